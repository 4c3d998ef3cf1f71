//! Mistakes of writing: TOML, names, types, lengths, expressions.

use super::{GOOD, check, errors};

#[test]
fn toml_names_and_types() {
    check(&[
        ("spacing = 0.25", "▶spcing = 0.25\nspacing = 0.25", "unknown key `spcing`", "did you mean `spacing`?"),
        ("dimension = 2", "dimension = 2\n▶dimention = 2", "unknown key `dimention`", "`dimension`?"),
        ("smoothing = 1.2", "smoothing = ▶\"wide\"", "expected a number, found the text \"wide\"", "write a number"),
        ("gravity = [0.0, -9.81]", "gravity = ▶-9.81", "expected a list", "square brackets"),
        ("gravity = [0.0, -9.81]", "gravity = [0.0, ▶\"-9.81\"]", "in quotes has no unit", "remove the quotes"),
        ("velocity = [\"0\", \"-1\"]", "velocity = [▶true, 0]", "a number or an expression", "in quotes"),
        ("name = \"tip\"", "name = ▶3", "expected a text in quotes", "a text in quotes"),
        ("max_iterations = 25", "max_iterations = ▶-3", "whole number, not negative", "not negative"),
        ("max_iterations = 25", "max_iterations = ▶2.5", "whole number", "whole number"),
        ("counts = [4, 5]", "counts = [4, ▶-5]", "whole number", "not negative"),
        ("title = \"good\"", "title = ▶good", "not TOML", "texts in quotes"),
        ("[time]", "[time▶\n", "not TOML", "key = value"),
        ("end = 1.0", "end = 1.0\n▶end = 2.0", "given twice", "remove one"),
        ("end = 1.0", "end = ▶1e999", "too large", "1.7e308"),
        ("kernel = \"cubic_spline\"", "kernel = ▶\"cubic\"", "`cubic` is not one of the choices", "`cubic_spline`?"),
        ("scheme = \"crank_nicolson\"", "scheme = ▶\"crank_nicholson\"", "`crank_nicholson`", "`crank_nicolson`?"),
        ("face = \"upper_x\"", "face = ▶\"upperx\"", "`upperx` is not", "did you mean `upper_x`?"),
        ("fix = [\"x\"]", "fix = [▶\"horizontal\"]", "not one of the choices", "x, y, z"),
        ("material.linear_volumetric", "material.▶jelly", "`jelly`", "linear_volumetric, hyper"),
        ("volumetric = { density = 1000.0, gamma", "volumetric = ▶{ gamma", "`density` is missing", "kg/m³"),
        (
            "select.where = \"Y > 2.4\"",
            "select = ▶{ box = { lower = [0, 0], upper = [1, 1] }, where = \"1\" }",
            "more than one",
            "exactly one",
        ),
        ("select.where = \"Y > 2.4\"", "select = ▶\"where\"", "a table with its values", "a table"),
        ("select.where = \"Y > 2.4\"", "select = ▶3", "a name or a table", "in quotes"),
    ]);
}

#[test]
fn dimensions_and_lengths() {
    check(&[
        ("gravity = [0.0, -9.81]", "gravity = ▶[0.0, -9.81, 0.0]", "3 component(s) in a 2-dimensional", "give 2"),
        ("velocity = [\"0\", \"-1\"]", "velocity = ▶[\"0\"]", "`velocity` has 1 component", "give 2"),
        ("displacement = [\"0\", \"0.001*Y\"]", "displacement = ▶[0, 0, 0]", "exact displacement", "one per direction"),
        ("counts = [4, 5]", "counts = ▶[4]", "`counts` has 1", "give 2"),
        ("at = [2.5, 2.5]", "at = ▶[2.5]", "`at` has 1", "give 2"),
        ("normal = [0.0, -1.0]", "normal = ▶[0.0, -1.0, 0.0]", "`normal` has 3", "give 2"),
        ("fix = [\"x\"]", "fix = [\"x\", ▶\"z\"]", "no direction z in a 2-dimensional", "use x, y"),
        ("displacement = { y = \"0.1*sin(t)\" }", "displacement = { z = ▶0 }", "no direction z", "use x, y"),
        ("face = \"upper_x\"", "face = ▶\"upper_z\"", "no such face", "lower_x, upper_x, lower_y, upper_y"),
        ("pressure = \"1000*t\"", "pressure = ▶\"1000*Z\"", "`Z` does not exist in a 2-dimensional", "use X, Y"),
    ]);
    let found = errors(&GOOD.replace("dimension = 2", "dimension = 4"));
    assert_eq!((found[0].line, found[0].column, found.len()), (Some(2), Some(13), 1));
    assert!(found[0].message.contains("`dimension` is 4") && found[0].remedy.contains("1, 2 or 3"));
}

#[test]
fn expressions() {
    const FIELD: &str = "velocity = [\"0\", \"-1\"]";
    check(&[
        (FIELD, "velocity = [0, \"1 + ▶sine(X)\"]", "unknown function `sine`", "did you mean `sin(…)`?"),
        (FIELD, "velocity = [0, \"2*▶x\"]", "unknown name `x`", "use `X`"),
        (FIELD, "velocity = [0, \"2*▶speed\"]", "unknown name `speed`", "X, Y, Z, t and pi"),
        (FIELD, "velocity = [0, \"sin▶(X\"]", "never closed", "missing `)`"),
        (FIELD, "velocity = [0, \"sin(X)▶)\"]", "closes nothing", "remove"),
        (FIELD, "velocity = [0, \"2▶X\"]", "operator is missing", "2*X"),
        (FIELD, "velocity = [0, '0▶,5']", "`,` outside a call", "point"),
        (FIELD, "velocity = [0, \"0 < X ▶< 1\"]", "cannot be chained", "&&"),
        (FIELD, "velocity = [0, \"X ▶= 1\"]", "`=` means nothing", "`==`"),
        (FIELD, "velocity = [0, \"X▶**2\"]", "`**` is not an operator", "X^2"),
        (FIELD, "velocity = [0, \"X▶²\"]", "`²` means nothing", "X^2"),
        (FIELD, "velocity = [0, \"▶sin(X, 1)\"]", "takes 1 argument, not 2", "write `sin(X)`"),
        (FIELD, "velocity = [0, \"▶if(X, 1)\"]", "takes 3 arguments, not 2", "if(condition"),
        (FIELD, "velocity = [0, \"▶min(1)\"]", "2 or more arguments, not 1", "min(X, 1)"),
        (FIELD, "velocity = [0, \"1 +▶\"]", "ends too early", "missing"),
        (FIELD, "velocity = [0, \"▶\"]", "is empty", "write a number"),
        (FIELD, "velocity = [0, \"▶pow(X, 2)\"]", "unknown function `pow`", "X^2"),
        (FIELD, "velocity = [0, \"3 + ▶1e999\"]", "too large", "1.7e308"),
    ]);
    let deep = format!("velocity = [0, \"{}X{}\"]", "(".repeat(1000), ")".repeat(1000));
    let found = errors(&GOOD.replace(FIELD, &deep));
    assert!(found.len() == 1 && found[0].message.contains("nested more than"), "{found:?}");
    let long = format!("velocity = [0, \"{}X\"]", "X + ".repeat(100_000));
    let found = errors(&GOOD.replace(FIELD, &long));
    assert!(found.len() == 1 && found[0].message.contains("400001 bytes long"), "{found:?}");
    assert!(found[0].to_string().len() < 1000, "{}", found[0]);
}

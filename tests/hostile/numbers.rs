//! Numbers that no computer holds, that are none, and texts that never end.

use super::{Place, on_scene, refused_scene, scene};

const SPACING: &str = "spacing = 0.25";
const BOX: &str = "shape.box = { lower = [0.0, 0.0], upper = [1.0, 1.0] }";

#[test]
fn counts_that_no_computer_holds() {
    for counts in [
        "counts = [1000000000000000000, 2]",
        "counts = [9223372036854775807, 9223372036854775807]",
        "counts = [4294967296, 4294967296]",
        "counts = [100000, 100000]",
        "spacing = 1e-9",
        "spacing = 1e-300",
        "spacing = 5e-324",
    ] {
        refused_scene(
            counts,
            scene(&[(SPACING, counts)]),
            &["scene.toml:6:", "particles", "help: give a larger spacing"],
        );
    }
    let shapes = [
        "shape.disc = { centre = [0, 0], radius = 1e9 }",
        "shape.ring = { centre = [0, 0], inner = 1e8, outer = 1e9 }",
        "shape.difference = [{ box = { lower = [0, 0], upper = [1e9, 1e9] } }, { disc = { centre = [0, 0], radius = 1 } }]",
        "shape.mapped_box = { lower = [0, 0], upper = [1e9, 1e9], map = [\"X\", \"Y\"] }",
    ];
    for shape in shapes {
        refused_scene(shape, scene(&[(BOX, shape)]), &["particles", "help: give a larger spacing"]);
    }
    // A mistake elsewhere does not make the particles all the same.
    let both = scene(&[(SPACING, "counts = [10000, 10000]"), ("gamma = 7.0", "gamma = 0.0")]);
    refused_scene("large, and with a mistake", both, &["gamma"]);
    refused_scene("too many for a word", scene(&[(SPACING, "counts = [99999999999999999999, 2]")]), &["help"]);
    refused_scene("a negative count", scene(&[(SPACING, "counts = [-1, 2]")]), &["help"]);
}

#[test]
fn settings_that_cannot_be_meant() {
    let step = "step = 0.01";
    for (change, words) in [
        ((step, "step = 1e-300"), &["scene.toml:16:", "lost in rounding", "larger step"][..]),
        (("plots = false", "interval = 1e-12"), &["frames", "longer interval"]),
        ((step, "step = 0.01\nminimum_step = -1"), &["minimum_step"]),
        (("end = 0.02", "end = -1"), &["`end` is -1"]),
    ] {
        refused_scene(change.1, scene(&[change]), words);
    }
    // What is larger than needed costs nothing.
    for setting in [
        "linear.restart=1000000000000000000",
        "linear.max_iterations=9223372036854775807",
        "newton.max_iterations=9223372036854775807",
        "newton.final_corrections=2",
        "time.minimum_step=5e-324",
        "body.0.smoothing=1.5",
        "checkpoint.keep=9223372036854775807",
    ] {
        for solver in ["linear.solver=gmres", "linear.solver=bicgstab"] {
            let place = Place::new();
            let answer = on_scene(&place, "run", &["--set", setting, "--set", solver]);
            assert_eq!((answer.code, answer.complained.as_str()), (0, ""), "{setting}");
        }
    }
}

#[test]
fn numbers_that_are_none() {
    let density = "density = 1000.0";
    for number in ["nan", "inf", "-inf", "+nan", "1e400", "-1e400", "0.0", "-0.0"] {
        for (key, old) in [("density", density), ("spacing", SPACING), ("wave_speed", "wave_speed = 10.0")] {
            let text = scene(&[(old, &format!("{key} = {number}"))]);
            refused_scene(&format!("{key} = {number}"), text, &["scene.toml:", key, "help"]);
        }
    }
    for field in ["nan", "inf", "1e400", "0/0", "1/0", "sqrt(-1)", "log(0)", "(1e308*10)", "exp(1000)", "X/0", "0^-1"] {
        let text = format!("{}\n[initial]\nvelocity = [\"{field}\", 0]\n", super::SCENE);
        refused_scene(field, text, &["scene.toml:22:", "help"]);
    }
    for lower in ["[nan, 0]", "[-inf, 0]", "[-1e308, 0]", "[1e308, 0]"] {
        let text = scene(&[("lower = [0.0, 0.0]", &format!("lower = {lower}"))]);
        refused_scene(lower, text, &["scene.toml:", "help"]);
    }
}

/// The smallest numbers there are: refused, or computed with, or a failure with its cause; no panic and no endless run.
#[test]
fn denormal_numbers_have_an_end() {
    for change in [
        (SPACING, "counts = [3, 3]"),
        ("density = 1000.0", "density = 5e-324"),
        ("density = 1000.0", "density = 1e-310"),
        ("wave_speed = 10.0", "wave_speed = 5e-324"),
        ("wave_speed = 10.0", "bulk_modulus = 5e-324"),
        ("upper = [1.0, 1.0]", "upper = [1e-310, 1e-310]"),
        ("gravity = [0.0, -9.81]", "gravity = [5e-324, -5e-324]"),
        ("density = 1000.0", "density = 1e308"),
        ("wave_speed = 10.0", "wave_speed = 1e160"),
        ("gamma = 7.0", "gamma = 1e300"),
        ("gravity = [0.0, -9.81]", "gravity = [0.0, -1e300]"),
    ] {
        let place = Place::new();
        place.file("scene.toml", scene(&[change, ("end = 0.02", "end = 0.01")]));
        if change.1.contains("upper") {
            place.file("scene.toml", scene(&[change, (SPACING, "counts = [3, 3]")]));
        }
        let answer = on_scene(&place, "run", &[]);
        assert!([0, 2, 3].contains(&answer.code), "{change:?}: {} {}", answer.code, answer.complained);
        assert!(answer.code == 0 || answer.complained.contains("error: "), "{change:?}: {}", answer.complained);
    }
}

#[test]
fn texts_nested_without_end() {
    let deep = |open: &str, close: &str| format!("{}1{}", open.repeat(100_000), close.repeat(100_000));
    for (case, text) in [
        ("lists", format!("a = {}", deep("[", "]"))),
        ("tables", format!("a = {}", deep("{a=", "}"))),
        ("an unclosed list", format!("a = {}", "[".repeat(100_000))),
        ("keys", format!("{}a = 1", "a.".repeat(100_000))),
        ("headers", format!("[{}a]\n", "a.".repeat(100_000))),
        ("shapes", scene(&[("box = {", &format!("{}box = {{", "union = [{".repeat(2000)))])),
    ] {
        refused_scene(case, text, &["scene.toml:", "help"]);
    }
    let expressions = [
        deep("(", ")"),
        deep("-", ""),
        deep("!", ""),
        deep("sin(", ")"),
        deep("2^", ""),
        "1+".repeat(100_000),
        format!("{}1", "1+".repeat(100_000)),
        format!("{}1", "X*".repeat(100_000)),
        format!("min({}1)", "1,".repeat(100_000)),
        "9".repeat(100_000),
        "a".repeat(100_000),
    ];
    for text in &expressions {
        let case = &text[..20];
        let place = Place::new();
        place.file("scene.toml", scene(&[("select.where = \"Y < 1e-9\"", &format!("select.where = \"{text}\""))]));
        super::refused(&place, case, &on_scene(&place, "check", &[]), &["scene.toml:", "help"]);
        let set = format!("boundary.0.select.where={}", &text[..text.len().min(100_000)]);
        super::refused(&place, case, &on_scene(&place, "check", &["--set", &set]), &["help"]);
    }
}

#[test]
fn overrides_made_to_break_things() {
    let place = Place::new();
    let deep = format!("time.step={}", "[".repeat(50_000));
    let keys = format!("{}=1", "a.".repeat(50_000));
    for set in [
        "",
        "=",
        "=1",
        ".=1",
        "a..b=1",
        "body.99999999999999999999.spacing=1",
        "body.18446744073709551615.spacing=1",
        "body.-1.spacing=1",
        "time=",
        "time.step=\n",
        "time.step=[",
        &deep,
        &keys,
    ] {
        let answer = on_scene(&place, "check", &["--set", set]);
        super::refused(&place, &set[..set.len().min(40)], &answer, &[]);
    }
}

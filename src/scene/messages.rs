//! What `toml` and `serde` say, in the words of a scene.

use super::document::REMEDY;
use crate::expression::closest;

/// Message and remedy for a mistake that `toml` found.
pub(super) fn explain(message: &str) -> (String, String) {
    let message = message.lines().next().unwrap_or_default();
    if let Some((message, remedy)) = message.split_once(REMEDY) {
        return (message.to_owned(), remedy.to_owned());
    }
    if let Some(rest) = message.strip_prefix("unknown field ") {
        let (name, known) = names(rest);
        return (format!("unknown key `{name}`"), choices(&name, &known, "keys here"));
    }
    if let Some(rest) = message.strip_prefix("unknown variant ") {
        let (name, known) = names(rest);
        return (format!("`{name}` is not one of the choices"), choices(&name, &known, "choices"));
    }
    if let Some(rest) = message.strip_prefix("missing field ") {
        let (name, _) = names(rest);
        return (format!("the key `{name}` is missing here"), format!("add {}", example(&name)));
    }
    for prefix in ["invalid type: ", "invalid value: "] {
        if let Some((found, wanted)) = message.strip_prefix(prefix).and_then(|rest| rest.rsplit_once(", expected ")) {
            let wanted = wanted_words(wanted);
            return (format!("expected {wanted}, found {}", found_words(found)), format!("write {wanted}"));
        }
    }
    match message {
        "wanted exactly 1 element, found 0 elements" => {
            ("nothing is chosen here".to_owned(), "give exactly one key".to_owned())
        }
        "wanted exactly 1 element, more than 1 element" => {
            ("more than one choice is made here".to_owned(), "give exactly one key".to_owned())
        }
        "wanted string or table" => {
            ("expected a name or a table".to_owned(), "write a name in quotes, or a table".to_owned())
        }
        "floating-point number overflowed" | "integer number overflowed" => {
            ("the number is too large".to_owned(), "numbers go up to 1.7e308".to_owned())
        }
        _ if message.contains("duplicate key") => {
            ("the key is given twice".to_owned(), "remove one of the two".to_owned())
        }
        _ if message.contains("recurs") => {
            ("the nesting is too deep".to_owned(), "use fewer levels of lists and tables".to_owned())
        }
        _ => (
            format!("this is not TOML: {message}"),
            "write `key = value`, texts in quotes, tables as `[table]` or `[[table]]`, comments after `#`".to_owned(),
        ),
    }
}

/// The first name in backticks, and the others.
fn names(message: &str) -> (String, Vec<String>) {
    let mut names = message.split('`').skip(1).step_by(2).map(str::to_owned);
    // A wrong name may itself hold backticks: what follows ", expected" is the list.
    if let Some((wrong, known)) = message.rsplit_once(", expected") {
        let wrong = wrong.trim().trim_start_matches('`').trim_end_matches('`').to_owned();
        return (wrong, known.split('`').skip(1).step_by(2).map(str::to_owned).collect());
    }
    (names.next().unwrap_or_default(), names.collect())
}

fn choices(name: &str, known: &[String], what: &str) -> String {
    if known.is_empty() {
        return "remove it".to_owned();
    }
    let guess = closest(name, known.iter().map(String::as_str));
    let guess = guess.map(|guess| format!("did you mean `{guess}`? ")).unwrap_or_default();
    format!("{guess}the {what} are {}", known.join(", "))
}

fn wanted_words(wanted: &str) -> String {
    match wanted {
        "f64" => "a number",
        "u64" | "usize" => "a whole number, not negative",
        "a sequence" => "a list in square brackets",
        "a string" | "a borrowed string" => "a text in quotes",
        "a boolean" => "true or false",
        "newtype variant" => "a table with its values",
        "unit variant" => "a name in quotes",
        other => other,
    }
    .to_owned()
}

fn found_words(found: &str) -> String {
    match found {
        "map" => "a table".to_owned(),
        "sequence" => "a list".to_owned(),
        "unit variant" => "a name alone".to_owned(),
        "newtype variant" => "a table".to_owned(),
        other => {
            let other = other.replacen("floating point ", "the number ", 1).replacen("integer ", "the number ", 1);
            other.replacen("string ", "the text ", 1).replacen("boolean ", "", 1)
        }
    }
}

/// How a required key is written.
fn example(name: &str) -> String {
    match name {
        "dimension" => "`dimension = 2` (1, 2 or 3)",
        "end" => "`end = 1.0`, the time at which the computation ends in seconds",
        "density" => "`density = 1000.0`, in kg/m³",
        "gamma" => "`gamma = 7.0`, at least 1",
        "material" => "`material.linear_volumetric = { density = 1000.0, bulk_modulus = 1e6 }` or another material",
        "select" => "`select = \"all\"`, `select.face`, `select.box`, `select.half_space` or `select.where`",
        "face" => "`face = \"upper_x\"` or another side",
        "value" => "`value = [\"1e4*sin(t)\", 0]`, one entry per direction, in Pa",
        "name" => "`name = \"tip\"`",
        "at" => "`at = [10.0]`, one number per direction",
        "lower" => "`lower = [0.0, 0.0]`, one number per direction",
        "upper" => "`upper = [1.0, 1.0]`, one number per direction",
        "map" => "`map = [\"X*(1 + Y)\", \"Y\"]`, one field of X, Y, Z per direction",
        "centre" => "`centre = [0.0, 0.0]`, in the plane",
        "outer" => "`outer = 1.0`, a radius in metres",
        "amount" => "`amount = 0.2`, in spacings",
        "file" => "`file = \"cloud.csv\"`",
        "spacing" => "`spacing = 0.1`, in metres",
        "level" => "`level = 2.5`, in metres against gravity",
        "tolerance" => "`tolerance = 1e-4`",
        "point" => "`point = [0.0, 0.0]`",
        "normal" => "`normal = [0.0, -1.0]`, pointing into the half-space",
        other => return format!("`{other} = …`"),
    }
    .to_owned()
}

#[cfg(test)]
mod tests {
    use super::explain;

    #[test]
    fn serde_is_translated() {
        let cases = [
            ("unknown field `spcing`, expected one of `spacing`, `counts`", "unknown key `spcing`", "`spacing`?"),
            ("unknown field `a`, there are no fields", "unknown key `a`", "remove"),
            ("unknown variant `rk5`, expected `rk4` or `rkc`", "`rk5` is not", "the choices are rk4, rkc"),
            ("missing field `end`", "`end` is missing", "add `end = 1.0`"),
            ("invalid type: string \"a, expected b\", expected f64", "expected a number, found the text", "a number"),
            ("invalid value: integer `-3`, expected u64", "a whole number", "not negative"),
            ("invalid type: map, expected a sequence", "found a table", "a list"),
            ("something else", "not TOML", "key = value"),
        ];
        for (message, phrase, remedy) in cases {
            let found = explain(message);
            assert!(found.0.contains(phrase) && found.1.contains(remedy), "{message}: {found:?}");
        }
    }
}

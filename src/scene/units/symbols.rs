//! Symbols of units and their prefixes.

use super::{Dimension, Unit, UnitError};
use crate::expression::closest;

/// Symbol, mantissa and decimal exponent of its factor to SI, what it measures, whether it takes prefixes.
type Symbol = (&'static str, f64, i32, Dimension, bool);

const LENGTH: Dimension = [1, 0, 0, 0];
const MASS: Dimension = [0, 1, 0, 0];
const TIME: Dimension = [0, 0, 1, 0];
const ANGLE: Dimension = [0, 0, 0, 1];
const FORCE: Dimension = [1, 1, -2, 0];
const PRESSURE: Dimension = [-1, 1, -2, 0];

/// Exact by definition, except `psi`, `ksi`, `slug` and `rad`, which are rounded to the nearest double.
const SYMBOLS: [Symbol; 26] = [
    ("m", 1.0, 0, LENGTH, true),
    ("g", 1.0, -3, MASS, true),
    ("s", 1.0, 0, TIME, true),
    ("N", 1.0, 0, FORCE, true),
    ("Pa", 1.0, 0, PRESSURE, true),
    ("J", 1.0, 0, [2, 1, -2, 0], true),
    ("W", 1.0, 0, [2, 1, -3, 0], true),
    ("Hz", 1.0, 0, [0, 0, -1, 0], true),
    ("bar", 1.0, 5, PRESSURE, true),
    ("P", 1.0, -1, [-1, 1, -1, 0], true),
    ("tonne", 1.0, 3, MASS, false),
    ("min", 60.0, 0, TIME, false),
    ("h", 3600.0, 0, TIME, false),
    ("deg", 1.0, 0, ANGLE, false),
    ("°", 1.0, 0, ANGLE, false),
    ("rad", 180.0 / std::f64::consts::PI, 0, ANGLE, true),
    ("gn", 980_665.0, -5, [1, 0, -2, 0], false),
    ("in", 254.0, -4, LENGTH, false),
    ("ft", 3048.0, -4, LENGTH, false),
    ("lb", 45_359_237.0, -8, MASS, false),
    ("slug", 14.593_902_937_206_364, 0, MASS, false),
    ("lbf", 44_482_216_152_605.0, -13, FORCE, false),
    ("psi", 6_894.757_293_168_361, 0, PRESSURE, false),
    ("ksi", 6_894.757_293_168_361, 3, PRESSURE, false),
    ("atm", 101_325.0, 0, PRESSURE, false),
    ("kip", 44_482_216_152_605.0, -10, FORCE, false),
];

/// `µ` has two code points, and a third spelling.
const PREFIXES: [(&str, i32); 16] = [
    ("T", 12),
    ("G", 9),
    ("M", 6),
    ("k", 3),
    ("h", 2),
    ("da", 1),
    ("d", -1),
    ("c", -2),
    ("m", -3),
    ("u", -6),
    ("µ", -6),
    ("μ", -6),
    ("n", -9),
    ("p", -12),
    ("f", -15),
    ("a", -18),
];

/// The unit of a symbol with or without a prefix. A symbol wins over a prefix: `min` is a minute.
pub(super) fn find(name: &str) -> Result<Unit, UnitError> {
    if let Some(unit) = of(name, 0) {
        return Ok(unit);
    }
    for (prefix, power) in PREFIXES {
        if let Some(unit) = name.strip_prefix(prefix).filter(|rest| takes_prefix(rest)).and_then(|rest| of(rest, power))
        {
            return Ok(unit);
        }
    }
    let common = ["mm", "cm", "km", "kg", "ms", "kN", "MN", "kPa", "MPa", "GPa", "kJ"];
    let guess = match name {
        "t" => Some("tonne"),
        "sec" | "second" | "seconds" => Some("s"),
        "inch" => Some("in"),
        "kilogram" => Some("kg"),
        "metre" | "meter" | "metres" | "meters" => Some("m"),
        "degree" | "degrees" => Some("deg"),
        "Pas" => Some("Pa*s"),
        // The size of a letter is the commonest mistake: `Mpa`, `gpa`, `KG`, `hz`.
        _ => closest(name, common.into_iter().chain(SYMBOLS.map(|symbol| symbol.0)).filter(|_| name.len() > 1)),
    };
    let guess = guess.map(|guess| format!("did you mean `{guess}`? ")).unwrap_or_default();
    let symbols: Vec<&str> = SYMBOLS.iter().map(|symbol| symbol.0).collect();
    Err(UnitError::new(
        format!("unknown unit `{name}`"),
        format!("{guess}units are {}, the first ten and rad with a prefix such as k, m or M", symbols.join(" ")),
    ))
}

fn takes_prefix(name: &str) -> bool {
    SYMBOLS.iter().any(|symbol| symbol.0 == name && symbol.4)
}

fn of(name: &str, power: i32) -> Option<Unit> {
    let (_, mantissa, exponent, dimension, _) = *SYMBOLS.iter().find(|symbol| symbol.0 == name)?;
    Some(Unit { numerator: mantissa, denominator: 1.0, exponent: exponent + power, dimension })
}

//! What keys of a scene measure.

use super::Dimension;

/// What a key measures.
pub(in crate::scene) trait Kind {
    /// With its article, as in messages: `a length`.
    const NAME: &'static str;
    /// Unit of plain numbers.
    const UNIT: &'static str;
    /// How a quantity of it may be written.
    const EXAMPLE: &'static str;
    /// Powers of length, mass, time, angle.
    const DIMENSION: Dimension;
    /// Whether plain numbers are in the units of the scene, rather than in SI units whatever those are.
    const IN_SCENE_UNITS: bool = true;
}

macro_rules! kinds {
    ($($name:ident, $words:literal, $unit:literal, $example:literal, $dimension:expr;)*) => {
        $(
            #[doc = concat!("Marks ", $words, ".")]
            #[derive(Debug, Clone, Copy, PartialEq)]
            pub(in crate::scene) struct $name;

            impl Kind for $name {
                const NAME: &'static str = $words;
                const UNIT: &'static str = $unit;
                const EXAMPLE: &'static str = $example;
                const DIMENSION: Dimension = $dimension;
            }
        )*

        /// Names by dimension, to say what was given instead.
        const NAMES: &[(&str, Dimension)] = &[
            $(($words, $dimension),)*
            ("a mass", [0, 1, 0, 0]),
            ("a force", [1, 1, -2, 0]),
            ("an energy", [2, 1, -2, 0]),
            ("a power", [2, 1, -3, 0]),
            ("a frequency", [0, 0, -1, 0]),
            ("an area", [2, 0, 0, 0]),
            ("a volume", [3, 0, 0, 0]),
            ("a number without a unit", [0; 4]),
        ];
    };
}

kinds! {
    Length, "a length", "m", "5 mm", [1, 0, 0, 0];
    Time, "a time", "s", "0.2 ms", [0, 0, 1, 0];
    Velocity, "a velocity", "m/s", "36 km/h", [1, 0, -1, 0];
    Acceleration, "an acceleration", "m/s²", "9.81 m/s^2", [1, 0, -2, 0];
    Density, "a density", "kg/m³", "7850 kg/m^3", [-3, 1, 0, 0];
    Pressure, "a pressure", "Pa", "210 GPa", [-1, 1, -2, 0];
    Viscosity, "a viscosity", "Pa s", "1 kPa*s", [-1, 1, -1, 0];
    Angle, "an angle", "degrees", "30 deg", [0, 0, 0, 1];
}

/// Marks a time on the clock on the wall, which is no part of what is computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene) struct WallTime;

impl Kind for WallTime {
    const NAME: &'static str = "a wall-clock time";
    const UNIT: &'static str = "s";
    const EXAMPLE: &'static str = "30 min";
    const DIMENSION: Dimension = Time::DIMENSION;
    const IN_SCENE_UNITS: bool = false;
}

/// What has such a dimension.
pub(in crate::scene) fn describe(dimension: Dimension) -> String {
    if let Some((name, _)) = NAMES.iter().find(|(_, known)| *known == dimension) {
        return (*name).to_owned();
    }
    let parts: Vec<String> = ["m", "kg", "s", "deg"]
        .iter()
        .zip(dimension)
        .filter(|(_, power)| *power != 0)
        .map(|(unit, power)| if power == 1 { (*unit).to_owned() } else { format!("{unit}^{power}") })
        .collect();
    format!("a quantity in {}", parts.join("*"))
}

/// What to write for a kind.
pub(in crate::scene) fn wanted<K: Kind>() -> String {
    format!("a number in {}, or {} such as \"{}\"", K::UNIT, K::NAME, K::EXAMPLE)
}

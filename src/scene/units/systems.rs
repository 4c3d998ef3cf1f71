//! Systems of units that a scene may declare with `units`, for its plain numbers and expressions.

use std::cell::Cell;

use serde::Deserialize;

use super::{Dimension, Unit, symbols};

/// Units of plain numbers. Quantities in quotes have their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
pub(in crate::scene) enum UnitSystem {
    /// Metre, kilogram, second; N, Pa, kg/m³.
    #[default]
    #[serde(rename = "m-kg-s")]
    MetreKilogramSecond,
    /// Millimetre, tonne, second; N, MPa, tonne/mm³ (steel: 7.85e-9). Usual with Abaqus and LS-DYNA.
    #[serde(rename = "mm-tonne-s")]
    MillimetreTonneSecond,
    /// Millimetre, kilogram, millisecond; kN, GPa, kg/mm³ (steel: 7.85e-6). Usual with LS-DYNA.
    #[serde(rename = "mm-kg-ms")]
    MillimetreKilogramMillisecond,
    /// Millimetre, gram, millisecond; N, MPa, g/mm³ (steel: 7.85e-3).
    #[serde(rename = "mm-g-ms")]
    MillimetreGramMillisecond,
    /// Centimetre, gram, microsecond; Mbar, g/cm³ (steel: 7.85).
    #[serde(rename = "cm-g-us")]
    CentimetreGramMicrosecond,
}

impl UnitSystem {
    /// Symbols of its lengths, masses and times.
    fn symbols(self) -> [&'static str; 3] {
        match self {
            Self::MetreKilogramSecond => ["m", "kg", "s"],
            Self::MillimetreTonneSecond => ["mm", "tonne", "s"],
            Self::MillimetreKilogramMillisecond => ["mm", "kg", "ms"],
            Self::MillimetreGramMillisecond => ["mm", "g", "ms"],
            Self::CentimetreGramMicrosecond => ["cm", "g", "us"],
        }
    }

    /// The unit of a dimension. Angles are in degrees in all systems.
    fn unit(self, dimension: Dimension) -> Unit {
        let parts = self.symbols().into_iter().zip(dimension);
        parts.fold(Unit::ONE, |unit, (symbol, power)| {
            unit.times(symbols::find(symbol).unwrap_or(Unit::ONE).to_the(power))
        })
    }

    /// So many units of a dimension, in SI.
    pub fn in_si(self, value: f64, dimension: Dimension) -> f64 {
        if self == Self::default() { value } else { self.unit(dimension).in_si(value) }
    }

    /// Its unit of length, m.
    pub fn length(self) -> f64 {
        self.in_si(1.0, [1, 0, 0, 0])
    }

    /// Its unit of time, s.
    pub fn time(self) -> f64 {
        self.in_si(1.0, [0, 0, 1, 0])
    }
}

thread_local! {
    /// The system of the scene that is being deserialised on this thread: derived implementations take no seed,
    /// and one that every number reads by itself cannot be forgotten for a key.
    static CURRENT: Cell<UnitSystem> = const { Cell::new(UnitSystem::MetreKilogramSecond) };
}

/// Calls `read` with a system for its plain numbers.
pub(in crate::scene) fn within<T>(system: UnitSystem, read: impl FnOnce() -> T) -> T {
    let before = CURRENT.replace(system);
    let result = read();
    CURRENT.set(before);
    result
}

/// The system in force.
pub(in crate::scene) fn current() -> UnitSystem {
    CURRENT.get()
}

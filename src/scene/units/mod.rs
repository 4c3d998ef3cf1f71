//! Quantities with units, written as text: `"210 GPa"`, `"5 mm"`, `"1 kPa*s"`, `"9.81 m/s^2"`.
//!
//! A quantity is a decimal number and a unit. Units are products and quotients, from left to right, of symbols with
//! an SI prefix and a power: `kg/m^3`, `kg/m³`, `N*s/m^2`, `J/(kg*m)`. Decimal prefixes only move the exponent of the
//! number: `"5 mm"` has the very bits of `0.005`. Degrees, not radians, are the unit of angles here, because they are
//! that of the one key that takes an angle.
//!
//! Not here: temperatures, currents, anything with an offset.

mod kinds;
mod symbols;
mod systems;

pub(super) use kinds::{
    Acceleration, Angle, Density, Kind, Length, Pressure, Time, Velocity, Viscosity, WallTime, describe, wanted,
};
pub(super) use systems::{UnitSystem, current, within};

/// Powers of length, mass, time and angle.
pub(super) type Dimension = [i32; 4];

/// A factor to SI, `numerator / denominator · 10^exponent`, and what it measures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unit {
    numerator: f64,
    denominator: f64,
    exponent: i32,
    pub dimension: Dimension,
}

/// What is wrong with a quantity, and what to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct UnitError {
    pub message: String,
    pub remedy: String,
}

impl UnitError {
    fn new(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { message: message.into(), remedy: remedy.into() }
    }
}

/// Largest power of a unit.
const LARGEST_POWER: u32 = 9;
/// Longest text of a quantity, bytes.
const LONGEST: usize = 200;
/// Deepest nesting of parentheses.
const DEEPEST: usize = 8;

impl Unit {
    const ONE: Self = Self { numerator: 1.0, denominator: 1.0, exponent: 0, dimension: [0; 4] };

    fn times(self, other: Self) -> Self {
        Self {
            numerator: self.numerator * other.numerator,
            denominator: self.denominator * other.denominator,
            exponent: self.exponent.saturating_add(other.exponent),
            dimension: std::array::from_fn(|i| self.dimension[i].saturating_add(other.dimension[i])),
        }
    }

    fn to_the(self, power: i32) -> Self {
        let (up, down) =
            if power < 0 { (self.denominator, self.numerator) } else { (self.numerator, self.denominator) };
        Self {
            numerator: up.powi(power.abs()),
            denominator: down.powi(power.abs()),
            exponent: self.exponent.saturating_mul(power),
            dimension: self.dimension.map(|part| part.saturating_mul(power)),
        }
    }

    /// So many of this unit, in SI: rounded once if the unit is a power of ten.
    pub fn in_si(&self, value: f64) -> f64 {
        if *self == (Self { dimension: self.dimension, ..Self::ONE }) || !value.is_finite() {
            return value;
        }
        self.decimal(&format!("{value:e}"))
    }

    /// The same of a number as it is written.
    fn decimal(&self, number: &str) -> f64 {
        if self.numerator == 1.0 && self.denominator == 1.0 {
            return shifted(number, self.exponent);
        }
        // The factor before the power of ten: most are whole numbers.
        let value = shifted(number, 0) * self.numerator / self.denominator;
        if value.is_finite() { shifted(&format!("{value:e}"), self.exponent) } else { value }
    }
}

/// A decimal number times a power of ten.
fn shifted(number: &str, exponent: i32) -> f64 {
    let (digits, power) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    // A power that is no machine word is as good as an infinite one.
    let power = power.parse::<i32>().unwrap_or(if power.starts_with('-') { -99_999 } else { 99_999 });
    format!("{digits}e{}", power.saturating_add(exponent)).parse().unwrap_or(f64::NAN)
}

/// Whether a text is meant as a quantity rather than as an expression: a number, and then a name that is none of
/// an expression.
pub(super) fn is_quantity(text: &str, is_of_expressions: impl Fn(&str) -> bool) -> bool {
    let Some((_, rest)) = number(text.trim()) else { return false };
    let length = rest.find(|letter: char| !(letter.is_alphanumeric() || letter == '_' || letter == '°'));
    let name = &rest[..length.unwrap_or(rest.len())];
    !name.is_empty() && !name.starts_with(|letter: char| letter.is_ascii_digit()) && !is_of_expressions(name)
}

/// Reads a quantity: its value in SI, and what it measures.
pub(super) fn read(text: &str) -> Result<(f64, Dimension), UnitError> {
    if text.len() > LONGEST {
        return Err(UnitError::new("the quantity is too long", "write a number and a unit, such as `5 mm`"));
    }
    let Some((value, rest)) = number(text.trim()) else {
        return Err(UnitError::new(
            format!("`{}` does not begin with a number", text.escape_debug()),
            "write a number and a unit, such as `5 mm`, or a number without quotes",
        ));
    };
    if rest.is_empty() {
        return Err(UnitError::new(
            format!("`{value}` in quotes has no unit"),
            "remove the quotes, or add a unit, such as `5 mm`",
        ));
    }
    let mut reader = Reader { rest, depth: 0 };
    let unit = reader.product()?;
    if let Some(letter) = reader.rest.chars().next() {
        return Err(reader.stray(letter));
    }
    let found = unit.decimal(value);
    if !found.is_finite() {
        return Err(UnitError::new("the number is too large", "numbers go up to 1.7e308 in SI units"));
    }
    Ok((found, unit.dimension))
}

/// The number at the beginning of a text, and what follows it.
fn number(text: &str) -> Option<(&str, &str)> {
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let sign = usize::from(text.starts_with(['+', '-']));
    let mut length = sign + digits(sign);
    let mut any = length > sign;
    if bytes.get(length) == Some(&b'.') {
        let fraction = digits(length + 1);
        any |= fraction > 0;
        length += 1 + fraction;
    }
    if !any {
        return None;
    }
    if matches!(bytes.get(length), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(length + 1), Some(b'+' | b'-')));
        let power = bytes.get(length + 1 + sign..).map_or(0, |_| digits(length + 1 + sign));
        if power > 0 {
            length += 1 + sign + power;
        }
    }
    Some((&text[..length], text[length..].trim_start()))
}

struct Reader<'t> {
    rest: &'t str,
    depth: usize,
}

impl Reader<'_> {
    fn product(&mut self) -> Result<Unit, UnitError> {
        let mut unit = self.factor()?;
        loop {
            self.rest = self.rest.trim_start();
            let power = match self.rest.chars().next() {
                Some('*' | '·' | '×') => 1,
                Some('/') => -1,
                _ => return Ok(unit),
            };
            self.skip();
            unit = unit.times(self.factor()?.to_the(power));
        }
    }

    fn factor(&mut self) -> Result<Unit, UnitError> {
        self.rest = self.rest.trim_start();
        let unit = match self.rest.chars().next() {
            None => return Err(UnitError::new("the unit ends too early", "complete it, as in `m/s^2`")),
            Some('(') => {
                self.depth += 1;
                if self.depth > DEEPEST {
                    return Err(UnitError::new("the unit is nested too deep", "use fewer parentheses"));
                }
                self.skip();
                let inside = self.product()?;
                if !self.rest.starts_with(')') {
                    return Err(UnitError::new("a parenthesis of the unit is never closed", "add the missing `)`"));
                }
                self.skip();
                self.depth -= 1;
                inside
            }
            Some('1') => {
                self.skip();
                Unit::ONE
            }
            Some(letter) => {
                let length = self.rest.find(|letter: char| !(letter.is_alphabetic() || letter == '°' || letter == '_'));
                let (name, rest) = self.rest.split_at(length.unwrap_or(self.rest.len()));
                if name.is_empty() {
                    return Err(self.stray(letter));
                }
                self.rest = rest;
                symbols::find(name)?
            }
        };
        Ok(unit.to_the(self.power()?))
    }

    /// `^2`, `^-1`, `²`, or nothing.
    fn power(&mut self) -> Result<i32, UnitError> {
        let power = match self.rest.chars().next() {
            Some('²') => 2,
            Some('³') => 3,
            Some('^') => {
                self.skip();
                let length = self.rest.find(|letter: char| !(letter.is_ascii_digit() || letter == '-'));
                let (power, rest) = self.rest.split_at(length.unwrap_or(self.rest.len()));
                self.rest = rest;
                let power = power.parse::<i32>().ok().filter(|power| power.unsigned_abs() <= LARGEST_POWER);
                let wrong = || UnitError::new("this is not a power of a unit", "write a whole number, as in `m/s^2`");
                return power.ok_or_else(wrong);
            }
            _ => return Ok(1),
        };
        self.skip();
        Ok(power)
    }

    fn skip(&mut self) {
        self.rest = self.rest.chars().next().map_or("", |letter| &self.rest[letter.len_utf8()..]);
    }

    fn stray(&self, letter: char) -> UnitError {
        let message = format!("`{}` means nothing in a unit", letter.escape_debug());
        let remedy = if letter.is_alphabetic() {
            "write `*` between units, as in `Pa*s`"
        } else {
            "units are like `kg/m^3`, `N*s/m` or `J/(kg*m)`; a quantity cannot be part of an expression"
        };
        UnitError::new(message, remedy)
    }
}

#[cfg(test)]
mod tests;

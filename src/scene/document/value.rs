//! Values that occur in many places.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, Unexpected, Visitor};
use toml::Spanned;

/// A number.
pub(in crate::scene) type Number = Spanned<f64>;
/// A text.
pub(in crate::scene) type Text = Spanned<String>;
/// A list of numbers.
pub(in crate::scene) type Vector = Spanned<Vec<Spanned<f64>>>;
/// A list of fields.
pub(in crate::scene) type FieldList = Spanned<Vec<Spanned<Field>>>;

/// A number or the text of an expression.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::scene) enum Field {
    Number(f64),
    Text(String),
}

impl<'de> Deserialize<'de> for Field {
    // By hand: an untagged enum would lose the place of a mistake.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Read;

        impl Visitor<'_> for Read {
            type Value = Field;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("a number or an expression in quotes")
            }

            fn visit_f64<E: Error>(self, value: f64) -> Result<Field, E> {
                Ok(Field::Number(value))
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<Field, E> {
                Ok(Field::Number(value as f64))
            }

            fn visit_u64<E: Error>(self, value: u64) -> Result<Field, E> {
                Ok(Field::Number(value as f64))
            }

            fn visit_str<E: Error>(self, value: &str) -> Result<Field, E> {
                Ok(Field::Text(value.to_owned()))
            }
        }

        deserializer.deserialize_any(Read)
    }
}

/// Hourglass control: a coefficient, or off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene) enum HourglassText {
    Off,
    Coefficient(f64),
}

impl<'de> Deserialize<'de> for HourglassText {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Read;

        impl Visitor<'_> for Read {
            type Value = HourglassText;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("a coefficient, such as `hourglass = 2`, or `hourglass = \"none\"`")
            }

            fn visit_f64<E: Error>(self, value: f64) -> Result<HourglassText, E> {
                Ok(HourglassText::Coefficient(value))
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<HourglassText, E> {
                Ok(HourglassText::Coefficient(value as f64))
            }

            fn visit_u64<E: Error>(self, value: u64) -> Result<HourglassText, E> {
                Ok(HourglassText::Coefficient(value as f64))
            }

            fn visit_bool<E: Error>(self, value: bool) -> Result<HourglassText, E> {
                match value {
                    false => Ok(HourglassText::Off),
                    true => Err(E::invalid_type(Unexpected::Bool(value), &self)),
                }
            }

            fn visit_str<E: Error>(self, value: &str) -> Result<HourglassText, E> {
                match value {
                    "none" => Ok(HourglassText::Off),
                    _ => Err(E::invalid_value(Unexpected::Str(value), &self)),
                }
            }
        }

        deserializer.deserialize_any(Read)
    }
}

//! Values that occur in many places.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, Visitor};
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

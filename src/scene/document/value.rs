//! Values that occur in many places: located, with a unit, fields.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Range;

use serde::de::{Deserialize, Deserializer, Error, Unexpected, Visitor};

use crate::expression::is_name;
use crate::scene::units::{self, Dimension, Kind, UnitError};

/// A value and its place in the text.
#[derive(Debug, Clone)]
pub(in crate::scene) struct Spanned<T> {
    span: Range<usize>,
    value: T,
}

impl<T> Spanned<T> {
    /// Bytes of the text.
    pub fn span(&self) -> Range<usize> {
        self.span.clone()
    }

    /// The value.
    pub fn get_ref(&self) -> &T {
        &self.value
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Spanned<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        // A type of our own, because those of others cannot be given a schema.
        let found = toml::Spanned::<T>::deserialize(deserializer)?;
        Ok(Self { span: found.span(), value: found.into_inner() })
    }
}

/// A number without a unit.
pub(in crate::scene) type Number = Spanned<f64>;
/// A number that measures something.
pub(in crate::scene) type Measure<K> = Spanned<Quantity<K>>;
/// A text.
pub(in crate::scene) type Text = Spanned<String>;
/// A list of numbers without a unit.
pub(in crate::scene) type Direction = Spanned<Vec<Number>>;
/// A list of numbers that measure something.
pub(in crate::scene) type Vector<K> = Spanned<Vec<Measure<K>>>;
/// A list of fields.
pub(in crate::scene) type FieldList<K> = Spanned<Vec<Spanned<Field<K>>>>;

/// A number that checks can look at.
pub(in crate::scene) trait Scalar {
    /// In SI units.
    fn value(&self) -> f64;
    /// For messages: empty, or a blank and the unit.
    fn unit(&self) -> String;
}

impl Scalar for f64 {
    fn value(&self) -> f64 {
        *self
    }

    fn unit(&self) -> String {
        String::new()
    }
}

/// A number in SI units, written plainly in the units of the scene, or as a text with a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene) struct Quantity<K>(f64, PhantomData<K>);

impl<K: Kind> Scalar for Quantity<K> {
    fn value(&self) -> f64 {
        self.0
    }

    fn unit(&self) -> String {
        format!(" {}", K::UNIT)
    }
}

/// Between message and remedy where serde has room for one text only; see `messages`.
pub(in crate::scene) const REMEDY: char = '\u{1f}';

impl<K: Kind> Quantity<K> {
    /// A plain number, in the units of the scene.
    fn plain(value: f64) -> Self {
        let value = if K::IN_SCENE_UNITS { units::current().in_si(value, K::DIMENSION) } else { value };
        Self(value, PhantomData)
    }

    fn text<E: Error>(text: &str) -> Result<Self, E> {
        let told = |error: UnitError| E::custom(format!("{}{REMEDY}{}", error.message, error.remedy));
        let (value, dimension) = units::read(text).map_err(told)?;
        if dimension == K::DIMENSION {
            return Ok(Self(value, PhantomData));
        }
        let found = units::describe(dimension);
        let message = format!("`{}` is {found}, but {} is wanted here", text.trim().escape_debug(), K::NAME);
        Err(told(UnitError { message, remedy: format!("write {}", units::wanted::<K>()) }))
    }
}

impl<'de, K: Kind> Deserialize<'de> for Quantity<K> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Read<K>(PhantomData<K>);

        impl<K: Kind> Visitor<'_> for Read<K> {
            type Value = Quantity<K>;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str(&units::wanted::<K>())
            }

            fn visit_f64<E: Error>(self, value: f64) -> Result<Quantity<K>, E> {
                Ok(Quantity::plain(value))
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<Quantity<K>, E> {
                Ok(Quantity::plain(value as f64))
            }

            fn visit_u64<E: Error>(self, value: u64) -> Result<Quantity<K>, E> {
                Ok(Quantity::plain(value as f64))
            }

            fn visit_str<E: Error>(self, value: &str) -> Result<Quantity<K>, E> {
                // A text without any digit was not meant as a quantity.
                if value.contains(|letter: char| letter.is_ascii_digit()) {
                    return Quantity::text(value);
                }
                Err(E::invalid_type(Unexpected::Str(value), &self))
            }
        }

        deserializer.deserialize_any(Read(PhantomData))
    }
}

/// A number, a quantity, or the text of an expression.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::scene) enum Field<K> {
    Number(Quantity<K>),
    Text(String),
}

impl<K: Kind> Field<K> {
    /// What it measures.
    pub fn dimension(&self) -> Dimension {
        K::DIMENSION
    }
}

impl<'de, K: Kind> Deserialize<'de> for Field<K> {
    // By hand: an untagged enum would lose the place of a mistake.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Read<K>(PhantomData<K>);

        impl<K: Kind> Visitor<'_> for Read<K> {
            type Value = Field<K>;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(formatter, "a number or an expression in quotes, or {} such as \"{}\"", K::NAME, K::EXAMPLE)
            }

            fn visit_f64<E: Error>(self, value: f64) -> Result<Field<K>, E> {
                Ok(Field::Number(Quantity::plain(value)))
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<Field<K>, E> {
                Ok(Field::Number(Quantity::plain(value as f64)))
            }

            fn visit_u64<E: Error>(self, value: u64) -> Result<Field<K>, E> {
                Ok(Field::Number(Quantity::plain(value as f64)))
            }

            fn visit_str<E: Error>(self, value: &str) -> Result<Field<K>, E> {
                if units::is_quantity(value, is_name) {
                    return Quantity::text(value).map(Field::Number);
                }
                Ok(Field::Text(value.to_owned()))
            }
        }

        deserializer.deserialize_any(Read(PhantomData))
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

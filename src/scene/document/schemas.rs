//! JSON Schema of the values that are deserialised by hand. Only tests make the schema: it is stored.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};

use super::body::{LayoutText, LayoutsText};
use super::value::{Field, HourglassText, Quantity, Spanned};
use crate::scene::units::Kind;

impl<T: JsonSchema> JsonSchema for Spanned<T> {
    fn inline_schema() -> bool {
        T::inline_schema()
    }

    fn schema_name() -> Cow<'static, str> {
        T::schema_name()
    }

    fn schema_id() -> Cow<'static, str> {
        T::schema_id()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}

/// `a length` to `length`.
fn bare<K: Kind>() -> &'static str {
    K::NAME.split_once(' ').map_or(K::NAME, |(_, name)| name)
}

/// Begins with a number and goes on with a unit; what it measures is checked by the program.
const PATTERN: &str = "^\\s*[+-]?([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][+-]?[0-9]+)?\\s*[A-Za-zµμ°1(].*$";

impl<K: Kind> JsonSchema for Quantity<K> {
    fn schema_name() -> Cow<'static, str> {
        bare::<K>().into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": format!("{} in {}, or a text with a unit.", bare::<K>(), K::UNIT),
            "x-unit": K::UNIT,
            "examples": [K::EXAMPLE],
            "anyOf": [{ "type": "number" }, { "type": "string", "pattern": PATTERN }]
        })
    }
}

impl<K: Kind> JsonSchema for Field<K> {
    fn schema_name() -> Cow<'static, str> {
        format!("field of {}", bare::<K>()).into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": format!(
                "{} in {}: a number, a text with a unit, or an expression of X, Y, Z, t.", bare::<K>(), K::UNIT
            ),
            "x-unit": K::UNIT,
            "examples": [K::EXAMPLE, "2*sin(pi*t)*X"],
            "type": ["number", "string"]
        })
    }
}

impl JsonSchema for HourglassText {
    fn schema_name() -> Cow<'static, str> {
        "HourglassText".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A coefficient, or none.",
            "anyOf": [{ "type": "number", "minimum": 0 }, { "const": "none" }, { "const": false }]
        })
    }
}

impl JsonSchema for LayoutsText {
    fn schema_name() -> Cow<'static, str> {
        "LayoutsText".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let one = generator.subschema_for::<LayoutText>();
        json_schema!({
            "description": "One layout for all directions, or one for each.",
            "anyOf": [one, { "type": "array", "items": one }]
        })
    }
}

//! Tables of a study, taken apart into key paths and values with their places.

use toml_edit::{Item, TableLike, Value};

use crate::scene::findings::{Findings, Span};

/// A key path with its value.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    /// Key path with dots.
    pub key: String,
    /// The value.
    pub value: Value,
    /// Place of the key.
    pub key_span: Span,
    /// Place of the value.
    pub value_span: Span,
}

/// All values of a table, those of tables within it under their paths. A table in braces is a value.
pub(super) fn entries(table: &dyn TableLike, findings: &mut Findings<'_>) -> Vec<Entry> {
    let mut found = Vec::new();
    descend(table, "", findings, &mut found);
    found
}

fn descend(table: &dyn TableLike, prefix: &str, findings: &mut Findings<'_>, found: &mut Vec<Entry>) {
    for (name, item) in table.iter() {
        let key_span = table.key(name).and_then(toml_edit::Key::span).unwrap_or(0..0);
        let key = if prefix.is_empty() { name.to_owned() } else { format!("{prefix}.{name}") };
        match item {
            Item::Table(inner) => descend(inner, &key, findings, found),
            Item::Value(Value::InlineTable(inner)) if inner.is_dotted() => descend(inner, &key, findings, found),
            Item::Value(value) => {
                let value_span = value.span().unwrap_or_else(|| key_span.clone());
                found.push(Entry { key, value: value.clone(), key_span, value_span });
            }
            Item::ArrayOfTables(_) => {
                let remedy =
                    "give one value, or a list in square brackets; elements are named by index: `body.0.spacing`";
                findings.error(key_span, format!("`{key}` is a list of tables"), remedy);
            }
            Item::None => {}
        }
    }
}

/// A value as one line of TOML. `text` is the text that it was read from.
pub(super) fn line(value: &Value, text: &str) -> String {
    match value {
        Value::Array(list) => {
            let inner: Vec<String> = list.iter().map(|value| line(value, text)).collect();
            format!("[{}]", inner.join(", "))
        }
        Value::InlineTable(table) => {
            let inner: Vec<String> =
                table.iter().map(|(key, value)| format!("{} = {}", quoted(key), line(value, text))).collect();
            format!("{{ {} }}", inner.join(", "))
        }
        scalar => {
            let written =
                scalar.span().and_then(|span| text.get(span)).filter(|written| !written.contains(['\n', '\r']));
            match (written, scalar.as_str()) {
                (Some(written), _) => written.to_owned(),
                (None, Some(string)) => Value::from(string.replace(['\n', '\r'], " ")).to_string().trim().to_owned(),
                (None, None) => scalar.to_string().trim().to_owned(),
            }
        }
    }
}

fn quoted(key: &str) -> String {
    let is_bare = !key.is_empty() && key.chars().all(|letter| letter.is_ascii_alphanumeric() || "_-".contains(letter));
    if is_bare { key.to_owned() } else { format!("{key:?}") }
}

/// A number, whole or not.
pub(super) fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
}

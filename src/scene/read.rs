//! Text and overrides to a [`Document`].

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::document::Document;
use super::findings::{Findings, Span};
use super::messages::explain;
use super::overrides::Overrides;
use crate::expression::closest;

/// Most unknown keys shown at once.
const MOST_UNKNOWN: usize = 20;

/// Reads the scene; `None` if a mistake was noted. Also gives the text with the overrides in it.
pub(super) fn read(
    text: &str,
    overrides: &[(String, String)],
    findings: &mut Findings<'_>,
) -> Option<(Document, String)> {
    let original = match DeTable::parse(text) {
        Ok(table) => table,
        Err(error) => {
            let (message, remedy) = explain(error.message());
            findings.error(error.span().unwrap_or(text.len()..text.len()), message, remedy);
            return None;
        }
    };
    let changes = Overrides::read(overrides, findings);
    let effective = changes.enter(text, findings);
    if findings.count() > 0 {
        return None;
    }
    let table = match DeTable::parse(&effective) {
        Ok(table) => changes.locate(table, &original),
        Err(error) => {
            findings.error(0..0, "the overrides do not fit the scene", format!("check them: {}", error.message()));
            return None;
        }
    };
    let document = deserialise(table, findings)?;
    Some((document, effective))
}

/// Serde stops at the first mistake; unknown keys are taken out one by one, so that all are shown.
fn deserialise(mut table: Spanned<DeTable<'_>>, findings: &mut Findings<'_>) -> Option<Document> {
    let mut unknown: Vec<String> = Vec::new();
    loop {
        let error = match Document::deserialize(toml::Deserializer::from(table.clone())) {
            Ok(document) => return unknown.is_empty().then_some(document),
            Err(error) => error,
        };
        let span = error.span().unwrap_or_else(|| table.span());
        let (message, remedy) = explain(error.message());
        // A key that is missing because it is mistyped is one mistake, not two.
        let missing = error.message().strip_prefix("missing field `").and_then(|rest| rest.strip_suffix('`'));
        if missing.is_none_or(|missing| closest(missing, unknown.iter().map(String::as_str)).is_none()) {
            findings.error(head(span.clone(), findings), message, remedy);
        }
        let is_unknown = error.message().starts_with("unknown field ");
        match remove(table.get_mut(), &span) {
            Some(key) if is_unknown && unknown.len() < MOST_UNKNOWN => unknown.push(key),
            _ => return None,
        }
    }
}

/// The first line of a place: a caret under a whole table says nothing.
fn head(span: Span, findings: &Findings<'_>) -> Span {
    let length = findings.source.slice(&span).and_then(|text| text.find('\n')).unwrap_or(span.len());
    span.start..span.start + length
}

/// Takes the key at a place out of a table.
fn remove(table: &mut DeTable<'_>, span: &Span) -> Option<String> {
    if let Some(key) = table.keys().find(|key| key.span() == *span).map(|key| key.get_ref().to_string()) {
        table.remove(key.as_str());
        return Some(key);
    }
    table.iter_mut().find_map(|(_, value)| remove_in(value.get_mut(), span))
}

fn remove_in(value: &mut DeValue<'_>, span: &Span) -> Option<String> {
    match value {
        DeValue::Table(table) => remove(table, span),
        DeValue::Array(array) => array.iter_mut().find_map(|element| remove_in(element.get_mut(), span)),
        _ => None,
    }
}

//! Text and overrides to a [`Document`].

use serde::Deserialize;
use serde::de::IntoDeserializer;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::document::Document;
use super::findings::{Findings, Span};
use super::messages::explain;
use super::overrides::Overrides;
use super::units::{UnitSystem, within};
use crate::expression::closest;

/// Most mistakes of names and types looked for.
const MOST_ROUNDS: usize = 50;

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

/// Serde stops at the first mistake. What it complains of is noted and taken out, and the rest tried again, so
/// that all mistakes are shown.
fn deserialise(mut table: Spanned<DeTable<'_>>, findings: &mut Findings<'_>) -> Option<Document> {
    let mut removed: Vec<String> = Vec::new();
    // A wrong one is complained of below.
    let system = table
        .get_ref()
        .get("units")
        .and_then(|system| UnitSystem::deserialize(system.clone().into_deserializer()).ok());
    let system = system.unwrap_or_default();
    for _ in 0..MOST_ROUNDS {
        let read = || Document::deserialize(toml::Deserializer::from(table.clone()));
        let error = match within(system, read) {
            Ok(document) => return removed.is_empty().then_some(document),
            Err(error) => error,
        };
        let span = error.span().unwrap_or_else(|| table.span());
        if !is_consequence(error.message(), &removed) {
            let (message, remedy) = explain(error.message());
            findings.error(head(span.clone(), findings), message, remedy);
        }
        removed.push(remove(table.get_mut(), &span)?);
    }
    None
}

/// Whether a mistake is only there because of what was taken out: a key is missing where it was mistyped.
fn is_consequence(message: &str, removed: &[String]) -> bool {
    match message.strip_prefix("missing field `").and_then(|rest| rest.strip_suffix('`')) {
        Some(missing) => closest(missing, removed.iter().map(String::as_str)).is_some(),
        None => message.ends_with("found 0 elements") && !removed.is_empty(),
    }
}

/// The first line of a place: a caret under a whole table says nothing.
fn head(span: Span, findings: &Findings<'_>) -> Span {
    let length = findings.source.slice(&span).and_then(|text| text.find('\n')).unwrap_or(span.len());
    span.start..span.start + length
}

/// Takes the innermost entry around a place out of a table; gives its key.
fn remove(table: &mut DeTable<'_>, span: &Span) -> Option<String> {
    if let Some(key) = table.iter_mut().find_map(|(_, value)| remove_inside(value.get_mut(), span)) {
        return Some(key);
    }
    let entry = table.iter().find(|(key, value)| covers(&key.span(), span) || covers(&value.span(), span));
    let key = entry.map(|(key, _)| key.get_ref().to_string())?;
    table.remove(key.as_str());
    Some(key)
}

fn remove_inside(value: &mut DeValue<'_>, span: &Span) -> Option<String> {
    match value {
        DeValue::Table(table) => remove(table, span),
        DeValue::Array(array) => {
            if let Some(key) = array.iter_mut().find_map(|element| remove_inside(element.get_mut(), span)) {
                return Some(key);
            }
            let index = array.iter().position(|element| covers(&element.span(), span))?;
            let rest = array.iter().enumerate().filter(|(at, _)| *at != index).map(|(_, element)| element.clone());
            *array = rest.collect();
            Some(String::new())
        }
        _ => None,
    }
}

fn covers(outer: &Span, inner: &Span) -> bool {
    outer.start <= inner.start && inner.end <= outer.end
}

//! Overrides `key.path=value`: entered into the text of the scene with `toml_edit`, so that the scene that was
//! computed can be written down, and then located, so that a mistake in one is not blamed on the file.
//!
//! Elements of lists are named by their index: `body.0.spacing=0.1`. A value is TOML; what is not becomes a text.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use toml_edit::{ArrayOfTables, DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::findings::{Findings, Span};
use crate::expression::closest;

/// Most parts of a key: no scene has more, and the stack must not be exhausted.
const DEEPEST: usize = 40;

/// One override, taken apart.
struct Override<'a> {
    path: Vec<&'a str>,
    /// Places of the parts of the path, in the imaginary text of the source.
    parts: Vec<Span>,
    value: Spanned<DeValue<'a>>,
    /// Place of the value.
    start: usize,
    edited: Value,
}

/// The overrides of a scene.
pub(super) struct Overrides<'a> {
    list: Vec<Override<'a>>,
}

/// Why an override does not fit; the number is that of the part of the path.
struct Misfit {
    part: usize,
    message: String,
    remedy: String,
}

impl<'a> Overrides<'a> {
    /// Takes the overrides apart; mistakes are noted.
    pub fn read(overrides: &'a [(String, String)], findings: &mut Findings<'_>) -> Self {
        let mut list = Vec::new();
        for (index, (key, text)) in overrides.iter().enumerate() {
            let start = findings.source.start_of_override(index);
            let mut place = start;
            let parts: Vec<Span> = key
                .split('.')
                .map(|part| {
                    let span = place..place + part.len();
                    place = span.end + 1;
                    span
                })
                .collect();
            if let Some(empty) = key.split('.').position(|part| part.trim().is_empty()) {
                findings.error(parts[empty].clone(), "a part of the key is empty", "write `--set time.step=0.1`");
                continue;
            }
            if parts.len() > DEEPEST {
                findings.error(start..start + key.len(), "the key has too many parts", "write `--set time.step=0.1`");
                continue;
            }
            let start = start + key.len() + 1;
            let value =
                DeValue::parse(text).unwrap_or_else(|_| Spanned::new(0..text.len(), DeValue::String(text.into())));
            let edited = text.trim().parse().unwrap_or_else(|_| Value::from(text.as_str()));
            list.push(Override { path: key.split('.').map(str::trim).collect(), parts, value, start, edited });
        }
        Self { list }
    }

    /// The text with all overrides in it; mistakes are noted.
    pub fn enter(&self, text: &str, findings: &mut Findings<'_>) -> String {
        if self.list.is_empty() {
            return text.to_owned();
        }
        let mut document = match text.parse::<DocumentMut>() {
            Ok(document) => document,
            Err(error) => {
                let span = error.span().unwrap_or(text.len()..text.len());
                findings.error(span, format!("this is not TOML: {}", error.message()), "correct the syntax");
                return text.to_owned();
            }
        };
        for change in &self.list {
            if let Err(misfit) = set(document.as_table_mut(), &change.path, 0, &change.edited) {
                findings.error(change.parts[misfit.part].clone(), misfit.message, misfit.remedy);
            }
        }
        document.to_string()
    }

    /// Gives every value of the effective scene the place it was written at: in the file (`original`) or in
    /// an override.
    pub fn locate<'t>(&self, effective: Spanned<DeTable<'t>>, original: &Spanned<DeTable<'_>>) -> Spanned<DeTable<'t>> {
        let span = original.span();
        let whole = Spanned::new(span.clone(), DeValue::Table(original.get_ref().clone()));
        let mut path = Vec::new();
        let root = Origin { value: Some(&whole), offset: 0, since: 0 };
        let table = self.table(effective.into_inner(), &mut path, &root, &span);
        Spanned::new(span, table)
    }

    fn table<'t>(&self, table: DeTable<'t>, path: &mut Vec<String>, origin: &Origin<'_>, parent: &Span) -> DeTable<'t> {
        let mut located = DeTable::new();
        for (key, value) in table {
            path.push(key.get_ref().to_string());
            let known = match origin.value.map(Spanned::get_ref) {
                Some(DeValue::Table(table)) => table.get_key_value(key.get_ref().as_ref()),
                _ => None,
            };
            let span = match known {
                Some((key, _)) => shift(key.span(), origin.offset),
                None => self.part(path, origin.since).unwrap_or_else(|| parent.clone()),
            };
            let child = Origin { value: known.map(|(_, value)| value), ..*origin };
            let value = self.value(value, path, &child, &span);
            located.insert(Spanned::new(span, key.into_inner()), value);
            path.pop();
        }
        located
    }

    fn value<'t>(
        &self,
        value: Spanned<DeValue<'t>>,
        path: &mut Vec<String>,
        origin: &Origin<'_>,
        parent: &Span,
    ) -> Spanned<DeValue<'t>> {
        let origin = match self.list.iter().enumerate().skip(origin.since).rfind(|(_, change)| change.path == *path) {
            Some((index, change)) => Origin { value: Some(&change.value), offset: change.start, since: index + 1 },
            None => *origin,
        };
        let span = match origin.value {
            Some(value) => shift(value.span(), origin.offset),
            None => parent.clone(),
        };
        let located = match value.into_inner() {
            DeValue::Table(table) => DeValue::Table(self.table(table, path, &origin, &span)),
            DeValue::Array(mut array) => {
                for (index, element) in array.iter_mut().enumerate() {
                    path.push(index.to_string());
                    let child = Origin { value: origin.value.and_then(|value| value.get_ref().get(index)), ..origin };
                    let taken = std::mem::replace(element, Spanned::new(0..0, DeValue::Boolean(false)));
                    *element = self.value(taken, path, &child, &span);
                    path.pop();
                }
                DeValue::Array(array)
            }
            scalar => scalar,
        };
        Spanned::new(span, located)
    }

    /// Place of the part of an override that made this path.
    fn part(&self, path: &[String], since: usize) -> Option<Span> {
        let change = self.list.iter().skip(since).rfind(|change| {
            change.path.len() >= path.len() && change.path.iter().zip(path).all(|(part, other)| part == other)
        })?;
        Some(change.parts[path.len() - 1].clone())
    }
}

/// What a part of the effective scene was made from.
#[derive(Clone, Copy)]
struct Origin<'o> {
    value: Option<&'o Spanned<DeValue<'o>>>,
    /// Place of the text that `value` was parsed from.
    offset: usize,
    /// Overrides from this one on are later than `value`.
    since: usize,
}

fn shift(span: Range<usize>, offset: usize) -> Span {
    span.start + offset..span.end + offset
}

fn set(table: &mut dyn TableLike, path: &[&str], depth: usize, value: &Value) -> Result<(), Misfit> {
    let key = path[depth];
    if depth + 1 == path.len() {
        table.insert(key, Item::Value(value.clone()));
        return Ok(());
    }
    if !table.contains_key(key) {
        // A dotted table is written where it stands, wherever that is.
        let mut dotted = Table::new();
        dotted.set_dotted(true);
        table.insert(key, Item::Table(dotted));
    }
    match table.get_mut(key) {
        Some(Item::Table(inner)) => set(inner, path, depth + 1, value),
        Some(Item::ArrayOfTables(list)) => {
            let length = list.len();
            let index = element(path, depth + 1, length).map_err(|misfit| named(misfit, list, path))?;
            let Some(inner) = list.get_mut(index) else { return Err(outside(path, depth + 1, length)) };
            if depth + 2 < path.len() {
                return set(inner, path, depth + 2, value);
            }
            match value {
                Value::InlineTable(whole) => *inner = whole.clone().into_table(),
                _ => {
                    return Err(Misfit {
                        part: depth + 1,
                        message: format!("`{}` is a table", path[..=depth + 1].join(".")),
                        remedy: "name one of its keys, or give a whole table in braces".to_owned(),
                    });
                }
            }
            Ok(())
        }
        Some(Item::Value(inner)) => set_in_value(inner, path, depth, value),
        Some(Item::None) | None => Ok(()),
    }
}

/// Goes into a value that `path[depth]` names.
fn set_in_value(inner: &mut Value, path: &[&str], depth: usize, value: &Value) -> Result<(), Misfit> {
    match inner {
        Value::InlineTable(table) => set(table as &mut InlineTable, path, depth + 1, value),
        Value::Array(list) => {
            let length = list.len();
            let index = element(path, depth + 1, length)?;
            let Some(inner) = list.get_mut(index) else { return Err(outside(path, depth + 1, length)) };
            if depth + 2 < path.len() {
                return set_in_value(inner, path, depth + 1, value);
            }
            *inner = value.clone();
            Ok(())
        }
        _ => Err(Misfit {
            part: depth + 1,
            message: format!("`{}` is a single value, it has no `{}`", path[..=depth].join("."), path[depth + 1]),
            remedy: format!("set `{}` itself", path[..=depth].join(".")),
        }),
    }
}

fn element(path: &[&str], part: usize, length: usize) -> Result<usize, Misfit> {
    path[part].parse().map_err(|_| Misfit {
        part,
        message: format!("`{}` is a list: `{}` is not the index of an element", path[..part].join("."), path[part]),
        remedy: format!("name an element, such as `{}.0`; there are {length}", path[..part].join(".")),
    })
}

/// Adds the index of the element with that name, or one like it, to the remedy.
fn named(mut misfit: Misfit, list: &ArrayOfTables, path: &[&str]) -> Misfit {
    let names: Vec<&str> =
        list.iter().map(|table| table.get("name").and_then(Item::as_str).unwrap_or_default()).collect();
    let near = closest(path[misfit.part], names.iter().copied().filter(|name| !name.is_empty()));
    if let Some(index) = near.and_then(|near| names.iter().position(|name| *name == near)) {
        let list = path[..misfit.part].join(".");
        misfit.remedy = format!("did you mean `{list}.{index}`, which is named '{}'? {}", names[index], misfit.remedy);
    }
    misfit
}

fn outside(path: &[&str], part: usize, length: usize) -> Misfit {
    Misfit {
        part,
        message: format!("`{}` has no element {}", path[..part].join("."), path[part]),
        remedy: match length {
            0 => "the list is empty: set the whole list".to_owned(),
            _ => format!("the indices go from 0 to {}", length - 1),
        },
    }
}

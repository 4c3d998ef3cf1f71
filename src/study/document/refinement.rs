//! The table `[convergence]`: what is measured, at which sizes, and the keys that they refine.

use toml_edit::Item;

use super::super::cases::Assignment;
use super::super::entries::{Entry, entries, number};
use super::super::orders;
use super::{known_keys, span_of, values};
use crate::scene::findings::{Findings, Span};

const CONVERGENCE_KEYS: [&str; 4] = ["quantity", "sizes", "exact", "refine"];

/// What a convergence study measures.
#[derive(Debug, Clone)]
pub struct Convergence {
    /// Paths of numbers in the report.
    pub quantities: Vec<String>,
    /// Sizes from coarse to fine.
    pub sizes: Vec<f64>,
    /// Exact value of the quantity, if known.
    pub exact: Option<f64>,
    /// What a size is: the key that has it as its value, or `size`.
    pub size_name: String,
    pub(in super::super) quantity_spans: Vec<Span>,
    /// The refined keys, with a value per level each.
    pub(super) levels: Vec<Vec<Assignment>>,
}

impl Convergence {
    /// Number of refined keys.
    pub(in super::super) fn refined(&self) -> usize {
        self.levels.len()
    }
}

/// Reads the table; `None` if a mistake was noted.
pub(super) fn convergence(item: &Item, text: &str, findings: &mut Findings<'_>) -> Option<Convergence> {
    let Some(table) = item.as_table_like() else {
        findings.error(span_of(item), "`convergence` is not a table", "write `[convergence]` and its keys below it");
        return None;
    };
    known_keys(table, &CONVERGENCE_KEYS, findings);
    let before = findings.count();
    let place = item.span().unwrap_or(0..0);
    let mut quantities = Vec::new();
    match table.get("quantity").and_then(Item::as_value) {
        None => findings.error(
            place.clone(),
            "the key `quantity` is missing",
            "add `quantity = \"errors.displacement.l2\"` or another number of report.json",
        ),
        Some(value) => {
            let one = std::slice::from_ref(value);
            let all: Vec<&toml_edit::Value> =
                value.as_array().map_or(one.iter().collect(), |list| list.iter().collect());
            for value in all {
                let span = value.span().unwrap_or_else(|| place.clone());
                match value.as_str() {
                    Some(path) => quantities.push((path.to_owned(), span)),
                    None => findings.error(span, "a quantity is a text", "write its path in report.json in quotes"),
                }
            }
        }
    }
    let exact = table.get("exact").and_then(|item| {
        let found = item.as_value().and_then(number).filter(|number| number.is_finite());
        if found.is_none() {
            findings.error(
                span_of(item),
                "`exact` is not a number",
                "give the exact value, or leave it out: it is extrapolated",
            );
        }
        found
    });
    let refined =
        table.get("refine").and_then(Item::as_table_like).map(|refine| entries(refine, findings)).unwrap_or_default();
    if refined.is_empty() {
        findings.error(
            place.clone(),
            "no key is refined",
            "add `[convergence.refine]` and a key, as `body.0.spacing = 1.0`, a factor of the size",
        );
        return None;
    }
    let sizes = orders::sizes(table.get("sizes"), &refined, &place, findings)?;
    let levels: Vec<_> = refined.iter().filter_map(|entry| refinement(entry, &sizes, text, findings)).collect();
    let itself = |values: &&Vec<Assignment>| {
        values.iter().zip(&sizes).all(|(one, size)| one.value.parse::<f64>().is_ok_and(|value| value == *size))
    };
    let size_name = levels.iter().find(itself).map_or("size", |values| values[0].key.as_str()).to_owned();
    let (quantities, quantity_spans) = quantities.into_iter().unzip();
    (findings.count() == before).then_some(Convergence { quantities, sizes, exact, size_name, quantity_spans, levels })
}

/// The values of a refined key, one per size.
fn refinement(entry: &Entry, sizes: &[f64], text: &str, findings: &mut Findings<'_>) -> Option<Vec<Assignment>> {
    if let Some(factor) = number(&entry.value).filter(|factor| factor.is_finite()) {
        let value = |size: &f64| orders::rounded(factor * size);
        return Some(sizes.iter().map(|size| Assignment::new(entry, value(size), entry.value_span.clone())).collect());
    }
    let all = values(entry, text, findings)?;
    if all.len() == sizes.len() {
        return Some(all);
    }
    let message = format!("`{}` has {} value(s) for {} sizes", entry.key, all.len(), sizes.len());
    findings.error(entry.value_span.clone(), message, "give one value for each size, or a factor of the size");
    None
}

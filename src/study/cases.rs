//! The cases of a study: products, rows and levels.

use super::entries::{Entry, line};
use crate::scene::findings::Span;

/// A key of the scene with its value.
#[derive(Debug, Clone)]
pub struct Assignment {
    /// Key path, as for `--set`.
    pub key: String,
    /// Value as one line of TOML.
    pub value: String,
    pub(super) key_span: Span,
    pub(super) value_span: Span,
}

impl Assignment {
    pub(super) fn new(entry: &Entry, value: String, value_span: Span) -> Self {
        Self { key: entry.key.clone(), value, key_span: entry.key_span.clone(), value_span }
    }

    pub(super) fn of(entry: &Entry, text: &str) -> Self {
        Self::new(entry, line(&entry.value, text), entry.value_span.clone())
    }
}

/// One run of a study.
#[derive(Debug, Clone)]
pub struct Case {
    /// Its number, from 1.
    pub index: usize,
    /// What it overrides, in the order of the study: what all cases share first.
    pub assignments: Vec<Assignment>,
    /// How many of them are shared by all cases.
    pub(super) shared: usize,
    /// Row of the grid or list, from 0.
    pub(super) row: usize,
    /// Level of refinement, from 0.
    pub(super) level: usize,
}

impl Case {
    /// What sets this case apart from the others.
    pub fn varied(&self) -> &[Assignment] {
        &self.assignments[self.shared..]
    }

    /// The overrides as [`crate::scene::Scene::read`] wants them.
    pub fn overrides(&self) -> Vec<(String, String)> {
        self.assignments.iter().map(|one| (one.key.clone(), one.value.clone())).collect()
    }

    /// Name of its directory.
    pub fn directory(&self) -> String {
        format!("case-{:04}", self.index)
    }

    /// `body.0.spacing = 0.1, time.step = 0.01`: what varies.
    pub fn label(&self) -> String {
        label(self.varied())
    }

    /// The table `[set]` of its `case.toml`.
    pub(super) fn table(&self) -> String {
        self.assignments.iter().fold("[set]\n".to_owned(), |table, one| {
            // Quoted, so that every tool reads it the same way.
            format!("{table}{:?} = {}\n", one.key, one.value)
        })
    }
}

/// `key = value, …`
pub(super) fn label(assignments: &[Assignment]) -> String {
    let parts: Vec<String> = assignments.iter().map(|one| format!("{} = {}", one.key, one.value)).collect();
    parts.join(", ")
}

/// All combinations, the last list fastest; `None` if there are more than `most`.
pub(super) fn product(axes: &[Vec<Assignment>], most: usize) -> Option<Vec<Vec<Assignment>>> {
    let mut rows: Vec<Vec<Assignment>> = vec![Vec::new()];
    for axis in axes {
        if rows.len().checked_mul(axis.len())? > most {
            return None;
        }
        let longer = |row: &Vec<Assignment>, one: &Assignment| row.iter().chain([one]).cloned().collect();
        rows = rows.iter().flat_map(|row| axis.iter().map(move |one| longer(row, one))).collect();
    }
    Some(rows)
}

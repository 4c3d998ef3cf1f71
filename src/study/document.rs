//! A study file to its cases; every mistake with its place.

mod refinement;

use std::path::{Path, PathBuf};

use toml_edit::{Document, Item, Table};

pub use refinement::Convergence;

use super::MOST_CASES;
use super::cases::{Assignment, Case, product};
use super::entries::{Entry, entries};
use crate::expression::closest;
use crate::scene::findings::{Findings, Span};
use crate::scene::source::Source;
use crate::scene::{SceneError, SceneErrors};
use refinement::convergence;

/// Largest study file, bytes.
const LARGEST_FILE: u64 = 1 << 24;
const KEYS: [&str; 6] = ["title", "scene", "set", "grid", "case", "convergence"];

/// A study whose text is understood; its scene has not been looked at.
#[derive(Debug, Clone)]
pub struct Study {
    /// Title; default: the name of the file without its ending.
    pub title: String,
    /// The scene.
    pub scene: PathBuf,
    /// Its cases; never empty.
    pub cases: Vec<Case>,
    /// Keys that vary, in the order of the study.
    pub keys: Vec<String>,
    /// What a convergence study measures.
    pub convergence: Option<Convergence>,
    pub(super) scene_span: Span,
    pub(super) text: String,
    pub(super) source: Source,
    /// Memory that a case may need, bytes.
    pub(super) memory: Option<u64>,
}

impl Study {
    /// Reads a study file.
    ///
    /// # Errors
    /// All mistakes found, with their places.
    pub fn read(path: &Path) -> Result<Self, SceneErrors> {
        let name = path.display().to_string();
        let text = crate::files::read_text(path, LARGEST_FILE).map_err(|error| {
            let remedy = "check the path, the permissions and the encoding (UTF-8) of the study file";
            SceneErrors::new(vec![SceneError::of_file(&name, format!("the study cannot be read: {error}"), remedy)])
        })?;
        Self::parse(&text, &name, path.parent().unwrap_or(Path::new("")))
    }

    /// Reads a study from text. `name` stands in messages; the scene is sought from `base`.
    ///
    /// # Errors
    /// All mistakes found, with their places.
    pub fn parse(text: &str, name: &str, base: &Path) -> Result<Self, SceneErrors> {
        let source = Source::new(name, text, &[]);
        let mut findings = Findings::new(&source);
        let study = match Document::parse(text.to_owned()) {
            Ok(document) => read(document.as_table(), text, &mut findings),
            Err(error) => {
                let message = error.message().lines().next().unwrap_or_default();
                let remedy = "write `key = value`, texts in quotes, tables as `[table]` or `[[table]]`";
                findings.error(error.span().unwrap_or(0..0), format!("this is not TOML: {message}"), remedy);
                None
            }
        };
        findings.finish()?;
        let Some(Parts { title, scene, scene_span, cases, keys, convergence }) = study else {
            // Unreachable: without a study a mistake was noted.
            return Err(SceneErrors::default());
        };
        let stem = Path::new(name).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        Ok(Self {
            title: title.or(stem).unwrap_or_default(),
            scene: base.join(scene),
            cases,
            keys,
            convergence,
            scene_span,
            text: text.to_owned(),
            source,
            memory: None,
        })
    }
}

struct Parts {
    title: Option<String>,
    scene: String,
    scene_span: Span,
    cases: Vec<Case>,
    keys: Vec<String>,
    convergence: Option<Convergence>,
}

fn read(table: &Table, text: &str, findings: &mut Findings<'_>) -> Option<Parts> {
    known_keys(table, &KEYS, findings);
    let title = table.get("title").and_then(|item| string(item, "title", findings));
    let scene = match table.get("scene") {
        Some(item) => string(item, "scene", findings).map(|scene| (scene, span_of(item))),
        None => {
            findings.error(
                0..0,
                "the key `scene` is missing",
                "add `scene = \"SCENE.toml\"`, a path from the folder of the study",
            );
            None
        }
    };
    let shared = match table.get("set") {
        Some(item) => assignments(item, "set", text, findings),
        None => Vec::new(),
    };
    let rows = rows(table, text, findings);
    let convergence = table.get("convergence").and_then(|item| convergence(item, text, findings));
    if !["grid", "case", "convergence"].iter().any(|key| table.contains_key(key)) {
        findings.error(0..0, "nothing varies in this study", "add `[grid]`, `[[case]]` or `[convergence]`");
    }
    let (rows, (scene, scene_span)) = (rows?, scene?);
    if findings.count() > 0 {
        return None;
    }
    let levels = convergence.as_ref().map_or(1, |convergence: &Convergence| convergence.sizes.len());
    if rows.len().saturating_mul(levels) > MOST_CASES {
        too_many(table, findings);
        return None;
    }
    let mut cases = Vec::new();
    for (row, varied) in rows.iter().enumerate() {
        for level in 0..levels {
            let refined = convergence.iter().flat_map(|c| c.levels.iter().map(|values| values[level].clone()));
            let assignments: Vec<Assignment> = shared.iter().chain(varied).cloned().chain(refined).collect();
            cases.push(Case { index: cases.len() + 1, assignments, shared: shared.len(), row, level });
        }
    }
    for case in &cases {
        twice(&case.assignments, findings);
    }
    let mut keys: Vec<String> = Vec::new();
    for one in cases.iter().flat_map(Case::varied) {
        if !keys.contains(&one.key) {
            keys.push(one.key.clone());
        }
    }
    Some(Parts { title, scene, scene_span, cases, keys, convergence })
}

/// The rows of the grid or of the list; one empty row if there is neither.
fn rows(table: &Table, text: &str, findings: &mut Findings<'_>) -> Option<Vec<Vec<Assignment>>> {
    match (table.get("grid"), table.get("case")) {
        (Some(_), Some(_)) => {
            findings.error(key_span(table, "case"), "there are both `[grid]` and `[[case]]`", "remove one of the two");
            None
        }
        (Some(grid), None) => {
            let Some(grid) = grid.as_table_like() else {
                findings.error(
                    span_of(grid),
                    "`grid` is not a table",
                    "write `[grid]` and a key with a list of values per line",
                );
                return None;
            };
            let found = entries(grid, findings);
            let axes: Vec<Vec<Assignment>> = found.iter().filter_map(|entry| values(entry, text, findings)).collect();
            if found.is_empty() {
                findings.error(
                    key_span(table, "grid"),
                    "the grid has no keys",
                    "add one, as `body.0.spacing = [0.2, 0.1]`",
                );
                return None;
            }
            let rows = product(&axes, MOST_CASES);
            if rows.is_none() {
                too_many(table, findings);
            }
            rows
        }
        (None, Some(Item::ArrayOfTables(list))) => {
            let row = |row: &Table| entries(row, findings).iter().map(|entry| Assignment::of(entry, text)).collect();
            Some(list.iter().map(row).collect())
        }
        (None, Some(other)) => {
            findings.error(
                span_of(other),
                "`case` is not a list of tables",
                "write `[[case]]` before the keys of every case",
            );
            None
        }
        (None, None) => Some(vec![Vec::new()]),
    }
}

/// A list of values as assignments.
fn values(entry: &Entry, text: &str, findings: &mut Findings<'_>) -> Option<Vec<Assignment>> {
    let Some(list) = entry.value.as_array().filter(|list| !list.is_empty()) else {
        let remedy = format!("list its values: `{} = […, …]`", entry.key);
        findings.error(entry.value_span.clone(), format!("`{}` is not a list of values", entry.key), remedy);
        return None;
    };
    let place = |value: &toml_edit::Value| value.span().unwrap_or_else(|| entry.value_span.clone());
    Some(list.iter().map(|value| Assignment::new(entry, super::entries::line(value, text), place(value))).collect())
}

/// Notes keys that a case sets twice.
fn twice(assignments: &[Assignment], findings: &mut Findings<'_>) {
    for (at, one) in assignments.iter().enumerate() {
        if assignments[..at].iter().any(|other| other.key == one.key) {
            let message = format!("`{}` is set twice in one case", one.key);
            findings.error(one.key_span.clone(), message, "name it in one place only");
        }
    }
}

fn assignments(item: &Item, name: &str, text: &str, findings: &mut Findings<'_>) -> Vec<Assignment> {
    match item.as_table_like() {
        Some(table) => entries(table, findings).iter().map(|entry| Assignment::of(entry, text)).collect(),
        None => {
            findings.error(
                span_of(item),
                format!("`{name}` is not a table"),
                format!("write `[{name}]` and its keys below it"),
            );
            Vec::new()
        }
    }
}

fn too_many(table: &Table, findings: &mut Findings<'_>) {
    let place = if table.contains_key("grid") { "grid" } else { "convergence" };
    let message = format!("the study has more than {MOST_CASES} cases");
    findings.error(key_span(table, place), message, "shorten the lists, or split the study");
}

fn known_keys(table: &dyn toml_edit::TableLike, known: &[&str], findings: &mut Findings<'_>) {
    for (name, _) in table.iter().filter(|(name, _)| !known.contains(name)) {
        let guess =
            closest(name, known.iter().copied()).map(|near| format!("did you mean `{near}`? ")).unwrap_or_default();
        let span = table.key(name).and_then(toml_edit::Key::span).unwrap_or(0..0);
        findings.error(span, format!("unknown key `{name}`"), format!("{guess}the keys here are {}", known.join(", ")));
    }
}

fn string(item: &Item, name: &str, findings: &mut Findings<'_>) -> Option<String> {
    if item.as_str().is_none() {
        findings.error(span_of(item), format!("`{name}` is not a text"), format!("write `{name} = \"…\"`"));
    }
    item.as_str().map(str::to_owned)
}

fn span_of(item: &Item) -> Span {
    item.span().unwrap_or(0..0)
}

fn key_span(table: &Table, key: &str) -> Span {
    table.key(key).and_then(toml_edit::Key::span).unwrap_or(0..0)
}

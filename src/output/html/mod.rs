//! A run as one HTML file that needs nothing else: no network, no program but a browser.
//!
//! What there is of the run decides what is in the file: a run that goes on or was killed has no `report.json`, and
//! its file says so. The policy in its head forbids the browser to fetch anything.

mod sections;
mod text;
mod viewer;

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::render::check_parent;
use super::stored_run::{StoredRun, check_directory, name_of, report_of};
use super::stored_table::StoredTable;
use super::{OutputError, REPORT_FILE, write_atomically};
use text::escaped;

/// Largest file in bytes, where nothing else is asked for. Frames and particles of the view are thinned to fit.
const MOST_BYTES: usize = 4_800_000;
/// Name of the file inside the run directory, where nothing else is asked for.
const FILE: &str = "report.html";

const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("viewer.js");

/// How the file is written.
#[derive(Debug, Clone, Default)]
pub struct HtmlReport {
    /// File to write; `None`: `report.html` in the directory of the run.
    pub out: Option<PathBuf>,
}

/// Everything that was found of a run.
struct Found {
    directory: PathBuf,
    report: Option<Value>,
    history: Option<StoredTable>,
    probes: Option<StoredTable>,
    run: Option<StoredRun>,
    /// What is missing, and why.
    notes: Vec<String>,
}

impl HtmlReport {
    /// Writes the report of the run in `directory` and returns the file.
    ///
    /// # Errors
    /// [`OutputError::Unreadable`] if there is no such directory, [`OutputError::Request`] if there is nothing of a run
    /// in it, [`OutputError::Malformed`] if `report.json` or a frame is damaged, [`OutputError::File`] if the disk
    /// refuses.
    pub fn write(&self, directory: &Path) -> Result<PathBuf, OutputError> {
        let out = self.out.clone().unwrap_or_else(|| directory.join(FILE));
        check_directory(directory)?;
        check_parent(&out)?;
        let document = document(directory)?;
        write_atomically(&out, |file| file.write_all(document.as_bytes()))?;
        Ok(out)
    }
}

/// The report of the run in `directory` as an HTML document.
fn document(directory: &Path) -> Result<String, OutputError> {
    let found = Found::read(directory)?;
    let title = found.title();
    let head = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"generator\" content=\"nicolson {}\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'unsafe-inline'; \
         style-src 'unsafe-inline'; img-src data:\">\n<title>{}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n",
        env!("CARGO_PKG_VERSION"),
        escaped(&title)
    );
    let summary = sections::summary(&found, &title);
    let rest = [
        sections::energy(&found)?,
        sections::probes(&found)?,
        sections::convergence(&found)?,
        sections::wall_time(&found),
        sections::outcomes(&found),
        sections::scene(&found),
    ]
    .concat();
    let end = "</main>\n</body>\n</html>\n";
    let used = head.len() + summary.len() + rest.len() + SCRIPT.len() + end.len();
    let view = match &found.run {
        Some(run) => viewer::section(run, MOST_BYTES.saturating_sub(used), SCRIPT)?,
        None => String::new(),
    };
    Ok([head, summary, view, rest, end.to_owned()].concat())
}

impl Found {
    fn read(directory: &Path) -> Result<Self, OutputError> {
        let mut notes = Vec::new();
        let report = report_of(directory)?;
        if report.is_none() {
            notes.push(format!("There is no {REPORT_FILE}: the run goes on, or it was killed."));
        }
        let mut table = |name: &str| {
            let path = directory.join(name);
            if !path.exists() {
                return Ok(None);
            }
            let table = StoredTable::read(&path)?;
            if table.rows() == 0 {
                notes.push(format!("{name} has no rows."));
            }
            Ok(Some(table).filter(|table| table.rows() > 0))
        };
        let (history, probes) = (table("history.csv")?, table("probes.csv")?);
        let run = match StoredRun::open(directory) {
            Ok(run) => Some(run),
            Err(OutputError::Request { .. }) => {
                notes.push("There are no frames, and so no view of the particles.".to_owned());
                None
            }
            Err(error) => return Err(error),
        };
        if report.is_none() && history.is_none() && run.is_none() {
            let what = format!("there is nothing of a run in {}", directory.display());
            return Err(OutputError::request(what, "give the directory of a run (`nicolson run SCENE --out DIR`)"));
        }
        Ok(Self { directory: directory.to_path_buf(), report, history, probes, run, notes })
    }

    /// Title of the scene, or the name of the directory.
    fn title(&self) -> String {
        let table: Option<toml::Table> = self.scene().parse().ok();
        let title = table.as_ref().and_then(|table| table.get("title")?.as_str());
        title.map_or_else(|| name_of(&self.directory), str::to_owned)
    }

    /// The scene as text; empty if nothing tells.
    fn scene(&self) -> &str {
        let reported = self.report.as_ref().and_then(|report| report["provenance"]["scene"].as_str());
        reported.or(self.run.as_ref().map(StoredRun::scene)).unwrap_or_default()
    }

    /// An entry of the report by its keys; `Null` if there is none.
    fn entry(&self, keys: &[&str]) -> &Value {
        const NOTHING: &Value = &Value::Null;
        self.report
            .as_ref()
            .map_or(NOTHING, |report| keys.iter().try_fold(report, |value, key| value.get(key)).unwrap_or(NOTHING))
    }
}

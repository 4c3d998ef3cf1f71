//! What is kept of the cases: a CSV file that grows, and from it a table and a figure.

use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use nicolson::output::{Cell, Panel, Panels, Tone};

use super::basics::reason;
use super::case::{Case, Ending, Outcome, RATIOS, SCENES, SCHEMES, UPWINDING};

const COLUMNS: [&str; 15] = [
    "scene",
    "scheme",
    "tau_v",
    "ratio",
    "end",
    "step",
    "ending",
    "time",
    "steps",
    "newton_iterations",
    "drift",
    "rise",
    "ledger",
    "remaining",
    "seconds",
];

/// The CSV file of a directory, to which every case that ends adds its row at once.
pub struct Results {
    path: PathBuf,
    rows: Vec<Outcome>,
}

impl Results {
    /// Reads what earlier calls left in the directory.
    ///
    /// # Errors
    /// In words, with the file.
    pub fn open(directory: &Path) -> Result<Self, String> {
        std::fs::create_dir_all(directory).map_err(reason(directory))?;
        let path = directory.join("stability-map.csv");
        let mut rows = Vec::new();
        if path.exists() {
            let mut reader = csv::Reader::from_path(&path).map_err(reason(&path))?;
            for record in reader.records() {
                let record = record.map_err(reason(&path))?;
                let fields: Vec<&str> = record.iter().collect();
                let row =
                    read_row(&fields).ok_or_else(|| format!("{}: cannot read the row {fields:?}", path.display()))?;
                rows.push(row);
            }
        } else {
            let mut file = File::create(&path).map_err(reason(&path))?;
            writeln!(file, "{},cause", COLUMNS.join(",")).map_err(reason(&path))?;
        }
        Ok(Self { path, rows })
    }

    /// Whether a case has its row already.
    pub fn has(&self, case: &Case) -> bool {
        self.rows.iter().any(|row| row.case == *case)
    }

    /// Adds a row, also to the file.
    ///
    /// # Errors
    /// In words, with the file.
    pub fn add(&mut self, row: Outcome) -> Result<(), String> {
        let file = OpenOptions::new().append(true).open(&self.path).map_err(reason(&self.path))?;
        let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(file);
        let Case { scene, scheme, upwinding, ratio, end } = &row.case;
        let numbers = [row.drift, row.rise, row.ledger, row.remaining].map(|value| format!("{value:.3e}"));
        let [drift, rise, ledger, remaining] = numbers;
        writer
            .write_record([
                scene.clone(),
                scheme.clone(),
                upwinding.to_string(),
                ratio.to_string(),
                end.to_string(),
                row.step.to_string(),
                row.ending.name().to_owned(),
                row.time.to_string(),
                row.steps.to_string(),
                row.iterations.to_string(),
                drift,
                rise,
                ledger,
                remaining,
                format!("{:.1}", row.seconds),
                row.cause.clone(),
            ])
            .map_err(reason(&self.path))?;
        writer.flush().map_err(reason(&self.path))?;
        self.rows.push(row);
        Ok(())
    }

    /// Writes `stability-map.md`, `.svg` and `.png` from all rows that go to `end`.
    ///
    /// # Errors
    /// In words, with the file.
    pub fn summarise(&self, end: f64) -> Result<Vec<PathBuf>, String> {
        let table = self.path.with_extension("md");
        std::fs::write(&table, self.markdown(end)).map_err(reason(&table))?;
        let figure = self.panels(end).write(&self.path.with_extension("")).map_err(|error| error.to_string())?;
        Ok(std::iter::once(table).chain(figure).collect())
    }

    fn find(&self, scene: &str, scheme: &str, upwinding: f64, ratio: f64, end: f64) -> Option<&Outcome> {
        let case = Case { scene: scene.into(), scheme: scheme.into(), upwinding, ratio, end };
        self.rows.iter().find(|row| row.case == case)
    }

    fn markdown(&self, end: f64) -> String {
        let mut text = String::new();
        for (scene, _) in SCENES {
            for upwinding in UPWINDING {
                let _ = writeln!(text, "{}\n", heading(scene, upwinding));
                let ratios: Vec<String> = RATIOS.iter().map(f64::to_string).collect();
                let _ = writeln!(text, "| Δt / Δt_explicit | {} |", ratios.join(" | "));
                let _ = writeln!(text, "|---|{}", "---|".repeat(RATIOS.len()));
                for scheme in SCHEMES {
                    let cell = |ratio: &f64| match self.find(scene, scheme, upwinding, *ratio, end).map(Outcome::cell) {
                        Some(Cell { text, tone: Tone::Bad(_) }) => format!("**{text}**"),
                        Some(cell) => cell.text,
                        None => String::new(),
                    };
                    let cells: Vec<String> = RATIOS.iter().map(cell).collect();
                    let _ = writeln!(text, "| `{scheme}` | {} |", cells.join(" | "));
                }
                text.push('\n');
            }
        }
        text
    }

    fn panels(&self, end: f64) -> Panels {
        let panel = |scene: &str, upwinding: f64| Panel {
            title: heading(scene, upwinding),
            cells: SCHEMES
                .iter()
                .map(|scheme| {
                    let cell = |ratio: &f64| self.find(scene, scheme, upwinding, *ratio, end).map(Outcome::cell);
                    RATIOS.iter().map(cell).collect()
                })
                .collect(),
        };
        Panels {
            title: format!("What becomes of long steps, to t = {end} s"),
            rows: SCHEMES.iter().map(|scheme| scheme.replace('_', " ")).collect(),
            columns: RATIOS.iter().map(f64::to_string).collect(),
            columns_label: "Δt over the explicit limit".into(),
            good: "reached the end; relative error of the energy".into(),
            bad: "blew up at this time".into(),
            panels: SCENES.iter().flat_map(|(scene, _)| UPWINDING.map(|upwinding| panel(scene, upwinding))).collect(),
        }
    }
}

fn heading(scene: &str, upwinding: f64) -> String {
    if upwinding > 0.0 {
        format!("Hyperelastic {scene}, upwinding {upwinding}: largest rise of the energy")
    } else {
        format!("Hyperelastic {scene}: largest change of the energy")
    }
}

fn read_row(fields: &[&str]) -> Option<Outcome> {
    let number = |i: usize| fields.get(i)?.parse::<f64>().ok();
    let count = |i: usize| fields.get(i)?.parse::<usize>().ok();
    Some(Outcome {
        case: Case {
            scene: (*fields.first()?).into(),
            scheme: (*fields.get(1)?).into(),
            upwinding: number(2)?,
            ratio: number(3)?,
            end: number(4)?,
        },
        step: number(5)?,
        ending: Ending::named(fields.get(6)?)?,
        time: number(7)?,
        steps: count(8)?,
        iterations: count(9)?,
        drift: number(10)?,
        rise: number(11)?,
        ledger: number(12)?,
        remaining: number(13)?,
        seconds: number(14)?,
        cause: (*fields.get(15)?).into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_survive_the_file_and_are_found_again() {
        let directory = tempfile::tempdir().unwrap();
        let case = Case {
            scene: "piston".into(),
            scheme: "midpoint".into(),
            upwinding: 0.5,
            ratio: 13.0 + 1.0 / 3.0,
            end: 100.0,
        };
        let row = Outcome {
            case: case.clone(),
            step: 0.1,
            ending: Ending::Failed,
            time: 33.9,
            steps: 339,
            iterations: 1200,
            drift: 2.5e-1,
            rise: 0.0,
            ledger: 1e-16,
            remaining: 7.0,
            seconds: 1.5,
            cause: "the step, \"3\", failed".into(),
        };
        let mut results = Results::open(directory.path()).unwrap();
        assert!(!results.has(&case));
        results.add(row.clone()).unwrap();
        let again = Results::open(directory.path()).unwrap();
        assert_eq!(again.rows, [row]);
        assert!(again.has(&case));
        assert!(!again.has(&Case { end: 5.0, ..case }));
        assert_eq!(again.summarise(100.0).unwrap().len(), 3);
    }
}

//! `report.json`: what a run did, for people, scripts and our own tests.
//!
//! The keys are a promise: they are all always there, in this order, and scripts read them. A number
//! that is not finite becomes `null` (JSON has no other way), and a warning says which.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::report_parts::{
    BalanceWork, Bottleneck, EnergyBudget, ErrorNorms, LinearWork, NewtonWork, ProbeState, Provenance, Status, Steps,
    WallSeconds, number_or_null,
};
use super::{OutputError, write_atomically};
use crate::setup::GeometryRecord;

/// Name of the report inside the output directory.
pub const REPORT_FILE: &str = "report.json";

/// Largest report that is read, bytes.
const LARGEST: u64 = 1 << 30;

/// The content of `report.json`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Report {
    /// How the run ended.
    pub status: Status,
    /// Why it failed; `None` otherwise.
    pub message: Option<String>,
    /// Time reached in s.
    #[serde(deserialize_with = "number_or_null")]
    pub time_reached: f64,
    /// Number of particles.
    pub particles: usize,
    /// Number of free unknowns.
    pub unknowns: usize,
    /// Time steps.
    pub steps: Steps,
    /// Balancing of gradient weights, for every body that asked for it.
    pub balance: Vec<BalanceWork>,
    /// What filling came to, for bodies cut out of a lattice or read from a file.
    #[serde(default)]
    pub geometry: Vec<GeometryRecord>,
    /// Work of Newton's method.
    pub newton: NewtonWork,
    /// Work of the linear solver.
    pub linear: LinearWork,
    /// Evaluations of the rate of the semi-discrete system.
    pub rate_evaluations: usize,
    /// Largest stable explicit time step in s; `None` if it was not estimated.
    pub explicit_step_limit: Option<f64>,
    /// Where the time went.
    pub wall_seconds: WallSeconds,
    /// Where most of it went.
    pub bottleneck: Bottleneck,
    /// Energy budget.
    pub energy: EnergyBudget,
    /// Largest change of linear momentum over the sum of its magnitudes; `None` for a body that is held or loaded.
    pub linear_momentum_drift: Option<f64>,
    /// Largest change of angular momentum over the sum of its magnitudes; `None` as above, and in 1D.
    pub angular_momentum_drift: Option<f64>,
    /// Errors against the exact solution, by field; empty without one.
    pub errors: BTreeMap<String, ErrorNorms>,
    /// Final state of the probes, by name.
    pub probes: BTreeMap<String, ProbeState>,
    /// What the user should know although the run went on.
    pub warnings: Vec<String>,
    /// What is needed to repeat the run.
    pub provenance: Provenance,
}

impl Report {
    /// Writes `report.json` into `directory` as a whole or not at all and returns its path. Numbers that
    /// are not finite become `null` and are named in `warnings`.
    ///
    /// # Errors
    /// [`OutputError::File`] if the disk refuses.
    pub fn write(&self, directory: &Path) -> Result<PathBuf, OutputError> {
        let path = directory.join(REPORT_FILE);
        let mut report = self.clone();
        report.warnings.extend(self.not_finite(&path)?);
        write_atomically(&path, |file| {
            serde_json::to_writer_pretty(&mut *file, &report)?;
            file.write_all(b"\n")
        })?;
        Ok(path)
    }

    /// Reads the report of a finished run from `directory`. A `null` in place of a number reads as NaN.
    ///
    /// # Errors
    /// [`OutputError::File`] if there is none, [`OutputError::Malformed`] if it is not a report.
    pub fn read(directory: &Path) -> Result<Self, OutputError> {
        let path = directory.join(REPORT_FILE);
        let text = crate::files::read_text(&path, LARGEST).map_err(OutputError::file("read the report", &path))?;
        serde_json::from_str(&text).map_err(|error| OutputError::Malformed { path, reason: error.to_string() })
    }

    /// One warning for each number that JSON cannot hold.
    fn not_finite(&self, path: &Path) -> Result<Vec<String>, OutputError> {
        let tree = serde_json::to_value(self)
            .map_err(|error| OutputError::Malformed { path: path.to_path_buf(), reason: error.to_string() })?;
        // The entries whose absence is meant; every other null is a number that was lost.
        let meant = [
            ("message", self.message.is_none()),
            ("explicit_step_limit", self.explicit_step_limit.is_none()),
            ("energy.max_relative_drift", self.energy.max_relative_drift.is_none()),
            ("energy.ledger_error", self.energy.ledger_error.is_none()),
            ("energy.hourglass_max_fraction", self.energy.hourglass_max_fraction.is_none()),
            ("linear_momentum_drift", self.linear_momentum_drift.is_none()),
            ("angular_momentum_drift", self.angular_momentum_drift.is_none()),
        ];
        let mut nulls = Vec::new();
        collect_nulls(&tree, String::new(), &mut nulls);
        // Those of the geometry say that something is not known.
        nulls.retain(|place| !meant.contains(&(place.as_str(), true)) && !place.starts_with("geometry."));
        Ok(nulls.into_iter().map(|place| format!("{place} is not a finite number and is reported as null")).collect())
    }
}

/// The dotted paths of all nulls in a JSON value.
fn collect_nulls(value: &Value, place: String, found: &mut Vec<String>) {
    let below = |key: &str| if place.is_empty() { key.to_owned() } else { format!("{place}.{key}") };
    match value {
        Value::Null => found.push(place),
        Value::Object(entries) => entries.iter().for_each(|(key, entry)| collect_nulls(entry, below(key), found)),
        Value::Array(entries) => {
            entries.iter().enumerate().for_each(|(i, entry)| collect_nulls(entry, below(&i.to_string()), found));
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_report_reads_back_as_it_was() {
        let directory = tempfile::tempdir().unwrap();
        let mut report = Report { status: Status::Completed, time_reached: 0.1 + 0.2, ..Report::default() };
        report.energy.max_relative_drift = Some(1.234_567_890_123_456_7e-13);
        report.errors.insert("displacement".into(), ErrorNorms { l1: 1e-300, l2: 5e-324, linf: 1.0 / 3.0 });
        let probe = ProbeState { displacement: vec![0.1, 0.2], velocity: vec![1e10, -0.0], position: vec![] };
        report.probes.insert("tip".into(), probe);
        report.provenance.scene = "title = \"späce\"\n".into();
        report.write(directory.path()).unwrap();
        assert_eq!(Report::read(directory.path()).unwrap(), report);
    }

    #[test]
    fn numbers_that_json_cannot_hold_become_null_and_a_warning() {
        let directory = tempfile::tempdir().unwrap();
        let mut report = Report { time_reached: f64::NAN, message: Some("blew up".into()), ..Report::default() };
        report.energy.ledger_error = Some(f64::INFINITY);
        report.probes.insert("tip".into(), ProbeState { velocity: vec![1.0, f64::NAN], ..ProbeState::default() });
        report.warnings.push("an older one".into());
        report.write(directory.path()).unwrap();
        let read = Report::read(directory.path()).unwrap();
        assert!(read.time_reached.is_nan() && read.probes["tip"].velocity[1].is_nan());
        assert_eq!(read.energy.ledger_error, None);
        assert_eq!(read.warnings.len(), 4, "{:?}", read.warnings);
        assert_eq!(read.warnings[0], "an older one");
        for place in ["time_reached", "energy.ledger_error", "probes.tip.velocity.1"] {
            assert!(read.warnings.iter().any(|warning| warning.starts_with(place)), "{place}: {:?}", read.warnings);
        }
    }

    #[test]
    fn a_missing_or_damaged_report_is_reported() {
        let directory = tempfile::tempdir().unwrap();
        assert!(matches!(Report::read(directory.path()), Err(OutputError::File { .. })));
        fs::write(directory.path().join(REPORT_FILE), "{ \"status\": \"completed\" }").unwrap();
        assert!(Report::read(directory.path()).unwrap_err().to_string().contains("run the case again"));
    }
}

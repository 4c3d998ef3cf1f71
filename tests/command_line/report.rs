//! `report.json` of a real run: every promised key, and numbers that belong together.

use std::path::Path;

use nicolson::output::Report;
use serde_json::Value;

use super::{example, readable, run, table};

/// The interface contract: keys of the report and of its groups.
const PROMISED: [(&str, &str); 8] = [
    (
        "",
        "angular_momentum_drift balance bottleneck energy errors explicit_step_limit geometry linear linear_momentum_drift \
         message newton particles probes provenance rate_evaluations status steps time_reached unknowns wall_seconds warnings",
    ),
    ("steps", "accepted rejected"),
    ("newton", "failures iterations linearisations residual_evaluations solves"),
    ("linear", "analyses factorisations fill iterations reason solver solves"),
    ("wall_seconds", "assembly factorisation integration ledger other output rate setup solve total"),
    ("bottleneck", "hint part share"),
    ("energy", "dissipated final hourglass_max_fraction initial ledger_error max_relative_drift"),
    ("provenance", "command commit parent_checkpoint scene threads version"),
];

fn promised_keys(tree: &Value) {
    for (group, keys) in PROMISED {
        let part = if group.is_empty() { tree } else { &tree[group] };
        let mut found: Vec<&str> = part.as_object().expect("a group").keys().map(String::as_str).collect();
        found.sort_unstable();
        assert_eq!(found.join(" "), keys, "{group}");
    }
}

fn tree(directory: &Path) -> Value {
    let text = std::fs::read_to_string(directory.join("report.json")).expect("a report");
    serde_json::from_str(&text).expect("JSON")
}

#[test]
fn every_promised_key_is_there_even_in_an_empty_report() {
    let directory = tempfile::tempdir().expect("a directory");
    Report::default().write(directory.path()).expect("a report");
    let tree = tree(directory.path());
    promised_keys(&tree);
    assert_eq!(tree["status"], "failed");
    assert_eq!(tree["warnings"], serde_json::json!([]));
}

#[test]
fn every_promised_key_is_in_the_report_of_a_run() {
    let directory = tempfile::tempdir().expect("a directory");
    for (name, overrides) in [
        ("bar-smooth", &["time.end=0.2"][..]),
        ("dam-break", &["time.end=0.05", "output.history=false"]),
        ("dam-break", &["time={ scheme = \"tvd_rk2\", cfl = 0.3, end = 0.05 }"]),
        ("block-piston", &["time.end=0.02"]),
    ] {
        let out = directory.path().join("out");
        assert_eq!(run(&example(name), &out, overrides, &["--quiet", "--threads", "2"]).code, 0);
        let tree = tree(&out);
        promised_keys(&tree);
        assert_eq!(tree["status"], "completed");
        assert_eq!(tree["message"], Value::Null);
        assert_eq!(tree["provenance"]["threads"], 2);
    }
}

#[test]
fn the_report_agrees_with_the_tables_and_the_command() {
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().join("out");
    let overrides = ["time.step=0.02", "time.end=0.2", "title=of the test"];
    assert_eq!(run(&example("bar-smooth"), &out, &overrides, &["--quiet", "--threads", "1"]).code, 0);
    let report = readable(&out);
    let (titles, rows) = table(&out.join("history.csv"));
    assert_eq!(
        titles.join(" "),
        "t dt kinetic internal external dissipated total newton_iterations rejected hourglass"
    );
    assert_eq!((report.steps.accepted, rows.len()), (10, 11));
    assert_eq!(report.time_reached, 0.2);
    assert_eq!((report.particles, report.unknowns), (41, 40));
    // A linear problem: one iteration per step, one factorisation.
    assert_eq!((report.newton.solves, report.newton.iterations, report.newton.failures), (10, 10, 0));
    assert_eq!((report.linear.analyses, report.linear.factorisations), (1, 1));
    assert_eq!(report.energy.initial, rows[0][6]);
    assert_eq!(report.energy.r#final, rows[10][6]);
    assert!(report.energy.max_relative_drift.is_some_and(|drift| drift < 1e-12));
    assert_eq!(report.errors.keys().collect::<Vec<_>>(), ["displacement", "pressure", "velocity"]);
    // Probe and table.
    let (titles, probes) = table(&out.join("probes.csv"));
    assert_eq!(titles, ["t", "tip.ux", "tip.vx"]);
    let tip = &report.probes["tip"];
    assert_eq!((tip.displacement[0], tip.velocity[0]), (probes[10][1], probes[10][2]));
    assert_eq!(tip.position[0], 10.0 + tip.displacement[0]);
    // What is needed to repeat the run, and nothing else is needed.
    for part in ["step = 0.02", "end = 0.2", "title = \"of the test\""] {
        assert!(report.provenance.scene.contains(part), "{}", report.provenance.scene);
    }
    assert!(report.provenance.command.contains("--set time.step=0.02"), "{}", report.provenance.command);
    let again = directory.path().join("again.toml");
    std::fs::write(&again, &report.provenance.scene).expect("a file");
    let second = directory.path().join("second");
    assert_eq!(run(&again, &second, &[], &["--quiet"]).code, 0);
    assert_eq!(table(&second.join("history.csv")), (table(&out.join("history.csv"))));
}

//! Sweeps: cases in parallel, resumed, failed, interrupted, collected; orders of convergence.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use nicolson::output::{Report, Status};

use super::{Answer, command, example, nicolson, readable, run};

/// A study of `examples/studies/`.
fn study(name: &str) -> PathBuf {
    example(&format!("studies/{name}"))
}

fn sweep(study: &Path, out: &Path, more: &[&str]) -> Answer {
    let mut arguments = vec!["sweep".as_ref(), study.as_os_str(), "--out".as_ref(), out.as_os_str()];
    arguments.extend(more.iter().map(std::ffi::OsStr::new));
    nicolson(&arguments)
}

/// Rows of a CSV file by title.
fn rows(path: &Path) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(path).expect("a table");
    let titles = reader.headers().expect("titles").clone();
    let row = |record: csv::StringRecord| titles.iter().zip(&record).map(|(a, b)| (a.into(), b.into())).collect();
    reader.records().map(|record| row(record.expect("a whole row"))).collect()
}

fn number(row: &BTreeMap<String, String>, title: &str) -> f64 {
    row[title].parse().unwrap_or_else(|_| panic!("{title}: {:?}", row[title]))
}

/// Writes a study beside a directory for its results.
fn written(directory: &Path, text: &str) -> (PathBuf, PathBuf) {
    let file = directory.join("study.toml");
    fs::write(&file, text).expect("a file");
    (file, directory.join("out"))
}

#[test]
fn a_grid_runs_every_combination_as_run_does() {
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().join("grid für alle");
    let answer = sweep(&study("dam-break-grid"), &out, &["--jobs", "3"]);
    assert_eq!(answer.code, 0, "{}", answer.complained);
    assert!(answer.said.contains("8 of 8 cases completed"), "{}", answer.said);
    assert_eq!(answer.complained.matches(" done: ").count(), 8, "{}", answer.complained);
    let table = rows(&out.join("cases.csv"));
    assert_eq!(table.len(), 8);
    // The last key varies fastest.
    let varied = |row: &BTreeMap<String, String>| {
        ["case", "time.scheme", "time.step", "stabilisation.tau_v"].map(|title| row[title].clone()).join(" ")
    };
    assert_eq!(varied(&table[0]), "1 crank_nicolson 0.01 0.0");
    assert_eq!(varied(&table[1]), "2 crank_nicolson 0.01 1.0");
    assert_eq!(varied(&table[6]), "7 midpoint 0.005 0.0");
    for (row, steps) in table.iter().zip([10.0, 10.0, 20.0, 20.0, 10.0, 10.0, 20.0, 20.0]) {
        assert_eq!(
            (row["status"].as_str(), number(row, "steps"), number(row, "particles")),
            ("completed", steps, 121.0)
        );
    }
    // What the study says of itself.
    let drift: Vec<f64> = table.iter().map(|row| number(row, "energy_drift")).collect();
    assert!((drift[0] / drift[2] - 4.0).abs() < 0.3 && (drift[4] / drift[6] - 4.0).abs() < 0.4, "{drift:?}");
    assert!([1, 3, 5, 7].iter().all(|&at| (drift[at] - 0.14).abs() < 0.005), "{drift:?}");
    // The same bits as a run of its own, with other threads.
    let alone = directory.path().join("alone");
    let overrides =
        ["time.end=0.1", "output.plots=false", "time.scheme=midpoint", "time.step=0.005", "stabilisation.tau_v=1.0"];
    assert_eq!(run(&example("dam-break"), &alone, &overrides, &["--quiet", "--threads", "2"]).code, 0);
    let case = out.join("case-0008");
    let (mut ours, mut theirs) = (readable(&case), readable(&alone));
    for file in ["history.csv", "probes.csv", "fields.pvd", "fields-00002.vtu"] {
        assert!(fs::read(case.join(file)).expect(file) == fs::read(alone.join(file)).expect(file), "{file} differs");
    }
    for report in [&mut ours, &mut theirs] {
        (report.wall_seconds, report.bottleneck) = Default::default();
        report.provenance.command.clear();
        report.provenance.threads = 0;
        report.balance.iter_mut().for_each(|balance| balance.seconds = 0.0);
    }
    assert_eq!(ours, theirs);
    assert!(fs::read_to_string(case.join("case.toml")).expect("a file").contains("\"time.scheme\" = \"midpoint\""));
}

#[test]
fn a_sweep_goes_on_where_it_was_left() {
    let directory = tempfile::tempdir().expect("a directory");
    let scene = example("bar-smooth");
    let text = format!(
        "scene = {:?}\n[set]\noutput.plots = false\ntime.end = 0.1\n[[case]]\ntime.step = 0.05\n[[case]]\ntime.step = 0.025\n\
         body.0.spacing = 0.5\n[[case]]\ntime.step = 0.02\n",
        scene.display().to_string()
    );
    let (file, out) = written(directory.path(), &text);
    assert_eq!(sweep(&file, &out, &["--quiet"]).code, 0);
    let table = rows(&out.join("cases.csv"));
    assert_eq!(table.iter().map(|row| row["body.0.spacing"].as_str()).collect::<Vec<_>>(), ["", "0.5", ""]);
    let stamp = |case: &str| fs::metadata(out.join(case).join("report.json")).and_then(|data| data.modified()).ok();
    let first = stamp("case-0001");
    // One without a report, one with half a report.
    fs::remove_file(out.join("case-0002/report.json")).expect("a file");
    fs::write(out.join("case-0003/report.json"), "{ \"status\": \"comple").expect("a file");
    let found = nicolson(&["collect".as_ref(), out.as_os_str()]);
    assert!(found.code == 0 && found.said.contains("1 of 3 cases completed"), "{} {}", found.said, found.complained);
    assert_eq!(
        rows(&out.join("cases.csv")).iter().map(|row| row["status"].as_str()).collect::<Vec<_>>(),
        ["completed", "missing", "missing"]
    );
    let plan = sweep(&file, &out, &["--dry-run"]);
    assert!(plan.said.contains("case-0001  skip: completed  time.step = 0.05"), "{}", plan.said);
    let again = sweep(&file, &out, &[]);
    assert!(again.code == 0 && again.said.contains("2 completed, 0 failed, 1 completed before"), "{}", again.said);
    assert_eq!(stamp("case-0001"), first);
    // Another value: only its case is run again, and until then its results are not taken for those of the study.
    fs::write(&file, text.replace("0.02\n", "0.01\n")).expect("a file");
    let plan = sweep(&file, &out, &["--dry-run"]);
    assert!(plan.said.contains("case-0003  run again: results of another scene"), "{}", plan.said);
    assert_eq!(sweep(&file, &out, &["--index", "1", "--quiet"]).code, 0);
    assert_eq!(nicolson(&["collect".as_ref(), out.as_os_str()]).code, 0);
    assert_eq!(rows(&out.join("cases.csv"))[2]["status"], "outdated");
    let again = sweep(&file, &out, &[]);
    assert!(again.said.contains("1 completed, 0 failed, 2 completed before"), "{}", again.said);
    assert_eq!(number(&rows(&out.join("cases.csv"))[2], "steps"), 10.0);
}

#[test]
fn the_cases_of_an_array_job_run_alone_and_are_collected_after() {
    let directory = tempfile::tempdir().expect("a directory");
    let (grid, out) = (study("dam-break-grid"), directory.path().join("out"));
    for index in ["2", "5"] {
        let answer = sweep(&grid, &out, &["--index", index]);
        assert_eq!(answer.code, 0, "{}", answer.complained);
        assert!(answer.complained.contains(&format!("[1/1] case {index} (")), "{}", answer.complained);
    }
    assert!(!out.join("cases.csv").exists());
    for index in ["0", "9"] {
        let answer = sweep(&grid, &out, &["--index", index]);
        assert!(answer.code == 2 && answer.complained.contains("the cases are 1 to 8"), "{}", answer.complained);
    }
    let file = directory.path().join("tables/all.csv");
    fs::create_dir(directory.path().join("tables")).expect("a directory");
    let answer = nicolson(&["collect".as_ref(), out.as_os_str(), "--out".as_ref(), file.as_os_str()]);
    assert!(answer.code == 0 && answer.said.contains("2 of 8 cases completed"), "{}", answer.said);
    let table = rows(&file);
    let done: Vec<&str> =
        table.iter().filter(|row| row["status"] == "completed").map(|row| row["case"].as_str()).collect();
    assert_eq!((done, table[0]["status"].as_str(), table[0]["steps"].as_str()), (vec!["2", "5"], "missing", ""));
    let nothing = nicolson(&["collect".as_ref(), directory.path().as_os_str()]);
    assert!(nothing.code == 2 && nothing.complained.contains("no study.toml in"), "{}", nothing.complained);
}

/// A bar pressed through its own clamp: the second case fails at t = 1 s, the first ends before.
const PRESSED: &str = "\n[[boundary]]\nselect.where = \"X > 9.9\"\ndisplacement = { x = \"-10*t\" }\n";

#[test]
fn a_case_that_fails_stops_no_other() {
    let directory = tempfile::tempdir().expect("a directory");
    let scene = fs::read_to_string(example("bar-smooth")).expect("a scene");
    let scene = scene.replace("linear_volumetric = {", "hyperelastic_volumetric = { gamma = 7.0,") + PRESSED;
    fs::write(directory.path().join("pressed.toml"), scene).expect("a file");
    let text =
        "scene = \"pressed.toml\"\n[set]\noutput.plots = false\ntime.step = 0.02\n[grid]\ntime.end = [2.0, 0.2, 0.1]\n";
    let (file, out) = written(directory.path(), text);
    let answer = sweep(&file, &out, &["--jobs", "1"]);
    assert_eq!(answer.code, 3, "{}", answer.complained);
    assert!(answer.complained.contains("error: case 1 (time.end = 2.0) failed after"), "{}", answer.complained);
    assert!(answer.said.contains("done: 2 completed, 1 failed"), "{}", answer.said);
    let table = rows(&out.join("cases.csv"));
    assert_eq!(
        table.iter().map(|row| row["status"].as_str()).collect::<Vec<_>>(),
        ["failed", "completed", "completed"]
    );
    assert!(table[0]["message"].contains("t = ") && number(&table[0], "time") < 1.0, "{:?}", table[0]);
    let kept = sweep(&file, &out, &["--keep-failed"]);
    assert!(
        kept.code == 3 && kept.said.contains("0 completed, 0 failed, 2 completed before, 1 failed before"),
        "{}",
        kept.said
    );
    let again = sweep(&file, &out, &[]);
    assert!(again.code == 3 && again.said.contains("0 completed, 1 failed, 2 completed before"), "{}", again.said);
}

#[test]
fn a_scene_that_cannot_be_discretised_is_a_failure_of_its_case() {
    let directory = tempfile::tempdir().expect("a directory");
    let text = format!(
        "scene = {:?}\n[set]\ntime.end = 0.1\noutput.plots = false\n[grid]\ntime.step = [0.05, 0.025]\n\
         initial.displacement = [[\"-2*X\", \"0\"], [\"0\", \"0\"]]\n",
        example("impact-hyperelastic").display().to_string()
    );
    let (file, out) = written(directory.path(), &text);
    let answer = sweep(&file, &out, &["--jobs", "2"]);
    assert_eq!(answer.code, 3, "{}{}", answer.said, answer.complained);
    let table = rows(&out.join("cases.csv"));
    assert_eq!(
        table.iter().map(|row| row["status"].as_str()).collect::<Vec<_>>(),
        ["failed", "completed", "failed", "completed"]
    );
    assert!(table[0]["message"].contains("reduce the initial displacement"), "{:?}", table[0]);
    let report = Report::read(&out.join("case-0001")).expect("a report");
    assert!(report.status == Status::Failed && report.provenance.scene.contains("-2*X"), "{report:?}");
}

#[test]
fn interrupting_stops_all_cases_and_keeps_what_they_have() {
    let directory = tempfile::tempdir().expect("a directory");
    let text = format!(
        "scene = {:?}\n[set]\ntime.end = 100\noutput.interval = 10\noutput.plots = false\n[grid]\ntime.step = [0.01, 0.02, 0.005]\n",
        example("bar-smooth").display().to_string()
    );
    let (file, out) = written(directory.path(), &text);
    let mut started = command(&["sweep".as_ref(), file.as_os_str(), "--out".as_ref(), out.as_os_str()]);
    let mut running = started
        .args(["--jobs", "2"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let begin = Instant::now();
    let lines =
        |case: &str| fs::read_to_string(out.join(case).join("history.csv")).map_or(0, |text| text.lines().count());
    while lines("case-0001") < 20 || lines("case-0002") < 20 {
        assert!(begin.elapsed() < Duration::from_secs(60), "no steps in a minute");
        assert!(running.try_wait().expect("a process").is_none(), "it ended by itself");
        sleep(Duration::from_millis(20));
    }
    let sent = Command::new("kill").args(["-INT", &running.id().to_string()]).status().expect("kill");
    assert!(sent.success());
    let output = running.wait_with_output().expect("an end");
    assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(String::from_utf8_lossy(&output.stdout).contains("interrupted: 0 completed, 0 failed"));
    for case in ["case-0001", "case-0002"] {
        assert_eq!(readable(&out.join(case)).status, Status::Interrupted, "{case}");
    }
    assert!(!out.join("case-0003").exists());
    let table = rows(&out.join("cases.csv"));
    assert_eq!(
        table.iter().map(|row| row["status"].as_str()).collect::<Vec<_>>(),
        ["interrupted", "interrupted", "missing"]
    );
    let plan = sweep(&file, &out, &["--dry-run"]);
    assert!(plan.said.contains("case-0002  go on: interrupted"), "{}", plan.said);
    // They go on, and end with the bits of a case that nobody disturbed.
    let again = sweep(&file, &out, &["--jobs", "2"]);
    assert!(again.code == 0 && again.said.contains("done: 3 completed"), "{}{}", again.said, again.complained);
    let reports = ["case-0001", "case-0002", "case-0003"].map(|case| readable(&out.join(case)));
    let from: Vec<bool> = reports.iter().map(|report| !report.provenance.parent_checkpoint.is_empty()).collect();
    assert_eq!(from, [true, true, false]);
    let undisturbed = directory.path().join("undisturbed");
    assert_eq!(sweep(&file, &undisturbed, &["--index", "1", "--quiet"]).code, 0);
    for file in ["history.csv", "probes.csv", "fields-00010.vtu"] {
        let bytes = |directory: &Path| fs::read(directory.join("case-0001").join(file)).expect(file);
        assert!(bytes(&out) == bytes(&undisturbed), "{file} differs");
    }
}

#[test]
fn orders_of_convergence_are_printed_written_and_drawn() {
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().join("orders");
    let answer = sweep(&study("manufactured-orders"), &out, &[]);
    assert_eq!(answer.code, 0, "{}", answer.complained);
    assert!(answer.said.contains("errors.displacement.l2\n") && answer.said.contains("errors.displacement.linf\n"));
    let table = rows(&out.join("convergence.csv"));
    assert_eq!(table.len(), 6);
    for at in [1, 2, 4, 5] {
        assert!((number(&table[at], "order") - 2.0).abs() < 0.1, "{:?}", table[at]);
        assert_eq!(table[at]["reference"], "itself");
    }
    // Size, error and order belong together.
    let by_hand = (number(&table[1], "error") / number(&table[2], "error")).log2();
    assert!((number(&table[2], "order") - by_hand).abs() < 1e-12);
    assert_eq!(
        number(&table[2], "error"),
        Report::read(&out.join("case-0003")).expect("a report").errors["displacement"].l2
    );
    assert_eq!(rows(&out.join("cases.csv"))[1]["time.step"], "0.0004");
    let picture = fs::read_to_string(out.join("convergence.svg")).expect("a picture");
    assert!(picture.matches("<polyline").count() >= 4 && picture.contains("errors.displacement.linf"), "{picture}");
    assert!(out.join("convergence.png").exists());
}

#[test]
fn a_limit_is_extrapolated_where_none_is_known() {
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().join("tip");
    let answer = sweep(&study("beam-tip"), &out, &[]);
    assert_eq!(answer.code, 0, "{}", answer.complained);
    assert!(answer.said.contains("extrapolated from the three finest levels with order 2.47"), "{}", answer.said);
    let table = rows(&out.join("convergence.csv"));
    // Turek and Hron 2006: −66.1029 mm; three, five and nine particles across leave 0.15 %.
    let limit = number(&table[2], "limit");
    assert!((limit / -0.066_102_9 - 1.0).abs() < 1.5e-3, "{limit}");
    let values: Vec<f64> = table.iter().map(|row| number(row, "value")).collect();
    let ratio = (values[0] - values[1]) / (values[1] - values[2]);
    assert!((number(&table[2], "order") - ratio.log2()).abs() < 1e-9);
    assert!((limit - (values[2] + (values[2] - values[1]) / (ratio - 1.0))).abs() < 1e-12);
}

#[test]
fn every_row_of_a_grid_has_its_own_orders_and_an_exact_value_may_be_given() {
    let directory = tempfile::tempdir().expect("a directory");
    let text = format!(
        "scene = {:?}\n[set]\ntime.end = 1.2\noutput.plots = false\n[grid]\ntime.scheme = [\"crank_nicolson\", \"backward_euler\"]\n\
         [convergence]\nquantity = [\"probes.tip.displacement.0\", \"errors.displacement.l2\"]\nexact = {}\n\
         refine.time.step = [0.02, 0.01, 0.005]\n",
        example("bar-smooth").display().to_string(),
        // The standing wave at the tip; what is left of it is the error in space.
        (1.2 * std::f64::consts::PI / 20.0 * 1000f64.sqrt()).sin() / (std::f64::consts::PI / 20.0 * 1000f64.sqrt()),
    );
    let (file, out) = written(directory.path(), &text);
    let answer = sweep(&file, &out, &[]);
    assert_eq!(answer.code, 0, "{}", answer.complained);
    assert_eq!(answer.said.matches("errors against the exact value").count(), 2, "{}", answer.said);
    assert!(answer.said.contains("time.step"), "the size has its name: {}", answer.said);
    let table = rows(&out.join("convergence.csv"));
    assert_eq!(table.len(), 12);
    assert_eq!(table[3]["row"], "time.scheme = \"backward_euler\"");
    assert_eq!(table.iter().map(|row| row["reference"].as_str()).collect::<Vec<_>>()[5..7], ["exact", "itself"]);
    // Backward Euler is of first order.
    assert!((number(&table[11], "order") - 1.0).abs() < 0.15, "{:?}", table[11]);
}

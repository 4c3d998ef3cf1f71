//! Why a step took what it took: the table, the JSON lines, several monitors, and the exported tangent.

use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::AtomicBool;

use nicolson::output::{Report, Status};
use nicolson::scene::Scene;
use nicolson::simulation::diagnostics::{Monitors, SolveLog, SolveTable};
use nicolson::simulation::{Monitor, Outcome, Progress, RunOptions, first_tangent, prepare, run};
use serde_json::Value;

/// A bar that is let go, with the end of its `[time]` table still open.
const BAR: &str = "dimension = 1\n[[body]]\nspacing = 0.25\nshape.box = { lower = [0], upper = [2] }\n\
    material.hyperelastic_volumetric = { density = 1000, gamma = 7, wave_speed = 10 }\n[initial]\n\
    velocity = [\"-0.5*X\"]\n[[boundary]]\nname = \"wall\"\nselect.where = \"X < 0.1\"\nfix = [\"x\"]\n[time]\nend = 0.4\n";

fn scene(more: &str) -> Scene {
    Scene::parse(&format!("{BAR}{more}"), "bar.toml", Path::new(""), &[]).unwrap_or_else(|errors| panic!("{errors}"))
}

fn listen(scene: &Scene, monitor: &mut dyn Monitor) -> Outcome {
    run(scene, &RunOptions::default(), monitor, &AtomicBool::new(false)).unwrap()
}

fn logged(scene: &Scene) -> (Vec<Value>, Report) {
    let mut log = SolveLog::new(Vec::new());
    let report = listen(scene, &mut log).report;
    let text = String::from_utf8(log.into_inner()).unwrap();
    (text.lines().map(|line| serde_json::from_str(line).unwrap()).collect(), report)
}

fn events<'a>(lines: &'a [Value], name: &str) -> Vec<&'a Value> {
    lines.iter().filter(|line| line["event"] == name).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn the_log_has_every_step_with_its_history() {
    // The automatic solver may go on with a factor where Newton's method asks for a new one; LU does as it is told.
    let (lines, report) = logged(&scene("step = 0.05\n[linear]\nsolver = \"lu\"\n"));
    assert_eq!((&lines[0]["event"], &lines[lines.len() - 1]["event"]), (&"start".into(), &"end".into()));
    let steps = events(&lines, "step");
    assert_eq!((lines.len(), steps.len(), report.steps.accepted), (10, 8, 8));
    let (mut iterations, mut factorisations) = (0, 0);
    for (index, step) in steps.iter().enumerate() {
        assert_eq!(step["step"], index + 1);
        assert!((number(&step["time"]) - 0.05 * (index + 1) as f64).abs() < 1e-12);
        let solve = &step["solves"][0];
        let history = solve["history"].as_array().unwrap();
        assert_eq!(history.len() as u64, solve["iterations"].as_u64().unwrap() + 1);
        for (before, after) in history.iter().zip(&history[1..]) {
            let ratio = number(&after["residual"]) / number(&before["residual"]);
            assert!((ratio / number(&after["contraction"]) - 1.0).abs() < 1e-12);
            assert_eq!((number(&after["step_length"]), after["trials"].as_u64()), (1.0, Some(1)));
            assert!(after["tangent"] == "every iteration" || after["tangent"] == "first", "{after}");
            assert!(number(&after["forcing"]) > 0.0 && number(&after["linear_residual"]) < 1e-10);
        }
        iterations += step["newton_iterations"].as_u64().unwrap();
        let causes = solve["work"]["factorisations"].as_object().unwrap();
        factorisations += causes.values().map(|count| count.as_u64().unwrap()).sum::<u64>();
        assert_eq!((&step["tries"], &step["failed_solves"]), (&Value::Array(vec![]), &Value::Array(vec![])));
    }
    assert_eq!(iterations as usize, report.newton.iterations);
    assert_eq!(factorisations as usize, report.linear.factorisations);
    assert_eq!(lines[lines.len() - 1]["status"], "completed");
}

#[test]
fn failed_tries_are_logged_with_their_causes() {
    // Two iterations are too few for the whole step, and enough for a part of it.
    let (lines, report) = logged(&scene("step = 0.2\n[newton]\nmax_iterations = 2\n"));
    assert_eq!(report.status, Status::Completed);
    let rejected: Vec<&Value> =
        events(&lines, "step").into_iter().filter(|step| step["tries"][0].is_object()).collect();
    assert!(!rejected.is_empty());
    let tries = rejected[0]["tries"].as_array().unwrap();
    assert_eq!(rejected[0]["rejected"]["newton"].as_u64(), Some(tries.len() as u64));
    assert_eq!((number(&tries[0]["length"]), &tries[0]["cause"]), (0.2, &"newton".into()));
    assert_eq!(tries[0]["solve"]["cause"], "iteration limit");
    assert_eq!(tries[0]["solve"]["history"].as_array().unwrap().len(), 3);
    assert!(tries[0]["solve"]["worst"][0]["description"].as_str().unwrap().contains("particle"));

    let (lines, report) = logged(&scene("step = 0.2\nminimum_step = 0.1\n[newton]\nmax_iterations = 1\n"));
    assert_eq!(report.status, Status::Failed);
    let failures = events(&lines, "failure");
    assert_eq!((failures.len(), &failures[0]["cause"]), (1, &"newton".into()));
    assert!(!failures[0]["tries"].as_array().unwrap().is_empty());
    let end = &lines[lines.len() - 1];
    assert_eq!((&end["event"], &end["status"]), (&"end".into(), &"failed".into()));
    assert!(end["message"].as_str().unwrap().contains("limit of 1 iterations"));
}

/// Starts that failed before another one led to the solution are in the log: steps of 200 explicit ones, some of
/// which cannot begin from the extrapolated motion.
#[test]
fn starts_that_failed_are_logged() {
    let overrides = [("time.step", "1.5"), ("time.end", "60"), ("time.scheme", "\"energy_momentum\"")];
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    let scene = Scene::read(Path::new("examples/piston-hyperelastic.toml"), &overrides).unwrap();
    let (lines, report) = logged(&scene);
    assert_eq!((report.status, report.steps.rejected), (Status::Completed, 0), "{:?}", report.message);
    let repaired: Vec<&Value> =
        events(&lines, "step").into_iter().filter(|step| step["failed_solves"][0].is_object()).collect();
    assert!(!repaired.is_empty());
    for step in repaired {
        let failed = &step["failed_solves"][0];
        assert!(failed["cause"].is_string() && failed["message"].is_string(), "{failed}");
        assert!(step["newton_iterations"].as_u64() >= step["solves"][0]["iterations"].as_u64());
    }
}

#[test]
fn the_table_has_a_line_per_step() {
    let table = |scene: &Scene| {
        let mut table = SolveTable::new(Vec::new());
        let report = listen(scene, &mut table).report;
        (String::from_utf8(table.into_inner()).unwrap(), report)
    };
    let (text, _) = table(&scene("step = 0.05\n[newton]\ntangent = \"modified\"\n[linear]\nsolver = \"lu\"\n"));
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 2 + 8 + 2, "{text}");
    assert!(lines[1].contains("contraction") && lines[1].contains("factorisations"), "{text}");
    assert!(lines[2].trim_start().starts_with("1 ") && lines[2].contains("1 (first 1)"), "{text}");
    assert!(lines[4].contains("1 (new step 1)"), "{text}");
    assert!(lines[10].starts_with("8 steps, rejected tries 0"), "{text}");
    assert!(lines[11].contains("new step 7") && lines[11].contains("LU"), "{text}");

    let (text, report) = table(&scene("step = 0.2\nminimum_step = 0.1\n[newton]\nmax_iterations = 1\n"));
    assert!(
        text.contains("failed after") && text.contains("rejected Δt = 2.000e-1 s: Newton's method failed"),
        "{text}"
    );
    assert!(report.message.unwrap().contains("limit of 1 iterations"));

    let (text, report) = table(&scene("scheme = \"rkc\"\nstep = 0.01\nadaptive = { tolerance = 1e-3 }\n"));
    let rows: Vec<&str> = text.lines().filter(|line| line.contains("of the tolerance")).collect();
    assert_eq!(rows.len(), report.steps.accepted, "{text}");
    assert!(text.contains("stages"), "{text}");
}

/// Remembers what had been written at every flush.
#[derive(Default)]
struct Flushed {
    written: Vec<u8>,
    flushed: Vec<usize>,
}

impl Write for Flushed {
    fn write(&mut self, data: &[u8]) -> io::Result<usize> {
        self.written.extend_from_slice(data);
        Ok(data.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.flushed.push(self.written.len());
        Ok(())
    }
}

#[test]
fn every_line_is_flushed_at_once() {
    let mut log = SolveLog::new(Flushed::default());
    listen(&scene("step = 0.1\n"), &mut log);
    let Flushed { written, flushed } = log.into_inner();
    assert_eq!(flushed.len(), written.iter().filter(|byte| **byte == b'\n').count());
    assert!(flushed.iter().all(|&length| written[length - 1] == b'\n'));
}

/// Takes so many bytes and no more.
struct Full(usize);

impl Write for Full {
    fn write(&mut self, data: &[u8]) -> io::Result<usize> {
        self.0 = self.0.checked_sub(data.len()).ok_or_else(|| io::Error::other("the disk is full"))?;
        Ok(data.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn several_monitors_hear_the_same_and_a_full_disk_stops_no_run() {
    #[derive(Default)]
    struct Count(usize);
    impl Monitor for Count {
        fn stepped(&mut self, _: &Progress<'_>) {
            self.0 += 1;
        }
    }
    let (mut first, mut second, mut log) = (Count::default(), Count::default(), SolveLog::new(Full(1500)));
    let mut all = Monitors::new().with(&mut first).with(&mut log).with(&mut second).with_optional(None::<&mut Count>);
    let outcome = listen(&scene("step = 0.05\n"), &mut all);
    assert_eq!((outcome.report.status, first.0, second.0), (Status::Completed, 8, 8));
    assert!(log.take_error().unwrap().to_string().contains("full"));
}

/// Entries of a Matrix Market file.
fn read_matrix(path: &Path) -> (usize, Vec<(usize, usize, f64)>) {
    let text = std::fs::read_to_string(path).unwrap();
    assert!(text.starts_with("%%MatrixMarket matrix coordinate real general"), "{text:.80}");
    let mut lines = text.lines().filter(|line| !line.starts_with('%'));
    let head: Vec<usize> = lines.next().unwrap().split_whitespace().map(|word| word.parse().unwrap()).collect();
    let entry = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        (words[0].parse::<usize>().unwrap() - 1, words[1].parse::<usize>().unwrap() - 1, words[2].parse().unwrap())
    };
    let entries: Vec<_> = lines.map(entry).collect();
    assert_eq!((head[0], head[2]), (head[1], entries.len()));
    (head[0], entries)
}

fn command(words: &[&str]) -> u8 {
    nicolson::cli::run(std::iter::once("nicolson").chain(words.iter().copied()).map(Into::into))
}

#[test]
fn the_tangent_of_the_first_step_can_be_exported() {
    let directory = tempfile::tempdir().unwrap();
    let (path, file) = (directory.path().join("tangent.mtx"), directory.path().join("bar.toml"));
    std::fs::write(&file, format!("{BAR}step = 0.1\n")).unwrap();
    let words = ["jacobian", file.to_str().unwrap(), "--json", "--export-tangent", path.to_str().unwrap()];
    assert_eq!(command(&words), 0);
    let (size, entries) = read_matrix(&path);
    let mut prepared = prepare::<1>(&scene("step = 0.1\n")).unwrap();
    let before = prepared.state.clone();
    let matrix = first_tangent(&mut prepared).unwrap();
    assert_eq!((size, matrix.values().len()), (8, entries.len()));
    assert!(entries.iter().all(|&(row, column, value)| matrix.get(row, column) == value));
    assert_eq!(prepared.state, before);
    // Crank–Nicolson with Δt and backward Euler with Δt/2 have the same shift. Δt is small enough that the
    // different starting points do not matter at the first iterate, where the tangent is m + s² K at rest.
    let at_rest = |more: &str| {
        let text = format!("{BAR}{more}").replace("-0.5*X", "0");
        let scene = Scene::parse(&text, "bar.toml", Path::new(""), &[]).unwrap();
        first_tangent(&mut prepare::<1>(&scene).unwrap()).unwrap()
    };
    let trapezium = at_rest("step = 0.1\n");
    let euler = at_rest("step = 0.05\nscheme = \"backward_euler\"\n");
    assert_eq!(trapezium.values(), euler.values());
    // Mass of an inner particle 250 kg, and stiffness on top of it.
    assert!(trapezium.get(3, 3) > 250.0);

    assert_eq!(command(&[&words[..2], &["--set", "time.scheme=rk4", "--export-tangent", "no.mtx"]].concat()), 2);
    assert_eq!(command(&[&words[..2], &["--export-tangent", "/nowhere/tangent.mtx"]].concat()), 3);
}

#[test]
fn the_command_line_writes_the_log() {
    let directory = tempfile::tempdir().unwrap();
    let place = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(place("bar.toml"), format!("{BAR}step = 0.1\n")).unwrap();
    let (scene, out, log) = (place("bar.toml"), place("out"), place("log.jsonl"));
    let words = ["run", &scene, "--quiet", "--out", &out, "--solve-log"];
    assert_eq!(command(&[&words[..], &[&log, "--solve-report"]].concat()), 0);
    let text = std::fs::read_to_string(&log).unwrap();
    assert_eq!(text.lines().filter(|line| line.contains("\"event\":\"step\"")).count(), 4);
    assert_eq!(command(&[&words[..], &["/nowhere/log.jsonl"]].concat()), 2);
}

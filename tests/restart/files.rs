//! The command in the directory of a run: signals, and the files that go on as if nothing had happened.

use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use nicolson::output::{Report, Status};
use nicolson::simulation::Checkpoint;

use super::support::{Case, checkpoints, results, start, timeless};

/// What a command left behind.
pub struct Answer {
    pub code: i32,
    pub said: String,
    pub complained: String,
}

pub fn command(arguments: &[&OsStr]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_nicolson"));
    command.args(arguments);
    command
}

pub fn nicolson<S: AsRef<OsStr>>(arguments: &[S]) -> Answer {
    let arguments: Vec<&OsStr> = arguments.iter().map(AsRef::as_ref).collect();
    let output = command(&arguments).output().expect("the program starts");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    let answer =
        Answer { code: output.status.code().unwrap_or(-1), said: text(output.stdout), complained: text(output.stderr) };
    assert!(!answer.complained.contains("panicked"), "{}", answer.complained);
    answer
}

/// A bar whose steps take long enough to be interrupted, with everything written that can be.
pub const BAR: &str = r#"
title = "Bar"
dimension = 2
[[body]]
counts = [21, 4]
shape.box = { lower = [0, 0], upper = [2, 0.3] }
smoothing = 1.0
material.neo_hookean = { density = 1000, youngs_modulus = 2e6, poissons_ratio = 0.3 }
[[boundary]]
select.where = "X < 1e-9"
fix = ["x", "y"]
[initial]
velocity = ["0", "0.3*X"]
[time]
step = 0.005
end = 0.5
[newton]
tangent = "lagged"
[output]
interval = 0.05
[checkpoint]
every_steps = 10
[[probe]]
name = "tip"
at = [2, 0.3]
"#;

fn write_scene(directory: &Path, text: &str) -> std::path::PathBuf {
    let path = directory.join("bar.toml");
    fs::write(&path, text).expect("a scene");
    path
}

fn rows(directory: &Path) -> usize {
    fs::read_to_string(directory.join("history.csv")).map_or(0, |text| text.lines().count())
}

/// Waits until a run has written so many rows.
fn wait_for(running: &mut Child, directory: &Path, count: usize) {
    let begin = Instant::now();
    while rows(directory) < count {
        assert!(begin.elapsed() < Duration::from_secs(120), "no rows in two minutes");
        assert!(running.try_wait().expect("a process").is_none(), "it ended by itself");
        sleep(Duration::from_millis(5));
    }
}

fn send(signal: &str, running: &Child) {
    let sent = Command::new("kill").args([signal, &running.id().to_string()]).status().expect("kill");
    assert!(sent.success());
}

fn run_command(scene: &Path, out: &Path, more: &[&str]) -> Command {
    let mut started = command(&["run".as_ref(), scene.as_os_str(), "--out".as_ref(), out.as_os_str()]);
    started.args(["--quiet", "--threads", "1"]).args(more).stderr(Stdio::piped());
    started
}

/// The lines of a solve log without what the clock says.
fn log_lines(path: &Path) -> Vec<String> {
    let clock = |line: &str| {
        let mut value: serde_json::Value = serde_json::from_str(line).expect("JSON");
        value["wall_seconds"] = serde_json::Value::Null;
        for solve in value["solves"].as_array_mut().into_iter().flatten() {
            for key in ["factorisation_seconds", "solve_seconds"] {
                solve["work"][key] = serde_json::Value::Null;
            }
        }
        value.to_string()
    };
    fs::read_to_string(path).expect("a log").lines().map(clock).collect()
}

#[test]
fn signals_interrupt_and_the_directory_goes_on_to_the_same_bytes() {
    let place = tempfile::tempdir().expect("a directory");
    let scene = write_scene(place.path(), BAR);
    let whole = place.path().join("whole");
    let log = place.path().join("whole.jsonl");
    let status = run_command(&scene, &whole, &["--solve-log", &log.display().to_string()]).status().expect("a run");
    assert!(status.success());
    for signal in ["-INT", "-TERM"] {
        let out = place.path().join(format!("out{signal}"));
        let own_log = place.path().join(format!("log{signal}.jsonl"));
        let mut running =
            run_command(&scene, &out, &["--solve-log", &own_log.display().to_string()]).spawn().expect("a run");
        wait_for(&mut running, &out, 25);
        send(signal, &running);
        let output = running.wait_with_output().expect("an end");
        assert_eq!(output.status.code(), Some(130), "{signal}");
        let report = Report::read(&out).expect("a report");
        assert_eq!(report.status, Status::Interrupted);
        let all = checkpoints(&out);
        assert_eq!(all.len(), 2, "{all:?}");
        let last = Checkpoint::read(&all[1]).expect("a checkpoint");
        // Where the signal came as one was due anyway, that one serves.
        let cause = if last.about.step.is_multiple_of(10) { "steps" } else { "interrupt" };
        assert_eq!((last.about.cause.as_str(), last.about.step), (cause, report.steps.accepted));

        let answer = nicolson(&["restart".as_ref(), out.as_os_str(), "--threads".as_ref(), "2".as_ref()]);
        assert_eq!(answer.code, 0, "{}", answer.complained);
        assert!(answer.complained.contains("going on from step"), "{}", answer.complained);
        let (found, expected) = (results(&out), results(&whole));
        assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
        for (name, bytes) in &expected {
            assert!(found[name] == *bytes, "{signal}: {name} differs");
        }
        let (one, other) = (Report::read(&out).expect("a report"), Report::read(&whole).expect("a report"));
        assert_eq!(timeless(&one), timeless(&other));
        assert!(one.provenance.parent_checkpoint.contains("step-00000000"), "{:?}", one.provenance);
        assert!(one.wall_seconds.total > report.wall_seconds.total, "the parts do not add up");
        assert_eq!(log_lines(&own_log), log_lines(&log), "{signal}");
    }
}

#[test]
fn a_signal_asks_for_a_checkpoint_and_the_run_goes_on() {
    let place = tempfile::tempdir().expect("a directory");
    let scene = write_scene(place.path(), &BAR.replace("every_steps = 10", ""));
    let out = place.path().join("out");
    let mut running = run_command(&scene, &out, &[]).spawn().expect("a run");
    wait_for(&mut running, &out, 20);
    assert!(checkpoints(&out).is_empty());
    send("-USR1", &running);
    assert!(running.wait().expect("an end").success());
    let causes: Vec<String> =
        checkpoints(&out).iter().map(|path| Checkpoint::read(path).expect("a checkpoint").about.cause).collect();
    assert_eq!(causes, ["signal", "end"]);
}

#[test]
fn a_complete_run_goes_on_to_a_later_end() {
    let place = tempfile::tempdir().expect("a directory");
    let at = |name: &str| place.path().join(name);
    let case = Case::solid("crank_nicolson").newton("tangent", "lagged").set("checkpoint", "{ keep = 1 }");
    let half = start(&case.clone().set("time.end", "0.08").scene(), &at("half"));
    let whole = start(&case.scene(), &at("whole"));
    let half_place = at("half");
    let answer = nicolson(&[half_place.as_os_str().to_owned()].map(|path| vec!["restart".into(), path]).concat());
    // Already there: nothing to do, and nothing changes.
    assert_eq!(answer.code, 0, "{}", answer.complained);
    assert_eq!(Report::read(&half_place).expect("a report").steps, half.report.steps);
    let answer = nicolson(&["restart".as_ref(), half_place.as_os_str(), "--set".as_ref(), "time.end=0.16".as_ref()]);
    assert_eq!(answer.code, 0, "{}", answer.complained);
    for name in ["history.csv", "probes.csv", "fields.pvd"] {
        let read = |directory: &str| fs::read_to_string(at(directory).join(name)).expect("a file");
        assert_eq!(read("half"), read("whole"), "{name}");
    }
    let state = Checkpoint::find(&at("half")).expect("a checkpoint").0.arrays.part("state");
    let bits: Vec<u64> = state.reals("values").expect("values").iter().map(|x| x.to_bits()).collect();
    assert_eq!(bits, whole.state.iter().map(|x| x.to_bits()).collect::<Vec<_>>());
    let report = Report::read(&half_place).expect("a report");
    assert_eq!(report.newton, whole.report.newton);
    assert_eq!(report.linear, whole.report.linear);
}

#[test]
fn a_failure_leaves_the_last_good_state() {
    let place = tempfile::tempdir().expect("a directory");
    let out = place.path().join("out");
    let case = Case::solid("crank_nicolson").set("newton.max_iterations", "1").set("time.minimum_step", "0.02");
    let outcome = start(&case.scene(), &out);
    assert_eq!(outcome.report.status, Status::Failed);
    let (checkpoint, _) = Checkpoint::find(&out).expect("a checkpoint");
    assert_eq!(checkpoint.about.cause, "failure");
    assert_eq!(checkpoint.about.time, outcome.report.time_reached);
    // With more iterations it goes on, if that is forced.
    let more = ["restart".as_ref(), out.as_os_str(), "--set".as_ref(), "newton.max_iterations=25".as_ref()];
    assert_eq!(nicolson(&more).code, 2);
    let answer = nicolson(&[&more[..], &["--force".as_ref()]].concat());
    assert_eq!(answer.code, 0, "{}", answer.complained);
    let report = Report::read(&out).expect("a report");
    assert_eq!((report.status, report.time_reached), (Status::Completed, 0.16));
}

#[test]
fn a_disk_that_refuses_a_checkpoint_leaves_the_older_ones() {
    let place = tempfile::tempdir().expect("a directory");
    let scene = write_scene(place.path(), BAR);
    let whole = place.path().join("whole");
    assert!(run_command(&scene, &whole, &[]).status().expect("a run").success());
    let out = place.path().join("out");
    let mut running = run_command(&scene, &out, &[]).spawn().expect("a run");
    wait_for(&mut running, &out, 25);
    send("-INT", &running);
    running.wait().expect("an end");
    let before = checkpoints(&out);
    // No file may be as long as a checkpoint: as on a full disk, writing ends in an error.
    let limit = fs::metadata(&before[1]).expect("a file").len() / 1024 - 1;
    let changes = "--set output.plots=false --set output.interval=10";
    let script = format!("trap '' XFSZ; ulimit -f {limit}; exec \"$0\" restart \"$1\" --quiet {changes}");
    let output = Command::new("bash").args(["-c", &script, env!("CARGO_BIN_EXE_nicolson")]).arg(&out).output();
    let output = output.expect("a shell");
    let complained = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{complained}");
    assert!(complained.contains(".safetensors"), "{complained}");
    assert_eq!(checkpoints(&out), before);
    before.iter().for_each(|path| drop(Checkpoint::read(path).unwrap_or_else(|error| panic!("{error}"))));
    assert_eq!(Report::read(&out).expect("a report").status, Status::Failed);
    // The disk has room again.
    let answer = nicolson(&["restart".as_ref(), out.as_os_str(), "--quiet".as_ref()]);
    assert_eq!(answer.code, 0, "{}", answer.complained);
    assert!(answer.said.is_empty());
    let (found, expected) = (results(&out), results(&whole));
    for (name, bytes) in &expected {
        assert!(found[name] == *bytes, "{name} differs");
    }
}

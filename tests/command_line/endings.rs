//! How runs end: completed, interrupted, failed.

use std::fs;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use nicolson::output::Status;

use super::{command, example, nicolson, readable, run, table};

#[test]
fn quiet_says_nothing_and_the_default_says_what_happened() {
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().join("quiet");
    let answer = run(&example("dam-break"), &out, &["time.end=0.05"], &["--quiet", "--threads", "2"]);
    assert_eq!((answer.code, answer.said.as_str(), answer.complained.as_str()), (0, "", ""));
    assert_eq!(readable(&out).status, Status::Completed);
    let answer = run(&example("dam-break"), &out, &["time.end=0.05"], &["--threads", "1"]);
    assert_eq!(answer.code, 0);
    for part in ["done: t = 0.05 s, 5 steps", "Newton iterations", "probe front", "energy:", "time:", "results in "] {
        assert!(answer.said.contains(part), "{part}: {}", answer.said);
    }
    assert!(answer.complained.contains("121 particles"), "{}", answer.complained);
}

#[test]
fn results_go_below_the_working_directory_unless_told_otherwise() {
    let directory = tempfile::tempdir().expect("a directory");
    let scene = example("bar-smooth");
    let mut started =
        command(&["run".as_ref(), scene.as_os_str(), "--set".as_ref(), "time.end=0.1".as_ref(), "--quiet".as_ref()]);
    assert!(started.current_dir(directory.path()).status().expect("the program starts").success());
    assert_eq!(readable(&directory.path().join("results").join("bar-smooth")).status, Status::Completed);
}

#[test]
fn a_directory_with_spaces_and_accents_is_as_good_as_any() {
    let directory = tempfile::tempdir().expect("a directory");
    let inside = directory.path().join("Größe & Höhe, été");
    fs::create_dir(&inside).expect("a directory");
    let scene = inside.join("stoß im kanal.toml");
    fs::copy(example("dam-break"), &scene).expect("a copy");
    let out = inside.join("Ergebnisse für é/neu");
    let answer = run(&scene, &out, &["time.end=0.03"], &["--quiet"]);
    assert_eq!((answer.code, answer.complained.as_str()), (0, ""));
    let report = readable(&out);
    assert_eq!(report.status, Status::Completed);
    assert!(report.provenance.command.contains("stoß im kanal.toml"), "{}", report.provenance.command);
    assert!(out.join("particles.png").exists() && out.join("probe-front.svg").exists());
}

#[test]
fn interrupting_keeps_the_results_so_far() {
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().join("long");
    let scene = example("bar-smooth");
    let arguments = ["--set", "time.end=1e5", "--set", "output.interval=1e4", "--quiet", "--threads", "1"];
    let mut started = command(&["run".as_ref(), scene.as_os_str(), "--out".as_ref(), out.as_os_str()]);
    let mut running = started.args(arguments).stderr(Stdio::piped()).spawn().expect("the program starts");
    // Wait until it steps: a signal before the handler is set would end it the hard way.
    let begin = Instant::now();
    let rows = || fs::read_to_string(out.join("history.csv")).map_or(0, |text| text.lines().count());
    while rows() < 20 {
        assert!(begin.elapsed() < Duration::from_secs(60), "no steps in a minute");
        assert!(running.try_wait().expect("a process").is_none(), "it ended by itself");
        sleep(Duration::from_millis(20));
    }
    let sent = Command::new("kill").args(["-INT", &running.id().to_string()]).status().expect("kill");
    assert!(sent.success());
    let output = running.wait_with_output().expect("an end");
    assert_eq!(output.status.code(), Some(130));
    let complained = String::from_utf8_lossy(&output.stderr);
    assert!(complained.contains("interrupted at t = "), "{complained}");
    let report = readable(&out);
    assert_eq!(report.status, Status::Interrupted);
    assert!(report.time_reached > 0.0 && report.time_reached < 1e5, "{}", report.time_reached);
    assert!(report.message.is_some_and(|message| message.contains("interrupted")));
    assert!(report.steps.accepted >= 18);
}

/// A piston pressed through its own base: no step leads past t = 5/6, where its volume is gone.
const PRESSED: &str = r#"

[[boundary]]
name = "press"
select.where = "Y > 2.49"
displacement = { y = "-3*t" }
"#;

#[test]
fn a_step_that_converges_at_no_length_is_a_failure_with_results() {
    let directory = tempfile::tempdir().expect("a directory");
    let scene = directory.path().join("pressed.toml");
    let text = fs::read_to_string(example("piston-hyperelastic")).expect("a scene");
    fs::write(&scene, text + PRESSED).expect("a file");
    for (case, overrides) in [
        ("implicit", &["output.interval=0.1"][..]),
        ("explicit", &["time={ scheme = \"tvd_rk2\", cfl = 0.3, end = 10 }"]),
        ("explicit, steps too long", &["time={ scheme = \"tvd_rk2\", step = 0.05, end = 10 }"]),
        ("explicit, without books", &["time={ scheme = \"tvd_rk2\", step = 0.05, end = 10 }", "output.history=false"]),
    ] {
        let out = directory.path().join(case);
        let answer = run(&scene, &out, overrides, &["--quiet"]);
        assert_eq!(answer.code, 3, "{case}: {}", answer.complained);
        assert_eq!(answer.said, "", "{case}");
        let message = answer.complained.trim_end();
        assert_eq!(message.lines().count(), 1, "{case}: one message: {message}");
        // Where, what, which particle, and what to do.
        for part in ["error: ", "t = ", "volume ratio J = ", "at particle ", "; try "] {
            assert!(message.contains(part), "{case}: {part:?} in {message}");
        }
        let report = if case.ends_with("books") {
            nicolson::output::Report::read(&out).expect("a report")
        } else {
            readable(&out)
        };
        assert_eq!(report.status, Status::Failed, "{case}");
        assert_eq!(report.message.as_deref(), message.strip_prefix("error: "), "{case}");
        assert!(report.time_reached < 5.0 / 6.0, "{case}: {}", report.time_reached);
        if case == "implicit" {
            assert!(report.time_reached > 0.8 && report.steps.rejected > 10, "{report:?}");
            let (_, rows) = table(&out.join("history.csv"));
            assert_eq!(rows.len(), report.steps.accepted + 1);
            assert!(out.join("fields-00008.vtu").exists() && out.join("energy.png").exists());
        }
    }
}

/// A Krylov method that stagnates: the cause is in the message, and the start is on disk.
#[test]
fn a_linear_solver_that_stagnates_is_a_failure_with_its_cause() {
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().join("out");
    let overrides =
        ["linear.solver=\"gmres\"", "linear.preconditioner=\"none\"", "linear.max_iterations=2", "time.end=0.1"];
    let answer = run(&example("impact-hyperelastic"), &out, &overrides, &["--quiet"]);
    assert_eq!(answer.code, 3, "{}", answer.complained);
    let report = readable(&out);
    assert_eq!((report.status, report.steps.accepted), (Status::Failed, 0));
    let message = report.message.expect("a message");
    assert!(message.contains("the linear solve failed: no convergence in 2 iterations"), "{message}");
}

#[test]
fn a_full_disk_is_a_failure_and_not_wrong_input() {
    // Linux's own disk that is always full; elsewhere there is nothing to test with.
    if !std::path::Path::new("/dev/full").exists() {
        return;
    }
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().join("full");
    fs::create_dir(&out).expect("a directory");
    std::os::unix::fs::symlink("/dev/full", out.join("history.csv")).expect("a link");
    let answer = run(&example("bar-smooth"), &out, &["time.end=5"], &["--quiet"]);
    assert_eq!(answer.code, 3, "{}", answer.complained);
    assert!(
        answer.complained.contains("history.csv") && answer.complained.contains("free some space"),
        "{}",
        answer.complained
    );
}

#[test]
fn wrong_usage_is_explained() {
    let scene = example("dam-break");
    let scene = scene.to_str().expect("a path");
    for (arguments, part) in [
        (&[][..], "Usage"),
        (&["rum", scene], "rum"),
        (&["run"], "SCENE.toml"),
        (&["run", scene, "--thread", "2"], "--threads"),
        (&["check", scene, "--threads", "many"], "many"),
        (&["check", scene, "--threads", "0"], "at least one thread"),
        (&["check", scene, "--set", "time.step"], "KEY.PATH=VALUE"),
    ] {
        let answer = nicolson(arguments);
        assert_eq!(answer.code, 2, "{arguments:?}");
        assert!(answer.complained.contains(part) && answer.said.is_empty(), "{arguments:?}: {}", answer.complained);
    }
}

//! Scenes that are too large for the machine: alone, in a sweep, and when a run goes on.

use std::collections::HashSet;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use nicolson::study::{Event, Study, SweepOptions, sweep};

use super::{Place, after, scene};

/// Ten million particles in two gigabytes.
#[test]
fn ten_million_particles_are_refused_by_a_small_machine() {
    for (case, changes) in [
        ("a plane, implicit", &[("spacing = 0.25", "counts = [3200, 3200]")][..]),
        ("a plane, explicit", &[("spacing = 0.25", "counts = [3200, 3200]"), ("step = 0.01", "scheme = \"tvd_rk2\"")]),
    ] {
        let place = Place::new();
        place.file("scene.toml", scene(changes));
        for command in ["check", "run"] {
            let answer = super::on_scene(&place, command, &[]);
            let words = ["scene.toml:6:", "1.02e7 particles need about ", " GB of memory, and 2.0 GB are available"];
            super::refused(&place, case, &answer, &words);
            assert!(answer.complained.contains("help: give a larger spacing"), "{}", answer.complained);
            assert!(answer.complained.contains("--ignore-memory"), "{}", answer.complained);
            let lighter = answer.complained.contains("matrix_free");
            assert_eq!(lighter, case.contains("implicit"), "{}", answer.complained);
        }
    }
}

#[test]
fn the_limit_can_be_ignored_and_is_shown() {
    let place = Place::new();
    // Refused with so little, although it fits.
    let text = scene(&[("spacing = 0.25", "counts = [300, 300]"), ("step = 0.01", "scheme = \"tvd_rk2\"")]);
    place.file("scene.toml", text);
    let limits = "ulimit -v 900000";
    let arguments = ["check", "scene.toml", "--threads", "1"];
    let answer = after(limits, &place.path(""), &arguments);
    assert_eq!(answer.code, 0, "{}", answer.complained);
    let line = answer.said.lines().find(|line| line.starts_with("memory (available)")).expect("a line");
    let megabytes: f64 = line.split_whitespace().nth(2).and_then(|word| word.parse().ok()).expect("a number");
    assert!(megabytes < 930.0, "{line}");
    let answer = after(limits, &place.path(""), &[&arguments[..], &["--ignore-memory"]].concat());
    assert_eq!(answer.code, 0, "{}", answer.complained);
    assert!(!answer.said.contains("memory (available)"), "{}", answer.said);
}

/// A case that alone needs too much is refused with its number, before any case runs.
#[test]
fn a_sweep_refuses_the_case_that_does_not_fit() {
    let place = Place::new();
    place.file("study.toml", "scene = \"scene.toml\"\n[grid]\nbody.0.spacing = [0.25, 0.0003125, 0.2]\n");
    let answer = super::nicolson(&place.path(""), &["sweep", "study.toml", "--out", "out"]);
    let words = ["study.toml:3:", "1.02e7 particles need about ", "2.0 GB are available (case 2: ", "--ignore-memory"];
    super::refused(&place, "a sweep", &answer, &words);
    assert!(!answer.complained.contains("case 1") && !answer.complained.contains("case 3"), "{}", answer.complained);
    // The one that fits may run alone.
    let answer = super::nicolson(&place.path(""), &["sweep", "study.toml", "--out", "out", "--index", "3", "--quiet"]);
    super::done("one case of it", &answer);
}

/// Four cases of which two fit into memory beside each other. Where their results should be is a file, so that none of them
/// is really computed.
#[test]
fn a_sweep_says_that_fewer_cases_run_at_a_time() {
    let place = Place::new();
    place.file("study.toml", "scene = \"scene.toml\"\n[grid]\nbody.0.spacing = [0.004, 0.0041, 0.0039, 0.2]\n");
    std::fs::create_dir(place.path("out")).expect("a directory");
    (1..=4).for_each(|case| drop(place.file(format!("out/case-000{case}"), "")));
    let arguments = ["sweep", "study.toml", "--out", "out", "--jobs", "4"];
    let answer = after("ulimit -v 1500000", &place.path(""), &arguments);
    assert_eq!(answer.code, 3, "{}", answer.complained);
    let line = answer.complained.lines().find(|line| line.starts_with("warning: ")).expect("a warning");
    assert!(line.starts_with("warning: 2 instead of 4 cases run at the same time: 4 of them may need "), "{line}");
    assert!(line.contains("1.54 GB are available"), "{line}");
    let answer = after("ulimit -v 1500000", &place.path(""), &[&arguments[..], &["--ignore-memory"]].concat());
    assert_eq!(answer.code, 3, "{}", answer.complained);
    assert!(!answer.complained.contains("warning: "), "{}", answer.complained);
}

/// Never more cases at a time than fit, whichever they are; all of them are done.
#[test]
fn cases_run_together_only_as_far_as_the_memory_goes() {
    let place = Place::new();
    let text = "scene = \"scene.toml\"\n[grid]\nbody.0.spacing = [0.25, 0.2, 0.125, 0.1, 0.24, 0.26]\n";
    let run = |limit: Option<u64>, jobs: usize, out: &str| {
        let mut study = Study::parse(text, "study.toml", &place.path("")).unwrap_or_else(|e| panic!("{e}"));
        study.limit_memory(limit);
        let cases = study.ready(&study.cases).unwrap_or_else(|e| panic!("{e}"));
        let options =
            SweepOptions { directory: place.path(out), jobs, threads: 1, keep_failed: false, command: String::new() };
        let (mut now, mut most, mut word) = (HashSet::new(), 0.0_f64, None);
        let mut listener = |event: &Event| match event {
            Event::Fewer { jobs, wanted, .. } => word = Some((*jobs, *wanted)),
            Event::Started(case) => {
                now.insert(*case);
                most = most.max(now.iter().map(|case| cases[case - 1].memory).sum());
            }
            Event::Ended(ending) => drop(now.remove(&ending.case)),
            Event::Running { .. } => {}
        };
        let summary = sweep(&study, &cases, &options, &mut listener, &AtomicBool::new(false)).expect("a sweep");
        assert_eq!(summary.completed, cases.len());
        let mut sizes: Vec<f64> = cases.iter().map(|case| case.memory).collect();
        sizes.sort_by(f64::total_cmp);
        (word, most, sizes)
    };
    let (word, _, sizes) = run(None, 6, "free");
    assert_eq!(word, None);
    let [third, second, first] = [sizes[3], sizes[4], sizes[5]];
    assert!(third > 1e3 && first > 1.2 * second, "{sizes:?}");
    for (limit, expected) in [
        (sizes.iter().sum::<f64>() + 1.0, None),
        (first + second + third + 1.0, Some((3, 6))),
        (first + second + third - 1.0, Some((2, 6))),
        (first + 1.0, Some((1, 6))),
    ] {
        let (word, most, _) = run(Some(limit as u64), 6, &format!("limit {limit}"));
        assert_eq!(word, expected, "{limit}");
        assert!(most <= limit, "{most} of {limit} bytes");
    }
    // A single job is not worth a word; a case that does not fit alone is refused.
    assert_eq!(run(Some(first as u64 + 1), 1, "one").0, None);
    let mut study = Study::parse(text, "study.toml", &place.path("")).unwrap_or_else(|e| panic!("{e}"));
    study.limit_memory(Some(first as u64 - 1));
    let error = study.ready(&study.cases).expect_err("too large").to_string();
    assert!(error.contains("(case 4: "), "{error}");
}

/// A run goes on only where the memory suffices: with a scene that has grown, or on a smaller machine.
#[test]
fn a_restart_that_does_not_fit_is_refused_before_anything_changes() {
    let place = Place::new();
    let text =
        scene(&[("spacing = 0.25", "counts = [150, 150]"), ("step = 0.01", "scheme = \"tvd_rk2\"\nstep = 1e-5")])
            .replace("end = 0.02", "end = 1e-5")
            + "[checkpoint]\nevery_steps = 1\n";
    place.file("scene.toml", text);
    let answer = super::nicolson(&place.path(""), &["run", "scene.toml", "--out", "before", "--quiet"]);
    super::done("a run", &answer);
    let listed = |path: &Path| -> Vec<_> {
        let entries = std::fs::read_dir(path).expect("a directory").map(|entry| entry.expect("an entry").path());
        let mut files: Vec<_> = entries.filter(|path| path.is_file()).collect();
        files.sort();
        files.into_iter().map(|path| (std::fs::read(&path).expect("a file"), path)).collect()
    };
    let before = listed(&place.path("before"));
    let restart = |limits: &str, more: &[&str]| {
        let arguments = ["restart", "before", "--threads", "1", "--quiet", "--force", "--set"];
        after(limits, &place.path(""), &[&arguments[..], more].concat())
    };
    let answer = restart("ulimit -v 2000000", &["body.0.counts=[3200, 3200]"]);
    let words = ["1.02e7 particles need about ", "2.0 GB are available", "--ignore-memory"];
    super::refused(&place, "in place", &answer, &words);
    assert_eq!(listed(&place.path("before")), before);
    // The factor that is asked for would not fit; but no step is left for which it would be made.
    let direct = ["time.scheme=crank_nicolson", "--set", "linear.solver=lu", "--out", "out"];
    let answer = restart("ulimit -v 1000000", &direct);
    super::refused(&place, "elsewhere", &answer, &["2.25e4 particles need about ", "1.0 GB are available"]);
    let answer = restart("ulimit -v 1000000", &[&direct[..], &["--ignore-memory"]].concat());
    super::done("all the same", &answer);
}

//! Malformed and impossible scenes: exit code 2, one message with the place and the remedy, nothing written.
//!
//! The wording of single messages is tested with the scene reader (`scene_errors.rs`); here the whole program
//! is: an example scene, spoilt by an edit of its text or by `--set`.

use std::fs;
use std::path::Path;

use super::{Answer, example, run};

/// How an example scene is spoilt.
enum Spoilt {
    /// A part of its text, and what it becomes.
    Edit(&'static str, &'static str),
    /// An override.
    Set(&'static str),
}
use Spoilt::{Edit, Set};

/// Scene, what is wrong with it, and parts of the message: what, and what to do.
type Case = (&'static str, Spoilt, &'static str, &'static str);

const CASES: &[Case] = &[
    // Text.
    ("dam-break", Edit("[time]", "[time"), "", "help"),
    ("dam-break", Edit("dimension = 2", "dimension = 2\ndimension = 2"), "given twice", "remove one"),
    ("dam-break", Edit("step = 0.01", "stpe = 0.01"), "unknown key `stpe`", "`step`"),
    ("dam-break", Edit("[stabilisation]", "[stabilization]"), "unknown key `stabilization`", "`stabilisation`"),
    ("dam-break", Edit("spacing = 0.25", "spacing = \"fine\""), "\"fine\"", "a number"),
    ("dam-break", Edit("dimension = 2\n", ""), "`dimension`", "add"),
    ("dam-break", Edit("end = 0.6", ""), "`end`", "add"),
    // Numbers.
    ("dam-break", Edit("dimension = 2", "dimension = 4"), "`dimension` is 4", "1, 2 or 3"),
    ("dam-break", Edit("density = 1000.0", "density = -1000.0"), "`density` is -1000", "positive"),
    ("dam-break", Edit("gamma = 7.0", "gamma = 0.5"), "gamma", "1"),
    ("dam-break", Edit("wave_speed = 10.0", "wave_speed = 0.0"), "`wave_speed` is 0", "positive"),
    ("dam-break", Edit("wave_speed = 10.0", "wave_speed = 10.0, bulk_modulus = 1e5"), "", "one"),
    ("impact-elastic", Set("body.0.material.linear_volumetric.poissons_ratio=0.5"), "poissons_ratio", "0.5"),
    ("impact-elastic", Set("body.0.material.linear_volumetric.poissons_ratio=-1"), "poissons_ratio", "-1"),
    ("dam-break", Edit("spacing = 0.25", "spacing = 0.0"), "`spacing` is 0", "positive"),
    ("dam-break", Set("body.0.spacing=1e-7"), "particles", "spacing"),
    ("dam-break", Set("body.0.smoothing=0.3"), "", "smoothing"),
    ("dam-break", Set("body.0.counts=[11, 11]"), "`counts`", "remove one"),
    ("dam-break", Edit("upper = [2.5, 2.5]", "upper = [2.5, -2.5]"), "no extent along y", "larger"),
    ("dam-break", Edit("gravity = [0.0, -9.81]", "gravity = [-9.81]"), "1 component", "give 2"),
    ("dam-break", Set("stabilisation.tau_v=-1"), "`tau_v` is -1", "zero or positive"),
    ("dam-break", Set("time.step=0"), "`step` is 0", "positive"),
    ("dam-break", Set("time.step=-0.01"), "`step` is -0.01", "positive"),
    ("dam-break", Set("time.step=nan"), "`step` is NaN", "positive"),
    ("dam-break", Set("time.end=inf"), "`end` is inf", "positive"),
    ("dam-break", Edit("step = 0.01", ""), "needs a step", "add `step"),
    ("dam-break", Set("time.cfl=0.3"), "both set the step", "remove one"),
    ("dam-break", Set("output.interval=0"), "`interval` is 0", "positive"),
    ("dam-break", Set("newton.max_iterations=0"), "`max_iterations` is 0", "at least 1"),
    ("dam-break", Set("linear.tolerance=2"), "`tolerance` is 2", "between 0 and 1"),
    // Choices.
    ("dam-break", Set("time.scheme=leapfrog"), "`leapfrog`", "velocity_verlet"),
    ("dam-break", Set("time.scheme=static"), "static", "dynamic scheme"),
    ("dam-break", Set("time.theta=0.7"), "`theta`", "scheme = \"theta\""),
    ("dam-break", Set("time.adaptive={ tolerance = 2 }"), "`tolerance` is 2", "between 0 and 1"),
    ("dam-break", Set("body.0.kernel=gauss"), "`gauss`", "wendland_c2"),
    ("dam-break", Set("newton.linear=true"), "not linear", "remove"),
    ("bar-shock", Set("newton.unknowns=velocity"), "tau_p", "velocity_jacobian"),
    // Selections.
    ("dam-break", Edit("normal = [-1.0, 0.0]", "normal = [0.0, 0.0]"), "normal", "help"),
    (
        "dam-break",
        Set("boundary.1.select={ half_space = { point = [0, -1], normal = [0, -1] } }"),
        "lowest Y is 0",
        "move",
    ),
    ("dam-break", Set("boundary.0.select={ where = \"X > 3\" }"), "selects no particle", "help"),
    ("dam-break", Set("boundary.0.displacement={ x = \"0.1*t\" }"), "x", "help"),
    ("dam-break", Set("boundary.0.fix=[\"z\"]"), "z", "help"),
    ("dam-break", Set("boundary.0.body=pillar"), "no body 'pillar'", "column"),
    ("dam-break", Set("probe.0.at=[9, 9]"), "(X = 9, Y = 9)", "help"),
    ("dam-break", Set("probe.1.name=front"), "front", "help"),
    // Expressions and initial values.
    ("impact-elastic", Edit("velocity = [\"0\", \"-1\"]", "velocity = [\"0\", \"sin(\"]"), "", "help"),
    ("impact-elastic", Edit("velocity = [\"0\", \"-1\"]", "velocity = [\"0\", \"sine(X)\"]"), "`sine`", "`sin(…)`"),
    ("impact-elastic", Edit("velocity = [\"0\", \"-1\"]", "velocity = [\"0\", \"Q*X\"]"), "`Q`", "help"),
    ("impact-elastic", Edit("velocity = [\"0\", \"-1\"]", "velocity = [\"0\", \"Z\"]"), "`Z` does not exist", "X, Y"),
    ("impact-elastic", Edit("velocity = [\"0\", \"-1\"]", "velocity = [\"0\", \"sqrt(X - 1)\"]"), "NaN", "help"),
    ("impact-elastic", Edit("velocity = [\"0\", \"-1\"]", "velocity = [\"0\", \"1/X\"]"), "inf", "help"),
    (
        "impact-hyperelastic",
        Edit("velocity = [\"0\", \"-1\"]", "displacement = [\"-2*X\", \"0\"]"),
        "at (0.000000, 0.000000)",
        "reduce the initial displacement",
    ),
    ("impact-hyperelastic", Edit("velocity = [\"0\", \"-1\"]", "pressure = \"-1e9\""), "pressure", "help"),
    ("impact-hyperelastic", Edit("velocity = [\"0\", \"-1\"]", "hydrostatic = { level = 5.0 }"), "gravity", "help"),
    // Files that the scene names.
    (
        "dam-break",
        Edit(
            "shape.box = { lower = [0.0, 0.0], upper = [2.5, 2.5] }\nspacing = 0.25\nlayout = \"vertex\"",
            "points = { file = \"absent.csv\", spacing = 0.25 }",
        ),
        "absent.csv",
        "help",
    ),
    (
        "dam-break",
        Edit(
            "shape.box = { lower = [0.0, 0.0], upper = [2.5, 2.5] }\nspacing = 0.25\nlayout = \"vertex\"",
            "points = { file = \"words.csv\", spacing = 0.25 }",
        ),
        "words.csv:2",
        "help",
    ),
    (
        "dam-break",
        Edit(
            "shape.box = { lower = [0.0, 0.0], upper = [2.5, 2.5] }\nspacing = 0.25\nlayout = \"vertex\"",
            "points = { file = \"line.csv\", spacing = 0.25 }",
        ),
        "particle",
        "",
    ),
];

/// One message, with no trace of a panic, and no results.
fn refused(case: &str, answer: &Answer, out: &Path) {
    show(case, answer);
    assert_eq!(answer.code, 2, "{case}: {}", answer.complained);
    assert_eq!(answer.said, "", "{case}");
    let messages = answer.complained.lines().filter(|line| line.starts_with("error: ")).count();
    assert!(messages == 1 && answer.complained.starts_with("error: "), "{case}: one message: {}", answer.complained);
    assert!(!out.exists(), "{case}: something was written");
}

#[expect(clippy::print_stdout, reason = "the messages are to be read by people, with --nocapture")]
fn show(case: &str, answer: &Answer) {
    println!("--- {case}\n{}", answer.complained.trim_end());
}

#[test]
fn bad_scenes_are_refused_with_place_and_remedy() {
    let directory = tempfile::tempdir().expect("a directory");
    let (scene, out) = (directory.path().join("scene.toml"), directory.path().join("out"));
    fs::write(directory.path().join("words.csv"), "0,0\nnought,one\n").expect("a file");
    fs::write(directory.path().join("line.csv"), "0,0\n0.25,0\n0.5,0\n0.75,0\n1,0\n2.5,0\n0,2.5\n").expect("a file");
    assert!(CASES.len() >= 30);
    let mut wrong = Vec::new();
    for (name, spoilt, what, remedy) in CASES {
        let good = fs::read_to_string(example(name)).expect("a scene");
        let (text, overrides, case) = match spoilt {
            Edit(from, to) => {
                assert_eq!(good.matches(from).count(), 1, "{name}: {from:?} must occur once");
                (good.replace(from, to), vec![], format!("{name}: {from:?} → {to:?}"))
            }
            Set(change) => (good, vec![*change], format!("{name}: --set {change}")),
        };
        fs::write(&scene, text).expect("a file");
        let answer = run(&scene, &out, &overrides, &["--quiet"]);
        refused(&case, &answer, &out);
        let message = &answer.complained;
        if !(message.contains(what) && message.contains(remedy)) {
            wrong.push(format!("{case}: {what:?}, {remedy:?}"));
        }
        // Where: a line and column of the file, the override, the key, or a particle.
        let key = overrides.first().and_then(|change| change.split('=').next()).unwrap_or("scene.toml");
        let place = message.contains("scene.toml:")
            || message.contains(".csv:")
            || message.contains(key)
            || message.contains("particle");
        if !place {
            wrong.push(format!("{case}: no place"));
        }
    }
    assert!(wrong.is_empty(), "not in the messages: {wrong:#?}");
}

#[test]
fn all_mistakes_are_shown_together() {
    let directory = tempfile::tempdir().expect("a directory");
    let (scene, out) = (directory.path().join("scene.toml"), directory.path().join("out"));
    let text = fs::read_to_string(example("dam-break")).expect("a scene");
    let text = text
        .replace("fix = [\"y\"]", "fix = [\"z\"]")
        .replace("tau_v = 1.0", "tau_v = -1")
        .replace("at = [0.0, 2.5]", "at = [7, 2.5]");
    fs::write(&scene, text).expect("a file");
    let answer = run(&scene, &out, &["time.step=-1"], &["--quiet"]);
    refused("four mistakes", &answer, &out);
    assert_eq!(answer.complained.matches("help: ").count(), 4, "{}", answer.complained);
    for part in ["z", "`tau_v` is -1", "X = 7", "--set time.step=-1"] {
        assert!(answer.complained.contains(part), "{part}: {}", answer.complained);
    }
}

#[test]
fn scenes_that_cannot_be_read_are_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().join("out");
    let binary = directory.path().join("binary.toml");
    fs::write(&binary, b"title = \"\xff\xfe\"\n").expect("a file");
    let empty = directory.path().join("empty.toml");
    fs::write(&empty, "").expect("a file");
    for (scene, what, remedy) in [
        (directory.path().join("absent.toml"), "cannot be read", "check the path"),
        (directory.path().to_owned(), "cannot be read", "check the path"),
        (binary, "not UTF-8", "encoding UTF-8"),
        (empty, "missing", "add"),
    ] {
        let answer = run(&scene, &out, &[], &[]);
        let case = scene.display().to_string();
        refused(&case, &answer, &out);
        assert!(
            answer.complained.contains(what) && answer.complained.contains(remedy),
            "{case}: {}",
            answer.complained
        );
        assert!(answer.complained.contains(&case), "{}", answer.complained);
    }
}

#[test]
fn directories_that_cannot_be_written_are_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("occupied");
    fs::write(&file, "mine").expect("a file");
    let mut cases = vec![(file.clone(), "it is a file"), (file.join("below"), "is a file")];
    // Where even the superuser may not write; elsewhere the first two must do.
    if Path::new("/proc/self").exists() {
        cases.push((Path::new("/proc/results").to_owned(), "cannot create the output directory"));
    }
    for (out, what) in cases {
        let answer = run(&example("bar-smooth"), &out, &["time.end=0.1"], &["--quiet"]);
        assert_eq!(answer.code, 2, "{}", answer.complained);
        assert!(answer.complained.starts_with("error: ") && answer.complained.contains(what), "{}", answer.complained);
        assert!(answer.complained.contains(&out.display().to_string()), "{}", answer.complained);
        assert!(answer.complained.trim_end().contains("; "), "a remedy: {}", answer.complained);
    }
    assert_eq!(fs::read_to_string(&file).expect("a file"), "mine");
}

#[cfg(unix)]
#[test]
fn a_directory_without_permission_is_refused() {
    use std::os::unix::fs::PermissionsExt;
    let directory = tempfile::tempdir().expect("a directory");
    let locked = directory.path().join("locked");
    fs::create_dir(&locked).expect("a directory");
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o555)).expect("permissions");
    // The superuser may write everywhere; then there is nothing to refuse.
    if fs::write(locked.join("try"), "").is_err() {
        let answer = run(&example("bar-smooth"), &locked, &["time.end=0.1"], &["--quiet"]);
        assert_eq!(answer.code, 2, "{}", answer.complained);
        assert!(answer.complained.contains("permissions"), "{}", answer.complained);
        assert_eq!(fs::read_dir(&locked).expect("a directory").count(), 0);
    }
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o755)).expect("permissions");
}

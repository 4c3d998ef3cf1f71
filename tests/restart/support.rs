//! Small scenes, their runs, and the comparison of everything that they leave.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use nicolson::output::Report;
use nicolson::scene::Scene;
use nicolson::simulation::{CHECKPOINT_FOLDER, Checkpoint, Outcome, RunOptions, Silent, restart, run};
use serde_json::Value;

/// A scene as text, with overrides.
#[derive(Clone)]
pub struct Case {
    text: String,
    set: Vec<(String, String)>,
}

const SOLID: &str = r#"
dimension = 2
gravity = [0, -9.81]
[[body]]
counts = [9, 4]
shape.box = { lower = [0, 0], upper = [2, 0.75] }
smoothing = 1.0
material.neo_hookean = { density = 1000, youngs_modulus = 2e6, poissons_ratio = 0.3 }
[[boundary]]
select.where = "X < 1e-9"
fix = ["x", "y"]
[[traction]]
select.face = "upper_x"
value = [0, -4e3]
[initial]
velocity = ["0", "-0.5*X"]
[time]
step = 0.02
end = 0.16
[output]
interval = 0.04
plots = false
[[probe]]
name = "tip"
at = [2, 0.75]
"#;

const FLUID: &str = r#"
dimension = 2
gravity = [0, -9.81]
[[body]]
counts = [8, 6]
shape.box = { lower = [0, 0], upper = [1.4, 1] }
material.hyperelastic_volumetric = { density = 1000, gamma = 7, wave_speed = 10 }
[[boundary]]
select.where = "Y < 1e-9"
fix = ["x", "y"]
[initial]
velocity = ["0.2*Y", "-0.3*Y"]
[time]
end = 0.08
[output]
interval = 0.02
plots = false
[[probe]]
name = "front"
at = [1.4, 0]
"#;

const CUBE: &str = r#"
dimension = 3
gravity = [0, 0, -9.81]
[[body]]
counts = [N, N, N]
shape.box = { lower = [0, 0, 0], upper = [1, 1, 1] }
smoothing = 1.0
material.neo_hookean = { density = 1000, youngs_modulus = 2e5, poissons_ratio = 0.3 }
[[boundary]]
select.where = "Z < 1e-9"
fix = ["x", "y", "z"]
[time]
step = 0.01
end = 0.05
[output]
plots = false
"#;

impl Case {
    fn new(text: &str, scheme: &str) -> Self {
        Self { text: text.to_owned(), set: Vec::new() }.set("time.scheme", &format!("\"{scheme}\""))
    }

    pub fn solid(scheme: &str) -> Self {
        let case = Self::new(SOLID, scheme);
        // A static computation has no velocities.
        if scheme == "static" { case.without("velocity").without("[initial]") } else { case }
    }

    pub fn linear(scheme: &str) -> Self {
        let mut case = Self::solid(scheme);
        case.text = case.text.replace("neo_hookean", "linear_elastic");
        case
    }

    pub fn fluid(scheme: &str) -> Self {
        Self::new(FLUID, scheme)
    }

    pub fn cube(scheme: &str, side: usize) -> Self {
        Self::new(&CUBE.replace('N', &side.to_string()), scheme)
    }

    pub fn set(mut self, key: &str, value: &str) -> Self {
        self.set.push((key.to_owned(), value.to_owned()));
        self
    }

    pub fn newton(self, key: &str, word: &str) -> Self {
        self.set(&format!("newton.{key}"), &format!("\"{word}\""))
    }

    pub fn solver(self, (solver, preconditioner): (&str, &str)) -> Self {
        let case = self.set("linear.solver", &format!("\"{solver}\""));
        match preconditioner {
            "" => case,
            name => case.set("linear.preconditioner", &format!("\"{name}\"")),
        }
    }

    /// Without the line of a key.
    pub fn without(mut self, key: &str) -> Self {
        let key = key.rsplit('.').next().unwrap_or_default();
        let lines = self.text.lines().filter(|line| line.split(" =").next() != Some(key));
        self.text = lines.map(|line| format!("{line}\n")).collect();
        self
    }

    pub fn scene(&self) -> Scene {
        Scene::parse(&self.text, "case.toml", Path::new(""), &self.set).unwrap_or_else(|e| panic!("{}{e}", self.name()))
    }

    pub fn name(&self) -> String {
        self.set.iter().map(|(key, value)| format!("{key}={value} ")).collect()
    }
}

/// Calls `f` with so many threads.
pub fn with_threads<T: Send>(threads: usize, f: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool").install(f)
}

pub fn options(directory: &Path) -> RunOptions {
    RunOptions { directory: Some(directory.to_owned()), ..RunOptions::default() }
}

pub fn start(scene: &Scene, directory: &Path) -> Outcome {
    let never = AtomicBool::new(false);
    run(scene, &options(directory), &mut Silent, &never).unwrap_or_else(|error| panic!("{error}"))
}

pub fn go_on(checkpoint: &Path, directory: &Path) -> Outcome {
    let checkpoint = Checkpoint::read(checkpoint).unwrap_or_else(|error| panic!("{error}"));
    let scene = checkpoint.scene(&[]).unwrap_or_else(|error| panic!("{error}"));
    let never = AtomicBool::new(false);
    restart(&scene, &checkpoint, false, &options(directory), &mut Silent, &never).unwrap_or_else(|e| panic!("{e}"))
}

/// Every file of a directory but the report, with its bytes.
pub fn results(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(directory).expect("a directory").map(|entry| entry.expect("an entry"));
    let files = entries.filter(|entry| entry.path().is_file() && entry.file_name() != "report.json");
    files
        .map(|entry| (entry.file_name().into_string().expect("a name"), fs::read(entry.path()).expect("bytes")))
        .collect()
}

/// A report without what the clock on the wall, threads and the command line say.
pub fn timeless(report: &Report) -> Value {
    let mut value = serde_json::to_value(report).expect("a report");
    for key in ["wall_seconds", "bottleneck"] {
        value[key] = Value::Null;
    }
    for key in ["command", "parent_checkpoint", "threads"] {
        value["provenance"][key] = Value::Null;
    }
    for body in value["balance"].as_array_mut().into_iter().flatten() {
        body["seconds"] = Value::Null;
    }
    value
}

pub fn same(what: &str, (one, a): (&Outcome, &Path), (other, b): (&Outcome, &Path)) {
    let bits = |state: &[f64]| state.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(timeless(&one.report), timeless(&other.report), "{what}: report");
    assert!(bits(&one.state) == bits(&other.state), "{what}: the final states differ");
    let (found, expected) = (results(a), results(b));
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>(), "{what}: files");
    for (name, bytes) in &found {
        assert!(*bytes == expected[name], "{what}: {name} differs");
    }
}

/// Checkpoints of a run, oldest first.
pub fn checkpoints(directory: &Path) -> Vec<std::path::PathBuf> {
    let entries = fs::read_dir(directory.join(CHECKPOINT_FOLDER)).into_iter().flatten();
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let mut found: Vec<_> = paths.filter(|path| path.extension().is_some_and(|end| end == "safetensors")).collect();
    found.sort();
    found
}

/// Checks a case, and returns the number of its rejected steps.
pub fn check(case: &Case) -> usize {
    let place = tempfile::tempdir().expect("a directory");
    let at = |name: &str| place.path().join(name);
    let plain = case.clone().set("checkpoint.keep", "0").scene();
    let whole = with_threads(1, || start(&plain, &at("plain")));
    let written = case.clone().set("checkpoint", "{ every_steps = 1, keep = 1000 }").scene();
    let other = with_threads(2, || start(&written, &at("written")));
    // The two differ in the scene that they tell, and in nothing else.
    let tell = |directory: &str| {
        let files = results(&at(directory));
        files.into_iter().filter(|(name, _)| !name.ends_with(".vtu")).collect::<Vec<_>>()
    };
    assert_eq!(tell("plain"), tell("written"), "{}: writing checkpoints changes the results", case.name());
    let steps = other.report.steps.accepted;
    assert!(whole.state == other.state && steps >= 3, "{}: {steps} steps", case.name());
    let all = checkpoints(&at("written"));
    assert_eq!(all.len(), steps, "{}", case.name());
    for (threads, step) in [(2, 1), (1, steps / 2), (2, steps - 1)] {
        let name = format!("from {step}");
        let outcome = with_threads(threads, || go_on(&all[step - 1], &at(&name)));
        let what = format!("{}from step {step} of {steps}", case.name());
        same(&what, (&outcome, &at(&name)), (&other, &at("written")));
    }
    let linear = &other.report.linear;
    println!(
        "{}: {steps} steps, {} Newton iterations, {} factorisations; {} {}",
        case.name(),
        other.report.newton.iterations,
        linear.factorisations,
        linear.solver,
        linear.reason
    );
    other.report.steps.rejected
}

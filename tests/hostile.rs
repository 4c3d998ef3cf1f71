//! Input that was made to break things, or that looks like it: exit code 2 with a message that says what, where and what to
//! do about it, before much time or memory is gone; never a panic. And paths as people have them, which must work.
#![cfg(unix)]
#![allow(missing_docs, reason = "tests")]

#[path = "hostile/files.rs"]
mod files;
#[path = "hostile/memory.rs"]
mod memory;
#[path = "hostile/names.rs"]
mod names;
#[path = "hostile/numbers.rs"]
mod numbers;
#[path = "hostile/outputs.rs"]
mod outputs;

use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Longest time for a refusal, with the machine busy.
const LONGEST: Duration = Duration::from_secs(20);
/// Most address space for a refusal, kB: with it everything that is allocated at once counts, used or not.
const MOST_SPACE: u64 = 2_000_000;

/// A small scene, in parts that tests replace.
pub const SCENE: &str = r#"dimension = 2
gravity = [0.0, -9.81]

[[body]]
name = "column"
spacing = 0.25
shape.box = { lower = [0.0, 0.0], upper = [1.0, 1.0] }
material.hyperelastic_volumetric = { density = 1000.0, gamma = 7.0, wave_speed = 10.0 }

[[boundary]]
select.where = "Y < 1e-9"
fix = ["x", "y"]

[time]
end = 0.02
step = 0.01

[output]
plots = false
"#;

/// [`SCENE`] with replacements.
fn scene(changes: &[(&str, &str)]) -> String {
    changes.iter().fold(SCENE.to_owned(), |text, (old, new)| {
        assert!(text.contains(old), "{old}");
        text.replacen(old, new, 1)
    })
}

/// A directory with a scene `scene.toml` in it.
struct Place {
    directory: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let place = Self { directory: tempfile::tempdir().expect("a directory") };
        place.file("scene.toml", SCENE.as_bytes());
        place
    }

    fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.directory.path().join(name)
    }

    fn file(&self, name: impl AsRef<Path>, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, content).expect("a file");
        path
    }
}

/// What a run of the program left behind.
struct Answer {
    code: i32,
    said: String,
    complained: String,
}

/// Runs the program in a directory, after commands of the shell such as limits.
fn after<S: AsRef<OsStr>>(limits: &str, directory: &Path, arguments: &[S]) -> Answer {
    let start = Instant::now();
    let program = env!("CARGO_BIN_EXE_nicolson");
    let mut child = Command::new("sh")
        .args(["-c", &format!("{limits}\nexec \"$0\" \"$@\""), program])
        .args(arguments)
        .current_dir(directory)
        .env("RUST_BACKTRACE", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    while start.elapsed() < LONGEST && child.try_wait().expect("a child").is_none() {
        std::thread::sleep(Duration::from_millis(5));
    }
    let late = child.try_wait().expect("a child").is_none();
    if late {
        child.kill().expect("a child");
    }
    let output = child.wait_with_output().expect("output");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    let answer =
        Answer { code: output.status.code().unwrap_or(-1), said: text(output.stdout), complained: text(output.stderr) };
    assert!(!late, "not done after {LONGEST:?}: {}", answer.complained);
    assert!(!answer.complained.contains("panicked"), "{}", answer.complained);
    answer
}

/// Runs the program with little memory.
fn nicolson<S: AsRef<OsStr>>(directory: &Path, arguments: &[S]) -> Answer {
    after(&format!("ulimit -v {MOST_SPACE}"), directory, arguments)
}

/// `COMMAND scene.toml` with more arguments.
fn on_scene(place: &Place, command: &str, more: &[&str]) -> Answer {
    let mut arguments = vec![command, "scene.toml", "--threads", "1"];
    if command == "run" {
        arguments.extend(["--out", "out", "--quiet"]);
    }
    arguments.extend(more);
    nicolson(&place.path(""), &arguments)
}

/// Exit code 2, an error of some lines with all of these words, and no results.
fn refused(place: &Place, case: &str, answer: &Answer, words: &[&str]) {
    assert_eq!(answer.code, 2, "{case}: {}{}", answer.said, answer.complained);
    assert!(answer.complained.starts_with("error: "), "{case}: {}", answer.complained);
    assert!(answer.complained.len() < 20_000, "{case}: {} bytes of complaint", answer.complained.len());
    for word in words {
        assert!(answer.complained.contains(word), "{case}: no `{word}` in {}", answer.complained);
    }
    assert!(!place.path("out").exists(), "{case}: something was written");
}

/// Both `check` and `run` refuse a scene.
fn refused_scene(case: &str, text: impl AsRef<[u8]>, words: &[&str]) {
    let place = Place::new();
    place.file("scene.toml", text);
    for command in ["check", "run"] {
        refused(&place, case, &on_scene(&place, command, &[]), words);
    }
}

/// Done without a complaint.
fn done(case: &str, answer: &Answer) {
    assert_eq!((answer.code, answer.complained.as_str()), (0, ""), "{case}: {}", answer.said);
}

/// Arguments of any kind.
fn arguments(parts: &[&dyn AsRef<OsStr>]) -> Vec<OsString> {
    parts.iter().map(|part| AsRef::<OsStr>::as_ref(*part).to_owned()).collect()
}

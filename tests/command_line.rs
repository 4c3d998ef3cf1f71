//! The program as a user meets it: exit codes, messages, files (issue, points "Output" and 11).
//!
//! Every test runs the real binary. Exit codes: 0 done, 2 wrong input (nothing written), 3 numerical failure
//! (results so far on disk), 130 interrupted (as for 3).

#[path = "command_line/bad_input.rs"]
mod bad_input;
#[path = "command_line/beginnings.rs"]
mod beginnings;
#[path = "command_line/endings.rs"]
mod endings;
#[path = "command_line/pictures.rs"]
mod pictures;
#[path = "command_line/report.rs"]
mod report;
#[path = "command_line/studies.rs"]
mod studies;
#[path = "command_line/study_mistakes.rs"]
mod study_mistakes;
#[path = "command_line/vtk.rs"]
mod vtk;

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use nicolson::output::Report;
use serde_json::Value;

/// What a run of the program left behind.
pub struct Answer {
    /// Exit code.
    pub code: i32,
    /// Standard output.
    pub said: String,
    /// Standard error.
    pub complained: String,
}

/// The program with arguments, not yet started.
pub fn command<S: AsRef<OsStr>>(arguments: &[S]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_nicolson"));
    command.args(arguments).env("RUST_BACKTRACE", "1");
    command
}

/// Runs the program to its end.
pub fn nicolson<S: AsRef<OsStr>>(arguments: &[S]) -> Answer {
    let output = command(arguments).output().expect("the program starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    let answer =
        Answer { code: output.status.code().unwrap_or(-1), said: text(output.stdout), complained: text(output.stderr) };
    assert!(!answer.complained.contains("panicked"), "{}", answer.complained);
    assert!(!answer.complained.contains("stack backtrace"), "{}", answer.complained);
    answer
}

/// Path of a scene of `examples/`.
pub fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(format!("{name}.toml"))
}

/// All scenes of `examples/`.
pub fn examples() -> Vec<PathBuf> {
    let mut scenes: Vec<PathBuf> = fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples"))
        .expect("a directory")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    scenes.sort();
    assert!(scenes.len() >= 8, "{scenes:?}");
    scenes
}

/// `run SCENE --out DIRECTORY` with overrides and further arguments.
pub fn run(scene: &Path, directory: &Path, overrides: &[&str], more: &[&str]) -> Answer {
    let mut arguments: Vec<&OsStr> = vec!["run".as_ref(), scene.as_os_str(), "--out".as_ref(), directory.as_os_str()];
    for change in overrides {
        arguments.extend([OsStr::new("--set"), OsStr::new(change)]);
    }
    arguments.extend(more.iter().map(OsStr::new));
    nicolson(&arguments)
}

/// The rows of a CSV file as numbers, its titles apart.
pub fn table(path: &Path) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut reader = csv::Reader::from_path(path).expect("a table");
    let titles = reader.headers().expect("titles").iter().map(str::to_owned).collect();
    let number = |text: &str| text.parse::<f64>().unwrap_or_else(|_| panic!("{text:?} in {}", path.display()));
    let rows = reader.records().map(|row| row.expect("a whole row").iter().map(number).collect()).collect();
    (titles, rows)
}

/// What a run that stopped early must leave: a report, whole tables up to its time, an index of whole frames.
pub fn readable(directory: &Path) -> Report {
    let report = Report::read(directory).expect("a report");
    let (titles, rows) = table(&directory.join("history.csv"));
    assert_eq!(titles[0], "t");
    assert_eq!(rows.last().expect("rows")[0], report.time_reached, "the history ends where the run ended");
    assert!(rows.windows(2).all(|pair| pair[0][0] < pair[1][0]));
    let (_, probes) = table(&directory.join("probes.csv"));
    assert_eq!(probes.len(), rows.len());
    let index = fs::read_to_string(directory.join("fields.pvd")).expect("an index");
    let frames: Vec<&str> = index.split("file=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert!(!frames.is_empty() && index.trim_end().ends_with("</VTKFile>"), "{index}");
    for frame in frames {
        let bytes = fs::read(directory.join(frame)).expect("a frame");
        assert!(bytes.ends_with(b"</VTKFile>\n") || bytes.ends_with(b"</VTKFile>"), "{frame} is not whole");
    }
    let left: Vec<_> =
        fs::read_dir(directory).expect("a directory").map(|e| e.expect("an entry").file_name()).collect();
    assert!(!left.iter().any(|name| name.to_string_lossy().contains("partial")), "{left:?}");
    report
}

#[test]
fn every_example_passes_check_and_jacobian() {
    for scene in examples() {
        let name = scene.display();
        let path = scene.as_os_str();
        let answer = nicolson(&["check".as_ref(), path]);
        assert_eq!((answer.code, answer.complained.as_str()), (0, ""), "{name}");
        for line in ["particles ", "explicit step limit ", "steps ", "memory (estimate)"] {
            assert!(answer.said.lines().any(|found| found.starts_with(line)), "{name}: {}", answer.said);
        }
        let answer = nicolson(&["jacobian".as_ref(), path, "--json".as_ref()]);
        let tables: Value =
            serde_json::from_str(&answer.said).unwrap_or_else(|e| panic!("{name}: {e}: {}", answer.said));
        assert_eq!(tables["agrees"], true, "{name}: {tables:#}");
        assert_eq!((answer.code, answer.complained.as_str()), (0, ""), "{name}");
        for block in tables["taylor"].as_array().expect("tables") {
            assert!(block["rows"].as_array().expect("rows").len() >= 4, "{name}: {block:#}");
        }
        assert!(tables["differences"]["largest_error"].as_f64().expect("a number") < 1e-6, "{name}: {tables:#}");
        // The same for people.
        let answer = nicolson(&["jacobian".as_ref(), path]);
        assert!(answer.code == 0 && answer.said.contains("‖ε‖/ε²"), "{name}: {}", answer.said);
    }
}

#[test]
fn list_names_the_choices_and_the_scenes() {
    let examples_directory = example("dam-break");
    let answer = nicolson(&["list".as_ref(), examples_directory.parent().expect("a directory").as_os_str()]);
    assert_eq!((answer.code, answer.complained.as_str()), (0, ""));
    for word in ["crank_nicolson", "tvd_rk2", "cubic_spline", "hyperelastic_volumetric", "gmres", "balanced"] {
        assert!(answer.said.contains(word), "{word}: {}", answer.said);
    }
    for scene in examples() {
        let file = scene.file_name().expect("a name").to_string_lossy().into_owned();
        let line = answer.said.lines().find(|line| line.contains(&file)).unwrap_or_else(|| panic!("{file} is missing"));
        assert!(!line.contains("not a valid scene"), "{line}");
    }
    let nothing = tempfile::tempdir().expect("a directory");
    assert_eq!(nicolson(&["list".as_ref(), nothing.path().as_os_str()]).code, 0);
}

#[test]
fn help_and_version_are_no_errors() {
    for argument in ["--help", "--version", "help"] {
        let answer = nicolson(&[argument]);
        assert_eq!((answer.code, answer.complained.as_str()), (0, ""), "{argument}");
        assert!(answer.said.contains("nicolson"), "{argument}: {}", answer.said);
    }
    assert!(nicolson(&["run", "--help"]).said.contains("--set"));
}

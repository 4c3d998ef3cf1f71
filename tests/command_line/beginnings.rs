//! How people begin: templates, completions, manual pages, help.

use std::fs;
use std::path::Path;
use std::process::Command;

use nicolson::output::{Report, Status};

use super::{Answer, command, nicolson, run};

/// The program in a working directory.
fn within(directory: &Path, arguments: &[&str]) -> Answer {
    let output = command(arguments).current_dir(directory).output().expect("the program starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    Answer { code: output.status.code().unwrap_or(-1), said: text(output.stdout), complained: text(output.stderr) }
}

#[test]
fn every_template_is_checked_and_runs() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    let list = within(at, &["new", "--list"]);
    let names: Vec<&str> = list.said.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert_eq!(names, ["cantilever", "impact", "dam-break", "stl-part", "static", "convergence"]);
    for name in names {
        let answer = within(at, &["new", name]);
        assert!(
            answer.code == 0 && answer.said.starts_with(&format!("{name}.toml\n")),
            "{name}: {}",
            answer.complained
        );
        let file = at.join(format!("{name}.toml"));
        let text = fs::read_to_string(&file).expect("a file");
        assert!(text.starts_with("# ") && text.contains(&format!("{name}.toml")), "{name}: it says how to be run");
        let out = at.join("results").join(name);
        if name == "convergence" {
            let answer = within(at, &["sweep", "convergence.toml", "--out", "results/convergence"]);
            assert!(answer.code == 0 && answer.said.contains("2.0"), "{}{}", answer.said, answer.complained);
            continue;
        }
        let answer = nicolson(&["check".as_ref(), file.as_os_str()]);
        assert_eq!((answer.code, answer.complained.as_str()), (0, ""), "{name}");
        assert!(!answer.said.contains("warning"), "{name}: {}", answer.said);
        // Two steps, or increments; half the particles per direction where there are many.
        let short = match name {
            "cantilever" => &["time.end=2e-3"][..],
            "impact" => &["time.end=2e-4"],
            "dam-break" => &["time.end=0.01"],
            "stl-part" => &["time.end=2e-5", "body.0.spacing=0.008"],
            _ => &["time.end=0.2"],
        };
        let answer = run(&file, &out, &[short, &["output.plots=false"]].concat(), &["--quiet"]);
        assert_eq!((answer.code, answer.complained.as_str()), (0, ""), "{name}");
        let report = Report::read(&out).expect("a report");
        assert!(report.status == Status::Completed && report.steps.accepted == 2, "{name}: {report:?}");
    }
}

#[test]
fn nothing_is_overwritten_and_wrong_names_are_explained() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    fs::write(at.join("impact.toml"), "mine").expect("a file");
    let answer = within(at, &["new", "impact"]);
    assert!(answer.code == 2 && answer.complained.contains("impact.toml exists already"), "{}", answer.complained);
    assert_eq!(fs::read_to_string(at.join("impact.toml")).expect("a file"), "mine");
    // Also not what a template needs beside it; then nothing is written at all.
    fs::write(at.join("bracket.stl"), "mine").expect("a file");
    let answer = within(at, &["new", "stl-part", "part é.toml"]);
    assert!(answer.code == 2 && answer.complained.contains("bracket.stl exists already"), "{}", answer.complained);
    assert!(!at.join("part é.toml").exists());
    let answer = within(at, &["new", "cantilver"]);
    assert!(answer.code == 2 && answer.complained.contains("did you mean `cantilever`?"), "{}", answer.complained);
    assert_eq!(within(at, &["new"]).code, 2);
    let answer = within(at, &["new", "static", "absent/strip.toml"]);
    assert!(answer.code == 3 && answer.complained.contains("create its directory first"), "{}", answer.complained);
}

#[test]
fn completions_and_manual_pages_know_every_command() {
    let commands = [
        "run",
        "restart",
        "check",
        "jacobian",
        "render",
        "plot",
        "report",
        "list",
        "new",
        "schema",
        "sweep",
        "collect",
        "completions",
        "man",
    ];
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let answer = nicolson(&["completions", shell]);
        assert_eq!((answer.code, answer.complained.as_str()), (0, ""), "{shell}");
        assert!(commands.iter().all(|command| answer.said.contains(command)), "{shell}");
        assert!(answer.said.contains("keep-failed") && answer.said.contains("solve-log"), "{shell}");
    }
    assert_eq!(nicolson(&["completions", "csh"]).code, 2);
    // A shell that is there takes the script, and completes with it.
    let complete = "source <(\"$0\" completions bash) && COMP_WORDS=(nicolson sw) COMP_CWORD=1 && \
                    _nicolson nicolson sw nicolson && echo \"${COMPREPLY[@]}\"";
    if let Ok(output) = Command::new("bash").args(["-c", complete, env!("CARGO_BIN_EXE_nicolson")]).output() {
        assert_eq!(
            String::from_utf8_lossy(&output.stdout).trim(),
            "sweep",
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
    let directory = tempfile::tempdir().expect("a directory");
    let pages = directory.path().join("man1");
    let answer = nicolson(&["man".as_ref(), pages.as_os_str()]);
    assert_eq!(answer.code, 0, "{}", answer.complained);
    let page = |name: &str| fs::read_to_string(pages.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert!(page("nicolson.1").contains("nicolson\\-sweep(1)") && page("nicolson.1").contains("RAYON_NUM_THREADS"));
    for command in commands {
        let text = page(&format!("nicolson-{command}.1"));
        assert!(text.contains(".SH SYNOPSIS") && text.contains("Examples:"), "{command}: {text}");
    }
    assert!(page("nicolson-sweep.1").contains("convergence"));
}

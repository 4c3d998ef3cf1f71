//! Disks that refuse: exit code 2 before the first step, 3 with what is there after it.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::{Answer, Place, after, nicolson, scene};

fn complains(case: &str, answer: &Answer, code: i32, words: &[&str]) {
    assert_eq!(answer.code, code, "{case}: {}", answer.complained);
    for word in words {
        assert!(answer.complained.contains(word), "{case}: no `{word}` in {}", answer.complained);
    }
}

/// Files that may not grow beyond some blocks of 512 bytes: what a full disk is, for any user on any machine.
#[test]
fn a_disk_that_fills_up_ends_the_run_with_code_3() {
    let long = scene(&[("end = 0.02", "end = 3.0"), ("plots = false", "plots = false\ninterval = 0.1")]);
    let place = Place::new();
    place.file("scene.toml", &long);
    let arguments = ["run", "scene.toml", "--quiet", "--out", "out"];
    // Room for frames, but not for the whole history.
    let answer = after("trap '' XFSZ\nulimit -f 40", &place.path(""), &arguments);
    complains("a long history", &answer, 3, &["error: ", "history.csv", "; "]);
    let history = fs::read_to_string(place.path("out/history.csv")).expect("a history");
    assert!(history.lines().count() > 10, "what was written stays");
    let index = fs::read_to_string(place.path("out/fields.pvd")).expect("an index");
    assert!(index.trim_end().ends_with("</VTKFile>"), "{index}");
    // Not even a frame.
    let answer = after("trap '' XFSZ\nulimit -f 1", &place.path(""), &arguments);
    assert!([2, 3].contains(&answer.code), "{} {}", answer.code, answer.complained);
    assert!(answer.complained.starts_with("error: "), "{}", answer.complained);
    let left: Vec<_> = fs::read_dir(place.path("out")).expect("results").flatten().map(|e| e.file_name()).collect();
    assert!(!left.iter().any(|name| name.to_string_lossy().contains("partial")), "{left:?}");
}

/// The same with a real file system, where one can be mounted.
#[test]
fn a_small_file_system_ends_the_run_with_code_3() {
    let long = scene(&[("end = 0.02", "end = 10.0"), ("plots = false", "plots = false\ninterval = 0.01")]);
    let place = Place::new();
    place.file("scene.toml", &long);
    fs::create_dir(place.path("disk")).expect("a directory");
    let inside = "mount -t tmpfs -o size=256k tmpfs disk && \"$0\" run scene.toml --quiet --out disk/out; code=$?; \
                  ls disk/out; tail -c 11 disk/out/fields.pvd; exit $code";
    let output = Command::new("unshare")
        .args(["--mount", "--map-root-user", "sh", "-c", inside, env!("CARGO_BIN_EXE_nicolson")])
        .current_dir(place.path(""))
        .output();
    let Ok(output) = output else { return };
    let (said, complained) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    if complained.contains("unshare") || complained.contains("mount:") {
        // Not allowed here.
        return;
    }
    assert_eq!(output.status.code(), Some(3), "{complained}");
    assert!(complained.contains("free some space"), "{complained}");
    assert!(said.contains("fields-00001.vtu") && said.contains("history.csv"), "{said}");
    assert!(!said.contains("partial") && said.trim_end().ends_with("</VTKFile>"), "{said}");
}

#[test]
fn devices_that_are_full_are_told() {
    if !Path::new("/dev/full").exists() {
        return;
    }
    let place = Place::new();
    let run =
        |more: &[&str]| nicolson(&place.path(""), &[&["run", "scene.toml", "--quiet", "--out", "out"], more].concat());
    complains("a log", &run(&["--solve-log", "/dev/full"]), 3, &["--solve-log /dev/full"]);
    let answer = nicolson(&place.path(""), &["jacobian", "scene.toml", "--export-tangent", "/dev/full"]);
    complains("a matrix", &answer, 3, &["--export-tangent /dev/full"]);
    let preview = nicolson(&place.path(""), &["check", "scene.toml", "--preview", "/proc/none/preview.png"]);
    complains("a preview", &preview, 3, &["/proc/none/preview", "; "]);
    let picture = nicolson(&place.path(""), &["render", "out", "--out", "/proc/none/picture.png"]);
    complains("a picture", &picture, 2, &["/proc/none/picture.png", "; "]);
    // Standard output that nobody reads, or that is full.
    let full = after("exec >/dev/full", &place.path(""), &["check", "scene.toml"]);
    complains("standard output", &full, 3, &["error: ", "standard output", "not complete"]);
    assert_eq!(after("exec 2>/dev/full", &place.path(""), &["check", "absent.toml"]).code, 2);
    assert_eq!(after("exec >&-", &place.path(""), &["check", "scene.toml"]).code, 0);
    let left = Command::new("sh").args(["-c", "\"$0\" list examples | true", env!("CARGO_BIN_EXE_nicolson")]).output();
    assert!(left.expect("a shell").stderr.is_empty(), "a reader that leaves is no mistake");
}

#[test]
fn directories_that_cannot_be_written_are_refused_before_anything_is_computed() {
    let place = Place::new();
    place.file("occupied", "mine");
    std::os::unix::fs::symlink("loop", place.path("loop")).expect("a link");
    let long = "x".repeat(300);
    for (out, words) in [
        ("occupied", "it is a file"),
        ("occupied/below", "is a file"),
        ("scene.toml", "it is a file"),
        ("loop", "cannot"),
        ("/proc/results", "cannot create the output directory"),
        ("/dev/null", "it is a file"),
        (&*long, "cannot"),
    ] {
        let answer = nicolson(&place.path(""), &["run", "scene.toml", "--quiet", "--out", out]);
        complains(out, &answer, 2, &["error: ", words, "; "]);
    }
    assert_eq!(fs::read_to_string(place.path("occupied")).expect("a file"), "mine");
    // Read-only: by its permissions, as long as one is not root.
    let locked = place.path("locked");
    fs::create_dir(&locked).expect("a directory");
    let read_only =
        |mode| fs::set_permissions(&locked, std::os::unix::fs::PermissionsExt::from_mode(mode)).expect("modes");
    read_only(0o555);
    if fs::write(locked.join("try"), "").is_err() {
        let answer = nicolson(&place.path(""), &["run", "scene.toml", "--quiet", "--out", "locked/out"]);
        complains("locked", &answer, 2, &["error: ", "permissions"]);
    }
    read_only(0o755);
}

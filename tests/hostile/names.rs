//! Names: those that people have work, those that are none are refused, and no file of the user is written over.

use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::symlink;

use super::{Place, SCENE, arguments, done, nicolson, refused, scene};

#[test]
fn spaces_accents_and_odd_letters_in_paths_work() {
    let odd = OsStr::from_bytes(b"latin-\xe9\xff");
    for name in [
        OsStr::new("with space"),
        OsStr::new("Größe é ü ∂ 流体 🌊"),
        OsStr::new("quote\" ' & <tag> %20 #"),
        OsStr::new("-leading"),
        OsStr::new("two\nlines"),
        OsStr::new("back\\slash $HOME `id` ; true"),
        OsStr::new(".hidden"),
        odd,
    ] {
        let place = Place::new();
        let folder = place.path(name);
        fs::create_dir(&folder).expect("a directory");
        let file = folder.join(name).with_extension("toml");
        fs::write(&file, scene(&[("plots = false", "interval = 0.01")])).expect("a scene");
        let case = name.to_string_lossy();
        done(&case, &nicolson(&place.path(""), &arguments(&[&"check", &file])));
        let out = folder.join("out of").join(name);
        done(&case, &nicolson(&place.path(""), &arguments(&[&"run", &file, &"--quiet", &"--out", &out])));
        assert!(out.join("report.json").is_file() && out.join("fields.pvd").is_file(), "{case}");
        done(&case, &nicolson(&place.path(""), &arguments(&[&"report", &out])));
        let picture = folder.join("a b.png");
        done(&case, &nicolson(&place.path(""), &arguments(&[&"render", &out, &"--out", &picture])));
        assert!(picture.is_file(), "{case}");
    }
}

#[test]
fn geometry_files_are_found_by_any_name_and_way() {
    let cloud: String = (0..25).map(|i| format!("{},{}\n", 0.25 * f64::from(i % 5), 0.25 * f64::from(i / 5))).collect();
    let place = Place::new();
    fs::create_dir_all(place.path("a/b")).expect("directories");
    for name in ["Wölke 1.csv", "a/../cloud.csv", "./a/b/cloud.csv", "link.csv"] {
        let written = if name == "link.csv" { "target.csv" } else { name };
        place.file(written, &cloud);
        if name == "link.csv" {
            symlink("target.csv", place.path("link.csv")).expect("a link");
        }
        let points = format!("points = {{ file = \"{name}\", spacing = 0.25 }}");
        let shape = "spacing = 0.25\nshape.box = { lower = [0.0, 0.0], upper = [1.0, 1.0] }";
        let file = place.file("points.toml", scene(&[(shape, &points)]));
        // From another directory: names are sought from the folder of the scene.
        done(name, &nicolson(&place.path("a/b"), &arguments(&[&"check", &file])));
    }
}

#[test]
fn arguments_that_are_no_text_or_nothing() {
    let place = Place::new();
    let odd = OsStr::from_bytes(b"time.step=\xff");
    let answer = nicolson(&place.path(""), &arguments(&[&"check", &"scene.toml", &"--set", &odd]));
    assert_eq!(answer.code, 2, "{}", answer.complained);
    for more in
        [&["--out", ""][..], &["--threads", "-1"], &["--threads", "0"], &["--threads", "1e9"], &["--nothing"], &[""]]
    {
        let answer = nicolson(&place.path(""), &[&["run", "scene.toml", "--quiet"], more].concat());
        assert_eq!(answer.code, 2, "{more:?}: {}", answer.complained);
        assert!(answer.complained.starts_with("error: "), "{more:?}: {}", answer.complained);
        assert!(!place.path("results").exists() && !place.path("report.json").exists(), "{more:?}");
    }
    let answer = nicolson(&place.path(""), &["run", "scene.toml", "--quiet", "--threads", "18446744073709551615"]);
    assert_eq!(answer.code, 2, "{}", answer.complained);
    assert_eq!(nicolson::<&str>(&place.path(""), &[]).code, 2);
    assert_eq!(nicolson(&place.path(""), &["no such command"]).code, 2);
}

#[test]
fn names_with_commands_for_terminals_are_shown_without() {
    let place = Place::new();
    let answer = nicolson(&place.path(""), &["check", "a\x1b[2Jb.toml"]);
    refused(&place, "an escape", &answer, &["cannot be read"]);
    assert!(!answer.complained.contains('\x1b'), "{:?}", answer.complained);
}

#[test]
fn no_file_of_the_user_is_written_over() {
    let place = Place::new();
    let cloud: String = (0..25).map(|i| format!("{},{}\n", 0.25 * f64::from(i % 5), 0.25 * f64::from(i / 5))).collect();
    place.file("probes.csv", &cloud);
    let shape = "spacing = 0.25\nshape.box = { lower = [0.0, 0.0], upper = [1.0, 1.0] }";
    place.file("scene.toml", scene(&[(shape, "points = { file = \"probes.csv\", spacing = 0.25 }")]));
    symlink("scene.toml", place.path("link.toml")).expect("a link");
    symlink(".", place.path("same")).expect("a link");
    for more in [
        &["run", "scene.toml", "--out", "."][..],
        &["run", "scene.toml", "--out", "same"],
        &["run", "link.toml", "--out", "same/./same"],
        &["run", "scene.toml", "--solve-log", "scene.toml", "--out", "out"],
        &["run", "scene.toml", "--solve-log", "link.toml", "--out", "out"],
        &["run", "scene.toml", "--solve-log", "probes.csv", "--out", "out"],
        &["jacobian", "scene.toml", "--export-tangent", "scene.toml"],
    ] {
        let before = fs::read(place.path("scene.toml")).expect("a scene");
        let answer = nicolson(&place.path(""), more);
        refused(&place, &format!("{more:?}"), &answer, &["choose another"]);
        assert_eq!(fs::read(place.path("scene.toml")).expect("a scene"), before, "{more:?}");
        assert_eq!(fs::read_to_string(place.path("probes.csv")).expect("points"), cloud, "{more:?}");
    }
    // Beside the scene there is room for results otherwise.
    let place = Place::new();
    done("beside the scene", &nicolson(&place.path(""), &["run", "scene.toml", "--quiet", "--out", "."]));
    assert_eq!(fs::read_to_string(place.path("scene.toml")).expect("a scene"), SCENE);
}

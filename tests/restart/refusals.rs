//! What `nicolson restart` refuses, and how it says so: exit code 2, what, where, and what to do. Nothing is changed then.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use nicolson::simulation::Checkpoint;

use super::files::{Answer, nicolson};
use super::support::{Case, checkpoints, results, start};

/// A complete run with checkpoints after steps 3, 6 and 8.
fn finished(place: &Path) -> PathBuf {
    let out = place.join("out");
    start(&Case::solid("crank_nicolson").set("checkpoint", "{ every_steps = 3, keep = 5 }").scene(), &out);
    assert_eq!(checkpoints(&out).len(), 3);
    out
}

fn restart(path: &Path, more: &[&str]) -> Answer {
    let mut arguments: Vec<OsString> = vec!["restart".into(), path.into(), "--quiet".into()];
    arguments.extend(more.iter().map(OsString::from));
    nicolson(&arguments)
}

#[test]
fn a_changed_scene_is_refused_key_by_key() {
    let place = tempfile::tempdir().expect("a directory");
    let out = finished(place.path());
    let (before, all) = (results(&out), checkpoints(&out));
    let changes = ["--set", "time.step=0.01", "--set", "body.0.material.neo_hookean.density=900"];
    let answer = restart(&all[0], &changes);
    assert_eq!(answer.code, 2);
    for part in ["step-0000000003", "time.step: 0.02 → 0.01", "neo_hookean.density: 1000 → 900", "--force"] {
        assert!(answer.complained.contains(part), "{part}: {}", answer.complained);
    }
    assert_eq!((results(&out), checkpoints(&out)), (before, all.clone()));
    // These may change.
    let free = ["time.end=0.12", "output.interval=0.03", "output.history=false", "checkpoint.keep=1"];
    let other = place.path().join("other").display().to_string();
    let free: Vec<&str> = free.iter().flat_map(|key| ["--set", key]).chain(["--out", &other]).collect();
    let answer = restart(&all[0], &free);
    assert_eq!(answer.code, 0, "{}", answer.complained);
    // With force it goes on from the state.
    let answer = restart(&all[0], &[&changes[..], &["--force", "--out", &other]].concat());
    assert_eq!(answer.code, 0, "{}", answer.complained);
    // But not with other particles.
    let answer = restart(&all[0], &["--set", "body.0.counts=[5, 3]", "--force"]);
    assert_eq!(answer.code, 2);
    assert!(answer.complained.contains("state of 15 particles"), "{}", answer.complained);
    // Nor to an end before the beginning.
    let answer = restart(&all[2], &["--set", "time.end=0.1"]);
    assert_eq!(answer.code, 2);
    assert!(answer.complained.contains("before the checkpoint"), "{}", answer.complained);
}

#[test]
fn loads_that_grow_until_the_end_fix_the_end() {
    let place = tempfile::tempdir().expect("a directory");
    let out = place.path().join("out");
    start(&Case::solid("static").set("checkpoint", "{ every_steps = 3 }").scene(), &out);
    let answer = restart(&out, &["--set", "time.end=0.2"]);
    assert_eq!(answer.code, 2);
    assert!(answer.complained.contains("time.end: 0.16 → 0.2"), "{}", answer.complained);
}

#[test]
fn damaged_files_are_refused_and_a_directory_passes_them_over() {
    let place = tempfile::tempdir().expect("a directory");
    let out = finished(place.path());
    let all = checkpoints(&out);
    let whole = fs::read(&all[2]).expect("bytes");
    let mut turned = whole.clone();
    turned[whole.len() / 2] ^= 4;
    for (what, bytes, phrase) in [
        ("cut", whole[..whole.len() / 2].to_vec(), "damaged"),
        ("empty", Vec::new(), "not a checkpoint"),
        ("turned", turned, "checksum"),
        ("foreign", b"solid bracket".to_vec(), "not a checkpoint"),
    ] {
        fs::write(&all[2], bytes).expect("a file");
        let answer = restart(&all[2], &[]);
        assert_eq!(answer.code, 2, "{what}");
        for part in [phrase, "step-0000000008", "the next older one is", "step-0000000006"] {
            assert!(answer.complained.contains(part), "{what}, {part}: {}", answer.complained);
        }
    }
    let raw = {
        let mut bytes = whole.clone();
        let found = bytes.windows(13).position(|part| part == b"\"version\":\"1\"").expect("a version");
        bytes[found + 11] = b'9';
        bytes
    };
    fs::write(&all[2], raw).expect("a file");
    let answer = restart(&all[2], &[]);
    assert!(answer.code == 2 && answer.complained.contains("has version 9"), "{}", answer.complained);
    // The directory goes on from the one before, and says so.
    let answer = restart(&out, &[]);
    assert_eq!(answer.code, 0, "{}", answer.complained);
    assert!(answer.complained.contains("passed over") && answer.complained.contains("step-0000000008"));
    // It has written the last one anew.
    let last = Checkpoint::read(&all[2]).unwrap_or_else(|error| panic!("{error}"));
    assert!(last.about.parent.contains("step-0000000006"), "{}", last.about.parent);
}

#[test]
fn what_is_not_there_is_told() {
    let place = tempfile::tempdir().expect("a directory");
    let answer = restart(&place.path().join("absent"), &[]);
    assert!(answer.code == 2 && answer.complained.contains("absent"), "{}", answer.complained);
    let answer = restart(place.path(), &[]);
    assert!(answer.code == 2 && answer.complained.contains("no checkpoint"), "{}", answer.complained);
    assert!(answer.complained.contains("[checkpoint]"), "{}", answer.complained);

    // Tables that are shorter than they were: not in place, but in another directory.
    let out = finished(place.path());
    let last = checkpoints(&out).pop().expect("a checkpoint");
    let whole = fs::read_to_string(out.join("history.csv")).expect("a table");
    let cut: String = whole.lines().take(3).map(|line| format!("{line}\n")).collect();
    fs::write(out.join("history.csv"), &cut).expect("a table");
    let answer = restart(&last, &["--set", "time.end=0.2"]);
    assert_eq!(answer.code, 2);
    assert!(answer.complained.contains("history.csv") && answer.complained.contains("--out"), "{}", answer.complained);
    assert_eq!(fs::read_to_string(out.join("history.csv")).expect("a table"), cut);
    let other = place.path().join("other");
    let answer = restart(&last, &["--set", "time.end=0.2", "--out", &other.display().to_string()]);
    assert_eq!(answer.code, 0, "{}", answer.complained);
    assert_eq!(fs::read_to_string(other.join("history.csv")).expect("a table").lines().count(), 3);
}

#[test]
fn a_file_of_the_scene_that_has_changed_is_refused() {
    let place = tempfile::tempdir().expect("a directory");
    let cloud = place.path().join("cloud.csv");
    let points: String = (0..12).map(|i| format!("{},{}\n", i % 4, i / 4)).collect();
    fs::write(&cloud, format!("x,y\n{points}")).expect("a file");
    let scene = place.path().join("scene.toml");
    let text = "dimension = 2\n[[body]]\npoints = { file = \"cloud.csv\", spacing = 1 }\nmaterial.linear_volumetric = \
                { density = 1, bulk_modulus = 1 }\n[initial]\nvelocity = [\"0.01*X\", 0]\n[time]\nstep = 0.1\nend = 0.4\n\
                [checkpoint]\nevery_steps = 2\n";
    fs::write(&scene, text).expect("a scene");
    let out = place.path().join("out");
    let arguments = ["run".as_ref(), scene.as_os_str(), "--out".as_ref(), out.as_os_str(), "--quiet".as_ref()];
    let answer = nicolson(&arguments);
    assert_eq!(answer.code, 0, "{}", answer.complained);
    let first = checkpoints(&out)[0].clone();
    assert_eq!(restart(&first, &[]).code, 0);
    fs::write(&cloud, format!("x,y\n{}", points.replace("3,2", "3,2.01"))).expect("a file");
    let answer = restart(&first, &[]);
    assert_eq!(answer.code, 2);
    assert!(answer.complained.contains("cloud.csv: its content has changed"), "{}", answer.complained);
}

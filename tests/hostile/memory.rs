//! Scenes that are too large for the machine.

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

//! Bad scenes: every mistake has its place, a telling message and a remedy; none makes the program panic.

#[path = "scene_errors/content.rs"]
mod content;
#[path = "scene_errors/files.rs"]
mod files;
#[path = "scene_errors/mutations.rs"]
mod mutations;
#[path = "scene_errors/overrides.rs"]
mod overrides;
#[path = "scene_errors/suggestions.rs"]
mod suggestions;
mod support;
#[path = "scene_errors/text.rs"]
mod text;
#[path = "scene_errors/units.rs"]
mod units;

use std::path::Path;

use nicolson::scene::{Scene, SceneError, SceneErrors};
use support::written;

/// A good scene; every case below spoils one line of it.
const GOOD: &str = r#"title = "good"
dimension = 2
gravity = [0.0, -9.81]
body_force = ["0.1*sin(t)", 0]
[[body]]
name = "column"
spacing = 0.25
layout = "vertex"
kernel = "cubic_spline"
smoothing = 1.2
shape.box = { lower = [0.0, 0.0], upper = [2.5, 2.5] }
material.hyperelastic_volumetric = { density = 1000.0, gamma = 7.0, wave_speed = 10.0 }
[[body]]
name = "block"
counts = [4, 5]
layout = "cell"
shape.box = { lower = [5.0, 0.0], upper = [6.0, 1.25] }
material.linear_volumetric = { density = 1000.0, youngs_modulus = 1e6, poissons_ratio = 0.3 }
[initial]
displacement = [0, "0.001*Y"]
velocity = ["0", "-1"]
hydrostatic = { level = 2.5 }
[[boundary]]
name = "base"
select.half_space = { point = [0.0, 0.0], normal = [0.0, -1.0] }
body = "column"
fix = ["x", "y"]
[[boundary]]
name = "lid"
body = "column"
select.where = "Y > 2.4"
displacement = { y = "0.1*sin(t)" }
[[boundary]]
name = "side"
body = "block"
select.box = { lower = [5.0, 0.0], upper = [5.2, 9.0] }
fix = ["x"]
[[traction]]
name = "pull"
body = "column"
face = "upper_x"
value = ["1e4*sin(t)", 0]
[stabilisation]
tau_v = 0.5
tau_p = 0.1
[time]
end = 1.0
step = 0.05
scheme = "crank_nicolson"
[newton]
max_iterations = 25
line_search = "backtracking"
unknowns = "auto"
[linear]
solver = "gmres"
tolerance = 1e-10
restart = 50
[output]
interval = 0.05
fields = ["pressure", "velocity"]
[[probe]]
name = "tip"
at = [2.5, 2.5]
[[probe]]
name = "foot"
at = [5.5, 0.5]
body = "block"
[exact]
displacement = ["0", "0.001*Y"]
pressure = "1000*t"
"#;

/// The mistake is expected at the place of this mark, which is taken out of the scene.
const MARK: char = '▶';

/// A part of the good scene, what it becomes, a part of the message and a part of the remedy.
type Case = (&'static str, &'static str, &'static str, &'static str);

fn errors(text: &str) -> Vec<SceneError> {
    match set_up(text, "scene.toml", Path::new(""), &[]) {
        Ok(()) => Vec::new(),
        Err(errors) => errors.iter().cloned().collect(),
    }
}

fn set_up(text: &str, name: &str, base: &Path, overrides: &[(String, String)]) -> Result<(), SceneErrors> {
    let scene = Scene::parse(text, name, base, overrides)?;
    // Small, so that no mutation of the good scene costs memory.
    let most = 100_000;
    match scene.dimension() {
        1 => scene.setup_within::<1>(most).map(drop),
        2 => scene.setup_within::<2>(most).map(drop),
        _ => scene.setup_within::<3>(most).map(drop),
    }
}

fn check(cases: &[Case]) {
    for (from, to, phrase, remedy) in cases {
        assert_eq!(GOOD.matches(from).count(), 1, "{from:?} must occur once in the good scene");
        let marked = GOOD.replace(from, to);
        let position = marked.find(MARK).unwrap_or_else(|| panic!("no mark in {to:?}"));
        let line = marked[..position].matches('\n').count() + 1;
        let column = marked[..position].chars().rev().take_while(|letter| *letter != '\n').count() + 1;
        let found = errors(&marked.replace(MARK, ""));
        let shown: Vec<String> = found.iter().map(ToString::to_string).collect();
        assert_eq!(found.len(), 1, "{to:?}: one mistake, one message\n{}", shown.join("\n"));
        assert_eq!((found[0].line, found[0].column), (Some(line), Some(column)), "{to:?}\n{}", shown[0]);
        assert!(found[0].message.contains(phrase), "{to:?}: no {phrase:?} in\n{}", shown[0]);
        assert!(found[0].remedy.contains(remedy), "{to:?}: no {remedy:?} in\n{}", shown[0]);
    }
}

#[test]
fn the_good_scene_is_good() {
    assert_eq!(errors(GOOD), []);
}

#[test]
fn all_mistakes_are_shown_together_in_the_order_of_the_text() {
    let text = GOOD
        .replace("spacing = 0.25", "spacing = -1")
        .replace("gamma = 7.0", "gamma = 0.5")
        .replace("velocity = [\"0\", \"-1\"]", "velocity = [\"sine(X)\", \"Z\"]")
        .replace("step = 0.05\n", "step = 0\n")
        .replace("at = [5.5, 0.5]", "at = [99, 0.5]");
    let found = errors(&text);
    let lines: Vec<_> = found.iter().filter_map(|error| error.line).collect();
    assert_eq!(lines, [7, 12, 21, 21, 48, 66]);
    let names =
        GOOD.replace("spacing = 0.25", "spcing = 0.25").replace("tau_v", "tauv").replace("end = 1.0", "end = 'x'");
    let lines: Vec<_> = errors(&names).iter().filter_map(|error| error.line).collect();
    assert_eq!(lines, [7, 44, 47]);
}

#[test]
fn the_message_has_the_expected_form() {
    let text = GOOD
        .replace("normal = [0.0, -1.0]", "normal = [0.0, -1.0] }\n#")
        .replace("point = [0.0, 0.0]", "point = [0, -0.5]");
    let text = text.replace("select.half", "  select.half");
    let expected = "scene.toml:25:3: boundary 'base' selects no particle: lowest Y is 0\n    |\n 25 |   \
                    select.half_space = { point = [0, -0.5], normal = [0.0, -1.0] }\n    |   ^^^^^^\nhelp: move `point` \
                    from Y = -0.5 to Y = 0, or use a finer layout";
    assert_eq!(errors(&text)[0].to_string(), expected);
}

#[test]
fn the_wrong_dimension_is_refused() {
    let errors = written::read::<3>(GOOD, Path::new("")).unwrap_err();
    assert!(errors.to_string().contains("2 dimension(s), the computation 3"));
}

//! Overrides: their mistakes, and the text that they make.

use std::path::Path;

use nicolson::scene::{Scene, SceneErrors};

use super::{GOOD, set_up};

fn overridden(changes: &[(&str, &str)]) -> Result<Scene, SceneErrors> {
    let changes: Vec<_> = changes.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    let scene = Scene::parse(GOOD, "scene.toml", Path::new(""), &changes)?;
    set_up(GOOD, "scene.toml", Path::new(""), &changes)?;
    Ok(scene)
}

#[test]
fn mistakes_in_overrides_are_blamed_on_them() {
    for (key, value, column, phrase, remedy) in [
        ("body.0.spacing", "-1", 16, "`spacing` is -1", "positive"),
        ("body.0.spacing", "fine", 16, "found the text \"fine\"", "a number"),
        ("body.7.spacing", "1", 6, "`body` has no element 7", "from 0 to 1"),
        ("body.column.spacing", "1", 6, "`column` is not the index", "did you mean `body.0`, which is named 'column'?"),
        ("boundary.ldi.name", "1", 10, "`ldi` is not the index", "did you mean `boundary.1`, which is named 'lid'?"),
        ("body.0.spacing", "5 mmm", 16, "unknown unit `mmm`", "did you mean `mm`?"),
        ("body.0.spacing", "5 Pa", 16, "`5 Pa` is a pressure, but a length is wanted", "such as \"5 mm\""),
        ("time.step", "2 mm", 11, "`2 mm` is a length, but a time is wanted", "such as \"0.2 ms\""),
        ("gravity.1", "-9.81 m/s", 11, "is a velocity, but an acceleration", "9.81 m/s^2"),
        ("body.first.spacing", "1", 6, "`first` is not the index", "such as `body.0`"),
        ("body.0.spcing", "1", 8, "unknown key `spcing`", "`spacing`?"),
        ("bdoy.spacing", "1", 1, "unknown key `bdoy`", "`body`?"),
        ("title.first", "1", 7, "single value", "set `title` itself"),
        ("time..step", "1", 6, "part of the key is empty", "time.step"),
        ("", "1", 1, "part of the key is empty", "time.step"),
        ("time", "3", 6, "a table of time options", "time options"),
        ("body.0", "3", 6, "is a table", "one of its keys"),
        ("initial.velocity", "[0, nan]", 22, "NaN is not a finite", "finite"),
        ("initial.velocity.1", "sine(X)", 20, "unknown function `sine`", "`sin(…)`?"),
        ("newton.line_search", "armijo", 20, "`armijo` is not one", "backtracking"),
        ("linear", "{ restart = 0 }", 20, "`restart` is 0", "at least 1"),
        ("exact.velocity", "[1]", 16, "exact velocity` has 1", "give 2"),
        ("body.1.shape.box.upper.1", "-2", 0, "no extent along y", "larger"),
    ] {
        let errors = overridden(&[("time.end", "2"), (key, value)]).unwrap_err();
        assert_eq!(errors.len(), 1, "{errors}");
        let error = errors.iter().next().unwrap();
        assert!(error.message.contains(phrase) && error.remedy.contains(remedy), "{error}");
        if column > 0 {
            assert_eq!(error.origin, format!("--set {key}={value}"), "{error}");
            assert_eq!((error.line, error.column), (None, Some(column)), "{error}");
            assert!(error.to_string().starts_with(&format!("--set {key}={value}: ")));
        }
    }
}

#[test]
fn overrides_do_not_move_the_mistakes_of_the_file() {
    let text = GOOD.replace("restart = 50", "restart = 0");
    let changes = [("stabilisation.gradient", "corrected"), ("body.0.weights", "balanced"), ("newton", "{}")];
    let changes: Vec<_> = changes.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    let errors = Scene::parse(&text, "scene.toml", Path::new(""), &changes).unwrap_err();
    let error = errors.iter().next().unwrap();
    let line = text.lines().position(|line| line.starts_with("restart")).unwrap() + 1;
    assert_eq!((errors.len(), error.line, error.column), (1, Some(line), Some(11)), "{errors}");
    assert_eq!(error.source_line.as_deref(), Some("restart = 0"));
}

#[test]
fn a_scene_with_overrides_can_be_written_down() {
    let changes = [
        ("time.end", "2.5"),
        ("time.step", "0.1"),
        ("body.0.spacing", "0.5"),
        ("body.1.material", "{ linear_volumetric = { density = 5, bulk_modulus = 1e7 } }"),
        ("initial.velocity.0", "0.5*X"),
        ("body.0.shape.box.upper", "[2.5, 3.0]"),
        ("boundary.1.select", "{ where = 'Y > 2.9' }"),
        ("probe.0.at.1", "2.0"),
        ("output.plots", "false"),
        ("title", "with \"quotes\""),
        ("newton", "{ max_iterations = 3 }"),
        ("newton.max_iterations", "7"),
        ("linear.max_iterations", "8"),
    ];
    let scene = overridden(&changes).unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!((scene.time.end, scene.newton.max_iterations, scene.linear.max_iterations), (2.5, 7, 8));
    assert_eq!((scene.title.as_str(), scene.output.plots), ("with \"quotes\"", false));
    let again =
        Scene::parse(scene.text(), "again.toml", Path::new(""), &[]).unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!((&again.time, &again.newton, &again.linear), (&scene.time, &scene.newton, &scene.linear));
    let (one, _) = scene.setup::<2>().unwrap();
    let (two, _) = again.setup::<2>().unwrap();
    assert_eq!(one.particles, two.particles);
    assert_eq!((&one.bodies, &one.initial, &one.probes), (&two.bodies, &two.initial, &two.probes));
    assert_eq!(one.constraints, two.constraints);

    // An override may make a table that the file does not have.
    let text = GOOD.replace("[stabilisation]\ntau_v = 0.5\ntau_p = 0.1\n", "");
    let changes = [("stabilisation.tau_v".to_owned(), "0.25".to_owned())];
    let scene = Scene::parse(&text, "scene.toml", Path::new(""), &changes).unwrap();
    assert_eq!(scene.setup::<2>().unwrap().0.stabilisation.unwrap().tau_v, 0.25);
    assert!(Scene::parse(scene.text(), "again.toml", Path::new(""), &[]).is_ok());
}

//! How a scene chooses the control, and what it is told if it does so wrongly.

use std::path::Path;

use nicolson::scene::Scene;

const SCENE: &str = "dimension = 2\nHERE\n[[body]]\nspacing = 0.5\nshape.box = { lower = [0, 0], upper = [2, 2] }\nBODY\n\
                     material.linear_volumetric = { density = 1000, bulk_modulus = 1e6 }\n[time]\nend = 1\nstep = 0.1\n";

fn read(scene: &str, body: &str) -> Result<(f64, Vec<String>), String> {
    let text = SCENE.replace("HERE", scene).replace("BODY", body);
    let scene = Scene::parse(&text, "scene.toml", Path::new(""), &[]).map_err(|errors| errors.to_string())?;
    let (setup, warnings) = scene.setup::<2>().map_err(|errors| errors.to_string())?;
    Ok((setup.bodies[0].hourglass, warnings))
}

#[test]
fn scenes_choose_it() {
    assert_eq!(read("", "").unwrap(), (0.0, vec![]), "a fluid has none");
    assert_eq!(read("hourglass = \"none\"", "").unwrap(), (0.0, vec![]));
    assert_eq!(read("hourglass = false", "").unwrap().0, 0.0);
    assert_eq!(read("hourglass = 1", "").unwrap().0, 1.0);
    assert_eq!(read("hourglass = 0.5", "hourglass = 2.5").unwrap().0, 2.5, "the body wins");
    assert_eq!(read("hourglass = 0.5", "hourglass = \"none\"").unwrap().0, 0.0);
    let (_, warnings) = read("hourglass = 0.5", "").unwrap();
    assert!(warnings.len() == 1 && warnings[0].contains("fluid") && warnings[0].contains(":2:"), "{warnings:?}");
    for (wrong, word) in [
        ("-1", "zero or positive"),
        ("nan", "zero or positive"),
        ("inf", "zero or positive"),
        ("true", "coefficient"),
        ("\"some\"", "coefficient"),
        ("[1]", "coefficient"),
    ] {
        for (place, line) in [(true, ":2:"), (false, ":6:")] {
            let key = format!("hourglass = {wrong}");
            let outcome = if place { read(&key, "") } else { read("", &key) };
            let error = outcome.expect_err(wrong);
            assert!(error.contains(line) && error.contains(word), "{error}");
        }
    }
}

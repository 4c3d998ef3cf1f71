//! How a scene chooses the control, and what it is told if it does so wrongly.

use std::path::Path;

use nicolson::model::Model;
use nicolson::scene::Scene;
use nicolson::stabilisation::{DEFAULT_HOURGLASS, DEFAULT_HOURGLASS_UNBALANCED};

const SCENE: &str = "dimension = 2\nHERE\n[[body]]\nspacing = 0.5\nshape.box = { lower = [0, 0], upper = [2, 2] }\nBODY\n\
                     material.linear_volumetric = { density = 1000, bulk_modulus = 1e6 }\n[time]\nend = 1\nstep = 0.1\n";

fn read(scene: &str, body: &str) -> Result<(f64, Vec<String>), String> {
    read_text(&SCENE.replace("HERE", scene).replace("BODY", body))
}

/// The coefficient of the model, and the warnings of its scene.
fn read_text(text: &str) -> Result<(f64, Vec<String>), String> {
    let scene = Scene::parse(text, "scene.toml", Path::new(""), &[]).map_err(|errors| errors.to_string())?;
    let (setup, warnings) = scene.setup::<2>().map_err(|errors| errors.to_string())?;
    let model = Model::new(setup, None, None).map_err(|error| error.to_string())?;
    Ok((model.setup().bodies[0].hourglass.ok_or("no coefficient")?, warnings))
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

#[test]
fn solids_have_what_suits_the_weights_that_they_get() {
    let solid = "linear_elastic = { density = 1000, youngs_modulus = 1e6, poissons_ratio = 0.3 }";
    let text = SCENE.replace("linear_volumetric = { density = 1000, bulk_modulus = 1e6 }", solid).replace("HERE", "");
    assert!(text.contains(solid));
    for (body, expected) in [
        ("", DEFAULT_HOURGLASS),
        ("weights = \"balanced\"", DEFAULT_HOURGLASS),
        ("weights = \"separate\"", DEFAULT_HOURGLASS_UNBALANCED),
        ("weights = \"single\"", DEFAULT_HOURGLASS_UNBALANCED),
        // Rows of nine of a cell layout cannot be balanced.
        ("layout = \"cell\"\nsmoothing = 1.0", DEFAULT_HOURGLASS_UNBALANCED),
        ("weights = \"separate\"\nhourglass = 0.75", 0.75),
    ] {
        assert_eq!(read_text(&text.replace("BODY", body)).unwrap(), (expected, vec![]), "{body}");
    }
    // λ/μ = 2ν/(1 − 2ν) against that of ν = 0.45.
    for (ratio, share) in [("-0.2", 1.0), ("0.4", 1.0), ("0.49", 9.0 / 49.0), ("0.4999", 0.1)] {
        let text = text.replace("BODY", "").replace("poissons_ratio = 0.3", &format!("poissons_ratio = {ratio}"));
        let (found, _) = read_text(&text).unwrap();
        assert!((found / DEFAULT_HOURGLASS - share).abs() < 1e-9, "ν = {ratio}: {found}");
    }
}

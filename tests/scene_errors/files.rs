//! Files that cannot be read, and lists of points with mistakes.

use nicolson::scene::Scene;

use super::set_up;

#[test]
fn files_that_cannot_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let read = |name: &str| Scene::read(&at(name), &[]).unwrap_err().iter().next().unwrap().clone();

    let missing = read("missing.toml");
    assert!(missing.message.contains("cannot be read") && missing.remedy.contains("path") && missing.line.is_none());
    assert!(missing.to_string().starts_with(&at("missing.toml").display().to_string()));
    assert!(read(".").message.contains("cannot be read"));

    std::fs::write(at("latin.toml"), b"title = \"a\"\nname = \"b\xfcr\"\n").unwrap();
    let latin = read("latin.toml");
    assert_eq!((latin.line, latin.column), (Some(2), Some(10)));
    assert!(latin.message.contains("not UTF-8") && latin.remedy.contains("UTF-8"));

    std::fs::write(at("empty.toml"), "").unwrap();
    let empty = read("empty.toml");
    assert!(empty.message.contains("`dimension` is missing") && empty.line == Some(1), "{empty}");

    let nested = format!("a = {}{}", "[".repeat(100_000), "]".repeat(100_000));
    std::fs::write(at("nested.toml"), nested).unwrap();
    let nested = read("nested.toml");
    assert!(nested.message.contains("too deep") && nested.line == Some(1), "{nested}");
    assert!(nested.to_string().len() < 1000);
}

#[test]
fn point_lists_with_mistakes() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "dimension = 2\n[[body]]\npoints = { file = \"cloud.csv\", spacing = 0.1 }\n\
                 material.linear_volumetric = { density = 1, bulk_modulus = 1 }\n[time]\nend = 1\nstep = 0.1\n";
    let first = |scene: &str| {
        let errors = set_up(scene, "scene.toml", folder.path(), &[]).unwrap_err();
        errors.iter().next().unwrap().clone()
    };
    let missing = first(scene);
    assert_eq!((missing.origin.as_str(), missing.line, missing.column), ("scene.toml", Some(3), Some(19)));
    assert!(missing.message.contains("cannot be read") && missing.remedy.contains("folder of the scene"));

    let cloud = folder.path().join("cloud.csv");
    for (text, line, column, phrase) in [
        ("0,0\n1,zero\n", 2, 3, "not a number"),
        ("x,y\n0,nan\n", 2, 3, "not finite"),
        ("0,0\n1\n", 2, 1, "1 columns"),
        ("0,0\n1,0\n0,0\n", 3, 1, "same point as in line 1"),
        ("", 1, 1, "no points"),
    ] {
        std::fs::write(&cloud, text).unwrap();
        let error = first(scene);
        assert_eq!((error.origin, error.line, error.column), (cloud.display().to_string(), Some(line), Some(column)));
        assert!(error.message.contains(phrase) && !error.remedy.is_empty());
    }
    std::fs::write(&cloud, b"0,0\n\xff\n").unwrap();
    assert!(first(scene).message.contains("not UTF-8"));

    std::fs::write(&cloud, "0,0\n1,0\n0,1\n").unwrap();
    assert!(set_up(scene, "scene.toml", folder.path(), &[]).is_ok());
    for (extra, phrase) in [
        ("[[traction]]\nface = 'upper_x'\nvalue = [1, 0]\n", "has no faces: its boundary"),
        ("[[probe]]\nname = 'p'\nat = [0.5, 0.5]\n", "lies outside"),
        ("[initial]\nhydrostatic = { level = 1 }\n", "needs gravity"),
    ] {
        assert!(first(&format!("{scene}{extra}")).message.contains(phrase), "{extra}");
    }
    assert!(first(&scene.replace("points", "spacing = 1\npoints")).message.contains("belongs to lattices"));
    assert!(first(&scene.replace("spacing = 0.1", "spacing = 0")).message.contains("`spacing` is 0"));
}

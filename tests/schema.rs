//! The schema of scenes against the scenes: it takes what the program takes, and refuses what it refuses.

#[path = "schema/validate.rs"]
mod validate;

use std::path::{Path, PathBuf};

use nicolson::scene::{Scene, schema};
use serde_json::{Map, Value, json};
use validate::refusals;

fn scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let scenes: Vec<PathBuf> = entries.filter(|path| path.extension().is_some_and(|end| end == "toml")).collect();
    assert!(scenes.len() > 15);
    scenes
}

fn root() -> Value {
    serde_json::from_str(schema::TEXT).unwrap()
}

fn of_toml(text: &str) -> Value {
    toml::from_str(text).unwrap()
}

#[test]
fn every_example_is_valid() {
    let root = root();
    for path in scenes() {
        let scene = of_toml(&std::fs::read_to_string(&path).unwrap());
        assert_eq!(refusals(&root, &scene), Vec::<String>::new(), "{}", path.display());
    }
}

/// Puts an unknown key into the n-th table of a scene; whether there are that many.
fn spoil(value: &mut Value, count: &mut usize) -> bool {
    match value {
        Value::Object(table) => {
            if *count == 0 {
                table.insert("qqq".to_owned(), json!(1));
                return true;
            }
            *count -= 1;
            table.values_mut().any(|inner| spoil(inner, count))
        }
        Value::Array(list) => list.iter_mut().any(|inner| spoil(inner, count)),
        _ => false,
    }
}

#[test]
fn an_unknown_key_in_any_table_of_any_example_is_refused_by_both() {
    let root = root();
    let mut cases = 0;
    for path in scenes() {
        let scene = of_toml(&std::fs::read_to_string(&path).unwrap());
        for table in 0.. {
            let (mut bad, mut count) = (scene.clone(), table);
            if !spoil(&mut bad, &mut count) {
                break;
            }
            cases += 1;
            assert_ne!(refusals(&root, &bad), Vec::<String>::new(), "{}: table {table}", path.display());
            let text = toml::to_string(&bad).unwrap();
            let errors = Scene::parse(&text, "scene.toml", path.parent().unwrap(), &[]).unwrap_err();
            let told = errors.iter().any(|error| {
                error.message == "unknown key `qqq`"
                    || error.message.contains("more than one choice is made")
                    || error.message.contains("`qqq` is not one of the choices")
            });
            assert!(told, "{}: {errors}", path.display());
        }
    }
    assert!(cases > 200, "{cases}");
}

#[test]
fn wrong_values_are_refused_by_both() {
    let root = root();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/csm1.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let good = of_toml(&text);
    for (pointer, value) in [
        ("dimension", json!(4)),
        ("dimension", json!("two")),
        ("title", json!(3)),
        ("units", json!("mm-stone-s")),
        ("body", json!(3)),
        ("time", json!([])),
        ("newton", json!({ "line_search": "armijo" })),
        ("newton", json!({ "max_iterations": -3 })),
        ("newton", json!({ "max_iterations": 2.5 })),
        ("linear", json!({ "restart": "many" })),
        ("output", json!({ "plots": "yes" })),
        ("output", json!({ "fields": ["presure"] })),
        ("output", json!({ "interval": "soon" })),
        ("gravity", json!("9.81 m/s^2")),
        ("hourglass", json!("some")),
        ("initial", json!({ "hydrostatic": {} })),
        ("probe", json!([{ "at": [1.0] }])),
    ] {
        let mut bad = good.clone();
        bad[pointer] = value.clone();
        assert_ne!(refusals(&root, &bad), Vec::<String>::new(), "{pointer} = {value}");
        let bad = toml::to_string(&bad).unwrap();
        Scene::parse(&bad, "scene.toml", path.parent().unwrap(), &[]).unwrap_err();
    }
    for required in ["dimension", "body", "time"] {
        let mut bad = good.clone();
        bad.as_object_mut().unwrap().remove(required);
        assert_ne!(refusals(&root, &bad), Vec::<String>::new(), "without {required}");
    }
}

/// Names of keys, and of choices, of a schema.
fn names(schema: &Value, keys: &mut Vec<String>, choices: &mut Vec<String>) {
    match schema {
        Value::Object(table) => {
            let properties = table.get("properties").and_then(Value::as_object);
            keys.extend(properties.into_iter().flat_map(Map::keys).cloned());
            choices.extend(table.get("const").and_then(Value::as_str).map(str::to_owned));
            let list = table.get("enum").and_then(Value::as_array);
            choices.extend(list.into_iter().flatten().filter_map(Value::as_str).map(str::to_owned));
            table.values().for_each(|value| names(value, keys, choices));
        }
        Value::Array(list) => list.iter().for_each(|value| names(value, keys, choices)),
        _ => {}
    }
}

/// Whether a name stands in a text as a word.
fn mentions(text: &str, name: &str) -> bool {
    let is_part = |letter: Option<char>| letter.is_some_and(|letter| letter.is_alphanumeric() || letter == '_');
    text.match_indices(name).any(|(start, _)| {
        !is_part(text[..start].chars().next_back()) && !is_part(text[start + name.len()..].chars().next())
    })
}

/// The hand-written page of keys has every key and every choice of the schema; its large example is valid, so that it
/// has no key that does not exist.
#[test]
fn the_written_reference_and_the_schema_agree() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/scene/reference.md");
    let page = std::fs::read_to_string(path).unwrap();
    let root = root();
    let (mut keys, mut choices) = (Vec::new(), Vec::new());
    names(&root, &mut keys, &mut choices);
    assert!(keys.len() > 100 && choices.len() > 70, "{} {}", keys.len(), choices.len());
    let missing: Vec<&String> = keys.iter().chain(&choices).filter(|name| !mentions(&page, name)).collect();
    assert!(missing.is_empty(), "not in reference.md: {missing:?}");
    let block = page.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    assert_eq!(refusals(&root, &of_toml(block)), Vec::<String>::new());
}

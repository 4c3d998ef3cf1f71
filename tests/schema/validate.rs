//! As much of JSON Schema as the schema of scenes uses. What it does not know makes it fail.

use serde_json::Value;

/// Why a value is refused, with the places; empty if it is valid.
pub fn refusals(root: &Value, value: &Value) -> Vec<String> {
    let mut found = Vec::new();
    check(root, root, value, "", &mut found);
    found
}

fn check(root: &Value, schema: &Value, value: &Value, place: &str, found: &mut Vec<String>) {
    let rules = match schema {
        Value::Bool(true) => return,
        Value::Bool(false) => return found.push(format!("{place}: nothing is allowed")),
        other => other.as_object().unwrap(),
    };
    for (rule, argument) in rules {
        match rule.as_str() {
            "$schema" | "$defs" | "title" | "description" | "default" | "examples" | "x-unit" => {}
            // The properties that it excepts are checked below.
            "additionalProperties" => {
                let known = rules.get("properties").and_then(Value::as_object);
                for key in value.as_object().into_iter().flatten().map(|(key, _)| key) {
                    if argument == &Value::Bool(false) && !known.is_some_and(|known| known.contains_key(key)) {
                        refuse(found, place, format!("unknown key {key}"));
                    }
                }
            }
            "$ref" => {
                let path = argument.as_str().unwrap().trim_start_matches('#').replace("%20", " ");
                let target = root.pointer(&path).unwrap_or_else(|| panic!("no {path}"));
                check(root, target, value, place, found);
            }
            "type" => {
                let types = argument.as_array().cloned().unwrap_or_else(|| vec![argument.clone()]);
                if !types.iter().any(|name| is_of(value, name.as_str().unwrap())) {
                    refuse(found, place, format!("{value} is not {argument}"));
                }
            }
            "const" => {
                if argument != value {
                    refuse(found, place, format!("{value} is not {argument}"));
                }
            }
            "enum" => {
                if !argument.as_array().unwrap().contains(value) {
                    refuse(found, place, format!("{value} is none of {argument}"));
                }
            }
            "minimum" | "maximum" => {
                let (number, bound) = (value.as_f64(), argument.as_f64().unwrap());
                if number.is_some_and(|number| if rule == "minimum" { number < bound } else { number > bound }) {
                    refuse(found, place, format!("{value} is beyond the {rule} {bound}"));
                }
            }
            "pattern" => {
                // The one pattern there is: a number and a unit.
                let text = value.as_str().unwrap_or("0 m").trim_start();
                let digits = text.trim_start_matches(['+', '-']).starts_with(|c: char| c.is_ascii_digit() || c == '.');
                let unit = text.trim_start_matches(|c: char| !(c.is_alphabetic() || c == '°' || c == '('));
                if !digits || unit.is_empty() {
                    refuse(found, place, format!("{value} does not match {argument}"));
                }
            }
            "required" => {
                for key in argument.as_array().unwrap() {
                    if value.as_object().is_some_and(|table| !table.contains_key(key.as_str().unwrap())) {
                        refuse(found, place, format!("{key} is missing"));
                    }
                }
            }
            "properties" => {
                for (key, own) in argument.as_object().unwrap() {
                    if let Some(inner) = value.get(key) {
                        check(root, own, inner, &format!("{place}/{key}"), found);
                    }
                }
            }
            "items" => {
                for (index, inner) in value.as_array().into_iter().flatten().enumerate() {
                    check(root, argument, inner, &format!("{place}/{index}"), found);
                }
            }
            "anyOf" | "oneOf" => {
                let fitting = argument.as_array().unwrap().iter().filter(|choice| {
                    let mut inner = Vec::new();
                    check(root, choice, value, place, &mut inner);
                    inner.is_empty()
                });
                let count = fitting.count();
                if count == 0 || rule == "oneOf" && count > 1 {
                    refuse(found, place, format!("{value} fits {count} of {rule}"));
                }
            }
            other => panic!("{place}: the rule {other} is not known here"),
        }
    }
}

fn refuse(found: &mut Vec<String>, place: &str, why: String) {
    found.push(format!("{place}: {why}"));
}

fn is_of(value: &Value, name: &str) -> bool {
    match name {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        other => panic!("the type {other} is not known here"),
    }
}

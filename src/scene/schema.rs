//! The keys of a scene for editors and readers: JSON Schema, and a Markdown page made of it.
//!
//! The schema is stored beside this file. It is generated from the types that read a scene, by the test below, which
//! fails where the two differ; `NICOLSON_WRITE_SCHEMA=1 cargo test stored_schema` writes it anew. Nothing of that is
//! part of the program. Quantities carry their unit as `x-unit`.

use std::fmt::Write as _;

use serde_json::{Map, Value};

/// JSON Schema (draft 2020-12) of scenes.
pub const TEXT: &str = include_str!("schema.json");

/// All keys as a page of Markdown: a section per table, with value, default and meaning of every key.
pub fn reference() -> String {
    let Ok(root) = serde_json::from_str::<Value>(TEXT) else {
        // Unreachable: a test reads the stored text.
        return String::new();
    };
    let mut page = Page { root: &root, text: String::new(), done: Vec::new() };
    page.text.push_str("# Keys of a scene\n\n");
    page.text.push_str(
        "Made by `nicolson schema --reference`. A *length* and the like is a plain number, or a text with a ",
    );
    page.text.push_str("unit such as `\"5 mm\"`; a *field* may also be an expression of X, Y, Z, t.\n");
    page.table("", &root, &[]);
    page.text
}

/// Names that the key at a path such as `linear.solver` can be given, or that can stand below it.
pub fn choices(path: &str) -> Vec<String> {
    let Ok(root) = serde_json::from_str::<Value>(TEXT) else {
        // Unreachable: a test reads the stored text.
        return Vec::new();
    };
    let page = Page { root: &root, text: String::new(), done: Vec::new() };
    let mut at = &root;
    for key in path.split('.') {
        let schema = page.resolve(at);
        let table = page.resolve(schema.get("items").unwrap_or(schema));
        let Some(next) = table.get("properties").and_then(|keys| keys.get(key)) else { return Vec::new() };
        at = next;
    }
    let mut names = Vec::new();
    page.names(at, &mut names);
    names
}

struct Page<'r> {
    root: &'r Value,
    text: String,
    /// Definitions that have a section already.
    done: Vec<String>,
}

impl<'r> Page<'r> {
    /// Section of a table, and those of the tables in it.
    fn table(&mut self, path: &str, schema: &'r Value, above: &[&str]) {
        if !path.is_empty() {
            let _ = write!(self.text, "\n## `{path}`\n\n{}\n", words(schema));
        }
        let required: Vec<&str> = array(schema, "required").iter().filter_map(Value::as_str).collect();
        self.text.push_str("\n| key | value | default | meaning |\n|---|---|---|---|\n");
        let keys = schema.get("properties").and_then(Value::as_object);
        for (key, own) in keys.into_iter().flatten() {
            let default = match own.get("default") {
                Some(default) if !default.is_array() || default.as_array().is_some_and(|list| !list.is_empty()) => {
                    format!("`{default}`")
                }
                _ if required.contains(&key.as_str()) => "required".to_owned(),
                _ => String::new(),
            };
            let value = self.value(own);
            let _ = writeln!(self.text, "| `{key}` | {value} | {default} | {}{} |", words(own), self.choices(own));
        }
        for (key, own) in keys.into_iter().flatten() {
            let deeper = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            self.inner(&deeper, own, above);
        }
    }

    /// Sections of what a key refers to, if that is a table or a choice of tables.
    fn inner(&mut self, path: &str, schema: &'r Value, above: &[&str]) {
        let schema = schema.get("items").unwrap_or(schema);
        let Some(name) = schema.get("$ref").and_then(Value::as_str) else { return };
        let target = self.resolve(schema);
        if above.contains(&name) || self.done.iter().any(|done| done == name) {
            return;
        }
        let mut above = above.to_vec();
        above.push(name);
        if target.get("properties").is_some() {
            self.done.push(name.to_owned());
            self.table(path, target, &above);
            return;
        }
        let tables: Vec<&Value> =
            array(target, "oneOf").iter().filter(|choice| choice.get("properties").is_some()).collect();
        if tables.is_empty() {
            return;
        }
        self.done.push(name.to_owned());
        let _ = write!(self.text, "\n## `{path}`\n\n{} One of:\n\n", words(target));
        self.text.push_str("| choice | value | meaning |\n|---|---|---|\n");
        for choice in array(target, "oneOf") {
            if let Some(name) = choice.get("const") {
                let _ = writeln!(self.text, "| `{name}` | | {} |", words(choice));
            }
            for (key, own) in choice.get("properties").and_then(Value::as_object).into_iter().flatten() {
                let _ = writeln!(self.text, "| `{key}` | {} | {} |", self.value(own), words(choice));
            }
        }
        for choice in tables {
            for (key, own) in choice.get("properties").and_then(Value::as_object).into_iter().flatten() {
                self.inner(&format!("{path}.{key}"), own, &above);
            }
        }
    }

    /// What kind of value is wanted.
    fn value(&self, schema: &Value) -> String {
        if let Some(name) = schema.get("$ref").and_then(Value::as_str) {
            let target = self.resolve(schema);
            if let Some(unit) = target.get("x-unit").and_then(Value::as_str) {
                let name = name.rsplit('/').next().unwrap_or(name).replace("%20", " ");
                return format!("{name}, {unit}");
            }
            return if target.get("properties").is_some() { "table".to_owned() } else { self.value(target) };
        }
        if let Some(items) = schema.get("items") {
            let one = self.value(items);
            return if one == "table" { "tables".to_owned() } else { format!("list: {one}") };
        }
        for key in ["oneOf", "anyOf"] {
            let choices = array(schema, key);
            if choices.iter().any(|choice| choice.get("properties").is_some()) {
                return "one of a choice".to_owned();
            }
            if !choices.is_empty() {
                let mut names: Vec<String> = choices.iter().map(|choice| self.value(choice)).collect();
                names.dedup();
                return names.join(", ");
            }
        }
        if let Some(only) = schema.get("const") {
            return format!("`{only}`");
        }
        if schema.get("enum").is_some() {
            let names: Vec<String> = array(schema, "enum").iter().map(|name| format!("`{name}`")).collect();
            return names.join(", ");
        }
        match schema.get("type").and_then(Value::as_str) {
            Some("string") => "text",
            Some("integer") => "whole number",
            Some("boolean") => "true or false",
            Some(other) => other,
            None => "value",
        }
        .to_owned()
    }

    /// Meanings of the names that can be chosen.
    fn choices(&self, schema: &Value) -> String {
        let schema = self.resolve(schema.get("items").unwrap_or(schema));
        let mut list = String::new();
        if array(schema, "oneOf").iter().all(|choice| choice.get("const").is_some()) {
            for choice in array(schema, "oneOf") {
                let name = choice.get("const").and_then(Value::as_str).unwrap_or_default();
                let _ = write!(list, "<br>`{name}`: {}", words(choice));
            }
        }
        list
    }

    /// Adds the names among which a value chooses.
    fn names(&self, schema: &Value, names: &mut Vec<String>) {
        let schema = self.resolve(schema);
        let words = schema.get("const").into_iter().chain(array(schema, "enum")).filter_map(Value::as_str);
        names.extend(words.map(str::to_owned));
        let keys = schema.get("properties").and_then(Value::as_object);
        names.extend(keys.into_iter().flatten().map(|(key, _)| key.clone()));
        for choice in array(schema, "oneOf").iter().chain(array(schema, "anyOf")) {
            self.names(choice, names);
        }
    }

    fn resolve<'s>(&self, schema: &'s Value) -> &'s Value
    where
        'r: 's,
    {
        let name = schema.get("$ref").and_then(Value::as_str).and_then(|name| name.strip_prefix("#/$defs/"));
        let definitions = self.root.get("$defs").and_then(Value::as_object);
        name.zip(definitions)
            .and_then(|(name, all): (&str, &Map<String, Value>)| all.get(&name.replace("%20", " ")))
            .unwrap_or(schema)
    }
}

fn words(schema: &Value) -> String {
    let text = schema.get("description").and_then(Value::as_str).unwrap_or_default();
    text.replace('\n', " ").replace('|', "\\|")
}

fn array<'v>(schema: &'v Value, key: &str) -> &'v [Value] {
    schema.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::{TEXT, reference};
    use crate::scene::document::Document;

    /// The schema of the types: without `null`, which TOML has not, and without formats of numbers, which say nothing.
    fn generated() -> String {
        let mut schema = schemars::generate::SchemaSettings::draft2020_12()
            .into_generator()
            .into_root_schema_for::<Document>()
            .to_value();
        tidy(&mut schema);
        let required = schema["required"].as_array_mut().unwrap();
        // Optional in the types, so that their absence gets a message of its own.
        required.extend([json!("body"), json!("time")]);
        serde_json::to_string_pretty(&schema).unwrap() + "\n"
    }

    fn tidy(schema: &mut Value) {
        if let Some(object) = schema.as_object_mut() {
            if object.get("format").is_some_and(Value::is_string) {
                object.remove("format");
            }
            if let Some(Value::Array(types)) = object.get_mut("type") {
                types.retain(|name| name != "null");
                if let [only] = types.as_slice() {
                    let only = only.clone();
                    object.insert("type".to_owned(), only);
                }
            }
            if let Some(Value::Array(choices)) = object.get_mut("anyOf") {
                choices.retain(|choice| *choice != json!({ "type": "null" }));
                if let [Value::Object(only)] = choices.as_slice() {
                    let only = only.clone();
                    object.remove("anyOf");
                    for (key, value) in only {
                        object.entry(key).or_insert(value);
                    }
                }
            }
            object.values_mut().for_each(tidy);
        } else if let Some(list) = schema.as_array_mut() {
            list.iter_mut().for_each(tidy);
        }
    }

    #[test]
    fn the_stored_schema_is_that_of_the_types() {
        let generated = generated();
        if std::env::var_os("NICOLSON_WRITE_SCHEMA").is_some() {
            let path = concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/schema.json");
            std::fs::write(path, &generated).unwrap();
            return;
        }
        assert!(
            generated == TEXT,
            "the keys of the scene have changed: NICOLSON_WRITE_SCHEMA=1 cargo test --lib stored_schema"
        );
    }

    /// Every key and every choice of the schema is on the page, every table has one section.
    #[test]
    fn the_page_shows_every_key() {
        fn keys(schema: &Value, found: &mut Vec<String>) {
            if let Some(object) = schema.as_object() {
                found.extend(
                    object
                        .get("properties")
                        .and_then(Value::as_object)
                        .into_iter()
                        .flatten()
                        .map(|(key, _)| key.clone()),
                );
                found.extend(object.get("const").and_then(Value::as_str).map(str::to_owned));
                object.values().for_each(|value| keys(value, found));
            } else if let Some(list) = schema.as_array() {
                list.iter().for_each(|value| keys(value, found));
            }
        }
        let page = reference();
        let mut found = Vec::new();
        keys(&serde_json::from_str(TEXT).unwrap(), &mut found);
        assert!(found.len() > 150, "{}", found.len());
        for key in found {
            assert!(page.contains(&format!("`{key}`")) || page.contains(&format!("`\"{key}\"`")), "{key}");
        }
        let headings: Vec<&str> = page.lines().filter(|line| line.starts_with("## ")).collect();
        let mut once = headings.clone();
        once.sort_unstable();
        once.dedup();
        assert_eq!(once.len(), headings.len());
        assert!(page.contains("| `spacing` | length, m |  | Distance of particles"), "{page}");
        assert!(page.contains("| `max_iterations` | whole number | `25` |"), "{page}");
    }
}

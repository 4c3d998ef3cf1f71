//! What makes two scenes different, key by key.

use std::collections::{BTreeMap, BTreeSet};

use toml::{Table, Value};

/// Keys whose values differ, as `key: old → new`, in the order of the keys; those that are `free` do not count. Layout,
/// comments and the order of keys make no difference.
pub fn differences(old: &str, new: &str, free: impl Fn(&str) -> bool) -> Vec<String> {
    let (Ok(old), Ok(new)) = (old.parse::<Table>(), new.parse::<Table>()) else {
        return if old == new { Vec::new() } else { vec!["one of the scenes is not TOML".to_owned()] };
    };
    let (mut before, mut after) = (BTreeMap::new(), BTreeMap::new());
    old.iter().for_each(|(key, value)| flatten(key.clone(), value, &mut before));
    new.iter().for_each(|(key, value)| flatten(key.clone(), value, &mut after));
    let keys: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    let shown = |value: Option<&String>| value.cloned().unwrap_or_else(|| "(not set)".to_owned());
    keys.into_iter()
        .filter(|key| before.get(*key) != after.get(*key) && !free(key))
        .map(|key| format!("{key}: {} → {}", shown(before.get(key)), shown(after.get(key))))
        .collect()
}

/// The values below a key, by their paths.
fn flatten(path: String, value: &Value, out: &mut BTreeMap<String, String>) {
    match value {
        Value::Table(table) if !table.is_empty() => {
            table.iter().for_each(|(key, value)| flatten(format!("{path}.{key}"), value, out));
        }
        Value::Array(list) if list.iter().any(Value::is_table) => {
            list.iter().enumerate().for_each(|(index, value)| flatten(format!("{path}.{index}"), value, out));
        }
        // As text, so that 1 and 1.0 are the same number.
        Value::Integer(number) => drop(out.insert(path, number.to_string())),
        Value::Float(number) => drop(out.insert(path, number.to_string())),
        value => drop(out.insert(path, value.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_values_count() {
        let old = "# a scene\ndimension = 2\ntime = { step = 1.0, end = 3 }\n[[body]]\nspacing = 0.1\n";
        let new = "[time]\nend = 4.0\nstep = 1\n[[body]]\nspacing = 0.2\nname = \"b\"\n";
        assert!(differences(old, old, |_| false).is_empty());
        let found = differences(old, new, |key| key == "time.end");
        assert_eq!(found, ["body.0.name: (not set) → \"b\"", "body.0.spacing: 0.1 → 0.2", "dimension: 2 → (not set)"]);
        assert!(differences(old, new, |_| false).contains(&"time.end: 3 → 4".to_owned()));
    }
}

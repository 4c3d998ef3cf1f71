//! Numbers of a report by their path: `errors.displacement.l2`, `probes.tip.displacement.1`.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::output::Report;
use crate::setup::Setup;

/// What a path leads to; none if there is no such number. Names in a report may have dots themselves.
pub(super) fn find(report: &Value, path: &str) -> Option<f64> {
    if let Some(number) = report.as_f64() {
        return path.is_empty().then_some(number);
    }
    match report {
        Value::Object(entries) => entries.iter().find_map(|(name, entry)| {
            let rest = path.strip_prefix(name.as_str())?;
            find(entry, if rest.is_empty() { rest } else { rest.strip_prefix('.')? })
        }),
        Value::Array(list) => {
            let (index, rest) = path.split_once('.').unwrap_or((path, ""));
            find(list.get(index.parse::<usize>().ok()?)?, rest)
        }
        _ => None,
    }
}

/// Paths of the numbers that the report of such a problem will have.
pub(super) fn known<const D: usize>(setup: &Setup<D>) -> Vec<String> {
    let mut names = Vec::new();
    if let Some(exact) = &setup.exact {
        let fields = [
            ("displacement", exact.displacement.is_some()),
            ("velocity", exact.velocity.is_some()),
            ("pressure", exact.pressure.is_some()),
        ];
        for (field, _) in fields.iter().filter(|(_, is_known)| *is_known) {
            names.extend(["l1", "l2", "linf"].map(|norm| format!("errors.{field}.{norm}")));
        }
    }
    for probe in &setup.probes {
        for field in ["displacement", "velocity", "position"] {
            names.extend((0..D).map(|axis| format!("probes.{}.{field}.{axis}", probe.name)));
        }
    }
    if let Ok(report) = serde_json::to_value(Report::default()) {
        let mut found = BTreeSet::new();
        numbers(&report, String::new(), &mut found);
        names.extend(found);
    }
    names
}

/// Paths of all numbers, and of what may become one.
fn numbers(value: &Value, place: String, found: &mut BTreeSet<String>) {
    match value {
        Value::Null if place == "message" => {}
        Value::Number(_) | Value::Null => {
            found.insert(place);
        }
        Value::Object(entries) => {
            for (key, entry) in entries {
                numbers(entry, if place.is_empty() { key.clone() } else { format!("{place}.{key}") }, found);
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::find;

    #[test]
    fn paths_lead_through_objects_lists_and_names_with_dots() {
        let report = json!({ "a": { "b": [1.5, { "c": 2 }] }, "probes": { "t": {}, "t.1": { "u": [3.0] } }, "s": "x" });
        for (path, value) in [("a.b.0", 1.5), ("a.b.1.c", 2.0), ("probes.t.1.u.0", 3.0)] {
            assert_eq!(find(&report, path), Some(value), "{path}");
        }
        for path in ["", "a", "a.b", "a.b.2", "a.b.0.c", "ab", "s", "probes.t.1.u", "a.", "a.b.-1"] {
            assert_eq!(find(&report, path), None, "{path}");
        }
    }
}

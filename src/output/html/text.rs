//! Text, numbers and tables as HTML.

use serde_json::Value;

use super::super::text::readable;

/// Text that cannot be taken for markup.
pub(super) fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\n' | '\t' => safe.push(character),
            other if other.is_control() => safe.push('\u{fffd}'),
            other => safe.push(other),
        }
    }
    safe
}

/// JSON that may stand inside a script element.
pub(super) fn embedded(value: &Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

/// A section with a heading; nothing if it would be empty.
pub(super) fn section(heading: &str, content: &str) -> String {
    if content.is_empty() { String::new() } else { format!("<section>\n<h2>{heading}</h2>\n{content}</section>\n") }
}

/// A table of names and values; nothing without rows.
pub(super) fn table(rows: &[(String, String)]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let row =
        |(name, value): &(String, String)| format!("<tr><th>{}</th><td>{}</td></tr>\n", escaped(name), escaped(value));
    format!("<table>\n{}</table>\n", rows.iter().map(row).collect::<String>())
}

/// A key as words: `rate_evaluations` is `rate evaluations`.
pub(super) fn words(key: &str) -> String {
    key.replace('_', " ")
}

/// A value of the report for people; `None` for what is not there, lists and groups.
pub(super) fn shown(value: &Value) -> Option<String> {
    match value {
        Value::Number(number) => Some(match (number.as_u64(), number.as_f64()) {
            (Some(count), _) => count.to_string(),
            (None, Some(number)) => readable(number, 6),
            (None, None) => number.to_string(),
        }),
        Value::String(text) if !text.is_empty() => Some(text.clone()),
        Value::Bool(answer) => Some(if *answer { "yes" } else { "no" }.to_owned()),
        _ => None,
    }
}

/// The plain entries of a group as rows.
pub(super) fn rows(group: &Value) -> Vec<(String, String)> {
    let entries = group.as_object().into_iter().flatten();
    entries.filter_map(|(key, value)| Some((words(key), shown(value)?))).collect()
}

/// An SVG document as part of the page.
pub(super) fn figure(svg: &str, caption: &str) -> String {
    // Inside a page the names of the namespaces are known.
    let svg = svg.replace(" xmlns=\"http://www.w3.org/2000/svg\"", "");
    format!("<figure role=\"img\" aria-label=\"{}\">{svg}</figure>\n", escaped(caption))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_breaks_out_of_its_place() {
        assert_eq!(escaped("a<b & \"c\"\u{7}"), "a&lt;b &amp; &quot;c&quot;\u{fffd}");
        assert!(!embedded(&serde_json::json!({"title": "</script><b>"})).contains('<'));
        assert_eq!(
            rows(&serde_json::json!({"a_b": 3, "c": null, "d": [1], "e": 0.25}))[..2],
            [("a b".to_owned(), "3".to_owned()), ("e".to_owned(), "0.25".to_owned())]
        );
    }
}

//! Where bytes of a scene come from.
//!
//! The text of the file and those of the overrides are laid end to end in one imaginary text, so that one
//! range of bytes says both which of them is meant and where in it. `toml`'s spans are such ranges.

use std::ops::Range;

use super::errors::SceneError;

/// The imaginary text.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    name: String,
    text: String,
    /// `key=value`, with the place of its first byte.
    overrides: Vec<(usize, String)>,
}

impl Source {
    pub fn new(name: &str, text: &str, overrides: &[(String, String)]) -> Self {
        // One byte between the parts: the end of one is not the beginning of the next.
        let mut start = text.len() + 1;
        let overrides = overrides
            .iter()
            .map(|(key, value)| {
                let assignment = format!("{key}={value}");
                let place = start;
                start += assignment.len() + 1;
                (place, assignment)
            })
            .collect();
        Self { name: name.to_owned(), text: text.to_owned(), overrides }
    }

    /// Name of the file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Place of the first byte of an override.
    pub fn start_of_override(&self, index: usize) -> usize {
        self.overrides[index].0
    }

    /// The bytes themselves, where they are those of one part.
    pub fn slice(&self, span: &Range<usize>) -> Option<&str> {
        let (start, text) = self.part(span.start);
        text.get(span.start - start..span.end.checked_sub(start)?)
    }

    /// A mistake at a place.
    pub fn error(&self, span: &Range<usize>, message: String, remedy: String) -> SceneError {
        let (start, text) = self.part(span.start);
        let is_file = start == 0;
        let (line, column, length, source) = place(text, span.start - start, span.end.saturating_sub(start));
        SceneError {
            origin: if is_file { self.name.clone() } else { format!("--set {}", shortened(&printable(text), 100)) },
            line: is_file.then_some(line),
            column: Some(column),
            source_line: Some(source),
            length,
            message: shortened(&message, 1000),
            remedy,
        }
    }

    fn part(&self, position: usize) -> (usize, &str) {
        let found = self.overrides.iter().rev().find(|(start, _)| position >= *start);
        found.map_or((0, self.text.as_str()), |(start, text)| (*start, text.as_str()))
    }
}

/// The beginning of a long text.
fn shortened(text: &str, longest: usize) -> String {
    match text.char_indices().nth(longest) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

/// Line and column (characters, from 1), number of characters up to the end of the line, and the line.
pub(super) fn place(text: &str, start: usize, end: usize) -> (usize, usize, usize, String) {
    let bytes = text.as_bytes();
    let start = start.min(bytes.len());
    // A place at the very end of a text is on its last line that has something on it.
    let from = bytes[..start].iter().rposition(|byte| *byte == b'\n').map_or(0, |newline| newline + 1);
    let to = bytes[from..].iter().position(|byte| *byte == b'\n').map_or(bytes.len(), |newline| from + newline);
    let line = 1 + bytes[..from].iter().filter(|byte| **byte == b'\n').count();
    let count = |bytes: &[u8]| String::from_utf8_lossy(bytes).chars().count();
    let column = 1 + count(&bytes[from..start]);
    let length = count(&bytes[start..end.clamp(start, to.max(start))]).max(1);
    (line, column, length, printable(&String::from_utf8_lossy(&bytes[from..to])))
}

/// A text that can be shown on a terminal: one blank for every control character.
fn printable(text: &str) -> String {
    text.trim_end_matches('\r').chars().map(|letter| if letter.is_control() { ' ' } else { letter }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_found_in_file_and_overrides() {
        let source = Source::new("a.toml", "one\ntwö = 3\n", &[("x.y".into(), "5".into()), ("z".into(), "6".into())]);
        let error = source.error(&(9..11), "m".into(), "r".into());
        assert_eq!((error.location().as_str(), error.length), ("a.toml:2:5", 2));
        assert_eq!(error.source_line.as_deref(), Some("twö = 3"));
        let second = source.start_of_override(1);
        let error = source.error(&(second + 2..second + 3), "m".into(), "r".into());
        assert_eq!((error.origin.as_str(), error.line, error.column), ("--set z=6", None, Some(3)));
        assert_eq!(source.slice(&(second..second + 3)), Some("z=6"));
        assert_eq!(source.error(&(500..600), "m".into(), "r".into()).origin, "--set z=6");
    }
}

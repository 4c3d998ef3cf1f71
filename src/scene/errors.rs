//! What is wrong with a scene: every mistake with its place and a remedy.

use std::fmt;

/// One mistake in a scene, or in a file that it names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneError {
    /// File, or the override `--set key=value`.
    pub origin: String,
    /// Line in the file, from 1; none for overrides and for files that cannot be read.
    pub line: Option<usize>,
    /// Character in the line, from 1.
    pub column: Option<usize>,
    /// The line, made printable.
    pub source_line: Option<String>,
    /// Number of characters concerned.
    pub length: usize,
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub remedy: String,
}

impl SceneError {
    /// A mistake without a place inside a text.
    pub(crate) fn of_file(origin: impl Into<String>, message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            origin: origin.into(),
            line: None,
            column: None,
            source_line: None,
            length: 0,
            message: message.into(),
            remedy: remedy.into(),
        }
    }

    /// `scene.toml:12:9`, as far as it is known.
    pub fn location(&self) -> String {
        match (self.line, self.column) {
            (Some(line), Some(column)) => format!("{}:{line}:{column}", self.origin),
            (Some(line), None) => format!("{}:{line}", self.origin),
            _ => self.origin.clone(),
        }
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(formatter, "{}: {}", self.location(), self.message)?;
        if let (Some(source), Some(column)) = (&self.source_line, self.column) {
            let number = self.line.map(|line| line.to_string()).unwrap_or_default();
            let margin = " ".repeat(number.len());
            let (source, before, length) = window(source, column, self.length);
            writeln!(formatter, " {margin} |")?;
            writeln!(formatter, " {number} | {source}")?;
            writeln!(formatter, " {margin} | {}{}", " ".repeat(before), "^".repeat(length))?;
        }
        write!(formatter, "help: {}", self.remedy)
    }
}

/// The part of a long line around the caret, the blanks before the caret and its length.
fn window(source: &str, column: usize, length: usize) -> (String, usize, usize) {
    const WIDEST: usize = 120;
    let letters: Vec<char> = source.chars().collect();
    let start = if letters.len() > WIDEST { (column - 1).saturating_sub(WIDEST / 2) } else { 0 };
    let end = letters.len().min(start + WIDEST);
    let shown = letters.get(start..end).unwrap_or_default().iter().collect();
    let before = column - 1 - start;
    (shown, before, length.min((end - start).saturating_sub(before)).max(1))
}

/// All mistakes of a scene.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SceneErrors {
    errors: Vec<SceneError>,
}

impl SceneErrors {
    pub(crate) fn new(errors: Vec<SceneError>) -> Self {
        Self { errors }
    }

    /// The mistakes, in the order of the text.
    pub fn iter(&self) -> std::slice::Iter<'_, SceneError> {
        self.errors.iter()
    }

    /// Number of mistakes.
    pub fn len(&self) -> usize {
        self.errors.len()
    }

    /// Whether there is none (never so for a list that was returned as an error).
    pub fn is_empty(&self) -> bool {
        self.errors.is_empty()
    }
}

impl<'a> IntoIterator for &'a SceneErrors {
    type Item = &'a SceneError;
    type IntoIter = std::slice::Iter<'a, SceneError>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl fmt::Display for SceneErrors {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, error) in self.errors.iter().enumerate() {
            if index > 0 {
                formatter.write_str("\n\n")?;
            }
            error.fmt(formatter)?;
        }
        Ok(())
    }
}

impl std::error::Error for SceneErrors {}

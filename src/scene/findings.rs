//! The mistakes and warnings found so far: checks go on after a mistake, so that all are shown together.

use std::ops::Range;

use super::errors::{SceneError, SceneErrors};
use super::source::Source;
use super::units::UnitSystem;

/// Bytes of the imaginary text of a [`Source`].
pub(crate) type Span = Range<usize>;

/// Collected mistakes and warnings.
#[derive(Debug)]
pub(crate) struct Findings<'a> {
    pub source: &'a Source,
    /// Units of expressions and of the numbers in files.
    pub(in crate::scene) units: UnitSystem,
    errors: Vec<(Span, SceneError)>,
    warnings: Vec<String>,
}

impl<'a> Findings<'a> {
    pub fn new(source: &'a Source) -> Self {
        Self { source, units: UnitSystem::default(), errors: Vec::new(), warnings: Vec::new() }
    }

    /// Notes a mistake.
    pub fn error(&mut self, span: Span, message: impl Into<String>, remedy: impl Into<String>) {
        let error = self.source.error(&span, message.into(), remedy.into());
        self.errors.push((span, error));
    }

    /// Notes a mistake in another file; `span` is where the scene names that file.
    pub fn elsewhere(&mut self, span: Span, error: SceneError) {
        self.errors.push((span, error));
    }

    /// Notes something that may not be meant.
    pub fn warning(&mut self, span: Span, message: impl Into<String>) {
        let place = self.source.error(&span, String::new(), String::new()).location();
        self.warnings.push(format!("{place}: {}", message.into()));
    }

    /// Number of mistakes so far.
    pub fn count(&self) -> usize {
        self.errors.len()
    }

    /// The mistakes in the order of the text, or the warnings if there is none.
    pub fn finish(mut self) -> Result<Vec<String>, SceneErrors> {
        if self.errors.is_empty() {
            return Ok(self.warnings);
        }
        self.errors.sort_by_key(|(span, _)| span.start);
        let mut errors: Vec<SceneError> = self.errors.into_iter().map(|(_, error)| error).collect();
        errors.dedup();
        Err(SceneErrors::new(errors))
    }
}

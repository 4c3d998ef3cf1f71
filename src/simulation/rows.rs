//! Tables kept in memory, for programs that go on from a run without reading its files.

/// A table: titles, and rows of numbers one after the other.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rows {
    /// Titles of the columns.
    pub titles: Vec<String>,
    /// Values, row after row.
    pub values: Vec<f64>,
}

impl Rows {
    /// An empty table.
    pub(super) fn new<'a>(titles: impl IntoIterator<Item = &'a str>) -> Self {
        Self { titles: titles.into_iter().map(str::to_owned).collect(), values: Vec::new() }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.values.len().checked_div(self.titles.len()).unwrap_or(0)
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// One column.
    pub fn column(&self, index: usize) -> impl Iterator<Item = f64> {
        self.values.iter().skip(index).step_by(self.titles.len().max(1)).copied()
    }
}

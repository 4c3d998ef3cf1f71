//! What outlives a step, as plain named arrays: the seam between solvers and checkpoints.
//!
//! A solver writes what it remembers into a [`Snapshot`] and takes it back from one, to the last bit; how a snapshot is
//! stored is nobody's business here. Factors are not written: they are made again from the operators they were made of.
//! Names are paths (`"newton/tangent/steps"`), so that the parts of a solver nest.

use std::collections::BTreeMap;

use crate::EvaluationError;
use crate::linear::LinearError;

/// One array.
#[derive(Debug, Clone, PartialEq)]
pub enum Array {
    /// Numbers.
    Reals(Vec<f64>),
    /// Counts, marks and flags.
    Integers(Vec<u64>),
    /// Words.
    Text(String),
}

/// Named arrays, in the order of their names.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Snapshot {
    entries: BTreeMap<String, Array>,
}

/// Why a snapshot cannot be taken back.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RestoreError {
    /// An array is not there.
    #[error("`{name}` is missing")]
    Missing {
        /// Its name.
        name: String,
    },
    /// An array is not what it should be.
    #[error("`{name}` is not {expected}")]
    Unfit {
        /// Its name.
        name: String,
        /// What it should be.
        expected: String,
    },
    /// The equations cannot be linearised where they were.
    #[error("the tangent cannot be taken again: {0}")]
    Evaluation(#[from] EvaluationError),
    /// The linear solver cannot be prepared as it was.
    #[error("the linear solver cannot be prepared again: {0}")]
    Linear(#[from] LinearError),
}

impl Snapshot {
    /// Nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// All arrays with their names, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Array)> {
        self.entries.iter().map(|(name, array)| (name.as_str(), array))
    }

    /// Adds an array.
    pub fn insert(&mut self, name: impl Into<String>, array: Array) {
        self.entries.insert(name.into(), array);
    }

    /// Adds numbers.
    pub fn put_reals(&mut self, name: &str, values: impl Into<Vec<f64>>) {
        self.insert(name, Array::Reals(values.into()));
    }

    /// Adds a number.
    pub fn put_real(&mut self, name: &str, value: f64) {
        self.put_reals(name, vec![value]);
    }

    /// Adds integers.
    pub fn put_integers(&mut self, name: &str, values: impl Into<Vec<u64>>) {
        self.insert(name, Array::Integers(values.into()));
    }

    /// Adds counts.
    pub fn put_counts(&mut self, name: &str, values: &[usize]) {
        self.put_integers(name, values.iter().map(|value| *value as u64).collect::<Vec<_>>());
    }

    /// Adds a yes or no.
    pub fn put_flag(&mut self, name: &str, value: bool) {
        self.put_integers(name, vec![u64::from(value)]);
    }

    /// Adds words.
    pub fn put_text(&mut self, name: &str, value: impl Into<String>) {
        self.insert(name, Array::Text(value.into()));
    }

    /// Adds another snapshot below a name.
    pub fn put_part(&mut self, name: &str, part: Self) {
        for (below, array) in part.entries {
            self.entries.insert(format!("{name}/{below}"), array);
        }
    }

    /// The snapshot below a name; empty if there is none.
    pub fn part(&self, name: &str) -> Self {
        let prefix = format!("{name}/");
        let below = self.entries.range(prefix.clone()..).take_while(|(key, _)| key.starts_with(&prefix));
        Self { entries: below.map(|(key, array)| (key[prefix.len()..].to_owned(), array.clone())).collect() }
    }

    /// Whether there is an array of this name.
    pub fn has(&self, name: &str) -> bool {
        self.entries.contains_key(name)
    }

    fn get(&self, name: &str) -> Result<&Array, RestoreError> {
        self.entries.get(name).ok_or_else(|| RestoreError::Missing { name: name.to_owned() })
    }

    /// Numbers.
    ///
    /// # Errors
    /// [`RestoreError`] if there are none of that name; so in all that follow.
    pub fn reals(&self, name: &str) -> Result<&[f64], RestoreError> {
        match self.get(name)? {
            Array::Reals(values) => Ok(values),
            _ => Err(unfit(name, "a list of numbers")),
        }
    }

    /// As many numbers as wanted.
    ///
    /// # Errors
    /// As [`reals`](Self::reals).
    pub fn some_reals<const N: usize>(&self, name: &str) -> Result<[f64; N], RestoreError> {
        self.reals(name)?.try_into().map_err(|_| unfit(name, &format!("a list of {N} numbers")))
    }

    /// Numbers, of which there must be so many.
    ///
    /// # Errors
    /// As [`reals`](Self::reals).
    pub fn reals_of(&self, name: &str, length: usize) -> Result<&[f64], RestoreError> {
        Some(self.reals(name)?)
            .filter(|values| values.len() == length)
            .ok_or_else(|| unfit(name, &format!("a list of {length} numbers")))
    }

    /// A number.
    ///
    /// # Errors
    /// As [`reals`](Self::reals).
    pub fn real(&self, name: &str) -> Result<f64, RestoreError> {
        self.some_reals::<1>(name).map(|[value]| value)
    }

    /// Integers.
    ///
    /// # Errors
    /// As [`reals`](Self::reals).
    pub fn integers(&self, name: &str) -> Result<&[u64], RestoreError> {
        match self.get(name)? {
            Array::Integers(values) => Ok(values),
            _ => Err(unfit(name, "a list of integers")),
        }
    }

    /// As many counts as wanted.
    ///
    /// # Errors
    /// As [`reals`](Self::reals).
    pub fn counts<const N: usize>(&self, name: &str) -> Result<[usize; N], RestoreError> {
        let values = self.integers(name)?;
        let counts: Option<Vec<usize>> = values.iter().map(|value| usize::try_from(*value).ok()).collect();
        let counts = counts.and_then(|counts| <[usize; N]>::try_from(counts).ok());
        counts.ok_or_else(|| unfit(name, &format!("a list of {N} counts")))
    }

    /// A count.
    ///
    /// # Errors
    /// As [`reals`](Self::reals).
    pub fn count(&self, name: &str) -> Result<usize, RestoreError> {
        self.counts::<1>(name).map(|[value]| value)
    }

    /// A yes or no.
    ///
    /// # Errors
    /// As [`reals`](Self::reals).
    pub fn flag(&self, name: &str) -> Result<bool, RestoreError> {
        match self.integers(name)? {
            [0] => Ok(false),
            [1] => Ok(true),
            _ => Err(unfit(name, "0 or 1")),
        }
    }

    /// Words.
    ///
    /// # Errors
    /// As [`reals`](Self::reals).
    pub fn text(&self, name: &str) -> Result<&str, RestoreError> {
        match self.get(name)? {
            Array::Text(text) => Ok(text),
            _ => Err(unfit(name, "a text")),
        }
    }
}

/// An array that is not what it should be.
pub fn unfit(name: &str, expected: &str) -> RestoreError {
    RestoreError::Unfit { name: name.to_owned(), expected: expected.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_in_comes_out_and_nothing_else() {
        let mut inner = Snapshot::new();
        inner.put_real("x", -0.0);
        inner.put_counts("n", &[1, 2, 3]);
        let mut outer = Snapshot::new();
        outer.put_part("a/b", inner.clone());
        outer.put_flag("a/by", true);
        outer.put_text("why", "because");
        assert_eq!(outer.part("a/b"), inner);
        assert_eq!(outer.part("a/b").real("x").map(f64::to_bits), Ok((-0.0_f64).to_bits()));
        assert_eq!(outer.part("a").count("by"), Ok(1));
        assert_eq!(outer.part("a").counts::<3>("b/n"), Ok([1, 2, 3]));
        assert_eq!(outer.text("why"), Ok("because"));
        let missing = outer.real("absent").map_err(|error| error.to_string());
        assert_eq!(missing, Err("`absent` is missing".to_owned()));
        for wrong in [outer.real("why"), outer.real("a/b/n"), outer.part("a/b").reals_of("x", 2).map(|x| x[0])] {
            assert!(matches!(wrong, Err(RestoreError::Unfit { .. })), "{wrong:?}");
        }
        assert!(outer.part("a/b").flag("n").is_err() && outer.part("none").is_empty());
    }
}

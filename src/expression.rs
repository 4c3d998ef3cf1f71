//! Scalar fields of `X, Y, Z, t`, written as text in scenes.

/// A scalar field of reference position and time, parsed from text.
#[derive(Debug, Clone)]
pub struct Expression {}

impl Expression {
    /// The value at a reference position and time. May be NaN or infinite.
    pub fn value(&self, position: [f64; 3], t: f64) -> f64 {
        let _ = (position, t);
        0.0
    }

    /// The partial derivative with respect to time.
    pub fn rate(&self, position: [f64; 3], t: f64) -> f64 {
        let _ = (position, t);
        0.0
    }

    /// Whether the text mentions `t`.
    pub fn depends_on_time(&self) -> bool {
        false
    }
}

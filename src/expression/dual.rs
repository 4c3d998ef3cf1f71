//! Dual numbers `value + rate ε`, ε² = 0: a value and its derivative in time, carried together.

use std::num::ParseFloatError;
use std::str::FromStr;

/// A value and its derivative in time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Dual {
    pub value: f64,
    pub rate: f64,
}

/// What exmex computes with: a dual number and, between the two halves of `if(c, a, b)`, the one that
/// waits for the choice (exmex has operators of one and two arguments only).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Quantity {
    pub chosen: Dual,
    pub other: Dual,
}

impl From<Dual> for Quantity {
    fn from(chosen: Dual) -> Self {
        Self { chosen, other: Dual::default() }
    }
}

impl FromStr for Quantity {
    type Err = ParseFloatError;

    fn from_str(text: &str) -> Result<Self, ParseFloatError> {
        Ok(Self::from(Dual { value: text.parse()?, rate: 0.0 }))
    }
}

impl Dual {
    /// `f(self)` by the chain rule. A constant argument stays constant, even where the slope is
    /// infinite (`sqrt(0)`).
    fn chain(self, value: f64, slope: f64) -> Self {
        Self { value, rate: if self.rate == 0.0 { 0.0 } else { slope * self.rate } }
    }

    /// A number without a rate: results of jumps, comparisons and logic.
    fn flat(value: f64) -> Self {
        Self { value, rate: 0.0 }
    }

    fn truth(holds: bool) -> Self {
        Self::flat(f64::from(u8::from(holds)))
    }
}

/// One argument.
pub(super) mod unary {
    use super::Dual;

    pub fn negative(a: Dual) -> Dual {
        Dual { value: -a.value, rate: -a.rate }
    }
    pub fn not(a: Dual) -> Dual {
        Dual::truth(a.value == 0.0)
    }
    pub fn sin(a: Dual) -> Dual {
        a.chain(a.value.sin(), a.value.cos())
    }
    pub fn cos(a: Dual) -> Dual {
        a.chain(a.value.cos(), -a.value.sin())
    }
    pub fn tan(a: Dual) -> Dual {
        let value = a.value.tan();
        a.chain(value, 1.0 + value * value)
    }
    pub fn asin(a: Dual) -> Dual {
        a.chain(a.value.asin(), 1.0 / (1.0 - a.value * a.value).sqrt())
    }
    pub fn acos(a: Dual) -> Dual {
        a.chain(a.value.acos(), -1.0 / (1.0 - a.value * a.value).sqrt())
    }
    pub fn atan(a: Dual) -> Dual {
        a.chain(a.value.atan(), 1.0 / (1.0 + a.value * a.value))
    }
    pub fn sinh(a: Dual) -> Dual {
        a.chain(a.value.sinh(), a.value.cosh())
    }
    pub fn cosh(a: Dual) -> Dual {
        a.chain(a.value.cosh(), a.value.sinh())
    }
    pub fn tanh(a: Dual) -> Dual {
        let value = a.value.tanh();
        a.chain(value, 1.0 - value * value)
    }
    pub fn exp(a: Dual) -> Dual {
        let value = a.value.exp();
        a.chain(value, value)
    }
    pub fn ln(a: Dual) -> Dual {
        a.chain(a.value.ln(), 1.0 / a.value)
    }
    pub fn log10(a: Dual) -> Dual {
        a.chain(a.value.log10(), 1.0 / (a.value * std::f64::consts::LN_10))
    }
    pub fn sqrt(a: Dual) -> Dual {
        let value = a.value.sqrt();
        a.chain(value, 0.5 / value)
    }
    pub fn abs(a: Dual) -> Dual {
        a.chain(a.value.abs(), signum(a.value))
    }
    pub fn sign(a: Dual) -> Dual {
        Dual::flat(signum(a.value))
    }
    pub fn step(a: Dual) -> Dual {
        if a.value.is_nan() { Dual::flat(f64::NAN) } else { Dual::truth(a.value >= 0.0) }
    }
    pub fn floor(a: Dual) -> Dual {
        Dual::flat(a.value.floor())
    }
    pub fn ceil(a: Dual) -> Dual {
        Dual::flat(a.value.ceil())
    }

    /// −1, 0 or 1: unlike [`f64::signum`], zero at zero.
    fn signum(a: f64) -> f64 {
        if a == 0.0 { 0.0 } else { a.signum() }
    }
}

/// Two arguments.
pub(super) mod binary {
    use super::Dual;

    pub fn plus(a: Dual, b: Dual) -> Dual {
        Dual { value: a.value + b.value, rate: a.rate + b.rate }
    }
    pub fn minus(a: Dual, b: Dual) -> Dual {
        Dual { value: a.value - b.value, rate: a.rate - b.rate }
    }
    pub fn times(a: Dual, b: Dual) -> Dual {
        Dual { value: a.value * b.value, rate: a.rate * b.value + a.value * b.rate }
    }
    pub fn over(a: Dual, b: Dual) -> Dual {
        let value = a.value / b.value;
        Dual { value, rate: (a.rate - value * b.rate) / b.value }
    }
    pub fn power(a: Dual, b: Dual) -> Dual {
        let value = a.value.powf(b.value);
        let by_base =
            if a.rate == 0.0 || b.value == 0.0 { 0.0 } else { b.value * a.value.powf(b.value - 1.0) * a.rate };
        let by_exponent = if b.rate == 0.0 { 0.0 } else { value * a.value.ln() * b.rate };
        Dual { value, rate: by_base + by_exponent }
    }
    pub fn min(a: Dual, b: Dual) -> Dual {
        // Not f64::min: a NaN must not vanish.
        if a.value.is_nan() || a.value <= b.value { a } else { b }
    }
    pub fn max(a: Dual, b: Dual) -> Dual {
        if a.value.is_nan() || a.value >= b.value { a } else { b }
    }
    pub fn atan2(a: Dual, b: Dual) -> Dual {
        let square = a.value * a.value + b.value * b.value;
        let turning = a.rate * b.value - a.value * b.rate;
        Dual { value: a.value.atan2(b.value), rate: if turning == 0.0 { 0.0 } else { turning / square } }
    }
    pub fn less(a: Dual, b: Dual) -> Dual {
        Dual::truth(a.value < b.value)
    }
    pub fn less_or_equal(a: Dual, b: Dual) -> Dual {
        Dual::truth(a.value <= b.value)
    }
    pub fn greater(a: Dual, b: Dual) -> Dual {
        Dual::truth(a.value > b.value)
    }
    pub fn greater_or_equal(a: Dual, b: Dual) -> Dual {
        Dual::truth(a.value >= b.value)
    }
    pub fn equal(a: Dual, b: Dual) -> Dual {
        Dual::truth(a.value == b.value)
    }
    pub fn unequal(a: Dual, b: Dual) -> Dual {
        Dual::truth(a.value != b.value)
    }
    pub fn and(a: Dual, b: Dual) -> Dual {
        Dual::truth(a.value != 0.0 && b.value != 0.0)
    }
    pub fn or(a: Dual, b: Dual) -> Dual {
        Dual::truth(a.value != 0.0 || b.value != 0.0)
    }
}

//! Scalar fields of `X, Y, Z, t`, written as text in scenes.
//!
//! `X Y Z` is the *reference* position (m), `t` the time (s), `pi` the only constant. Operators, from the
//! loosest to the tightest: `||`, `&&`, one comparison (`< <= > >= == !=`), `+ -`, `* /`, the signs `- + !`,
//! and `^` (to the right, and tighter than a sign: `-X^2` is `-(X^2)`). Comparisons and `&& || !` give 1 or 0
//! and take every number other than 0 as true. Functions: see [`FUNCTIONS`]; `if(c, a, b)` chooses, `step(a)`
//! is 1 for `a ≥ 0`, `min` and `max` take two or more arguments.
//!
//! The `grammar` below reads the text, knows where a mistake is and says it in words; the evaluation is
//! [`exmex`]'s, over dual numbers `value + rate ε`, so that [`Expression::rate`] is the exact partial
//! derivative in time of piecewise fields too (at a jump: of the branch that is taken; of a jump itself: 0).
//! exmex gets a fully parenthesised text, because its own rules (`-1^2 = 1`, no nested calls with two
//! arguments, mistakes without a position) are not what a scene should depend on.
//!
//! Not here: units ([`Expression::in_units`] aside), tables, random numbers, anything of the current position `x`.

mod dual;
mod error;
mod grammar;
mod operators;
mod suggestion;
mod tokens;

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use exmex::{Express, FlatEx};

pub use error::ExpressionError;
pub use operators::FUNCTIONS;
pub(crate) use suggestion::closest;

use dual::{Dual, Quantity};
use operators::{Literals, Operators};

/// Longest text of an expression, in bytes; a bound on what a mistaken scene can cost.
pub const LONGEST_TEXT: usize = 4096;

/// Names of the variables, in the order of [`exmex`] (alphabetical) and of [`Variables`].
const VARIABLES: [&str; 4] = ["X", "Y", "Z", "t"];

/// Whether a name is, or might be meant as, one of expressions.
pub(crate) fn is_name(name: &str) -> bool {
    VARIABLES.contains(&name)
        || matches!(name, "pi" | "x" | "y" | "z" | "time")
        || FUNCTIONS.iter().any(|(function, ..)| *function == name)
}

/// Which of `X, Y, Z, t` a text mentions.
type Variables = [bool; 4];

/// A scalar field of reference position and time, parsed from text. Cheap to clone.
#[derive(Clone)]
pub struct Expression {
    parsed: Arc<Parsed>,
}

/// The immutable part of an expression.
struct Parsed {
    text: String,
    variables: Variables,
    program: Program,
    scaling: Option<Scaling>,
}

/// Units other than SI in which a text is meant, as factors to SI.
#[derive(Debug, Clone, Copy)]
struct Scaling {
    length: f64,
    time: f64,
    value: f64,
}

/// How the value is found.
enum Program {
    /// No variable is mentioned: evaluated once.
    Constant(f64),
    /// Evaluated at every call. Boxed: exmex keeps 20 kB of room in the structure itself.
    Compiled(Box<FlatEx<Quantity, Operators, Literals>>),
}

impl Expression {
    /// Reads an expression.
    ///
    /// # Errors
    /// [`ExpressionError`] with the place of the first mistake in the text.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        if text.len() > LONGEST_TEXT {
            return Err(ExpressionError::new(
                LONGEST_TEXT..text.len(),
                format!("the expression is {} bytes long", text.len()),
                format!("shorten it to at most {LONGEST_TEXT} bytes"),
            ));
        }
        let canonical = grammar::read(text)?;
        let compiled = FlatEx::<Quantity, Operators, Literals>::parse(&canonical.text).map_err(|error| {
            ExpressionError::new(0..text.len(), format!("the expression cannot be evaluated ({error})"), "simplify it")
        })?;
        let variables = canonical.variables;
        let program = if variables.contains(&true) {
            Program::Compiled(Box::new(compiled))
        } else {
            Program::Constant(evaluate(&compiled, &variables, [0.0; 3], 0.0).value)
        };
        Ok(Self { parsed: Arc::new(Parsed { text: text.trim().to_owned(), variables, program, scaling: None }) })
    }

    /// The field with the same value everywhere and always.
    pub fn constant(value: f64) -> Self {
        let program = Program::Constant(value);
        let parsed = Parsed { text: format!("{value}"), variables: [false; 4], program, scaling: None };
        Self { parsed: Arc::new(parsed) }
    }

    /// The same text with `X, Y, Z` in other units of length, `t` in other units of time, and the value in other units
    /// than SI: each of those units in SI. Positions and times are still handed over in SI units, as are the values.
    pub fn in_units(self, length: f64, time: f64, value: f64) -> Self {
        if (length, time, value) == (1.0, 1.0, 1.0) {
            return self;
        }
        let Parsed { text, variables, program, .. } = match Arc::try_unwrap(self.parsed) {
            Ok(parsed) => parsed,
            // Others hold it too: read it again, which has been possible before.
            Err(shared) => match Self::parse(&shared.text).map(|again| Arc::into_inner(again.parsed)) {
                Ok(Some(parsed)) => parsed,
                _ => return Self { parsed: shared },
            },
        };
        let (program, scaling) = match program {
            Program::Constant(constant) => (Program::Constant(constant * value), None),
            compiled @ Program::Compiled(_) => (compiled, Some(Scaling { length, time, value })),
        };
        Self { parsed: Arc::new(Parsed { text, variables, program, scaling }) }
    }

    /// The value at a reference position and time. May be NaN or infinite.
    pub fn value(&self, position: [f64; 3], t: f64) -> f64 {
        self.dual(position, t).value
    }

    /// The partial derivative with respect to time.
    pub fn rate(&self, position: [f64; 3], t: f64) -> f64 {
        self.dual(position, t).rate
    }

    /// Whether the text mentions `t`.
    pub fn depends_on_time(&self) -> bool {
        self.parsed.variables[3]
    }

    /// Whether the text mentions the coordinate `X` (axis 0), `Y` (1) or `Z` (2).
    pub fn depends_on_coordinate(&self, axis: usize) -> bool {
        self.parsed.variables[..3].get(axis).copied().unwrap_or(false)
    }

    /// Whether the text mentions a coordinate; if not, one evaluation serves all particles.
    pub fn depends_on_position(&self) -> bool {
        self.parsed.variables[..3].contains(&true)
    }

    /// The value, if the text mentions no variable.
    pub fn as_constant(&self) -> Option<f64> {
        match self.parsed.program {
            Program::Constant(value) => Some(value),
            Program::Compiled(_) => None,
        }
    }

    /// The text it was read from.
    pub fn text(&self) -> &str {
        &self.parsed.text
    }

    fn dual(&self, position: [f64; 3], t: f64) -> Dual {
        match &self.parsed.program {
            Program::Constant(value) => Dual { value: *value, rate: 0.0 },
            Program::Compiled(program) => match self.parsed.scaling {
                None => evaluate(program, &self.parsed.variables, position, t),
                Some(Scaling { length, time, value }) => {
                    let own = position.map(|x| x / length);
                    let found = evaluate(program, &self.parsed.variables, own, t / time);
                    Dual { value: found.value * value, rate: found.rate * value / time }
                }
            },
        }
    }
}

/// Runs a compiled expression; exmex wants exactly the variables that the text mentions.
fn evaluate(
    program: &FlatEx<Quantity, Operators, Literals>,
    variables: &Variables,
    position: [f64; 3],
    t: f64,
) -> Dual {
    let all = [
        Dual { value: position[0], rate: 0.0 },
        Dual { value: position[1], rate: 0.0 },
        Dual { value: position[2], rate: 0.0 },
        Dual { value: t, rate: 1.0 },
    ];
    let mut mentioned = [Quantity::default(); 4];
    let mut count = 0;
    for (value, _) in all.into_iter().zip(variables).filter(|(_, mentioned)| **mentioned) {
        mentioned[count] = Quantity::from(value);
        count += 1;
    }
    // exmex can only fail here on a wrong number of variables, which the line above rules out.
    program.eval(&mentioned[..count]).map_or(Dual { value: f64::NAN, rate: f64::NAN }, |result| result.chosen)
}

impl fmt::Debug for Expression {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Expression({:?})", self.parsed.text)
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.parsed.text)
    }
}

impl FromStr for Expression {
    type Err = ExpressionError;

    fn from_str(text: &str) -> Result<Self, ExpressionError> {
        Self::parse(text)
    }
}

#[cfg(test)]
mod tests;

//! The operators and literals that exmex is taught.

use exmex::{BinOp, MakeOperators, MatchLiteral, Operator};

use super::dual::{Dual, Quantity, binary, unary};

/// Functions of expressions with the least and largest number of arguments.
pub const FUNCTIONS: [(&str, usize, usize); 22] = [
    ("sin", 1, 1),
    ("cos", 1, 1),
    ("tan", 1, 1),
    ("asin", 1, 1),
    ("acos", 1, 1),
    ("atan", 1, 1),
    ("sinh", 1, 1),
    ("cosh", 1, 1),
    ("tanh", 1, 1),
    ("exp", 1, 1),
    ("ln", 1, 1),
    ("log10", 1, 1),
    ("sqrt", 1, 1),
    ("abs", 1, 1),
    ("sign", 1, 1),
    ("step", 1, 1),
    ("floor", 1, 1),
    ("ceil", 1, 1),
    ("min", 2, usize::MAX),
    ("max", 2, usize::MAX),
    ("atan2", 2, 2),
    ("if", 3, 3),
];

/// Wraps a function of one dual number for exmex, whose operators are plain function pointers.
macro_rules! one {
    ($name:literal, $function:path) => {
        Operator::make_unary($name, |a: Quantity| Quantity::from($function(a.chosen)))
    };
}

/// Wraps a function of two dual numbers. All have one priority: the text is fully parenthesised. None is
/// called commutative, which would let exmex regroup sums.
macro_rules! two {
    ($name:literal, $function:path) => {
        infix($name, |a: Quantity, b: Quantity| Quantity::from($function(a.chosen, b.chosen)))
    };
}

fn infix<'a>(name: &'a str, apply: fn(Quantity, Quantity) -> Quantity) -> Operator<'a, Quantity> {
    Operator::make_bin(name, BinOp { apply, prio: 1, is_commutative: false })
}

/// Operators of the canonical text that the grammar writes.
#[derive(Debug, Clone)]
pub(super) struct Operators;

impl MakeOperators<Quantity> for Operators {
    fn make<'a>() -> Vec<Operator<'a, Quantity>> {
        vec![
            one!("neg", unary::negative),
            one!("not", unary::not),
            one!("sin", unary::sin),
            one!("cos", unary::cos),
            one!("tan", unary::tan),
            one!("asin", unary::asin),
            one!("acos", unary::acos),
            one!("atan", unary::atan),
            one!("sinh", unary::sinh),
            one!("cosh", unary::cosh),
            one!("tanh", unary::tanh),
            one!("exp", unary::exp),
            one!("ln", unary::ln),
            one!("log10", unary::log10),
            one!("sqrt", unary::sqrt),
            one!("abs", unary::abs),
            one!("sign", unary::sign),
            one!("step", unary::step),
            one!("floor", unary::floor),
            one!("ceil", unary::ceil),
            two!("+", binary::plus),
            two!("-", binary::minus),
            two!("*", binary::times),
            two!("/", binary::over),
            two!("^", binary::power),
            two!("min", binary::min),
            two!("max", binary::max),
            two!("atan2", binary::atan2),
            two!("<", binary::less),
            two!("<=", binary::less_or_equal),
            two!(">", binary::greater),
            two!(">=", binary::greater_or_equal),
            two!("==", binary::equal),
            two!("!=", binary::unequal),
            two!("&&", binary::and),
            two!("||", binary::or),
            infix("else", |a, b| Quantity { chosen: a.chosen, other: b.chosen }),
            infix("if", choose),
        ]
    }
}

/// `condition if (a else b)`. A condition that is not a number gives no number.
fn choose(condition: Quantity, branches: Quantity) -> Quantity {
    let nothing = Dual { value: f64::NAN, rate: f64::NAN };
    Quantity::from(match condition.chosen.value {
        value if value.is_nan() => nothing,
        0.0 => branches.other,
        _ => branches.chosen,
    })
}

/// Literals as the grammar writes them: digits, point, exponent (exmex's own matcher has no exponents).
#[derive(Debug, Clone)]
pub(super) struct Literals;

impl MatchLiteral for Literals {
    fn is_literal(text: &str) -> Option<&str> {
        let bytes = text.as_bytes();
        if !bytes.first()?.is_ascii_digit() {
            return None;
        }
        let mut length = 0;
        while let Some(byte) = bytes.get(length) {
            let exponent_sign = *byte == b'-' && bytes[length - 1] == b'e';
            if !(byte.is_ascii_digit() || *byte == b'.' || *byte == b'e' || exponent_sign) {
                break;
            }
            length += 1;
        }
        Some(&text[..length])
    }
}

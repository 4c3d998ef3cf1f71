//! Tokens to a canonical text for exmex: every operation in its own parentheses, calls of two and three
//! arguments as infix operators. A recursive descent with bounded depth.

use std::ops::Range;

use super::error::ExpressionError;
use super::operators::FUNCTIONS;
use super::suggestion::closest;
use super::tokens::{self, Located, Token};
use super::{VARIABLES, Variables};

/// Deepest nesting of parentheses, calls and signs: more is a mistake, and must not exhaust the stack.
const DEEPEST: usize = 48;

/// What the grammar hands on.
pub(super) struct Canonical {
    pub text: String,
    pub variables: Variables,
}

/// Reads a text.
pub(super) fn read(text: &str) -> Result<Canonical, ExpressionError> {
    let mut reader = Reader { tokens: tokens::read(text)?, next: 0, depth: 0, variables: [false; 4] };
    if reader.peek().token == Token::End {
        return Err(ExpressionError::new(0..text.len(), "the expression is empty", "write a number such as `0`"));
    }
    let text = reader.any()?;
    let rest = reader.peek().clone();
    match rest.token {
        Token::End => Ok(Canonical { text, variables: reader.variables }),
        _ => Err(reader.unexpected(&rest)),
    }
}

struct Reader<'a> {
    tokens: Vec<Located<'a>>,
    next: usize,
    depth: usize,
    variables: Variables,
}

type Piece = Result<String, ExpressionError>;

impl<'a> Reader<'a> {
    fn peek(&self) -> &Located<'a> {
        // The last token is `End`, and `advance` never passes it.
        &self.tokens[self.next]
    }

    fn advance(&mut self) -> Located<'a> {
        let token = self.peek().clone();
        self.next = (self.next + 1).min(self.tokens.len() - 1);
        token
    }

    /// Takes the next token if it is one of these symbols.
    fn take(&mut self, symbols: &[&'static str]) -> Option<(&'static str, Range<usize>)> {
        match &self.peek().token {
            Token::Symbol(symbol) if symbols.contains(symbol) => {
                let found = (*symbol, self.peek().span.clone());
                self.advance();
                Some(found)
            }
            _ => None,
        }
    }

    fn any(&mut self) -> Piece {
        self.left(&["||"], |reader| reader.left(&["&&"], Self::comparison))
    }

    /// A chain of operators of one rank, grouped from the left.
    fn left(&mut self, symbols: &[&'static str], operand: impl Fn(&mut Self) -> Piece) -> Piece {
        let mut text = operand(self)?;
        while let Some((symbol, _)) = self.take(symbols) {
            text = format!("({text}{symbol}{})", operand(self)?);
        }
        Ok(text)
    }

    fn comparison(&mut self) -> Piece {
        const COMPARISONS: [&str; 6] = ["<=", ">=", "==", "!=", "<", ">"];
        let text = self.sum()?;
        let Some((symbol, _)) = self.take(&COMPARISONS) else { return Ok(text) };
        let text = format!("({text}{symbol}{})", self.sum()?);
        match self.take(&COMPARISONS) {
            None => Ok(text),
            Some((_, span)) => Err(ExpressionError::new(
                span,
                "comparisons cannot be chained",
                "write `0 < X && X < 1` instead of `0 < X < 1`",
            )),
        }
    }

    fn sum(&mut self) -> Piece {
        self.left(&["+", "-"], |reader| reader.left(&["*", "/"], Self::signed))
    }

    fn signed(&mut self) -> Piece {
        let Some((symbol, span)) = self.take(&["-", "+", "!"]) else { return self.power() };
        let operand = self.deeper(span, Self::signed)?;
        Ok(match symbol {
            "-" => format!("(neg({operand}))"),
            "!" => format!("(not({operand}))"),
            _ => operand,
        })
    }

    fn power(&mut self) -> Piece {
        let base = self.primary()?;
        match self.take(&["^"]) {
            // The exponent may have a sign and a power of its own: `2^-X^2`.
            Some((_, span)) => Ok(format!("({base}^{})", self.deeper(span, Self::signed)?)),
            None => Ok(base),
        }
    }

    fn primary(&mut self) -> Piece {
        let found = self.advance();
        match found.token {
            Token::Number(value) => Ok(format!("{value:?}")),
            Token::Name(name) if self.peek().token == Token::Symbol("(") => self.call(name, found.span),
            Token::Name(name) => self.name(name, found.span),
            Token::Symbol("(") => {
                let inside = self.deeper(found.span.clone(), Self::any)?;
                self.close(found.span)?;
                Ok(inside)
            }
            _ => Err(self.unexpected(&found)),
        }
    }

    fn name(&mut self, name: &str, span: Range<usize>) -> Piece {
        if let Some(variable) = VARIABLES.iter().position(|variable| *variable == name) {
            self.variables[variable] = true;
            return Ok(name.to_owned());
        }
        if name == "pi" {
            return Ok(format!("{:?}", std::f64::consts::PI));
        }
        Err(unknown_name(name, span))
    }

    fn call(&mut self, name: &str, span: Range<usize>) -> Piece {
        let Some((_, least, most)) = FUNCTIONS.iter().find(|(function, ..)| *function == name) else {
            return Err(unknown_function(name, span));
        };
        let open = self.advance().span;
        let mut arguments = Vec::new();
        if self.peek().token != Token::Symbol(")") {
            arguments.push(self.deeper(open.clone(), Self::any)?);
            while self.take(&[","]).is_some() {
                arguments.push(self.deeper(open.clone(), Self::any)?);
            }
        }
        self.close(open)?;
        if arguments.len() < *least || arguments.len() > *most {
            let wanted = match (*least, *most) {
                (1, 1) => "1 argument".to_owned(),
                (least, most) if least == most => format!("{least} arguments"),
                (least, _) => format!("{least} or more arguments"),
            };
            return Err(ExpressionError::new(
                span,
                format!("`{name}` takes {wanted}, not {}", arguments.len()),
                example(name),
            ));
        }
        let mut arguments = arguments.into_iter();
        let first = arguments.next().unwrap_or_default();
        let rest: Vec<String> = arguments.collect();
        Ok(match (name, rest.as_slice()) {
            ("if", [yes, no]) => format!("({first} if ({yes} else {no}))"),
            (_, []) => format!("({name}({first}))"),
            (_, rest) => rest.iter().fold(first, |text, argument| format!("({text} {name} {argument})")),
        })
    }

    /// The closing parenthesis of the one at `open`.
    fn close(&mut self, open: Range<usize>) -> Result<(), ExpressionError> {
        if self.take(&[")"]).is_some() {
            return Ok(());
        }
        match self.peek().token {
            Token::End => Err(ExpressionError::new(open, "this parenthesis is never closed", "add the missing `)`")),
            _ => Err(self.unexpected(&self.peek().clone())),
        }
    }

    fn deeper(&mut self, span: Range<usize>, inside: impl Fn(&mut Self) -> Piece) -> Piece {
        if self.depth == DEEPEST {
            return Err(ExpressionError::new(
                span,
                format!("the expression is nested more than {DEEPEST} levels deep"),
                "use fewer parentheses",
            ));
        }
        self.depth += 1;
        let result = inside(self);
        self.depth -= 1;
        result
    }

    /// A token where another one must stand.
    fn unexpected(&self, found: &Located<'_>) -> ExpressionError {
        let operand = matches!(found.token, Token::Number(_) | Token::Name(_) | Token::Symbol("("));
        let (message, remedy) = match &found.token {
            Token::End => ("the expression ends too early".to_owned(), "a number, variable or function is missing"),
            Token::Symbol(")") => {
                ("`)` closes nothing, or nothing stands before it".to_owned(), "remove or complete it")
            }
            Token::Symbol(",") => ("`,` outside a call".to_owned(), "numbers are written with a point, such as `0.5`"),
            _ if operand => ("an operator is missing here".to_owned(), "write a product as `2*X`"),
            Token::Symbol(symbol) => {
                (format!("`{symbol}` needs something before it"), "a number, variable or function is missing")
            }
            Token::Number(_) | Token::Name(_) => ("an operator is missing here".to_owned(), "write `2*X`"),
        };
        ExpressionError::new(found.span.clone(), message, remedy)
    }
}

fn unknown_name(name: &str, span: Range<usize>) -> ExpressionError {
    let upper = name.to_uppercase();
    let hint = match name {
        "x" | "y" | "z" => format!(
            "use `{upper}`: expressions are fields of the reference position X, Y, Z (`{name}` would be the current one)"
        ),
        "T" | "time" => "the time is `t`".to_owned(),
        "e" | "E" => "write `exp(1)`".to_owned(),
        "PI" | "Pi" => "write `pi`".to_owned(),
        "and" => "write `&&`".to_owned(),
        "or" => "write `||`".to_owned(),
        "not" => "write `!`".to_owned(),
        "true" => "write `1`".to_owned(),
        "false" => "write `0`".to_owned(),
        _ if FUNCTIONS.iter().any(|(function, ..)| *function == name) => {
            return ExpressionError::new(span, format!("the function `{name}` has no arguments"), example(name));
        }
        _ => {
            let nearest = closest(name, VARIABLES.into_iter().chain(["pi"]).filter(|_| name.len() > 1));
            let guess = nearest.map(|guess| format!("did you mean `{guess}`? ")).unwrap_or_default();
            format!("{guess}the names are X, Y, Z, t and pi; functions need parentheses")
        }
    };
    ExpressionError::new(span, format!("unknown name `{name}`"), hint)
}

fn unknown_function(name: &str, span: Range<usize>) -> ExpressionError {
    let known = || FUNCTIONS.iter().map(|(function, ..)| *function);
    if VARIABLES.contains(&name) || name == "pi" {
        return ExpressionError::new(span, format!("`{name}` is not a function"), format!("write `{name}*(…)`"));
    }
    let replacement = match name {
        "heaviside" | "H" => Some("step"),
        "log" => Some("ln(…)` or `log10"),
        "sgn" | "signum" => Some("sign"),
        "fabs" => Some("abs"),
        "arcsin" => Some("asin"),
        "arccos" => Some("acos"),
        "arctan" => Some("atan"),
        "pow" => return ExpressionError::new(span, "unknown function `pow`", "write a power as `X^2`"),
        _ => closest(name, known()),
    };
    let guess = replacement.map(|guess| format!("did you mean `{guess}(…)`? ")).unwrap_or_default();
    let list = known().collect::<Vec<_>>().join(" ");
    ExpressionError::new(span, format!("unknown function `{name}`"), format!("{guess}the functions are {list}"))
}

fn example(name: &str) -> String {
    match name {
        "if" => "write `if(condition, value, otherwise)`".to_owned(),
        "min" | "max" => format!("write `{name}(X, 1)`"),
        "atan2" => "write `atan2(Y, X)`".to_owned(),
        _ => format!("write `{name}(X)`"),
    }
}

//! Text to tokens, each with its bytes.

use std::ops::Range;

use super::error::ExpressionError;

/// A token.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Token<'a> {
    Number(f64),
    Name(&'a str),
    /// An operator, a parenthesis or a comma.
    Symbol(&'static str),
    End,
}

/// A token and its bytes in the text.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Located<'a> {
    pub token: Token<'a>,
    pub span: Range<usize>,
}

/// Longer symbols before their beginnings.
const SYMBOLS: [&str; 17] = ["<=", ">=", "==", "!=", "&&", "||", "<", ">", "!", "+", "-", "*", "/", "^", "(", ")", ","];

/// Cuts a text into tokens; the last one is [`Token::End`].
pub(super) fn read(text: &str) -> Result<Vec<Located<'_>>, ExpressionError> {
    let mut tokens = Vec::new();
    let mut start = 0;
    while let Some(first) = text[start..].chars().next() {
        let rest = &text[start..];
        if first.is_whitespace() {
            start += first.len_utf8();
            continue;
        }
        let (token, length) = if first.is_ascii_digit() || first == '.' {
            number(rest, start)?
        } else if first.is_ascii_alphabetic() || first == '_' {
            let length = rest.bytes().take_while(|byte| byte.is_ascii_alphanumeric() || *byte == b'_').count();
            (Token::Name(&rest[..length]), length)
        } else if rest.starts_with("**") {
            return Err(ExpressionError::new(start..start + 2, "`**` is not an operator", "write a power as `X^2`"));
        } else if let Some(symbol) = SYMBOLS.iter().find(|symbol| rest.starts_with(**symbol)) {
            (Token::Symbol(symbol), symbol.len())
        } else {
            return Err(stray(first, start));
        };
        tokens.push(Located { token, span: start..start + length });
        start += length;
    }
    tokens.push(Located { token: Token::End, span: text.len()..text.len() });
    Ok(tokens)
}

fn number(rest: &str, start: usize) -> Result<(Token<'_>, usize), ExpressionError> {
    let digits = |from: usize| rest.as_bytes()[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let mut length = digits(0);
    if rest[length..].starts_with('.') {
        length += 1;
        length += digits(length);
    }
    if rest[length..].starts_with(['e', 'E']) {
        let sign = usize::from(rest[length + 1..].starts_with(['+', '-']));
        let exponent = digits(length + 1 + sign);
        // `2exp(1)` is a missing `*`, not a number with a broken exponent.
        if exponent > 0 {
            length += 1 + sign + exponent;
        }
    }
    let span = start..start + length;
    match rest[..length].parse::<f64>() {
        Ok(value) if value.is_finite() => Ok((Token::Number(value), length)),
        Ok(_) => Err(ExpressionError::new(span, "the number is too large", "numbers go up to 1.7e308")),
        Err(_) => Err(ExpressionError::new(span, "this is not a number", "write numbers like `0.5`, `3` or `1e-3`")),
    }
}

fn stray(first: char, start: usize) -> ExpressionError {
    let remedy = match first {
        '=' => "compare with `==`",
        '&' => "write `&&` for \"and\"",
        '|' => "write `||` for \"or\", `abs(X)` for the absolute value",
        '%' => "write the remainder as `X - floor(X/a)*a`",
        '[' | ']' | '{' | '}' => "use round parentheses",
        '\'' | '"' => "an expression has no text in it",
        'π' => "write `pi`",
        '²' | '³' => "write a power as `X^2`",
        '·' | '×' => "write `*`",
        _ => "use numbers, X, Y, Z, t, pi, functions, `+ - * / ^`, comparisons and round parentheses",
    };
    ExpressionError::new(start..start + first.len_utf8(), format!("`{first}` means nothing here"), remedy)
}

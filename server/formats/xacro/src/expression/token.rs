//! Splits an expression into tokens.

use crate::error::{Fault, shown};
use crate::limits;

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token {
    Int(i64),
    Float(f64),
    Text(String),
    Name(String),
    Sign(&'static str),
}

/// Longer signs come first.
const SIGNS: &[&str] = &[
    "**", "//", "==", "!=", "<=", ">=", "<<", ">>", "<", ">", "+", "-", "*", "/", "%", "(", ")", "[", "]",
    "{", "}", ",", ":", ".", "=", "&", "|", "^", "~", "@",
];

pub(super) fn tokens(text: &str) -> Result<Vec<Token>, Fault> {
    let mut tokens = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        if tokens.len() >= limits::WORDS {
            return Err(format!("an expression has more than {} words", limits::WORDS));
        }
        let length = if first == '\'' || first == '"' {
            let (inner, length) = quoted(rest, first)?;
            tokens.push(Token::Text(inner));
            length
        } else if first.is_ascii_digit()
            || (first == '.' && rest.chars().nth(1).is_some_and(|c| c.is_ascii_digit()))
        {
            let length = number_length(rest);
            let digits = rest.get(..length).unwrap_or_default().replace('_', "");
            let wrong = || format!("{} is not a number", shown(&digits));
            tokens.push(match digits.parse() {
                Ok(int) => Token::Int(int),
                Err(_) => Token::Float(digits.parse().map_err(|_| wrong())?),
            });
            length
        } else if first.is_alphabetic() || first == '_' {
            let end = |c: char| !(c.is_alphanumeric() || c == '_');
            let length = rest.find(end).unwrap_or(rest.len());
            tokens.push(Token::Name(rest.get(..length).unwrap_or_default().to_owned()));
            length
        } else {
            let sign = SIGNS.iter().find(|sign| rest.starts_with(**sign));
            let sign = sign
                .ok_or_else(|| format!("{} does not belong into an expression", shown(&first.to_string())))?;
            tokens.push(Token::Sign(sign));
            sign.len()
        };
        rest = rest.get(length..).unwrap_or_default().trim_start();
    }
    Ok(tokens)
}

/// Returns a quoted text, and its length including the quotes.
fn quoted(rest: &str, quote: char) -> Result<(String, usize), Fault> {
    let mut inner = String::new();
    let mut chars = rest.char_indices().skip(1);
    while let Some((at, c)) = chars.next() {
        if c == quote {
            return Ok((inner, at + 1));
        }
        if c != '\\' {
            inner.push(c);
            continue;
        }
        match chars.next() {
            Some((_, 'n')) => inner.push('\n'),
            Some((_, 't')) => inner.push('\t'),
            Some((_, c @ ('\\' | '\'' | '"'))) => inner.push(c),
            Some((_, c)) => inner.extend(['\\', c]),
            None => break,
        }
    }
    Err(format!("{} has no closing quote", shown(rest)))
}

fn number_length(rest: &str) -> usize {
    let mut before = ' ';
    let part = |c: char| {
        let exponent = matches!(before, 'e' | 'E') && matches!(c, '+' | '-');
        let is = c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E' | '_') || exponent;
        before = c;
        !is
    };
    rest.find(part).unwrap_or(rest.len())
}

//! The parts of a text: plain, `${expression}` and `$(command)`.

use crate::error::{Fault, shown};

/// A part of a text.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Part<'t> {
    Plain(&'t str),
    /// Content of `${}`.
    Expression(&'t str),
    /// Content of `$()`.
    Command(&'t str),
}

/// Parses a text. `$${` is a plain `${`, and `$$(` a plain `$(`.
pub(crate) fn parts(text: &str) -> Result<Vec<Part<'_>>, Fault> {
    let mut parts = Vec::new();
    let mut rest = text;
    while let Some(at) = rest.find('$') {
        let (plain, sign) = rest.split_at(at);
        if !plain.is_empty() {
            parts.push(Part::Plain(plain));
        }
        if sign.starts_with("$${") || sign.starts_with("$$(") {
            let (_, escaped) = sign.split_at(1);
            let (kept, after) = escaped.split_at(2);
            parts.push(Part::Plain(kept));
            rest = after;
        } else if let Some(inside) = sign.strip_prefix("${") {
            let length =
                closing(inside, '}', '{').ok_or_else(|| format!("{} has no closing bracket", shown(sign)))?;
            let (inner, after) = inside.split_at(length);
            parts.push(Part::Expression(inner));
            rest = after.get(1..).unwrap_or_default();
        } else if let Some(inside) = sign.strip_prefix("$(") {
            let length =
                closing(inside, ')', '(').ok_or_else(|| format!("{} has no closing bracket", shown(sign)))?;
            let (inner, after) = inside.split_at(length);
            parts.push(Part::Command(inner));
            rest = after.get(1..).unwrap_or_default();
        } else {
            let (dollar, after) = sign.split_at(1);
            parts.push(Part::Plain(dollar));
            rest = after;
        }
    }
    if !rest.is_empty() {
        parts.push(Part::Plain(rest));
    }
    Ok(parts)
}

/// Returns the position of the bracket that closes the one before the text. Brackets in quotes do not count.
fn closing(text: &str, close: char, open: char) -> Option<usize> {
    let mut depth = 0_usize;
    let mut quote = None;
    for (at, c) in text.char_indices() {
        match quote {
            Some(open) if c == open => quote = None,
            Some(_) => {}
            None if (c == '\'' || c == '"') && close == '}' => quote = Some(c),
            None if c == open => depth += 1,
            None if c == close && depth == 0 => return Some(at),
            None if c == close => depth -= 1,
            None => {}
        }
    }
    None
}

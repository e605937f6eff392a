//! Macros and their parameters.

use std::rc::Rc;

use crate::error::{Fault, shown};
use crate::source::Element;

/// A macro.
#[derive(Debug)]
pub(crate) struct Macro {
    pub(crate) name: String,
    pub(crate) parameters: Vec<Parameter>,
    /// Element whose content is the body.
    pub(crate) element: Rc<Element>,
}

/// A parameter of a macro.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Parameter {
    Value {
        name: String,
        /// `:=^`: taken from the caller's property of this name.
        forward: bool,
        default: Option<String>,
    },
    /// `*name` takes an element, `**name` the content of one.
    Block { name: String, content: bool },
}

/// Parses `a b:=1 c:='two words' d:=^ e:=^|3 f:=${a + 1} *block **blocks`.
pub(crate) fn parameters(text: &str) -> Result<Vec<Parameter>, Fault> {
    let mut all = Vec::new();
    let mut rest = text.trim_start();
    while !rest.is_empty() {
        let end = rest.find(|c: char| c.is_whitespace() || c == '=' || c == ':').unwrap_or(rest.len());
        let (name, after) = rest.split_at(end);
        if name.is_empty() {
            return Err(format!("{} is not a list of parameters", shown(text)));
        }
        // Blanks may surround the sign.
        let sign = after.trim_start();
        let value = sign.strip_prefix(":=").or_else(|| sign.strip_prefix('='));
        let Some(value) = value else {
            all.push(match (name.strip_prefix("**"), name.strip_prefix('*')) {
                (Some(name), _) => Parameter::Block { name: name.to_owned(), content: true },
                (None, Some(name)) => Parameter::Block { name: name.to_owned(), content: false },
                (None, None) => Parameter::Value { name: name.to_owned(), forward: false, default: None },
            });
            rest = sign;
            continue;
        };
        let value = value.trim_start();
        let (forward, value) = match (value.strip_prefix("^|"), value.strip_prefix('^')) {
            (Some(value), _) => (true, value),
            (None, Some(value)) => (true, value),
            (None, None) => (false, value),
        };
        let length = default_length(value);
        let (default, after) = value.split_at(length);
        let default = (!default.is_empty() || !forward).then(|| default.to_owned());
        all.push(Parameter::Value { name: name.to_owned(), forward, default });
        rest = after.trim_start();
    }
    Ok(all)
}

/// Returns the length up to the first blank outside of quotes and brackets.
fn default_length(text: &str) -> usize {
    let mut depth = 0_usize;
    let mut quote = None;
    for (at, c) in text.char_indices() {
        match (quote, c) {
            (Some(open), c) if c == open => quote = None,
            (Some(_), _) => {}
            (None, '\'' | '"') => quote = Some(c),
            (None, '{' | '(' | '[') => depth += 1,
            (None, '}' | ')' | ']') => depth = depth.saturating_sub(1),
            (None, c) if c.is_whitespace() && depth == 0 => return at,
            (None, _) => {}
        }
    }
    text.len()
}

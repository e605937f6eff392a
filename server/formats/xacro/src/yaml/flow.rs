//! YAML values on one line: words, quoted texts, and values in brackets.

use std::rc::Rc;

use super::{Reader, anchor};
use crate::error::{Fault, not_supported, shown};
use crate::limits;
use crate::value::{Value, float, put};

/// Unit tags of angles and lengths, in radians and metres.
const UNITS: &[(&str, f64)] = &[
    ("radians", 1.0),
    ("degrees", std::f64::consts::PI / 180.0),
    ("meters", 1.0),
    ("millimeters", 0.001),
    ("foot", 0.3048),
    ("inches", 0.0254),
];

/// Returns whether all brackets and quotes are closed.
pub(super) fn is_closed(text: &str) -> bool {
    let mut depth = 0_usize;
    let mut quote = None;
    let mut before = ' ';
    let mut is_escaped = false;
    for c in text.chars() {
        match (quote, c) {
            (Some('"'), '\\') if !is_escaped => {
                is_escaped = true;
                continue;
            }
            (Some(open), c) if c == open && !is_escaped => quote = None,
            (Some(_), _) => {}
            // Within a word a quote is an apostrophe.
            (None, '\'' | '"') if !before.is_alphanumeric() => quote = Some(c),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth = depth.saturating_sub(1),
            _ => {}
        }
        is_escaped = false;
        before = c;
    }
    depth == 0 && quote.is_none()
}

/// Parser of one value, or of values in brackets.
pub(super) struct Flow<'t> {
    pub(super) rest: &'t str,
    pub(super) number: usize,
}

impl<'t> Flow<'t> {
    pub(super) fn wrong(&self) -> Fault {
        format!("line {}: {} is not understood", self.number, shown(self.rest.trim()))
    }

    fn take(&mut self, sign: char) -> bool {
        let rest = self.rest.trim_start();
        let after = rest.strip_prefix(sign);
        self.rest = after.unwrap_or(rest);
        after.is_some()
    }

    pub(super) fn value(&mut self, reader: &mut Reader, depth: usize, ends: &[char]) -> Result<Value, Fault> {
        reader.count(1, self.number)?;
        if depth > limits::BRACKETS {
            return Err(format!("line {}: nested deeper than {}", self.number, limits::BRACKETS));
        }
        if let Some((name, rest)) = anchor(self.rest.trim_start()) {
            let before = reader.values;
            self.rest = rest;
            let value = self.value(reader, depth + 1, ends)?;
            reader.keep(name, &value, before);
            return Ok(value);
        }
        if self.take('[') {
            let mut list = Vec::new();
            while !self.take(']') {
                list.push(self.value(reader, depth + 1, &[',', ']'])?);
                if !self.take(',') && !self.rest.starts_with(']') {
                    return Err(self.wrong());
                }
            }
            return Ok(Value::List(Rc::new(list)));
        }
        if self.take('{') {
            let mut map = Vec::new();
            while !self.take('}') {
                let key = self.value(reader, depth + 1, &[':', ',', '}'])?;
                let value = match self.take(':') {
                    true => self.value(reader, depth + 1, &[',', '}'])?,
                    false => Value::None,
                };
                match &key {
                    Value::Text(key) if &**key == "<<" => super::merge(&mut map, &value),
                    _ => put(&mut map, key, value),
                }
                if !self.take(',') && !self.rest.starts_with('}') {
                    return Err(self.wrong());
                }
            }
            return Ok(Value::Map(Rc::new(map)));
        }
        self.plain(reader, ends)
    }

    fn plain(&mut self, reader: &mut Reader, ends: &[char]) -> Result<Value, Fault> {
        let rest = self.rest.trim_start();
        if let Some(quote @ ('\'' | '"')) = rest.chars().next() {
            return self.quoted(rest, quote);
        }
        let end = rest.find(ends).unwrap_or(rest.len());
        let (word, after) = rest.split_at(end);
        self.rest = after;
        let word = word.trim();
        if let Some(name) = word.strip_prefix('*') {
            return reader.alias(name, self.number);
        }
        if let Some((tag, text)) = word.strip_prefix('!').and_then(|word| word.split_once(' ')) {
            let text = text.trim().trim_matches(['"', '\'']);
            if let Some((_, factor)) = UNITS.iter().find(|(unit, _)| *unit == tag) {
                let value =
                    (reader.evaluate)(text).map_err(|fault| format!("line {}: {fault}", self.number))?;
                return Ok(Value::Float(value * factor));
            }
            return match tag {
                "!str" => Ok(Value::text(text)),
                "!float" => float(text).map(Value::Float).ok_or_else(|| self.wrong()),
                "!int" | "!bool" => Ok(scalar(text)),
                _ => Err(format!("line {}: {}", self.number, not_supported(&format!("the tag !{tag}")))),
            };
        }
        if word.starts_with(['&', '|', '>', '!', '`', '@']) {
            return Err(format!(
                "line {}: {}",
                self.number,
                not_supported(&format!("{} in YAML", shown(word)))
            ));
        }
        Ok(scalar(word))
    }

    fn quoted(&mut self, rest: &'t str, quote: char) -> Result<Value, Fault> {
        let mut text = String::new();
        let mut chars = rest.char_indices().skip(1).peekable();
        while let Some((at, c)) = chars.next() {
            match c {
                '\\' if quote == '"' => {
                    let (_, escaped) = chars.next().ok_or_else(|| self.wrong())?;
                    text.push(match escaped {
                        'n' => '\n',
                        't' => '\t',
                        'r' => '\r',
                        '0' => '\0',
                        'u' => {
                            let digits: String = chars.by_ref().take(4).map(|(_, digit)| digit).collect();
                            let code = u32::from_str_radix(&digits, 16).ok().and_then(char::from_u32);
                            code.ok_or_else(|| self.wrong())?
                        }
                        '"' | '\\' | '/' | ' ' => escaped,
                        _ => {
                            return Err(format!(
                                "line {}: {}",
                                self.number,
                                not_supported("an escape in YAML")
                            ));
                        }
                    });
                }
                // A doubled quote is one quote.
                '\'' if quote == '\'' && chars.peek().is_some_and(|(_, next)| *next == '\'') => {
                    chars.next();
                    text.push('\'');
                }
                c if c == quote => {
                    self.rest = rest.get(at + 1..).unwrap_or_default();
                    return Ok(Value::text(&text));
                }
                c => text.push(c),
            }
        }
        Err(self.wrong())
    }
}

/// Parses a word without quotes.
fn scalar(word: &str) -> Value {
    match word {
        "" | "~" | "null" | "Null" | "NULL" => Value::None,
        "true" | "True" | "TRUE" | "yes" | "Yes" | "YES" | "on" | "On" | "ON" => Value::Bool(true),
        "false" | "False" | "FALSE" | "no" | "No" | "NO" | "off" | "Off" | "OFF" => Value::Bool(false),
        ".inf" | "+.inf" | ".Inf" => Value::Float(f64::INFINITY),
        "-.inf" | "-.Inf" => Value::Float(f64::NEG_INFINITY),
        ".nan" | ".NaN" => Value::Float(f64::NAN),
        word => match word.replace('_', "").parse() {
            Ok(int) => Value::Int(int),
            Err(_) if word.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) => {
                let hex = word.strip_prefix("0x").and_then(|digits| i64::from_str_radix(digits, 16).ok());
                hex.map(Value::Int)
                    .or_else(|| float(word).map(Value::Float))
                    .unwrap_or_else(|| Value::text(word))
            }
            Err(_) => Value::text(word),
        },
    }
}

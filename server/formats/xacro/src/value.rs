//! Values of expressions: the types of Python that xacro files use.

use std::rc::Rc;

use crate::error::{Fault, not_supported, shown};
use crate::expression::Expression;
use crate::limits;

/// A value.
#[derive(Clone, Debug)]
pub(crate) enum Value {
    None,
    Bool(bool),
    Int(i64),
    Float(f64),
    Text(Rc<str>),
    /// Lists and tuples.
    List(Rc<Vec<Value>>),
    /// Entries in the order in which they were written.
    Map(Rc<Vec<(Value, Value)>>),
    /// `xacro`, `math`, `python`: a module before a dot.
    Module(&'static str),
    /// A function, by its name.
    Function(Rc<str>),
    /// A `lambda`.
    Lambda(Rc<Closure>),
    /// The names of an include with `ns`, by their scope.
    Namespace(usize),
}

/// A `lambda` with its surrounding variables.
#[derive(Debug)]
pub(crate) struct Closure {
    pub(crate) parameters: Vec<Rc<str>>,
    pub(crate) body: Rc<Expression>,
    /// Variables of the comprehensions and lambdas around it.
    pub(crate) locals: Vec<(Rc<str>, Value)>,
    /// Scope in which it looks up properties.
    pub(crate) level: usize,
}

impl Value {
    /// Makes a text.
    pub(crate) fn text(text: &str) -> Self {
        Self::Text(Rc::from(text))
    }

    /// Parses a literal as xacro does: a quoted text, a number, a boolean, else the text.
    pub(crate) fn literal(text: &str) -> Self {
        if let Some(inner) = text.strip_prefix('\'').and_then(|text| text.strip_suffix('\'')) {
            return Self::text(inner);
        }
        if text.contains('_') {
            return Self::text(text);
        }
        let trimmed = text.trim();
        if let Ok(int) = trimmed.parse() {
            return Self::Int(int);
        }
        if let Some(float) = float(trimmed) {
            return Self::Float(float);
        }
        match text {
            "true" | "True" => Self::Bool(true),
            "false" | "False" => Self::Bool(false),
            _ => Self::text(text),
        }
    }

    /// Parses a text as a literal; keeps other values.
    pub(crate) fn into_literal(self) -> Self {
        match self {
            Self::Text(text) => Self::literal(&text),
            value => value,
        }
    }

    /// Returns its truth as in Python's `if`.
    pub(crate) fn truth(&self) -> bool {
        match self {
            Self::None => false,
            Self::Bool(is) => *is,
            Self::Int(int) => *int != 0,
            Self::Float(float) => *float != 0.0,
            Self::Text(text) => !text.is_empty(),
            Self::List(list) => !list.is_empty(),
            Self::Map(map) => !map.is_empty(),
            Self::Module(_) | Self::Function(_) | Self::Lambda(_) | Self::Namespace(_) => true,
        }
    }

    /// Returns its truth as in `<xacro:if>`.
    pub(crate) fn condition(&self) -> Result<bool, Fault> {
        match self {
            Self::Text(text) => match text.trim() {
                "true" | "True" => Ok(true),
                "false" | "False" => Ok(false),
                word => match word.parse::<i64>() {
                    Ok(int) => Ok(int != 0),
                    Err(_) => Err(format!("{} is neither true nor false", shown(word))),
                },
            },
            value => Ok(value.truth()),
        }
    }

    /// Returns the value as a number, if it is one.
    pub(crate) fn number(&self) -> Option<f64> {
        match self {
            Self::Bool(is) => Some(f64::from(u8::from(*is))),
            Self::Int(int) => Some(*int as f64),
            Self::Float(float) => Some(*float),
            _ => None,
        }
    }

    /// Returns the value as an integer, if it is one.
    pub(crate) fn int(&self) -> Option<i64> {
        match self {
            Self::Bool(is) => Some(i64::from(*is)),
            Self::Int(int) => Some(*int),
            _ => None,
        }
    }

    /// Compares like Python's `==`. Values that share parts may be huge, so the comparison ends after some
    /// steps.
    pub(crate) fn equals(&self, other: &Self) -> bool {
        const STEPS: usize = 100_000;
        self.equals_within(other, &mut { STEPS })
    }

    fn equals_within(&self, other: &Self, steps: &mut usize) -> bool {
        let Some(left) = steps.checked_sub(1) else { return false };
        *steps = left;
        match (self, other) {
            (Self::None, Self::None) => true,
            (Self::Text(a), Self::Text(b)) | (Self::Function(a), Self::Function(b)) => a == b,
            (Self::List(a), Self::List(b)) => {
                a.len() == b.len() && a.iter().zip(b.iter()).all(|(a, b)| a.equals_within(b, steps))
            }
            (Self::Map(a), Self::Map(b)) => {
                let mut same = |(key, value): &(Self, Self)| {
                    find(b, key).is_some_and(|other| other.equals_within(value, steps))
                };
                a.len() == b.len() && a.iter().all(&mut same)
            }
            (a, b) => matches!((a.number(), b.number()), (Some(a), Some(b)) if a == b),
        }
    }

    /// Returns the name of its type for errors.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::None => "None",
            Self::Bool(_) => "a truth value",
            Self::Int(_) | Self::Float(_) => "a number",
            Self::Text(_) => "a text",
            Self::List(_) => "a list",
            Self::Map(_) => "a dictionary",
            Self::Module(_) => "a module",
            Self::Function(_) | Self::Lambda(_) => "a function",
            Self::Namespace(_) => "a namespace",
        }
    }

    /// Formats like Python's `str`.
    pub(crate) fn show(&self) -> Result<String, Fault> {
        let mut out = String::new();
        self.write(&mut out, false, 0)?;
        Ok(out)
    }

    fn write(&self, out: &mut String, quote: bool, depth: usize) -> Result<(), Fault> {
        if depth > limits::BRACKETS || out.len() > limits::VALUE_BYTES {
            return Err(too_long());
        }
        match self {
            Self::None => out.push_str("None"),
            Self::Bool(is) => out.push_str(if *is { "True" } else { "False" }),
            Self::Int(int) => out.push_str(&int.to_string()),
            Self::Float(float) => out.push_str(&show_float(*float)),
            Self::Text(text) if quote && text.contains('\'') && !text.contains('"') => {
                out.push_str(&format!("\"{text}\""));
            }
            Self::Text(text) if quote => out.push_str(&format!("'{}'", text.replace('\'', "\\'"))),
            Self::Text(text) => out.push_str(text),
            Self::List(list) => {
                out.push('[');
                for (index, value) in list.iter().enumerate() {
                    out.push_str(if index > 0 { ", " } else { "" });
                    value.write(out, true, depth + 1)?;
                }
                out.push(']');
            }
            Self::Map(map) => {
                out.push('{');
                for (index, (key, value)) in map.iter().enumerate() {
                    out.push_str(if index > 0 { ", " } else { "" });
                    key.write(out, true, depth + 1)?;
                    out.push_str(": ");
                    value.write(out, true, depth + 1)?;
                }
                out.push('}');
            }
            Self::Module(_) | Self::Function(_) | Self::Lambda(_) | Self::Namespace(_) => {
                return Err(not_supported(&format!("{} as a text", self.kind())));
            }
        }
        Ok(())
    }
}

/// Sets the value of a key. A repeated key keeps its place and gets the last value.
pub(crate) fn put(map: &mut Vec<(Value, Value)>, key: Value, value: Value) {
    match map.iter_mut().find(|(known, _)| known.equals(&key)) {
        Some((_, known)) => *known = value,
        None => map.push((key, value)),
    }
}

/// Returns the value of a key.
pub(crate) fn find<'m>(map: &'m [(Value, Value)], key: &Value) -> Option<&'m Value> {
    map.iter().find(|(known, _)| known.equals(key)).map(|(_, value)| value)
}

/// Makes the fault of a value that is too long.
pub(crate) fn too_long() -> Fault {
    format!("a value is longer than {} bytes", limits::VALUE_BYTES)
}

/// Parses a number like Python's `float`.
pub(crate) fn float(text: &str) -> Option<f64> {
    text.trim().parse().ok()
}

/// Formats like Python's `repr`.
fn show_float(float: f64) -> String {
    let size = float.abs();
    if float.is_nan() {
        "nan".to_owned()
    } else if float.is_infinite() {
        if float > 0.0 { "inf".to_owned() } else { "-inf".to_owned() }
    } else if size != 0.0 && !(1e-4..1e16).contains(&size) {
        let text = format!("{float:e}");
        let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let (sign, exponent) = exponent.strip_prefix('-').map_or(('+', exponent), |size| ('-', size));
        format!("{digits}e{sign}{exponent:0>2}")
    } else if float.fract() == 0.0 {
        format!("{float:.1}")
    } else {
        format!("{float}")
    }
}

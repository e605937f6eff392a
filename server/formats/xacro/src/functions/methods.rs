//! Methods of Python for expressions.

use std::rc::Rc;

use super::{count, items, kinds};
use crate::error::{Fault, not_supported};
use crate::limits;
use crate::value::{Value, find, too_long};

/// Calls a method.
pub(crate) fn method(of: &Value, name: &str, arguments: &[Value]) -> Result<Value, Fault> {
    let text = |text: String| {
        if text.len() > limits::VALUE_BYTES { Err(too_long()) } else { Ok(Value::text(&text)) }
    };
    let list = |all: Vec<Value>| Ok(Value::List(Rc::new(all)));
    match (of, name, arguments) {
        (Value::Text(of), "lower", []) => text(of.to_lowercase()),
        (Value::Text(of), "upper", []) => text(of.to_uppercase()),
        (Value::Text(of), "strip", []) => text(of.trim().to_owned()),
        (Value::Text(of), "lstrip", []) => text(of.trim_start().to_owned()),
        (Value::Text(of), "rstrip", []) => text(of.trim_end().to_owned()),
        (Value::Text(of), "strip", [Value::Text(of_these)]) => {
            text(of.trim_matches(|c| of_these.contains(c)).to_owned())
        }
        (Value::Text(of), "lstrip", [Value::Text(of_these)]) => {
            text(of.trim_start_matches(|c| of_these.contains(c)).to_owned())
        }
        (Value::Text(of), "rstrip", [Value::Text(of_these)]) => {
            text(of.trim_end_matches(|c| of_these.contains(c)).to_owned())
        }
        (Value::Text(of), "capitalize", []) => {
            let mut chars = of.chars();
            let first = chars.next().map(|c| c.to_uppercase().to_string()).unwrap_or_default();
            text(first + &chars.as_str().to_lowercase())
        }
        (Value::Text(of), "title", []) => {
            let mut before = ' ';
            let mut titled = String::new();
            for c in of.chars() {
                if before.is_alphabetic() {
                    titled.extend(c.to_lowercase())
                } else {
                    titled.extend(c.to_uppercase())
                }
                before = c;
            }
            text(titled)
        }
        (Value::Text(of), "isdigit" | "isnumeric" | "isdecimal", []) => {
            Ok(Value::Bool(!of.is_empty() && of.chars().all(char::is_numeric)))
        }
        (Value::Text(of), "isalpha", []) => {
            Ok(Value::Bool(!of.is_empty() && of.chars().all(char::is_alphabetic)))
        }
        (Value::Text(of), "find" | "rfind", [Value::Text(wanted)]) => {
            let at = if name == "find" { of.find(&**wanted) } else { of.rfind(&**wanted) };
            Ok(at.map_or(Value::Int(-1), |at| count(of.get(..at).map_or(0, |before| before.chars().count()))))
        }
        (Value::Text(of), "count", [Value::Text(wanted)]) if !wanted.is_empty() => {
            Ok(count(of.matches(&**wanted).count()))
        }
        (Value::Text(of), "zfill", [width]) => {
            let width = width.int().and_then(|width| usize::try_from(width).ok()).unwrap_or(0);
            if width > limits::VALUE_BYTES {
                return Err(too_long());
            }
            let (sign, digits) = of.strip_prefix('-').map_or(("", &**of), |digits| ("-", digits));
            text(format!("{sign}{digits:0>width$}", width = width.saturating_sub(sign.len())))
        }
        (Value::Text(of), "rsplit", [Value::Text(by), most]) if !by.is_empty() && most.int().is_some() => {
            let most = usize::try_from(most.int().unwrap_or(0)).unwrap_or(limits::ENTRIES);
            let mut parts: Vec<Value> = of.rsplitn(most.saturating_add(1), &**by).map(Value::text).collect();
            parts.reverse();
            list(parts)
        }
        (Value::Text(of), "split", [Value::Text(by), most]) if !by.is_empty() && most.int().is_some() => {
            let most = usize::try_from(most.int().unwrap_or(0)).unwrap_or(limits::ENTRIES);
            list(of.splitn(most.saturating_add(1), &**by).map(Value::text).collect())
        }
        (Value::Text(of), "splitlines", []) => list(of.lines().map(Value::text).collect()),
        (Value::List(of), "index", [wanted]) => {
            let at = of.iter().position(|value| value.equals(wanted));
            at.map(count).ok_or_else(|| "the list does not have that value".to_owned())
        }
        (Value::List(of), "count", [wanted]) => {
            Ok(count(of.iter().filter(|value| value.equals(wanted)).count()))
        }
        (Value::Text(of), "startswith", [Value::Text(start)]) => Ok(Value::Bool(of.starts_with(&**start))),
        (Value::Text(of), "endswith", [Value::Text(end)]) => Ok(Value::Bool(of.ends_with(&**end))),
        (Value::Text(of), "replace", [Value::Text(from), Value::Text(to)]) => {
            let most = of.len().saturating_add(1).saturating_mul(to.len() + 1);
            if most > 16 * limits::VALUE_BYTES { Err(too_long()) } else { text(of.replace(&**from, to)) }
        }
        (Value::Text(of), "split", []) => list(of.split_whitespace().map(Value::text).collect()),
        (Value::Text(of), "split", [Value::Text(by)]) if !by.is_empty() => {
            list(of.split(&**by).map(Value::text).collect())
        }
        (Value::Text(of), "join", [all]) => {
            let all = items(all).ok_or_else(|| format!("{} cannot be joined", all.kind()))?;
            let words: Result<Vec<String>, Fault> = all.iter().map(Value::show).collect();
            text(words?.join(of))
        }
        (Value::Map(of), "keys", []) => list(of.iter().map(|(key, _)| key.clone()).collect()),
        (Value::Map(of), "values", []) => list(of.iter().map(|(_, value)| value.clone()).collect()),
        (Value::Map(of), "items", []) => list(
            of.iter().map(|(key, value)| Value::List(Rc::new(vec![key.clone(), value.clone()]))).collect(),
        ),
        (Value::Map(of), "get", [key]) => Ok(find(of, key).cloned().unwrap_or(Value::None)),
        (Value::Map(of), "get", [key, other]) => Ok(find(of, key).unwrap_or(other).clone()),
        _ => Err(not_supported(&format!("the method {name}() of {} with {}", of.kind(), kinds(arguments)))),
    }
}

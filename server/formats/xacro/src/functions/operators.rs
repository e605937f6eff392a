//! Operators of Python for expressions, and entries of lists, dictionaries and texts.

use std::rc::Rc;

use super::{SET, format, items, too_large};
use crate::error::{Fault, shown};
use crate::expression::{Comparison, Operator};
use crate::limits;
use crate::value::{Value, find, put, too_long};

/// Applies a binary operator.
pub(crate) fn binary(operator: Operator, a: &Value, b: &Value) -> Result<Value, Fault> {
    use Operator::{
        Add, And, Divide, ExclusiveOr, FloorDivide, Modulo, Multiply, Or, Power, ShiftLeft, ShiftRight,
        Subtract,
    };
    let divided = || "a division by zero".to_owned();
    match (operator, a, b) {
        (Add, Value::Text(a), Value::Text(b)) if a.len() + b.len() <= limits::VALUE_BYTES => {
            return Ok(Value::text(&format!("{a}{b}")));
        }
        (Add, Value::List(a), Value::List(b)) if a.len() + b.len() <= limits::ENTRIES => {
            return Ok(Value::List(Rc::new(a.iter().chain(b.iter()).cloned().collect())));
        }
        (Multiply, Value::Text(text), times) | (Multiply, times, Value::Text(text))
            if times.int().is_some() =>
        {
            let times = usize::try_from(times.int().unwrap_or(0).max(0)).unwrap_or(usize::MAX);
            if text.len().saturating_mul(times) > limits::VALUE_BYTES {
                return Err(too_long());
            }
            return Ok(Value::text(&text.repeat(times)));
        }
        (Add, Value::Text(_), Value::Text(_)) | (Add, Value::List(_), Value::List(_)) => {
            return Err(too_long());
        }
        (Multiply, Value::List(list), times) | (Multiply, times, Value::List(list))
            if times.int().is_some() =>
        {
            let times = usize::try_from(times.int().unwrap_or(0).max(0)).unwrap_or(usize::MAX);
            if list.len().saturating_mul(times) > limits::ENTRIES {
                return Err(too_long());
            }
            let copies = std::iter::repeat_n(list, times).flat_map(|list| list.iter().cloned());
            return Ok(Value::List(Rc::new(copies.collect())));
        }
        (Or, Value::Map(a), Value::Map(b)) if a.len() + b.len() <= SET => {
            let mut map = a.to_vec();
            b.iter().for_each(|(key, value)| put(&mut map, key.clone(), value.clone()));
            return Ok(Value::Map(Rc::new(map)));
        }
        // Sets are lists here.
        (Subtract, Value::List(a), Value::List(b)) if a.len() + b.len() <= SET => {
            let kept = a.iter().filter(|value| !b.iter().any(|other| other.equals(value)));
            return Ok(Value::List(Rc::new(kept.cloned().collect())));
        }
        (Modulo, Value::Text(text), values) => return Ok(Value::text(&format::percent(text, values)?)),
        (And | Or | ExclusiveOr, Value::Bool(a), Value::Bool(b)) => {
            return Ok(Value::Bool(match operator {
                And => a & b,
                Or => a | b,
                _ => a ^ b,
            }));
        }
        _ => {}
    }
    if let (Some(a), Some(b)) = (a.int(), b.int()) {
        let int = match operator {
            Add => a.checked_add(b),
            Subtract => a.checked_sub(b),
            Multiply => a.checked_mul(b),
            Divide if b == 0 => return Err(divided()),
            Divide => return Ok(Value::Float(a as f64 / b as f64)),
            FloorDivide | Modulo if b == 0 => return Err(divided()),
            // Python rounds towards minus infinity.
            FloorDivide => a.checked_div(b).map(|q| if a % b != 0 && (a < 0) != (b < 0) { q - 1 } else { q }),
            Modulo => a.checked_rem(b).map(|r| if r != 0 && (r < 0) != (b < 0) { r + b } else { r }),
            And => Some(a & b),
            Or => Some(a | b),
            ExclusiveOr => Some(a ^ b),
            ShiftLeft => {
                u32::try_from(b).ok().and_then(|by| 2_i64.checked_pow(by)).and_then(|by| a.checked_mul(by))
            }
            ShiftRight => {
                u32::try_from(b).ok().map(|by| a.checked_shr(by).unwrap_or(if a < 0 { -1 } else { 0 }))
            }
            Power => match u32::try_from(b) {
                Ok(exponent) => a.checked_pow(exponent),
                Err(_) => return Ok(Value::Float((a as f64).powf(b as f64))),
            },
        };
        return int.map(Value::Int).ok_or_else(too_large);
    }
    let (Some(x), Some(y)) = (a.number(), b.number()) else {
        return Err(format!("{} and {} cannot be combined", a.kind(), b.kind()));
    };
    let float = match operator {
        Add => x + y,
        Subtract => x - y,
        Multiply => x * y,
        Divide | FloorDivide | Modulo if y == 0.0 => return Err(divided()),
        Divide => x / y,
        FloorDivide => (x / y).floor(),
        Modulo => x - y * (x / y).floor(),
        Power => x.powf(y),
        And | Or | ExclusiveOr | ShiftLeft | ShiftRight => {
            return Err(format!("{} and {} do not support bit operations", a.kind(), b.kind()));
        }
    };
    Ok(Value::Float(float))
}

/// Applies a comparison.
pub(crate) fn compare(comparison: Comparison, a: &Value, b: &Value) -> Result<bool, Fault> {
    use std::cmp::Ordering::{Equal, Greater, Less};
    let order = match comparison {
        Comparison::Equal => return Ok(a.equals(b)),
        Comparison::NotEqual => return Ok(!a.equals(b)),
        Comparison::Is => return Ok(is_same(a, b)),
        Comparison::IsNot => return Ok(!is_same(a, b)),
        Comparison::In => return contains(b, a),
        Comparison::NotIn => return contains(b, a).map(|is| !is),
        _ => match (a, b) {
            (Value::Text(a), Value::Text(b)) => Some(a.cmp(b)),
            _ => match (a.number(), b.number()) {
                (Some(a), Some(b)) => a.partial_cmp(&b),
                _ => return Err(format!("{} and {} cannot be compared", a.kind(), b.kind())),
            },
        },
    };
    Ok(match comparison {
        Comparison::Less => order == Some(Less),
        Comparison::LessEqual => matches!(order, Some(Less | Equal)),
        Comparison::Greater => order == Some(Greater),
        _ => matches!(order, Some(Greater | Equal)),
    })
}

/// Compares like Python's `is`, for values whose result does not depend on objects: None, booleans, numbers
/// and texts.
fn is_same(a: &Value, b: &Value) -> bool {
    std::mem::discriminant(a) == std::mem::discriminant(b) && a.equals(b)
}

fn contains(all: &Value, one: &Value) -> Result<bool, Fault> {
    match (all, one) {
        (Value::Text(all), Value::Text(one)) => Ok(all.contains(&**one)),
        (Value::List(all), one) => Ok(all.iter().any(|value| value.equals(one))),
        (Value::Map(all), one) => Ok(find(all, one).is_some()),
        _ => Err(format!("`in` cannot search {}", all.kind())),
    }
}

/// Returns an entry of a list, a dictionary or a text.
pub(crate) fn index(of: &Value, index: &Value) -> Result<Value, Fault> {
    if let Value::Map(map) = of {
        let found = find(map, index).cloned();
        return found
            .ok_or_else(|| format!("the dictionary has no {}", shown(&index.show().unwrap_or_default())));
    }
    let all = items(of).ok_or_else(|| format!("{} has no entries", of.kind()))?;
    let at = index.int().ok_or_else(|| format!("{} is not an index", index.kind()))?;
    let length = i64::try_from(all.len()).unwrap_or(i64::MAX);
    let from_start = if at < 0 { at.checked_add(length) } else { Some(at) };
    let found = from_start.and_then(|at| usize::try_from(at).ok()).and_then(|at| all.get(at));
    found.cloned().ok_or_else(|| format!("the index {at} is beyond {length} entries"))
}

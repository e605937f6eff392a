//! Functions of Python for expressions.

mod format;
mod methods;
mod operators;

use std::f64::consts;
use std::rc::Rc;

use crate::error::{Fault, not_supported, shown};
use crate::expression::{Comparison, Operator};
use crate::limits;
use crate::value::{Value, float};

pub(crate) use methods::method;
pub(crate) use operators::{binary, compare, index};

/// Returns the builtin value of a name that no property has.
pub(crate) fn builtin(name: &str) -> Option<Value> {
    Some(match name {
        "pi" => Value::Float(consts::PI),
        "True" => Value::Bool(true),
        "False" => Value::Bool(false),
        "tau" => Value::Float(consts::TAU),
        "e" => Value::Float(consts::E),
        "inf" => Value::Float(f64::INFINITY),
        "nan" => Value::Float(f64::NAN),
        "math" => Value::Module("math"),
        "xacro" => Value::Module("xacro"),
        "python" => Value::Module("python"),
        _ if ONE_NUMBER.iter().any(|(known, _)| *known == name) || FUNCTIONS.contains(&name) => {
            Value::Function(Rc::from(name))
        }
        _ => return None,
    })
}

type OfOne = fn(f64) -> f64;

/// Functions of one number that return a number.
const ONE_NUMBER: &[(&str, OfOne)] = &[
    ("sin", f64::sin),
    ("cos", f64::cos),
    ("tan", f64::tan),
    ("asin", f64::asin),
    ("acos", f64::acos),
    ("atan", f64::atan),
    ("sinh", f64::sinh),
    ("cosh", f64::cosh),
    ("tanh", f64::tanh),
    ("sqrt", f64::sqrt),
    ("exp", f64::exp),
    ("log10", f64::log10),
    ("log2", f64::log2),
    ("fabs", f64::abs),
    ("asinh", f64::asinh),
    ("acosh", f64::acosh),
    ("atanh", f64::atanh),
    ("expm1", f64::exp_m1),
    ("log1p", f64::ln_1p),
    ("cbrt", f64::cbrt),
    ("exp2", f64::exp2),
    ("degrees", f64::to_degrees),
    ("radians", f64::to_radians),
];

const FUNCTIONS: &[&str] = &[
    "abs",
    "atan2",
    "bool",
    "ceil",
    "copysign",
    "dict",
    "float",
    "floor",
    "fmod",
    "hypot",
    "int",
    "isnan",
    "len",
    "list",
    "log",
    "max",
    "min",
    "pow",
    "range",
    "round",
    "str",
    "sum",
    "trunc",
    "tuple",
    "load_yaml",
    "all",
    "any",
    "sorted",
    "map",
    "filter",
    "enumerate",
    "zip",
    "reversed",
    "divmod",
    "isinstance",
    "isfinite",
    "isinf",
    "isclose",
    "fsum",
    "prod",
    "gcd",
    "factorial",
    "ord",
    "repr",
    "set",
    "frozenset",
];

/// Calls a builtin function.
pub(crate) fn call(name: &str, arguments: &[Value]) -> Result<Value, Fault> {
    let wrong = || format!("{name}() cannot be called with {}", kinds(arguments));
    let number = |index: usize| arguments.get(index).and_then(Value::number).ok_or_else(wrong);
    if let Some((_, function)) = ONE_NUMBER.iter().find(|(known, _)| *known == name) {
        let [argument] = arguments else { return Err(wrong()) };
        let argument = argument.number().ok_or_else(wrong)?;
        let result = function(argument);
        return match result.is_nan() && !argument.is_nan() {
            true => Err(format!("{name}({argument}) has no value")),
            false => Ok(Value::Float(result)),
        };
    }
    Ok(match (name, arguments) {
        ("abs", [Value::Int(int)]) => Value::Int(int.checked_abs().ok_or_else(too_large)?),
        ("abs", [_]) => Value::Float(number(0)?.abs()),
        ("atan2", [_, _]) => Value::Float(number(0)?.atan2(number(1)?)),
        ("copysign", [_, _]) => Value::Float(number(0)?.copysign(number(1)?)),
        ("hypot", [_, _]) => Value::Float(number(0)?.hypot(number(1)?)),
        ("fmod", [_, _]) => Value::Float(number(0)? % number(1)?),
        ("log", [_]) => Value::Float(number(0)?.ln()),
        ("log", [_, _]) => Value::Float(number(0)?.log(number(1)?)),
        ("pow", [base, exponent]) => binary(Operator::Power, base, exponent)?,
        ("isnan", [_]) => Value::Bool(number(0)?.is_nan()),
        ("bool", [value]) => Value::Bool(value.truth()),
        ("str", [value]) => Value::text(&value.show()?),
        ("float", [Value::Text(text)]) => Value::Float(float(text).ok_or_else(|| not_a_number(text))?),
        ("float", [_]) => Value::Float(number(0)?),
        ("int", [Value::Text(text)]) => Value::Int(text.trim().parse().map_err(|_| not_a_number(text))?),
        ("int" | "trunc", [_]) => whole(number(0)?.trunc())?,
        ("floor", [_]) => whole(number(0)?.floor())?,
        ("ceil", [_]) => whole(number(0)?.ceil())?,
        ("round", [Value::Int(int)]) => Value::Int(*int),
        ("round", [_]) => whole(number(0)?.round_ties_even())?,
        ("round", [_, digits]) => {
            let digits = digits.int().filter(|digits| (0..=15).contains(digits)).ok_or_else(wrong)?;
            let digits = usize::try_from(digits).unwrap_or_default();
            Value::Float(float(&format!("{:.digits$}", number(0)?)).ok_or_else(wrong)?)
        }
        ("len", [Value::Text(text)]) => count(text.chars().count()),
        ("len", [Value::List(list)]) => count(list.len()),
        ("len", [Value::Map(map)]) => count(map.len()),
        ("list" | "tuple", []) => Value::List(Rc::default()),
        ("list" | "tuple", [value]) => Value::List(items(value).ok_or_else(wrong)?),
        ("set" | "frozenset", [value]) => {
            let mut all: Vec<Value> = Vec::new();
            for value in items(value).ok_or_else(wrong)?.iter().take(SET) {
                if !all.iter().any(|known| known.equals(value)) {
                    all.push(value.clone());
                }
            }
            Value::List(Rc::new(all))
        }
        ("enumerate", [value, start @ ..]) if start.len() <= 1 => {
            let start = start.first().map_or(Some(0), Value::int).ok_or_else(wrong)?;
            let all = items(value).ok_or_else(wrong)?;
            let pair =
                |(index, value): (i64, &Value)| pair(Value::Int(start.saturating_add(index)), value.clone());
            Value::List(Rc::new((0..).zip(all.iter()).map(pair).collect()))
        }
        ("zip", lists) => {
            let lists: Option<Vec<_>> = lists.iter().map(items).collect();
            let lists = lists.ok_or_else(wrong)?;
            let length = lists.iter().map(|list| list.len()).min().unwrap_or(0);
            let row = |index: usize| lists.iter().filter_map(|list| list.get(index).cloned()).collect();
            Value::List(Rc::new((0..length).map(|index| Value::List(Rc::new(row(index)))).collect()))
        }
        ("reversed", [value]) => {
            Value::List(Rc::new(items(value).ok_or_else(wrong)?.iter().rev().cloned().collect()))
        }
        ("divmod", [a, b]) => pair(binary(Operator::FloorDivide, a, b)?, binary(Operator::Modulo, a, b)?),
        ("isinstance", [value, Value::Function(kind)]) => Value::Bool(is_instance(value, kind)),
        ("isinstance", [value, Value::List(kinds)]) => Value::Bool(
            kinds.iter().any(|kind| matches!(kind, Value::Function(kind) if is_instance(value, kind))),
        ),
        ("isfinite", [_]) => Value::Bool(number(0)?.is_finite()),
        ("isinf", [_]) => Value::Bool(number(0)?.is_infinite()),
        ("isclose", [_, _]) => {
            let (a, b) = (number(0)?, number(1)?);
            Value::Bool(a == b || (a - b).abs() <= 1e-9 * a.abs().max(b.abs()))
        }
        ("prod", [value]) => {
            let all = items(value).ok_or_else(wrong)?;
            all.iter()
                .try_fold(Value::Int(1), |product, value| binary(Operator::Multiply, &product, value))?
        }
        ("fsum", [value]) => {
            let all = items(value).ok_or_else(wrong)?;
            let all: Option<Vec<f64>> = all.iter().map(Value::number).collect();
            Value::Float(all.ok_or_else(wrong)?.iter().sum())
        }
        ("gcd", [a, b]) => {
            let (mut a, mut b) = (a.int().ok_or_else(wrong)?, b.int().ok_or_else(wrong)?);
            while b != 0 {
                (a, b) = (b, a.checked_rem(b).ok_or_else(too_large)?);
            }
            Value::Int(a.checked_abs().ok_or_else(too_large)?)
        }
        ("factorial", [value]) => {
            let of = value.int().filter(|of| (0..=20).contains(of)).ok_or_else(too_large)?;
            Value::Int((1..=of).product())
        }
        ("ord", [Value::Text(text)]) if text.chars().count() == 1 => {
            Value::Int(text.chars().next().map_or(0, |c| i64::from(u32::from(c))))
        }
        ("repr", [value]) => {
            let text = Value::List(Rc::new(vec![value.clone()])).show()?;
            Value::text(text.get(1..text.len().saturating_sub(1)).unwrap_or_default())
        }
        ("range", [_] | [_, _] | [_, _, _]) => range(arguments).ok_or_else(wrong)?,
        ("sum", [value]) => {
            let all = items(value).ok_or_else(wrong)?;
            all.iter().try_fold(Value::Int(0), |sum, value| binary(Operator::Add, &sum, value))?
        }
        ("all", [value]) => Value::Bool(items(value).ok_or_else(wrong)?.iter().all(Value::truth)),
        ("any", [value]) => Value::Bool(items(value).ok_or_else(wrong)?.iter().any(Value::truth)),
        ("min" | "max", [value]) => most(name, &items(value).ok_or_else(wrong)?)?,
        ("min" | "max", [_, _, ..]) => most(name, arguments)?,
        _ if FUNCTIONS.contains(&name) => return Err(wrong()),
        _ => return Err(not_supported(&format!("the function {name}()"))),
    })
}

fn kinds(arguments: &[Value]) -> String {
    let kinds: Vec<&str> = arguments.iter().take(5).map(Value::kind).collect();
    if kinds.is_empty() { "nothing".to_owned() } else { kinds.join(", ") }
}

fn count(count: usize) -> Value {
    Value::Int(i64::try_from(count).unwrap_or(i64::MAX))
}

fn too_large() -> Fault {
    "a whole number is too large".to_owned()
}

fn not_a_number(text: &str) -> Fault {
    format!("{} is not a number", shown(text))
}

fn whole(float: f64) -> Result<Value, Fault> {
    if float.abs() < 9e15 { Ok(Value::Int(float as i64)) } else { Err(too_large()) }
}

/// Maximum number of values of a set: each is compared with each other one.
const SET: usize = 1_000;

fn pair(first: Value, second: Value) -> Value {
    Value::List(Rc::new(vec![first, second]))
}

/// Returns the keys and values of a dictionary, or of a list of pairs.
pub(crate) fn pairs(value: &Value) -> Option<Vec<(Value, Value)>> {
    if let Value::Map(map) = value {
        return Some(map.to_vec());
    }
    let Value::List(list) = value else { return None };
    list.iter()
        .map(|pair| match items(pair)?.as_slice() {
            [key, value] => Some((key.clone(), value.clone())),
            _ => None,
        })
        .collect()
}

fn is_instance(value: &Value, kind: &str) -> bool {
    matches!(
        (value, kind),
        (Value::Text(_), "str")
            | (Value::Int(_), "int")
            | (Value::Float(_), "float")
            | (Value::Bool(_), "bool" | "int")
            | (Value::List(_), "list" | "tuple" | "set")
            | (Value::Map(_), "dict")
    )
}

/// Returns the order of two values.
pub(crate) fn order(a: &Value, b: &Value) -> Result<std::cmp::Ordering, Fault> {
    if compare(Comparison::Less, a, b)? {
        return Ok(std::cmp::Ordering::Less);
    }
    Ok(if compare(Comparison::Less, b, a)? { std::cmp::Ordering::Greater } else { std::cmp::Ordering::Equal })
}

/// Returns a part of a list or a text, as Python's slices do.
pub(crate) fn slice(of: &Value, [first, end, step]: [Option<i64>; 3]) -> Result<Value, Fault> {
    let all = match of {
        Value::Map(_) => None,
        of => items(of),
    };
    let all = all.ok_or_else(|| format!("{} has no parts", of.kind()))?;
    let length = i64::try_from(all.len()).unwrap_or(i64::MAX);
    let step = step.unwrap_or(1);
    if step == 0 {
        return Err("the step of a slice is zero".to_owned());
    }
    let (lowest, highest) = if step > 0 { (0, length) } else { (-1, length - 1) };
    let bound = |bound: Option<i64>, default: i64| match bound {
        None => default,
        Some(at) if at < 0 => at.saturating_add(length).clamp(lowest, highest),
        Some(at) => at.clamp(lowest, highest),
    };
    let (start, stop) = if step > 0 { (0, length) } else { (length - 1, -1) };
    let (mut at, stop) = (bound(first, start), bound(end, stop));
    let mut part = Vec::new();
    while (step > 0 && at < stop) || (step < 0 && at > stop) {
        part.extend(usize::try_from(at).ok().and_then(|at| all.get(at)).cloned());
        at = at.saturating_add(step);
    }
    match of {
        Value::Text(_) => {
            let text: Result<Vec<String>, Fault> = part.iter().map(Value::show).collect();
            Ok(Value::text(&text?.concat()))
        }
        _ => Ok(Value::List(Rc::new(part))),
    }
}

/// Returns the entries that `for` iterates over.
pub(crate) fn items(value: &Value) -> Option<Rc<Vec<Value>>> {
    match value {
        Value::List(list) => Some(list.clone()),
        Value::Map(map) => Some(Rc::new(map.iter().map(|(key, _)| key.clone()).collect())),
        Value::Text(text) => {
            Some(Rc::new(text.chars().map(|c| Value::text(c.encode_utf8(&mut [0; 4]))).collect()))
        }
        _ => None,
    }
}

fn range(arguments: &[Value]) -> Option<Value> {
    let ints: Option<Vec<i64>> = arguments.iter().map(Value::int).collect();
    let (first, end, step) = match ints?.as_slice() {
        [end] => (0, *end, 1),
        [first, end] => (*first, *end, 1),
        [first, end, step] if *step != 0 => (*first, *end, *step),
        _ => return None,
    };
    let mut all = Vec::new();
    let mut next = first;
    while (step > 0 && next < end) || (step < 0 && next > end) {
        if all.len() >= limits::ENTRIES {
            return None;
        }
        all.push(Value::Int(next));
        next = next.checked_add(step)?;
    }
    Some(Value::List(Rc::new(all)))
}

fn most(name: &str, values: &[Value]) -> Result<Value, Fault> {
    let wanted = if name == "max" { Comparison::Greater } else { Comparison::Less };
    let (first, others) = values.split_first().ok_or_else(|| format!("{name}() of nothing"))?;
    others.iter().try_fold(first.clone(), |most, value| {
        Ok(if compare(wanted, value, &most)? { value.clone() } else { most })
    })
}

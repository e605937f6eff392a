//! The functions, operators and methods of Python that expressions may use.

mod format;

use std::f64::consts;
use std::rc::Rc;

use crate::error::{Fault, not_supported, shown};
use crate::expression::{Comparison, Operator};
use crate::limits;
use crate::value::{Value, find, float, put, too_long};

/// What a name means that no property has.
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

/// Functions from one number to a number.
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

/// Calls one of them.
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

/// Values that a set is made of at most: each is compared with each other one.
const SET: usize = 1_000;

fn pair(first: Value, second: Value) -> Value {
    Value::List(Rc::new(vec![first, second]))
}

/// Keys and values of a dictionary, or of a list of pairs.
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

/// How two values are ordered.
pub(crate) fn order(a: &Value, b: &Value) -> Result<std::cmp::Ordering, Fault> {
    if compare(Comparison::Less, a, b)? {
        return Ok(std::cmp::Ordering::Less);
    }
    Ok(if compare(Comparison::Less, b, a)? { std::cmp::Ordering::Greater } else { std::cmp::Ordering::Equal })
}

/// A part of a list or a text, as Python takes it.
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

/// Entries, as `for` goes through them.
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

/// One operator.
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
        return Err(format!("{} and {} cannot be computed with", a.kind(), b.kind()));
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
            return Err(format!("{} and {} have no bits to compute with", a.kind(), b.kind()));
        }
    };
    Ok(Value::Float(float))
}

/// One comparison.
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

/// As Python's `is`, where that does not depend on the objects: of None, truths, numbers and texts.
fn is_same(a: &Value, b: &Value) -> bool {
    std::mem::discriminant(a) == std::mem::discriminant(b) && a.equals(b)
}

fn contains(all: &Value, one: &Value) -> Result<bool, Fault> {
    match (all, one) {
        (Value::Text(all), Value::Text(one)) => Ok(all.contains(&**one)),
        (Value::List(all), one) => Ok(all.iter().any(|value| value.equals(one))),
        (Value::Map(all), one) => Ok(find(all, one).is_some()),
        _ => Err(format!("{} holds nothing that `in` could find", all.kind())),
    }
}

/// An entry of a list, a dictionary or a text.
pub(crate) fn index(of: &Value, index: &Value) -> Result<Value, Fault> {
    if let Value::Map(map) = of {
        let found = find(map, index).cloned();
        return found
            .ok_or_else(|| format!("the dictionary has no {}", shown(&index.show().unwrap_or_default())));
    }
    let all = items(of).ok_or_else(|| format!("{} has no entries", of.kind()))?;
    let at = index.int().ok_or_else(|| format!("{} is no index", index.kind()))?;
    let length = i64::try_from(all.len()).unwrap_or(i64::MAX);
    let from_start = if at < 0 { at.checked_add(length) } else { Some(at) };
    let found = from_start.and_then(|at| usize::try_from(at).ok()).and_then(|at| all.get(at));
    found.cloned().ok_or_else(|| format!("the index {at} is beyond {length} entries"))
}

/// A method, called.
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
            at.map(count).ok_or_else(|| "a list does not have the value that is looked for".to_owned())
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

//! Formats texts with `%`, as Python does.

use crate::error::{Fault, not_supported, shown};
use crate::limits;
use crate::value::{Value, find, too_long};

/// Formats such as `'%d %s %.3f' % (1, 'a', 2.0)`.
pub(super) fn percent(text: &str, values: &Value) -> Result<String, Fault> {
    let mut by_place = match values {
        Value::List(list) => list.to_vec(),
        value => vec![value.clone()],
    }
    .into_iter();
    let mut out = String::new();
    let mut rest = text;
    while let Some((plain, after)) = rest.split_once('%') {
        out.push_str(plain);
        if let Some(after) = after.strip_prefix('%') {
            out.push('%');
            rest = after;
            continue;
        }
        let (key, after) = match after.strip_prefix('(').and_then(|inner| inner.split_once(')')) {
            Some((key, after)) => (Some(key), after),
            None => (None, after),
        };
        let kind_at = after.find(|c: char| c.is_ascii_alphabetic());
        let (flags, behind) = after.split_at(kind_at.ok_or("a `%` in a text has no letter behind it")?);
        let mut chars = behind.chars();
        let kind = chars.next().unwrap_or('s');
        rest = chars.as_str();
        let value = match (key, values) {
            (Some(key), Value::Map(map)) => find(map, &Value::text(key)).cloned(),
            _ => by_place.next(),
        };
        let value = value.ok_or_else(|| format!("{} names more values than it is given", shown(text)))?;
        out.push_str(&one(flags, kind, &value)?);
        if out.len() > limits::VALUE_BYTES {
            return Err(too_long());
        }
    }
    out.push_str(rest);
    Ok(out)
}

fn one(flags: &str, kind: char, value: &Value) -> Result<String, Fault> {
    let (flags, precision) =
        flags.split_once('.').map_or((flags, None), |(flags, digits)| (flags, Some(digits)));
    let size = |text: &str| text.parse::<usize>().ok().filter(|size| *size <= 1_000);
    let precision = match precision {
        None => None,
        Some("") => Some(0),
        Some(digits) => {
            Some(size(digits).ok_or_else(|| not_supported(&format!("the precision {}", shown(digits))))?)
        }
    };
    let digits = flags.trim_start_matches(['-', '+', ' ', '0', '#']);
    let signs = flags.get(..flags.len() - digits.len()).unwrap_or_default();
    let width = if digits.is_empty() { Some(0) } else { size(digits) };
    let width = width.ok_or_else(|| not_supported(&format!("the width {}", shown(digits))))?;
    let number = || value.number().ok_or_else(|| format!("{} is not a number", value.kind()));
    let whole = || {
        let number = number()?.trunc();
        if number.abs() < 9e15 { Ok(number as i64) } else { Err("a whole number is too large".to_owned()) }
    };
    let text = match kind {
        'd' | 'i' | 'u' => whole()?.to_string(),
        'x' => format!("{:x}", whole()?),
        'X' => format!("{:X}", whole()?),
        'o' => format!("{:o}", whole()?),
        'f' | 'F' => format!("{:.*}", precision.unwrap_or(6), number()?),
        'g' | 'G' => general(number()?, precision.unwrap_or(6).max(1)),
        'e' | 'E' => exponential(number()?, precision.unwrap_or(6)),
        's' => value.show()?.chars().take(precision.unwrap_or(usize::MAX)).collect(),
        kind => return Err(not_supported(&format!("`%{kind}` in a text"))),
    };
    let is_number = kind != 's';
    let sign = if is_number && signs.contains('+') && !text.starts_with('-') { "+" } else { "" };
    let text = format!("{sign}{text}");
    Ok(if signs.contains('-') {
        format!("{text:<width$}")
    } else if is_number && signs.contains('0') {
        let (sign, digits) = text.split_at(usize::from(text.starts_with(['-', '+'])));
        format!("{sign}{digits:0>width$}", width = width.saturating_sub(sign.len()))
    } else {
        format!("{text:>width$}")
    })
}

fn exponential(number: f64, precision: usize) -> String {
    let text = format!("{number:.precision$e}");
    let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let (sign, exponent) = exponent.strip_prefix('-').map_or(('+', exponent), |size| ('-', size));
    format!("{digits}e{sign}{exponent:0>2}")
}

fn general(number: f64, precision: usize) -> String {
    if !number.is_finite() {
        return number.to_string().to_lowercase();
    }
    let text = exponential(number, precision - 1);
    let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let size = exponent.parse::<i64>().unwrap_or(0);
    let short = |digits: &str| match digits.contains('.') {
        true => digits.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => digits.to_owned(),
    };
    match usize::try_from(precision as i64 - 1 - size) {
        Ok(places) if size >= -4 => short(&format!("{number:.places$}")),
        _ => format!("{}e{exponent}", short(digits)),
    }
}

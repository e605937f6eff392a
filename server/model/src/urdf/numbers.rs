//! Numbers as people write them, with repairs.

use roxmltree::Node;

use super::findings::quoted;
use crate::limits;

/// Number of values of an attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// Exactly this many.
    Exactly(usize),
    /// One, which may be infinite for no limit.
    Bound,
    /// Red, green, blue, and alpha, which is optional.
    Color,
    /// Three, or one for all three.
    Scale,
}

/// Numbers of an attribute.
#[derive(Debug, PartialEq)]
pub(crate) struct Numbers {
    /// The values; the shape sets their number.
    pub(crate) values: Vec<f64>,
    /// Repair, as the end of a sentence after the attribute and its value.
    pub(crate) repair: Option<String>,
}

impl Shape {
    fn count(self) -> usize {
        match self {
            Self::Exactly(count) => count,
            Self::Bound => 1,
            Self::Color => 4,
            Self::Scale => 3,
        }
    }
}

/// Returns the numbers of an attribute that was already checked.
pub(crate) fn of<const N: usize>(node: Node, name: &str, shape: Shape) -> Option<[f64; N]> {
    read(node.attribute(name)?, shape).ok()?.values.try_into().ok()
}

/// Parses a value. The error is the end of a sentence after the attribute and its value.
pub(crate) fn read(value: &str, shape: Shape) -> Result<Numbers, String> {
    let (text, xacro) = match default_of_optenv(value) {
        Some(default) => (default, Some("is an unexpanded xacro expression: the default is used".to_owned())),
        None => (value, None),
    };
    if text.contains("${") || text.contains("$(") {
        return Err(
            "is an unexpanded xacro expression: load the .xacro file, or run xacro on it and load the result"
                .to_owned(),
        );
    }
    let words: Vec<&str> = text.split_whitespace().collect();
    let (values, separators) = match parsed(&words) {
        Ok(values) => (values, None),
        Err(word) => {
            let (values, how) = forgiven(text, &words, shape)
                .ok_or_else(|| format!("has a word that is not a number: {}", quoted(word)))?;
            (values, Some(how.to_owned()))
        }
    };
    check_range(&values, shape)?;
    let (values, counted) = fitted(values, shape)?;
    let repairs: Vec<String> = [xacro, separators, counted].into_iter().flatten().collect();
    let repair = (!repairs.is_empty()).then(|| repairs.join(", and "));
    Ok(Numbers { values, repair })
}

/// Parses all words as numbers, or returns the first invalid one.
fn parsed<'w>(words: &[&'w str]) -> Result<Vec<f64>, &'w str> {
    words.iter().map(|word| word.parse().map_err(|_not_a_number| *word)).collect()
}

/// Returns the default of `$(optenv NAME 1 2 3)`, which refers to an environment variable of another machine.
fn default_of_optenv(value: &str) -> Option<&str> {
    let inside = value.trim().strip_prefix("$(optenv")?.strip_suffix(')')?;
    let (_, default) = inside.trim_start().split_once(char::is_whitespace)?;
    Some(default)
}

/// Accepts commas between numbers or instead of decimal points, and extra points: the reading that gives the
/// required number of values.
fn forgiven(text: &str, words: &[&str], shape: Shape) -> Option<(Vec<f64>, &'static str)> {
    let separated = |c: char| c.is_whitespace() || c == ',' || c == ';';
    let between: Vec<&str> = text.split(separated).filter(|word| !word.is_empty()).collect();
    if between.len() == shape.count()
        && let Ok(values) = parsed(&between)
    {
        return Some((values, "has commas between its numbers: read as spaces"));
    }
    // `-1.57.`, as C reads it.
    let shorter: Vec<&str> = words.iter().map(|word| word.strip_suffix('.').unwrap_or(word)).collect();
    if shorter.len() == shape.count()
        && let Ok(values) = parsed(&shorter)
    {
        return Some((values, "has more than one decimal point: read without the last"));
    }
    let points: Vec<String> = words.iter().map(|word| word.replace(',', ".")).collect();
    let points: Vec<&str> = points.iter().map(String::as_str).collect();
    let values = parsed(&points).ok().filter(|values| values.len() == shape.count())?;
    Some((values, "has commas for decimal points: read as points"))
}

fn check_range(values: &[f64], shape: Shape) -> Result<(), String> {
    let most = limits::MAGNITUDE;
    for value in values {
        let bounded = value.abs() <= most;
        if value.is_nan() || (!value.is_finite() && shape != Shape::Bound) {
            return Err("is not finite".to_owned());
        }
        if !bounded && shape != Shape::Bound {
            return Err(format!("is beyond the range of simd; the limit is {most:e}"));
        }
    }
    Ok(())
}

/// Returns the intended numbers if there are too many or too few.
fn fitted(mut values: Vec<f64>, shape: Shape) -> Result<(Vec<f64>, Option<String>), String> {
    let (found, count) = (values.len(), shape.count());
    if found == count {
        if shape == Shape::Bound {
            // Larger bounds than simd computes with mean no limit.
            let beyond = values.iter_mut().filter(|value| value.abs() > limits::MAGNITUDE);
            beyond.for_each(|value| *value = f64::INFINITY.copysign(*value));
        }
        return Ok((values, None));
    }
    if found > count {
        values.truncate(count);
        let used =
            if count == 1 { "the first is used".to_owned() } else { format!("the first {count} are used") };
        let wanted = if count == 1 { "one".to_owned() } else { count.to_string() };
        return Ok((values, Some(format!("is {found} numbers instead of {wanted}: {used}"))));
    }
    match (shape, values.as_slice()) {
        (Shape::Color, [_, _, _]) => {
            values.push(1.0);
            Ok((values, Some("has no alpha: 1 is used".to_owned())))
        }
        (Shape::Scale, [all]) => {
            let all = *all;
            Ok((vec![all; 3], Some("is one number: it is used for all three axes".to_owned())))
        }
        _ if count == 1 => Err(format!("is {found} numbers instead of one")),
        _ => Err(format!("is {found} number{} instead of {count}", if found == 1 { "" } else { "s" })),
    }
}

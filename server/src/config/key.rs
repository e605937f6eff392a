//! One key of the configuration: its name, type, and destination.

use std::fmt::Write as _;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::Duration;

use super::draft::Draft;

/// End of a range that no machine reaches.
pub(super) const MANY: u64 = 1 << 40;

/// One key of the configuration. The flag, the environment variable, the configuration file and the documents
/// are all made from these.
pub(super) struct Key {
    /// Path in the file: `physics.time_step`.
    pub(super) path: &'static str,
    /// Meaning with units, as one line of Markdown.
    pub(super) meaning: &'static str,
    /// Flag of the key, without hyphens. Every key can also be set by `--set`.
    pub(super) flag: Option<&'static str>,
    /// Example in TOML, for a key without a default.
    pub(super) example: &'static str,
    pub(super) access: Access,
}

type Get<T> = fn(&Draft) -> T;
type Set<T> = fn(&mut Draft, T) -> Result<(), String>;

/// Type of a key, with access to its value.
pub(super) enum Access {
    Switch(Get<bool>, fn(&mut Draft, bool)),
    Count(RangeInclusive<u64>, fn(&mut Draft) -> &mut dyn Whole),
    Seconds(RangeInclusive<f64>, fn(&mut Draft) -> &mut Duration),
    Number(RangeInclusive<f64>, Get<f64>, Set<f64>),
    /// Three components.
    Vector(Get<[f64; 3]>, Set<[f64; 3]>),
    /// One of some words.
    Word(&'static [&'static str], Get<&'static str>, Set<String>),
    Text(Get<String>, Set<String>),
    File(fn(&mut Draft) -> &mut Option<PathBuf>),
    Texts(Get<Vec<String>>, Set<Vec<String>>),
    Files(Get<Vec<PathBuf>>, Set<Vec<PathBuf>>),
    Counts(RangeInclusive<u64>, Get<Vec<u64>>, Set<Vec<u64>>),
}

/// A whole number of any width.
pub(super) trait Whole {
    fn get(&self) -> u64;
    /// Sets the number, which is within the range of its key and fits its type.
    fn set(&mut self, value: u64);
}

macro_rules! whole {
    ($($number:ty),*) => {$(
        impl Whole for $number {
            fn get(&self) -> u64 {
                u64::try_from(*self).unwrap_or(u64::MAX)
            }
            fn set(&mut self, value: u64) {
                *self = Self::try_from(value).unwrap_or(Self::MAX);
            }
        }
    )*};
}
whole!(u32, u64, usize);

/// A given value, before its key checks it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Switch(bool),
    Whole(i128),
    Number(f64),
    Text(String),
    List(Vec<Self>),
    /// A value that no key accepts, by its name in TOML.
    Other(&'static str),
}

impl std::fmt::Display for Value {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Switch(value) => write!(formatter, "{value}"),
            Self::Whole(value) => write!(formatter, "{value}"),
            Self::Number(value) => write!(formatter, "{value}"),
            Self::Text(text) => write!(formatter, "{}", quoted(text)),
            Self::List(values) => {
                let values: Vec<String> = values.iter().map(Self::to_string).collect();
                write!(formatter, "[{}]", values.join(", "))
            }
            Self::Other(kind) => formatter.write_str(kind),
        }
    }
}

impl Key {
    pub(super) const fn new(path: &'static str, meaning: &'static str, access: Access) -> Self {
        Self { path, meaning, flag: None, example: "", access }
    }

    pub(super) const fn flag(self, flag: &'static str) -> Self {
        Self { flag: Some(flag), ..self }
    }

    pub(super) const fn example(self, example: &'static str) -> Self {
        Self { example, ..self }
    }

    /// Returns the variable: `SIMD_PHYSICS_TIME_STEP`.
    pub(super) fn variable(&self) -> String {
        format!("SIMD_{}", self.path.replace('.', "_").to_ascii_uppercase())
    }

    /// Returns the key's table in the file, and its name there.
    pub(super) fn table_and_name(&self) -> (&'static str, &'static str) {
        self.path.rsplit_once('.').unwrap_or(("", self.path))
    }

    /// Returns whether the flag takes no value.
    pub(super) fn is_switch(&self) -> bool {
        matches!(self.access, Access::Switch(..))
    }

    /// Returns whether the flag may be repeated.
    pub(super) fn is_list(&self) -> bool {
        matches!(self.access, Access::Texts(..) | Access::Files(..) | Access::Counts(..))
    }

    /// Returns the placeholder of the value in the help.
    pub(super) fn value_name(&self) -> &'static str {
        match &self.access {
            Access::Switch(..) => "SWITCH",
            Access::Count(..) | Access::Number(..) => "NUMBER",
            Access::Seconds(..) => "SECONDS",
            Access::Vector(..) => "X,Y,Z",
            Access::Word(..) => "WORD",
            Access::Text(..) | Access::Texts(..) => "TEXT",
            Access::File(_) | Access::Files(..) => "PATH",
            Access::Counts(..) => "NUMBERS",
        }
    }

    /// Returns the accepted values, in words.
    pub(super) fn takes(&self) -> String {
        match &self.access {
            Access::Switch(..) => "true or false".into(),
            Access::Count(range, _) if *range.end() >= MANY => format!("{} or more", range.start()),
            Access::Count(range, _) => format!("{} to {}", range.start(), range.end()),
            Access::Seconds(range, _) => format!("{} to {} seconds", range.start(), range.end()),
            Access::Number(range, ..) => format!("{} to {}", range.start(), range.end()),
            Access::Vector(..) => "three numbers".into(),
            Access::Word(words, ..) => words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" or "),
            Access::Text(..) => "text".into(),
            Access::File(_) => "path".into(),
            Access::Texts(..) => "list of texts".into(),
            Access::Files(..) => "list of paths".into(),
            Access::Counts(range, ..) => format!("list of {} to {}", range.start(), range.end()),
        }
    }

    /// Returns the configured value in TOML; `None` if there is none.
    pub(super) fn value(&self, draft: &mut Draft) -> Option<String> {
        let list = |values: Vec<String>| Some(format!("[{}]", values.join(", ")));
        match &self.access {
            Access::Switch(get, _) => Some(get(draft).to_string()),
            Access::Count(_, field) => Some(field(draft).get().to_string()),
            Access::Seconds(_, field) => Some(number(field(draft).as_secs_f64())),
            Access::Number(_, get, _) => Some(number(get(draft))),
            Access::Vector(get, _) => list(get(draft).map(number).to_vec()),
            Access::Word(_, get, _) => Some(quoted(get(draft))),
            Access::Text(get, _) => Some(quoted(&get(draft))),
            Access::File(field) => field(draft).as_ref().map(|path| quoted(&path.display().to_string())),
            Access::Texts(get, _) => list(get(draft).iter().map(|text| quoted(text)).collect()),
            Access::Files(get, _) => {
                list(get(draft).iter().map(|path| quoted(&path.display().to_string())).collect())
            }
            Access::Counts(_, get, _) => list(get(draft).iter().map(u64::to_string).collect()),
        }
        .filter(|value| value != "[]" || self.example.is_empty())
    }

    /// Parses the text of a flag or a variable. The error is a sentence without its subject.
    pub(super) fn parse(&self, text: &str) -> Result<Value, String> {
        let wrong = || format!("must be {}, and not {}", self.takes_one(), quoted(text));
        let whole = |text: &str| text.trim().parse().map(Value::Whole).map_err(|_error| wrong());
        let float = |text: &str| text.trim().parse().map(Value::Number).map_err(|_error| wrong());
        Ok(match &self.access {
            Access::Switch(..) => match text.trim() {
                "true" | "1" | "yes" | "on" => Value::Switch(true),
                "false" | "0" | "no" | "off" => Value::Switch(false),
                _ => return Err(wrong()),
            },
            Access::Count(..) => whole(text)?,
            Access::Seconds(..) | Access::Number(..) => float(text)?,
            Access::Vector(..) => Value::List(text.split(',').map(float).collect::<Result<_, _>>()?),
            Access::Word(..) | Access::Text(..) | Access::File(_) => Value::Text(text.into()),
            Access::Texts(..) | Access::Files(..) => {
                let parts = text.split(',').map(str::trim).filter(|part| !part.is_empty());
                Value::List(parts.map(|part| Value::Text(part.into())).collect())
            }
            Access::Counts(..) => Value::List(text.split(',').map(whole).collect::<Result<_, _>>()?),
        })
    }

    fn takes_one(&self) -> String {
        match &self.access {
            Access::Vector(..) => "three numbers with commas, for instance 0,0,-9.81".into(),
            Access::Count(..) => "a whole number, 0 or more".into(),
            Access::Counts(..) => "whole numbers with commas".into(),
            Access::Number(..) | Access::Seconds(..) => "a number".into(),
            _ => self.takes(),
        }
    }

    /// Sets a value in the configuration. The error is a sentence that names the key.
    pub(super) fn set(&self, draft: &mut Draft, value: Value) -> Result<(), String> {
        let path = self.path;
        let wrong = |value: &Value| {
            let kind = match &self.access {
                Access::Vector(..) => "three numbers".into(),
                Access::Count(..) => "a whole number, 0 or more".into(),
                Access::Number(..) | Access::Seconds(..) => "a number".into(),
                _ => self.takes(),
            };
            format!("{path} is {value}; it must be {kind}")
        };
        let outside =
            |value: &dyn std::fmt::Display, least: &dyn std::fmt::Display, most: &dyn std::fmt::Display| {
                format!("{path} is {value}; it must be between {least} and {most}")
            };
        let count = |range: &RangeInclusive<u64>, value: &Value| match value {
            Value::Whole(whole) => u64::try_from(*whole)
                .ok()
                .filter(|count| range.contains(count))
                .ok_or_else(|| outside(whole, range.start(), range.end())),
            _ => Err(wrong(value)),
        };
        match (&self.access, &value) {
            (Access::Switch(_, set), Value::Switch(switch)) => {
                set(draft, *switch);
                Ok(())
            }
            (Access::Count(range, field), _) => {
                field(draft).set(count(range, &value)?);
                Ok(())
            }
            (Access::Seconds(range, field), _) => {
                let seconds = value.number().ok_or_else(|| wrong(&value))?;
                if !range.contains(&seconds) {
                    return Err(outside(&seconds, range.start(), range.end()));
                }
                *field(draft) = Duration::from_secs_f64(seconds);
                Ok(())
            }
            (Access::Number(range, _, set), _) => {
                let number = value.number().ok_or_else(|| wrong(&value))?;
                if !range.contains(&number) {
                    return Err(outside(&number, range.start(), range.end()));
                }
                set(draft, number)
            }
            (Access::Vector(_, set), Value::List(parts)) => {
                let numbers: Option<Vec<f64>> = parts.iter().map(Value::number).collect();
                match numbers.as_deref() {
                    Some(&[x, y, z]) => set(draft, [x, y, z]),
                    Some(_) | None => Err(wrong(&value)),
                }
            }
            (Access::Word(words, _, set), Value::Text(text)) if words.contains(&text.as_str()) => {
                set(draft, text.clone())
            }
            (Access::Text(_, set), Value::Text(text)) => set(draft, text.clone()),
            (Access::File(field), Value::Text(text)) if !text.is_empty() => {
                *field(draft) = Some(draft.folder.join(text));
                Ok(())
            }
            (Access::Texts(_, set), Value::List(parts)) => {
                set(draft, texts(parts).ok_or_else(|| wrong(&value))?)
            }
            (Access::Files(_, set), Value::List(parts)) => {
                let texts = texts(parts).ok_or_else(|| wrong(&value))?;
                let paths = texts.iter().map(|text| draft.folder.join(text)).collect();
                set(draft, paths)
            }
            (Access::Counts(range, _, set), Value::List(parts)) => {
                set(draft, parts.iter().map(|part| count(range, part)).collect::<Result<_, _>>()?)
            }
            _ => Err(wrong(&value)),
        }
    }
}

impl Value {
    fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            // Exact for all sensible values of a configuration.
            #[expect(clippy::cast_precision_loss)]
            Self::Whole(whole) => Some(*whole as f64),
            _ => None,
        }
    }
}

fn texts(values: &[Value]) -> Option<Vec<String>> {
    let text = |value: &Value| match value {
        Value::Text(text) => Some(text.clone()),
        _ => None,
    };
    values.iter().map(text).collect()
}

fn number(number: f64) -> String {
    number.to_string()
}

/// Quotes a text for TOML.
pub(super) fn quoted(text: &str) -> String {
    let mut quoted = String::from('"');
    for character in text.chars() {
        match character {
            '"' | '\\' => quoted.extend(['\\', character]),
            character if character.is_control() => {
                // Writing to a string does not fail.
                let _ = write!(quoted, "\\u{:04X}", u32::from(character));
            }
            character => quoted.push(character),
        }
    }
    quoted + "\""
}

//! Paths of fields in a request, and refusals of their values.

use std::collections::BTreeSet;
use std::fmt;
use std::ops::RangeInclusive;
use std::time::Duration;

use simd_model::shown;

use simd_world::info::MAX_NAME_BYTES;

/// Refusal of a field's value.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field}{of} is {value}; {expected}")]
pub struct BadField {
    /// Path of the field, for instance `robots[0].joints[2].position.position`.
    pub field: String,
    /// Owner of the field, for people: ` (joint "elbow")`, or empty.
    pub of: String,
    /// Given value.
    pub value: String,
    /// Accepted values, as "it must be ...".
    pub expected: String,
}

/// Position of a value in a request. It allocates nothing until it is formatted.
#[derive(Clone, Copy, Debug)]
pub struct Path<'a> {
    parent: Option<&'a Path<'a>>,
    part: Part<'a>,
}

#[derive(Clone, Copy, Debug)]
enum Part<'a> {
    Root,
    Field(&'a str),
    Item(&'a str, usize),
    Entry(&'a str, &'a str),
}

impl<'a> Path<'a> {
    /// Path of the request.
    pub const ROOT: Path<'static> = Path { parent: None, part: Part::Root };

    /// Returns the path of the field `name`.
    pub fn field(&'a self, name: &'a str) -> Self {
        Self { parent: Some(self), part: Part::Field(name) }
    }

    /// Returns the path of `name[index]`.
    pub fn item(&'a self, name: &'a str, index: usize) -> Self {
        Self { parent: Some(self), part: Part::Item(name, index) }
    }

    /// Returns the path of `name["key"]`.
    pub fn entry(&'a self, name: &'a str, key: &'a str) -> Self {
        Self { parent: Some(self), part: Part::Entry(name, key) }
    }

    /// Returns the refusal of the value at this path.
    pub fn refuse(&self, value: impl fmt::Display, expected: impl Into<String>) -> BadField {
        BadField {
            field: self.to_string(),
            of: String::new(),
            value: shown(value),
            expected: expected.into(),
        }
    }

    /// Returns a value that must be given.
    pub fn given<T>(&self, value: Option<T>) -> Result<T, BadField> {
        value.ok_or_else(|| self.refuse("not given", "it must be given"))
    }

    /// Accepts a number that is neither NaN nor infinite.
    pub fn finite(&self, value: f64) -> Result<f64, BadField> {
        if value.is_finite() { Ok(value) } else { Err(self.refuse(value, "it must be finite")) }
    }

    /// Accepts a number in a range.
    pub fn within(&self, value: f64, range: RangeInclusive<f64>) -> Result<f64, BadField> {
        if range.contains(&value) {
            Ok(value)
        } else {
            Err(self.refuse(value, format!("it must be between {} and {}", range.start(), range.end())))
        }
    }

    /// Accepts a finite number that is not negative.
    pub fn at_least_zero(&self, value: f64) -> Result<f64, BadField> {
        if value >= 0.0 && value.is_finite() {
            Ok(value)
        } else {
            Err(self.refuse(value, "it must be finite and at least 0"))
        }
    }

    /// Returns wall seconds within a range; 0 selects the default.
    pub fn seconds(
        &self,
        value: f64,
        range: RangeInclusive<f64>,
        default: f64,
    ) -> Result<Duration, BadField> {
        let seconds = if value == 0.0 { default } else { self.within(value, range)? };
        Duration::try_from_secs_f64(seconds).map_err(|error| self.refuse(seconds, error.to_string()))
    }

    /// Accepts a name of permitted length, which may not be empty.
    pub fn name(&self, value: String) -> Result<String, BadField> {
        if value.is_empty() {
            return Err(self.refuse("empty", "it must be a name"));
        }
        self.short(value)
    }

    /// Accepts text of permitted length, which may be empty.
    pub fn short(&self, value: String) -> Result<String, BadField> {
        if value.len() > MAX_NAME_BYTES {
            let expected = format!("it must have at most {MAX_NAME_BYTES}");
            return Err(self.refuse(format_args!("{} bytes long", value.len()), expected));
        }
        Ok(value)
    }

    /// Refuses a list that names the same thing twice.
    pub fn each_once<K: Ord + fmt::Debug>(
        &self,
        list: &str,
        keys: impl IntoIterator<Item = K>,
    ) -> Result<(), BadField> {
        let mut seen = BTreeSet::new();
        for (index, key) in keys.into_iter().enumerate() {
            if seen.contains(&key) {
                let value = format!("{key:?} again");
                return Err(self.item(list, index).refuse(value, "it must be named once"));
            }
            seen.insert(key);
        }
        Ok(())
    }

    /// Returns the value of an enum that this daemon knows.
    pub fn known<E: TryFrom<i32>>(&self, number: i32) -> Result<E, BadField> {
        E::try_from(number).map_err(|_unknown| {
            self.refuse(number, "it must be one of the numbers that the schema gives this enum")
        })
    }
}

impl fmt::Display for Path<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(parent) = self.parent {
            parent.fmt(f)?;
            if !matches!(parent.part, Part::Root) {
                f.write_str(".")?;
            }
        }
        match self.part {
            Part::Root => Ok(()),
            Part::Field(name) => f.write_str(name),
            Part::Item(name, index) => write!(f, "{name}[{index}]"),
            Part::Entry(name, key) => write!(f, "{name}[{key:?}]"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_reads_as_a_client_would_write_it() {
        let robot = Path::ROOT.item("robots", 0);
        let joint = robot.item("joints", 2);
        let target = joint.field("position");
        assert_eq!(target.field("position").to_string(), "robots[0].joints[2].position.position");
        assert_eq!(Path::ROOT.entry("joint_positions", "a b").to_string(), "joint_positions[\"a b\"]");
    }

    #[test]
    fn numbers_that_cannot_be_are_refused_by_name() {
        let at = Path::ROOT.field("x");
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(at.finite(bad).unwrap_err().field, "x");
            assert!(at.at_least_zero(bad).is_err());
            assert!(at.within(bad, 0.0..=1.0).is_err());
            assert!(at.seconds(bad, 0.0..=60.0, 1.0).is_err());
        }
        assert!(at.at_least_zero(-1e-9).is_err());
        assert_eq!(at.seconds(0.0, 0.1..=60.0, 1.0), Ok(Duration::from_secs(1)));
        assert_eq!(at.within(2.0, 0.0..=1.0).unwrap_err().to_string(), "x is 2; it must be between 0 and 1");
    }

    #[test]
    fn names_are_neither_empty_nor_endless() {
        let at = Path::ROOT.field("robot");
        assert_eq!(at.name(String::new()).unwrap_err().to_string(), "robot is empty; it must be a name");
        assert!(at.name("x".repeat(MAX_NAME_BYTES)).is_ok());
        assert!(at.name("x".repeat(MAX_NAME_BYTES + 1)).is_err());
    }
}

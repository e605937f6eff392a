//! Sliders and buttons that programs put up and people move: no part of the
//! world, so that no step, reset or saved state knows of them.

mod share;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use simd_proto::text::{is_printable, printable};
use tokio::sync::Notify;

use super::{CallError, JointBinding, Owner, SimHandle};

/// Longest name, in bytes.
const MAX_NAME: usize = 256;

/// Something to move or to press.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Unique; 1 to 256 bytes of visible characters.
    pub name: Arc<str>,
    /// What it is, and where it stands.
    pub kind: ParameterKind,
    /// Of the list when it last changed.
    pub version: u64,
    /// Who put it up.
    pub owner: Owner,
    /// Of a slider: the joint whose target it sets.
    pub binding: Option<Arc<JointBinding>>,
}

/// What a parameter is, and where it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterKind {
    /// A number between two others.
    Slider {
        /// Finite.
        minimum: f64,
        /// Finite, above `minimum`.
        maximum: f64,
        /// Not beyond either.
        value: f64,
    },
    /// Something to press.
    Button {
        /// How often it was.
        presses: u64,
    },
}

/// All parameters, in the order in which they were added.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterList {
    /// 1 before anything was added; grows with every change.
    pub version: u64,
    /// What there is.
    pub parameters: Vec<Parameter>,
}

/// What adding does where the name is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NameTaken {
    /// Refuse.
    Refuse,
    /// Replace the old one.
    Replace,
    /// Add `_1`, `_2`, ... to the name.
    Rename,
}

/// A change of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterChange {
    /// Moves a slider.
    Move {
        /// Its name.
        name: String,
        /// Within its range.
        value: f64,
    },
    /// Presses a button.
    Press {
        /// Its name.
        name: String,
        /// How often.
        times: u64,
    },
}

/// All parameters, for any number of readers and writers; newest wins.
#[derive(Debug)]
pub(super) struct Parameters {
    /// Held for a look or a change, never across a wait.
    newest: Mutex<Arc<ParameterList>>,
    changed: Notify,
    limit: usize,
}

impl Parameters {
    /// None yet, and never more than `limit`.
    pub(super) fn new(limit: u32) -> Self {
        let none = ParameterList { version: 1, parameters: Vec::new() };
        let limit = usize::try_from(limit).unwrap_or(usize::MAX);
        Self { newest: Mutex::new(Arc::new(none)), changed: Notify::new(), limit }
    }

    fn newest(&self) -> Arc<ParameterList> {
        self.lock().clone()
    }

    /// The list once it is not of this version. Another and not a newer one: a
    /// version from before a restart of the daemon may lie ahead.
    async fn other_than(&self, version: u64) -> Arc<ParameterList> {
        loop {
            // Made before the look, so that a change between look and wait wakes it.
            let changed = self.changed.notified();
            let newest = self.newest();
            if newest.version != version {
                return newest;
            }
            changed.await;
        }
    }

    /// Changes a copy, which becomes the list where the change says so: all of it or nothing.
    fn change<T>(
        &self,
        change: impl FnOnce(&mut ParameterList) -> Result<(T, bool), CallError>,
    ) -> Result<T, CallError> {
        let mut newest = self.lock();
        let mut next = ParameterList { version: newest.version + 1, ..ParameterList::clone(&newest) };
        let (answer, is_other) = change(&mut next)?;
        if is_other {
            *newest = Arc::new(next);
            drop(newest);
            self.changed.notify_waiters();
        }
        Ok(answer)
    }

    fn lock(&self) -> MutexGuard<'_, Arc<ParameterList>> {
        self.newest.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl SimHandle {
    /// All parameters, at once.
    pub fn parameters(&self) -> Arc<ParameterList> {
        self.inner.parameters.newest()
    }

    /// All parameters once their version is another than `version`; after
    /// `timeout`, those that there are.
    ///
    /// # Errors
    /// Returns an error if the daemon drains before that, or the driver failed.
    pub async fn next_parameters(
        &self,
        version: u64,
        timeout: Option<Duration>,
    ) -> Result<Arc<ParameterList>, CallError> {
        let other = self.until_drained(self.inner.parameters.other_than(version));
        let Some(timeout) = timeout else { return other.await };
        match tokio::time::timeout(timeout, other).await {
            Ok(other) => other,
            Err(_elapsed) => Ok(self.parameters()),
        }
    }

    /// Puts up a slider or a button. A slider's value beyond its range becomes the
    /// nearest end of it. Answers with what it is now.
    ///
    /// # Errors
    /// Returns an error if the name cannot be or is taken, also by another's parameter that would be replaced, where a number is not
    /// finite or the range is empty, and where there are as many as there may be, in all or of this client.
    pub fn add_parameter(
        &self,
        name: &str,
        kind: ParameterKind,
        taken: NameTaken,
    ) -> Result<Parameter, CallError> {
        self.put_up(name, kind, None, taken)
    }

    pub(super) fn put_up(
        &self,
        name: &str,
        kind: ParameterKind,
        binding: Option<Arc<JointBinding>>,
        taken: NameTaken,
    ) -> Result<Parameter, CallError> {
        check_name(name)?;
        let kind = checked(name, kind)?;
        let limit = self.inner.parameters.limit;
        self.inner.parameters.change(|list| {
            let (version, owner) = (list.version, self.owner());
            let added = |name: &str| Parameter { name: name.into(), kind, version, owner, binding };
            let is_taken = match (list.index_of(name), taken) {
                (Some(_), NameTaken::Refuse) => {
                    return Err(CallError::ParameterExists { name: name.to_owned() });
                }
                (Some(index), NameTaken::Replace) => {
                    self.check_parameter(&list.parameters[index])?;
                    return self.insert_parameter(list, Some(index), added(name));
                }
                (found, _) => found.is_some(),
            };
            // Before a name is looked for, for which all others wait.
            if list.parameters.len() >= limit {
                return Err(CallError::LimitExceeded {
                    what: "the number of parameters".into(),
                    value: limit as u64 + 1,
                    limit: limit as u64,
                });
            }
            let added = if is_taken { added(&list.free_name(name)?) } else { added(name) };
            self.insert_parameter(list, None, added)
        })
    }

    /// Moves sliders and presses buttons: all or none, and without the joints that sliders are bound to. Answers with those that
    /// were named, as they are now. To move a slider to where it is changes nothing.
    ///
    /// # Errors
    /// Returns an error if there is no such parameter, where it is of the other kind, and where a
    /// value lies beyond the range.
    pub fn set_parameters(&self, changes: &[ParameterChange]) -> Result<Vec<Parameter>, CallError> {
        self.inner.parameters.change(|list| {
            let version = list.version;
            let mut is_other = false;
            let mut set = Vec::with_capacity(changes.len());
            for (index, change) in changes.iter().enumerate() {
                let found = list.find_index(change.name())?;
                let parameter = &mut list.parameters[found];
                let kind = checked_change(parameter, change, index)?;
                if kind != parameter.kind {
                    *parameter = Parameter { kind, version, ..parameter.clone() };
                    is_other = true;
                }
                set.push(parameter.clone());
            }
            Ok((set, is_other))
        })
    }

    /// Takes parameters down, all that are not another's where none is named. Answers with the
    /// names of those that are gone.
    ///
    /// # Errors
    /// Returns an error if there is no parameter of one of the names, or it is another's; then none is gone.
    pub fn remove_parameters(&self, names: &[String]) -> Result<Vec<String>, CallError> {
        self.inner.parameters.change(|list| {
            if names.is_empty() {
                let gone = list.parameters.extract_if(.., |it| self.owns(&it.owner));
                let gone: Vec<String> = gone.map(|it| it.name.to_string()).collect();
                let is_other = !gone.is_empty();
                return Ok((gone, is_other));
            }
            for name in names {
                let index = list.find_index(name)?;
                self.check_parameter(&list.parameters[index])?;
                list.parameters.remove(index);
            }
            Ok((names.to_vec(), true))
        })
    }

    fn check_parameter(&self, parameter: &Parameter) -> Result<(), CallError> {
        self.check_owner(|| format!("parameter {:?}", parameter.name), &parameter.owner)
    }
}

impl ParameterList {
    /// The parameter of that name.
    ///
    /// # Errors
    /// Returns an error if there is none.
    pub fn find(&self, name: &str) -> Result<&Parameter, CallError> {
        self.parameters.iter().find(|it| &*it.name == name).ok_or_else(|| self.not_found(name))
    }

    fn find_index(&self, name: &str) -> Result<usize, CallError> {
        self.index_of(name).ok_or_else(|| self.not_found(name))
    }

    fn index_of(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|it| &*it.name == name)
    }

    fn not_found(&self, name: &str) -> CallError {
        let known = self.parameters.iter().map(|it| it.name.to_string()).collect();
        CallError::ParameterNotFound { name: name.to_owned(), known }
    }

    /// A taken name with the smallest number that makes it free.
    fn free_name(&self, name: &str) -> Result<String, CallError> {
        // Once through all names: thousands may have one and its numbers, of which one up to their count is free.
        let mut taken = vec![false; self.parameters.len() + 1];
        for number in self.parameters.iter().filter_map(|it| number_of(&it.name, name)) {
            if let Some(taken) = taken.get_mut(number) {
                *taken = true;
            }
        }
        let free = taken.iter().skip(1).take_while(|taken| **taken).count() + 1;
        let free = format!("{name}_{free}");
        check_name(&free)?;
        Ok(free)
    }
}

/// The number after a name and an underscore, as it is written there; 0 is none.
fn number_of(other: &str, name: &str) -> Option<usize> {
    let number = other.strip_prefix(name)?.strip_prefix('_')?;
    let is_plain = number.starts_with(|first: char| ('1'..='9').contains(&first));
    number.parse().ok().filter(|_| is_plain)
}

impl ParameterChange {
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Move { name, value: _ } | Self::Press { name, times: _ } => name,
        }
    }
}

/// People read names, in terminals too.
fn check_name(name: &str) -> Result<(), CallError> {
    let refuse = |value: String, expected: &str| {
        let (element, expected) = ("parameter.name".into(), expected.into());
        Err(CallError::InvalidValue { element, value, expected })
    };
    if name.is_empty() || name.len() > MAX_NAME {
        return refuse(format!("{} bytes long", name.len()), "it must have 1 to 256");
    }
    if !name.chars().all(is_printable) {
        return refuse(format!("\"{}\"", printable(name)), "all of its characters must be visible");
    }
    Ok(())
}

/// With the value within the range.
fn checked(name: &str, kind: ParameterKind) -> Result<ParameterKind, CallError> {
    let ParameterKind::Slider { minimum, maximum, value } = kind else { return Ok(kind) };
    let refuse = |what: &str, number: f64, expected: String| CallError::InvalidValue {
        element: format!("parameter.slider.{what}"),
        value: number.to_string(),
        expected: format!("{expected} (parameter {name:?})"),
    };
    for (what, number) in [("minimum", minimum), ("maximum", maximum), ("value", value)] {
        if !number.is_finite() {
            return Err(refuse(what, number, "it must be finite".into()));
        }
    }
    if minimum >= maximum {
        return Err(refuse("maximum", maximum, format!("it must be above the minimum, {minimum}")));
    }
    Ok(ParameterKind::Slider { minimum, maximum, value: value.clamp(minimum, maximum) })
}

/// What a parameter is after the change at this index of a request.
pub(super) fn checked_change(
    parameter: &Parameter,
    change: &ParameterChange,
    index: usize,
) -> Result<ParameterKind, CallError> {
    let name = &parameter.name;
    let of_other_kind = |value: &str, expected: &str| CallError::InvalidValue {
        element: format!("changes[{index}]"),
        value: format!("of {name:?}, {value}"),
        expected: expected.into(),
    };
    match (parameter.kind, change) {
        (ParameterKind::Slider { minimum, maximum, value: _ }, &ParameterChange::Move { value, .. }) => {
            if !(minimum..=maximum).contains(&value) {
                return Err(CallError::InvalidValue {
                    element: format!("changes[{index}].value"),
                    value: value.to_string(),
                    expected: format!("it must be between {minimum} and {maximum} (parameter {name:?})"),
                });
            }
            Ok(ParameterKind::Slider { minimum, maximum, value })
        }
        (ParameterKind::Button { presses }, &ParameterChange::Press { times, .. }) => {
            Ok(ParameterKind::Button { presses: presses.saturating_add(times) })
        }
        (ParameterKind::Button { .. }, ParameterChange::Move { .. }) => {
            Err(of_other_kind("a button", "it must be pressed, it has no value"))
        }
        (ParameterKind::Slider { .. }, ParameterChange::Press { .. }) => {
            Err(of_other_kind("a slider", "it must be given a value, it cannot be pressed"))
        }
    }
}

#[cfg(test)]
mod tests;

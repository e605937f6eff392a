//! Sliders and buttons that programs add and people move. They are not part of the world: steps, resets and
//! saved states do not include them.

mod share;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use simd_proto::text::{is_printable, printable};
use tokio::sync::Notify;

use super::{CallError, JointBinding, Owner, SimHandle};

/// Maximum length of a name, bytes.
const MAX_NAME: usize = 256;

/// A slider or a button.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Unique name; 1 to 256 bytes of visible characters.
    pub name: Arc<str>,
    /// Kind and value.
    pub kind: ParameterKind,
    /// Version of the list at its last change.
    pub version: u64,
    /// Client that added it.
    pub owner: Owner,
    /// Joint whose target it sets, for a slider.
    pub binding: Option<Arc<JointBinding>>,
}

/// Kind and value of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterKind {
    /// A number in a range.
    Slider {
        /// Lower end, finite.
        minimum: f64,
        /// Upper end, finite and above `minimum`.
        maximum: f64,
        /// Value within the range.
        value: f64,
    },
    /// A button.
    Button {
        /// Number of presses.
        presses: u64,
    },
}

/// All parameters, in the order in which they were added.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterList {
    /// Version: 1 for the initial empty list; grows with every change.
    pub version: u64,
    /// Parameters.
    pub parameters: Vec<Parameter>,
}

/// Behaviour of an addition if the name is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NameTaken {
    /// Refuses the addition.
    Refuse,
    /// Replaces the old parameter.
    Replace,
    /// Appends `_1`, `_2`, ... to the name.
    Rename,
}

/// A change of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterChange {
    /// Moves a slider.
    Move {
        /// Name of the slider.
        name: String,
        /// New value, within its range.
        value: f64,
    },
    /// Presses a button.
    Press {
        /// Name of the button.
        name: String,
        /// Number of presses.
        times: u64,
    },
}

/// All parameters, for any number of readers and writers; the newest list wins.
#[derive(Debug)]
pub(super) struct Parameters {
    /// Locked for a look or a change, never across a wait.
    newest: Mutex<Arc<ParameterList>>,
    changed: Notify,
    limit: usize,
}

impl Parameters {
    /// Makes an empty list for at most `limit` parameters.
    pub(super) fn new(limit: u32) -> Self {
        let none = ParameterList { version: 1, parameters: Vec::new() };
        let limit = usize::try_from(limit).unwrap_or(usize::MAX);
        Self { newest: Mutex::new(Arc::new(none)), changed: Notify::new(), limit }
    }

    fn newest(&self) -> Arc<ParameterList> {
        self.lock().clone()
    }

    /// Returns the list once its version differs from this one. It need not be newer: a version from before a
    /// restart of the daemon may be larger.
    async fn other_than(&self, version: u64) -> Arc<ParameterList> {
        loop {
            // Created before the look, so that a change in between wakes it.
            let changed = self.changed.notified();
            let newest = self.newest();
            if newest.version != version {
                return newest;
            }
            changed.await;
        }
    }

    /// Changes a copy, which becomes the list if the change succeeds and reports a difference: all of it or
    /// nothing.
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
    /// Returns all parameters, at once.
    pub fn parameters(&self) -> Arc<ParameterList> {
        self.inner.parameters.newest()
    }

    /// Returns all parameters once their version differs from `version`; after `timeout`, the present ones.
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

    /// Adds a slider or a button. A slider's value beyond its range becomes the nearest end. Returns the
    /// parameter as it is now.
    ///
    /// # Errors
    /// Returns an error if the name is invalid or taken, or belongs to another owner's parameter that would
    /// be replaced. Also if a number is not finite, the range is empty, or there are too many parameters, in
    /// total or of this client.
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
            // Checked before the search for a name, for which all others wait.
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

    /// Moves sliders and presses buttons: all or none, without setting targets of bound joints. Returns the
    /// named parameters as they are now. Moving a slider to its present value changes nothing.
    ///
    /// # Errors
    /// Returns an error if a parameter does not exist or has the other kind, or a value is out of range.
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

    /// Deletes parameters; without names, all that belong to no other owner. Returns the names of the deleted
    /// ones.
    ///
    /// # Errors
    /// Returns an error if one does not exist, or belongs to another owner; then none is deleted.
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
    /// Finds a parameter by its name.
    ///
    /// # Errors
    /// Returns an error if it does not exist.
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

    /// Returns a taken name with the smallest number that makes it free.
    fn free_name(&self, name: &str) -> Result<String, CallError> {
        // One pass through all names: thousands may have this name with a number, and a number up to their
        // count is free.
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

/// Returns the number after a name and an underscore, written without leading zeros; 0 counts as none.
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

/// Checks a name, which people read, in terminals too.
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

/// Returns the kind with its value within the range.
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

/// Returns a parameter after the change at this index of a request.
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

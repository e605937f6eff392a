//! Who did what, for the audit log and for those who watch events.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use super::SimHandle;
use crate::driver::{AuditedCall, LogEvent};

/// Robots of one call that are noted.
const ROBOTS: usize = 8;
/// Longest name that is noted, in characters.
const NAME: usize = 256;

/// Which robots a call concerns, noted where that is known and read where the call is written down.
#[derive(Clone, Debug, Default)]
pub struct RobotNote(Arc<Mutex<Vec<String>>>);

impl RobotNote {
    fn add<'r>(&self, robots: impl IntoIterator<Item = &'r str>) {
        let mut noted = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        for robot in robots {
            if noted.len() == ROBOTS {
                return;
            }
            let name: String = robot.chars().take(NAME).collect();
            if !noted.contains(&name) {
                noted.push(name);
            }
        }
    }

    /// What was noted.
    pub fn robots(&self) -> Vec<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl SimHandle {
    /// The same for a call whose robots are noted there.
    #[must_use]
    pub fn noting(&self, note: Option<RobotNote>) -> Self {
        Self { note, ..self.clone() }
    }

    /// Notes robots that the call concerns.
    pub(super) fn note_robots<'r>(&self, robots: impl IntoIterator<Item = &'r str>) {
        if let Some(note) = &self.note {
            note.add(robots);
        }
    }

    /// Makes an event of a call.
    pub fn audited(&self, call: AuditedCall) {
        let newest = self.newest();
        let what = LogEvent::Called { at: newest.state.at, call: Box::new(call) };
        self.inner.driver.events.push(SystemTime::now(), newest.sequence, what);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn some_robots_are_noted_each_once_and_no_more() {
        let note = RobotNote::default();
        note.add(["arm", "arm"]);
        let names: Vec<String> = (0..20).map(|number| format!("{number}{}", "x".repeat(1000))).collect();
        note.add(names.iter().map(String::as_str));
        let noted = note.robots();
        assert_eq!((noted.len(), noted[0].as_str(), noted[1].len()), (ROBOTS, "arm", NAME));
    }
}

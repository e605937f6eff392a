//! Audited calls, for the audit log and for watchers of events.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use super::SimHandle;
use crate::driver::{AuditedCall, LogEvent};

/// Maximum number of noted robots of one call.
const ROBOTS: usize = 8;
/// Maximum length of a noted name, characters.
const NAME: usize = 256;

/// Robots that a call concerns, noted where they are known and read when the call is logged.
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

    /// Returns the noted robots.
    pub fn robots(&self) -> Vec<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl SimHandle {
    /// Notes robots that the call concerns.
    pub(super) fn note_robots<'r>(&self, robots: impl IntoIterator<Item = &'r str>) {
        if let Some(note) = &self.call.note {
            note.add(robots);
        }
    }

    /// Logs a call as an event.
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

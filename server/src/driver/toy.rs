//! A world for tests: it counts steps, remembers commands, and panics when asked to.

use std::sync::{Arc, Mutex};

use simd_core::simulation::EventKind;
use simd_core::simulation::command::PhysicsChange;
use simd_core::{Applied, Command, Error, Event, Moment, PhysicsSettings, Reply, Snapshot};

use super::world::World;

/// See the module.
#[derive(Debug, Default)]
pub(crate) struct Toy {
    now: Moment,
    settings: PhysicsSettings,
    events: Vec<Event>,
    panics_at: Option<u64>,
    /// Each command that was applied, with its step.
    pub(crate) applied: Arc<Mutex<Vec<(u64, Command)>>>,
}

impl Toy {
    /// A world that fails in this step.
    pub(crate) fn panicking_at(step: u64) -> Self {
        Self { panics_at: Some(step), ..Self::default() }
    }
}

/// A command that the toy applies and does nothing for.
pub(crate) fn nothing() -> Command {
    Command::SetTargets(Default::default())
}

/// A command that the toy refuses.
pub(crate) fn refused() -> Command {
    Command::Delete { robot: "nobody".into() }
}

impl World for Toy {
    fn apply(&mut self, command: &Command) -> Result<Applied, Error> {
        let reply = match command {
            Command::Delete { robot } => {
                return Err(Error::RobotNotFound { robot: robot.clone(), known: Vec::new() });
            }
            Command::SetTargets(targets) if targets.robots.iter().any(|it| it.robot == "nobody") => {
                return Err(Error::RobotNotFound { robot: "nobody".into(), known: Vec::new() });
            }
            Command::SetPhysics(PhysicsChange { time_step: Some(time_step), .. }) => {
                self.settings.time_step = *time_step;
                let kind = EventKind::PhysicsChanged(self.settings);
                self.events.push(Event { at: self.now, kind });
                Reply::Physics(self.settings)
            }
            Command::Reset(scope) => {
                if scope.time {
                    self.now = Moment { epoch: self.now.epoch + 1, ..Moment::default() };
                }
                Reply::Reset { deleted: Vec::new() }
            }
            _ => Reply::Done,
        };
        self.applied.lock().unwrap().push((self.now.step, command.clone()));
        Ok(Applied { at: self.now, reply })
    }

    fn step(&mut self) {
        self.now.step += 1;
        assert_ne!(Some(self.now.step), self.panics_at, "on purpose");
    }

    fn now(&self) -> Moment {
        self.now
    }

    fn settings(&self) -> PhysicsSettings {
        self.settings
    }

    fn observe(&self, snapshot: &mut Snapshot) {
        snapshot.at = self.now;
    }

    fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }
}

//! Worlds for tests. One counts steps, remembers commands, and panics when asked to; one has a step that does
//! not end.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};

use simd_core::pool::Interrupt;
use simd_core::simulation::command::{ClaimId, PhysicsChange};
use simd_core::simulation::{EventKind, Saved, WorldLimits};
use simd_core::{Applied, Command, Error, Event, Moment, PhysicsSettings, PublishedState, Reply, Simulation};

use super::world::World;

/// A world that counts steps, remembers commands, and panics when asked to.
#[derive(Debug, Default)]
pub struct FakeWorld {
    now: Moment,
    settings: PhysicsSettings,
    events: Vec<Event>,
    panics_at: Option<u64>,
    /// Function called within each interruptible step.
    pub step_hook: Option<StepHook>,
    panics_when_dropped: bool,
    /// Applied commands, each with its step.
    pub applied: Arc<Mutex<Vec<(u64, Command)>>>,
}

/// Function that gets the interrupt of a step, and returns whether the step is completed.
pub struct StepHook(pub Box<dyn FnMut(&Interrupt<'_>) -> bool + Send>);

impl std::fmt::Debug for StepHook {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a hook in a step")
    }
}

impl FakeWorld {
    /// Makes a world that panics in this step.
    pub fn panicking_at(step: u64) -> Self {
        let mut fake = Self::default();
        fake.panics_at = Some(step);
        fake
    }

    /// Makes a world that panics in this step, and again when it is dropped.
    pub fn panicking_twice_at(step: u64) -> Self {
        let mut fake = Self::panicking_at(step);
        fake.panics_when_dropped = true;
        fake
    }
}

/// Returns a command that the fake world accepts, without effect.
pub fn nothing() -> Command {
    Command::SetTargets(Default::default())
}

/// Returns a command that the fake world refuses.
pub fn refused() -> Command {
    Command::Delete { robot: "missing".into() }
}

impl Drop for FakeWorld {
    fn drop(&mut self) {
        assert!(!self.panics_when_dropped, "while it is cleaned up");
    }
}

impl World for FakeWorld {
    fn apply_for(&mut self, command: &Command, _claim: Option<ClaimId>) -> Result<Applied, Error> {
        let reply = match command {
            Command::Delete { robot } => {
                return Err(Error::RobotNotFound { robot: robot.clone(), known: Vec::new() });
            }
            Command::SetTargets(targets) if targets.robots.iter().any(|it| it.robot == "missing") => {
                return Err(Error::RobotNotFound { robot: "missing".into(), known: Vec::new() });
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
            // Targets without a robot change no joint's control law.
            Command::SetTargets(targets) => {
                Reply::Targets { clamped: Vec::new(), changed_law: !targets.robots.is_empty() }
            }
            _ => Reply::Done,
        };
        self.applied.lock().unwrap().push((self.now.step, command.clone()));
        Ok(Applied { at: self.now, reply })
    }

    fn step_interruptible(&mut self, interrupt: &Interrupt<'_>) -> bool {
        let is_whole = self.step_hook.as_mut().is_none_or(|StepHook(hook)| hook(interrupt));
        if is_whole {
            self.step();
        }
        is_whole
    }

    fn step(&mut self) {
        self.now.step += 1;
        assert_ne!(Some(self.now.step), self.panics_at, "on purpose");
    }

    fn now(&self) -> Moment {
        self.now
    }

    fn to_saved(&self) -> Saved {
        Simulation::new(self.settings, WorldLimits::default()).to_saved()
    }

    fn settings(&self) -> PhysicsSettings {
        self.settings
    }

    fn observe(&self, state: &mut PublishedState) {
        state.at = self.now;
    }

    fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }
}

/// A real world whose first step does not end until the test releases it.
#[derive(Debug)]
pub struct BlockedWorld {
    world: Simulation,
    begins: Sender<()>,
    ends: Receiver<()>,
}

impl BlockedWorld {
    /// Returns the world, a receiver that reports the step's begin, and a sender that releases the step when
    /// dropped.
    pub fn new(world: Simulation) -> (Self, Receiver<()>, Sender<()>) {
        let (begins, has_begun) = channel();
        let (let_go, ends) = channel();
        (Self { world, begins, ends }, has_begun, let_go)
    }
}

impl World for BlockedWorld {
    fn apply_for(&mut self, command: &Command, _claim: Option<ClaimId>) -> Result<Applied, Error> {
        self.world.apply(command)
    }

    fn step_interruptible(&mut self, _interrupt: &Interrupt<'_>) -> bool {
        self.step();
        true
    }

    fn step(&mut self) {
        let _ = self.begins.send(());
        let _ = self.ends.recv();
        self.world.step();
    }

    fn now(&self) -> Moment {
        self.world.now()
    }

    fn to_saved(&self) -> Saved {
        FakeWorld::default().to_saved()
    }

    fn settings(&self) -> PhysicsSettings {
        *self.world.settings()
    }

    fn observe(&self, state: &mut PublishedState) {
        self.world.observe(state);
    }

    fn take_events(&mut self) -> Vec<Event> {
        self.world.take_events()
    }
}

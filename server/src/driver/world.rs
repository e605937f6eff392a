//! What the driver needs of a world. There is one world, [`Simulation`]; tests of
//! the driver bring their own, which stalls and fails when a test asks for it.

use simd_core::{Applied, Command, Error, Event, Moment, PhysicsSettings, PublishedState, Simulation};

/// A world that commands change and steps move.
pub(crate) trait World: Send + 'static {
    /// See [`Simulation::apply`].
    fn apply(&mut self, command: &Command) -> Result<Applied, Error>;
    /// See [`Simulation::step`].
    fn step(&mut self);
    /// See [`Simulation::step_interruptible`].
    fn step_interruptible(&mut self, interrupt: &dyn Fn() -> bool) -> bool;
    /// See [`Simulation::now`].
    fn now(&self) -> Moment;
    /// See [`Simulation::settings`].
    fn settings(&self) -> PhysicsSettings;
    /// See [`Simulation::observe`].
    fn observe(&self, state: &mut PublishedState);
    /// See [`Simulation::take_events`].
    fn take_events(&mut self) -> Vec<Event>;
}

impl World for Simulation {
    fn apply(&mut self, command: &Command) -> Result<Applied, Error> {
        Simulation::apply(self, command)
    }

    fn step(&mut self) {
        Simulation::step(self);
    }

    fn step_interruptible(&mut self, interrupt: &dyn Fn() -> bool) -> bool {
        Simulation::step_interruptible(self, interrupt)
    }

    fn now(&self) -> Moment {
        Simulation::now(self)
    }

    fn settings(&self) -> PhysicsSettings {
        *Simulation::settings(self)
    }

    fn observe(&self, state: &mut PublishedState) {
        Simulation::observe(self, state);
    }

    fn take_events(&mut self) -> Vec<Event> {
        Simulation::take_events(self)
    }
}

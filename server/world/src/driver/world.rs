//! The driver's interface to a world. The real world is [`Simulation`]; tests of the driver use their own,
//! which stall and fail on request.

use std::sync::Arc;

use simd_core::pool::{Interrupt, Pool};
use simd_core::simulation::Saved;
use simd_core::simulation::command::{ClaimId, ClaimRequest};
use simd_core::simulation::sensors::DueSample;
use simd_core::{Applied, Command, Error, Event, Moment, PhysicsSettings, PublishedState, Simulation};

/// A world that commands change and steps move.
pub trait World: Send + 'static {
    /// See [`Simulation::apply_for`].
    fn apply_for(&mut self, command: &Command, claim: Option<ClaimId>) -> Result<Applied, Error>;
    /// See [`Simulation::allow_world`].
    fn allow_world(&self, _claim: Option<ClaimId>) -> Result<(), Error> {
        Ok(())
    }
    /// See [`Simulation::allow_step`].
    fn allow_step(&self, _claim: Option<ClaimId>) -> Result<(), Error> {
        Ok(())
    }
    /// See [`Simulation::step`].
    fn step(&mut self);
    /// See [`Simulation::step_interruptible`].
    fn step_interruptible(&mut self, interrupt: &Interrupt<'_>) -> bool;
    /// See [`Simulation::set_pool`].
    fn set_pool(&mut self, _pool: Arc<dyn Pool>) {}
    /// See [`Simulation::now`].
    fn now(&self) -> Moment;
    /// See [`Simulation::settings`].
    fn settings(&self) -> PhysicsSettings;
    /// See [`Simulation::observe`].
    fn observe(&self, state: &mut PublishedState);
    /// See [`Simulation::to_saved`].
    fn to_saved(&self) -> Saved;
    /// See [`Simulation::claims`].
    fn claims(&self) -> Vec<ClaimRequest> {
        Vec::new()
    }
    /// See [`Simulation::take_events`].
    fn take_events(&mut self) -> Vec<Event>;
    /// See [`Simulation::take_due_samples`].
    fn take_due_samples(&mut self, _into: &mut Vec<DueSample>) {}
}

impl World for Simulation {
    fn apply_for(&mut self, command: &Command, claim: Option<ClaimId>) -> Result<Applied, Error> {
        Simulation::apply_for(self, command, claim)
    }

    fn allow_world(&self, claim: Option<ClaimId>) -> Result<(), Error> {
        Simulation::allow_world(self, claim)
    }

    fn allow_step(&self, claim: Option<ClaimId>) -> Result<(), Error> {
        Simulation::allow_step(self, claim)
    }

    fn step(&mut self) {
        Simulation::step(self);
    }

    fn step_interruptible(&mut self, interrupt: &Interrupt<'_>) -> bool {
        Simulation::step_interruptible(self, interrupt)
    }

    fn set_pool(&mut self, pool: Arc<dyn Pool>) {
        Simulation::set_pool(self, Some(pool));
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

    fn take_due_samples(&mut self, into: &mut Vec<DueSample>) {
        Simulation::take_due_samples(self, into);
    }

    fn to_saved(&self) -> Saved {
        Simulation::to_saved(self)
    }

    fn claims(&self) -> Vec<ClaimRequest> {
        Simulation::claims(self)
    }
}

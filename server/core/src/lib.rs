//! Physics and rules of simd, without IO: no clock, no files, no threads, no network. The caller supplies the
//! robots and decides when to step. Equal inputs give equal bits on one build and machine.
//!
//! * [`dynamics`]: articulated bodies, after Featherstone's book.
//! * [`collision`]: contacts and distances; the only module that uses parry.
//! * [`pool`]: threads that the owner of a world may lend it.
//! * [`simulation`]: the world: commands that change it, the step, its published state.
//! * [`rollout`]: copies of a world that continue from one state.

pub mod collision;
pub mod dynamics;
mod plain;
pub mod pool;
pub mod rollout;
pub mod simulation;
mod valid;

pub use simulation::{
    Applied, BulletContacts, Command, Error, Event, Integrator, Moment, PhysicsSettings, PublishedState,
    Reply, Simulation, SurfaceCombination,
};

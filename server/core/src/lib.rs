//! Physics and rules of simd. No IO at all: no clock, no file, no thread, no
//! network; the caller brings the robots and says when to step. Equal inputs
//! give equal bits on one build and machine.
//!
//! * [`dynamics`]: articulated bodies, as Featherstone's book has them.
//! * [`collision`]: what robots touch with; all that is known of parry.
//! * [`pool`]: threads that the owner of a world may lend it.
//! * [`simulation`]: the world: commands that change it, the step, what it looks like.
//! * [`rollout`]: copies of a world that run on from one state.

pub mod collision;
pub mod dynamics;
mod plain;
pub mod pool;
pub mod rollout;
pub mod simulation;
mod valid;

pub use simulation::{
    Applied, Command, Error, Event, Integrator, Moment, PhysicsSettings, PublishedState, Reply, Simulation,
    SurfaceCombination,
};

//! Operations on a world: commands, the step, publishing. All are methods of
//! [`Simulation`](super::Simulation); no other module imports this one.

mod claims;
mod collision_filter;
mod constraints;
mod copies;
mod described_constraints;
mod joints;
mod links;
mod observe;
mod pulls;
mod robots;
mod saved_states;
mod sensors;
mod step;
mod target_sources;
mod targets;
mod trajectories;
mod world;

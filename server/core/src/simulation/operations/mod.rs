//! What can be done with a world: commands, the step, publishing. All of it is methods of
//! [`Simulation`](super::Simulation), and nothing below imports it.

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

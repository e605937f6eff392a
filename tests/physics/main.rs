//! Physics that can be checked: each test states its formula or source, its
//! tolerance and why.
#![cfg(test)]

mod chains;
mod contact_runs;
mod contacts;
mod convergence;
mod energy;
mod extremes;
mod floating;
mod mujoco;
mod properties;
mod random_robots;
mod rows;
mod scenes;
mod seven_arm;
mod world;

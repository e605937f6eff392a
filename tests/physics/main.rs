//! Physics that can be checked: each test states its formula or source, its
//! tolerance and why.
#![cfg(test)]

mod chains;
mod convergence;
mod energy;
mod extremes;
mod floating;
mod inverse_kinematics;
mod kinematics;
mod mujoco;
mod properties;
mod random_robots;
mod rows;
mod seven_arm;
mod world;

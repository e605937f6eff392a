//! Physics that can be checked: each test states its formula or source, its
//! tolerance and why.
#![cfg(test)]

mod ball_joints;
mod chains;
mod closed_forms;
mod collision_filters;
mod constraint_properties;
mod constraints;
mod contact_runs;
mod contacts;
mod contradictions;
mod cradle;
mod distances;
mod energy;
mod equal_bits;
mod extremes;
mod floating;
mod grounds;
mod hard_stacks;
mod initial_overlaps;
mod inverse_kinematics;
mod kinematics;
mod lanes;
mod mechanisms;
mod mujoco;
mod passive_worlds;
mod properties;
mod queries;
mod random_robots;
mod reactions;
mod resting_forces;
mod rows;
mod saved_state_files;
mod scenes;
mod sensors;
mod seven_arm;
mod sleeping;
mod spinning;
mod surface_queries;
mod terrain;
mod terrain_bits;
mod threads;
mod truth;
mod turning_friction;
mod walking;
mod world;

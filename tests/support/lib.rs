//! Code shared by the suites.

pub mod contact_figures;
pub mod contact_scene;
pub mod daemon;
pub mod http;
pub mod json;
pub mod network;
pub mod pictures;
pub mod process;
pub mod pybullet_data;
pub mod robots;
pub mod room;
mod scene_constraint;
pub mod scene_in_rapier;
mod scene_thing;
pub mod scenes;
pub mod soak;
pub mod statistics;
pub mod truth;
pub mod web;
pub mod world;

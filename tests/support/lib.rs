//! What the suites share.

pub mod daemon;
pub mod http;
pub mod network;
pub mod process;
pub mod pybullet_data;
pub mod robots;
pub mod scenes;
pub mod statistics;
pub mod truth;

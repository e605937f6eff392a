//! Replaces the ROS 2 node in a build without the feature `ros2`.

use std::io;

use simd_world::SimHandle;

use crate::config::{NO_ROS2, Ros2};

/// The running node, which never exists.
#[derive(Debug)]
pub enum Serving {}

/// Refuses to join a graph.
///
/// # Errors
/// Always returns that this build has no ROS 2.
pub fn start(_settings: Ros2, _handle: &SimHandle) -> io::Result<Serving> {
    Err(io::Error::other(NO_ROS2))
}

impl Serving {
    /// Never called.
    pub async fn drain(self) {
        match self {}
    }
}

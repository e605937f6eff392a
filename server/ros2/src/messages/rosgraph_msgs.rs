//! The time of a simulation.

use super::builtin_interfaces::Time;
use crate::message::messages;

messages! {
    /// What nodes with `use_sim_time` take for the time.
    Clock = "rosgraph_msgs/msg/Clock" {
        clock: Time,
    }
}

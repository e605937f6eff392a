//! The time of a simulation.

use super::builtin_interfaces::Time;
use crate::message::messages;

messages! {
    /// Time for nodes with `use_sim_time`.
    Clock = "rosgraph_msgs/msg/Clock" {
        clock: Time,
    }
}

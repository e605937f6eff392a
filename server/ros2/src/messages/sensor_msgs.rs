//! What robots measure.

use super::std_msgs::Header;
use crate::message::messages;

messages! {
    /// Joints by name. `position`, `velocity` and `effort` have a number for each, or are empty.
    JointState = "sensor_msgs/msg/JointState" {
        header: Header,
        name: Vec<String>,
        position: Vec<f64>,
        velocity: Vec<f64>,
        effort: Vec<f64>,
    }
}

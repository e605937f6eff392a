//! Frames.

use super::geometry_msgs::TransformStamped;
use crate::message::messages;

messages! {
    /// Transforms between frames.
    TFMessage = "tf2_msgs/msg/TFMessage" {
        transforms: Vec<TransformStamped>,
    }
}

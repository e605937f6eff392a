//! Frames.

use super::geometry_msgs::TransformStamped;
use crate::message::messages;

messages! {
    /// Where frames are.
    TFMessage = "tf2_msgs/msg/TFMessage" {
        transforms: Vec<TransformStamped>,
    }
}

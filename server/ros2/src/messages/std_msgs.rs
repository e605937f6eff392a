//! What many packages share.

use super::builtin_interfaces::Time;
use crate::message::messages;

/// The text of Rust, which `String` below hides.
type Text = std::string::String;

messages! {
    /// When and in which frame.
    Header = "std_msgs/msg/Header" {
        stamp: Time,
        frame_id: Text,
    }

    /// A text.
    String = "std_msgs/msg/String" {
        data: Text,
    }

    /// One dimension of an array.
    MultiArrayDimension = "std_msgs/msg/MultiArrayDimension" {
        label: Text,
        size: u32,
        stride: u32,
    }

    /// What the numbers of an array mean.
    MultiArrayLayout = "std_msgs/msg/MultiArrayLayout" {
        dim: Vec<MultiArrayDimension>,
        data_offset: u32,
    }

    /// Numbers, such as the commands of a group of joints.
    Float64MultiArray = "std_msgs/msg/Float64MultiArray" {
        layout: MultiArrayLayout,
        data: Vec<f64>,
    }
}

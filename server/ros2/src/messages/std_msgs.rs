//! Types that many packages share.

use super::builtin_interfaces::Time;
use crate::message::messages;

/// Rust's text type, which `String` below hides.
type Text = std::string::String;

messages! {
    /// Time and frame of a message.
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

    /// Meaning of the numbers of an array.
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

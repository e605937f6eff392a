//! Poses and movements. Metres, radians, seconds, newtons; quaternions x y z w.

use super::std_msgs::Header;
use crate::message::messages;

messages! {
    /// A vector.
    Vector3 = "geometry_msgs/msg/Vector3" {
        x: f64,
        y: f64,
        z: f64,
    }

    /// A point.
    Point = "geometry_msgs/msg/Point" {
        x: f64,
        y: f64,
        z: f64,
    }

    /// A rotation. The default is all zeros, which is not a rotation: set `w` to 1.
    Quaternion = "geometry_msgs/msg/Quaternion" {
        x: f64,
        y: f64,
        z: f64,
        w: f64,
    }

    /// A position and a rotation.
    Pose = "geometry_msgs/msg/Pose" {
        position: Point,
        orientation: Quaternion,
    }

    /// A pose at a time, in a frame.
    PoseStamped = "geometry_msgs/msg/PoseStamped" {
        header: Header,
        pose: Pose,
    }

    /// A transform between the coordinates of two frames.
    Transform = "geometry_msgs/msg/Transform" {
        translation: Vector3,
        rotation: Quaternion,
    }

    /// The pose of `child_frame_id` in the header's frame.
    TransformStamped = "geometry_msgs/msg/TransformStamped" {
        header: Header,
        child_frame_id: String,
        transform: Transform,
    }

    /// Linear and angular velocity.
    Twist = "geometry_msgs/msg/Twist" {
        linear: Vector3,
        angular: Vector3,
    }

    /// Linear and angular acceleration.
    Accel = "geometry_msgs/msg/Accel" {
        linear: Vector3,
        angular: Vector3,
    }

    /// A force and a torque.
    Wrench = "geometry_msgs/msg/Wrench" {
        force: Vector3,
        torque: Vector3,
    }

    /// A wrench at a time, in a frame.
    WrenchStamped = "geometry_msgs/msg/WrenchStamped" {
        header: Header,
        wrench: Wrench,
    }
}

//! Poses and movements. Metres, radians, seconds, newtons; quaternions x y z w.

use super::std_msgs::Header;
use crate::message::messages;

messages! {
    /// A direction with a length.
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

    /// A rotation. The default is all zeros, which is none: set `w` to 1.
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

    /// One at a time, in a frame.
    PoseStamped = "geometry_msgs/msg/PoseStamped" {
        header: Header,
        pose: Pose,
    }

    /// From one frame's coordinates to another's.
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

    /// Velocities.
    Twist = "geometry_msgs/msg/Twist" {
        linear: Vector3,
        angular: Vector3,
    }

    /// Accelerations.
    Accel = "geometry_msgs/msg/Accel" {
        linear: Vector3,
        angular: Vector3,
    }

    /// A force and a torque.
    Wrench = "geometry_msgs/msg/Wrench" {
        force: Vector3,
        torque: Vector3,
    }

    /// One at a time, in a frame.
    WrenchStamped = "geometry_msgs/msg/WrenchStamped" {
        header: Header,
        wrench: Wrench,
    }
}

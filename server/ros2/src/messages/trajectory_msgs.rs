//! Trajectories of joints.

use super::builtin_interfaces::Duration;
use super::geometry_msgs::{Transform, Twist};
use super::std_msgs::Header;
use crate::message::messages;

messages! {
    /// Desired state of joints at a time. Each list has a number for each joint, or is empty.
    JointTrajectoryPoint = "trajectory_msgs/msg/JointTrajectoryPoint" {
        positions: Vec<f64>,
        velocities: Vec<f64>,
        accelerations: Vec<f64>,
        effort: Vec<f64>,
        time_from_start: Duration,
    }

    /// Points in the order of their times.
    JointTrajectory = "trajectory_msgs/msg/JointTrajectory" {
        header: Header,
        joint_names: Vec<String>,
        points: Vec<JointTrajectoryPoint>,
    }

    /// Desired state of joints with several degrees of freedom.
    MultiDOFJointTrajectoryPoint = "trajectory_msgs/msg/MultiDOFJointTrajectoryPoint" {
        transforms: Vec<Transform>,
        velocities: Vec<Twist>,
        accelerations: Vec<Twist>,
        time_from_start: Duration,
    }

    /// Trajectory of joints with several degrees of freedom.
    MultiDOFJointTrajectory = "trajectory_msgs/msg/MultiDOFJointTrajectory" {
        header: Header,
        joint_names: Vec<String>,
        points: Vec<MultiDOFJointTrajectoryPoint>,
    }
}

//! The action by which controllers of `ros2_control` follow trajectories.

use super::builtin_interfaces::{Duration, Time};
use super::std_msgs::Header;
use super::trajectory_msgs::{
    JointTrajectory, JointTrajectoryPoint, MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint,
};
use super::unique_identifier_msgs::UUID;
use crate::message::{messages, services};

messages! {
    /// Tolerance of a joint: 0 is the server's default, -1 allows any distance.
    JointTolerance = "control_msgs/msg/JointTolerance" {
        name: String,
        position: f64,
        velocity: f64,
        acceleration: f64,
    }

    /// Tolerance of a component of a joint with several degrees of freedom.
    JointComponentTolerance = "control_msgs/msg/JointComponentTolerance" consts {
        X_AXIS: u16 = 1;
        Y_AXIS: u16 = 2;
        Z_AXIS: u16 = 3;
        TRANSLATION: u16 = 4;
        ROTATION: u16 = 5;
    } {
        joint_name: String,
        component: u16,
        position: f64,
        velocity: f64,
        acceleration: f64,
    }

    /// A trajectory to follow, with tolerances.
    FollowJointTrajectoryGoal = "control_msgs/action/FollowJointTrajectory_Goal" {
        trajectory: JointTrajectory,
        multi_dof_trajectory: MultiDOFJointTrajectory,
        path_tolerance: Vec<JointTolerance>,
        component_path_tolerance: Vec<JointComponentTolerance>,
        goal_tolerance: Vec<JointTolerance>,
        component_goal_tolerance: Vec<JointComponentTolerance>,
        goal_time_tolerance: Duration,
    }

    /// Result of a trajectory.
    FollowJointTrajectoryResult = "control_msgs/action/FollowJointTrajectory_Result" consts {
        SUCCESSFUL: i32 = 0;
        INVALID_GOAL: i32 = -1;
        INVALID_JOINTS: i32 = -2;
        OLD_HEADER_TIMESTAMP: i32 = -3;
        PATH_TOLERANCE_VIOLATED: i32 = -4;
        GOAL_TOLERANCE_VIOLATED: i32 = -5;
    } {
        error_code: i32,
        error_string: String,
    }

    /// Progress of a trajectory.
    FollowJointTrajectoryFeedback = "control_msgs/action/FollowJointTrajectory_Feedback" {
        header: Header,
        joint_names: Vec<String>,
        desired: JointTrajectoryPoint,
        actual: JointTrajectoryPoint,
        error: JointTrajectoryPoint,
        index: i32,
        multi_dof_joint_names: Vec<String>,
        multi_dof_desired: MultiDOFJointTrajectoryPoint,
        multi_dof_actual: MultiDOFJointTrajectoryPoint,
        multi_dof_error: MultiDOFJointTrajectoryPoint,
        multi_dof_index: i32,
    }

    /// A goal with its identifier.
    FollowJointTrajectorySendGoalRequest = "control_msgs/action/FollowJointTrajectory_SendGoal_Request" {
        goal_id: UUID,
        goal: FollowJointTrajectoryGoal,
    }

    /// Whether the goal was accepted.
    FollowJointTrajectorySendGoalResponse = "control_msgs/action/FollowJointTrajectory_SendGoal_Response" {
        accepted: bool,
        stamp: Time,
    }

    /// Id of the goal whose result is requested.
    FollowJointTrajectoryGetResultRequest = "control_msgs/action/FollowJointTrajectory_GetResult_Request" {
        goal_id: UUID,
    }

    /// Result of a goal, once it exists.
    FollowJointTrajectoryGetResultResponse = "control_msgs/action/FollowJointTrajectory_GetResult_Response" {
        status: i8,
        result: FollowJointTrajectoryResult,
    }

    /// Feedback with the goal's identifier.
    FollowJointTrajectoryFeedbackMessage = "control_msgs/action/FollowJointTrajectory_FeedbackMessage" {
        goal_id: UUID,
        feedback: FollowJointTrajectoryFeedback,
    }
}

services! {
    /// Begins a goal.
    FollowJointTrajectorySendGoal = "control_msgs/action/FollowJointTrajectory_SendGoal"
        (FollowJointTrajectorySendGoalRequest, FollowJointTrajectorySendGoalResponse);
    /// Waits for the result of a goal.
    FollowJointTrajectoryGetResult = "control_msgs/action/FollowJointTrajectory_GetResult"
        (FollowJointTrajectoryGetResultRequest, FollowJointTrajectoryGetResultResponse);
}

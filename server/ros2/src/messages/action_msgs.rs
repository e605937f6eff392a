//! Types that all actions share.

use super::builtin_interfaces::Time;
use super::unique_identifier_msgs::UUID;
use crate::message::{messages, services};

messages! {
    /// Id of a goal, and the time of its acceptance.
    GoalInfo = "action_msgs/msg/GoalInfo" {
        goal_id: UUID,
        stamp: Time,
    }

    /// Status of a goal.
    GoalStatus = "action_msgs/msg/GoalStatus" consts {
        STATUS_UNKNOWN: i8 = 0;
        STATUS_ACCEPTED: i8 = 1;
        STATUS_EXECUTING: i8 = 2;
        STATUS_CANCELING: i8 = 3;
        STATUS_SUCCEEDED: i8 = 4;
        STATUS_CANCELED: i8 = 5;
        STATUS_ABORTED: i8 = 6;
    } {
        goal_info: GoalInfo,
        status: i8,
    }

    /// Status of all goals that the server remembers.
    GoalStatusArray = "action_msgs/msg/GoalStatusArray" {
        status_list: Vec<GoalStatus>,
    }

    /// Selects one goal by its id, goals accepted before a time, both, or with zeros all.
    CancelGoalRequest = "action_msgs/srv/CancelGoal_Request" {
        goal_info: GoalInfo,
    }

    /// Goals that are being cancelled.
    CancelGoalResponse = "action_msgs/srv/CancelGoal_Response" consts {
        ERROR_NONE: i8 = 0;
        ERROR_REJECTED: i8 = 1;
        ERROR_UNKNOWN_GOAL_ID: i8 = 2;
        ERROR_GOAL_TERMINATED: i8 = 3;
    } {
        return_code: i8,
        goals_canceling: Vec<GoalInfo>,
    }
}

services! {
    /// Cancels goals.
    CancelGoal = "action_msgs/srv/CancelGoal" (CancelGoalRequest, CancelGoalResponse);
}

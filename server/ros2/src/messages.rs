//! The types, one module per ROS package. The definitions come from ROS 2 Jazzy and later, `control_msgs` 6
//! and `simulation_interfaces` 2.

pub mod action_msgs;
pub mod builtin_interfaces;
pub mod control_msgs;
pub mod geometry_msgs;
pub mod rcl_interfaces;
pub mod rosgraph_msgs;
pub mod sensor_msgs;
pub mod service_msgs;
pub mod simulation_interfaces;
pub mod std_msgs;
pub mod tf2_msgs;
pub mod trajectory_msgs;
pub mod unique_identifier_msgs;

use crate::message::{Message as _, Service as _};

/// Returns name, hash and text of every type, messages first.
pub fn all() -> Vec<(&'static str, &'static str, String)> {
    macro_rules! listed {
        ($($message:path),* ; $($service:path),*) => {
            vec![
                $((<$message>::NAME, <$message>::type_hash(), <$message>::definition()),)*
                $((<$service>::NAME, <$service>::type_hash(), String::new()),)*
            ]
        };
    }
    listed!(
        action_msgs::CancelGoalRequest, action_msgs::CancelGoalResponse, action_msgs::GoalInfo,
        action_msgs::GoalStatus, action_msgs::GoalStatusArray,
        builtin_interfaces::Duration, builtin_interfaces::Time,
        control_msgs::FollowJointTrajectoryFeedback, control_msgs::FollowJointTrajectoryFeedbackMessage,
        control_msgs::FollowJointTrajectoryGetResultRequest, control_msgs::FollowJointTrajectoryGetResultResponse,
        control_msgs::FollowJointTrajectoryGoal, control_msgs::FollowJointTrajectoryResult,
        control_msgs::FollowJointTrajectorySendGoalRequest, control_msgs::FollowJointTrajectorySendGoalResponse,
        control_msgs::JointComponentTolerance, control_msgs::JointTolerance,
        geometry_msgs::Accel, geometry_msgs::Point, geometry_msgs::Pose, geometry_msgs::PoseStamped,
        geometry_msgs::Quaternion, geometry_msgs::Transform, geometry_msgs::TransformStamped, geometry_msgs::Twist,
        geometry_msgs::Vector3, geometry_msgs::Wrench, geometry_msgs::WrenchStamped,
        rcl_interfaces::Log,
        rosgraph_msgs::Clock,
        sensor_msgs::CameraInfo, sensor_msgs::Image, sensor_msgs::Imu, sensor_msgs::JointState,
        sensor_msgs::LaserScan, sensor_msgs::PointCloud2, sensor_msgs::PointField, sensor_msgs::Range,
        sensor_msgs::RegionOfInterest,
        service_msgs::ServiceEventInfo,
        simulation_interfaces::Bounds, simulation_interfaces::DeleteEntityRequest,
        simulation_interfaces::DeleteEntityResponse, simulation_interfaces::EntityCategory,
        simulation_interfaces::EntityFilters, simulation_interfaces::EntityState,
        simulation_interfaces::GetEntitiesRequest, simulation_interfaces::GetEntitiesResponse,
        simulation_interfaces::GetEntityStateRequest, simulation_interfaces::GetEntityStateResponse,
        simulation_interfaces::GetSimulationStateRequest, simulation_interfaces::GetSimulationStateResponse,
        simulation_interfaces::GetSimulatorFeaturesRequest, simulation_interfaces::GetSimulatorFeaturesResponse,
        simulation_interfaces::ResetSimulationRequest, simulation_interfaces::ResetSimulationResponse,
        simulation_interfaces::Resource, simulation_interfaces::Result,
        simulation_interfaces::SetEntityStateRequest, simulation_interfaces::SetEntityStateResponse,
        simulation_interfaces::SetSimulationStateRequest, simulation_interfaces::SetSimulationStateResponse,
        simulation_interfaces::SimulationState, simulation_interfaces::SimulatorFeatures,
        simulation_interfaces::SpawnEntityRequest, simulation_interfaces::SpawnEntityResponse,
        simulation_interfaces::StepSimulationRequest, simulation_interfaces::StepSimulationResponse,
        simulation_interfaces::TagsFilter,
        std_msgs::Float64MultiArray, std_msgs::Header, std_msgs::MultiArrayDimension, std_msgs::MultiArrayLayout,
        std_msgs::String,
        tf2_msgs::TFMessage,
        trajectory_msgs::JointTrajectory, trajectory_msgs::JointTrajectoryPoint,
        trajectory_msgs::MultiDOFJointTrajectory, trajectory_msgs::MultiDOFJointTrajectoryPoint,
        unique_identifier_msgs::UUID;
        action_msgs::CancelGoal,
        control_msgs::FollowJointTrajectoryGetResult, control_msgs::FollowJointTrajectorySendGoal,
        simulation_interfaces::DeleteEntity, simulation_interfaces::GetEntities,
        simulation_interfaces::GetEntityState, simulation_interfaces::GetSimulationState,
        simulation_interfaces::GetSimulatorFeatures, simulation_interfaces::ResetSimulation,
        simulation_interfaces::SetEntityState, simulation_interfaces::SetSimulationState,
        simulation_interfaces::SpawnEntity, simulation_interfaces::StepSimulation
    )
}

//! What follows from where a robot's joints are: poses, Jacobians, inertia, inverses.

use simd_proto::v1::{
    ComputeInverseDynamicsRequest, ComputeInverseDynamicsResponse, ComputeInverseKinematicsRequest,
    ComputeInverseKinematicsResponse, GetJacobianRequest, GetJacobianResponse, GetJointReactionsRequest,
    GetJointReactionsResponse, GetLinkStatesRequest, GetLinkStatesResponse, GetMassMatrixRequest,
    GetMassMatrixResponse,
};

use crate::{Client, Error};

/// `KinematicsService`.
impl Client {
    /// Where links are and how they move, in the newest state; of all robots where none is named.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn link_states(&self, robots: Vec<String>) -> Result<GetLinkStatesResponse, Error> {
        self.unary(self.kinematics().get_link_states(GetLinkStatesRequest { robots })).await
    }

    /// What a robot's joints carried over the last step.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn joint_reactions(&self, robot: &str) -> Result<GetJointReactionsResponse, Error> {
        let request = GetJointReactionsRequest { robot: robot.to_owned() };
        self.unary(self.kinematics().get_joint_reactions(request)).await
    }

    /// The Jacobian of a point of a link.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `LINK_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn jacobian(&self, request: GetJacobianRequest) -> Result<GetJacobianResponse, Error> {
        self.unary(self.kinematics().get_jacobian(request)).await
    }

    /// The joint-space inertia matrix, armature included.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn mass_matrix(&self, request: GetMassMatrixRequest) -> Result<GetMassMatrixResponse, Error> {
        self.unary(self.kinematics().get_mass_matrix(request)).await
    }

    /// The efforts that give accelerations.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn inverse_dynamics(
        &self,
        request: ComputeInverseDynamicsRequest,
    ) -> Result<ComputeInverseDynamicsResponse, Error> {
        self.unary(self.kinematics().compute_inverse_dynamics(request)).await
    }

    /// Joint positions at which a link is at a pose, or as near to it as was found: look
    /// at `converged`.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `LINK_NOT_FOUND`, `JOINT_NOT_FOUND`, `JOINT_NOT_ACTUATED`, `INVALID_VALUE`.
    pub async fn inverse_kinematics(
        &self,
        request: ComputeInverseKinematicsRequest,
    ) -> Result<ComputeInverseKinematicsResponse, Error> {
        self.unary(self.kinematics().compute_inverse_kinematics(request)).await
    }
}

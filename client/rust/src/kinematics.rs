//! Kinematics and dynamics of a robot: poses, Jacobians, inertia, inverses.

use simd_proto::v1::{
    ComputeInverseDynamicsRequest, ComputeInverseDynamicsResponse, ComputeInverseKinematicsRequest,
    ComputeInverseKinematicsResponse, GetJacobianRequest, GetJacobianResponse, GetJointReactionsRequest,
    GetJointReactionsResponse, GetLinkStatesRequest, GetLinkStatesResponse, GetMassMatrixRequest,
    GetMassMatrixResponse,
};

use crate::{Client, Error};

/// `KinematicsService`.
impl Client {
    /// Returns poses and twists of links in the newest state; of all robots if none is named.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn link_states(&self, robots: Vec<String>) -> Result<GetLinkStatesResponse, Error> {
        self.unary(self.kinematics().get_link_states(GetLinkStatesRequest { robots })).await
    }

    /// Returns the wrenches that a robot's joints carried over the last step.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn joint_reactions(&self, robot: &str) -> Result<GetJointReactionsResponse, Error> {
        let request = GetJointReactionsRequest { robot: robot.to_owned() };
        self.unary(self.kinematics().get_joint_reactions(request)).await
    }

    /// Returns the Jacobian of a point of a link.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `LINK_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn jacobian(&self, request: GetJacobianRequest) -> Result<GetJacobianResponse, Error> {
        self.unary(self.kinematics().get_jacobian(request)).await
    }

    /// Returns the joint-space inertia matrix, armature included.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn mass_matrix(&self, request: GetMassMatrixRequest) -> Result<GetMassMatrixResponse, Error> {
        self.unary(self.kinematics().get_mass_matrix(request)).await
    }

    /// Returns the efforts that give accelerations.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn inverse_dynamics(
        &self,
        request: ComputeInverseDynamicsRequest,
    ) -> Result<ComputeInverseDynamicsResponse, Error> {
        self.unary(self.kinematics().compute_inverse_dynamics(request)).await
    }

    /// Returns joint positions at which a link reaches a pose, or the nearest that was found: see
    /// `converged`.
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

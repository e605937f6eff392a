//! Constraints between links, in addition to the joints of their robots.

use simd_proto::v1::{
    ChangeConstraintRequest, Constraint, CreateConstraintRequest, DeleteConstraintRequest,
    ListConstraintsRequest, Stamp,
};

use crate::{Client, Error, client::present};

/// `ConstraintService`.
impl Client {
    /// Connects two links. Returns the constraint's name.
    ///
    /// # Errors `ROBOT_NOT_FOUND`, `LINK_NOT_FOUND`, `JOINT_NOT_FOUND`, `CONSTRAINT_EXISTS`, `INVALID_VALUE`,
    /// `LIMIT_EXCEEDED`, `ROBOT_CLAIMED`.
    pub async fn create_constraint(&self, request: CreateConstraintRequest) -> Result<String, Error> {
        Ok(self.unary(self.constraint().create_constraint(self.claimed(request))).await?.name)
    }

    /// Changes a constraint.
    ///
    /// # Errors
    /// `CONSTRAINT_NOT_FOUND`, `INVALID_VALUE`, `ROBOT_CLAIMED`.
    pub async fn change_constraint(&self, request: ChangeConstraintRequest) -> Result<Stamp, Error> {
        present(self.unary(self.constraint().change_constraint(self.claimed(request))).await?.stamp, "stamp")
    }

    /// Deletes a constraint.
    ///
    /// # Errors
    /// `CONSTRAINT_NOT_FOUND`, `ROBOT_CLAIMED`.
    pub async fn delete_constraint(&self, name: &str) -> Result<Stamp, Error> {
        let request = DeleteConstraintRequest { name: name.to_owned(), ..Default::default() };
        present(self.unary(self.constraint().delete_constraint(self.claimed(request))).await?.stamp, "stamp")
    }

    /// Returns the constraints of a robot, or of the world if none is named, with their forces over the last
    /// step.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn constraints(&self, robot: Option<&str>) -> Result<Vec<Constraint>, Error> {
        let request = ListConstraintsRequest { robot: robot.unwrap_or_default().to_owned() };
        Ok(self.unary(self.constraint().list_constraints(request)).await?.constraints)
    }
}

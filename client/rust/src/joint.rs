//! Joints: layout, states, targets, trajectories, claims.

use std::time::Duration;

use simd_proto::v1::{
    CancelTrajectoryRequest, ClaimJointsRequest, ClampedTarget, FollowTrajectoryRequest,
    FollowTrajectoryResponse, GetJointLayoutRequest, GetJointStatesRequest, JointLayout, JointProperties,
    JointReset, JointSelection, JointStates, JointTarget, ListTrajectoriesRequest, NextJointStatesRequest,
    NextJointStatesResponse, ReleaseJointsRequest, ResetJointsRequest, RobotReset, SetJointPropertiesRequest,
    SetJointTargetsRequest, SetJointTargetsResponse, Stamp, Trajectory, WatchJointStatesRequest,
    WatchJointStatesResponse,
};
use tonic::Streaming;

use crate::{Client, Error, RobotReading, client::present, simulation::wall_seconds, target::robot_targets};

/// Selects all joints of a robot.
pub fn every_joint(robot: &str) -> JointSelection {
    JointSelection { robot: robot.to_owned(), joints: Vec::new() }
}

/// Selects some joints of a robot, in this order.
pub fn some_joints(robot: &str, joints: impl IntoIterator<Item = impl Into<String>>) -> JointSelection {
    JointSelection { robot: robot.to_owned(), joints: joints.into_iter().map(Into::into).collect() }
}

/// `JointService`, except the stream for controllers: see [`Control`](crate::Control).
impl Client {
    /// Returns the joints of a robot, fixed ones included.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn joint_layout(&self, robot: &str) -> Result<JointLayout, Error> {
        let request = GetJointLayoutRequest { robot: robot.to_owned() };
        present(self.unary(self.joint().get_joint_layout(request)).await?.layout, "layout")
    }

    /// Returns the newest state, at once; of all robots without a selection.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `JOINT_NOT_FOUND`.
    pub async fn joint_states(&self, selections: Vec<JointSelection>) -> Result<JointStates, Error> {
        let request = GetJointStatesRequest { selections };
        present(self.unary(self.joint().get_joint_states(request)).await?.states, "states")
    }

    /// Returns the newest state of one robot's joints, with their names: a layout and a state in one.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `JOINT_NOT_FOUND`.
    pub async fn read_joints(&self, selection: &JointSelection) -> Result<RobotReading, Error> {
        let mut layout = self.joint_layout(&selection.robot).await?;
        let mut states = self.joint_states(vec![selection.clone()]).await?;
        // The robot may have been reloaded between the two calls; a second reload is an error.
        if !RobotReading::fits(&layout, &states) {
            layout = self.joint_layout(&selection.robot).await?;
            states = self.joint_states(vec![selection.clone()]).await?;
        }
        RobotReading::new(&layout, selection, &states)
    }

    /// Sets targets for joints of one or several robots: all at one step, or none.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `JOINT_NOT_FOUND`, `INVALID_VALUE`, `JOINT_NOT_ACTUATED`,
    /// `TARGET_BEYOND_LIMIT`, `JOINT_CLAIMED`, `LAYOUT_CHANGED`.
    pub async fn set_targets(
        &self,
        request: SetJointTargetsRequest,
    ) -> Result<SetJointTargetsResponse, Error> {
        self.unary(self.joint().set_joint_targets(self.claimed(request))).await
    }

    /// Sets targets for joints of one robot. Targets beyond a limit are clamped, and the answer lists them.
    ///
    /// # Errors
    /// As [`set_targets`](Self::set_targets).
    pub async fn set_robot_targets(
        &self,
        robot: &str,
        targets: impl IntoIterator<Item = JointTarget>,
    ) -> Result<Vec<ClampedTarget>, Error> {
        let robots = vec![robot_targets(robot, targets)];
        let request = SetJointTargetsRequest { robots, ..Default::default() };
        Ok(self.set_targets(request).await?.clamped)
    }

    /// Makes joints of one robot follow a trajectory. Returns once it is accepted, with its id; an event with
    /// that id reports its end.
    ///
    /// # Errors `ROBOT_NOT_FOUND`, `JOINT_NOT_FOUND`, `INVALID_VALUE`, `JOINT_NOT_ACTUATED`,
    /// `TARGET_BEYOND_LIMIT`, `JOINT_CLAIMED`, `LIMIT_EXCEEDED`.
    pub async fn follow_trajectory(
        &self,
        request: FollowTrajectoryRequest,
    ) -> Result<FollowTrajectoryResponse, Error> {
        self.unary(self.joint().follow_trajectory(self.claimed(request))).await
    }

    /// Ends a trajectory, or all trajectories of a robot. Their joints hold where they are.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `JOINT_CLAIMED`, and `INVALID_VALUE` if it has already ended.
    pub async fn cancel_trajectory(&self, robot: &str, id: Option<u64>) -> Result<Stamp, Error> {
        let request = CancelTrajectoryRequest { robot: robot.to_owned(), id, ..Default::default() };
        present(self.unary(self.joint().cancel_trajectory(self.claimed(request))).await?.stamp, "stamp")
    }

    /// Returns the active and waiting trajectories of a robot, or of all robots.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn trajectories(&self, robot: Option<&str>) -> Result<Vec<Trajectory>, Error> {
        let request = ListTrajectoriesRequest { robot: robot.unwrap_or_default().to_owned() };
        Ok(self.unary(self.joint().list_trajectories(request)).await?.trajectories)
    }

    /// Sets positions and velocities of one robot's joints. Without joints, all of them return to their
    /// spawned positions.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `JOINT_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn reset_joints(&self, robot: &str, joints: Vec<JointReset>) -> Result<Stamp, Error> {
        let robots = vec![RobotReset { robot: robot.to_owned(), joints }];
        let request = ResetJointsRequest { robots, ..Default::default() };
        present(self.unary(self.joint().reset_joints(self.claimed(request))).await?.stamp, "stamp")
    }

    /// Changes joints' damping, friction, armature, springs, limits and default gains.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `JOINT_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn set_joint_properties(
        &self,
        robot: &str,
        joints: Vec<JointProperties>,
    ) -> Result<Stamp, Error> {
        let request = SetJointPropertiesRequest { robot: robot.to_owned(), joints, ..Default::default() };
        present(self.unary(self.joint().set_joint_properties(self.claimed(request))).await?.stamp, "stamp")
    }

    /// Claims robots, joints or the world for one client. Returns the secret that later requests carry: see
    /// [`with_claim`](Self::with_claim).
    ///
    /// # Errors
    /// `JOINT_CLAIMED`, `ROBOT_CLAIMED` or `WORLD_CLAIMED` if another client holds one of them.
    pub async fn claim(&self, request: ClaimJointsRequest) -> Result<String, Error> {
        Ok(self.unary(self.joint().claim_joints(request)).await?.claim)
    }

    /// Like [`claim`](Self::claim), only for joints and with a lease.
    ///
    /// # Errors
    /// As [`claim`](Self::claim).
    pub async fn claim_joints(
        &self,
        selections: Vec<JointSelection>,
        holder: &str,
        lease: Duration,
    ) -> Result<String, Error> {
        let request = ClaimJointsRequest {
            selections,
            holder: holder.to_owned(),
            lease: lease.as_secs_f64(),
            ..Default::default()
        };
        self.claim(request).await
    }

    /// Releases a claim. Joints hold their position.
    ///
    /// # Errors
    /// `CLAIM_NOT_FOUND`.
    pub async fn release_joints(&self, claim: &str) -> Result<(), Error> {
        let request = ReleaseJointsRequest { claim: claim.to_owned(), ..Default::default() };
        self.unary(self.joint().release_joints(request)).await.map(drop)
    }

    /// Returns the newest state once its `stamp.sequence` is above `after_sequence` (0 for any). After
    /// `wait`, at most 60 s, returns the present state.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `JOINT_NOT_FOUND`.
    pub async fn next_states(
        &self,
        after_sequence: u64,
        wait: Duration,
        selections: Vec<JointSelection>,
    ) -> Result<JointStates, Error> {
        let timeout = wait.as_secs_f64();
        let request = NextJointStatesRequest { after_sequence, timeout, selections, ..Default::default() };
        present(self.next_joint_states(request).await?.states, "states")
    }

    /// Like [`next_states`](Self::next_states), with all options of the schema: link poses and contacts of
    /// the same moment.
    ///
    /// # Errors
    /// As [`next_states`](Self::next_states).
    pub async fn next_joint_states(
        &self,
        request: NextJointStatesRequest,
    ) -> Result<NextJointStatesResponse, Error> {
        let wait = wall_seconds(request.timeout);
        self.unary_for(wait, self.joint().next_joint_states(request)).await
    }

    /// Streams states at a rate per wall second; 0 is the daemon's default. A slow reader reads old states:
    /// use [`Control`](crate::Control) or [`next_states`](Self::next_states) to act on them.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `JOINT_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn watch(&self, selections: Vec<JointSelection>, rate: f64) -> Result<JointWatch, Error> {
        self.watch_joint_states(WatchJointStatesRequest { selections, rate, ..Default::default() }).await
    }

    /// Like [`watch`](Self::watch), with all options of the schema: newest readings of sensors with the
    /// states, see [`JointWatch::next_answer`].
    ///
    /// # Errors
    /// As [`watch`](Self::watch), and `SENSOR_NOT_FOUND`.
    pub async fn watch_joint_states(&self, request: WatchJointStatesRequest) -> Result<JointWatch, Error> {
        let states = self.unary(self.joint().watch_joint_states(request)).await?;
        Ok(JointWatch { client: self.clone(), states })
    }
}

/// A stream of states.
#[derive(Debug)]
pub struct JointWatch {
    client: Client,
    states: Streaming<WatchJointStatesResponse>,
}

impl JointWatch {
    /// Returns the next state; `None` if the daemon ended the stream normally.
    ///
    /// # Errors
    /// Returns an error if a selected robot is gone, or the connection broke.
    pub async fn next(&mut self) -> Result<Option<JointStates>, Error> {
        match self.next_answer().await? {
            Some(answer) => present(answer.states, "states").map(Some),
            None => Ok(None),
        }
    }

    /// Returns the next state with the requested readings; `None` if the daemon ended the stream normally.
    ///
    /// # Errors
    /// Returns an error if a selected robot or sensor is gone, or the connection broke.
    pub async fn next_answer(&mut self) -> Result<Option<WatchJointStatesResponse>, Error> {
        let answer = self.states.message().await;
        answer.map_err(|status| Error::from_status(&status, self.client.endpoint()))
    }
}

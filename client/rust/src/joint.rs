//! Joints: what they are, what they do, what they are asked to do.

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

/// All joints of a robot.
pub fn every_joint(robot: &str) -> JointSelection {
    JointSelection { robot: robot.to_owned(), joints: Vec::new() }
}

/// Some joints of a robot, in this order.
pub fn some_joints(robot: &str, joints: impl IntoIterator<Item = impl Into<String>>) -> JointSelection {
    JointSelection { robot: robot.to_owned(), joints: joints.into_iter().map(Into::into).collect() }
}

/// `JointService`, but for the stream of controllers: see [`Control`](crate::Control).
impl Client {
    /// The joints of a robot, fixed ones included.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn joint_layout(&self, robot: &str) -> Result<JointLayout, Error> {
        let request = GetJointLayoutRequest { robot: robot.to_owned() };
        present(self.unary(self.joint().get_joint_layout(request)).await?.layout, "layout")
    }

    /// The newest state, at once; of all robots where nothing is selected.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `JOINT_NOT_FOUND`.
    pub async fn joint_states(&self, selections: Vec<JointSelection>) -> Result<JointStates, Error> {
        let request = GetJointStatesRequest { selections };
        present(self.unary(self.joint().get_joint_states(request)).await?.states, "states")
    }

    /// The newest state of one robot's joints, with their names: a layout and a
    /// state in one.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `JOINT_NOT_FOUND`.
    pub async fn read_joints(&self, selection: &JointSelection) -> Result<RobotReading, Error> {
        let mut layout = self.joint_layout(&selection.robot).await?;
        let mut states = self.joint_states(vec![selection.clone()]).await?;
        // A reload may have come between the two calls; two in a row are an error.
        if !RobotReading::fits(&layout, &states) {
            layout = self.joint_layout(&selection.robot).await?;
            states = self.joint_states(vec![selection.clone()]).await?;
        }
        RobotReading::new(&layout, selection, &states)
    }

    /// Gives joints of one or several robots new targets, all at one step or none.
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

    /// Gives joints of one robot new targets. What lies beyond a limit is clamped,
    /// and the answer says which those are.
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

    /// Has joints of one robot carry out a trajectory. The answer says that it is accepted, and what it is called in the event that
    /// tells how it ended.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `JOINT_NOT_FOUND`, `INVALID_VALUE`, `JOINT_NOT_ACTUATED`, `TARGET_BEYOND_LIMIT`, `JOINT_CLAIMED`,
    /// `LIMIT_EXCEEDED`.
    pub async fn follow_trajectory(
        &self,
        request: FollowTrajectoryRequest,
    ) -> Result<FollowTrajectoryResponse, Error> {
        self.unary(self.joint().follow_trajectory(self.claimed(request))).await
    }

    /// Ends a trajectory, or all of a robot. Their joints hold where they are.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `JOINT_CLAIMED`, and `INVALID_VALUE` where it has ended already.
    pub async fn cancel_trajectory(&self, robot: &str, id: Option<u64>) -> Result<Stamp, Error> {
        let request = CancelTrajectoryRequest { robot: robot.to_owned(), id, ..Default::default() };
        present(self.unary(self.joint().cancel_trajectory(self.claimed(request))).await?.stamp, "stamp")
    }

    /// Trajectories of a robot, or of all, that are carried out or wait.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn trajectories(&self, robot: Option<&str>) -> Result<Vec<Trajectory>, Error> {
        let request = ListTrajectoriesRequest { robot: robot.unwrap_or_default().to_owned() };
        Ok(self.unary(self.joint().list_trajectories(request)).await?.trajectories)
    }

    /// Puts joints of one robot at a position and a velocity; all of them back to where
    /// they were spawned where none is named.
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

    /// Takes robots, joints or the world for one client. The answer is the secret that requests come with from then on:
    /// see [`with_claim`](Self::with_claim).
    ///
    /// # Errors
    /// `JOINT_CLAIMED`, `ROBOT_CLAIMED` or `WORLD_CLAIMED` where another holds one of them.
    pub async fn claim(&self, request: ClaimJointsRequest) -> Result<String, Error> {
        Ok(self.unary(self.joint().claim_joints(request)).await?.claim)
    }

    /// The same for joints, with a lease and nothing else.
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

    /// Gives a claim back. Joints hold their position.
    ///
    /// # Errors
    /// `CLAIM_NOT_FOUND`.
    pub async fn release_joints(&self, claim: &str) -> Result<(), Error> {
        let request = ReleaseJointsRequest { claim: claim.to_owned(), ..Default::default() };
        self.unary(self.joint().release_joints(request)).await.map(drop)
    }

    /// The newest state once its `stamp.sequence` is beyond `after_sequence` (0 for
    /// any), or the state there is after `wait`, at most 60 s.
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

    /// The same with all that the schema offers: link poses and contacts of the same moment.
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

    /// States at a rate per wall second; 0 is the daemon's own. A slow reader reads
    /// old states: use [`Control`](crate::Control) or [`next_states`](Self::next_states) to act on them.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `JOINT_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn watch(&self, selections: Vec<JointSelection>, rate: f64) -> Result<JointWatch, Error> {
        self.watch_joint_states(WatchJointStatesRequest { selections, rate, ..Default::default() }).await
    }

    /// The same with all that the schema offers: newest readings of sensors beside the states, see
    /// [`JointWatch::next_answer`].
    ///
    /// # Errors
    /// As [`watch`](Self::watch), and `SENSOR_NOT_FOUND`.
    pub async fn watch_joint_states(&self, request: WatchJointStatesRequest) -> Result<JointWatch, Error> {
        let states = self.unary(self.joint().watch_joint_states(request)).await?;
        Ok(JointWatch { client: self.clone(), states })
    }
}

/// States as the daemon sends them.
#[derive(Debug)]
pub struct JointWatch {
    client: Client,
    states: Streaming<WatchJointStatesResponse>,
}

impl JointWatch {
    /// The next state; `None` where the daemon ended the stream in good order.
    ///
    /// # Errors
    /// Returns an error if a selected robot is gone, or the connection broke.
    pub async fn next(&mut self) -> Result<Option<JointStates>, Error> {
        match self.next_answer().await? {
            Some(answer) => present(answer.states, "states").map(Some),
            None => Ok(None),
        }
    }

    /// The next state with what was asked for beside it; `None` where the daemon ended the stream in good order.
    ///
    /// # Errors
    /// Returns an error if a selected robot or sensor is gone, or the connection broke.
    pub async fn next_answer(&mut self) -> Result<Option<WatchJointStatesResponse>, Error> {
        let answer = self.states.message().await;
        answer.map_err(|status| Error::from_status(&status, self.client.endpoint()))
    }
}

//! The world: its time, whether it runs, how it is stepped, and its saved states.

use std::time::Duration;

use simd_proto::v1::{
    DaemonStatistics, DeleteSavedStateRequest, GetPhysicsRequest, GetSimulationStateRequest,
    GetSimulationStateResponse, GetSimulatorInfoRequest, GetSimulatorInfoResponse, GetWorldStatisticsRequest,
    JoinLockstepRequest, LeaveLockstepRequest, ListLockstepMembersRequest, ListSavedStatesRequest,
    LockstepMember, Physics, ResetSimulationRequest, ResetSimulationResponse, RestoreStateRequest,
    SaveStateRequest, SavedStateInfo, SetPhysicsRequest, SetPhysicsResponse, SetSimulationStateRequest,
    SimulationState, Stamp, StepSimulationRequest, StepSimulationResponse, WorldStatistics,
};

use crate::{Client, Error, client::present};

/// `SimulationService`.
impl Client {
    /// Who answers: versions, limits, features. Works whatever the daemon's version.
    ///
    /// # Errors
    /// Returns an error if the daemon does not answer.
    pub async fn simulator_info(&self) -> Result<GetSimulatorInfoResponse, Error> {
        self.unary(self.simulation().get_simulator_info(GetSimulatorInfoRequest {})).await
    }

    /// Whether the world is playing, paused or stopped, and since when that is known.
    ///
    /// # Errors
    /// Returns an error if the daemon does not answer or is of another version.
    pub async fn simulation_state(&self) -> Result<GetSimulationStateResponse, Error> {
        self.unary(self.simulation().get_simulation_state(GetSimulationStateRequest {})).await
    }

    /// Lets time run.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn play(&self) -> Result<Stamp, Error> {
        self.set_simulation_state(SimulationState::Playing).await
    }

    /// Lets time stand.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn pause(&self) -> Result<Stamp, Error> {
        self.set_simulation_state(SimulationState::Paused).await
    }

    /// Pauses, and puts time and robots back to the start.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn stop(&self) -> Result<Stamp, Error> {
        self.set_simulation_state(SimulationState::Stopped).await
    }

    /// Plays, pauses or stops. The answer is the moment from which it holds.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn set_simulation_state(&self, state: SimulationState) -> Result<Stamp, Error> {
        let request = SetSimulationStateRequest { state: state.into(), ..Default::default() };
        let answer = self.unary(self.simulation().set_simulation_state(self.claimed(request))).await?;
        present(answer.stamp, "stamp")
    }

    /// Does so many steps of a world that does not play, and answers when they are
    /// done. There is no time limit: dropping the call ends the steps.
    ///
    /// # Errors
    /// `WRONG_STATE` while playing, `LIMIT_EXCEEDED` for too many, `SUPERSEDED`
    /// where a play, pause or reset came between.
    pub async fn step(&self, steps: u64) -> Result<Stamp, Error> {
        let request = StepSimulationRequest { steps, ..Default::default() };
        present(self.step_with(request).await?.stamp, "stamp")
    }

    /// Sets targets, does steps and reads the states after the last of them, in one
    /// call: a turn of a lockstep loop.
    ///
    /// ```no_run
    /// use simd_client::proto::StepSimulationRequest;
    /// use simd_client::{Client, Target, every_joint, joint_target, robot_targets};
    ///
    /// # async fn example(client: Client) -> Result<(), simd_client::Error> {
    /// let turn = StepSimulationRequest {
    ///     steps: 1,
    ///     robots: vec![robot_targets("arm", [joint_target("elbow", Target::velocity(0.5))])],
    ///     return_states: true,
    ///     selections: vec![every_joint("arm")],
    ///     ..Default::default()
    /// };
    /// let states = client.step_with(turn).await?.states;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As [`step`](Self::step), and as [`set_targets`](Self::set_targets): then nothing was done.
    pub async fn step_with(&self, request: StepSimulationRequest) -> Result<StepSimulationResponse, Error> {
        self.opened(self.simulation().step_simulation(self.claimed(request)).await)
    }

    /// Makes this client one of those that step the world together: it advances once each of them has asked. Gives
    /// what goes into `lockstep_member` of each [`StepSimulationRequest`]. Who takes longer than `timeout` from one step to asking for
    /// the next is a member no more.
    ///
    /// # Errors
    /// `INVALID_VALUE` for a time that is not within 10 ms and an hour, `LIMIT_EXCEEDED` for too many members.
    pub async fn join_lockstep(&self, timeout: Duration) -> Result<String, Error> {
        let request = JoinLockstepRequest { timeout: timeout.as_secs_f64(), ..Default::default() };
        Ok(self.unary(self.simulation().join_lockstep(request)).await?.member)
    }

    /// Ends a membership; the others go on.
    ///
    /// # Errors
    /// `LOCKSTEP_MEMBER_NOT_FOUND` where it has ended already.
    pub async fn leave_lockstep(&self, member: &str) -> Result<(), Error> {
        let request = LeaveLockstepRequest { member: member.into(), ..Default::default() };
        self.unary(self.simulation().leave_lockstep(request)).await?;
        Ok(())
    }

    /// Who steps the world together, in the order in which they joined.
    ///
    /// # Errors
    /// Returns an error if the daemon does not answer.
    pub async fn lockstep_members(&self) -> Result<Vec<LockstepMember>, Error> {
        let request = ListLockstepMembersRequest {};
        Ok(self.unary(self.simulation().list_lockstep_members(request)).await?.members)
    }

    /// Puts the world back, by scope.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn reset(&self, request: ResetSimulationRequest) -> Result<ResetSimulationResponse, Error> {
        self.unary(self.simulation().reset_simulation(self.claimed(request))).await
    }

    /// Gravity, time step, substeps, integrator, how surfaces combine, pace.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn physics(&self) -> Result<Physics, Error> {
        let answer = self.unary(self.simulation().get_physics(GetPhysicsRequest {})).await?;
        present(answer.physics, "physics")
    }

    /// Changes what is given and leaves the rest.
    ///
    /// # Errors
    /// `INVALID_VALUE` where one value is refused; then none is changed.
    pub async fn set_physics(&self, request: SetPhysicsRequest) -> Result<SetPhysicsResponse, Error> {
        self.unary(self.simulation().set_physics(self.claimed(request))).await
    }

    /// How well the world keeps time. Never waits for a step, and so is also a ping.
    ///
    /// # Errors
    /// Returns an error if the daemon does not answer or is of another version.
    pub async fn world_statistics(&self) -> Result<WorldStatistics, Error> {
        let request = GetWorldStatisticsRequest::default();
        let answer = self.unary(self.simulation().get_world_statistics(request)).await?;
        present(answer.statistics, "statistics")
    }

    /// The same, and what the daemon does for its clients and needs for that.
    ///
    /// # Errors
    /// As [`world_statistics`](Self::world_statistics). An older daemon says the first alone.
    pub async fn daemon_statistics(&self) -> Result<(WorldStatistics, Option<DaemonStatistics>), Error> {
        let request = GetWorldStatisticsRequest { daemon: true };
        let answer = self.unary(self.simulation().get_world_statistics(request)).await?;
        Ok((present(answer.statistics, "statistics")?, answer.daemon))
    }

    /// Keeps the state of the world in the daemon's memory. An empty name lets the
    /// daemon make one up; one of that name is replaced.
    ///
    /// # Errors
    /// `LIMIT_EXCEEDED` where there are too many, `OWNED_BY_ANOTHER`.
    pub async fn save_state(&self, name: &str) -> Result<SavedStateInfo, Error> {
        let (name, take_over) = (name.to_owned(), self.takes_over);
        let request = SaveStateRequest { name, take_over, ..Default::default() };
        let answer = self.unary(self.simulation().save_state(self.claimed(request))).await?;
        present(answer.saved_state, "saved_state")
    }

    /// Puts the world back to a saved state.
    ///
    /// # Errors
    /// `SAVED_STATE_NOT_FOUND`.
    pub async fn restore_state(&self, name: &str) -> Result<Stamp, Error> {
        let request = RestoreStateRequest { name: name.to_owned(), ..Default::default() };
        let answer = self.unary(self.simulation().restore_state(self.claimed(request))).await?;
        present(answer.stamp, "stamp")
    }

    /// The saved states that are kept, oldest first.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn saved_states(&self) -> Result<Vec<SavedStateInfo>, Error> {
        let answer = self.unary(self.simulation().list_saved_states(ListSavedStatesRequest {})).await?;
        Ok(answer.saved_states)
    }

    /// Forgets a saved state.
    ///
    /// # Errors
    /// `SAVED_STATE_NOT_FOUND`, `OWNED_BY_ANOTHER`.
    pub async fn delete_saved_state(&self, name: &str) -> Result<(), Error> {
        let (name, take_over) = (name.to_owned(), self.takes_over);
        let request = DeleteSavedStateRequest { name, take_over, ..Default::default() };
        self.unary(self.simulation().delete_saved_state(self.claimed(request))).await.map(drop)
    }
}

/// Wall seconds that a request asks the daemon to wait, as a duration to wait here.
pub(crate) fn wall_seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or(Duration::ZERO)
}

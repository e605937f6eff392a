//! The world: its time, its state, its steps, and its saved states.

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
    /// Returns versions, limits and features of the daemon. Works with any version of the daemon.
    ///
    /// # Errors
    /// Returns an error if the daemon does not answer.
    pub async fn simulator_info(&self) -> Result<GetSimulatorInfoResponse, Error> {
        self.unary(self.simulation().get_simulator_info(GetSimulatorInfoRequest {})).await
    }

    /// Returns whether the world is playing, paused or stopped, with the stamp of that state.
    ///
    /// # Errors
    /// Returns an error if the daemon does not answer or has another version.
    pub async fn simulation_state(&self) -> Result<GetSimulationStateResponse, Error> {
        self.unary(self.simulation().get_simulation_state(GetSimulationStateRequest {})).await
    }

    /// Plays the world.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn play(&self) -> Result<Stamp, Error> {
        self.set_simulation_state(SimulationState::Playing).await
    }

    /// Pauses the world.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn pause(&self) -> Result<Stamp, Error> {
        self.set_simulation_state(SimulationState::Paused).await
    }

    /// Pauses the world, and resets time and robots to the start.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn stop(&self) -> Result<Stamp, Error> {
        self.set_simulation_state(SimulationState::Stopped).await
    }

    /// Plays, pauses or stops. Returns the moment from which it holds.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn set_simulation_state(&self, state: SimulationState) -> Result<Stamp, Error> {
        let request = SetSimulationStateRequest { state: state.into(), ..Default::default() };
        let answer = self.unary(self.simulation().set_simulation_state(self.claimed(request))).await?;
        present(answer.stamp, "stamp")
    }

    /// Does steps of a world that does not play, and answers when they are done. Without a timeout: dropping
    /// the call ends the steps.
    ///
    /// # Errors
    /// `WRONG_STATE` while playing, `LIMIT_EXCEEDED` above the maximum, `SUPERSEDED` if a play, pause or
    /// reset came between.
    pub async fn step(&self, steps: u64) -> Result<Stamp, Error> {
        let request = StepSimulationRequest { steps, ..Default::default() };
        present(self.step_with(request).await?.stamp, "stamp")
    }

    /// Sets targets, does steps and reads the states after the last of them, in one call: a cycle of a lockstep
    /// loop.
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

    /// Makes this client one of the clients that step the world together: it advances once each of them has
    /// asked. Returns the value for `lockstep_member` of each [`StepSimulationRequest`]. A member that takes
    /// longer than `timeout` from one step to its next request loses its membership.
    ///
    /// # Errors
    /// `INVALID_VALUE` for a timeout outside 10 ms to one hour, `LIMIT_EXCEEDED` above the maximum number of
    /// members.
    pub async fn join_lockstep(&self, timeout: Duration) -> Result<String, Error> {
        let request = JoinLockstepRequest { timeout: timeout.as_secs_f64(), ..Default::default() };
        Ok(self.unary(self.simulation().join_lockstep(self.claimed(request))).await?.member)
    }

    /// Ends a membership; the others continue.
    ///
    /// # Errors
    /// `LOCKSTEP_MEMBER_NOT_FOUND` if it has already ended.
    pub async fn leave_lockstep(&self, member: &str) -> Result<(), Error> {
        let request = LeaveLockstepRequest { member: member.into(), ..Default::default() };
        self.unary(self.simulation().leave_lockstep(request)).await?;
        Ok(())
    }

    /// Returns the clients that step the world together, in the order in which they joined.
    ///
    /// # Errors
    /// Returns an error if the daemon does not answer.
    pub async fn lockstep_members(&self) -> Result<Vec<LockstepMember>, Error> {
        let request = ListLockstepMembersRequest {};
        Ok(self.unary(self.simulation().list_lockstep_members(request)).await?.members)
    }

    /// Resets the world, by scope.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn reset(&self, request: ResetSimulationRequest) -> Result<ResetSimulationResponse, Error> {
        self.unary(self.simulation().reset_simulation(self.claimed(request))).await
    }

    /// Returns gravity, time step, substeps, integrator, surface combination and pace.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn physics(&self) -> Result<Physics, Error> {
        let answer = self.unary(self.simulation().get_physics(GetPhysicsRequest {})).await?;
        present(answer.physics, "physics")
    }

    /// Changes the given values and leaves the rest.
    ///
    /// # Errors
    /// `INVALID_VALUE` if one value is refused; then none is changed.
    pub async fn set_physics(&self, request: SetPhysicsRequest) -> Result<SetPhysicsResponse, Error> {
        self.unary(self.simulation().set_physics(self.claimed(request))).await
    }

    /// Returns how well the world keeps time. Also serves as a ping: it never waits for a step.
    ///
    /// # Errors
    /// Returns an error if the daemon does not answer or has another version.
    pub async fn world_statistics(&self) -> Result<WorldStatistics, Error> {
        let request = GetWorldStatisticsRequest::default();
        let answer = self.unary(self.simulation().get_world_statistics(request)).await?;
        present(answer.statistics, "statistics")
    }

    /// Like [`world_statistics`](Self::world_statistics), with the load and the resources of the daemon.
    ///
    /// # Errors
    /// As [`world_statistics`](Self::world_statistics). An older daemon returns only the statistics of the
    /// world.
    pub async fn daemon_statistics(&self) -> Result<(WorldStatistics, Option<DaemonStatistics>), Error> {
        let request = GetWorldStatisticsRequest { daemon: true };
        let answer = self.unary(self.simulation().get_world_statistics(request)).await?;
        Ok((present(answer.statistics, "statistics")?, answer.daemon))
    }

    /// Keeps the state of the world in the daemon's memory. With an empty name, the daemon chooses one. A
    /// state of that name is replaced.
    ///
    /// # Errors
    /// `LIMIT_EXCEEDED` above the maximum number, `OWNED_BY_ANOTHER`.
    pub async fn save_state(&self, name: &str) -> Result<SavedStateInfo, Error> {
        let (name, take_over) = (name.to_owned(), self.takes_over);
        let request = SaveStateRequest { name, take_over, ..Default::default() };
        let answer = self.unary(self.simulation().save_state(self.claimed(request))).await?;
        present(answer.saved_state, "saved_state")
    }

    /// Restores a saved state.
    ///
    /// # Errors
    /// `SAVED_STATE_NOT_FOUND`.
    pub async fn restore_state(&self, name: &str) -> Result<Stamp, Error> {
        let request = RestoreStateRequest { name: name.to_owned(), ..Default::default() };
        let answer = self.unary(self.simulation().restore_state(self.claimed(request))).await?;
        present(answer.stamp, "stamp")
    }

    /// Returns the saved states, oldest first.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn saved_states(&self) -> Result<Vec<SavedStateInfo>, Error> {
        let answer = self.unary(self.simulation().list_saved_states(ListSavedStatesRequest {})).await?;
        Ok(answer.saved_states)
    }

    /// Deletes a saved state.
    ///
    /// # Errors
    /// `SAVED_STATE_NOT_FOUND`, `OWNED_BY_ANOTHER`.
    pub async fn delete_saved_state(&self, name: &str) -> Result<(), Error> {
        let (name, take_over) = (name.to_owned(), self.takes_over);
        let request = DeleteSavedStateRequest { name, take_over, ..Default::default() };
        self.unary(self.simulation().delete_saved_state(self.claimed(request))).await.map(drop)
    }
}

/// Converts a request's wall seconds to the time that the client waits.
pub(crate) fn wall_seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or(Duration::ZERO)
}

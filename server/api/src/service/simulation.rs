//! The simulation service: the world's state, time and steps.

use crate::service::status::OrStatus as _;
use std::collections::BTreeSet;
use std::time::Duration;

use simd_core::simulation::command::SavedStateInfo;
use simd_core::{Command, Reply};
use simd_proto::v1::{self, simulation_service_server::SimulationService};
use tonic::{Request, Response, Status};

use super::authorization::may_take_over;
use super::calls::{context, handle_of};
use super::joint::no_connection;
use super::mismatched;
use super::once::{once, once_in_secret};
use crate::convert::from_proto::sensor::beside;
use crate::convert::from_proto::simulation::{self as from_proto, Steps};
use crate::convert::to_proto::{
    contact as to_proto_contact, joint, kinematics as to_proto_kinematics, sensor as to_proto_sensor,
    simulation as to_proto, stamp,
};
use simd_world::SimHandle;
use simd_world::handle::Disconnect;

/// Longest wait of the answer to a step for range readings of its state.
const WAIT_FOR_RANGES: Duration = Duration::from_secs(1);

/// Serves `simd.v1.SimulationService`.
#[derive(Clone, Debug)]
pub struct Service {
    handle: SimHandle,
}

impl Service {
    /// Serves the world of a handle.
    pub fn new(handle: SimHandle) -> Self {
        Self { handle }
    }
}

fn saved_state(handle: &SimHandle, info: &SavedStateInfo) -> v1::SavedStateInfo {
    to_proto::saved_state(info, handle.saved_state_owner(&info.name).as_ref())
}

#[tonic::async_trait]
impl SimulationService for Service {
    async fn get_simulator_info(
        &self,
        request: Request<v1::GetSimulatorInfoRequest>,
    ) -> Result<Response<v1::GetSimulatorInfoResponse>, Status> {
        let grant = context(request.extensions()).grant;
        Ok(Response::new(to_proto::simulator_info(self.handle.info(), grant.as_deref())))
    }

    async fn get_simulation_state(
        &self,
        _request: Request<v1::GetSimulationStateRequest>,
    ) -> Result<Response<v1::GetSimulationStateResponse>, Status> {
        let state = self.handle.newest();
        Ok(Response::new(v1::GetSimulationStateResponse {
            state: to_proto::run_state(state.statistics.state).into(),
            stamp: Some(stamp::published(&state)),
        }))
    }

    async fn set_simulation_state(
        &self,
        request: Request<v1::SetSimulationStateRequest>,
    ) -> Result<Response<v1::SetSimulationStateResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let done = handle.set_state(from_proto::run_state(&request)?).await?;
            Ok(v1::SetSimulationStateResponse { stamp: Some(stamp::done(&done)) })
        })
        .await
    }

    async fn step_simulation(
        &self,
        request: Request<v1::StepSimulationRequest>,
    ) -> Result<Response<v1::StepSimulationResponse>, Status> {
        once(&self.handle, request, |handle, mut request| async move {
            let sensors = beside(std::mem::take(&mut request.sensors))?;
            handle.readings_beside(&sensors)?;
            let Steps { steps, member, mut targets, mut selection, with_links, with_contacts, all } =
                from_proto::steps(request)?;
            if let Some(targets) = &mut targets {
                targets.source = Some(handle.target_source());
            }
            // No step is made if its answer cannot be given.
            if let Some(selection) = &mut selection {
                selection.resolve(&handle.newest().state.world)?;
            }
            let stepped = match member.is_empty() {
                true => handle.step_with(targets, steps).await?,
                false => handle.step_with_others(&member, targets, steps).await?,
            };
            let state_of_world = &stepped.state.state;
            let (mut states, mut link_states, mut contacts) = (None, Vec::new(), Vec::new());
            if let Some(selection) = &mut selection {
                states = Some(selection.states(&stepped.state)?);
                let robots = selection.robots(&state_of_world.world)?;
                for (index, entity) in robots.iter().filter(|_| with_links) {
                    link_states.push(to_proto_kinematics::link_states(state_of_world, *index, entity));
                }
                if with_contacts {
                    let wanted: BTreeSet<usize> = robots.iter().map(|(index, _entity)| *index).collect();
                    contacts = to_proto_contact::contacts(state_of_world, |robots| {
                        all || robots.iter().any(|robot| wanted.contains(robot))
                    });
                }
            }
            let mut readings = Vec::new();
            if !sensors.is_empty() {
                let (_, newest) = handle.newest_readings(&sensors, WAIT_FOR_RANGES).await?;
                readings.extend(newest.into_iter().map(to_proto_sensor::readings));
            }
            Ok(v1::StepSimulationResponse {
                stamp: Some(stamp::done(&stepped.done)),
                states,
                clamped: joint::clamped(stepped.clamped),
                link_states,
                contacts,
                sensors: readings,
            })
        })
        .await
    }

    async fn join_lockstep(
        &self,
        request: Request<v1::JoinLockstepRequest>,
    ) -> Result<Response<v1::JoinLockstepResponse>, Status> {
        let disconnect = request.extensions().get::<Disconnect>().cloned();
        once_in_secret(&self.handle, request, |handle, request| async move {
            let until = match request.until_disconnect {
                true => Some(disconnect.ok_or_else(no_connection)?.0),
                false => None,
            };
            let caller = handle.call().caller.as_ref();
            let client = caller.map(|caller| caller.name.clone()).unwrap_or_default();
            let timeout = from_proto::lockstep_timeout(&request)?;
            let (member, members) = handle.join_lockstep(&client, timeout, until)?;
            let members = to_proto::lockstep_members(members);
            Ok(v1::JoinLockstepResponse { member: member.to_string(), members })
        })
        .await
    }

    async fn leave_lockstep(
        &self,
        request: Request<v1::LeaveLockstepRequest>,
    ) -> Result<Response<v1::LeaveLockstepResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            handle.leave_lockstep(&request.member)?;
            Ok(v1::LeaveLockstepResponse {})
        })
        .await
    }

    async fn list_lockstep_members(
        &self,
        _request: Request<v1::ListLockstepMembersRequest>,
    ) -> Result<Response<v1::ListLockstepMembersResponse>, Status> {
        let members = to_proto::lockstep_members(self.handle.lockstep_members());
        Ok(Response::new(v1::ListLockstepMembersResponse { members }))
    }

    async fn reset_simulation(
        &self,
        request: Request<v1::ResetSimulationRequest>,
    ) -> Result<Response<v1::ResetSimulationResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let done = handle.command(Command::Reset(from_proto::reset_scope(&request))).await?;
            let stamp = Some(stamp::done(&done));
            match done.applied.reply {
                Reply::Reset { deleted } => Ok(v1::ResetSimulationResponse { stamp, deleted }),
                other => Err(mismatched(&other).into()),
            }
        })
        .await
    }

    async fn get_physics(
        &self,
        _request: Request<v1::GetPhysicsRequest>,
    ) -> Result<Response<v1::GetPhysicsResponse>, Status> {
        let (settings, pace) = self.handle.physics();
        Ok(Response::new(v1::GetPhysicsResponse { physics: Some(to_proto::physics(&settings, pace)) }))
    }

    async fn set_physics(
        &self,
        request: Request<v1::SetPhysicsRequest>,
    ) -> Result<Response<v1::SetPhysicsResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let (change, pace) = from_proto::physics_change(&request)?;
            let (done, settings, pace) = handle.set_physics(change, pace).await?;
            Ok(v1::SetPhysicsResponse {
                physics: Some(to_proto::physics(&settings, pace)),
                stamp: Some(stamp::done(&done)),
            })
        })
        .await
    }

    async fn get_world_statistics(
        &self,
        request: Request<v1::GetWorldStatisticsRequest>,
    ) -> Result<Response<v1::GetWorldStatisticsResponse>, Status> {
        let state = self.handle.newest();
        let statistics = to_proto::statistics(&state, &self.handle.statistics_at(&state));
        let daemon = request.into_inner().daemon.then(|| to_proto::daemon(&self.handle));
        Ok(Response::new(v1::GetWorldStatisticsResponse { statistics: Some(statistics), daemon }))
    }

    async fn save_state(
        &self,
        request: Request<v1::SaveStateRequest>,
    ) -> Result<Response<v1::SaveStateResponse>, Status> {
        may_take_over(&request, request.get_ref().take_over, "SaveState")?;
        once(&self.handle, request, |handle, request| async move {
            let handle = handle.taking_over(request.take_over);
            // The world chooses a name if none is given, so two callers never get the same one.
            let name = from_proto::new_saved_state_name(request.name)?.unwrap_or_default();
            match handle.command(Command::SaveState { name }).await?.applied.reply {
                Reply::SavedState(info) => {
                    Ok(v1::SaveStateResponse { saved_state: Some(saved_state(&handle, &info)) })
                }
                other => Err(mismatched(&other).into()),
            }
        })
        .await
    }

    async fn restore_state(
        &self,
        request: Request<v1::RestoreStateRequest>,
    ) -> Result<Response<v1::RestoreStateResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let command = Command::RestoreState { name: from_proto::saved_state_name(request.name)? };
            let done = handle.command(command).await?;
            Ok(v1::RestoreStateResponse { stamp: Some(stamp::done(&done)) })
        })
        .await
    }

    async fn list_saved_states(
        &self,
        _request: Request<v1::ListSavedStatesRequest>,
    ) -> Result<Response<v1::ListSavedStatesResponse>, Status> {
        let state = self.handle.newest();
        let saved = state.state.saved.iter().map(|kept| saved_state(&self.handle, &kept.info()));
        let saved_states = saved.collect();
        Ok(Response::new(v1::ListSavedStatesResponse { saved_states }))
    }

    async fn delete_saved_state(
        &self,
        request: Request<v1::DeleteSavedStateRequest>,
    ) -> Result<Response<v1::DeleteSavedStateResponse>, Status> {
        may_take_over(&request, request.get_ref().take_over, "DeleteSavedState")?;
        once(&self.handle, request, |handle, request| async move {
            let handle = handle.taking_over(request.take_over);
            let command = Command::DeleteSavedState { name: from_proto::saved_state_name(request.name)? };
            handle.command(command).await?;
            Ok(v1::DeleteSavedStateResponse {})
        })
        .await
    }

    async fn export_saved_state(
        &self,
        request: Request<v1::ExportSavedStateRequest>,
    ) -> Result<Response<v1::ExportSavedStateResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let name = from_proto::saved_state_name(request.into_inner().name)?;
        let (sha256, total_bytes) = handle.export_saved_state(name).await.or_status()?;
        Ok(Response::new(v1::ExportSavedStateResponse { sha256: sha256.to_string(), total_bytes }))
    }

    async fn import_saved_state(
        &self,
        request: Request<v1::ImportSavedStateRequest>,
    ) -> Result<Response<v1::ImportSavedStateResponse>, Status> {
        may_take_over(&request, request.get_ref().take_over, "ImportSavedState")?;
        once(&self.handle, request, |handle, request| async move {
            let handle = handle.taking_over(request.take_over);
            let (sha256, name) = from_proto::import_saved_state(request)?;
            let info = handle.import_saved_state(sha256, name).await?;
            Ok(v1::ImportSavedStateResponse { saved_state: Some(saved_state(&handle, &info)) })
        })
        .await
    }
}

//! The joint service: properties, states and targets of joints.

use crate::service::status::OrStatus as _;
use std::collections::BTreeSet;

use futures_util::stream;
use simd_core::{Command, Reply};
use simd_proto::v1::{self, joint_service_server::JointService};
use tokio::time::{Interval, MissedTickBehavior, interval};
use tonic::{Request, Response, Status, Streaming};

use super::authorization::may_take_over;
use super::calls::handle_of;
use super::claims::Presented;
use super::control::Control;
use super::once::{once, once_in_secret};
use super::{BoxStream, PublishedRobot, joints_of, mismatched};
use crate::convert::from_proto::{joint as from_proto, sensor, state as from_proto_state};
use crate::convert::to_proto::entity::{link_poses as entity_link_poses, unchanged_link_poses};
use crate::convert::{Selection, to_proto, to_proto::stamp};
use simd_world::SimHandle;
use simd_world::handle::{CallError, Disconnect, SensorSelection};

/// Serves `simd.v1.JointService`.
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

#[tonic::async_trait]
impl JointService for Service {
    async fn get_joint_layout(
        &self,
        request: Request<v1::GetJointLayoutRequest>,
    ) -> Result<Response<v1::GetJointLayoutResponse>, Status> {
        let robot = from_proto::layout_of(request.into_inner())?;
        let PublishedRobot { state, index, layout: entity, joints } =
            joints_of(&self.handle, &robot).or_status()?;
        let layout = Some(to_proto::joint::layout(&state.state, index, &entity, &joints));
        Ok(Response::new(v1::GetJointLayoutResponse { layout }))
    }

    async fn get_joint_states(
        &self,
        request: Request<v1::GetJointStatesRequest>,
    ) -> Result<Response<v1::GetJointStatesResponse>, Status> {
        let mut selection = Selection::new(from_proto_state::selections(request.into_inner().selections)?);
        let states = selection.states(&self.handle.newest()).map_err(CallError::World).or_status()?;
        Ok(Response::new(v1::GetJointStatesResponse { states: Some(states) }))
    }

    async fn set_joint_targets(
        &self,
        request: Request<v1::SetJointTargetsRequest>,
    ) -> Result<Response<v1::SetJointTargetsResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let mut targets = from_proto::set_joint_targets(request)?;
            targets.source = Some(handle.target_source());
            let done = handle.command(Command::SetTargets(targets)).await?;
            let stamp = Some(stamp::done(&done));
            match done.applied.reply {
                Reply::Targets { clamped, changed_law: _ } => {
                    let clamped = to_proto::joint::clamped(clamped);
                    Ok(v1::SetJointTargetsResponse { stamp, clamped })
                }
                other => Err(mismatched(&other).into()),
            }
        })
        .await
    }

    async fn follow_trajectory(
        &self,
        request: Request<v1::FollowTrajectoryRequest>,
    ) -> Result<Response<v1::FollowTrajectoryResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let mut trajectory = from_proto::follow_trajectory(request)?;
            trajectory.source = Some(handle.target_source());
            let done = handle.command(Command::FollowTrajectory(trajectory)).await?;
            let stamp = Some(stamp::done(&done));
            match done.applied.reply {
                Reply::TrajectoryAccepted { id } => Ok(v1::FollowTrajectoryResponse { stamp, id }),
                other => Err(mismatched(&other).into()),
            }
        })
        .await
    }

    async fn cancel_trajectory(
        &self,
        request: Request<v1::CancelTrajectoryRequest>,
    ) -> Result<Response<v1::CancelTrajectoryResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let done = handle.command(from_proto::cancel_trajectory(request)?).await?;
            Ok(v1::CancelTrajectoryResponse { stamp: Some(stamp::done(&done)) })
        })
        .await
    }

    async fn list_trajectories(
        &self,
        request: Request<v1::ListTrajectoriesRequest>,
    ) -> Result<Response<v1::ListTrajectoriesResponse>, Status> {
        let robot = from_proto::trajectories_of(request.into_inner())?;
        let (state, robot) = match robot {
            Some(robot) => {
                let PublishedRobot { state, index, .. } = joints_of(&self.handle, &robot).or_status()?;
                (state, Some(index))
            }
            None => (self.handle.newest(), None),
        };
        let trajectories = to_proto::joint::trajectories(&state.state, robot);
        let stamp = Some(stamp::published(&state));
        Ok(Response::new(v1::ListTrajectoriesResponse { stamp, trajectories }))
    }

    async fn reset_joints(
        &self,
        request: Request<v1::ResetJointsRequest>,
    ) -> Result<Response<v1::ResetJointsResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let done = handle.command(from_proto::reset_joints(request)?).await?;
            Ok(v1::ResetJointsResponse { stamp: Some(stamp::done(&done)) })
        })
        .await
    }

    async fn set_joint_properties(
        &self,
        request: Request<v1::SetJointPropertiesRequest>,
    ) -> Result<Response<v1::SetJointPropertiesResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let done = handle.command(from_proto::set_joint_properties(request)?).await?;
            Ok(v1::SetJointPropertiesResponse { stamp: Some(stamp::done(&done)) })
        })
        .await
    }

    async fn claim_joints(
        &self,
        request: Request<v1::ClaimJointsRequest>,
    ) -> Result<Response<v1::ClaimJointsResponse>, Status> {
        may_take_over(&request, request.get_ref().take_over, "ClaimJoints")?;
        let disconnect = request.extensions().get::<Disconnect>().cloned();
        once_in_secret(&self.handle, request, |handle, request| async move {
            let until_disconnect = request.until_disconnect;
            let (request, lease) = from_proto::claim_joints(request)?;
            let until = match until_disconnect {
                true => Some(disconnect.ok_or_else(no_connection)?.0),
                false => None,
            };
            let (claim, done) = handle.claim(request, lease, until).await?;
            Ok(v1::ClaimJointsResponse { claim, stamp: Some(stamp::done(&done)) })
        })
        .await
    }

    async fn release_joints(
        &self,
        request: Request<v1::ReleaseJointsRequest>,
    ) -> Result<Response<v1::ReleaseJointsResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            from_proto::claim(&request)?;
            let done = handle.release().await?;
            Ok(v1::ReleaseJointsResponse { stamp: Some(stamp::done(&done)) })
        })
        .await
    }

    type ControlStream = BoxStream<v1::ControlResponse>;

    async fn control(
        &self,
        request: Request<Streaming<v1::ControlRequest>>,
    ) -> Result<Response<Self::ControlStream>, Status> {
        let handle = handle_of(&self.handle, &request);
        let presented = Presented::of(request.extensions());
        let control = Control::new(handle, presented, request.into_inner());
        Ok(Response::new(Box::pin(stream::try_unfold(control, Control::answer_next))))
    }

    async fn next_joint_states(
        &self,
        request: Request<v1::NextJointStatesRequest>,
    ) -> Result<Response<v1::NextJointStatesResponse>, Status> {
        let request = request.into_inner();
        let timeout = from_proto_state::next_timeout(request.timeout)?;
        let all = request.selections.is_empty();
        let mut selection = Selection::new(from_proto_state::selections(request.selections)?);
        // An unknown name is refused at once and not after a wait.
        selection.resolve(&self.handle.newest().state.world).map_err(CallError::World).or_status()?;
        let wanted = sensor::beside(request.sensors)?;
        self.handle.readings_beside(&wanted).or_status()?;
        let state = self.handle.newer_than(request.after_sequence, Some(timeout)).await.or_status()?;
        let (state, unchanged) = match request.changes_since {
            Some(since) => {
                drop(state);
                self.handle.newest_with_unchanged(since)
            }
            None => (state, Vec::new()),
        };
        let states = selection.changed_states(&state, &unchanged).map_err(CallError::World).or_status()?;
        let sensors = readings_beside(&self.handle, &wanted).or_status()?;
        let state_of_world = &state.state;
        let robots = selection.robots(&state_of_world.world).map_err(CallError::World).or_status()?;
        let mut link_poses = Vec::new();
        if request.return_link_poses {
            let poses = robots.iter().map(|(index, entity)| match unchanged.get(*index) {
                Some(true) => unchanged_link_poses(entity),
                _ => entity_link_poses(state_of_world, *index, entity),
            });
            link_poses.extend(poses);
        }
        let mut contacts = Vec::new();
        if request.return_contacts {
            let wanted: BTreeSet<usize> = robots.iter().map(|(index, _entity)| *index).collect();
            contacts = to_proto::contact::contacts(state_of_world, |robots| {
                all || robots.iter().any(|robot| wanted.contains(robot))
            });
        }
        Ok(Response::new(v1::NextJointStatesResponse { states: Some(states), link_poses, contacts, sensors }))
    }

    type WatchJointStatesStream = BoxStream<v1::WatchJointStatesResponse>;

    async fn watch_joint_states(
        &self,
        request: Request<v1::WatchJointStatesRequest>,
    ) -> Result<Response<Self::WatchJointStatesStream>, Status> {
        let request = request.into_inner();
        let mut ticks = interval(from_proto_state::period(request.rate)?);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        let mut selection = Selection::new(from_proto_state::selections(request.selections)?);
        selection.resolve(&self.handle.newest().state.world).map_err(CallError::World).or_status()?;
        let sensors = sensor::beside(request.sensors)?;
        self.handle.readings_beside(&sensors).or_status()?;
        let watcher = Watcher { handle: self.handle.clone(), selection, sensors, ticks, sent: 0 };
        Ok(Response::new(Box::pin(stream::try_unfold(watcher, Watcher::next))))
    }
}

/// Returns the refusal of `until_disconnect` on a transport that does not notice the end of a connection.
pub(super) fn no_connection() -> CallError {
    CallError::InvalidValue {
        element: "until_disconnect".into(),
        value: "true".into(),
        expected: "over Zenoh it needs a liveliness token of the session, and a line simd-session in the attachment: \
                   see docs/zenoh.md"
            .into(),
    }
}

/// A watcher at a rate. A state is read when the network asks for the next one; states in the network's
/// buffers are older.
struct Watcher {
    handle: SimHandle,
    selection: Selection,
    /// Sensors whose newest readings accompany the states.
    sensors: Vec<SensorSelection>,
    ticks: Interval,
    /// Sequence of the last sent state.
    sent: u64,
}

impl Watcher {
    async fn next(mut self) -> Result<Option<(v1::WatchJointStatesResponse, Self)>, Status> {
        let Some(_tick) = self.handle.draining().run_until_cancelled(self.ticks.tick()).await else {
            return Ok(None);
        };
        let state = match self.handle.newer_than(self.sent, None).await {
            Ok(state) => state,
            Err(CallError::ShuttingDown) => return Ok(None),
            Err(error) => return Err(error).or_status(),
        };
        self.sent = state.sequence;
        let states = self.selection.states(&state).map_err(CallError::World).or_status()?;
        let sensors = readings_beside(&self.handle, &self.sensors).or_status()?;
        Ok(Some((v1::WatchJointStatesResponse { states: Some(states), sensors }, self)))
    }
}

/// Returns the newest readings of sensors, for an answer with states.
pub(super) fn readings_beside(
    handle: &SimHandle,
    sensors: &[SensorSelection],
) -> Result<Vec<v1::SensorReadings>, CallError> {
    Ok(handle.readings_beside(sensors)?.into_iter().map(to_proto::sensor::readings).collect())
}

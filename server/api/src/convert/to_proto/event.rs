//! Answers of the event service.

use simd_core::simulation::EventKind;
use simd_core::simulation::command::ReleaseCause;
use simd_core::simulation::event::{Claimed, ConstraintDeletion};
use simd_core::simulation::trajectory::TrajectoryEnd;
use simd_core::{Event, Moment};
use simd_proto::v1;

use super::{simulation, stamp};
use simd_world::handle::{
    AuditedCall, BlockedJoint, LockstepChange, LogEvent, LoggedEvent, Pace, RecordingEnd,
};

/// Converts an event.
pub fn event(logged: LoggedEvent) -> v1::Event {
    let (at, kind) = log_event(logged.what);
    v1::Event {
        sequence: logged.sequence,
        stamp: Some(stamp::stamp(at, Some(logged.wall_time), logged.state_sequence)),
        kind: Some(kind),
    }
}

fn log_event(what: LogEvent) -> (Moment, v1::event::Kind) {
    match what {
        LogEvent::World(Event { at, kind }) => (at, world(kind)),
        LogEvent::PhysicsChanged { at, settings, pace } => {
            let physics = Some(simulation::physics(&settings, pace));
            (at, v1::event::Kind::PhysicsChanged(v1::PhysicsChanged { physics }))
        }
        LogEvent::StateChanged { at, state } => {
            let state = simulation::run_state(state).into();
            (at, v1::event::Kind::SimulationStateChanged(v1::SimulationStateChanged { state }))
        }
        LogEvent::LockstepChanged { at, client, change, members } => {
            let cause = match change {
                LockstepChange::Joined => v1::LockstepCause::Joined,
                LockstepChange::Left => v1::LockstepCause::Left,
                LockstepChange::TimedOut => v1::LockstepCause::TimedOut,
                LockstepChange::Disconnected => v1::LockstepCause::Disconnected,
            };
            let members = u32::try_from(members).unwrap_or(u32::MAX);
            let changed = v1::LockstepChanged { client: client.to_string(), cause: cause.into(), members };
            (at, v1::event::Kind::LockstepChanged(changed))
        }
        LogEvent::Overrun { at, dropped_lag } => (at, v1::event::Kind::Overrun(v1::Overrun { dropped_lag })),
        LogEvent::JointBlocked { at, blocked } => {
            let BlockedJoint { robot, joint, by_robot, by_link } = *blocked;
            (at, v1::event::Kind::JointBlocked(v1::JointBlocked { robot, joint, by_robot, by_link }))
        }
        LogEvent::Called { at, call } => {
            let AuditedCall { token, client, peer, transport, method, robots, code, reason } = *call;
            let transport = transport.to_owned();
            let reason = v1::ErrorReason::from_str_name(&format!("ERROR_REASON_{reason}"));
            let reason = reason.unwrap_or_default().into();
            let called = v1::AuditedCall { token, client, peer, transport, method, robots, code, reason };
            (at, v1::event::Kind::AuditedCall(called))
        }
        LogEvent::RecordingStarted { at, recording } => {
            (at, v1::event::Kind::RecordingStarted(v1::RecordingStarted { recording }))
        }
        LogEvent::RecordingEnded { at, recording, cause, message } => {
            let cause = recording_end(cause).into();
            (at, v1::event::Kind::RecordingEnded(v1::RecordingEnded { recording, cause, message }))
        }
    }
}

fn world(kind: EventKind) -> v1::event::Kind {
    match kind {
        EventKind::EntitySpawned { robot } => v1::event::Kind::EntitySpawned(v1::EntitySpawned { robot }),
        EventKind::EntityDeleted { robot } => v1::event::Kind::EntityDeleted(v1::EntityDeleted { robot }),
        EventKind::EntityReloaded { robot, layout_version } => {
            v1::event::Kind::EntityReloaded(v1::EntityReloaded { robot, layout_version })
        }
        EventKind::EntityDisabled { robot, reason } => {
            v1::event::Kind::EntityDisabled(v1::EntityDisabled { robot, reason })
        }
        EventKind::Reset(scope) => v1::event::Kind::SimulationReset(v1::SimulationReset {
            time: scope.time,
            state: scope.state,
            spawned: scope.spawned,
        }),
        // The driver logs `LogEvent::PhysicsChanged` instead, which knows the pace.
        EventKind::PhysicsChanged(settings) => v1::event::Kind::PhysicsChanged(v1::PhysicsChanged {
            physics: Some(simulation::physics(&settings, Pace::default())),
        }),
        EventKind::JointsClaimed { holder, claimed: Claimed { robots, joints, world } } => {
            v1::event::Kind::JointsClaimed(v1::JointsClaimed { holder, joints, robots, world })
        }
        EventKind::JointsReleased { holder, released: Claimed { robots, joints, world }, cause } => {
            let (cause, taken_over_by) = release_cause(cause);
            let cause = cause.into();
            v1::event::Kind::JointsReleased(v1::JointsReleased {
                holder,
                joints,
                robots,
                world,
                cause,
                taken_over_by,
            })
        }
        EventKind::ConstraintCreated { constraint } => {
            v1::event::Kind::ConstraintCreated(v1::ConstraintCreated { constraint })
        }
        EventKind::ConstraintDeleted { constraint, cause } => {
            let cause = constraint_deletion(cause).into();
            v1::event::Kind::ConstraintDeleted(v1::ConstraintDeleted { constraint, cause })
        }
        EventKind::SensorCreated { robot, sensor } => {
            v1::event::Kind::SensorCreated(v1::SensorCreated { robot, sensor })
        }
        EventKind::SensorDeleted { robot, sensor } => {
            v1::event::Kind::SensorDeleted(v1::SensorDeleted { robot, sensor })
        }
        EventKind::TrajectoryEnded { robot, id, end } => {
            let message = end.to_string();
            let outcome = match &end {
                TrajectoryEnd::Succeeded => v1::TrajectoryOutcome::Succeeded,
                TrajectoryEnd::PathToleranceViolated(_) => v1::TrajectoryOutcome::PathToleranceViolated,
                TrajectoryEnd::GoalToleranceViolated(_) => v1::TrajectoryOutcome::GoalToleranceViolated,
                TrajectoryEnd::Cancelled { .. } => v1::TrajectoryOutcome::Cancelled,
                TrajectoryEnd::Superseded => v1::TrajectoryOutcome::Superseded,
            };
            v1::event::Kind::TrajectoryEnded(v1::TrajectoryEnded {
                robot,
                id,
                outcome: outcome.into(),
                message,
            })
        }
        EventKind::StateRestored { name } => v1::event::Kind::StateRestored(v1::StateRestored { name }),
    }
}

fn constraint_deletion(cause: ConstraintDeletion) -> v1::ConstraintDeletionCause {
    match cause {
        ConstraintDeletion::Asked => v1::ConstraintDeletionCause::Deleted,
        ConstraintDeletion::Broke => v1::ConstraintDeletionCause::Broke,
        ConstraintDeletion::RobotDeleted => v1::ConstraintDeletionCause::RobotDeleted,
        ConstraintDeletion::LinkGone => v1::ConstraintDeletionCause::LinkGone,
    }
}

/// Converts the cause of a recording's end.
fn recording_end(cause: RecordingEnd) -> v1::RecordingEndCause {
    match cause {
        RecordingEnd::Stopped => v1::RecordingEndCause::Stopped,
        RecordingEnd::LimitReached => v1::RecordingEndCause::LimitReached,
        RecordingEnd::WriteFailed => v1::RecordingEndCause::WriteFailed,
        RecordingEnd::TooSlow => v1::RecordingEndCause::TooSlow,
        RecordingEnd::DaemonEnded => v1::RecordingEndCause::DaemonEnded,
    }
}

/// Converts the cause of a claim's end, and the holder that took over.
fn release_cause(cause: ReleaseCause) -> (v1::ReleaseCause, String) {
    match cause {
        ReleaseCause::Released => (v1::ReleaseCause::Released, String::new()),
        ReleaseCause::Lapsed => (v1::ReleaseCause::Lapsed, String::new()),
        ReleaseCause::Disconnected => (v1::ReleaseCause::Disconnected, String::new()),
        ReleaseCause::TakenOver { by } => (v1::ReleaseCause::TakenOver, by),
    }
}

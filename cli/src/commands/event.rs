//! `simctl event`: events in the world.

use clap::Subcommand;
use serde::Serialize;
use serde_json::{Value, json};
use simd_client::{
    Client, Observed,
    proto::{ConstraintDeletionCause, ErrorReason, LockstepCause, ReleaseCause, event::Kind},
};

use super::{ended, present, sim};
use crate::{
    failure::warn,
    output::{
        Output, View,
        json::{self, Stamp},
        number::{count, fixed},
        table::Page,
    },
};

#[derive(Debug, Subcommand)]
pub(crate) enum Event {
    /// Shows events as they happen, until Ctrl-C
    Watch {
        /// Begin after this event instead of now
        #[arg(long, default_value_t = 0, hide_default_value = true, value_name = "SEQUENCE")]
        after: u64,
        /// End after this number of events
        #[arg(short, long, value_name = "N")]
        count: Option<u64>,
    },
}

pub(crate) async fn run(command: Event, client: &Client, output: Output) -> anyhow::Result<()> {
    let Event::Watch { after, count } = command;
    tokio::select! {
        done = watch(client, output, after, count) => done,
        _ = tokio::signal::ctrl_c() => Ok(()),
    }
}

async fn watch(client: &Client, output: Output, after: u64, limit: Option<u64>) -> anyhow::Result<()> {
    let mut events = client.watch_events(after).await?;
    let mut shown = 0;
    while limit.is_none_or(|limit| shown < limit) {
        let observed = events.next().await?.ok_or_else(|| ended(client))?;
        if observed.missed > 0 {
            let missed = usize::try_from(observed.missed).unwrap_or(usize::MAX);
            warn(&format!(
                "{} before this one were lost: they came faster than simctl read them",
                count(missed, "event")
            ));
        }
        output.item(&EventView::new(observed)?)?;
        shown += 1;
    }
    Ok(())
}

/// A line of `event watch`.
#[derive(Serialize)]
struct EventView {
    sequence: u64,
    stamp: Stamp,
    /// Number of lost events before this one.
    missed: u64,
    /// For instance `entity_spawned`.
    kind: &'static str,
    /// The fields of the event's message in the schema.
    details: Value,
    #[serde(skip)]
    sentence: String,
}

impl EventView {
    fn new(observed: Observed) -> anyhow::Result<Self> {
        let event = observed.event;
        let (kind, details, sentence) = describe(event.kind);
        let stamp = present(event.stamp, "stamp")?.into();
        Ok(Self { sequence: event.sequence, stamp, missed: observed.missed, kind, details, sentence })
    }
}

impl View for EventView {
    fn page(&self) -> Page {
        let time = fixed(self.stamp.sim_time, 3);
        Page::of_line(format!("{time:>10} s  #{}  {}", self.sequence, self.sentence))
    }
}

/// Returns the kind's name, its fields, and a sentence.
fn describe(kind: Option<Kind>) -> (&'static str, Value, String) {
    match kind {
        Some(Kind::EntitySpawned(it)) => {
            ("entity_spawned", json!({ "robot": it.robot }), format!("robot {} spawned", it.robot))
        }
        Some(Kind::EntityDeleted(it)) => {
            ("entity_deleted", json!({ "robot": it.robot }), format!("robot {} deleted", it.robot))
        }
        Some(Kind::EntityReloaded(it)) => (
            "entity_reloaded",
            json!({ "robot": it.robot, "layout_version": it.layout_version }),
            format!("robot {} reloaded", it.robot),
        ),
        Some(Kind::EntityDisabled(it)) => (
            "entity_disabled",
            json!({ "robot": it.robot, "reason": it.reason }),
            format!("robot {} disabled: {}", it.robot, it.reason),
        ),
        Some(Kind::SimulationStateChanged(it)) => {
            let state = json::name("SIMULATION_STATE_", it.state().as_str_name());
            ("simulation_state_changed", json!({ "state": state }), format!("the world is {state}"))
        }
        Some(Kind::SimulationReset(it)) => {
            let scopes = [("time", it.time), ("state", it.state), ("spawned", it.spawned)];
            let names: Vec<&str> = scopes.iter().filter(|(_, is_in)| *is_in).map(|(name, _)| *name).collect();
            (
                "simulation_reset",
                json!({ "time": it.time, "state": it.state, "spawned": it.spawned }),
                format!("the world was reset ({})", names.join(", ")),
            )
        }
        Some(Kind::LockstepChanged(it)) => {
            let cause = json::name("LOCKSTEP_CAUSE_", it.cause().as_str_name());
            let client = if it.client.is_empty() { "a client" } else { &it.client };
            let text = match it.cause() {
                LockstepCause::Joined => format!("{client} joined the lockstep"),
                LockstepCause::TimedOut => {
                    format!("{client} left the lockstep: it did not ask for its step in time")
                }
                LockstepCause::Disconnected => format!("{client} left the lockstep: its connection ended"),
                LockstepCause::Left | LockstepCause::Unspecified => format!("{client} left the lockstep"),
            };
            let json = json!({ "client": it.client, "cause": cause, "members": it.members });
            ("lockstep_changed", json, format!("{text}; {} step the world together", it.members))
        }
        Some(Kind::PhysicsChanged(it)) => {
            let physics = it.physics.unwrap_or_default();
            (
                "physics_changed",
                json!({
                    "gravity": physics.gravity.as_ref().map(json::vector),
                    "time_step": physics.time_step,
                    "substeps": physics.substeps,
                    "integrator": json::name("INTEGRATOR_", physics.integrator().as_str_name()),
                    "surface_combination": json::name(sim::COMBINATION, physics.surface_combination().as_str_name()),
                    "sleeping": physics.sleeping,
                    "real_time_factor": physics.real_time_factor,
                    "pace": json::name("PACE_MODE_", physics.pace().as_str_name()),
                }),
                "the physics settings were changed".to_owned(),
            )
        }
        Some(Kind::Overrun(it)) => (
            "overrun",
            json!({ "dropped_lag": it.dropped_lag }),
            format!("the world fell behind: {} s of lag dropped", fixed(it.dropped_lag, 3)),
        ),
        Some(Kind::JointBlocked(it)) => {
            let link = if it.by_link.is_empty() { String::new() } else { format!(" with {}", it.by_link) };
            (
                "joint_blocked",
                json!({
                    "robot": it.robot, "joint": it.joint, "by_robot": it.by_robot, "by_link": it.by_link,
                }),
                format!("{} blocks joint {} of {}{link}", it.by_robot, it.joint, it.robot),
            )
        }
        Some(Kind::JointsClaimed(it)) => (
            "joints_claimed",
            json!({ "holder": it.holder, "joints": it.joints, "robots": it.robots, "world": it.world }),
            format!("{} claimed {}", it.holder, claimed(it.world, &it.robots, &it.joints)),
        ),
        Some(Kind::JointsReleased(it)) => {
            let cause = json::name("RELEASE_CAUSE_", it.cause().as_str_name());
            let what = claimed(it.world, &it.robots, &it.joints);
            let sentence = match it.cause() {
                ReleaseCause::Unspecified | ReleaseCause::Released => {
                    format!("{} released {what}", it.holder)
                }
                ReleaseCause::Lapsed => format!("{} let lapse {what}", it.holder),
                ReleaseCause::Disconnected => format!("{} disconnected and released {what}", it.holder),
                ReleaseCause::TakenOver => {
                    format!("{} took over from {}: {what}", it.taken_over_by, it.holder)
                }
            };
            let details = json!({
                "holder": it.holder, "joints": it.joints, "robots": it.robots, "world": it.world, "cause": cause,
                "taken_over_by": it.taken_over_by,
            });
            ("joints_released", details, sentence)
        }
        Some(Kind::ConstraintCreated(it)) => (
            "constraint_created",
            json!({ "constraint": it.constraint }),
            format!("constraint {} created", it.constraint),
        ),
        Some(Kind::ConstraintDeleted(it)) => {
            let cause = json::name("CONSTRAINT_DELETION_CAUSE_", it.cause().as_str_name());
            let sentence = match it.cause() {
                ConstraintDeletionCause::Unspecified | ConstraintDeletionCause::Deleted => {
                    format!("constraint {} deleted", it.constraint)
                }
                ConstraintDeletionCause::Broke => format!("constraint {} broke", it.constraint),
                ConstraintDeletionCause::RobotDeleted => {
                    format!("constraint {} was removed with its robot", it.constraint)
                }
                ConstraintDeletionCause::LinkGone => {
                    format!("constraint {} was removed with its link", it.constraint)
                }
            };
            ("constraint_deleted", json!({ "constraint": it.constraint, "cause": cause }), sentence)
        }
        Some(Kind::SensorCreated(it)) => (
            "sensor_created",
            json!({ "robot": it.robot, "sensor": it.sensor }),
            format!("sensor {} of robot {} created", it.sensor, it.robot),
        ),
        Some(Kind::SensorDeleted(it)) => (
            "sensor_deleted",
            json!({ "robot": it.robot, "sensor": it.sensor }),
            format!("sensor {} of robot {} deleted", it.sensor, it.robot),
        ),
        Some(Kind::RecordingStarted(it)) => (
            "recording_started",
            json!({ "recording": it.recording }),
            format!("recording {} started", it.recording),
        ),
        Some(Kind::RecordingEnded(it)) => {
            let cause = json::name("RECORDING_END_CAUSE_", it.cause().as_str_name());
            (
                "recording_ended",
                json!({ "recording": it.recording, "cause": cause, "message": it.message }),
                format!("recording {} ended: {}", it.recording, it.message),
            )
        }
        Some(Kind::TrajectoryEnded(it)) => (
            "trajectory_ended",
            json!({
                "robot": it.robot, "id": it.id, "outcome": it.outcome().as_str_name(), "message": it.message,
            }),
            format!("trajectory {} of {} ended: {}", it.id, it.robot, it.message),
        ),
        Some(Kind::AuditedCall(it)) => {
            let result = match it.reason() {
                _ if it.code == 0 => "ok".to_owned(),
                ErrorReason::Unspecified => format!("refused with code {}", it.code),
                reason => format!("refused: {}", json::name("ERROR_REASON_", reason.as_str_name())),
            };
            let robots =
                if it.robots.is_empty() { String::new() } else { format!(" ({})", it.robots.join(", ")) };
            let sentence = format!("{} called {}{robots}: {result}", it.token, it.method);
            let details = json!({
                "token": it.token, "client": it.client, "peer": it.peer, "transport": it.transport, "method": it.method,
                "robots": it.robots, "result": result,
            });
            ("audited_call", details, sentence)
        }
        Some(Kind::StateRestored(it)) => {
            ("state_restored", json!({ "name": it.name }), format!("saved state {} restored", it.name))
        }
        // A newer daemon may have kinds that this client does not know.
        None => ("unknown", json!({}), "an event of a kind that this simctl does not know".to_owned()),
    }
}

/// Describes the object of a claim: joints of robots that are claimed as a whole are not listed.
fn claimed(world: bool, robots: &[String], joints: &[String]) -> String {
    let is_of_whole = |joint: &&String| robots.iter().any(|robot| joint.split('/').next() == Some(robot));
    let joints = joints.iter().filter(|joint| !is_of_whole(joint)).cloned();
    let world = world.then(|| "the world".to_owned());
    let all: Vec<String> = world.into_iter().chain(robots.iter().cloned()).chain(joints).collect();
    if all.is_empty() { "robots that no longer exist".to_owned() } else { all.join(", ") }
}

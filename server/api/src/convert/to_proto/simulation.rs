//! Answers of the simulation service.

use std::time::SystemTime;

use simd_core::simulation::command::SavedStateInfo;
use simd_core::{BulletContacts, Integrator, PhysicsSettings, SurfaceCombination};
use simd_model::robot::JointKind;
use simd_proto::{API_VERSION, v1};

use super::geometry::vector;
use super::stamp;
use simd_world::access::Grant;
use simd_world::handle::{
    DaemonInfo, DaemonLimits, LockstepMember, Owner, Pace, Published, RunState, Statistics,
};
use simd_world::histogram::Counts;
use simd_world::{SimHandle, process};

/// Optional features that this daemon has.
const FEATURES: [&str; 8] =
    ["claims", "events", "health", "kinematics", "parameters", "reflection", "saved_states", "wrenches"];

/// Describes this daemon, and the caller's rights.
pub fn simulator_info(info: &DaemonInfo, grant: Option<&Grant>) -> v1::GetSimulatorInfoResponse {
    v1::GetSimulatorInfoResponse {
        simulator: "simd".to_owned(),
        version: info.version.to_owned(),
        api_major: API_VERSION.major,
        api_minor: API_VERSION.minor,
        name: info.name.clone(),
        limits: Some(limits(&info.limits)),
        features: FEATURES.map(str::to_owned).to_vec(),
        token: grant.map(|grant| v1::TokenInfo {
            name: grant.name.clone(),
            role: grant.role.name().to_owned(),
            expires: grant.expires,
        }),
    }
}

fn limits(limits: &DaemonLimits) -> v1::RequestLimits {
    v1::RequestLimits {
        max_robots: limits.robots,
        max_links: limits.links,
        max_description_bytes: limits.description_bytes,
        max_asset_bytes: limits.asset_bytes,
        max_upload_store_bytes: limits.upload_store_bytes,
        max_message_bytes: limits.message_bytes,
        max_steps: limits.steps,
        max_saved_states: limits.saved_states,
        max_parameters: limits.parameters,
    }
}

/// Converts the run state of the world.
pub fn run_state(state: RunState) -> v1::SimulationState {
    match state {
        RunState::Stopped => v1::SimulationState::Stopped,
        RunState::Playing => v1::SimulationState::Playing,
        RunState::Paused => v1::SimulationState::Paused,
    }
}

/// Converts the settings in force.
pub fn physics(settings: &PhysicsSettings, pace: Pace) -> v1::Physics {
    let mode = match pace {
        Pace::RealTime { .. } => v1::PaceMode::RealTime,
        Pace::AsFastAsPossible { .. } => v1::PaceMode::AsFastAsPossible,
    };
    let integrator = match settings.integrator {
        Integrator::Leapfrog => v1::Integrator::Leapfrog,
        Integrator::Euler => v1::Integrator::Euler,
        Integrator::Bullet(_) => v1::Integrator::Bullet,
    };
    let bullet_contacts =
        settings.integrator.bullet().map(|BulletContacts { error_reduction, slop, bounce_speed }| {
            v1::BulletContacts {
                error_reduction: Some(error_reduction),
                slop: Some(slop),
                bounce_speed: Some(bounce_speed),
            }
        });
    let combination = match settings.surface_combination {
        SurfaceCombination::Min => v1::SurfaceCombination::Min,
        SurfaceCombination::Multiply => v1::SurfaceCombination::Multiply,
        SurfaceCombination::Max => v1::SurfaceCombination::Max,
    };
    v1::Physics {
        gravity: Some(vector(settings.gravity)),
        time_step: settings.time_step,
        substeps: settings.substeps,
        real_time_factor: pace.factor(),
        pace: mode.into(),
        integrator: integrator.into(),
        surface_combination: combination.into(),
        sleeping: settings.sleeping,
        bullet_contacts,
    }
}

/// Converts statistics about how well the world keeps time.
pub fn statistics(newest: &Published, now: &Statistics) -> v1::WorldStatistics {
    let entities = &newest.state.world.entities;
    let moving = entities
        .iter()
        .flat_map(|entity| &entity.model.joints)
        .filter(|joint| joint.kind != JointKind::Fixed)
        .count();
    v1::WorldStatistics {
        stamp: Some(stamp::published(newest)),
        state: run_state(now.state).into(),
        target_real_time_factor: match now.pace {
            Pace::RealTime { factor } => factor,
            Pace::AsFastAsPossible { .. } => f64::INFINITY,
        },
        real_time_factor: now.real_time_factor,
        overruns: now.overruns,
        dropped_lag: now.dropped_lag,
        iterations: now.iterations,
        robots: count(entities.len()),
        joints: count(moving),
        step_duration: now.step_duration,
        mailbox_refusals: now.mailbox_refusals,
        claimed_by: newest.state.claimed_by.as_deref().unwrap_or_default().to_owned(),
    }
}

/// Returns the daemon's present load and use of resources.
pub fn daemon(handle: &SimHandle) -> v1::DaemonStatistics {
    let calls = handle.call_counts();
    let ended = || calls.iter().flat_map(|of| &of.ended);
    let is_failed = |((code, _), _): &&((i32, &str), u64)| *code != i32::from(tonic::Code::Ok);
    let (duration, lateness) = handle.step_times();
    v1::DaemonStatistics {
        wall_time: Some(stamp::timestamp(SystemTime::now())),
        calls: ended().map(|(_, count)| count).sum(),
        failed_calls: ended().filter(is_failed).map(|(_, count)| count).sum(),
        streams: u32::try_from(calls.iter().map(|of| of.streams).sum::<u64>()).unwrap_or(u32::MAX),
        claims: count(handle.claim_count()),
        mailbox_waiting: count(handle.mailbox().0),
        resident_bytes: process::resident_bytes().unwrap_or(0),
        open_files: process::open_files().map_or(0, count),
        step_duration: Some(histogram(&duration)),
        step_lateness: Some(histogram(&lateness)),
    }
}

fn histogram(counts: &Counts) -> v1::DurationHistogram {
    let (upper_bounds, each) = counts.buckets.iter().copied().unzip();
    v1::DurationHistogram { sum: counts.sum, upper_bounds, counts: each }
}

/// Converts a saved state. No state was published for its moment, so it has no wall time.
pub fn saved_state(info: &SavedStateInfo, owner: Option<&Owner>) -> v1::SavedStateInfo {
    v1::SavedStateInfo {
        name: info.name.clone(),
        stamp: Some(stamp::stamp(info.at, None, 0)),
        robots: count(info.robots),
        owner: owner.map(ToString::to_string).unwrap_or_default(),
    }
}

/// Converts a count to the wire's type.
pub(super) fn count(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}

/// Converts the members of the lockstep.
pub fn lockstep_members(members: Vec<LockstepMember>) -> Vec<v1::LockstepMember> {
    let member = |LockstepMember { client, timeout, waits_for }: LockstepMember| v1::LockstepMember {
        client: client.to_string(),
        timeout: timeout.as_secs_f64(),
        waits_for,
    };
    members.into_iter().map(member).collect()
}

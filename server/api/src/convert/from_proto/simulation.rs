//! Requests of the simulation service.

use std::time::Duration;

use simd_core::simulation::command::{PhysicsChange, ResetScope, SetTargets};
use simd_core::{BulletContacts, Integrator, SurfaceCombination};
use simd_model::robot::Sha256;
use simd_proto::v1;

use super::entity::sha256;
use super::{geometry, joint, state};
use crate::convert::Selection;
use crate::convert::field::{BadField, Path};
use simd_world::handle::{PaceChange, RunState};

/// Parses the requested state of the world.
pub fn run_state(request: &v1::SetSimulationStateRequest) -> Result<RunState, BadField> {
    let at = Path::ROOT.field("state");
    match at.known(request.state)? {
        v1::SimulationState::Unspecified => {
            Err(at.refuse("not given", "it must be STOPPED, PLAYING or PAUSED"))
        }
        v1::SimulationState::Stopped => Ok(RunState::Stopped),
        v1::SimulationState::Playing => Ok(RunState::Playing),
        v1::SimulationState::Paused => Ok(RunState::Paused),
    }
}

/// Request for steps.
#[derive(Debug)]
pub struct Steps {
    /// Number of steps.
    pub steps: u64,
    /// Lockstep member that asks; empty outside of a lockstep.
    pub member: String,
    /// Targets to set before the first step.
    pub targets: Option<SetTargets>,
    /// Joints whose states the answer has; `None` for no states.
    pub selection: Option<Selection>,
    /// Whether the answer also has the links of those robots.
    pub with_links: bool,
    /// Whether the answer also has the contacts of those robots.
    pub with_contacts: bool,
    /// Whether the selection has all robots.
    pub all: bool,
}

/// Parses a request for steps.
pub fn steps(request: v1::StepSimulationRequest) -> Result<Steps, BadField> {
    let targets = joint::set_targets(request.robots, request.limit_policy)?;
    let all = request.selections.is_empty();
    let selections = state::selections(request.selections)?;
    Ok(Steps {
        steps: request.steps,
        member: request.lockstep_member,
        targets: (!targets.robots.is_empty()).then_some(targets),
        selection: request.return_states.then(|| Selection::new(selections)),
        with_links: request.return_link_states,
        with_contacts: request.return_contacts,
        all,
    })
}

/// Parses the scope of a reset.
pub fn reset_scope(request: &v1::ResetSimulationRequest) -> ResetScope {
    ResetScope { time: request.time, state: request.state, spawned: request.spawned }
}

/// Parses new settings; absent ones stay unchanged.
pub fn physics_change(request: &v1::SetPhysicsRequest) -> Result<(PhysicsChange, PaceChange), BadField> {
    let gravity = request.gravity.map(geometry::vector);
    let integrator = match Path::ROOT.field("integrator").known(request.integrator)? {
        v1::Integrator::Unspecified => None,
        v1::Integrator::Leapfrog => Some(Integrator::Leapfrog),
        v1::Integrator::Euler => Some(Integrator::Euler),
        v1::Integrator::Bullet => Some(Integrator::Bullet(bullet_contacts(request.bullet_contacts.as_ref()))),
    };
    if request.bullet_contacts.is_some() && integrator.and_then(Integrator::bullet).is_none() {
        let expected = "it needs INTEGRATOR_BULLET in `integrator`";
        return Err(Path::ROOT.field("bullet_contacts").refuse("given", expected));
    }
    let combination = Path::ROOT.field("surface_combination").known(request.surface_combination)?;
    let surface_combination = match combination {
        v1::SurfaceCombination::Unspecified => None,
        v1::SurfaceCombination::Min => Some(SurfaceCombination::Min),
        v1::SurfaceCombination::Multiply => Some(SurfaceCombination::Multiply),
        v1::SurfaceCombination::Max => Some(SurfaceCombination::Max),
    };
    let v1::SetPhysicsRequest { time_step, substeps, sleeping, .. } = *request;
    let change = PhysicsChange { gravity, time_step, substeps, integrator, surface_combination, sleeping };
    Ok((change, pace(request)?))
}

/// Parses the law of contacts; absent numbers have their defaults.
fn bullet_contacts(given: Option<&v1::BulletContacts>) -> BulletContacts {
    let default = BulletContacts::default();
    let v1::BulletContacts { error_reduction, slop, bounce_speed } = given.copied().unwrap_or_default();
    BulletContacts {
        error_reduction: error_reduction.unwrap_or(default.error_reduction),
        slop: slop.unwrap_or(default.slop),
        bounce_speed: bounce_speed.unwrap_or(default.bounce_speed),
    }
}

fn pace(request: &v1::SetPhysicsRequest) -> Result<PaceChange, BadField> {
    let as_fast_as_possible = match Path::ROOT.field("pace").known(request.pace)? {
        v1::PaceMode::Unspecified => None,
        v1::PaceMode::RealTime => Some(false),
        v1::PaceMode::AsFastAsPossible => Some(true),
    };
    Ok(PaceChange { as_fast_as_possible, factor: request.real_time_factor })
}

/// Accepts the name of a saved state.
pub fn saved_state_name(name: String) -> Result<String, BadField> {
    Path::ROOT.field("name").name(name)
}

/// Parses the name of a new saved state; `None` lets the daemon choose one.
pub fn new_saved_state_name(name: String) -> Result<Option<String>, BadField> {
    let name = Path::ROOT.field("name").short(name)?;
    Ok((!name.is_empty()).then_some(name))
}

/// Returns the digest of a saved state's file, and the new name; if empty, the name in the file is used.
pub fn import_saved_state(request: v1::ImportSavedStateRequest) -> Result<(Sha256, String), BadField> {
    let digest = sha256(&Path::ROOT.field("sha256"), &request.sha256)?;
    Ok((digest, Path::ROOT.field("name").short(request.name)?))
}

/// Returns the longest time that a member of a lockstep may take to ask for its next step.
///
/// # Errors
/// Returns an error if the timeout is out of range.
pub fn lockstep_timeout(request: &v1::JoinLockstepRequest) -> Result<Duration, BadField> {
    let seconds = if request.timeout == 0.0 { 10.0 } else { request.timeout };
    Duration::try_from_secs_f64(seconds)
        .map_err(|_error| Path::ROOT.field("timeout").refuse(seconds, "it must be a number of seconds"))
}

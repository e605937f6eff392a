//! Saved states of the world: named ones, and validated ones from elsewhere.

use std::collections::BTreeSet;
use std::sync::Arc;

use simd_model::RobotModel;

use super::entity::{Description, Entity, check_own_pairs, tree_for};
use super::error::Error;
use super::moment::Moment;
use super::pull::ActivePull;
use super::sensors::SensorCount;
use super::settings::{BulletContacts, PhysicsSettings, SUBSTEPS, TIME_STEP};
use super::trajectory::{ActiveTrajectory, TrajectoryJoint};
use super::world_state::{EntityState, InvalidState, RobotState, WorldState};
use super::wrench::{ActiveWrench, MAX_WRENCH_DURATION, WrenchDuration};
use crate::collision::{Groups, LinkPair, RestPose, RobotColliders, Shapes, Surface};
use crate::dynamics::Tree;
use crate::dynamics::link_damping::LinkDamping;
use crate::valid::{finite, pose, sizes};

/// State of a world with the descriptions of its robots. Cheap to share; two are equal if they are the same.
#[derive(Clone, Debug)]
pub struct Saved(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    state: WorldState,
    /// Descriptions, one for each robot.
    robots: Vec<Description>,
}

/// Parts of a robot: its model and its collision shapes.
pub type RobotParts = (Arc<RobotModel>, Arc<Shapes>);

/// Saved state of a world with its name. Cheap to copy.
#[derive(Clone, Debug)]
pub struct NamedSavedState {
    pub(super) name: String,
    pub(super) saved: Saved,
    /// First version of its robots here, if the state came from elsewhere: their versions there may belong to
    /// others here.
    pub(super) versions: Option<u64>,
}

/// Description of a saved state.
#[derive(Clone, Debug, PartialEq)]
pub struct SavedStateInfo {
    /// Name of the saved state.
    pub name: String,
    /// Moment of the saved state.
    pub at: Moment,
    /// Number of robots.
    pub robots: usize,
}

/// Maximum number of steps of a world, so that counting from there does not overflow: half a million years of
/// milliseconds would not reach it.
const MAX_STEPS: u64 = 1 << 53;

impl PartialEq for Saved {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

pub(super) fn no_saved_state(saved: &[NamedSavedState], name: &str) -> Error {
    let known = saved.iter().map(|kept| kept.name.clone()).collect();
    Error::SavedStateNotFound { name: name.to_owned(), known }
}

impl NamedSavedState {
    /// Returns the state.
    pub fn saved(&self) -> &Saved {
        &self.saved
    }

    /// Returns its description.
    pub fn info(&self) -> SavedStateInfo {
        let Inner { state, robots } = &*self.saved.0;
        let at = Moment { epoch: 0, step: state.step, sim_time: state.sim_time };
        SavedStateInfo { name: self.name.clone(), at, robots: robots.len() }
    }

    /// Returns the descriptions of its robots, with their versions here.
    pub(super) fn descriptions(&self) -> Vec<Description> {
        self.versions.map_or_else(|| self.saved.0.robots.clone(), |first| self.saved.descriptions(first))
    }

    /// Returns whether it came from elsewhere: its ids belong to another world.
    pub(super) fn is_foreign(&self) -> bool {
        self.versions.is_some()
    }
}

impl Saved {
    /// Creates the saved state of a present world.
    pub(super) fn of_world(state: WorldState, robots: Vec<Description>) -> Self {
        Self(Arc::new(Inner { state, robots }))
    }

    /// Returns the state of an empty world that was never stepped.
    pub(super) fn nothing() -> Self {
        let state = WorldState {
            step: 0,
            sim_time: 0.0,
            time_base: (0, 0.0),
            settings: PhysicsSettings::default(),
            robots: Vec::new(),
            contacts: Vec::new(),
            ignored_overlaps: Vec::new(),
            collision_pairs: Arc::default(),
            constraints: Vec::new(),
        };
        Self::of_world(state, Vec::new())
    }

    /// Returns the descriptions of its robots, with versions from `first` on.
    pub(super) fn descriptions(&self, first: u64) -> Vec<Description> {
        let robots = self.0.robots.iter().zip(first..);
        robots.map(|(robot, version)| Description { version, ..robot.clone() }).collect()
    }

    /// Returns the number of robots.
    pub(super) fn robot_count(&self) -> usize {
        self.0.robots.len()
    }

    /// Returns the state.
    pub fn world_state(&self) -> &WorldState {
        &self.0.state
    }

    /// Returns the robots' models, in the order of their spawning.
    pub fn models(&self) -> impl Iterator<Item = &Arc<RobotModel>> {
        self.0.robots.iter().map(|robot| &robot.model)
    }

    /// Returns the parts of its robots, in the order of their spawning.
    pub fn parts(&self) -> Vec<RobotParts> {
        self.0.robots.iter().map(|robot| (Arc::clone(&robot.model), Arc::clone(&robot.shapes))).collect()
    }

    /// Creates a state from elsewhere, of which every number is validated: an accepted state can be stepped.
    /// `parts` has one entry for each robot.
    ///
    /// # Errors
    /// Returns an error if no world can be in such a state.
    pub fn new(mut state: WorldState, parts: Vec<RobotParts>) -> Result<Self, InvalidState> {
        check_world(&state).map_err(InvalidState::World)?;
        if state.robots.len() != parts.len() {
            return Err(InvalidState::World(format!(
                "{} robots have {} models",
                state.robots.len(),
                parts.len()
            )));
        }
        let mut names = BTreeSet::new();
        let mut entities = Vec::with_capacity(parts.len());
        for (robot, parts) in state.robots.iter_mut().zip(parts) {
            let name = robot.entity.name.clone();
            if !simd_model::is_wire_name(&name) {
                return Err(InvalidState::World(format!("{name:?} is not a valid name of a robot")));
            }
            if !names.insert(name.clone()) {
                return Err(InvalidState::World(format!("there are two robots {name:?}")));
            }
            let invalid = |what| InvalidState::Robot { robot: name, what };
            let entity = checked(robot, parts, &entities, state.sim_time).map_err(invalid)?;
            entities.push(entity);
        }
        let sensors = state.robots.iter().flat_map(|robot| &robot.entity.sensors);
        let count = SensorCount::of(sensors.map(|sensor| &sensor.definition.kind));
        SensorCount::default().check(count).map_err(|error| InvalidState::World(error.to_string()))?;
        super::contacts::complete(&entities, &mut state.contacts).map_err(InvalidState::World)?;
        super::contacts::check_ignored_overlaps(&entities, &state.ignored_overlaps)
            .map_err(InvalidState::World)?;
        super::contacts::check_pairs(&entities, &state.collision_pairs).map_err(InvalidState::World)?;
        super::constraints::check(&entities, &state.constraints).map_err(InvalidState::World)?;
        let robots = entities.iter().map(Entity::description).collect();
        Ok(Self(Arc::new(Inner { state, robots })))
    }
}

fn check_world(state: &WorldState) -> Result<(), String> {
    let WorldState { step, sim_time, time_base, settings, .. } = *state;
    let PhysicsSettings { gravity, time_step, substeps, integrator, .. } = settings;
    if step > MAX_STEPS || time_base.0 > step {
        return Err(format!("it is at step {step}, with time counted from step {}", time_base.0));
    }
    sizes("the time has numbers", [sim_time, time_base.1])?;
    finite("gravity has numbers", gravity.to_array())?;
    if !TIME_STEP.contains(&time_step) || !SUBSTEPS.contains(&substeps) {
        return Err(format!("its time step of {time_step} s in {substeps} parts cannot be"));
    }
    let mut contacts = integrator.bullet().into_iter().flat_map(BulletContacts::ranges);
    match contacts.find(|(_, value, range)| !range.contains(value)) {
        Some((name, value, _)) => Err(format!("its contacts have the {name} {value}, which cannot be")),
        None => Ok(()),
    }
}

/// Returns a robot in this state, in a world at this sim time that already has `others`. The error is a
/// fragment of a sentence.
fn checked(
    robot: &mut RobotState,
    (model, shapes): RobotParts,
    others: &[Entity],
    now: f64,
) -> Result<Entity, String> {
    let RobotState { entity, body } = &mut *robot;
    let EntityState {
        name: _,
        loaded_at_start: _,
        fixed_base,
        contact_settings: _,
        surfaces,
        groups,
        link_damping,
        collision_pairs,
        asleep,
        rest_poses,
        teleported: _,
        still_for,
        disabled,
        spawned,
        last_good,
        applied_wrenches,
        expired_wrenches,
        pulls,
        trajectories,
        // Checked when the robot exists.
        sensors: _,
    } = entity;
    let tree = tree_for(others, &model, *fixed_base);
    check_last_good(&tree, last_good)?;
    check_wrenches(&tree, applied_wrenches.iter().chain(&*expired_wrenches))?;
    check_pulls(&tree, pulls)?;
    sizes("a time of rest", [*still_for])?;
    check_trajectories(&model, &tree, trajectories)?;
    body.check(&tree)?;
    spawned.check(&tree).map_err(|what| format!("{what}, in the state that it was spawned with"))?;
    surfaces.iter().try_for_each(Surface::check)?;
    check_filter(model.links.len(), groups, collision_pairs)?;
    check_damping(model.links.len(), link_damping)?;
    if let Some(reason) = disabled.as_ref().filter(|reason| reason.len() > MAX_REASON) {
        return Err(format!("a reason of {} bytes for which it is disabled, of {MAX_REASON}", reason.len()));
    }
    for RestPose { world_from_shape, margin, drift } in &*rest_poses {
        pose("the pose of a collider", world_from_shape)?;
        sizes("margins of colliders", [*margin])?;
        finite("motions of colliders", drift.to_array())?;
    }
    // A sleeping robot may wake within a step, and then needs a state to restore.
    if *asleep && last_good.0.is_empty() {
        *last_good = (body.positions.clone(), body.velocities.clone());
    }
    if robot.entity.contact_settings.self_collision {
        let colliders = RobotColliders::new(&tree, &shapes, Surface::default());
        check_own_pairs(&robot.entity.name, &colliders).map_err(|error| error.to_string())?;
    }
    let description = Description { version: 0, model, tree, shapes };
    let entity = Entity::from_state(&description, robot.clone());
    entity.check_contact_settings().map_err(|error| format!("a surface that cannot be: {error}"))?;
    entity.check_sensors(now)?;
    let EntityState { surfaces, rest_poses, asleep, .. } = &robot.entity;
    let colliders = entity.colliders.len();
    for (what, there, needed) in [
        ("surfaces", surfaces.len(), colliders),
        ("poses of colliders", rest_poses.len(), if *asleep { colliders } else { 0 }),
    ] {
        if there != needed {
            return Err(format!("{there} {what}; its model has {needed}"));
        }
    }
    if *asleep && !entity.may_sleep() {
        return Err(
            "a sleep that only a single free body can be in, and only if it does not stay awake".into()
        );
    }
    Ok(entity)
}

fn check_filter(links: usize, groups: &[Groups], pairs: &[LinkPair]) -> Result<(), String> {
    if groups.len() != links {
        return Err(format!("collision groups of {} links; its model has {links}", groups.len()));
    }
    let sound = pairs.iter().all(|pair| pair.links[0] < pair.links[1] && pair.links[1] < links);
    if sound && pairs.is_sorted_by(|a, b| a.links < b.links) {
        return Ok(());
    }
    Err("collision pairs that are not of its links, or not in order".into())
}

fn check_damping(links: usize, damping: &[LinkDamping]) -> Result<(), String> {
    if !damping.is_empty() && damping.len() != links {
        return Err(format!("damping of {} links; its model has {links}", damping.len()));
    }
    let is_sound = |value: f64| (0.0..=LinkDamping::MAX).contains(&value);
    let all = damping.iter().all(|damping| is_sound(damping.linear) && is_sound(damping.angular));
    if all { Ok(()) } else { Err("damping of a link that is negative or too large".into()) }
}

/// Maximum length of the reason why a robot is disabled, bytes: clients see it.
const MAX_REASON: usize = 8192;

fn check_last_good(tree: &Tree, (positions, velocities): &(Vec<f64>, Vec<f64>)) -> Result<(), String> {
    let none = positions.is_empty() && velocities.is_empty();
    if !none && (positions.len(), velocities.len()) != (tree.position_count, tree.velocity_count) {
        return Err(format!(
            "{} positions and {} velocities before the last step; its model has {} and {}",
            positions.len(),
            velocities.len(),
            tree.position_count,
            tree.velocity_count
        ));
    }
    finite("a state before the last step", positions.iter().chain(velocities).copied())
}

/// Checks that each trajectory has joints for which it could have been accepted.
fn check_trajectories(
    model: &RobotModel,
    tree: &Tree,
    trajectories: &[ActiveTrajectory],
) -> Result<(), String> {
    trajectories.iter().try_for_each(|trajectory| {
        trajectory.check(model.joints.len())?;
        let has_one_axis = |joint: &TrajectoryJoint| {
            model.joints[joint.joint].mimic.is_none()
                && tree.joints[joint.joint].len() == 1
                && tree.bodies[tree.joints[joint.joint].start].joint_type.velocities() == 1
        };
        if !trajectory.joints.iter().all(has_one_axis) {
            return Err("a trajectory of a joint that has not one axis, or that nothing drives".to_owned());
        }
        Ok(())
    })
}

fn check_wrenches<'a>(
    tree: &Tree,
    mut wrenches: impl Iterator<Item = &'a ActiveWrench>,
) -> Result<(), String> {
    wrenches.try_for_each(|wrench| {
        let ActiveWrench { link, force, torque, point, duration, .. } = wrench;
        if *link >= tree.links.len() {
            return Err(format!("a wrench on its link {link}, of {}", tree.links.len()));
        }
        if let WrenchDuration::For(remaining) = duration
            && !(0.0..=MAX_WRENCH_DURATION).contains(remaining)
        {
            return Err(format!("a wrench for {remaining} s, which is not 0 to {MAX_WRENCH_DURATION}"));
        }
        finite("wrenches", [force, torque, point].into_iter().flat_map(|vector| vector.to_array()))
    })
}

fn check_pulls(tree: &Tree, pulls: &[ActivePull]) -> Result<(), String> {
    let mut links = BTreeSet::new();
    pulls.iter().try_for_each(|pull| {
        pull.check(tree.links.len())?;
        if links.insert(pull.link) { Ok(()) } else { Err(format!("two pulls on its link {}", pull.link)) }
    })
}

//! Constraints of robots' descriptions, which come with the robots.

use std::collections::{BTreeMap, BTreeSet};

use glamx::DPose3;
use simd_model::setup::{ConstraintEnd, ConstraintOn, LinkConstraint, LinkConstraintKind};
use simd_model::{RobotModel, first_bytes, wire_name};

use crate::dynamics::constraint::link_constraint::{MAX_CONSTRAINT_NAME, MAX_CONSTRAINTS};
use crate::simulation::Simulation;
use crate::simulation::command::{CreateConstraint, RequestedConstraint, RequestedEnd, Spawn};
use crate::simulation::error::Error;
use crate::simulation::event::ConstraintDeletion;

/// A new robot, and the initial pose of its root.
pub(super) struct Came<'a> {
    pub(super) name: String,
    pub(super) model: &'a RobotModel,
    pub(super) pose: DPose3,
}

impl Simulation {
    /// Refuses robots with too many constraints, before they are added.
    pub(super) fn check_described_constraints<'s>(
        &self,
        spawns: impl IntoIterator<Item = &'s Spawn>,
    ) -> Result<(), Error> {
        let described: usize = spawns.into_iter().map(|spawn| spawn.model.setup.constraints.len()).sum();
        if described == 0 || self.constraints.list.len() + described <= MAX_CONSTRAINTS {
            return Ok(());
        }
        let (what, limit) = ("the number of constraints".into(), MAX_CONSTRAINTS as u64);
        let value = (self.constraints.list.len() + described) as u64;
        Err(Error::LimitExceeded { what, value, limit })
    }

    /// Creates the constraints of robots that were added at one moment. Impossible ones are left out: between
    /// links that cannot move relative to each other, and to robots that were not added.
    pub(super) fn make_described_constraints(&mut self, came: &[Came]) {
        if came.iter().all(|own| own.model.setup.constraints.is_empty()) {
            return;
        }
        let mut made = Vec::new();
        let mut names = FreeNames::beside(self.constraints.list.iter().map(|of| of.definition.name.as_str()));
        for own in came {
            for constraint in &own.model.setup.constraints {
                let create = requested(own, constraint, came, &mut names);
                // Its numbers were checked when it was read: a refused constraint is left out.
                made.extend(create.and_then(|create| self.add_constraint(&create).ok()));
            }
        }
        if !made.is_empty() {
            self.constraints_came(made);
        }
    }

    /// Removes the constraints of a robot's old description between its own links, and creates the new
    /// description's.
    pub(super) fn remake_described_constraints(&mut self, old: &RobotModel, new: &Came) {
        if old.setup.constraints.is_empty() && new.model.setup.constraints.is_empty() {
            return;
        }
        let names: BTreeSet<String> = old
            .setup
            .constraints
            .iter()
            .filter(|constraint| is_of_one(constraint))
            .map(|constraint| described_name(&new.name, &constraint.name))
            .collect();
        let index = self.layout.index_of(&new.name);
        let is_own = |robot: usize| Some(robot) == index;
        let gone: Vec<String> = self
            .constraints
            .list
            .extract_if(.., |of| {
                is_numbered(&of.definition.name, &names) && of.definition.robots().all(is_own)
            })
            .map(|of| of.definition.name)
            .collect();
        self.constraints.changed();
        self.constraints_went(gone, ConstraintDeletion::LinkGone);
        self.make_described_constraints(std::slice::from_ref(new));
    }
}

/// Returns the command that creates a constraint; `None` if a robot that it names was not added.
fn requested(
    own: &Came,
    constraint: &LinkConstraint,
    came: &[Came],
    names: &mut FreeNames,
) -> Option<CreateConstraint> {
    let kind = match constraint.kind {
        LinkConstraintKind::Weld => RequestedConstraint::Weld,
        LinkConstraintKind::PointToPoint => RequestedConstraint::PointToPoint,
        LinkConstraintKind::Hinge(axis) => RequestedConstraint::Hinge { axis },
        LinkConstraintKind::Slide(axis) => RequestedConstraint::Slide { axis },
        LinkConstraintKind::Gear { ratio, offset } => RequestedConstraint::Gear { ratio, offset },
        LinkConstraintKind::Distance { length, is_rope } => RequestedConstraint::Distance { length, is_rope },
    };
    let is_gear = matches!(constraint.kind, LinkConstraintKind::Gear { .. });
    let [parent, child] = constraint.ends.each_ref().map(|end| requested_end(end, is_gear, own, came));
    Some(CreateConstraint {
        name: names.take(described_name(&own.name, &constraint.name)),
        kind,
        parent: parent?,
        child: child?,
        max_force: constraint.max_force,
        max_torque: constraint.max_torque,
        breaks: false,
        disable_collisions: !constraint.collisions,
    })
}

/// Free names of constraints.
struct FreeNames {
    taken: BTreeSet<String>,
    /// Next number to try after each taken name.
    next: BTreeMap<String, u64>,
}

impl FreeNames {
    fn beside<'n>(taken: impl Iterator<Item = &'n str>) -> Self {
        Self { taken: taken.map(str::to_owned).collect(), next: BTreeMap::new() }
    }

    /// Returns the name, or the name with the first free number.
    fn take(&mut self, name: String) -> String {
        let mut candidate = name.clone();
        while self.taken.contains(&candidate) {
            let next = self.next.entry(name.clone()).or_insert(1);
            candidate = format!("{name}_{next}");
            *next += 1;
        }
        self.taken.insert(candidate.clone());
        candidate
    }
}

/// Returns whether this is one of the names, or one with a number from [`FreeNames::take`].
fn is_numbered(name: &str, names: &BTreeSet<String>) -> bool {
    let numbered = || name.rsplit_once('_').filter(|(_, number)| number.parse::<u64>().is_ok());
    names.contains(name) || numbered().is_some_and(|(stem, _)| names.contains(stem))
}

/// Returns whether a constraint connects only one robot, or it and the world.
fn is_of_one(constraint: &LinkConstraint) -> bool {
    constraint.ends.iter().all(|end| !matches!(end.on, ConstraintOn::Other { .. }))
}

/// Returns the name in the world of a description's constraint, if it is free.
fn described_name(robot: &str, constraint: &str) -> String {
    let name = if constraint.is_empty() { "constraint" } else { constraint };
    let name = format!("{robot}_{}", wire_name(name));
    // Leaves room for a number.
    first_bytes(&name, MAX_CONSTRAINT_NAME - 24).to_owned()
}

fn requested_end(end: &ConstraintEnd, is_gear: bool, own: &Came, came: &[Came]) -> Option<RequestedEnd> {
    let (of, name) = match &end.on {
        ConstraintOn::World => {
            let pose = own.pose * end.pose.unwrap_or(DPose3::IDENTITY);
            return Some(RequestedEnd { pose: Some(pose), ..RequestedEnd::default() });
        }
        ConstraintOn::Own(index) if is_gear => (own, own.model.joints.get(*index)?.name.clone()),
        ConstraintOn::Own(index) => (own, own.model.links.get(*index)?.name.clone()),
        ConstraintOn::Other { robot, name } => {
            (came.iter().find(|other| other.model.name == *robot)?, name.clone())
        }
    };
    let (link, joint) = if is_gear { (String::new(), name) } else { (name, String::new()) };
    Some(RequestedEnd { robot: of.name.clone(), link, joint, pose: end.pose })
}

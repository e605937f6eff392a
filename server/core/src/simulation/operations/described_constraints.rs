//! Constraints that come with robots, because their descriptions have them.

use std::collections::{BTreeMap, BTreeSet};

use glamx::DPose3;
use simd_model::setup::{ConstraintEnd, ConstraintOn, LinkConstraint, LinkConstraintKind};
use simd_model::{RobotModel, wire_name};

use crate::dynamics::constraint::link_constraint::{MAX_CONSTRAINT_NAME, MAX_CONSTRAINTS};
use crate::simulation::Simulation;
use crate::simulation::command::{CreateConstraint, RequestedConstraint, RequestedEnd, Spawn};
use crate::simulation::error::Error;
use crate::simulation::event::ConstraintDeletion;

/// A robot that came, and where its root began.
pub(super) struct Came<'a> {
    pub(super) name: String,
    pub(super) model: &'a RobotModel,
    pub(super) pose: DPose3,
}

impl Simulation {
    /// Refuses robots of which the constraints would be too many; to be called before they come.
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

    /// Makes the constraints of robots that came at one moment. What none of them can hold is left out: links that cannot
    /// move against each other, and robots that did not come.
    pub(super) fn make_described_constraints(&mut self, came: &[Came]) {
        if came.iter().all(|own| own.model.setup.constraints.is_empty()) {
            return;
        }
        let mut made = Vec::new();
        let mut names = FreeNames::beside(self.constraints.list.iter().map(|of| of.definition.name.as_str()));
        for own in came {
            for constraint in &own.model.setup.constraints {
                let create = requested(own, constraint, came, &mut names);
                // Its numbers were judged when it was read: what is refused holds nothing.
                made.extend(create.and_then(|create| self.add_constraint(&create).ok()));
            }
        }
        if !made.is_empty() {
            self.constraints_came(made);
        }
    }

    /// Takes out what the old description of a robot had made of its own links, and makes what the new one has.
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

/// The command that makes a constraint; `None` where a robot that it names is not among those that came.
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

/// Names of constraints that are not taken.
struct FreeNames {
    taken: BTreeSet<String>,
    /// The number that comes after a name that is taken.
    next: BTreeMap<String, u64>,
}

impl FreeNames {
    fn beside<'n>(taken: impl Iterator<Item = &'n str>) -> Self {
        Self { taken: taken.map(str::to_owned).collect(), next: BTreeMap::new() }
    }

    /// The name, or the first free one of the name with a number.
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

/// Whether this is one of the names, or one of them with the number that [`FreeNames::take`] adds.
fn is_numbered(name: &str, names: &BTreeSet<String>) -> bool {
    let numbered = || name.rsplit_once('_').filter(|(_, number)| number.parse::<u64>().is_ok());
    names.contains(name) || numbered().is_some_and(|(stem, _)| names.contains(stem))
}

/// Whether all that a constraint is on is one robot or the world.
fn is_of_one(constraint: &LinkConstraint) -> bool {
    constraint.ends.iter().all(|end| !matches!(end.on, ConstraintOn::Other { .. }))
}

/// What a constraint of a description is called in the world, where that is free.
fn described_name(robot: &str, constraint: &str) -> String {
    let name = if constraint.is_empty() { "constraint" } else { constraint };
    let mut name = format!("{robot}_{}", wire_name(name));
    // Room for a number.
    name.truncate(MAX_CONSTRAINT_NAME - 24);
    name
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

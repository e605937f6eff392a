//! Constraints between links of a world: the robots that they connect, and quantities derived from them.

use std::sync::Arc;

use super::entity::Entity;
use crate::dynamics::constraint::link_constraint::{
    ConstraintDefinition, ConstraintEnd, ConstraintKind, LinkConstraint, MAX_CONSTRAINT_NAME, Reading,
};
use crate::valid::{finite, moderate, pose};

/// Robots and links between which a constraint disables collisions; the smaller robot, or link of one robot,
/// first.
pub(super) type ExcludedLinks = ([usize; 2], [usize; 2]);

/// Constraints of a world, in the order of their creation.
#[derive(Debug, Default)]
pub(super) struct LinkConstraints {
    pub(super) list: Vec<LinkConstraint>,
    /// Definitions of the constraints. Shared with what is published.
    pub(super) definitions: Arc<Vec<ConstraintDefinition>>,
    /// Links between which collisions are disabled, in order.
    pub(super) excluded: Vec<ExcludedLinks>,
}

impl LinkConstraints {
    /// Updates what follows from the list; call it when the list has changed.
    pub(super) fn changed(&mut self) {
        self.definitions = Arc::new(self.list.iter().map(|of| of.definition.clone()).collect());
        self.excluded.clear();
        for of in self.list.iter().filter(|of| of.definition.disable_collisions) {
            if let [Some(a), Some(b)] = of.definition.ends.map(|end| end.link) {
                let (a, b) = (a.min(b), a.max(b));
                self.excluded.push(([a.0, b.0], [a.1, b.1]));
            }
        }
        self.excluded.sort_unstable();
        self.excluded.dedup();
    }

    /// Replaces the constraints by another state's.
    pub(super) fn replace(&mut self, list: Vec<LinkConstraint>) {
        self.list = list;
        self.changed();
    }

    /// Records that a robot was moved other than by a step; `None` means all robots.
    pub(super) fn forget_motion(&mut self, robot: Option<usize>) {
        for of in &mut self.list {
            if robot.is_none_or(|robot| of.definition.robots().any(|other| other == robot)) {
                of.forget_motion();
            }
        }
    }

    /// Clears the last step's data of constraints on a disabled robot, by its index. The next step cannot use
    /// them, they may be NaN, and would be shown and saved as long as the constraints do nothing.
    pub(super) fn forget_step(&mut self, robot: usize) {
        for of in &mut self.list {
            if of.definition.robots().any(|other| other == robot) {
                of.forget_step();
            }
        }
    }

    /// Changes the indices of robots. Removes constraints of robots without a new index, and returns their
    /// names.
    pub(super) fn keep(&mut self, index: impl Fn(usize) -> Option<usize>) -> Vec<String> {
        let mut gone = Vec::new();
        self.list.retain_mut(|of| {
            let is_there = of.definition.robots().all(|robot| index(robot).is_some());
            for (robot, _) in of.definition.ends.iter_mut().filter_map(|end| end.link.as_mut()) {
                *robot = index(*robot).unwrap_or(*robot);
            }
            if !is_there {
                gone.push(of.definition.name.clone());
            }
            is_there
        });
        self.changed();
        gone
    }

    /// Changes the indices of a robot's links. Removes constraints of links without a new index, and returns
    /// their names.
    pub(super) fn keep_links(&mut self, robot: usize, index: impl Fn(usize) -> Option<usize>) -> Vec<String> {
        let mut gone = Vec::new();
        self.list.retain_mut(|of| {
            let mut is_there = true;
            for (_, link) in
                of.definition.ends.iter_mut().filter_map(|end| end.link.as_mut()).filter(|of| of.0 == robot)
            {
                match index(*link) {
                    Some(new) => *link = new,
                    None => is_there = false,
                }
            }
            if !is_there {
                gone.push(of.definition.name.clone());
            }
            is_there
        });
        gone
    }
}

/// Returns the robots that a constraint moves. Returns `None` if it acts on nothing, because a robot is
/// disabled.
pub(super) fn moved(robots: &[Entity], constraint: &LinkConstraint) -> Option<[Option<usize>; 2]> {
    let mut moved = [None; 2];
    for (moved, ConstraintEnd { link, .. }) in moved.iter_mut().zip(&constraint.definition.ends) {
        let Some((robot, link)) = *link else { continue };
        if !robots[robot].is_active() {
            return None;
        }
        *moved = robots[robot].body.tree().links[link].body.map(|_| robot);
    }
    Some(moved)
}

/// Returns whether a step solves a constraint: whether a robot that it can move is awake.
pub(super) fn acts(robots: &[Entity], constraint: &LinkConstraint) -> bool {
    moved(robots, constraint)
        .is_some_and(|moved| moved.into_iter().flatten().any(|robot| robots[robot].is_awake()))
}

/// Returns whether a link is the child of a joint of one axis, which a gear can turn.
pub(super) fn has_axis(robot: &Entity, link: usize) -> bool {
    link.checked_sub(1).is_some_and(|joint| robot.body.tree().has_one_axis(joint))
}

/// Checks constraints from elsewhere against these robots.
pub(super) fn check(robots: &[Entity], constraints: &[LinkConstraint]) -> Result<(), String> {
    let mut names: Vec<&str> = constraints.iter().map(|of| of.definition.name.as_str()).collect();
    names.sort_unstable();
    if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(format!("there are two constraints {:?}", pair[0]));
    }
    constraints.iter().try_for_each(|of| {
        check_one(robots, of).map_err(|what| format!("the constraint {:?} {what}", of.definition.name))
    })
}

fn check_one(robots: &[Entity], of: &LinkConstraint) -> Result<(), String> {
    let LinkConstraint { definition, impulses, is_least: _, motion, is_dragged: _, reading } = of;
    let ConstraintDefinition { name, ends, kind, max_force, max_torque, breaks: _, disable_collisions: _ } =
        definition;
    if !simd_model::is_wire_name(name) || name.len() > MAX_CONSTRAINT_NAME {
        return Err("has a name that is not valid".into());
    }
    for ConstraintEnd { link, frame } in ends {
        pose("has a frame", frame)?;
        moderate("has a frame with a coordinate", frame.translation.to_array())?;
        if let Some((robot, link)) = *link {
            let robot = robots.get(robot).filter(|robot| link < robot.model.links.len());
            let robot = robot.ok_or("is on a link that does not exist")?;
            if matches!(kind, ConstraintKind::Gear { .. }) && !has_axis(robot, link) {
                return Err("is a gear of a joint that has not one axis".into());
            }
        }
    }
    if ends[0].link == ends[1].link {
        return Err("has two equal ends".into());
    }
    let is_unit = |axis: glamx::DVec3| (axis.length_squared() - 1.0).abs() < 1e-6;
    match *kind {
        ConstraintKind::Weld | ConstraintKind::PointToPoint => {}
        ConstraintKind::Hinge { axis } | ConstraintKind::Slide { axis } if is_unit(axis) => {}
        ConstraintKind::Hinge { .. } | ConstraintKind::Slide { .. } => {
            return Err("has an axis that is not of unit length".into());
        }
        ConstraintKind::Gear { ratio, offset } => {
            if ends.iter().any(|end| end.link.is_none()) {
                return Err("is a gear of the world".into());
            }
            moderate("has a ratio", [ratio])?;
            moderate("has an offset", [offset])?;
        }
        ConstraintKind::Distance { length, .. } if length < 0.0 => {
            return Err(format!("has a length of {length}, which is below 0"));
        }
        ConstraintKind::Distance { length, .. } => moderate("has a length", [length])?,
    }
    if !(*max_force >= 0.0 && *max_torque >= 0.0) {
        return Err("has a limit that is not a size".into());
    }
    finite(
        "has impulses",
        impulses
            .iter()
            .chain(motion.iter().flatten().flat_map(|of| [&of.predicted, &of.bent]))
            .flatten()
            .copied(),
    )?;
    let Reading { force, torque, last_force, last_torque, point, errors, residuals, is_saturated: _ } =
        reading;
    let vectors =
        [force, torque, last_force, last_torque, point].into_iter().flat_map(|vector| vector.to_array());
    finite("has readings", vectors.chain(*errors).chain(*residuals))
}

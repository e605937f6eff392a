//! Creation, change and deletion of constraints between links.

use glamx::{DPose3, DVec3};

use crate::dynamics::constraint::link_constraint::{
    ConstraintDefinition, ConstraintEnd, ConstraintKind, LinkConstraint, MAX_CONSTRAINT_NAME, MAX_CONSTRAINTS,
};
use crate::simulation::command::{ChangeConstraint, CreateConstraint, RequestedConstraint, RequestedEnd};
use crate::simulation::constraints::has_axis;
use crate::simulation::entity::Entity;
use crate::simulation::error::Error;
use crate::simulation::event::ConstraintDeletion;
use crate::simulation::{EventKind, Reply, Simulation, check};

impl Simulation {
    pub(in crate::simulation) fn create_constraint(
        &mut self,
        create: &CreateConstraint,
    ) -> Result<Reply, Error> {
        let name = self.add_constraint(create)?;
        self.constraints_came(vec![name.clone()]);
        Ok(Reply::ConstraintCreated { name })
    }

    /// Creates a constraint, and returns its name. [`Self::constraints_came`] must follow.
    pub(super) fn add_constraint(&mut self, create: &CreateConstraint) -> Result<String, Error> {
        let CreateConstraint { name, kind, parent, child, max_force, max_torque, breaks, disable_collisions } =
            create;
        if self.constraints.list.len() >= MAX_CONSTRAINTS {
            let what = "the number of constraints".into();
            let limit = MAX_CONSTRAINTS as u64;
            return Err(Error::LimitExceeded { what, value: limit + 1, limit });
        }
        let name = self.free_constraint_name(name)?;
        let is_gear = matches!(kind, RequestedConstraint::Gear { .. });
        let ends = [("parent", parent), ("child", child)];
        let [a, b] = ends.map(|(field, end)| self.constraint_link(end, is_gear, field));
        let (a, b) = (a?, b?);
        self.check_ends(a, b, is_gear)?;
        let [parent_link, child_link] = [a, b].map(|link| self.link_pose(link));
        let first = parent.pose.unwrap_or(DPose3::IDENTITY);
        let at = parent_link * first;
        let second = child.pose.unwrap_or_else(|| match kind {
            RequestedConstraint::Distance { .. } | RequestedConstraint::Gear { .. } => DPose3::IDENTITY,
            _ => child_link.inverse() * at,
        });
        check::moderate_pose("pose", &second).map_err(|error| error.within(|| "child".to_owned()))?;
        let across = (child_link * second).translation - at.translation;
        let kind = match *kind {
            RequestedConstraint::Weld => ConstraintKind::Weld,
            RequestedConstraint::PointToPoint => ConstraintKind::PointToPoint,
            RequestedConstraint::Hinge { axis } => ConstraintKind::Hinge { axis: unit("axis", axis)? },
            RequestedConstraint::Slide { axis } => ConstraintKind::Slide { axis: unit("axis", axis)? },
            RequestedConstraint::Gear { ratio, offset } => {
                let ratio = check::moderate("ratio", ratio)?;
                let now = || self.joint_position(b) - ratio * self.joint_position(a);
                ConstraintKind::Gear { ratio, offset: check::moderate("offset", offset.unwrap_or_else(now))? }
            }
            RequestedConstraint::Distance { length, is_rope } => {
                let length = length.unwrap_or_else(|| across.length());
                ConstraintKind::Distance { length: distance("length", length)?, is_rope }
            }
        };
        let definition = ConstraintDefinition {
            name: name.clone(),
            ends: [ConstraintEnd { link: a, frame: first }, ConstraintEnd { link: b, frame: second }],
            kind,
            max_force: most("max_force", max_force.unwrap_or(f64::INFINITY))?,
            max_torque: most("max_torque", max_torque.unwrap_or(f64::INFINITY))?,
            breaks: *breaks,
            disable_collisions: *disable_collisions,
        };
        self.wake_ends(&definition);
        self.constraints.list.push(LinkConstraint::new(definition));
        Ok(name)
    }

    /// Updates the world after constraints were created.
    pub(super) fn constraints_came(&mut self, names: Vec<String>) {
        self.constraints.changed();
        self.contacts.forget_excluded(&self.constraints.excluded);
        for constraint in names {
            self.happened(EventKind::ConstraintCreated { constraint });
        }
    }

    pub(in crate::simulation) fn change_constraint(
        &mut self,
        change: &ChangeConstraint,
    ) -> Result<Reply, Error> {
        let index = self.constraint_index(&change.name)?;
        let mut new = self.constraints.list[index].clone();
        let ChangeConstraint {
            name: _,
            parent_pose,
            child_pose,
            max_force,
            max_torque,
            breaks,
            ratio,
            offset,
            length,
        } = change;
        let definition = &mut new.definition;
        let poses = [("parent_pose", parent_pose), ("child_pose", child_pose)];
        for ((field, pose), end) in poses.into_iter().zip(&mut definition.ends) {
            if let Some(pose) = pose {
                check::moderate_pose(field, pose)?;
                end.frame = *pose;
            }
        }
        if let Some(force) = max_force {
            definition.max_force = most("max_force", *force)?;
        }
        if let Some(torque) = max_torque {
            definition.max_torque = most("max_torque", *torque)?;
        }
        definition.breaks = breaks.unwrap_or(definition.breaks);
        for (field, value) in [("ratio", *ratio), ("offset", *offset), ("length", *length)] {
            let Some(value) = value else { continue };
            let slot = match (&mut definition.kind, field) {
                (ConstraintKind::Gear { ratio, .. }, "ratio") => ratio,
                (ConstraintKind::Gear { offset, .. }, "offset") => offset,
                (ConstraintKind::Distance { length, .. }, "length") => length,
                _ => {
                    let whose = if field == "length" { "a distance" } else { "a gear" };
                    return Err(check::refuse(field, value, format!("only {whose} has one")));
                }
            };
            *slot = match field {
                "length" => distance(field, value)?,
                _ => check::moderate(field, value)?,
            };
        }
        new.forget_motion();
        let definition = new.definition.clone();
        self.constraints.list[index] = new;
        self.constraints.changed();
        self.wake_ends(&definition);
        Ok(Reply::Done)
    }

    pub(in crate::simulation) fn delete_constraint(&mut self, name: &str) -> Result<Reply, Error> {
        let index = self.constraint_index(name)?;
        let definition = self.constraints.list[index].definition.clone();
        self.wake_ends(&definition);
        self.constraints.list.remove(index);
        self.constraints.changed();
        self.constraints_went(vec![definition.name], ConstraintDeletion::Asked);
        Ok(Reply::Done)
    }

    /// Removes breakable constraints that reached their maximum in the last step.
    pub(in crate::simulation) fn break_constraints(&mut self) {
        let is_broken = |of: &LinkConstraint| of.definition.breaks && of.reading.is_saturated;
        if !self.constraints.list.iter().any(is_broken) {
            return;
        }
        let broken =
            self.constraints.list.extract_if(.., |of| is_broken(of)).map(|of| of.definition.name).collect();
        self.constraints.changed();
        self.constraints_went(broken, ConstraintDeletion::Broke);
    }

    /// Drops pairs and constraints of robots that were not loaded at the start, before these are deleted.
    pub(in crate::simulation) fn forget_links_of_spawned(&mut self) {
        let mut left = 0;
        let index = |entity: &Entity| {
            entity.state.loaded_at_start.then(|| {
                left += 1;
                left - 1
            })
        };
        let indices: Vec<Option<usize>> = self.entities.iter().map(index).collect();
        let index = |robot: usize| indices.get(robot).copied().flatten();
        self.contacts.keep_pairs(index);
        let gone = self.constraints.keep(index);
        self.constraints_went(gone, ConstraintDeletion::RobotDeleted);
    }

    /// Updates the constraints of a reloaded robot to the new indices of its links. Returns the names of
    /// those that are removed.
    pub(in crate::simulation) fn reload_constraints(
        &mut self,
        robot: usize,
        link: &[Option<usize>],
    ) -> Vec<String> {
        let mut gone = self.constraints.keep_links(robot, |index| link.get(index).copied().flatten());
        let entities = &self.entities;
        self.constraints.list.retain(|of| {
            let ends = of.definition.ends.iter().filter_map(|end| end.link);
            let is_gear = matches!(of.definition.kind, ConstraintKind::Gear { .. });
            let mut joints = ends.filter(|_| is_gear);
            let stays = joints.all(|(robot, link)| has_axis(&entities[robot], link));
            if !stays {
                gone.push(of.definition.name.clone());
            }
            stays
        });
        self.constraints.forget_motion(Some(robot));
        self.constraints.changed();
        gone
    }

    /// Emits events for deleted constraints.
    pub(in crate::simulation) fn constraints_went(&mut self, names: Vec<String>, cause: ConstraintDeletion) {
        for constraint in names {
            self.happened(EventKind::ConstraintDeleted { constraint, cause });
        }
    }

    /// Returns the index of a constraint.
    pub(in crate::simulation) fn constraint_index(&self, name: &str) -> Result<usize, Error> {
        let list = &self.constraints.list;
        list.iter().position(|of| of.definition.name == name).ok_or_else(|| Error::ConstraintNotFound {
            constraint: name.to_owned(),
            known: list.iter().map(|of| of.definition.name.clone()).collect(),
        })
    }

    fn wake_ends(&mut self, definition: &ConstraintDefinition) {
        for robot in definition.robots() {
            self.wake_around(robot);
        }
    }

    fn free_constraint_name(&self, name: &str) -> Result<String, Error> {
        let list = &self.constraints.list;
        if name.is_empty() {
            // One of the first numbers is free: there is one more than there are constraints.
            let mut taken = vec![false; list.len() + 1];
            for of in list {
                let number = of.definition.name.strip_prefix("constraint_");
                let number = number.filter(|number| !number.starts_with('0'));
                let number = number.and_then(|number| number.parse::<usize>().ok());
                if let Some(slot) = number.and_then(|number| taken.get_mut(number.checked_sub(1)?)) {
                    *slot = true;
                }
            }
            let free = taken.iter().position(|taken| !*taken).unwrap_or_default();
            return Ok(format!("constraint_{}", free + 1));
        }
        if !simd_model::is_wire_name(name) || name.len() > MAX_CONSTRAINT_NAME {
            let expected = format!(
                "it must be letters and digits of any script, `_` and `-`, at least one and at most {MAX_CONSTRAINT_NAME} bytes"
            );
            return Err(check::refuse("name", format!("{name:?}"), expected));
        }
        if list.iter().any(|of| of.definition.name == name) {
            return Err(Error::ConstraintExists { constraint: name.to_owned() });
        }
        Ok(name.to_owned())
    }

    /// Returns the indices of the robot and link of an end, given in the field `field`.
    fn constraint_link(
        &self,
        end: &RequestedEnd,
        is_gear: bool,
        field: &str,
    ) -> Result<Option<(usize, usize)>, Error> {
        let RequestedEnd { robot, link, joint, pose } = end;
        if let Some(pose) = pose {
            check::moderate_pose("pose", pose).map_err(|error| error.within(|| field.to_owned()))?;
        }
        if robot.is_empty() {
            return match (is_gear, link.is_empty() && joint.is_empty()) {
                (false, true) => Ok(None),
                (false, false) => {
                    Err(check::refuse(format!("{field}.robot"), "empty", "a link needs its robot's name"))
                }
                (true, _) => {
                    Err(check::refuse(format!("{field}.robot"), "empty", "a gear is between two joints"))
                }
            };
        }
        let robot = self.robot_index(robot)?;
        let entity = &self.entities[robot];
        if !is_gear {
            let link = if link.is_empty() { 0 } else { entity.link(link)? };
            return Ok(Some((robot, link)));
        }
        if joint.is_empty() {
            let robot = &entity.state.name;
            let expected = format!("a gear is between two joints: it must name one of robot {robot:?}");
            return Err(check::refuse(format!("{field}.joint"), "empty", expected));
        }
        // The child of each joint is the link after it.
        let link = entity.joint(joint)? + 1;
        if has_axis(entity, link) {
            return Ok(Some((robot, link)));
        }
        let expected = "a gear is of joints that turn or slide about one axis";
        Err(check::refuse(format!("{field}.joint"), format!("{joint:?}"), expected))
    }

    fn check_ends(
        &self,
        a: Option<(usize, usize)>,
        b: Option<(usize, usize)>,
        is_gear: bool,
    ) -> Result<(), Error> {
        let body = |end: Option<(usize, usize)>| {
            end.and_then(|(robot, link)| {
                self.entities[robot].body.tree().links[link].body.map(|body| (robot, body))
            })
        };
        match (body(a), body(b)) {
            (None, None) => {
                Err(check::refuse("child", "as fixed as its parent", "one of the two must be able to move"))
            }
            (a, b) if a == b && is_gear => {
                Err(check::refuse("child.joint", "the parent's", "it must be another joint"))
            }
            (a, b) if a == b => Err(check::refuse(
                "child.link",
                "fixed to the parent's",
                "the two must be able to move apart",
            )),
            _ => Ok(()),
        }
    }

    /// Returns the present `world_from_link`; identity for the world.
    fn link_pose(&self, link: Option<(usize, usize)>) -> DPose3 {
        let Some((robot, link)) = link else { return DPose3::IDENTITY };
        let body = &self.entities[robot].body;
        body.tree().link_pose(body.root_pose(), body.positions(), link)
    }

    /// Returns the position of the joint above a link of one axis.
    fn joint_position(&self, link: Option<(usize, usize)>) -> f64 {
        let Some((robot, link)) = link else { return 0.0 };
        let body = &self.entities[robot].body;
        let at = body.tree().links[link].body.map(|at| body.tree().bodies[at].position);
        at.map_or(0.0, |at| body.positions()[at])
    }
}

/// Returns the unit vector of a direction.
fn unit(field: &str, axis: DVec3) -> Result<DVec3, Error> {
    check::vector(field, axis)?;
    axis.try_normalize().ok_or_else(|| check::refuse(field, axis, "it must not be zero"))
}

/// Checks the distance of two points.
fn distance(field: &str, length: f64) -> Result<f64, Error> {
    check::at_least_zero(field, length).and_then(|length| check::moderate(field, length))
}

/// Checks a limit, which may be infinite.
fn most(field: &str, value: f64) -> Result<f64, Error> {
    if value >= 0.0 { Ok(value) } else { Err(check::refuse(field, value, "it must be at least 0")) }
}

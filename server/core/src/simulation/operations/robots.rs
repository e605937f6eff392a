//! Creation, change and deletion of robots.

use std::collections::BTreeMap;

use glamx::{DPose3, DVec3};
use simd_model::RobotModel;
use simd_model::setup::LinkPair;

use super::described_constraints::Came;
use crate::dynamics::spherical::{rotation_vector, write_orientation};
use crate::dynamics::{Actuator, Mode};
use crate::simulation::command::{
    CollisionPair, ContactSettings, JointOrientation, LinkWrench, MAX_WRENCH_DURATION, Reload, Spawn,
    WrenchDuration,
};
use crate::simulation::entity::{Entity, apply_mimics, tree_for};
use crate::simulation::error::Error;
use crate::simulation::event::ConstraintDeletion;
use crate::simulation::free_place::{Extent, FreePlace};
use crate::simulation::wrench::ActiveWrench;
use crate::simulation::{EventKind, Reply, Simulation, check};

/// Returns the pairs of links that a description enables or disables, as in a command.
fn described_pairs(model: &RobotModel) -> Vec<CollisionPair> {
    let name = |link: usize| model.links.get(link).map(|link| link.name.clone());
    let pair = |pair: &LinkPair| {
        let [link, other_link] = pair.links.map(name);
        let (link, other_link) = (link?, other_link?);
        Some(CollisionPair { link, other_link, enabled: Some(pair.enabled), ..CollisionPair::default() })
    };
    model.setup.pairs.iter().filter_map(pair).collect()
}

/// Returns the number of a robot that was renamed from this name.
fn number_of(robot: &str, name: &str) -> Option<usize> {
    let digits = robot.strip_prefix(name)?.strip_prefix('_')?;
    let is_plain = digits.bytes().all(|digit| digit.is_ascii_digit()) && !digits.starts_with('0');
    if is_plain { digits.parse().ok() } else { None }
}

fn came<'a>(name: &str, spawn: &'a Spawn, way: DVec3) -> Came<'a> {
    let pose = DPose3 { translation: spawn.pose.translation + way, ..spawn.pose };
    Came { name: name.to_owned(), model: &spawn.model, pose }
}

/// Returns the extent of a robot at its present configuration.
fn extent(entity: &Entity) -> Extent {
    let tree = entity.body.tree();
    let positions = &entity.body.positions()[tree.root_positions()..];
    let poses = tree.link_poses(entity.body.root_pose(), positions);
    Extent::new(tree, entity.colliders.shapes(), &poses)
}

impl Simulation {
    pub(in crate::simulation) fn spawn(&mut self, spawn: &Spawn) -> Result<Reply, Error> {
        let mut entity = self.prepared(spawn, &[])?;
        self.check_described_constraints([spawn])?;
        self.check_described_sensors([spawn])?;
        let way = self.find_place(std::slice::from_mut(&mut entity), spawn.free_place)?;
        let first = self.entities.len();
        let name = self.admit(entity);
        self.lay_out_from(first);
        self.make_described_constraints(&[came(&name, spawn, way)]);
        Ok(Reply::Spawned { name })
    }

    /// Spawns all of them or none.
    pub(in crate::simulation) fn spawn_all(&mut self, spawns: &[Spawn]) -> Result<Reply, Error> {
        let mut entities: Vec<Entity> = Vec::with_capacity(spawns.len());
        for spawn in spawns {
            let entity = self.prepared(spawn, &entities)?;
            entities.push(entity);
        }
        self.check_described_constraints(spawns)?;
        self.check_described_sensors(spawns)?;
        let free_place = spawns.first().map(|spawn| spawn.free_place).unwrap_or_default();
        let way = self.find_place(&mut entities, free_place)?;
        let first = self.entities.len();
        let names: Vec<String> = entities.into_iter().map(|entity| self.admit(entity)).collect();
        self.lay_out_from(first);
        let came: Vec<Came> = names.iter().zip(spawns).map(|(name, spawn)| came(name, spawn, way)).collect();
        self.make_described_constraints(&came);
        Ok(Reply::SpawnedAll { names })
    }

    /// Moves robots that are spawned together to a free place, and returns by how much, metres.
    fn find_place(&self, robots: &mut [Entity], asked: FreePlace) -> Result<DVec3, Error> {
        let FreePlace { beside_others, on_ground } = asked;
        let own = robots.iter().map(extent).reduce(Extent::union);
        let Some(own) = own.filter(|_| beside_others || on_ground) else { return Ok(DVec3::ZERO) };
        let aside = if beside_others { own.way_beside(self.entities.iter().map(extent)) } else { 0.0 };
        let up = if on_ground { own.way_up() } else { 0.0 };
        let way = DVec3::new(0.0, aside, up);
        for entity in robots.iter_mut().filter(|_| way != DVec3::ZERO) {
            let mut pose = entity.body.root_pose();
            pose.translation += way;
            check::moderate_pose("pose", &pose)?;
            entity.body.set_root_pose(pose);
            entity.state.spawned = std::sync::Arc::new(entity.body.state().clone());
        }
        Ok(way)
    }

    /// Creates a robot to be added to the world together with `with`.
    fn prepared(&self, spawn: &Spawn, with: &[Entity]) -> Result<Entity, Error> {
        let limit = self.limits.robots;
        if self.entities.len() + with.len() >= limit {
            return Err(Error::LimitExceeded {
                what: "the number of robots".into(),
                value: limit as u64 + 1,
                limit: limit as u64,
            });
        }
        let name = self.free_name(&spawn.name, spawn.allow_renaming, with)?;
        check::moderate_pose("pose", &spawn.pose)?;
        let fixed = Spawn::is_base_fixed(&spawn.model, spawn.fixed_base);
        let model = std::sync::Arc::clone(&spawn.model);
        let tree = tree_for(self.entities.iter().chain(with), &model, fixed);
        let mut entity = Entity::new(name, self.next_version, model, tree, spawn.pose, spawn.passive);
        entity.state.loaded_at_start = spawn.loaded_at_start;
        for (joint, position) in &spawn.joint_positions {
            let value = check::moderate(&format!("joint_positions[{joint:?}]"), *position)?;
            let index = entity.joint(joint)?;
            let body = entity.axis_body(index, 0)?;
            if entity.is_spherical(index) {
                let expected = "a spherical joint starts at an orientation: name it in `joint_orientations`";
                return Err(check::refuse(format!("joint_positions[{joint:?}]"), value, expected));
            }
            let body = &entity.body.tree().bodies[body];
            let (position, velocity) = (body.position, body.velocity);
            entity.body.positions_mut()[position] = value;
            let axis = &mut entity.body.axes_mut()[velocity];
            if axis.actuator.mode == Mode::Hold {
                axis.actuator = Actuator::hold(value, 0.0);
            }
        }
        for JointOrientation { joint, orientation } in &spawn.joint_orientations {
            let field = || format!("joint_orientations[{joint:?}]");
            let orientation = check::orientation(&field(), *orientation)?;
            let index = entity.joint(joint)?;
            let body = entity.axis_body(index, 0)?;
            if !entity.is_spherical(index) {
                let expected = "the joint is not spherical: name it in `joint_positions`";
                return Err(check::refuse(field(), orientation, expected));
            }
            let first = &entity.body.tree().bodies[body];
            let (position, velocity) = (first.position, first.velocity);
            write_orientation(&mut entity.body.positions_mut()[position..], orientation);
            let position = rotation_vector(orientation).to_array();
            for (axis, position) in entity.body.axes_mut()[velocity..velocity + 3].iter_mut().zip(position) {
                if axis.actuator.mode == Mode::Hold {
                    axis.actuator = Actuator::hold(position, 0.0);
                }
            }
        }
        let tree = std::sync::Arc::clone(entity.body.tree());
        apply_mimics(&tree, entity.body.positions_mut());
        entity.body.set_default_gains();
        entity.use_described_gains();
        entity.choose_profiles(self.settings.setpoint_profiles);
        entity.state.spawned = std::sync::Arc::new(entity.body.state().clone());
        entity.state.contact_settings = spawn.contact_settings.clone();
        entity.state.contact_settings.self_collision |= spawn.model.setup.self_collision;
        entity.state.contact_settings.stays_awake |= spawn.model.setup.stays_awake;
        entity.switch_pairs(&described_pairs(&spawn.model), "collision_pairs")?;
        entity.switch_pairs(&spawn.collision_pairs, "collision_pairs")?;
        entity.make_colliders(&spawn.shapes)?;
        entity.add_described_sensors(self.now.sim_time);
        Ok(entity)
    }

    /// Adds a prepared robot, and returns its name. The layout must be updated afterwards.
    fn admit(&mut self, mut entity: Entity) -> String {
        // Immovable robots do not query sleeping ones.
        if entity.body.tree().fixed_base {
            self.entities.iter_mut().for_each(Entity::wake);
        }
        entity.version = self.take_version();
        let name = entity.state.name.clone();
        self.entities.push(entity);
        self.happened(EventKind::EntitySpawned { robot: name.clone() });
        name
    }

    pub(in crate::simulation) fn reload(&mut self, reload: &Reload) -> Result<Reply, Error> {
        let robot_index = self.robot_index(&reload.robot)?;
        self.check_reloaded_sensors(robot_index, &reload.model)?;
        let model = std::sync::Arc::clone(&reload.model);
        let fixed = self.entities[robot_index].is_fixed();
        let tree = tree_for(&self.entities, &model, fixed);
        self.entities[robot_index].check_reloaded(&tree, &reload.shapes)?;
        self.cancel_trajectories(robot_index, None, "a new model of the robot");
        let version = self.take_version();
        let old = &self.entities[robot_index];
        let pose = old.body.root_pose();
        let mut new = Entity::new(old.state.name.clone(), version, model, tree, pose, false);
        new.choose_profiles(self.settings.setpoint_profiles);
        new.state.loaded_at_start = old.state.loaded_at_start;
        let (linear, angular) = old.body.root_twist();
        new.body.set_root_twist(linear, angular);

        let before: BTreeMap<&str, usize> =
            old.model.joints.iter().enumerate().map(|(i, joint)| (joint.name.as_str(), i)).collect();
        let mut added = Vec::new();
        let spawned = std::sync::Arc::make_mut(&mut new.state.spawned);
        for (index, joint) in new.model.joints.iter().enumerate() {
            let Some(&was) = before.get(joint.name.as_str()) else {
                added.push(joint.name.clone());
                continue;
            };
            let (from, to) = (old.body.tree().joints[was].clone(), new.body.tree().joints[index].clone());
            for (from, to) in from.zip(to) {
                let (from, to) = (&old.body.tree().bodies[from], new.body.tree().bodies[to].clone());
                if from.joint_type.positions() != to.joint_type.positions() {
                    continue;
                }
                for i in 0..to.joint_type.positions() {
                    let value = old.body.positions()[from.position + i];
                    new.body.positions_mut()[to.position + i] = value;
                    spawned.positions[to.position + i] = old.state.spawned.positions[from.position + i];
                }
                for i in 0..to.joint_type.velocities() {
                    let axis = &old.body.axes()[from.velocity + i];
                    new.body.velocities_mut()[to.velocity + i] = old.body.velocities()[from.velocity + i];
                    if new.body.axes()[to.velocity + i].actuator.mode != Mode::None
                        && axis.actuator.mode != Mode::None
                    {
                        new.body.axes_mut()[to.velocity + i].actuator = axis.actuator.clone();
                        let actuator = old.state.spawned.axes[from.velocity + i].actuator.clone();
                        spawned.axes[to.velocity + i].actuator = actuator;
                    }
                }
            }
        }
        spawned.set_root_pose(new.body.tree(), old.state.spawned.root_pose(old.body.tree()));
        new.take_claims(&old.claims, &old.model);
        let now: Vec<&str> = new.model.joints.iter().map(|joint| joint.name.as_str()).collect();
        let gone = before.keys().filter(|name| !now.contains(name));
        let removed: Vec<String> = gone.map(|name| (*name).to_owned()).collect();

        // Requests for links that the new model lacks are dropped.
        let known = |link: &str| link.is_empty() || new.link(link).is_ok();
        let links =
            old.state.contact_settings.links.iter().filter(|asked| known(&asked.link)).cloned().collect();
        new.state.contact_settings = ContactSettings { links, ..old.state.contact_settings };
        new.make_colliders(&reload.shapes)?;
        let gone_sensors = self.carry_sensors(robot_index, &mut new);
        let link = new.take_filter(old);
        self.wake_around(robot_index);
        self.contacts.forget(robot_index);
        self.contacts.reload_pairs(robot_index, &link);
        let robot = reload.robot.clone();
        let began = new.state.spawned.root_pose(new.body.tree());
        let old = std::mem::replace(&mut self.entities[robot_index], new);
        let gone = self.reload_constraints(robot_index, &link);
        self.lay_out();
        self.constraints_went(gone, ConstraintDeletion::LinkGone);
        let now = Came { name: robot.clone(), model: &reload.model, pose: began };
        self.remake_described_constraints(&old.model, &now);
        self.sensors_went(&robot, gone_sensors);
        self.happened(EventKind::EntityReloaded { robot, layout_version: version });
        Ok(Reply::Reloaded { added, removed })
    }

    pub(in crate::simulation) fn delete(&mut self, robot: &str) -> Result<Reply, Error> {
        let robot_index = self.robot_index(robot)?;
        self.cancel_trajectories(robot_index, None, "the end of the robot");
        self.wake_around(robot_index);
        self.contacts.remove(robot_index);
        let left = |index: usize| (index != robot_index).then_some(index - usize::from(index > robot_index));
        let gone = self.constraints.keep(left);
        self.entities.remove(robot_index);
        self.lay_out_from(robot_index);
        self.constraints_went(gone, ConstraintDeletion::RobotDeleted);
        self.happened(EventKind::EntityDeleted { robot: robot.to_owned() });
        Ok(Reply::Done)
    }

    pub(in crate::simulation) fn set_entity_state(
        &mut self,
        robot: &str,
        pose: Option<DPose3>,
        twist: Option<(DVec3, DVec3)>,
    ) -> Result<Reply, Error> {
        let entity = self.entity_mut(robot)?;
        if let Some(pose) = &pose {
            check::moderate_pose("pose", pose)?;
        }
        if let Some((linear, angular)) = twist {
            check::moderate_point("twist.linear", linear)?;
            check::moderate_point("twist.angular", angular)?;
            let still = linear == DVec3::ZERO && angular == DVec3::ZERO;
            if entity.body.tree().fixed_base && !still {
                let value = format!("linear {linear}, angular {angular}");
                return Err(check::refuse("twist", value, "the robot's base is fixed, so it must be zero"));
            }
        }
        if let Some(pose) = pose {
            // The angular velocity is stored in the body's own axes: keep it constant in the world.
            let (linear, angular) = entity.body.root_twist();
            entity.body.set_root_pose(pose);
            entity.body.set_root_twist(linear, angular);
        }
        if let Some((linear, angular)) = twist {
            entity.body.set_root_twist(linear, angular);
        }
        entity.state.disabled = None;
        entity.state.teleported = true;
        entity.update_external_forces();
        let moves = entity.moves();
        let robot_index = self.robot_index(robot)?;
        self.constraints.forget_motion(Some(robot_index));
        self.wake_around(robot_index);
        if !moves {
            // Immovable robots do not query sleeping ones at their new pose.
            self.entities.iter_mut().for_each(Entity::wake);
        }
        Ok(Reply::Done)
    }

    pub(in crate::simulation) fn apply_wrench(&mut self, wrench: &LinkWrench) -> Result<Reply, Error> {
        let entity = self.entity_mut(&wrench.robot)?;
        let link = entity.link(&wrench.link)?;
        let LinkWrench { force, torque, in_link_axes, point, duration, .. } = *wrench;
        check::vector("wrench.force", force)?;
        check::vector("wrench.torque", torque)?;
        check::vector("point", point)?;
        if let WrenchDuration::For(seconds) = duration {
            check::within("duration", seconds, 0.0..=MAX_WRENCH_DURATION)?;
        }
        entity.add_wrench(ActiveWrench {
            link,
            force,
            torque,
            in_link_axes,
            point,
            duration,
            suspended: false,
        });
        entity.update_external_forces();
        let robot_index = self.robot_index(&wrench.robot)?;
        self.wake_around(robot_index);
        Ok(Reply::Done)
    }

    /// Returns the name or, with `allow_renaming`, the name with the first free number.
    fn free_name(&self, name: &str, allow_renaming: bool, with: &[Entity]) -> Result<String, Error> {
        if !simd_model::is_wire_name(name) {
            let expected = "it must be letters and digits of any script, `_` and `-`, at least one";
            return Err(check::refuse("name", format!("{name:?}"), expected));
        }
        let names = || self.entities.iter().chain(with).map(|entity| entity.state.name.as_str());
        if !names().any(|other| other == name) {
            return Ok(name.to_owned());
        }
        if !allow_renaming {
            return Err(Error::RobotExists { robot: name.to_owned() });
        }
        // Once through all names: thousands of robots may have one name with numbers, of which one up to
        // their count is free.
        let mut taken = vec![false; self.entities.len() + with.len() + 1];
        for number in names().filter_map(|other| number_of(other, name)) {
            if let Some(taken) = taken.get_mut(number) {
                *taken = true;
            }
        }
        let free = (1..taken.len()).find(|number| !taken[*number]).unwrap_or(taken.len());
        Ok(format!("{name}_{free}"))
    }
}

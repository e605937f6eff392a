//! The world as a whole: its physics, its resets, restored states.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::dynamics::constraint::link_constraint::LinkConstraint;
use crate::simulation::claim::RobotClaims;
use crate::simulation::command::{PhysicsChange, ResetScope};
use crate::simulation::entity::Entity;
use crate::simulation::error::Error;
use crate::simulation::settings::{Integrator, SUBSTEPS, TIME_STEP};
use crate::simulation::trajectory::TrajectoryEnd;
use crate::simulation::{EventKind, Moment, Reply, Simulation, check};

impl Simulation {
    pub(in crate::simulation) fn set_physics(&mut self, change: &PhysicsChange) -> Result<Reply, Error> {
        let PhysicsChange { gravity, time_step, substeps, integrator, surface_combination, sleeping } =
            *change;
        if let Some(gravity) = gravity {
            check::moderate_point("gravity", gravity)?;
        }
        if let Some(seconds) = time_step {
            check::within("time_step", seconds, TIME_STEP)?;
        }
        if let Some(parts) = substeps.filter(|parts| !SUBSTEPS.contains(parts)) {
            let (least, most) = SUBSTEPS.into_inner();
            return Err(check::refuse("substeps", parts, format!("it must be between {least} and {most}")));
        }
        for (name, value, range) in
            integrator.and_then(Integrator::bullet).iter().flat_map(|law| law.ranges())
        {
            check::within(&format!("bullet_contacts.{name}"), value, range)?;
        }
        let before = self.settings;
        if let Some(seconds) = time_step {
            self.time_base = (self.now.step, self.now.sim_time);
            self.settings.time_step = seconds;
        }
        self.settings.gravity = gravity.unwrap_or(self.settings.gravity);
        self.settings.substeps = substeps.unwrap_or(self.settings.substeps);
        self.settings.integrator = integrator.unwrap_or(self.settings.integrator);
        self.settings.surface_combination = surface_combination.unwrap_or(before.surface_combination);
        self.settings.sleeping = sleeping.unwrap_or(before.sleeping);
        // Impulses and changes of velocities are published as forces and accelerations: divided by the length
        // of a step.
        let step = self.settings.time_step / before.time_step;
        let part = step * f64::from(before.substeps) / f64::from(self.settings.substeps);
        self.contacts.stretch(step, part);
        self.constraints.list.iter_mut().for_each(|of| of.stretch(step, part));
        self.entities.iter_mut().for_each(|entity| entity.body.change_step(part));
        let h = self.settings.time_step / f64::from(self.settings.substeps);
        // A longer step requires softer springs.
        for entity in self.entities.iter_mut().filter(|entity| !entity.state.pulls.is_empty()) {
            entity.soften_pulls((h, self.settings.integrator));
        }
        self.entities.iter_mut().for_each(Entity::wake);
        self.happened(EventKind::PhysicsChanged(self.settings));
        Ok(Reply::Physics(self.settings))
    }

    pub(in crate::simulation) fn reset(&mut self, scope: ResetScope) -> Result<Reply, Error> {
        // In `simulation_interfaces`, no given scope means all except `spawned`.
        let none = scope == ResetScope::default();
        let scope = if none { ResetScope { time: true, state: true, spawned: false } } else { scope };
        let mut deleted = Vec::new();
        if scope.spawned {
            for robot_index in 0..self.entities.len() {
                if !self.entities[robot_index].state.loaded_at_start {
                    self.cancel_trajectories(robot_index, None, "the end of the robot");
                }
            }
            self.forget_links_of_spawned();
            self.entities.retain(|entity| {
                if !entity.state.loaded_at_start {
                    deleted.push(entity.state.name.clone());
                }
                entity.state.loaded_at_start
            });
            self.lay_out();
        }
        if scope.state {
            for robot_index in 0..self.entities.len() {
                self.cancel_trajectories(robot_index, None, "a reset");
            }
            for entity in &mut self.entities {
                entity.put_back();
            }
            self.constraints.list.iter_mut().for_each(LinkConstraint::forget_step);
            self.targets_were_put_back();
        }
        if scope.state || !deleted.is_empty() {
            // Their indices may have changed: initial overlaps are searched again.
            self.contacts.replace(Vec::new(), &[]);
            for entity in &mut self.entities {
                entity.state.teleported = true;
                entity.wake();
            }
        }
        if scope.time {
            self.begin_epoch(Moment::default(), (0, 0.0));
            self.begin_sensors_anew();
        }
        for robot in &deleted {
            self.happened(EventKind::EntityDeleted { robot: robot.clone() });
        }
        self.happened(EventKind::Reset(scope));
        Ok(Reply::Reset { deleted })
    }

    pub(in crate::simulation) fn restore(&mut self, name: &str) -> Result<Reply, Error> {
        let kept = self.kept(name)?;
        let (saved, robots, is_foreign) = (kept.saved().clone(), kept.descriptions(), kept.is_foreign());
        let state = saved.world_state();
        let (at, time_base) =
            (Moment { epoch: 0, step: state.step, sim_time: state.sim_time }, state.time_base);
        // Claims are agreements between clients, not state of the world: holders keep them.
        let held: BTreeMap<String, _> = self
            .entities
            .iter()
            .map(|entity| (entity.state.name.clone(), (entity.claims.clone(), Arc::clone(&entity.model))))
            .collect();
        let before = self.trajectory_ids();
        self.go_back(state, &robots);
        if is_foreign {
            self.forget_sensor_ids();
        }
        let there = self.trajectory_ids();
        // Versions of a state from elsewhere may equal those that would be assigned next.
        let last = there.iter().map(|(_, id)| *id).max().unwrap_or_default();
        self.next_version = self.next_version.max(last + 1);
        for entity in &mut self.entities {
            let (claims, model) = held
                .get(&entity.state.name)
                .cloned()
                .unwrap_or_else(|| (RobotClaims::default(), entity.model.clone()));
            entity.take_claims(&claims, &model);
        }
        self.begin_epoch(at, time_base);
        self.lay_out();
        self.targets_were_put_back();
        for (robot, id) in before.into_iter().filter(|ended| !there.contains(ended)) {
            let end = TrajectoryEnd::Cancelled { by: "a state that was restored".to_owned() };
            self.happened(EventKind::TrajectoryEnded { robot, id, end });
        }
        self.happened(EventKind::StateRestored { name: name.to_owned() });
        Ok(Reply::Done)
    }

    fn begin_epoch(&mut self, at: Moment, time_base: (u64, f64)) {
        self.now = Moment { epoch: self.now.epoch + 1, ..at };
        self.time_base = time_base;
    }
}

impl Entity {
    /// Restores the state it was spawned with. Changed settings of joints stay changed.
    fn put_back(&mut self) {
        let settings: Vec<_> = self.body.axes().iter().map(|axis| axis.settings.clone()).collect();
        self.body.set_state(&self.state.spawned);
        for (axis, settings) in self.body.axes_mut().iter_mut().zip(settings) {
            axis.settings = settings;
        }
        self.state.applied_wrenches.clear();
        self.state.expired_wrenches.clear();
        self.state.pulls.clear();
        self.state.trajectories.clear();
        self.state.disabled = None;
        self.state.teleported = true;
        (self.state.asleep, self.state.still_for) = (false, 0.0);
        self.state.rest_poses.clear();
        self.put_sensors_back();
    }
}

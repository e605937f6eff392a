//! Publishing of a world's state.

use std::sync::Arc;

use glamx::DVec3;

use crate::dynamics::constraint::link_constraint::Reading;
use crate::dynamics::tree::JointType;
use crate::simulation::Simulation;
use crate::simulation::constraints::LinkConstraints;
use crate::simulation::contacts::Contacts;
use crate::simulation::entity::Entity;
use crate::simulation::published_state::{
    AppliedWrench, ConstraintState, ContactReport, EntityLayout, Flags, PublishedState, RootState,
    TrajectoryState, WorldLayout,
};
use crate::simulation::pull::ActivePull;
use crate::simulation::settings::PhysicsSettings;
use crate::simulation::wrench::ActiveWrench;

impl Simulation {
    /// Writes the state of the world into a published state, reusing its memory.
    pub fn observe(&self, state: &mut PublishedState) {
        state.at = self.now;
        share(&mut state.world, &self.layout);
        state.roots.clear();
        for values in [&mut state.positions, &mut state.velocities, &mut state.efforts, &mut state.targets] {
            values.clear();
        }
        state.modes.clear();
        state.gains.clear();
        state.accelerations.clear();
        state.flags.clear();
        state.trajectories.clear();
        state.trajectory_joints.clear();
        let PhysicsSettings { time_step, substeps, .. } = self.settings;
        let h = time_step / f64::from(substeps);
        for (robot, entity) in self.entities.iter().enumerate() {
            entity.observe(state, time_step, h);
            entity.observe_trajectories(state, robot);
        }
        state.contacts.clear();
        state.contacts.extend(self.contacts.reports(time_step, h));
        share(&mut state.constraints, &self.constraints.definitions);
        state.constraint_states.clear();
        state.constraint_states.extend(self.constraints.states(time_step, h));
        state.applied_wrenches.clear();
        state.applied_wrenches.extend(self.applied_wrenches());
        share(&mut state.settings, &self.robot_settings);
        share(&mut state.collision_pairs, &self.contacts.collision_pairs);
        share(&mut state.target_sources, &self.target_sources);
        share(&mut state.sensors, &self.sensors.published);
        share(&mut state.saved, &self.saved);
        state.claimed_by = self.world_claim.as_ref().map(|claim| Arc::clone(&claim.holder));
    }

    /// Returns the wrenches on links that acted over the last step or will act over the next one.
    pub(in crate::simulation) fn applied_wrenches(&self) -> impl Iterator<Item = AppliedWrench> + '_ {
        self.entities.iter().enumerate().flat_map(|(robot, entity)| {
            let applied_wrenches = entity
                .state
                .applied_wrenches
                .iter()
                .filter(|wrench| !wrench.suspended)
                .chain(&entity.state.expired_wrenches);
            let applied_wrenches = applied_wrenches.map(move |wrench| {
                let ActiveWrench { link, force, torque, in_link_axes, point, .. } = *wrench;
                AppliedWrench { robot, link, force, torque, in_link_axes, point }
            });
            let pulls = entity.state.pulls.iter().map(move |pull| {
                let ActivePull { link, force, point, .. } = *pull;
                AppliedWrench { robot, link, force, torque: DVec3::ZERO, in_link_axes: false, point }
            });
            applied_wrenches.chain(pulls)
        })
    }

    /// Updates the published settings of the robot at this index; call it when a command changed them.
    pub(in crate::simulation) fn settings_changed(&mut self, robot: usize) {
        let settings = Arc::new(self.entities[robot].robot_settings());
        if let Some(shared) = Arc::make_mut(&mut self.robot_settings).get_mut(robot) {
            *shared = settings;
        }
    }

    /// Updates the layout; call it when robots were added, deleted or reloaded.
    pub(in crate::simulation) fn lay_out(&mut self) {
        self.lay_out_from(0);
    }

    /// Updates the layout from the robot at this index on, if earlier ones are unchanged: one more robot
    /// among thousands costs little.
    pub(in crate::simulation) fn lay_out_from(&mut self, first: usize) {
        let mut others = Vec::new();
        let last = first.checked_sub(1).and_then(|last| self.layout.entities.get(last));
        let (mut position, mut velocity) =
            last.map(|last| (last.positions.end, last.velocities.end)).unwrap_or_default();
        for (robot_index, entity) in self.entities.iter().enumerate().skip(first) {
            let tree = entity.body.tree();
            let (positions, velocities) =
                (tree.position_count - tree.root_positions(), tree.velocity_count - tree.root_velocities());
            let (first_position, first_velocity) = (position, velocity);
            position += positions;
            velocity += velocities;
            // A version belongs to one robot and model.
            let known = self.layout.entities.get(robot_index).filter(|known| {
                known.version == entity.version
                    && (known.positions.start, known.velocities.start) == (first_position, first_velocity)
            });
            if let Some(known) = known {
                others.push(Arc::clone(known));
                continue;
            }
            let (joint_positions, joint_velocities) = entity.joint_ranges();
            others.push(Arc::new(EntityLayout {
                name: entity.state.name.clone(),
                version: entity.version,
                model: Arc::clone(&entity.model),
                tree: Arc::clone(tree),
                shapes: Arc::clone(entity.colliders.shapes()),
                fixed_base: tree.fixed_base,
                loaded_at_start: entity.state.loaded_at_start,
                positions: first_position..position,
                velocities: first_velocity..velocity,
                joint_positions,
                joint_velocities,
            }));
        }
        let layout = WorldLayout::with_others(&self.layout, first, others);
        let before = std::mem::replace(&mut self.layout, Arc::new(layout));
        self.keep_target_sources(&before, first);
        let mut settings = self.robot_settings[..first].to_vec();
        settings.extend(self.entities[first..].iter().map(|entity| Arc::new(entity.robot_settings())));
        self.robot_settings = Arc::new(settings);
        self.sensors_changed();
    }
}

impl Contacts {
    /// Returns the contacts of the last step of `time_step` seconds, whose parts took `h` seconds each.
    pub(super) fn reports(&self, time_step: f64, h: f64) -> impl Iterator<Item = ContactReport> + '_ {
        self.list.iter().map(move |contact| {
            let point = &contact.point;
            let force = contact.total / time_step;
            let normal_force = force.dot(point.normal);
            ContactReport {
                robots: contact.robots,
                links: point.links,
                point: point.position,
                normal: point.normal,
                depth: -point.distance,
                normal_force,
                friction_force: force - point.normal * normal_force,
                last_force: contact.impulse / h,
            }
        })
    }
}

impl LinkConstraints {
    /// Returns the state of each constraint over the last step of `time_step` seconds, whose parts took `h`
    /// seconds each.
    fn states(&self, time_step: f64, h: f64) -> impl Iterator<Item = ConstraintState> + '_ {
        self.list.iter().map(move |constraint| {
            let Reading { force, torque, last_force, last_torque, point, errors, residuals, is_saturated } =
                constraint.reading;
            ConstraintState {
                force: force / time_step,
                torque: torque / time_step,
                last: [last_force / h, last_torque / h],
                point,
                position_error: errors[0],
                angle_error: errors[1],
                velocity_residual: residuals[0],
                angular_residual: residuals[1],
                is_saturated,
            }
        })
    }
}

impl Entity {
    /// Adds the robot's values to a published state, after a step of `time_step` seconds in parts of `h`
    /// seconds.
    fn observe(&self, state: &mut PublishedState, time_step: f64, h: f64) {
        let tree = self.body.tree();
        let root = tree.root_velocities();
        let mut accelerations = self.body.last_accelerations(h);
        let mut of_root = [0.0; 6];
        of_root.iter_mut().zip(accelerations.by_ref().take(root)).for_each(|(of, value)| *of = value);
        state.accelerations.extend(accelerations);
        let (linear, angular) = self.body.root_twist();
        state.roots.push(RootState {
            pose: self.body.root_pose(),
            linear,
            angular,
            disabled: self.state.disabled.clone(),
            accelerations: of_root,
        });
        state.positions.extend_from_slice(&self.body.positions()[tree.root_positions()..]);
        state.velocities.extend_from_slice(&self.body.velocities()[root..]);
        state.efforts.extend_from_slice(&self.body.efforts()[root..]);
        for axis in &self.body.axes()[root..] {
            state.targets.push(axis.actuator.target);
            state.modes.push(axis.actuator.mode);
            state.gains.push(axis.gains(time_step));
        }
        for body in tree.bodies.iter().filter(|body| body.joint.is_some()) {
            match body.joint_type {
                JointType::Free { .. } => state.flags.extend([Flags::default(); 6]),
                JointType::Spherical { .. } => {
                    let saturated = self.body.is_saturated(body.velocity);
                    state.flags.push(Flags { saturated, ..Flags::default() });
                }
                JointType::Revolute | JointType::Prismatic => {
                    state.flags.push(self.flags(body.position, body.velocity));
                }
            }
        }
    }

    fn observe_trajectories(&self, state: &mut PublishedState, robot: usize) {
        for trajectory in &self.state.trajectories {
            let first = state.trajectory_joints.len();
            state.trajectory_joints.extend(trajectory.joints.iter().map(|joint| joint.joint));
            state.trajectories.push(TrajectoryState {
                robot,
                id: trajectory.id,
                joints: first..state.trajectory_joints.len(),
                begin: trajectory.begin,
                elapsed: trajectory.elapsed,
                duration: trajectory.duration(),
            });
        }
    }

    fn flags(&self, position: usize, velocity: usize) -> Flags {
        /// Distance to a limit within which a joint is at it, rad or m.
        const AT_LIMIT: f64 = 1e-6;
        let position = self.body.positions()[position];
        let limits = &self.body.axes()[velocity].settings.limits;
        Flags {
            saturated: self.body.is_saturated(velocity),
            at_lower: limits.lower.is_some_and(|lower| position <= lower + AT_LIMIT),
            at_upper: limits.upper.is_some_and(|upper| position >= upper - AT_LIMIT),
        }
    }
}

/// Makes one equal to the other. Mostly they already are, and then no reference is counted.
fn share<T>(one: &mut Arc<T>, other: &Arc<T>) {
    if !Arc::ptr_eq(one, other) {
        *one = Arc::clone(other);
    }
}

//! Operations of copies of a world, other than commands: repeated starts from a saved state, and targets at
//! each step without name lookups.

use std::sync::Arc;

use glamx::DPose3;

use super::step::slack;
use super::targets::actuator_for;
use crate::collision::{Filter, RobotFeet, Surface};
use crate::dynamics::constraint::contact::Contact;
use crate::dynamics::lanes::{Clearance, fits_lanes};
use crate::dynamics::tree::JointType;
use crate::dynamics::{Articulation, Tree};
use crate::simulation::command::Target;
use crate::simulation::entity::Entity;
use crate::simulation::saved::Saved;
use crate::simulation::world_state::{EntityState, Pair};
use crate::simulation::{PhysicsSettings, PublishedState, Simulation, WorldLimits};

/// Maximum displacement of a robot before it is checked again, metres.
const FARTHEST: f64 = 1.0;

/// Version of the first robot of a copy.
const FIRST_VERSION: u64 = 1;

impl Simulation {
    /// Creates a world in a saved state, without claims and saved states.
    pub(crate) fn copy_of(saved: &Saved) -> Self {
        let limits = WorldLimits { robots: saved.robot_count(), saved_states: 0 };
        let mut copy = Self::new(PhysicsSettings::default(), limits);
        copy.next_version = FIRST_VERSION + saved.robot_count() as u64;
        copy.begin_from(saved, &[]);
        copy.lay_out();
        copy
    }

    /// Restores the saved state of a copy. A tree in `trees` replaces its robot's tree: it has the same
    /// structure, with other masses.
    pub(crate) fn begin_from(&mut self, saved: &Saved, trees: &[Option<Arc<Tree>>]) {
        let mut robots = saved.descriptions(FIRST_VERSION);
        for (robot, tree) in robots.iter_mut().zip(trees) {
            if let Some(tree) = tree {
                robot.tree = Arc::clone(tree);
                robot.version = self.take_version();
            }
        }
        self.go_back(saved.world_state(), &robots);
        self.forget_sensor_ids();
        self.events.clear();
    }

    /// Sets the target of an axis, as `Command::SetTargets` does if no trajectory moves the joint; beyond a
    /// limit it is clamped. The body must take targets.
    pub(crate) fn set_axis_target(&mut self, robot: usize, body: usize, target: &Target) {
        let robot = &mut self.entities[robot].body;
        let (actuator, _beyond) = actuator_for(robot, body, target);
        let dof = robot.tree().bodies[body].velocity;
        robot.set_actuator(dof, actuator);
    }

    /// Returns the robot that lanes can step alone. Its state is all that a step changes, only the dynamics
    /// change it, and [`LaneRobot`](crate::dynamics::lanes::LaneRobot) can do that too. It touches only
    /// planes, with balls, and nothing else moves.
    pub(crate) fn lane_robot(&self) -> Option<usize> {
        // All fields are listed, so that new state is considered here too.
        let has_nothing_else = |entity: &Entity| {
            let EntityState {
                name: _,
                loaded_at_start: _,
                fixed_base: _,
                contact_settings: _,
                surfaces: _,
                groups: _,
                link_damping,
                collision_pairs: _,
                asleep: _,
                rest_poses: _,
                teleported: _,
                still_for: _,
                disabled: _,
                spawned: _,
                last_good: _,
                applied_wrenches,
                expired_wrenches,
                pulls,
                trajectories,
                sensors,
            } = &entity.state;
            link_damping.is_empty()
                && applied_wrenches.is_empty()
                && expired_wrenches.is_empty()
                && pulls.is_empty()
                && trajectories.is_empty()
                && sensors.is_empty()
        };
        // Lanes do not have Bullet's laws.
        let is_bullets = self.settings.integrator.bullet().is_some();
        if is_bullets || !self.constraints.list.is_empty() || !self.entities.iter().all(has_nothing_else) {
            return None;
        }
        let mut moving = (0..self.entities.len()).filter(|robot| self.entities[*robot].moves());
        let robot = moving.next().filter(|_| moving.next().is_none())?;
        let entity = &self.entities[robot];
        let stays = |&(robots, colliders): &Pair| {
            let moves = |side: usize| {
                let of = &self.entities[robots[side]].colliders;
                of.side(colliders[side]).is_some_and(|side| side.body.is_some())
            };
            !moves(0) && !moves(1)
        };
        let meets_nothing = self.contacts.ignored_overlaps().all(|pair| stays(&pair));
        let is_simple = entity.is_awake() && fits_lanes(entity.body.tree());
        (meets_nothing && is_simple && self.touches_planes_alone(robot)).then_some(robot)
    }

    /// Returns whether all contacts are between balls of a robot with a free root and planes of others; lanes
    /// check more.
    fn touches_planes_alone(&self, robot: usize) -> bool {
        let is_of_foot = |contact: &Contact| {
            let side = usize::from(contact.robots[0] != robot);
            let [own, other] = [side, 1 - side]
                .map(|side| (&self.entities[contact.robots[side]].colliders, contact.point.colliders[side]));
            contact.robots[side] == robot
                && contact.robots[1 - side] != robot
                && own.0.is_moving_ball(own.1)
                && other.0.is_plane(other.1)
        };
        self.contacts.list.is_empty()
            || !self.entities[robot].is_fixed() && self.contacts.list.iter().all(is_of_foot)
    }

    /// Returns the feet of the robot of [`lane_robot`](Self::lane_robot), if lanes can take them.
    pub(crate) fn lane_feet(&self, robot: usize) -> Option<RobotFeet> {
        let Entity { body, colliders, .. } = &self.entities[robot];
        // The axes of the base are then the world's.
        if body.tree().fixed_base || body.base() != DPose3::IDENTITY {
            return None;
        }
        let others = self.entities.iter().enumerate().filter(|(other, entity)| {
            *other != robot && entity.is_active() && entity.is_fixed() && !entity.colliders.is_empty()
        });
        let grounds = others.map(|(other, entity)| (other, &entity.colliders, entity.body.base()));
        let filter = |pair| Filter::between(pair, &self.contacts.collision_pairs);
        RobotFeet::new((robot, colliders), body.tree(), grounds, filter)
    }

    /// Returns the combined surfaces of each pair of a robot's feet; `None` if the planes are elsewhere in
    /// this copy.
    pub(crate) fn lane_surfaces(&self, feet: &RobotFeet) -> Option<Vec<Surface>> {
        let are_there = feet.stand_on(|robot| self.entities[robot].body.base());
        if !are_there {
            return None;
        }
        feet.surfaces(|robot| &self.entities[robot].colliders, self.settings.surface_combination)
    }

    /// Returns the contacts of the last step, in order.
    pub(crate) fn lane_contacts(&self) -> &[Contact] {
        &self.contacts.list
    }

    /// Replaces the contacts by the results of steps elsewhere, in order.
    pub(crate) fn set_lane_contacts(&mut self, contacts: impl Iterator<Item = Contact>) {
        self.contacts.list.clear();
        self.contacts.list.extend(contacts);
    }

    /// Writes only the contacts to a published state.
    pub(crate) fn observe_contacts(&self, state: &mut PublishedState) {
        let PhysicsSettings { time_step, substeps, .. } = self.settings;
        state.contacts.clear();
        state.contacts.extend(self.contacts.reports(time_step, time_step / f64::from(substeps)));
    }

    /// Returns how far points of the robot of [`lane_robot`](Self::lane_robot) can move after a step before a
    /// contact of it could be found. If it has feet, planes do not count: lanes check them in each step.
    pub(crate) fn lane_clearance(&self, robot: usize, has_feet: bool) -> Clearance {
        let PhysicsSettings { gravity, time_step, substeps, .. } = self.settings;
        let h = time_step / f64::from(substeps);
        let slack = slack(gravity, h);
        let Entity { body, colliders, .. } = &self.entities[robot];
        let (own, mut around) = (0.5 * colliders.own_gap(), f64::INFINITY);
        let counts_planes = !has_feet;
        for (other, entity) in self.entities.iter().enumerate() {
            if other == robot || !entity.is_active() || colliders.is_empty() {
                continue;
            }
            let pair = [robot.min(other), robot.max(other)];
            let [first, second] = pair.map(|index| &self.entities[index].colliders);
            let filter = Filter::between(pair, &self.contacts.collision_pairs);
            around = around.min(first.gap_to(second, filter, counts_planes));
        }
        let bodies = &body.tree().bodies;
        if own.min(around) == f64::INFINITY {
            return Clearance { around, own, levers: vec![0.0; bodies.len()], slack };
        }
        let levers = colliders.levers(body.tree(), body.positions(), FARTHEST);
        // Shapes are at their poses of the last part of a step.
        let length = |of: &[f64]| of.iter().map(|value| value * value).sum::<f64>().sqrt();
        let (mut by_root, mut by_joints) = (0.0, 0.0);
        for (body_of_joint, lever) in bodies.iter().zip(&levers) {
            let velocities = &body.half_velocities()[body_of_joint.velocity..];
            match body_of_joint.joint_type {
                JointType::Free { .. } => {
                    by_root += h * (length(&velocities[..3]) + lever * length(&velocities[3..6]));
                }
                _ => by_joints += h * lever * velocities[0].abs(),
            }
        }
        let capped = |gap: f64| if gap == f64::INFINITY { gap } else { gap.min(FARTHEST) };
        Clearance {
            around: capped(around) - by_root - by_joints,
            own: capped(own) - by_joints,
            levers,
            slack,
        }
    }

    /// Returns whether trajectories move joints of a robot, or wait to.
    pub(crate) fn has_trajectories(&self, robot: usize) -> bool {
        !self.entities[robot].state.trajectories.is_empty()
    }

    /// Advances the time to this step, after steps of the only robot were done elsewhere.
    pub(crate) fn pass_steps_to(&mut self, step: u64) {
        self.now.step = step;
        let (step, time) = self.time_base;
        self.now.sim_time = time + (self.now.step - step) as f64 * self.settings.time_step;
    }

    /// Returns the dynamics of a robot.
    pub(crate) fn body(&self, robot: usize) -> &Articulation {
        &self.entities[robot].body
    }

    /// Returns the dynamics of a robot, to copy the result of a step elsewhere.
    pub(crate) fn body_mut(&mut self, robot: usize) -> &mut Articulation {
        &mut self.entities[robot].body
    }

    /// Returns position and velocity of the axis of a revolute or prismatic body.
    pub(crate) fn axis_state(&self, robot: usize, body: usize) -> (f64, f64) {
        let robot = &self.entities[robot].body;
        let velocity = robot.tree().bodies[body].velocity;
        (robot.tree().position_of_axis(body, robot.positions()), robot.velocities()[velocity])
    }
}

//! Scenes with contact as data, in simd: `tests/reference/scenes.py` writes them, the physics suite
//! and `make scenes` run them.

use std::collections::BTreeMap;
use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use serde::{Deserialize, Serialize};
use simd_core::collision::{MeshShapes, Shapes};
use simd_core::simulation::SolverChoice;
use simd_core::simulation::command::{
    JointProperties, JointReset, JointTarget, PhysicsChange, RobotReset, RobotTargets, SetTargets, Spawn,
    Target,
};
use simd_core::{Command, Integrator, PublishedState, Simulation};
use simd_model::robot::JointLimits;

use crate::scene_constraint::Constraint;
use crate::scene_thing::Thing;
pub use crate::scene_thing::keep_awake;
use crate::{robots, scenes};

/// Bodies, drives and measurements.
#[derive(Clone, Debug, Deserialize)]
pub struct Scene {
    /// Name for people.
    pub name: String,
    /// Duration.
    pub seconds: f64,
    /// Seconds between which it should be at rest, or the measurements are taken.
    pub window: [f64; 2],
    pub(crate) things: Vec<Thing>,
    pub(crate) robots: Vec<Robot>,
    #[serde(default)]
    pub(crate) constraints: Vec<Constraint>,
    /// Seconds.
    pub time_step: f64,
    /// Robot and link whose normal forces are summed; all links if the name is empty.
    pub(crate) watch: Vec<[String; 2]>,
    /// Downwards, m/s^2.
    #[serde(default = "earth")]
    pub(crate) gravity: f64,
}

fn earth() -> f64 {
    9.81
}

#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Robot {
    pub(crate) name: String,
    pub(crate) urdf: String,
    pub(crate) at: [f64; 3],
    pub(crate) turn: [f64; 4],
    pub(crate) fixed: bool,
    pub(crate) friction: f64,
    pub(crate) restitution: f64,
    /// Initial joint positions.
    pub(crate) joints: BTreeMap<String, f64>,
    /// Stiffness and damping by joint; without any it is passive.
    pub(crate) gains: BTreeMap<String, [f64; 2]>,
    pub(crate) effort: BTreeMap<String, f64>,
    /// For each joint, times in seconds and targets, alternating; linear between them.
    pub(crate) path: BTreeMap<String, Vec<[f64; 2]>>,
    /// Columns of the cycle.
    pub(crate) order: Vec<String>,
    pub(crate) cycle: Vec<Vec<f64>>,
    pub(crate) period: f64,
    pub(crate) begin: f64,
    /// Initial joint velocities.
    #[serde(default)]
    pub(crate) velocities: BTreeMap<String, f64>,
    /// Initial velocity of a free robot, along the world's axes.
    #[serde(default)]
    pub(crate) linear: [f64; 3],
    #[serde(default)]
    pub(crate) angular: [f64; 3],
    /// For each joint driven at a velocity: the damping, and seconds and velocities, alternating.
    #[serde(default)]
    pub(crate) speeds: BTreeMap<String, (f64, Vec<[f64; 2]>)>,
}

/// A spring and a damper towards a target; of a velocity without a spring.
pub(crate) struct Drive {
    pub(crate) position: f64,
    pub(crate) velocity: f64,
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
}

/// State at one time.
#[derive(Clone, Debug, Serialize)]
pub struct View {
    /// Seconds.
    pub time: f64,
    /// Place, quaternion x y z w, linear and angular velocity of each body with a free root.
    pub roots: Vec<Vec<f64>>,
    /// Joint positions of all robots, in the order of the scene.
    pub joints: Vec<f64>,
    /// The largest overlap since the last view, metres.
    pub deepest: f64,
    /// Sums of normal forces, as the scene watches them, N.
    pub forces: Vec<f64>,
    /// Largest distance between the frames of a constraint, metres.
    pub error: f64,
}

/// A scene on its way.
pub struct Run<'a> {
    scene: &'a Scene,
    /// The world that it is in.
    pub world: Simulation,
    deepest: f64,
}

impl Scene {
    /// Returns views from the start on, one each `every` steps, by an integrator, by default a world's own.
    ///
    /// # Panics
    /// Panics if the world refuses the scene: then the test has failed.
    pub fn run(&self, every: u64, integrator: Option<Integrator>) -> Vec<View> {
        let mut run = Run::new(self);
        if integrator.is_some() {
            let change = PhysicsChange { integrator, ..PhysicsChange::default() };
            scenes::apply(&mut run.world, Command::SetPhysics(change));
        }
        let mut views = vec![run.view()];
        for step in 1..=(self.seconds / self.time_step).round() as u64 {
            run.step();
            if step % every == 0 {
                views.push(run.view());
            }
        }
        views
    }

    /// Returns the largest residual of a contact in each step, m/s, with impulses of one solver; `None` for a
    /// step without contacts.
    ///
    /// # Panics
    /// Panics if the world refuses the scene: then the test has failed.
    pub fn residuals(&self, choice: SolverChoice) -> Vec<Option<f64>> {
        let mut run = Run::new(self);
        run.world.measure_solver(choice);
        let steps = (self.seconds / self.time_step).round() as u64;
        let residual = |_| {
            run.step();
            run.world.take_solver_residual()
        };
        (0..steps).map(residual).collect()
    }
}

impl<'a> Run<'a> {
    /// Puts the scene at its start. Nothing in it ever sleeps.
    ///
    /// # Panics
    /// Panics if the world refuses the scene: then the test has failed.
    pub fn new(scene: &'a Scene) -> Self {
        let mut world = scenes::world(scene.time_step);
        let gravity = Some(DVec3::Z * -scene.gravity);
        scenes::apply(&mut world, Command::SetPhysics(PhysicsChange { gravity, ..PhysicsChange::default() }));
        scene.things.iter().for_each(|thing| thing.put_into(&mut world));
        scene.robots.iter().for_each(|robot| robot.put_into(&mut world));
        scene.constraints.iter().for_each(|constraint| constraint.put_into(&mut world));
        Self { scene, world, deepest: 0.0 }
    }

    /// Gives the actuators their targets, and advances by a time step.
    pub fn step(&mut self) {
        let now = self.world.now().sim_time;
        let robots: Vec<_> = self.scene.robots.iter().filter_map(|robot| robot.targets(now)).collect();
        if !robots.is_empty() {
            scenes::apply(
                &mut self.world,
                Command::SetTargets(SetTargets { robots, ..SetTargets::default() }),
            );
        }
        self.world.step();
        let reports = scenes::look(&self.world).contacts;
        self.deepest = reports.iter().map(|contact| contact.depth).fold(self.deepest, f64::max);
    }

    /// Returns the present view, with the largest overlap since the last one.
    pub fn view(&mut self) -> View {
        let seen = scenes::look(&self.world);
        let free = seen.world.entities.iter().zip(&seen.roots).filter(|(entity, _)| !entity.fixed_base);
        let roots = free.map(|(_, root)| {
            let turn = root.pose.rotation.to_array();
            let [at, linear, angular] =
                [root.pose.translation, root.linear, root.angular].map(|part| part.to_array());
            [&at[..], &turn, &linear, &angular].concat()
        });
        let reports = scenes::contacts(&self.world, None);
        let force = |[robot, link]: &[String; 2]| {
            let of = |contact: &scenes::Touching, side: usize| {
                contact.robots[side] == *robot && (link.is_empty() || contact.links[side] == *link)
            };
            let own = reports.iter().filter(|contact| of(contact, 0) || of(contact, 1));
            own.map(|contact| contact.normal_force).sum()
        };
        View {
            time: self.world.now().sim_time,
            roots: roots.collect(),
            joints: self.scene.robots.iter().flat_map(|robot| robot.positions(&seen)).collect(),
            deepest: std::mem::take(&mut self.deepest),
            forces: self.scene.watch.iter().map(force).collect(),
            error: seen.constraint_states.iter().map(|of| of.position_error).fold(0.0, f64::max),
        }
    }
}

impl Robot {
    /// Returns the name, model and root pose of each robot, and whether its root is fixed: one robot, or
    /// those of an SDF.
    pub(crate) fn described(&self) -> Vec<(String, robots::Described)> {
        let pose = DPose3::from_parts(self.at.into(), DQuat::from_array(self.turn));
        if !self.urdf.ends_with(".sdf") {
            let (model, _) = robots::read(&self.urdf);
            return vec![(self.name.clone(), robots::Described { model, pose, fixed: self.fixed })];
        }
        let all = robots::read_all(&self.urdf).into_iter().enumerate();
        let name = |i: usize| if i == 0 { self.name.clone() } else { format!("{}-{i}", self.name) };
        all.map(|(i, of)| (name(i), robots::Described { pose: pose * of.pose, ..of })).collect()
    }

    fn put_into(&self, world: &mut Simulation) {
        let described = self.described();
        for (name, robots::Described { model, pose, fixed }) in &described {
            let shapes = Arc::new(Shapes::reusing(model, *fixed, MeshShapes::Mesh, &[]));
            let spawn = Spawn {
                shapes,
                contact_settings: scenes::surface(self.friction, self.restitution),
                joint_positions: self.joints.iter().map(|(name, &at)| (name.clone(), at)).collect(),
                passive: self.gains.is_empty() && self.speeds.is_empty(),
                ..scenes::robot(name, model, *pose, *fixed)
            };
            scenes::spawn(world, spawn);
        }
        let Some((_, robots::Described { model, .. })) = described.first() else { return };
        // Settings of joints in files are ignored except for their limits, so that they are read the same
        // everywhere.
        let properties = self.order.iter().map(|name| {
            let joint = model.joints.iter().find(|joint| joint.name == *name);
            let limits = joint.map(|joint| joint.limits).unwrap_or_default();
            let effort = self.effort.get(name).copied();
            JointProperties {
                joint: name.clone(),
                damping: Some(0.0),
                friction: Some(0.0),
                armature: Some(0.0),
                limits: Some(JointLimits { effort, velocity: None, ..limits }),
                default_gains: None,
                gravity_compensation: None,
                profile: None,
                spring: None,
            }
        });
        let joints: Vec<_> = properties.collect();
        scenes::apply(world, Command::SetJointProperties { robot: self.name.clone(), joints });
        let reset = |(name, &velocity): (&String, &f64)| {
            let position = self.joints.get(name).copied().unwrap_or_default();
            JointReset { joint: name.clone(), axis: 0, position, velocity, ..Default::default() }
        };
        let joints: Vec<_> = self.velocities.iter().map(reset).collect();
        if !joints.is_empty() {
            let robots = vec![RobotReset { robot: self.name.clone(), joints }];
            scenes::apply(world, Command::ResetJoints { robots });
        }
        if !self.fixed && [self.linear, self.angular].concat().iter().any(|part| *part != 0.0) {
            scenes::throw(world, &self.name, self.linear.into(), self.angular.into());
        }
    }

    fn targets(&self, now: f64) -> Option<RobotTargets> {
        let joint = |name: &String| {
            let is_driven = self.speeds.contains_key(name) || self.gains.contains_key(name);
            let target = match self.drive(name, now) {
                Some(Drive { velocity, stiffness: 0.0, damping, .. }) => {
                    Target::Velocity { velocity, damping: Some(damping), feed_forward: 0.0, max_effort: None }
                }
                Some(Drive { position, velocity, stiffness, damping }) => Target::Position {
                    position,
                    velocity,
                    stiffness: Some(stiffness),
                    damping: Some(damping),
                    feed_forward: 0.0,
                    max_effort: None,
                    max_velocity: None,
                },
                None if is_driven => return None,
                None => Target::Passive,
            };
            Some(JointTarget { joint: name.clone(), axis: 0, target })
        };
        let joints: Vec<_> = self.order.iter().filter_map(joint).collect();
        let targets = || RobotTargets { robot: self.name.clone(), joints, ..RobotTargets::default() };
        (!self.gains.is_empty() || !self.speeds.is_empty()).then(targets)
    }

    /// Returns the drive of a joint at a time; `None` if it has no drive.
    pub(crate) fn drive(&self, name: &str, now: f64) -> Option<Drive> {
        if let Some((damping, path)) = self.speeds.get(name) {
            return Some(Drive {
                position: 0.0,
                velocity: along(path, now)?,
                stiffness: 0.0,
                damping: *damping,
            });
        }
        let &[stiffness, damping] = self.gains.get(name)?;
        Some(Drive { position: self.target(name, now)?, velocity: 0.0, stiffness, damping })
    }

    fn target(&self, name: &str, now: f64) -> Option<f64> {
        let column = self.order.iter().position(|known| known == name)?;
        if let Some(path) = self.path.get(name) {
            return along(path, now);
        }
        let samples = self.cycle.len();
        if samples == 0 || now < self.begin {
            return self.joints.get(name).copied();
        }
        let at = (now - self.begin) / self.period * samples as f64;
        let [from, to] = [at as usize, at as usize + 1].map(|row| &self.cycle[row % samples]);
        let part = at.fract();
        Some((1.0 - part) * from.get(column)? + part * to.get(column)?)
    }

    fn positions(&self, seen: &PublishedState) -> Vec<f64> {
        let Some((_, entity)) = seen.entity(&self.name) else { return Vec::new() };
        let own = &seen.positions[entity.positions.clone()];
        let position = |name: &String| {
            let joint = entity.model.joints.iter().position(|joint| joint.name == *name)?;
            own.get(entity.joint_positions[joint].start).copied()
        };
        self.order.iter().map(|name| position(name).unwrap_or(f64::NAN)).collect()
    }
}

/// Returns the value at a time, of times and values in turn.
fn along(path: &[[f64; 2]], now: f64) -> Option<f64> {
    let after = path.partition_point(|[time, _]| *time <= now);
    let [from, to] = [path.get(after.checked_sub(1)?)?, path.get(after).or(path.last())?];
    let part = if to[0] > from[0] { (now - from[0]) / (to[0] - from[0]) } else { 0.0 };
    Some(from[1] + part * (to[1] - from[1]))
}

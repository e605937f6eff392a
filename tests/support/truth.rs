//! Cases of the truth table in simd: `tests/reference/cases.py` writes them, the physics
//! suite and `make truth` run them.

use crate::world::apply;
use std::sync::Arc;

use glamx::DVec3;
use serde::{Deserialize, Serialize};
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::*;
use simd_core::{Command, Integrator, PhysicsSettings, PublishedState, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{JointLimits, Mimic};

use crate::robots;

/// A robot, its initial state, and the settings of its joints. Settings in its file are ignored.
#[derive(Clone, Debug, Deserialize)]
pub struct Case {
    /// Name for people.
    pub name: String,
    /// `smooth`: passive and smooth; `kinked`: with dry friction, limits or mimic; `driven`.
    pub subject: String,
    /// In the form of [`robots::read`].
    pub urdf: String,
    /// Linear in world axes, angular in the root's own, which start as the world's; `None` if it is fixed.
    pub root_velocity: Vec<f64>,
    /// Damping of each joint axis: N m s/rad or N s/m.
    pub damping: f64,
    /// Friction of each joint axis: N m or N.
    pub friction: f64,
    /// Armature of each joint axis: kg m^2 or kg.
    pub armature: f64,
    /// Limit of each actuator: N m or N.
    pub effort: Option<f64>,
    /// Joints with stops; the others have none.
    pub limits: Vec<Stops>,
    /// Joints that follow others.
    pub mimic: Vec<Follower>,
    /// None: passive.
    pub drive: Option<Drive>,
    /// Every axis that moves, in the order of positions.
    pub joints: Vec<Start>,
}

/// Lower and upper limit of a joint, rad or m.
#[derive(Clone, Debug, Deserialize)]
pub struct Stops {
    joint: String,
    lower: f64,
    upper: f64,
}

/// q = multiplier q of the leader + offset.
#[derive(Clone, Debug, Deserialize)]
pub struct Follower {
    joint: String,
    leader: String,
    multiplier: f64,
    offset: f64,
}

/// The target of all joints.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Drive {
    /// Springs with dampers.
    Position {
        /// rad or m, by joint axis.
        targets: Vec<f64>,
        /// N m/rad or N/m.
        stiffness: f64,
        /// N m s/rad or N s/m.
        damping: f64,
    },
    /// Dampers that pull towards a velocity.
    Velocity {
        /// rad/s or m/s, by joint axis.
        targets: Vec<f64>,
        /// N m s/rad or N s/m.
        damping: f64,
    },
    /// Constant efforts.
    Effort {
        /// N m or N, by joint axis.
        targets: Vec<f64>,
    },
}

/// Initial state of a joint axis.
#[derive(Clone, Debug, Deserialize)]
pub struct Start {
    joint: String,
    axis: u32,
    position: f64,
    velocity: f64,
}

/// State of a robot at one time.
#[derive(Clone, Debug, Serialize)]
pub struct View {
    /// rad or m, as [`Case::joints`].
    pub joints: Vec<f64>,
    /// x y z and quaternion x y z w of a root that can move.
    pub root: Option<[f64; 7]>,
}

impl Case {
    /// Returns the robot's state at these times, which are multiples of the time step, seconds, by an
    /// integrator.
    ///
    /// # Panics
    /// Panics if the world refuses the case: then the test has failed.
    pub fn run(&self, integrator: Integrator, time_step: f64, instants: &[f64]) -> Vec<View> {
        let mut world = self.world(integrator, time_step);
        let mut done = 0;
        let looks = instants.iter().map(|instant| {
            let steps = (instant / time_step).round() as u64;
            (done..steps).for_each(|_| world.step());
            done = steps;
            self.view(&world)
        });
        looks.collect()
    }

    /// Returns the world at its start.
    ///
    /// # Panics
    /// Panics if the world refuses the case: then the test has failed.
    pub fn world(&self, integrator: Integrator, time_step: f64) -> Simulation {
        let settings = PhysicsSettings { time_step, integrator, ..PhysicsSettings::default() };
        let mut world = Simulation::new(settings, WorldLimits::default());
        apply(&mut world, Command::Spawn(Box::new(self.spawn())));
        let robot = || "robot".to_owned();
        apply(&mut world, Command::SetJointProperties { robot: robot(), joints: self.properties() });
        let joints = self.joints.iter().filter(|start| !self.follows(&start.joint));
        let joints = joints.map(|start| JointReset {
            joint: start.joint.clone(),
            axis: start.axis,
            position: start.position,
            velocity: start.velocity,
            ..Default::default()
        });
        let reset = RobotReset { robot: robot(), joints: joints.collect() };
        if !reset.joints.is_empty() {
            apply(&mut world, Command::ResetJoints { robots: vec![reset] });
        }
        if let [x, y, z, a, b, c] = self.root_velocity[..] {
            let twist = Some((DVec3::new(x, y, z), DVec3::new(a, b, c)));
            apply(&mut world, Command::SetEntityState { robot: robot(), pose: None, twist });
        }
        if self.drive.is_some() {
            let robots =
                vec![RobotTargets { robot: robot(), joints: self.targets(), ..RobotTargets::default() }];
            apply(&mut world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
        }
        world
    }

    fn spawn(&self) -> Spawn {
        Spawn {
            name: "robot".into(),
            allow_renaming: false,
            model: Arc::new(self.model()),
            pose: glamx::DPose3::IDENTITY,
            fixed_base: Some(self.root_velocity.is_empty()),
            passive: true,
            joint_positions: Vec::new(),
            joint_orientations: Vec::new(),
            shapes: Default::default(),
            contact_settings: Default::default(),
            collision_pairs: Vec::new(),
            free_place: Default::default(),
            loaded_at_start: false,
        }
    }

    fn model(&self) -> RobotModel {
        let mut model = (*robots::read(&self.urdf).0).clone();
        for index in 0..model.joints.len() {
            let found = self.mimic.iter().find(|follower| follower.joint == model.joints[index].name);
            let leader = |name: &str| model.joints.iter().position(|joint| joint.name == name);
            let mimic = found.and_then(|follower| {
                let joint = leader(&follower.leader)?;
                Some(Mimic { joint, multiplier: follower.multiplier, offset: follower.offset })
            });
            assert_eq!(mimic.is_some(), found.is_some(), "{}: no such leader", self.name);
            model.joints[index].mimic = mimic;
            // Positions beyond the file's limits may be requested.
            model.joints[index].limits = JointLimits::default();
        }
        model
    }

    fn follows(&self, joint: &str) -> bool {
        self.mimic.iter().any(|follower| follower.joint == joint)
    }

    fn properties(&self) -> Vec<JointProperties> {
        let first = self.joints.iter().filter(|start| start.axis == 0);
        let properties = first.map(|start| {
            let stops = self.limits.iter().find(|stops| stops.joint == start.joint);
            let limits = JointLimits {
                lower: stops.map(|stops| stops.lower),
                upper: stops.map(|stops| stops.upper),
                effort: self.effort,
                velocity: None,
            };
            JointProperties {
                joint: start.joint.clone(),
                damping: Some(self.damping),
                friction: Some(self.friction),
                armature: Some(self.armature),
                limits: Some(limits),
                default_gains: None,
                gravity_compensation: None,
                profile: None,
                spring: None,
            }
        });
        properties.collect()
    }

    fn targets(&self) -> Vec<JointTarget> {
        let target = |index: usize| match self.drive.as_ref()? {
            Drive::Position { targets, stiffness, damping } => Some(Target::Position {
                position: *targets.get(index)?,
                velocity: 0.0,
                stiffness: Some(*stiffness),
                damping: Some(*damping),
                feed_forward: 0.0,
                max_effort: None,
                max_velocity: None,
            }),
            Drive::Velocity { targets, damping } => Some(Target::Velocity {
                velocity: *targets.get(index)?,
                damping: Some(*damping),
                feed_forward: 0.0,
                max_effort: None,
            }),
            Drive::Effort { targets } => Some(Target::Effort(*targets.get(index)?)),
        };
        let pairs = self.joints.iter().enumerate().filter_map(|(index, start)| {
            let target = target(index)?;
            Some(JointTarget { joint: start.joint.clone(), axis: start.axis, target })
        });
        pairs.collect()
    }

    fn view(&self, world: &Simulation) -> View {
        let mut seen = PublishedState::default();
        world.observe(&mut seen);
        assert!(seen.roots[0].disabled.is_none(), "{} was disabled", self.name);
        let layout = &seen.world.entities[0];
        let joints = self.joints.iter().map(|start| {
            let index = layout.model.joints.iter().position(|joint| joint.name == start.joint);
            let range = index.map(|index| layout.joint_positions[index].start);
            range.map_or(f64::NAN, |first| seen.positions[first + start.axis as usize])
        });
        let pose = seen.roots[0].pose;
        let root = [pose.translation.to_array().to_vec(), pose.rotation.to_array().to_vec()].concat();
        let free = !self.root_velocity.is_empty();
        View { joints: joints.collect(), root: root.try_into().ok().filter(|_| free) }
    }
}

impl View {
    /// Returns the largest difference of a joint's or the root's position, rad or m, the root's turn as its
    /// angle; NaN where anything is.
    pub fn difference(&self, joints: &[f64], root: Option<&[f64; 7]>) -> f64 {
        assert_eq!(self.joints.len(), joints.len());
        let mut apart: Vec<f64> = self.joints.iter().zip(joints).map(|(a, b)| (a - b).abs()).collect();
        if let (Some(own), Some(other)) = (&self.root, root) {
            apart.extend((0..3).map(|i| (own[i] - other[i]).abs()));
            let turn = |pose: &[f64; 7]| glamx::DQuat::from_xyzw(pose[3], pose[4], pose[5], pose[6]);
            let between = turn(own).inverse() * turn(other);
            apart.push(2.0 * between.xyz().length().min(1.0).asin());
        }
        apart.into_iter().fold(0.0, |most, next| if next.is_nan() { next } else { most.max(next) })
    }
}

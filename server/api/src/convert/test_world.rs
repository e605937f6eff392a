//! A small world for the tests of conversions: two robots, with one joint of each relevant kind.

#![allow(clippy::unwrap_used)]

use std::sync::Arc;
use std::time::{Duration, UNIX_EPOCH};

use glamx::{DMat3, DPose3, DVec3};
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::Spawn;
use simd_core::{Command, PhysicsSettings, PublishedState, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Geometry, Inertial, Joint, JointKind, JointLimits, Link, Visual};

use simd_world::handle::{Pace, Published, RunState, Statistics};

/// Returns a model: `shoulder` turns, `tool` is fixed, `puck` is planar, `slide` slides.
pub fn model() -> RobotModel {
    let joints = [
        ("shoulder", JointKind::Revolute),
        ("tool", JointKind::Fixed),
        ("puck", JointKind::Planar),
        ("slide", JointKind::Prismatic),
    ];
    RobotModel {
        name: "test arm".to_owned(),
        links: (0..=joints.len()).map(link).collect(),
        joints: joints.into_iter().enumerate().map(joint).collect(),
        ..RobotModel::default()
    }
}

fn link(index: usize) -> Link {
    Link {
        name: format!("link_{index}"),
        inertial: Inertial {
            mass: 1.0,
            center_of_mass: DVec3::new(0.1, 0.0, 0.0),
            inertia: DMat3::from_diagonal(DVec3::new(0.01, 0.02, 0.03)),
        },
        visuals: vec![Visual {
            link_from_shape: DPose3::IDENTITY,
            geometry: Geometry::Sphere { radius: 0.1 },
            color: Some([1.0, 0.5, 0.0, 1.0]),
            texture: None,
        }],
        collisions: Vec::new(),
    }
}

fn joint((index, (name, kind)): (usize, (&str, JointKind))) -> Joint {
    Joint {
        name: name.to_owned(),
        kind,
        parent: index,
        child: index + 1,
        parent_from_joint: DPose3::from_translation(DVec3::new(0.0, 0.0, 0.5)),
        axis: DVec3::Z,
        limits: JointLimits { lower: Some(-1.0), upper: Some(1.0), effort: None, velocity: None },
        damping: 0.1,
        friction: 0.0,
        mimic: None,
    }
}

/// Spawns a robot with a fixed base and these joint positions.
pub fn spawn(name: &str, joint_positions: &[(&str, f64)]) -> Command {
    Command::Spawn(Box::new(Spawn {
        name: name.to_owned(),
        allow_renaming: false,
        model: Arc::new(model()),
        pose: DPose3::IDENTITY,
        fixed_base: Some(true),
        passive: false,
        joint_positions: joint_positions.iter().map(|(name, at)| ((*name).to_owned(), *at)).collect(),
        joint_orientations: Vec::new(),
        shapes: Default::default(),
        contact_settings: Default::default(),
        collision_pairs: Vec::new(),
        free_place: Default::default(),
        loaded_at_start: false,
    }))
}

/// Returns a world with `left` and `right`, in this order.
pub fn simulation() -> Simulation {
    let mut simulation = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    simulation.apply(&spawn("left", &[("shoulder", 0.25), ("slide", 0.5)])).unwrap();
    simulation.apply(&spawn("right", &[("shoulder", -0.25), ("slide", -0.5)])).unwrap();
    simulation
}

/// Publishes the state of a world.
pub fn publish(simulation: &Simulation, sequence: u64) -> Published {
    let mut state = PublishedState::default();
    simulation.observe(&mut state);
    Published {
        sequence,
        wall_time: UNIX_EPOCH + Duration::from_millis(1500),
        state,
        physics: *simulation.settings(),
        statistics: Statistics::at_start(RunState::Paused, Pace::default()),
    }
}

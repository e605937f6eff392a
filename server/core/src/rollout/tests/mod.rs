//! Copies compared with the world itself.

mod costs;
mod crowds;
mod equality;
mod extremes;
mod facts;
mod feet;
mod landing;
mod lanes;
mod pauses;
mod refusals;
mod variations;

use std::sync::Arc;

use glamx::{DMat3, DPose3, DVec3};
use simd_model::RobotModel;
use simd_model::robot::{Collision, Geometry, Inertial, Joint, JointKind, JointLimits, Link, Material};

use super::request::*;
use super::*;
use crate::collision::Shapes;
use crate::simulation::command::Spawn;
use crate::simulation::{Command, PhysicsSettings, WorldLimits};

/// Maximum memory of answers, bytes.
const ROOM: u64 = 64 << 20;

fn link(name: &str, mass: f64, at: DVec3, geometry: Option<Geometry>) -> Link {
    let inertia = DMat3::from_diagonal(DVec3::new(0.02, 0.03, 0.01) * mass);
    let collision = |geometry| Collision {
        link_from_shape: DPose3::from_translation(at),
        geometry,
        material: Material::default(),
    };
    Link {
        name: name.into(),
        inertial: Inertial { mass, center_of_mass: at, inertia },
        visuals: Vec::new(),
        collisions: geometry.into_iter().map(collision).collect(),
    }
}

/// Returns an arm of two joints about y above the ground; its hand is a ball that reaches down to it.
fn arm(masses: [f64; 2]) -> RobotModel {
    let joint = |name: &str, child: usize, at: DVec3| Joint {
        name: name.into(),
        kind: JointKind::Revolute,
        parent: child - 1,
        child,
        parent_from_joint: DPose3::from_translation(at),
        axis: DVec3::Y,
        limits: JointLimits { lower: Some(-2.5), upper: Some(2.5), effort: Some(40.0), velocity: None },
        damping: 0.1,
        friction: 0.2,
        mimic: None,
    };
    let half = DVec3::X * 0.2;
    RobotModel {
        name: "arm".into(),
        links: vec![
            link("base", 1.0, DVec3::ZERO, None),
            link("upper", masses[0], half, None),
            link("hand", masses[1], half * 2.0, Some(Geometry::Sphere { radius: 0.05 })),
        ],
        joints: vec![joint("shoulder", 1, DVec3::Z * 0.5), joint("elbow", 2, DVec3::X * 0.4)],
        ..RobotModel::default()
    }
}

fn spawn(name: &str, model: RobotModel, fixed: bool, at: DVec3) -> Command {
    Command::Spawn(Box::new(Spawn {
        name: name.into(),
        allow_renaming: false,
        shapes: Arc::new(Shapes::new(&model)),
        model: Arc::new(model),
        pose: DPose3::from_translation(at),
        fixed_base: Some(fixed),
        passive: false,
        joint_positions: Vec::new(),
        joint_orientations: Vec::new(),
        contact_settings: Default::default(),
        collision_pairs: Vec::new(),
        free_place: Default::default(),
        loaded_at_start: false,
    }))
}

fn one_link(name: &str, geometry: Geometry) -> RobotModel {
    let links = vec![link(name, 1.0, DVec3::ZERO, Some(geometry))];
    RobotModel { name: name.into(), links, ..RobotModel::default() }
}

/// Returns the arm with links of these masses, a floor within its reach and a ball that falls beside it,
/// after some steps.
fn world_with(masses: [f64; 2]) -> Simulation {
    let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    let floor = one_link("floor", Geometry::Box { size: DVec3::new(4.0, 4.0, 0.2) });
    let ball = one_link("ball", Geometry::Sphere { radius: 0.1 });
    for command in [
        spawn("arm", arm(masses), true, DVec3::ZERO),
        spawn("floor", floor, true, DVec3::Z * -0.1),
        spawn("ball", ball, false, DVec3::new(-1.0, 0.0, 0.105)),
    ] {
        world.apply(&command).unwrap();
    }
    (0..40).for_each(|_| world.step());
    world
}

fn world() -> Simulation {
    world_with([1.0, 0.5])
}

/// Returns a control of all joints of the arm.
fn control(mode: ControlMode, values: Vec<f64>, knots: usize, knot_steps: u64) -> Control {
    Control {
        robot: "arm".into(),
        joints: Vec::new(),
        mode,
        values,
        knots,
        knot_steps,
        interpolation: Interpolation::Hold,
        stiffness: Vec::new(),
        damping: Vec::new(),
        feedback: None,
    }
}

fn named(robot: &str) -> Named {
    Named { robot: robot.into(), names: Vec::new() }
}

/// Returns a request that reads everything that moves, after every step.
fn all_of_it(copies: usize, steps: u64) -> RolloutRequest {
    RolloutRequest {
        copies,
        steps,
        quantities: vec![
            Quantity::JointPositions(named("arm")),
            Quantity::JointVelocities(named("arm")),
            Quantity::JointEfforts(named("arm")),
            Quantity::RootPose("ball".into()),
            Quantity::RootTwist("ball".into()),
            Quantity::LinkPoses(named("arm")),
            Quantity::ContactCount("arm".into()),
            Quantity::ContactForce(named("ball")),
        ],
        record_every: 1,
        ..RolloutRequest::default()
    }
}

/// Returns the same values, read from a world.
fn seen(world: &Simulation) -> Vec<f64> {
    let mut state = PublishedState::default();
    world.observe(&mut state);
    let mut numbers = [&state.positions[..], &state.velocities, &state.efforts].concat();
    let root = &state.roots[2];
    numbers.extend(root.pose.translation.to_array());
    numbers.extend(root.pose.rotation.to_array());
    numbers.extend(root.linear.to_array());
    numbers.extend(root.angular.to_array());
    for pose in state.link_poses(0).unwrap() {
        numbers.extend(pose.translation.to_array());
        numbers.extend(pose.rotation.to_array());
    }
    numbers.push(state.contacts.iter().filter(|contact| contact.robots.contains(&0)).count() as f64);
    let on_ball = state.contacts.iter().filter(|contact| contact.robots.contains(&2));
    numbers.push(on_ball.map(|contact| contact.normal_force).sum());
    numbers
}

fn roll(world: &Simulation, request: RolloutRequest) -> Vec<BatchResult> {
    let rollout = Rollout::new(world.to_saved(), request, ROOM).unwrap();
    let mut worker = rollout.worker();
    (0..rollout.batches()).map(|batch| rollout.advance(&mut worker, batch, &|| false).unwrap()).collect()
}

/// Returns the states of all copies, concatenated.
fn states(batches: &[BatchResult]) -> Vec<f64> {
    batches.iter().flat_map(|batch| batch.states.clone()).collect()
}

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|number| number.to_bits()).collect()
}

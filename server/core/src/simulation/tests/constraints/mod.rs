//! Tests of constraints between links.

mod bodies;
mod disabled;
mod extremes;
mod loops;
mod rules;
mod sizes;
mod split_velocities;
mod threads;

use super::*;
use crate::simulation::published_state::ConstraintState;

const GRAVITY: f64 = 9.81;

/// Returns a uniform bar, from the origin of its link along x.
fn bar(name: &str, mass: f64, length: f64) -> Link {
    let (across, along) = (mass * length * length / 12.0, mass * 1e-4);
    let inertia = DMat3::from_diagonal(DVec3::new(along, across, across));
    link(name, Inertial { mass, center_of_mass: DVec3::X * (0.5 * length), inertia })
}

/// Returns a box that moves alone, about its centre.
fn body(mass: f64, size: DVec3) -> Arc<RobotModel> {
    let square = size * size;
    let moment = DVec3::new(square.y + square.z, square.x + square.z, square.x + square.y) * (mass / 12.0);
    let inertial = Inertial { mass, center_of_mass: DVec3::ZERO, inertia: DMat3::from_diagonal(moment) };
    Arc::new(RobotModel {
        name: "body".into(),
        links: vec![link("body", inertial)],
        joints: Vec::new(),
        ..RobotModel::default()
    })
}

fn hinge_at(name: &str, (parent, child): (usize, usize), at: DVec3, axis: DVec3) -> Joint {
    Joint {
        name: name.into(),
        kind: JointKind::Continuous,
        parent,
        child,
        parent_from_joint: DPose3::from_parts(at, DQuat::IDENTITY),
        axis,
        ..arm_joint()
    }
}

fn world_of(integrator: Integrator, gravity: f64) -> Simulation {
    let settings = PhysicsSettings {
        time_step: 1e-3,
        integrator,
        gravity: DVec3::new(0.0, 0.0, -gravity),
        ..PhysicsSettings::default()
    };
    Simulation::new(settings, WorldLimits::default())
}

fn add_body(world: &mut Simulation, name: &str, model: Arc<RobotModel>, at: DVec3) {
    let pose = DPose3::from_parts(at, DQuat::IDENTITY);
    let spawn = Spawn { fixed_base: Some(false), pose, ..spawn(name, model) };
    world.apply(&Command::Spawn(Box::new(spawn))).unwrap();
}

fn end(robot: &str, link: &str, at: DVec3) -> RequestedEnd {
    let pose = Some(DPose3::from_parts(at, DQuat::IDENTITY));
    RequestedEnd { robot: robot.into(), link: link.into(), joint: String::new(), pose }
}

/// Returns an end with the frame at the parent's present frame.
fn as_it_is(robot: &str) -> RequestedEnd {
    RequestedEnd { robot: robot.into(), ..RequestedEnd::default() }
}

fn constraint(kind: RequestedConstraint, parent: RequestedEnd, child: RequestedEnd) -> CreateConstraint {
    CreateConstraint {
        name: String::new(),
        kind,
        parent,
        child,
        max_force: None,
        max_torque: None,
        breaks: false,
        disable_collisions: false,
    }
}

fn create(world: &mut Simulation, create: CreateConstraint) -> String {
    match world.apply(&Command::CreateConstraint(Box::new(create))).unwrap().reply {
        Reply::ConstraintCreated { name } => name,
        other => panic!("{other:?}"),
    }
}

fn state_of(state: &PublishedState, name: &str) -> ConstraintState {
    let index = state.constraints.iter().position(|of| of.name == name).unwrap();
    state.constraint_states[index]
}

/// Returns the total momentum, angular momentum about the world's origin, and kinetic energy of robots that
/// are single boxes.
fn momenta(state: &PublishedState) -> (DVec3, DVec3, f64) {
    let (mut linear, mut angular, mut energy) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for (root, entity) in state.roots.iter().zip(&state.world.entities) {
        let Inertial { mass, inertia, .. } = entity.model.links[0].inertial;
        let turn = DMat3::from_quat(root.pose.rotation);
        let spin = turn * inertia * turn.transpose() * root.angular;
        linear += mass * root.linear;
        angular += spin + root.pose.translation.cross(mass * root.linear);
        energy += 0.5 * (mass * root.linear.length_squared() + spin.dot(root.angular));
    }
    (linear, angular, energy)
}

//! Robots of one world that step several at once, compared with the same world in which each steps alone.

use super::feet::{STANDS, quadruped, standing_positions};
use super::*;
use crate::dynamics::Integrator;
use crate::dynamics::island::SolverChoice;
use crate::rollout::draw::uniform;
use crate::simulation::command::{JointReset, RobotReset, RobotTargets, SetTargets, WholeTarget};
use crate::simulation::{Event, EventKind};

const ROBOTS: usize = 21;

fn name(robot: usize) -> String {
    format!("robot-{robot}")
}

/// Returns quadrupeds that fall on a plane; some are added to the world before it. The last one falls on the
/// one before it, one falls on a box, and one on its back. Beside them arms hang on fixed bases.
fn many(integrator: Integrator, substeps: u32) -> Simulation {
    let settings = PhysicsSettings { integrator, substeps, ..PhysicsSettings::default() };
    let mut world = Simulation::new(settings, WorldLimits::default());
    let model = quadruped(0.1);
    let positions = standing_positions(&model);
    let Command::Spawn(first) = spawn("", model, false, DVec3::ZERO) else { unreachable!() };
    for robot in 0..ROBOTS {
        if robot == 9 {
            let plane = one_link("plane", Geometry::Plane { normal: DVec3::new(0.05, 0.0, 1.0) });
            world.apply(&spawn("plane", plane, true, DVec3::ZERO)).unwrap();
            let step = one_link("step", Geometry::Box { size: DVec3::splat(0.1) });
            world.apply(&spawn("step", step, true, DVec3::new(8.15, 0.0, -0.36))).unwrap();
        }
        let x = 2.0 * robot.min(ROBOTS - 2) as f64;
        let above = if robot == ROBOTS - 1 { 0.5 } else { 0.35 + 0.003 * robot as f64 };
        let turn = if robot == 3 { glamx::DQuat::from_rotation_x(3.1) } else { glamx::DQuat::IDENTITY };
        let mut spawn = first.clone();
        spawn.name = name(robot);
        spawn.pose = DPose3::from_parts(DVec3::new(x, 0.0, above - 0.05 * x), turn);
        spawn.joint_positions = positions.clone();
        world.apply(&Command::Spawn(spawn)).unwrap();
    }
    let Command::Spawn(first) = spawn("", arm([1.5, 0.8]), true, DVec3::ZERO) else { unreachable!() };
    for index in 0..6 {
        let turn = glamx::DQuat::from_rotation_z(index as f64);
        let at = DVec3::new(2.0 * index as f64, 5.0, 1.2 - 0.1 * index as f64);
        let (name, pose) = (format!("arm-{index}"), DPose3::from_parts(at, turn));
        let joint_positions = vec![("shoulder".into(), 0.3 * index as f64)];
        let arm = Spawn { name, pose, joint_positions, passive: index % 2 == 0, ..(*first).clone() };
        world.apply(&Command::Spawn(Box::new(arm))).unwrap();
    }
    world
}

/// Sets targets of all robots. One robot's mode differs, and one is passive.
fn drive(world: &mut Simulation, number: u64) {
    for robot in (0..ROBOTS).filter(|robot| number < 9 || *robot != 8) {
        let target = |joint: usize| {
            STANDS[joint % 3] + 0.3 * uniform([7, number, robot as u64, joint as u64], -0.5, 0.5)
        };
        let targets: Vec<f64> = (0..12).map(target).collect();
        let whole = match (robot, number % 3) {
            (5, _) => WholeTarget::Passive,
            (7, 1) => WholeTarget::Velocity(vec![0.2; 12]),
            (11, 2) => WholeTarget::Effort(vec![80.0; 12]),
            _ => WholeTarget::Position(targets),
        };
        let robot = RobotTargets { robot: name(robot), whole: Some(whole), ..Default::default() };
        let command = SetTargets { robots: vec![robot], ..Default::default() };
        world.apply(&Command::SetTargets(command)).unwrap();
    }
}

#[test]
fn robots_that_step_several_at_once_have_the_bits_of_those_that_step_by_themselves() {
    for (integrator, substeps) in
        [(Integrator::Leapfrog, 1), (Integrator::Leapfrog, 3), (Integrator::Euler, 1)]
    {
        let mut together = many(integrator, substeps);
        let mut apart = many(integrator, substeps);
        apart.measure_solver(SolverChoice::Automatic);
        let mut at_once = 0;
        for step in 0..900 {
            if step % 60 == 0 {
                drive(&mut together, step / 60);
                drive(&mut apart, step / 60);
            }
            if step == 500 {
                let robot = name(8);
                together.apply(&Command::Delete { robot: robot.clone() }).unwrap();
                apart.apply(&Command::Delete { robot }).unwrap();
            }
            together.step();
            apart.step();
            at_once += together.robots_at_once();
            assert_eq!(apart.robots_at_once(), 0);
            if step % 10 == 0 {
                assert_eq!(together.fingerprint(), apart.fingerprint(), "{integrator:?} {substeps} {step}");
            }
        }
        let part = at_once as f64 / (900 * ROBOTS) as f64;
        assert!(part > 0.3, "only {part} of the robots' steps were done in lanes");
    }
}

/// A lane keeps nothing of a state that is not finite: later robots are in lanes as before.
#[test]
fn a_robot_that_is_not_finite_leaves_its_lane_to_others() {
    let mut world = many(Integrator::Leapfrog, 1);
    (0..200).for_each(|_| world.step());
    let before = world.robots_at_once();
    let reset =
        JointReset { joint: "fl_upper".into(), axis: 0, position: 0.0, velocity: 1e12, spherical: None };
    let robots = vec![RobotReset { robot: name(12), joints: vec![reset] }];
    world.apply(&Command::ResetJoints { robots }).unwrap();
    (0..20).for_each(|_| world.step());
    let gone = |event: &Event| matches!(event.kind, EventKind::EntityDisabled { .. });
    assert!(world.take_events().iter().any(gone), "it went on");
    world.apply(&Command::Delete { robot: name(12) }).unwrap();
    (0..20).for_each(|_| world.step());
    assert!(world.robots_at_once() + 2 >= before, "{} of {before}", world.robots_at_once());
}

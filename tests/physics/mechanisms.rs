//! Closed mechanisms with constraints between links: a delta robot, a gripper whose fingers a gear couples, a
//! bridge of planks.

use std::f64::consts::TAU;
use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::command::*;
use simd_core::simulation::published_state::ConstraintState;
use simd_core::{Command, PublishedState, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Joint, JointKind, JointLimits, Link};
use simd_tests::scenes::*;

const G: f64 = 9.81;

fn end(robot: &str, link: &str, at: DVec3) -> RequestedEnd {
    let pose = Some(DPose3::from_translation(at));
    RequestedEnd { robot: robot.into(), link: link.into(), joint: String::new(), pose }
}

fn hold(world: &mut Simulation, kind: RequestedConstraint, parent: RequestedEnd, child: RequestedEnd) {
    let create = CreateConstraint {
        name: String::new(),
        kind,
        parent,
        child,
        max_force: None,
        max_torque: None,
        breaks: false,
        disable_collisions: true,
    };
    apply(world, Command::CreateConstraint(Box::new(create)));
}

fn largest_error(state: &PublishedState) -> f64 {
    let error = |of: &ConstraintState| of.position_error.max(of.angle_error);
    state.constraint_states.iter().map(error).fold(0.0, f64::max)
}

fn aim(world: &mut Simulation, robot: &str, targets: impl IntoIterator<Item = (String, f64)>) {
    let joint = |(joint, q)| JointTarget { joint, axis: 0, target: Target::position(q) };
    let joints = targets.into_iter().map(joint).collect();
    let robots = vec![RobotTargets { robot: robot.into(), joints, ..RobotTargets::default() }];
    apply(world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
}

/// Dimensions of a delta robot: radius of the base's joints, lengths of arms and rods, radius of the
/// platform, half the distance of two rods.
const BASE: f64 = 0.2;
const ARM: f64 = 0.2;
const ROD: f64 = 0.4;
const PLATFORM: f64 = 0.05;
const HALF: f64 = 0.06;

fn side(number: usize) -> DQuat {
    DQuat::from_rotation_z(TAU * number as f64 / 3.0)
}

/// Returns a base with three arms, which point outwards at 0 and down for positive angles.
fn delta_arms() -> Arc<RobotModel> {
    let bare = |name: &str, center: DVec3, mass: f64| {
        let mut link: Link = cuboid(DVec3::new(ARM, 0.03, 0.03), mass).links[0].clone();
        link.collisions.clear();
        (link.name, link.inertial.center_of_mass) = (name.into(), center);
        link
    };
    let mut model = RobotModel {
        name: "delta".into(),
        links: vec![bare("base", DVec3::ZERO, 1.0)],
        joints: Vec::new(),
        ..RobotModel::default()
    };
    for number in 0..3 {
        model.links.push(bare(&format!("arm-{number}"), DVec3::X * (ARM / 2.0), 0.3));
        model.joints.push(Joint {
            name: format!("motor-{number}"),
            kind: JointKind::Continuous,
            parent: 0,
            child: number + 1,
            parent_from_joint: DPose3::from_parts(side(number) * (DVec3::X * BASE), side(number)),
            axis: DVec3::Y,
            limits: JointLimits::default(),
            damping: 0.0,
            friction: 0.0,
            mimic: None,
        });
    }
    Arc::new(model)
}

/// Six rods between the elbows and the platform keep it level.
fn delta(start: f64) -> Simulation {
    let mut world = world(1e-3);
    let joint_positions = (0..3).map(|number| (format!("motor-{number}"), start)).collect();
    let arms = robot("delta", &delta_arms(), DPose3::IDENTITY, true);
    spawn(&mut world, Spawn { joint_positions, passive: false, ..arms });
    let across = BASE + ARM * start.cos() - PLATFORM;
    let depth = ARM * start.sin() + (ROD * ROD - across * across).sqrt();
    let platform = cuboid(DVec3::new(0.1, 0.1, 0.02), 0.5);
    spawn(&mut world, robot("platform", &platform, DPose3::from_translation(DVec3::Z * -depth), false));
    for number in 0..3 {
        for shift in [-HALF, HALF] {
            let elbow = end("delta", &format!("arm-{number}"), DVec3::new(ARM, shift, 0.0));
            let joint = end("platform", "", side(number) * DVec3::new(PLATFORM, shift, 0.0));
            let kind = RequestedConstraint::Distance { length: Some(ROD), is_rope: false };
            hold(&mut world, kind, elbow, joint);
        }
    }
    world
}

/// At 1 ms the rods keep their length to a micrometre and the platform stays level. It moves at up to half a
/// metre a second.
#[test]
fn a_delta_robot_is_driven_for_a_minute() {
    let mut world = delta(0.3);
    let mut state = PublishedState::default();
    let (mut error, mut lean, mut fastest) = (0.0f64, 0.0f64, 0.0f64);
    for step in 0..60_000 {
        let time = f64::from(step) * 1e-3;
        let size = 0.2 * (time / 2.0).min(1.0).powi(3);
        let angle = |number: usize| 0.3 + size * (TAU * (0.5 * time + number as f64 / 3.0)).sin();
        aim(&mut world, "delta", (0..3).map(|number| (format!("motor-{number}"), angle(number))));
        world.step();
        world.observe(&mut state);
        error = error.max(largest_error(&state));
        lean = lean.max(state.roots[1].pose.rotation.angle_between(DQuat::IDENTITY));
        fastest = fastest.max(state.roots[1].linear.length());
    }
    assert!(error < 1e-6 && lean < 1e-5, "{error:e} {lean:e}");
    assert!(fastest > 0.1, "{fastest}");
}

/// By virtual work: each motor carries its arm, and a third of the platform times the change of its height.
#[test]
fn a_delta_robot_at_rest_carries_its_platform() {
    let mut world = delta(0.3);
    aim(&mut world, "delta", (0..3).map(|number| (format!("motor-{number}"), 0.3)));
    (0..4_000).for_each(|_| world.step());
    let mut state = PublishedState::default();
    world.observe(&mut state);
    let q = state.positions[0];
    let height = |q: f64| {
        let across = BASE + ARM * q.cos() - PLATFORM;
        -ARM * q.sin() - (ROD * ROD - across * across).sqrt()
    };
    let slope = (height(q + 1e-5) - height(q - 1e-5)) / 2e-5;
    let effort = 0.3 * G * (-ARM / 2.0 * q.cos()) + 0.5 * G / 3.0 * slope;
    for found in &state.efforts {
        assert!((found - effort).abs() < 1e-6 * effort.abs(), "{found} {effort}");
    }
    let carried: DVec3 = state.constraint_states.iter().map(|of| of.force).sum();
    assert!((carried - DVec3::Z * (0.5 * G)).length() < 1e-6, "{carried}");
    assert!(largest_error(&state) < 1e-8, "{:e}", largest_error(&state));
}

/// One finger is driven, and a gear moves the other. Friction holds the cube, then a weld carries it, and
/// then it is released.
#[test]
fn a_gripper_with_a_gear_lifts_a_cube_and_a_weld_carries_it() {
    let mut world = world(1e-3);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    let at = DPose3::from_translation(DVec3::Z * 0.02);
    let mut hand = robot("gripper", &gripper(), at, true);
    hand.contact_settings = surface(1.0, 0.0);
    spawn(&mut world, Spawn { passive: false, ..hand });
    let mut cube =
        robot("cube", &cuboid(DVec3::splat(0.06), 0.2), DPose3::from_translation(DVec3::Z * 0.03), false);
    cube.contact_settings = surface(1.0, 0.0);
    spawn(&mut world, cube);
    let joint =
        |joint: &str| RequestedEnd { robot: "gripper".into(), joint: joint.into(), ..Default::default() };
    hold(
        &mut world,
        RequestedConstraint::Gear { ratio: 1.0, offset: Some(0.0) },
        joint("left"),
        joint("right"),
    );
    let passive = JointTarget { joint: "right".into(), axis: 0, target: Target::Passive };
    let robots =
        vec![RobotTargets { robot: "gripper".into(), joints: vec![passive], ..RobotTargets::default() }];
    apply(&mut world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
    let run = |world: &mut Simulation, steps: usize| {
        (0..steps).for_each(|_| world.step());
        let mut state = PublishedState::default();
        world.observe(&mut state);
        state
    };
    aim(&mut world, "gripper", [("left".to_owned(), 0.09)]);
    let state = run(&mut world, 1_000);
    assert!((state.positions[1] - state.positions[2]).abs() < 1e-6, "{:?}", state.positions);
    aim(&mut world, "gripper", [("lift".to_owned(), 0.3)]);
    let state = run(&mut world, 2_500);
    let height = state.roots[2].pose.translation.z;
    assert!((height - 0.33).abs() < 5e-3, "{height}");
    let grasp =
        (end("gripper", "hand", DVec3::ZERO), RequestedEnd { robot: "cube".into(), ..Default::default() });
    hold(&mut world, RequestedConstraint::Weld, grasp.0, grasp.1);
    aim(&mut world, "gripper", [("left".to_owned(), 0.0)]);
    let state = run(&mut world, 1_000);
    assert!((state.roots[2].pose.translation.z - height).abs() < 1e-3, "{:?}", state.roots[2]);
    assert!((state.constraint_states[1].force.z - 0.2 * G).abs() < 1e-6, "{:?}", state.constraint_states);
    apply(&mut world, Command::DeleteConstraint { name: "constraint_2".into() });
    let state = run(&mut world, 100);
    let fallen = height - state.roots[2].pose.translation.z;
    assert!((fallen - 0.5 * G * 0.01).abs() < 2e-3, "{fallen}");
}

/// Twenty planks hang between two banks, each by two points on the next, and a box lies on them.
#[test]
fn a_bridge_of_planks_carries_a_box() {
    let (count, length, lean) = (20, 0.1, 0.03);
    let mut world = world(1e-3);
    let plank = cuboid(DVec3::new(0.09, 0.4, 0.02), 1.0);
    let mut at = DVec3::ZERO;
    for number in 0..count {
        // Chords of an arc.
        let angle = lean * (0.5 * f64::from(count - 1) - f64::from(number));
        let turn = DQuat::from_rotation_y(angle);
        let along = turn * (DVec3::X * length);
        let name = format!("plank-{number}");
        let mut spawned = robot(&name, &plank, DPose3::from_parts(at + 0.5 * along, turn), false);
        spawned.contact_settings = surface(0.6, 0.0);
        spawn(&mut world, spawned);
        for y in [-0.2, 0.2] {
            let child = end(&name, "", DVec3::new(-length / 2.0, y, 0.0));
            let parent = match number {
                0 => end("", "", DVec3::Y * y),
                _ => end(&format!("plank-{}", number - 1), "", DVec3::new(length / 2.0, y, 0.0)),
            };
            hold(&mut world, RequestedConstraint::PointToPoint, parent, child);
        }
        at += along;
    }
    for y in [-0.2, 0.2] {
        let last = end(&format!("plank-{}", count - 1), "", DVec3::new(length / 2.0, y, 0.0));
        hold(&mut world, RequestedConstraint::PointToPoint, last, end("", "", at + DVec3::Y * y));
    }
    let mut load = robot(
        "box",
        &cuboid(DVec3::splat(0.15), 5.0),
        DPose3::from_translation(DVec3::new(1.0, 0.0, 0.0)),
        false,
    );
    load.contact_settings = surface(0.6, 0.0);
    spawn(&mut world, load);
    let mut state = PublishedState::default();
    let (mut error, mut carried) = (0.0f64, DVec3::ZERO);
    for step in 0..4_000 {
        world.step();
        world.observe(&mut state);
        error = error.max(largest_error(&state));
        if step >= 2_000 {
            let forces = &state.constraint_states;
            let banks = [
                forces[0].force,
                forces[1].force,
                -forces[2 * count as usize].force,
                -forces[2 * count as usize + 1].force,
            ];
            carried += banks.iter().sum::<DVec3>() / 2_000.0;
        }
    }
    let weight = (f64::from(count) + 5.0) * G;
    assert!(error < 1e-4, "{error:e}");
    // It swings; the mean force on the banks over two seconds is the weight, except for the momentum at both
    // ends.
    assert!((carried.z / weight - 1.0).abs() < 0.1, "{carried} {weight}");
    let (load, plank) = (state.roots[20].pose.translation, state.roots[10].pose.translation);
    assert!((load.z - plank.z - 0.085).abs() < 0.02 && (load.x - 1.0).abs() < 0.1, "{load} {plank}");
}

/// Returns a door: a panel on a hinge about z, and a handle on it that turns about y. A latch slides out of
/// its edge at x = 0.8.
fn door() -> Arc<RobotModel> {
    let part = |name: &str, size: DVec3, mass: f64, center: DVec3| {
        let mut link: Link = cuboid(size, mass).links[0].clone();
        link.name = name.into();
        link.inertial.center_of_mass = center;
        link.collisions.iter_mut().for_each(|of| of.link_from_shape = DPose3::from_translation(center));
        link
    };
    let joint =
        |name: &str, kind, [parent, child]: [usize; 2], at: DVec3, axis, [lower, upper]: [f64; 2]| Joint {
            name: name.into(),
            kind,
            parent,
            child,
            parent_from_joint: DPose3::from_translation(at),
            axis,
            limits: JointLimits { lower: Some(lower), upper: Some(upper), ..JointLimits::default() },
            damping: 0.1,
            friction: 0.0,
            mimic: None,
        };
    let mut frame = part("frame", DVec3::splat(0.02), 1.0, DVec3::ZERO);
    frame.collisions.clear();
    let links = vec![
        frame,
        part("panel", DVec3::new(0.78, 0.03, 2.0), 20.0, DVec3::X * 0.4),
        part("handle", DVec3::new(0.12, 0.02, 0.02), 0.2, DVec3::new(-0.06, 0.04, 0.0)),
        part("latch", DVec3::new(0.06, 0.02, 0.04), 0.1, DVec3::ZERO),
    ];
    let joints = vec![
        joint("hinge", JointKind::Revolute, [0, 1], DVec3::ZERO, DVec3::Z, [-0.1, 2.0]),
        joint("handle", JointKind::Revolute, [1, 2], DVec3::X * 0.7, DVec3::Y, [-1.0, 1.0]),
        joint("latch", JointKind::Prismatic, [1, 3], DVec3::X * 0.8, DVec3::X, [-0.05, 0.01]),
    ];
    Arc::new(RobotModel { name: "door".into(), links, joints, ..RobotModel::default() })
}

/// Under a push of 5 N m the door opens only by the latch's 1 cm of play at its 0.8 m. The handle pulls the
/// latch by a gear, and then the door swings.
#[test]
fn a_door_opens_when_its_handle_draws_the_latch() {
    let mut world = world(1e-3);
    let strike = robot(
        "strike",
        &cuboid(DVec3::new(0.06, 0.04, 0.2), 1.0),
        DPose3::from_translation(DVec3::new(0.84, 0.04, 0.0)),
        true,
    );
    spawn(&mut world, Spawn { contact_settings: surface(0.2, 0.0), ..strike });
    let door = robot("door", &door(), DPose3::IDENTITY, true);
    spawn(&mut world, Spawn { contact_settings: surface(0.2, 0.0), ..door });
    let joint =
        |joint: &str| RequestedEnd { robot: "door".into(), joint: joint.into(), ..Default::default() };
    let ratio = -0.05;
    hold(&mut world, RequestedConstraint::Gear { ratio, offset: None }, joint("handle"), joint("latch"));
    let push = JointTarget { joint: "hinge".into(), axis: 0, target: Target::Effort(5.0) };
    let robots = vec![RobotTargets { robot: "door".into(), joints: vec![push], ..RobotTargets::default() }];
    apply(&mut world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
    let run = |world: &mut Simulation, steps: usize| {
        (0..steps).for_each(|_| world.step());
        let mut state = PublishedState::default();
        world.observe(&mut state);
        state
    };
    aim(&mut world, "door", [("handle".to_owned(), 0.0)]);
    let state = run(&mut world, 1_000);
    let [hinge, ..] = state.positions[..] else { panic!("the door has joints") };
    assert!(hinge > 0.0 && (hinge - 0.01 / 0.8).abs() < 3e-3, "{hinge}");
    aim(&mut world, "door", [("handle".to_owned(), 0.8)]);
    let state = run(&mut world, 1_500);
    let [hinge, handle, latch] = state.positions[..] else { panic!("the door has three joints") };
    assert!(hinge > 0.5, "{:?}", state.positions);
    assert!((handle - 0.8).abs() < 1e-3 && (latch - ratio * handle).abs() < 1e-6, "{handle} {latch}");
}

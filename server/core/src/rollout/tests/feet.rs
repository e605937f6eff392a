//! Copies of a quadruped on a plane: lanes handle the contacts of its feet.

use super::lanes::{alone, assert_equal, assert_neighbours_do_not_matter, in_all_widths};
use super::*;
use crate::dynamics::Integrator;
use crate::rollout::draw::uniform;

/// Standing positions of hip, upper and lower joint of a leg, rad.
pub(super) const STANDS: [f64; 3] = [0.0, 0.67, -1.3];

/// Number of joints of all legs.
const JOINTS: usize = 12;

/// Returns a trunk of 6 kg and four legs of three joints, each with a ball as a foot; lengths and masses of
/// an A1.
pub(super) fn quadruped(friction: f64) -> RobotModel {
    let shape = |size: DVec3| Some(Geometry::Box { size });
    let mut links = vec![link("trunk", 6.0, DVec3::ZERO, shape(DVec3::new(0.267, 0.194, 0.114)))];
    let mut joints = Vec::new();
    for (leg, x, y) in [("fr", 0.18, -0.05), ("fl", 0.18, 0.05), ("rr", -0.18, -0.05), ("rl", -0.18, 0.05)] {
        let first = links.len();
        let middle = DVec3::Z * -0.1;
        links.push(link(&format!("{leg}_hip"), 0.7, DVec3::ZERO, shape(DVec3::splat(0.06))));
        links.push(link(&format!("{leg}_upper"), 1.0, middle, shape(DVec3::new(0.0245, 0.034, 0.2))));
        let mut lower = link(&format!("{leg}_lower"), 0.2, middle, shape(DVec3::new(0.016, 0.016, 0.2)));
        let mut foot = lower.collisions[0].clone();
        foot.link_from_shape = DPose3::from_translation(DVec3::Z * -0.2);
        foot.geometry = Geometry::Sphere { radius: 0.02 };
        lower.collisions.push(foot);
        links.push(lower);
        for (part, child, parent, at, axis, [low, high], effort) in [
            ("hip", first, 0, DVec3::new(x, y, 0.0), DVec3::X, [-0.8, 0.8], 20.0),
            ("upper", first + 1, first, DVec3::Y * y.signum() * 0.08, DVec3::Y, [-1.0, 4.1], 55.0),
            ("lower", first + 2, first + 1, DVec3::Z * -0.2, DVec3::Y, [-2.6, -0.9], 55.0),
        ] {
            joints.push(Joint {
                name: format!("{leg}_{part}"),
                kind: JointKind::Revolute,
                parent,
                child,
                parent_from_joint: DPose3::from_translation(at),
                axis,
                limits: JointLimits {
                    lower: Some(low),
                    upper: Some(high),
                    effort: Some(effort),
                    velocity: Some(30.0),
                },
                damping: 0.0,
                friction,
                mimic: None,
            });
        }
    }
    RobotModel { name: "quadruped".into(), links, joints, ..RobotModel::default() }
}

/// Returns the standing positions of its joints.
pub(super) fn standing_positions(model: &RobotModel) -> Vec<(String, f64)> {
    let joints = model.joints.iter().enumerate();
    joints.map(|(index, joint)| (joint.name.clone(), STANDS[index % 3])).collect()
}

/// Returns the standing quadruped at a height above a plane, metres; the plane comes first or last.
fn world_on_plane(
    model: RobotModel,
    height: f64,
    plane_first: bool,
    integrator: Integrator,
    substeps: u32,
) -> Simulation {
    let settings = PhysicsSettings { integrator, substeps, ..PhysicsSettings::default() };
    let mut world = Simulation::new(settings, WorldLimits::default());
    let positions = standing_positions(&model);
    let Command::Spawn(mut robot) = spawn("quadruped", model, false, DVec3::Z * height) else {
        unreachable!()
    };
    robot.joint_positions = positions;
    let plane = spawn("plane", one_link("plane", Geometry::Plane { normal: DVec3::Z }), true, DVec3::ZERO);
    let mut commands = [Command::Spawn(robot), plane];
    if plane_first {
        commands.reverse();
    }
    for command in &commands {
        world.apply(command).unwrap();
    }
    world
}

/// Returns the standing quadruped after some steps.
pub(super) fn standing(steps: usize, plane_first: bool) -> Simulation {
    let mut world = world_on_plane(quadruped(0.0), 0.34, plane_first, Integrator::Leapfrog, 1);
    (0..steps).for_each(|_| world.step());
    world
}

/// Returns targets of `knots` knots that differ from the standing positions by a part of `sizes`, for hip,
/// upper and lower joints.
fn targets(copies: usize, knots: usize, sizes: [f64; 3]) -> Vec<f64> {
    let noise = |index: usize| (0..12).map(|k| uniform([3, index as u64, k, 0], -0.5, 0.5)).sum::<f64>();
    (0..copies * knots * JOINTS).map(|index| STANDS[index % 3] + sizes[index % 3] * noise(index)).collect()
}

pub(super) fn drive(copies: usize, steps: u64, every: u64, sizes: [f64; 3]) -> RolloutRequest {
    let knots = steps.div_ceil(every) as usize;
    let values = targets(copies, knots, sizes);
    RolloutRequest {
        controls: vec![Control {
            robot: "quadruped".into(),
            stiffness: vec![80.0; JOINTS],
            damping: vec![2.0; JOINTS],
            ..control(ControlMode::Position, values, knots, every)
        }],
        quantities: vec![
            Quantity::JointPositions(named("quadruped")),
            Quantity::JointVelocities(named("quadruped")),
            Quantity::JointEfforts(named("quadruped")),
            Quantity::RootPose("quadruped".into()),
            Quantity::RootTwist("quadruped".into()),
            Quantity::ContactCount("quadruped".into()),
            Quantity::ContactForce(named("quadruped")),
        ],
        ..all_of_it(copies, steps)
    }
}

/// Returns the part of the steps that were done in lanes.
fn part_in_lanes(found: &BatchResult) -> f64 {
    found.lane_steps as f64 / found.steps_done.iter().sum::<u64>() as f64
}

fn assert_as_alone(world: &Simulation, request: RolloutRequest, part: f64, what: &str) {
    let copies = request.copies;
    let rollout = Rollout::new(world.to_saved(), request, ROOM).unwrap();
    assert!(rollout.has_lanes, "{what}");
    let expected = alone(&rollout, 0..copies);
    for (width, found) in in_all_widths(&rollout, 0..copies) {
        let what = format!("{what}, {width} lanes");
        println!("{what}: {}", part_in_lanes(&found));
        assert_equal(&found, &expected, &what);
        assert!(part_in_lanes(&found) >= part, "{what}: {}", part_in_lanes(&found));
    }
}

#[test]
fn a_quadruped_that_stands_has_the_bits_of_the_world() {
    for plane_first in [true, false] {
        let world = standing(300, plane_first);
        assert_as_alone(&world, drive(8, 200, 50, [0.02; 3]), 0.9, "standing");
    }
}

/// Targets far from the standing position that change soon: feet leave the ground, land and slip.
#[test]
fn a_quadruped_that_steps_lands_and_slips_has_the_bits_of_the_world() {
    let world = standing(300, true);
    assert_as_alone(&world, drive(8, 300, 60, [0.1, 0.4, 0.4]), 0.5, "stepping");
    let fallen = world_on_plane(quadruped(0.0), 0.42, false, Integrator::Leapfrog, 1);
    let mut fallen = fallen;
    (0..3).for_each(|_| fallen.step());
    assert_as_alone(&fallen, drive(8, 300, 100, [0.02; 3]), 0.5, "landing");
    let mut request = drive(8, 300, 40, [0.2, 0.1, 0.1]);
    request.variations = vec![Variation {
        of: Varied::SurfaceFriction(named("plane")),
        values: Values::Uniform { low: 0.05, high: 0.4 },
    }];
    assert_as_alone(&world, request, 0.5, "slipping");
}

/// Several parts of a step, and the other integrator.
#[test]
fn a_quadruped_has_the_bits_of_the_world_by_each_integrator() {
    for (integrator, substeps) in [(Integrator::Euler, 1), (Integrator::Leapfrog, 2)] {
        let mut world = world_on_plane(quadruped(0.0), 0.35, true, integrator, substeps);
        (0..150).for_each(|_| world.step());
        let what = format!("{integrator:?} of {substeps} parts");
        assert_as_alone(&world, drive(5, 150, 50, [0.05, 0.1, 0.1]), 0.5, &what);
    }
}

/// Rows of joints and contacts are solved together: dry friction, and limits that targets lead to.
#[test]
fn a_quadruped_with_dry_friction_and_joints_at_limits_has_the_bits_of_the_world() {
    for (friction, integrator, substeps) in
        [(0.1, Integrator::Leapfrog, 1), (0.0, Integrator::Leapfrog, 1), (0.3, Integrator::Euler, 2)]
    {
        let mut world = world_on_plane(quadruped(friction), 0.37, true, integrator, substeps);
        (0..3).for_each(|_| world.step());
        let what = format!("dry friction of {friction}");
        let mut request = drive(8, 300, 50, [0.5, 0.2, 0.5]);
        let limits = [0.9, 0.67, -0.8];
        let values = request.controls[0].values.iter_mut().enumerate();
        values.filter(|(index, _)| index % 7 == 0).for_each(|(index, value)| *value = limits[index % 3]);
        assert_as_alone(&world, request, 0.7, &what);
    }
}

#[test]
fn the_copies_beside_one_that_touches_do_not_matter() {
    let world = standing(300, true);
    let rollout = Rollout::new(world.to_saved(), drive(8, 120, 40, [0.1, 0.3, 0.3]), ROOM).unwrap();
    assert_neighbours_do_not_matter(&rollout);
}

/// A trunk that comes down on the plane, with folded legs beside it. Shapes that are not feet touch too, and
/// lanes leave them to the world.
#[test]
fn a_quadruped_that_lies_down_has_the_bits_of_the_world() {
    let world = standing(300, false);
    let mut request = drive(5, 400, 200, [0.0; 3]);
    let folds = |index: usize| [0.0, 1.4, -2.5][index % 3] * if index % 24 < JOINTS { 1.0 } else { 0.5 };
    request.controls[0].stiffness = vec![3.0; JOINTS];
    request.controls[0].damping = vec![0.3; JOINTS];
    request.controls[0].values = (0..5 * 2 * JOINTS).map(folds).collect();
    request.costs =
        vec![CostTerm { weight: 1.0, final_weight: 2.0, of: Cost::JointEfforts(named("quadruped")) }];
    request.step_costs = true;
    let rollout = Rollout::new(world.to_saved(), request.clone(), ROOM).unwrap();
    let expected = alone(&rollout, 0..5);
    let contacts = expected.states.chunks_exact(rollout.shape().columns()).map(|row| row[row.len() - 2]);
    assert!(contacts.fold(0.0, f64::max) > 4.0, "more than feet touch");
    assert_as_alone(&world, request, 0.1, "lying down");
}

/// Planes of copies at other positions do not match the lanes' planes.
#[test]
fn copies_on_planes_of_different_heights_have_the_bits_of_the_world() {
    let world = standing(300, true);
    let mut request = drive(4, 150, 50, [0.02; 3]);
    let heights = [0.0, -0.01, 0.0, -0.03];
    let roots = heights.into_iter().flat_map(|height| [0.0, 0.0, height, 0.0, 0.0, 0.0, 1.0]);
    request.starts = vec![Start { robot: "plane".into(), roots: roots.collect(), ..Start::default() }];
    assert_as_alone(&world, request, 0.4, "on planes of different heights");
}

/// Only joints of legs have targets, if there are others.
fn drive_legs(model: &RobotModel, copies: usize, steps: u64, sizes: [f64; 3]) -> RolloutRequest {
    let mut request = drive(copies, steps, 50, sizes);
    request.controls[0].joints = model.joints.iter().take(JOINTS).map(|joint| joint.name.clone()).collect();
    request
}

/// Three level balls on each front foot: with three contacts of a body the world sums responses differently.
#[test]
fn a_quadruped_with_feet_of_three_balls_has_the_bits_of_the_world() {
    let mut model = quadruped(0.0);
    for link in model.links.iter_mut().filter(|link| ["fr_lower", "fl_lower"].contains(&&*link.name)) {
        for y in [-0.02, 0.02] {
            let mut ball = link.collisions[1].clone();
            ball.link_from_shape = DPose3::from_translation(DVec3::new(0.0, y, -0.2));
            link.collisions.push(ball);
        }
    }
    for plane_first in [true, false] {
        let mut world = world_on_plane(model.clone(), 0.34, plane_first, Integrator::Leapfrog, 1);
        (0..300).for_each(|_| world.step());
        for sizes in [[0.02; 3], [0.2, 0.3, 0.3]] {
            assert_as_alone(&world, drive(8, 200, 50, sizes), 0.0, "feet of three balls");
        }
    }
}

/// With these numbers of joints the world solves some numbers of contacts directly and sweeps others.
#[test]
fn a_quadruped_with_a_long_chain_on_its_trunk_has_the_bits_of_the_world() {
    for more in [30, 33] {
        let mut model = quadruped(0.0);
        for index in 0..more {
            let parent = if index == 0 { 0 } else { model.links.len() - 1 };
            model.links.push(link(&format!("chain_{index}"), 0.02, DVec3::Z * 0.01, None));
            model.joints.push(Joint {
                name: format!("chain_{index}"),
                parent,
                child: model.links.len() - 1,
                parent_from_joint: DPose3::from_translation(DVec3::Z * 0.02),
                axis: [DVec3::X, DVec3::Y][index % 2],
                limits: JointLimits::default(),
                ..model.joints[0].clone()
            });
        }
        let mut world = world_on_plane(model.clone(), 0.35, true, Integrator::Leapfrog, 1);
        (0..100).for_each(|_| world.step());
        let request = drive_legs(&model, 4, 150, [0.1, 0.4, 0.4]);
        assert_as_alone(&world, request, 0.3, &format!("{more} more joints"));
    }
}

/// Planes of robots before and after the quadruped in a world, one of them a wall. Masses, gains and pushes
/// differ, and a distant box has another position in each copy.
#[test]
fn a_quadruped_between_a_floor_and_a_wall_has_the_bits_of_the_world() {
    for floor_first in [true, false] {
        let mut world = world_on_plane(quadruped(0.0), 0.34, floor_first, Integrator::Leapfrog, 3);
        let normal = DVec3::new(-1.0, 0.0, 0.1).normalize();
        world
            .apply(&spawn("wall", one_link("wall", Geometry::Plane { normal }), true, DVec3::X * 0.28))
            .unwrap();
        let far = one_link("box", Geometry::Box { size: DVec3::ONE });
        world.apply(&spawn("box", far, true, DVec3::Y * 50.0)).unwrap();
        (0..300).for_each(|_| world.step());
        let mut request = drive(4, 200, 50, [0.05, 0.3, 0.3]);
        request.variations = vec![
            Variation {
                of: Varied::LinkMasses(named("quadruped")),
                values: Values::Uniform { low: 0.8, high: 1.2 },
            },
            Variation {
                of: Varied::Gains(named("quadruped")),
                values: Values::Uniform { low: 0.8, high: 1.2 },
            },
        ];
        let roots = (0..4).flat_map(|copy| [0.0, f64::from(50 + copy), 0.0, 0.0, 0.0, 0.0, 1.0]);
        request.starts = vec![Start { robot: "box".into(), roots: roots.collect(), ..Start::default() }];
        assert_as_alone(&world, request, 0.5, "between a floor and a wall");
    }
}

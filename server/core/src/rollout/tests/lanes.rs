//! Copies in lanes compared with copies that step alone: equal to the bit, for any number of lanes.

use pulp::Simd;
use simd_model::setup::{JointSetup, Spring};

use super::super::draw::uniform;
use super::super::schedule::Unpaused;
use super::*;
use crate::simulation::Integrator;

/// Returns a branching tree of revolute and prismatic joints, with limits, dry friction, damping, rotors and
/// springs.
pub(super) fn branching(joints: usize) -> RobotModel {
    let draw = |what: u64, joint: usize, low: f64, high: f64| uniform([5, what, joint as u64, 0], low, high);
    let vector = |what: u64, joint: usize, size: f64| {
        DVec3::new(
            draw(what, joint, -size, size),
            draw(what + 1, joint, -size, size),
            draw(what + 2, joint, -size, size),
        )
    };
    let kind = |index: usize| if index % 4 == 3 { JointKind::Prismatic } else { JointKind::Revolute };
    let joint = |index: usize| Joint {
        name: format!("j{index}"),
        kind: kind(index),
        parent: if index % 5 == 4 { index - 2 } else { index },
        child: index + 1,
        parent_from_joint: DPose3::from_parts(
            vector(10, index, 0.3),
            glamx::DQuat::from_scaled_axis(vector(20, index, 2.0)),
        ),
        axis: vector(30, index, 1.0).normalize(),
        limits: JointLimits {
            lower: Some(-0.4),
            upper: (index != 1).then_some(0.5),
            effort: (index != 2).then_some(draw(40, index, 3.0, 30.0)),
            velocity: index.is_multiple_of(2).then_some(2.0),
        },
        damping: draw(41, index, 0.0, 0.5),
        friction: if index.is_multiple_of(3) { draw(42, index, 0.1, 1.0) } else { 0.0 },
        mimic: None,
    };
    let setup = |index: usize| JointSetup {
        joint: index,
        armature: if index.is_multiple_of(2) { 0.01 } else { 0.0 },
        spring: (index % 3 == 1).then_some(Spring { stiffness: 20.0, rest: 0.1 }),
        ..JointSetup::default()
    };
    let mut model = RobotModel {
        name: "tree".into(),
        links: (0..=joints)
            .map(|index| link(&format!("l{index}"), draw(50, index, 0.3, 2.0), vector(60, index, 0.2), None))
            .collect(),
        joints: (0..joints).map(joint).collect(),
        ..RobotModel::default()
    };
    model.setup.joints = (0..joints).map(setup).collect();
    model
}

pub(super) fn world_of(model: RobotModel, integrator: Integrator, substeps: u32) -> Simulation {
    world_with_root(model, true, integrator, substeps)
}

pub(super) fn world_with_root(
    model: RobotModel,
    fixed: bool,
    integrator: Integrator,
    substeps: u32,
) -> Simulation {
    let settings = PhysicsSettings { integrator, substeps, ..PhysicsSettings::default() };
    let mut world = Simulation::new(settings, WorldLimits::default());
    world.apply(&spawn("tree", model, fixed, DVec3::ZERO)).unwrap();
    (0..10).for_each(|_| world.step());
    world
}

fn drawn(what: u64, count: usize, size: f64) -> Vec<f64> {
    (0..count as u64).map(|index| uniform([9, what, index, 0], -size, size)).collect()
}

/// Returns a request in which each copy is driven to and beyond limits, with separate masses and gains.
pub(super) fn asked(
    joints: usize,
    copies: usize,
    mode: ControlMode,
    interpolation: Interpolation,
) -> RolloutRequest {
    let size = if mode == ControlMode::Effort { 30.0 } else { 1.2 };
    let tree = || named("tree");
    RolloutRequest {
        copies,
        steps: 200,
        controls: vec![Control {
            robot: "tree".into(),
            interpolation,
            ..control(mode, drawn(1, copies * 4 * joints, size), 4, 50)
        }],
        starts: vec![Start {
            robot: "tree".into(),
            positions: drawn(2, copies * joints, 0.4),
            velocities: drawn(3, copies * joints, 1.0),
            ..Start::default()
        }],
        variations: vec![Variation {
            of: Varied::LinkMasses(tree()),
            values: Values::Uniform { low: 0.5, high: 2.0 },
        }],
        quantities: vec![
            Quantity::JointPositions(tree()),
            Quantity::JointVelocities(tree()),
            Quantity::JointEfforts(tree()),
            Quantity::LinkPoses(tree()),
        ],
        costs: vec![CostTerm {
            weight: 1.0,
            final_weight: 2.0,
            of: Cost::JointVelocities { joints: tree(), targets: Vec::new() },
        }],
        step_costs: true,
        record_every: 1,
        record_start: true,
        ..RolloutRequest::default()
    }
}

/// Returns copies computed by the one-robot step.
pub(super) fn alone(rollout: &Rollout, copies: Range<usize>) -> BatchResult {
    let mut open = rollout.open(0, copies);
    rollout.advance_alone(&mut rollout.worker(), &mut open, &Unpaused(&|| false)).unwrap();
    open.result
}

fn in_lanes<S: Simd>(simd: S, rollout: &Rollout, copies: Range<usize>) -> BatchResult {
    let mut open = rollout.open(0, copies);
    rollout.advance_in_lanes(simd, &mut rollout.worker(), &mut open, &Unpaused(&|| false)).unwrap();
    open.result
}

/// Returns copies computed with every number of lanes of this processor.
pub(super) fn in_all_widths(rollout: &Rollout, copies: Range<usize>) -> Vec<(usize, BatchResult)> {
    let mut all = vec![(1, in_lanes(pulp::Scalar, rollout, copies.clone()))];
    #[cfg(target_arch = "x86_64")]
    {
        if let Some(simd) = pulp::x86::V3::try_new() {
            all.push((4, in_lanes(simd, rollout, copies.clone())));
        }
        if let Some(simd) = pulp::x86::V4::try_new() {
            all.push((8, in_lanes(simd, rollout, copies)));
        }
    }
    all
}

pub(super) fn assert_equal(found: &BatchResult, expected: &BatchResult, what: &str) {
    let pairs = found.states.iter().zip(&expected.states);
    let first = pairs.enumerate().find(|(_, (a, b))| a != b && !(a.is_nan() && b.is_nan()));
    assert_eq!(first, None, "{what}");
    assert_eq!(bits(&found.costs), bits(&expected.costs), "{what}");
    assert_eq!(bits(&found.step_costs), bits(&expected.step_costs), "{what}");
    assert_eq!(found.steps_done, expected.steps_done, "{what}");
    assert_eq!(found.ended, expected.ended, "{what}");
    assert_eq!(bits(&found.states), bits(&expected.states), "{what}");
}

/// Asserts that at least this part of the steps of copies was done in lanes, so that equality is meaningful.
pub(super) fn assert_in_lanes(found: &BatchResult, part: f64, what: &str) {
    let steps: u64 = found.steps_done.iter().sum();
    let in_lanes = found.lane_steps as f64 / steps as f64;
    assert!(in_lanes >= part && in_lanes < 1.0, "{what}: {in_lanes} of the steps were done in lanes");
}

/// Returns how often a joint of a branching tree is at a position limit, and how often its actuator applies
/// its maximum. Rows begin with positions, velocities and efforts.
fn at_limits(joints: usize, result: &BatchResult, columns: usize) -> [usize; 2] {
    let all = branching(joints).joints;
    let is_at = |limit: Option<f64>, value: f64, within: f64| {
        limit.is_some_and(|limit| (value - limit).abs() < within)
    };
    let (mut stopped, mut saturated) = (0, 0);
    for row in result.states.chunks_exact(columns) {
        for (index, Joint { limits, .. }) in all.iter().enumerate() {
            let (position, effort) = (row[index], row[2 * joints + index]);
            stopped +=
                usize::from(is_at(limits.lower, position, 1e-3) || is_at(limits.upper, position, 1e-3));
            saturated += usize::from(is_at(limits.effort, effort.abs(), 1e-6));
        }
    }
    [stopped, saturated]
}

#[test]
fn lanes_of_any_number_have_the_bits_of_copies_that_step_alone() {
    let mut limited = [0, 0];
    for joints in [1, 7, 11] {
        for (integrator, substeps) in [(Integrator::Leapfrog, 1), (Integrator::Euler, 2)] {
            let world = world_of(branching(joints), integrator, substeps);
            for (mode, interpolation) in [
                (ControlMode::Position, Interpolation::Hold),
                (ControlMode::Velocity, Interpolation::Linear),
                (ControlMode::Effort, Interpolation::Hold),
            ] {
                let request = asked(joints, 5, mode, interpolation);
                let rollout = Rollout::new(world.to_saved(), request, ROOM).unwrap();
                assert!(rollout.has_lanes);
                let expected = alone(&rollout, 0..5);
                assert_eq!(expected.lane_steps, 0);
                let here = at_limits(joints, &expected, rollout.shape().columns());
                limited = [limited[0] + here[0], limited[1] + here[1]];
                for (width, found) in in_all_widths(&rollout, 0..5) {
                    let what = format!("{joints} {integrator:?} {mode:?} {width}");
                    assert_equal(&found, &expected, &what);
                    // Bodies that efforts turn by more than 0.1 rad in a step step alone.
                    assert_in_lanes(&found, if mode == ControlMode::Effort { 0.1 } else { 0.5 }, &what);
                }
            }
        }
    }
    assert!(limited.iter().all(|count| *count > 100), "at limits, and saturated: {limited:?}");
}

/// Returns copies of a robot with a free root, with roots that begin elsewhere and tumble.
pub(super) fn tumbling(joints: usize, mode: ControlMode) -> RolloutRequest {
    let copies = 5;
    let turn = |copy: usize| glamx::DQuat::from_scaled_axis(DVec3::new(0.3, -0.5, 0.2) * copy as f64);
    let roots = (0..copies).flat_map(|copy| {
        let mut root = vec![copy as f64, 0.0, 0.0];
        root.extend(turn(copy).to_array());
        root
    });
    let mut request = asked(joints, copies, mode, Interpolation::Hold);
    request.starts[0].roots = roots.collect();
    request.starts[0].root_twists = drawn(4, 6 * copies, 3.0);
    request.quantities.extend([Quantity::RootPose("tree".into()), Quantity::RootTwist("tree".into())]);
    request
}

#[test]
fn robots_whose_root_is_free_have_the_bits_of_copies_that_step_alone() {
    for joints in [1, 5, 11] {
        for (integrator, substeps) in [(Integrator::Leapfrog, 1), (Integrator::Euler, 2)] {
            let world = world_with_root(branching(joints), false, integrator, substeps);
            for mode in [ControlMode::Position, ControlMode::Velocity, ControlMode::Effort] {
                let rollout = Rollout::new(world.to_saved(), tumbling(joints, mode), ROOM).unwrap();
                assert!(rollout.has_lanes);
                let expected = alone(&rollout, 0..5);
                // If targets disturb the motion with leapfrog, copies step alone.
                let least = if integrator == Integrator::Leapfrog { 0.0 } else { 0.1 };
                for (width, found) in in_all_widths(&rollout, 0..5) {
                    let what = format!("{joints} {integrator:?} {mode:?} {width}");
                    assert_equal(&found, &expected, &what);
                    assert_in_lanes(&found, least, &what);
                }
            }
        }
    }
}

/// The second of three copies diverges: the farther it is, the harder it is driven away.
#[test]
fn a_copy_in_lanes_that_is_not_finite_ends_alone() {
    let world = world_of(branching(3), Integrator::Leapfrog, 1);
    let mut request = asked(3, 3, ControlMode::Velocity, Interpolation::Hold);
    let gains = [0.0, -1e12, 0.0].into_iter().flat_map(|gain| [gain; 18]).collect();
    request.controls = vec![Control {
        robot: "tree".into(),
        feedback: Some(Feedback { gains, ..Feedback::default() }),
        ..control(ControlMode::Velocity, vec![0.0; 3], 1, 1)
    }];
    let mut model = branching(3);
    model.joints.iter_mut().for_each(|joint| joint.limits = JointLimits::default());
    let free = world_of(model, Integrator::Leapfrog, 1);
    let mut ended = Vec::new();
    for world in [world, free] {
        let rollout = Rollout::new(world.to_saved(), request.clone(), ROOM).unwrap();
        let expected = alone(&rollout, 0..3);
        ended.push(expected.ended.iter().map(|ended| ended.copy).collect::<Vec<_>>());
        for (width, found) in in_all_widths(&rollout, 0..3) {
            assert_equal(&found, &expected, &format!("{width} lanes"));
            assert_in_lanes(&found, 0.1, &format!("{width} lanes"));
        }
    }
    assert_eq!(ended[1], [1], "without limits the second copy ends, and no other");
}

/// A copy steps alone while a wrench acts, and is in the lanes before and after.
#[test]
fn copies_with_an_applied_wrench_have_the_bits_of_the_world() {
    let world = world_of(branching(5), Integrator::Leapfrog, 1);
    let wrench = |link: &str, at| Variation {
        of: Varied::Wrench { robot: "tree".into(), link: link.into(), at, steps: 15 },
        values: Values::Uniform { low: -20.0, high: 20.0 },
    };
    let mut request = asked(5, 5, ControlMode::Position, Interpolation::Hold);
    request.variations.extend([wrench("l5", 0), wrench("l3", 60), wrench("l4", 70), wrench("l5", 199)]);
    let rollout = Rollout::new(world.to_saved(), request, ROOM).unwrap();
    let expected = alone(&rollout, 0..5);
    assert!(rollout.has_lanes);
    for (width, found) in in_all_widths(&rollout, 0..5) {
        assert_equal(&found, &expected, &format!("{width} lanes"));
        assert_in_lanes(&found, 0.3, &format!("{width} lanes"));
    }
}

/// Asserts that some of eight copies are equal with and without the others.
pub(super) fn assert_neighbours_do_not_matter(rollout: &Rollout) {
    let length = rollout.shape().rows * rollout.shape().columns();
    for (width, all) in in_all_widths(rollout, 0..8) {
        for (first, last) in [(0, 1), (5, 6), (2, 7)] {
            for (_, some) in
                in_all_widths(rollout, first..last).into_iter().filter(|(other, _)| *other == width)
            {
                assert_eq!(bits(&some.states), bits(&all.states[first * length..last * length]), "{width}");
            }
        }
    }
}

#[test]
fn the_copies_beside_one_in_lanes_do_not_matter() {
    let world = world_of(branching(5), Integrator::Leapfrog, 1);
    let request = asked(5, 8, ControlMode::Position, Interpolation::Cubic);
    let rollout = Rollout::new(world.to_saved(), request, ROOM).unwrap();
    assert_neighbours_do_not_matter(&rollout);
}

/// Two controls of a joint, of one mode and of two, and feedback: targets change while copies are in lanes.
#[test]
fn joints_with_two_controls_or_feedback_have_the_bits_of_the_world() {
    let world = world_of(branching(5), Integrator::Leapfrog, 1);
    let with_two = [ControlMode::Position, ControlMode::Effort].map(|mode| {
        let mut request = asked(5, 5, ControlMode::Position, Interpolation::Hold);
        request.controls.push(Control {
            robot: "tree".into(),
            joints: vec!["j1".into(), "j3".into()],
            stiffness: if mode == ControlMode::Position { vec![50.0, 80.0] } else { Vec::new() },
            ..control(mode, drawn(6, 5 * 7 * 2, 2.0), 7, 21)
        });
        request
    });
    let with_feedback = [ControlMode::Velocity, ControlMode::Effort].map(|mode| {
        let mut request = asked(5, 5, mode, Interpolation::Linear);
        let gains = drawn(7, 5 * 10, 2.0);
        request.controls[0].feedback = Some(Feedback { gains, ..Feedback::default() });
        request
    });
    for request in with_two.into_iter().chain(with_feedback) {
        let rollout = Rollout::new(world.to_saved(), request, ROOM).unwrap();
        assert!(rollout.has_lanes);
        let expected = alone(&rollout, 0..5);
        for (width, found) in in_all_widths(&rollout, 0..5) {
            assert_equal(&found, &expected, &format!("{width} lanes"));
            assert_in_lanes(&found, 0.1, &format!("{width} lanes"));
        }
    }
}

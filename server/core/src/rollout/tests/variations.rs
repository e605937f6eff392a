//! Variations of copies have the effect of the same change of the world.

use super::*;
use crate::simulation::command::{JointProperties, JointReset, LinkWrench, RobotReset, WrenchDuration};

const STEPS: u64 = 40;

/// Returns the states of the last of `copies`, in rows.
fn last_copy(request: RolloutRequest) -> Vec<Vec<f64>> {
    let (copies, steps) = (request.copies, request.steps as usize);
    let states = states(&roll(&world(), request));
    let length = states.len() / copies;
    states[states.len() - length..].chunks_exact(length / steps).map(<[f64]>::to_vec).collect()
}

fn given(of: Varied, values: &[f64]) -> Vec<Variation> {
    vec![Variation { of, values: Values::Given(values.to_vec()) }]
}

/// Compares with a world that is changed by `change`: at the start, and before a step.
fn check(request: RolloutRequest, mut world: Simulation, change: impl Fn(&mut Simulation, u64)) {
    for (step, row) in last_copy(request).iter().enumerate() {
        change(&mut world, step as u64);
        world.step();
        assert_eq!(bits(row), bits(&seen(&world)), "step {step}");
    }
}

#[test]
fn a_start_is_a_reset_of_joints_and_a_variation_adds_to_it() {
    let start = Start {
        robot: "arm".into(),
        joints: vec!["elbow".into()],
        positions: vec![0.1, 0.4],
        velocities: vec![-1.0, 2.0],
        ..Start::default()
    };
    let added = Varied::JointPositions(Named { robot: "arm".into(), names: vec!["elbow".into()] });
    let request =
        RolloutRequest { starts: vec![start], variations: given(added, &[0.0, 0.25]), ..all_of_it(2, STEPS) };
    let reset = |position| {
        let joint = JointReset { joint: "elbow".into(), position, velocity: 2.0, ..JointReset::default() };
        Command::ResetJoints { robots: vec![RobotReset { robot: "arm".into(), joints: vec![joint] }] }
    };
    check(request, world(), |world, step| {
        if step == 0 {
            world.apply(&reset(0.4)).unwrap();
            world.apply(&reset(0.65)).unwrap();
        }
    });
}

#[test]
fn a_root_starts_where_it_is_put() {
    let roots = [[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], [-1.0, 0.5, 0.3, 0.6, 0.0, 0.8, 0.0]].concat();
    let root_twists = vec![1.0, 0.0, -2.0, 0.0, 3.0, 0.0];
    let start = Start { robot: "ball".into(), roots, root_twists, ..Start::default() };
    let request = RolloutRequest { starts: vec![start], ..all_of_it(2, STEPS) };
    let rotation = glamx::DQuat::from_xyzw(0.6, 0.0, 0.8, 0.0).normalize();
    check(request, world(), |world, step| {
        if step == 0 {
            let pose = Some(DPose3::from_parts(DVec3::new(-1.0, 0.5, 0.3), rotation));
            let twist = Some((DVec3::new(1.0, 0.0, -2.0), DVec3::Y * 3.0));
            world.apply(&Command::SetEntityState { robot: "ball".into(), pose, twist }).unwrap();
        }
    });
}

#[test]
fn factors_of_joints_are_changes_of_their_settings() {
    let change = |properties: fn(JointProperties) -> JointProperties| {
        let joint = JointProperties { joint: "shoulder".into(), ..JointProperties::default() };
        Command::SetJointProperties { robot: "arm".into(), joints: vec![properties(joint)] }
    };
    let shoulder = || Named { robot: "arm".into(), names: vec!["shoulder".into()] };
    let driven = |variations| RolloutRequest {
        controls: vec![control(ControlMode::Effort, vec![-3.0, 1.0], 1, 1)],
        variations,
        ..all_of_it(2, STEPS)
    };
    let drive = |world: &mut Simulation| {
        let joint = |(name, effort): (&str, f64)| crate::simulation::command::JointTarget {
            joint: name.into(),
            axis: 0,
            target: crate::simulation::command::Target::Effort(effort),
        };
        let joints = [("shoulder", -3.0), ("elbow", 1.0)].into_iter().map(joint).collect();
        let robot =
            crate::simulation::command::RobotTargets { robot: "arm".into(), joints, ..Default::default() };
        let command = crate::simulation::command::SetTargets { robots: vec![robot], ..Default::default() };
        world.apply(&Command::SetTargets(command)).unwrap();
    };
    type Case = (Varied, fn(JointProperties) -> JointProperties);
    let cases: [Case; 2] = [
        (Varied::JointFriction(shoulder()), |of| JointProperties { friction: Some(0.2 * 4.0), ..of }),
        (Varied::JointDamping(shoulder()), |of| JointProperties { damping: Some(0.1 * 4.0), ..of }),
    ];
    for (of, properties) in cases {
        check(driven(given(of, &[1.0, 4.0])), world(), |world, step| {
            if step == 0 {
                world.apply(&change(properties)).unwrap();
                drive(world);
            }
        });
    }
}

/// A robot with these masses would not be in the previous state. The comparison is with a world that has the
/// masses from the start of the copies, from a description with other masses.
#[test]
fn factors_of_masses_are_those_of_a_description_with_them() {
    let request = RolloutRequest {
        controls: vec![control(ControlMode::Effort, vec![0.0; 2], 1, 1)],
        variations: given(Varied::LinkMasses(named("arm")), &[1.0, 3.0, 0.5]),
        // The history of the last step belongs to other masses: restart.
        starts: vec![Start { robot: "arm".into(), positions: vec![0.2, 0.1], ..Start::default() }],
        ..all_of_it(1, STEPS)
    };
    let rows = last_copy(request);
    let mut heavy = world_with([3.0, 0.25]);
    let joint =
        |(name, position): (&str, f64)| JointReset { joint: name.into(), position, ..JointReset::default() };
    let joints = [("shoulder", 0.2), ("elbow", 0.1)].into_iter().map(joint).collect();
    let robots = vec![RobotReset { robot: "arm".into(), joints }];
    heavy.apply(&Command::ResetJoints { robots }).unwrap();
    let effort = |name: &str| crate::simulation::command::JointTarget {
        joint: name.into(),
        axis: 0,
        target: crate::simulation::command::Target::Effort(0.0),
    };
    let joints = ["shoulder", "elbow"].map(effort).to_vec();
    let robot =
        crate::simulation::command::RobotTargets { robot: "arm".into(), joints, ..Default::default() };
    let command = crate::simulation::command::SetTargets { robots: vec![robot], ..Default::default() };
    heavy.apply(&Command::SetTargets(command)).unwrap();
    for (step, row) in rows.iter().enumerate() {
        heavy.step();
        // The initial impulses of friction belong to other masses in the first step: rounding.
        for (found, expected) in row[..4].iter().zip(&seen(&heavy)[..4]) {
            assert!((found - expected).abs() < 1e-9, "step {step}: {found}, {expected}");
        }
    }
    let nominal = last_copy(RolloutRequest {
        controls: vec![control(ControlMode::Effort, vec![0.0; 2], 1, 1)],
        ..all_of_it(1, STEPS)
    });
    assert_ne!(bits(&nominal[39]), bits(&rows[39]));
}

#[test]
fn a_wrench_acts_for_so_many_steps() {
    let wrench = Varied::Wrench { robot: "ball".into(), link: "ball".into(), at: 5, steps: 8 };
    let variations = given(wrench, &[0.0, 0.0, 0.0, 20.0, -5.0, 30.0]);
    let request = RolloutRequest { variations, ..all_of_it(2, STEPS) };
    check(request, world(), |world, step| {
        if step == 5 {
            let wrench = LinkWrench {
                robot: "ball".into(),
                link: "ball".into(),
                force: DVec3::new(20.0, -5.0, 30.0),
                torque: DVec3::ZERO,
                in_link_axes: false,
                point: DVec3::ZERO,
                duration: WrenchDuration::For(8.0 * world.settings().time_step),
            };
            world.apply(&Command::ApplyWrench(wrench)).unwrap();
        }
    });
}

#[test]
fn gains_and_friction_of_surfaces_make_copies_that_differ() {
    let varied = |variations| RolloutRequest {
        controls: vec![control(ControlMode::Position, vec![0.8, 0.3], 1, 1)],
        starts: vec![Start {
            robot: "ball".into(),
            root_twists: vec![2.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            ..Start::default()
        }],
        variations,
        ..all_of_it(2, STEPS)
    };
    let nominal = last_copy(varied(Vec::new()));
    let soft = last_copy(varied(given(Varied::Gains(named("arm")), &[1.0, 1.0, 0.01, 0.01])));
    assert!(soft[39][0] < nominal[39][0] - 1e-3, "a soft arm is behind");
    let slippery = last_copy(varied(given(Varied::SurfaceFriction(named("ball")), &[1.0, 0.0])));
    // For a ball that slides without friction the spin about y stays zero.
    let spin = |rows: &[Vec<f64>]| rows[39][6 + 7 + 4];
    assert!(spin(&slippery).abs() < 1e-9 && spin(&nominal).abs() > 0.1, "{}", spin(&nominal));
}

#[test]
fn drawn_numbers_depend_on_the_seed_and_the_copy() {
    let drawn = |seed| RolloutRequest {
        variations: vec![Variation {
            of: Varied::JointPositions(named("arm")),
            values: Values::Normal { mean: 0.0, deviation: 0.1 },
        }],
        seed,
        ..all_of_it(3, 1)
    };
    let once = states(&roll(&world(), drawn(1)));
    assert_eq!(bits(&once), bits(&states(&roll(&world(), drawn(1)))));
    assert_ne!(bits(&once), bits(&states(&roll(&world(), drawn(2)))));
    let length = once.len() / 3;
    assert_ne!(bits(&once[..length]), bits(&once[length..2 * length]));
}

//! A copy equals the world, to the bit, and depends only on its own numbers.

use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

use glamx::DQuat;

use super::*;
use crate::simulation::command::{JointTarget, RobotTargets, SetTargets, Target};

const STEPS: u64 = 60;

fn targets(mode: ControlMode, values: &[f64]) -> Command {
    let target = |value: f64| match mode {
        ControlMode::Position => Target::position(value),
        ControlMode::Velocity => Target::velocity(value),
        ControlMode::Effort => Target::Effort(value),
    };
    let joint =
        |(name, value): (&str, &f64)| JointTarget { joint: name.into(), axis: 0, target: target(*value) };
    let joints = ["shoulder", "elbow"].into_iter().zip(values).map(joint).collect();
    let robots = vec![RobotTargets { robot: "arm".into(), joints, ..RobotTargets::default() }];
    Command::SetTargets(SetTargets { robots, ..SetTargets::default() })
}

/// Knots that take the hand to the floor and beyond a limit.
const KNOTS: [f64; 6] = [0.2, -0.3, 1.4, 0.5, 3.0, -1.0];

#[test]
fn a_copy_is_to_the_bit_what_the_world_is_with_the_same_commands() {
    for mode in [ControlMode::Position, ControlMode::Velocity, ControlMode::Effort] {
        for (interpolation, of_step) in [
            (Interpolation::Hold, (|step| step / 20) as fn(u64) -> u64),
            (Interpolation::Linear, (|step| step) as fn(u64) -> u64),
        ] {
            let mut world = world();
            let control = Control { interpolation, ..control(mode, KNOTS.to_vec(), 3, 20) };
            let request = RolloutRequest { controls: vec![control], ..all_of_it(3, STEPS) };
            let copies = states(&roll(&world, request));
            let mut touched = false;
            let mut rows = copies.chunks_exact(copies.len() / (3 * STEPS as usize));
            let first: Vec<&[f64]> = rows.by_ref().take(STEPS as usize).collect();
            for (step, row) in (0..STEPS).zip(&first) {
                let values = [0, 1].map(|joint| match interpolation {
                    Interpolation::Hold => KNOTS[2 * (step as usize / 20).min(2) + joint],
                    _ => {
                        let knot = (step as usize / 20).min(2);
                        let next = (knot + 1).min(2);
                        let [one, next] = [knot, next].map(|knot| KNOTS[2 * knot + joint]);
                        if knot == 2 { one } else { one + (next - one) * ((step % 20) as f64 / 20.0) }
                    }
                });
                if step == 0 || of_step(step) != of_step(step - 1) {
                    world.apply(&targets(mode, &values)).unwrap();
                }
                world.step();
                assert_eq!(bits(row), bits(&seen(&world)), "{mode:?} {interpolation:?} step {step}");
                touched |= row[row.len() - 1] > 0.0;
            }
            assert!(touched, "the ball lies on the floor");
            // The others do the same.
            let second: Vec<f64> = rows.take(STEPS as usize).flatten().copied().collect();
            assert_eq!(bits(&first.concat()), bits(&second));
        }
    }
}

/// Also for a quaternion of length 1 except for its last digits.
#[test]
fn a_copy_starts_where_the_world_is_put_by_the_same_numbers() {
    for [x, y, z, w] in
        [[0.1, 0.2, 0.3, 0.927_361_849_55], [0.5, -0.5, 0.5, 0.5], [0.6, 0.0, 0.0, -0.800_000_1]]
    {
        let mut world = world();
        let roots = vec![0.1, -0.2, 1.3, x, y, z, w];
        let request = RolloutRequest {
            starts: vec![Start { robot: "ball".into(), roots, ..Start::default() }],
            ..all_of_it(1, 30)
        };
        let found = states(&roll(&world, request));
        let pose = Some(DPose3::from_parts(DVec3::new(0.1, -0.2, 1.3), DQuat::from_xyzw(x, y, z, w)));
        world.apply(&Command::SetEntityState { robot: "ball".into(), pose, twist: None }).unwrap();
        for (step, row) in found.chunks_exact(found.len() / 30).enumerate() {
            world.step();
            assert_eq!(bits(row), bits(&seen(&world)), "step {step}");
        }
    }
}

/// Returns a request in which each copy has separate values, starts and draws.
fn many(copies: usize) -> RolloutRequest {
    let value = |i: usize| 0.3 + 0.01 * (i as f64) - 0.002 * ((i * i) % 17) as f64;
    let values = (0..copies * 4).map(value).collect();
    let positions = (0..copies * 2).map(|i| 0.5 * (i as f64).sin()).collect();
    RolloutRequest {
        controls: vec![control(ControlMode::Position, values, 2, 15)],
        starts: vec![Start { robot: "arm".into(), positions, ..Start::default() }],
        variations: vec![Variation {
            of: Varied::LinkMasses(named("arm")),
            values: Values::Uniform { low: 0.5, high: 2.0 },
        }],
        seed: 3,
        ..all_of_it(copies, 30)
    }
}

#[test]
fn threads_and_order_of_copies_change_nothing() {
    let world = world();
    let whole = roll(&world, many(20));
    let rollout = Rollout::new(world.to_saved(), many(20), ROOM).unwrap();
    assert_eq!(rollout.batches(), 3);
    let found = std::thread::scope(|scope| {
        let on_its_own = |batches: Vec<usize>| {
            let rollout = &rollout;
            scope.spawn(move || {
                let mut worker = rollout.worker();
                let advance = |batch| (batch, rollout.advance(&mut worker, batch, &|| false).unwrap());
                batches.into_iter().map(advance).collect::<Vec<_>>()
            })
        };
        let threads = [on_its_own(vec![2, 0]), on_its_own(vec![1])];
        threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect::<Vec<_>>()
    });
    for (batch, result) in found {
        assert_eq!(bits(&result.states), bits(&whole[batch].states));
    }
}

#[test]
fn the_copies_beside_one_do_not_matter() {
    let world = world();
    let all = states(&roll(&world, many(12)));
    let length = all.len() / 12;
    // A single copy draws as copy 0: the mass of copy 0 is the same in both.
    let alone = states(&roll(&world, many(1)));
    assert_eq!(bits(&alone), bits(&all[..length]));
    assert_ne!(bits(&all[..length]), bits(&all[length..2 * length]));
}

#[test]
fn the_world_itself_is_left_as_it_is() {
    let world = world();
    let before = world.fingerprint();
    roll(&world, many(3));
    assert_eq!(world.fingerprint(), before);
}

#[test]
fn a_copy_that_is_not_finite_ends_alone_and_says_so() {
    // The second copy spins faster than can be computed with.
    let free = |speed: f64| RolloutRequest {
        controls: vec![control(ControlMode::Velocity, vec![0.0; 2], 1, 1)],
        starts: vec![Start {
            robot: "arm".into(),
            positions: [0.1, 0.2].repeat(3),
            velocities: vec![0.0, 0.0, speed, speed, 0.0, 0.0],
            ..Start::default()
        }],
        costs: vec![CostTerm {
            weight: 1.0,
            final_weight: 0.0,
            of: Cost::JointVelocities { joints: named("arm"), targets: Vec::new() },
        }],
        step_costs: true,
        ..all_of_it(3, 100)
    };
    let batches = roll(&world(), free(1e12));
    let BatchResult { states, costs, step_costs, steps_done, ended, .. } = &batches[0];
    let Some([Ended { copy: 1, reason }]) = ended.first_chunk::<1>().filter(|_| ended.len() == 1) else {
        panic!("{ended:?}");
    };
    assert!(reason.contains("finite"), "{reason}");
    let done = steps_done[1] as usize;
    assert!(done < 100 && [steps_done[0], steps_done[2]] == [100, 100], "{steps_done:?}");
    let length = states.len() / 3;
    let row = length / 100;
    assert!(states[length + done * row..2 * length].iter().all(|number| number.is_nan()));
    assert!(states[..length].iter().chain(&states[2 * length..]).all(|number| number.is_finite()));
    assert!(costs[1] == f64::INFINITY && costs[0].is_finite() && costs[2].is_finite());
    assert!(step_costs[100 + done..200].iter().all(|cost| *cost == f64::INFINITY));
    // The others are equal without it.
    let without = roll(&world(), free(0.0));
    assert_eq!(bits(&states[..length]), bits(&without[0].states[..length]));
    assert_eq!(bits(&states[2 * length..]), bits(&without[0].states[2 * length..]));
}

#[test]
fn an_interrupted_rollout_returns_nothing() {
    let rollout = Rollout::new(world().to_saved(), all_of_it(4, 50), ROOM).unwrap();
    let asked = AtomicUsize::new(0);
    let interrupt = || asked.fetch_add(1, Relaxed) >= 70;
    assert!(rollout.advance(&mut rollout.worker(), 0, &interrupt).is_none());
    assert_eq!(asked.into_inner(), 71, "it is asked before each step");
}

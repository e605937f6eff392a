//! Copies that pause and continue, and computations that are interrupted.

use std::sync::atomic::Ordering::Relaxed;
use std::sync::atomic::{AtomicBool, AtomicU64};

use pulp::Simd;

use super::feet::{drive, standing};
use super::lanes::{alone, asked, assert_equal, branching, tumbling, world_of, world_with_root};
use super::*;
use crate::simulation::Integrator;

/// Pauses copies each time after `every` steps. Each step can be interrupted, and is not.
struct Paused {
    every: u64,
    asked: AtomicU64,
}

impl Paused {
    fn every(steps: u64) -> Self {
        Self { every: steps, asked: AtomicU64::new(0) }
    }
}

impl Schedule for Paused {
    fn before_step(&self) -> Result<(), Halt> {
        let asked = self.asked.fetch_add(1, Relaxed);
        if asked % (self.every + 1) == self.every { Err(Halt::Paused) } else { Ok(()) }
    }

    fn is_over(&self) -> bool {
        false
    }

    fn has_long_steps(&self) -> bool {
        true
    }
}

/// Returns the result of the first batch, and the number of its pauses.
fn with_pauses(rollout: &Rollout, every: u64) -> (BatchResult, usize) {
    let (mut worker, schedule, mut pauses) = (rollout.worker(), Paused::every(every), 0);
    rollout.begin_batch(&mut worker, 0);
    loop {
        match rollout.go_on(&mut worker, &schedule) {
            Ok(done) => return (done.unwrap().1, pauses),
            Err(halt) => assert_eq!(halt, Halt::Paused),
        }
        pauses += 1;
    }
}

fn in_lanes_with_pauses<S: Simd>(simd: S, rollout: &Rollout, every: u64) -> (BatchResult, usize) {
    let (mut worker, schedule, mut pauses) = (rollout.worker(), Paused::every(every), 0);
    let mut open = rollout.open(0, rollout.copies_of(0));
    while let Err(halt) = rollout.advance_in_lanes(simd, &mut worker, &mut open, &schedule) {
        assert_eq!(halt, Halt::Paused);
        pauses += 1;
    }
    (open.result, pauses)
}

/// Checks that pauses at many steps change no bit, whether copies step alone or in lanes.
fn check(rollout: Rollout) {
    let copies = rollout.copies_of(0);
    let expected = alone(&rollout, copies.clone());
    for every in [1, 7, 50] {
        let mut all = vec![("as it is", with_pauses(&rollout, every))];
        if rollout.steps_in_lanes() {
            all.push(("one lane", in_lanes_with_pauses(pulp::Scalar, &rollout, every)));
            #[cfg(target_arch = "x86_64")]
            {
                if let Some(simd) = pulp::x86::V3::try_new() {
                    all.push(("four lanes", in_lanes_with_pauses(simd, &rollout, every)));
                }
                if let Some(simd) = pulp::x86::V4::try_new() {
                    all.push(("eight lanes", in_lanes_with_pauses(simd, &rollout, every)));
                }
            }
        }
        for (way, (found, pauses)) in all {
            assert_equal(&found, &expected, &format!("{way}, a pause every {every} steps"));
            assert!(pauses > 0, "{way}, a pause every {every} steps");
        }
    }
}

#[test]
fn copies_that_pause_have_the_bits_of_copies_that_do_not() {
    let request = RolloutRequest {
        controls: vec![control(ControlMode::Position, vec![0.2, -0.3, 1.4, 0.5], 2, 20)],
        variations: vec![Variation {
            of: Varied::LinkMasses(named("arm")),
            values: Values::Uniform { low: 0.5, high: 2.0 },
        }],
        costs: vec![CostTerm { weight: 1.0, final_weight: 2.0, of: Cost::JointEfforts(named("arm")) }],
        step_costs: true,
        record_start: true,
        ..all_of_it(3, 60)
    };
    let rollout = Rollout::new(world().to_saved(), request, ROOM).unwrap();
    assert!(!rollout.steps_in_lanes(), "two robots move");
    check(rollout);
}

#[test]
fn copies_in_lanes_that_pause_have_the_bits_of_copies_that_do_not() {
    for mode in [ControlMode::Position, ControlMode::Effort] {
        let world = world_of(branching(5), Integrator::Leapfrog, 1);
        let mut request = asked(5, 6, mode, Interpolation::Linear);
        request.variations.push(Variation {
            of: Varied::Wrench { robot: "tree".into(), link: "l3".into(), at: 60, steps: 15 },
            values: Values::Uniform { low: -20.0, high: 20.0 },
        });
        check(Rollout::new(world.to_saved(), request, ROOM).unwrap());
        let free = world_with_root(branching(5), false, Integrator::Euler, 2);
        check(Rollout::new(free.to_saved(), tumbling(5, mode), ROOM).unwrap());
    }
}

/// Returns the arm above a plane, which the hands of some copies reach.
fn reaching() -> (Simulation, RolloutRequest) {
    let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    world.apply(&spawn("arm", arm([1.0, 0.5]), true, DVec3::ZERO)).unwrap();
    let plane = one_link("ground", Geometry::Plane { normal: DVec3::Z });
    world.apply(&spawn("ground", plane, true, DVec3::ZERO)).unwrap();
    (0..5).for_each(|_| world.step());
    let values = (0..6).flat_map(|copy| [1.4 - 0.3 * copy as f64, 0.4 - 0.1 * copy as f64]).collect();
    let request = RolloutRequest {
        copies: 6,
        steps: 400,
        controls: vec![control(ControlMode::Position, values, 1, 1)],
        quantities: vec![
            Quantity::JointPositions(named("arm")),
            Quantity::JointVelocities(named("arm")),
            Quantity::ContactCount("arm".into()),
        ],
        record_every: 3,
        ..RolloutRequest::default()
    };
    (world, request)
}

#[test]
fn copies_that_touch_something_and_pause_have_the_bits_of_copies_that_do_not() {
    let (world, request) = reaching();
    let rollout = Rollout::new(world.to_saved(), request, ROOM).unwrap();
    assert!(rollout.steps_in_lanes());
    let touches = alone(&rollout, 0..6).states.chunks_exact(5).filter(|row| row[4] > 0.0).count();
    assert!(touches > 10, "{touches}");
    check(rollout);
}

/// Interrupts once, at the call of this number, and never again.
fn interrupted_once(rollout: &Rollout, at: u64) -> (Option<BatchResult>, bool) {
    let (asked, said) = (AtomicU64::new(0), AtomicBool::new(false));
    let interrupt = || {
        let is_over = asked.fetch_add(1, Relaxed) == at;
        said.fetch_or(is_over, Relaxed);
        is_over
    };
    let result = rollout.advance(&mut rollout.worker(), 0, &interrupt);
    (result, said.into_inner())
}

/// A cancelled search for distances finds nothing near: this must not become a cost, not even in the last
/// step of the last copy.
#[test]
fn whatever_is_computed_while_it_is_interrupted_no_cost_comes_of_it() {
    let nearness = |link: &str| Cost::Nearness {
        robot: "arm".into(),
        link: link.into(),
        other_robot: String::new(),
        other_link: String::new(),
        distance: 2.0,
    };
    let term = |of| CostTerm { weight: 1.0, final_weight: 0.0, of };
    let (in_lanes, of_lanes) = reaching();
    for (world, request, has_lanes) in [(world(), all_of_it(2, 4), false), (in_lanes, of_lanes, true)] {
        let costs = vec![term(nearness("")), term(nearness("hand"))];
        let request = RolloutRequest { copies: 2, steps: 4, costs, step_costs: true, ..request };
        let request = RolloutRequest { controls: Vec::new(), ..request };
        let rollout = Rollout::new(world.to_saved(), request, ROOM).unwrap();
        assert_eq!(rollout.steps_in_lanes(), has_lanes);
        let whole = rollout.advance(&mut rollout.worker(), 0, &|| false).unwrap();
        assert!(whole.costs.iter().all(|cost| *cost > 0.0));
        let mut at = 0;
        loop {
            let (result, was_interrupted) = interrupted_once(&rollout, at);
            if !was_interrupted {
                assert_equal(&result.unwrap(), &whole, "all questions were answered");
                break;
            }
            assert!(result.is_none(), "interrupted at question {at}");
            at += 1;
        }
        assert!(at > 2 * 2 * 4, "it is asked within the search too: {at} questions");
    }
}

#[test]
fn a_step_that_takes_long_is_interrupted_halfway() {
    /// Over once the first step has begun.
    struct Over(AtomicU64);
    impl Schedule for Over {
        fn before_step(&self) -> Result<(), Halt> {
            Ok(())
        }

        fn is_over(&self) -> bool {
            self.0.fetch_add(1, Relaxed) > 0
        }

        fn has_long_steps(&self) -> bool {
            true
        }
    }
    let rollout = Rollout::new(world().to_saved(), all_of_it(1, 5), ROOM).unwrap();
    let (mut worker, schedule) = (rollout.worker(), Over(AtomicU64::new(0)));
    rollout.begin_batch(&mut worker, 0);
    assert_eq!(rollout.go_on(&mut worker, &schedule), Err(Halt::Over));
    assert!(schedule.0.load(Relaxed) > 1, "it was asked once the step had begun");
    assert_eq!(rollout.go_on(&mut worker, &Paused::every(9)), Ok(None), "the batch is dropped");
}

/// A standing quadruped: all data that contacts keep from the previous step enter and leave the lanes.
#[test]
fn copies_that_stand_and_pause_have_the_bits_of_copies_that_do_not() {
    let world = standing(300, true);
    let rollout = Rollout::new(world.to_saved(), drive(5, 120, 40, [0.1, 0.2, 0.2]), ROOM).unwrap();
    assert!(rollout.steps_in_lanes());
    check(rollout);
}

#[test]
fn a_copy_that_comes_out_of_its_lane_has_the_contacts_of_the_world() {
    let world = standing(300, false);
    let rollout = Rollout::new(world.to_saved(), drive(3, 60, 20, [0.02; 3]), ROOM).unwrap();
    for steps in [2, 3, 17, 40] {
        let mut worker = rollout.worker();
        rollout.begin_batch(&mut worker, 0);
        assert_eq!(rollout.go_on(&mut worker, &Paused::every(steps)), Err(Halt::Paused));
        for copy in 0..3 {
            let (mut other, mut open) = (rollout.worker(), rollout.open(0, copy..copy + 1));
            let halt = rollout.advance_alone(&mut other, &mut open, &Paused::every(steps));
            assert_eq!((halt, open.step), (Err(Halt::Paused), steps));
            let [found, expected] = [&worker.beside[copy], &other].map(|of| {
                assert_eq!(of.world.now().step, 300 + steps);
                format!("{:?}", of.world.lane_contacts())
            });
            assert_eq!(found, expected, "copy {copy} after {steps} steps");
            assert!(expected.len() > 1000, "it stands");
        }
    }
}

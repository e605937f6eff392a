//! Groups that are solved on threads.

use super::*;
use crate::pool::Pool;

/// A thread for each second half.
#[derive(Debug)]
struct ThreadEach;

impl Pool for ThreadEach {
    fn join(&self, first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send)) {
        std::thread::scope(|scope| {
            scope.spawn(second);
            first();
        });
    }

    fn keep_awake(&self, work: &mut (dyn FnMut() + Send)) {
        work();
    }

    fn thread(&self) -> usize {
        0
    }
}

/// Returns fifty pairs of bodies that swing from the world; successive pairs have different types of
/// constraints.
fn pairs() -> Simulation {
    let mut world = world_of(Integrator::default(), GRAVITY);
    let model = body(1.0, DVec3::new(0.2, 0.1, 0.05));
    for pair in 0..50 {
        let at = DVec3::new(f64::from(pair), 0.0, 0.0);
        let names = ["first", "second"].map(|name| format!("{name}-{pair}"));
        add_body(&mut world, &names[0], Arc::clone(&model), at);
        add_body(&mut world, &names[1], Arc::clone(&model), at + DVec3::X * 0.3);
        let hung = end(&names[0], "body", DVec3::X * -0.2);
        create(
            &mut world,
            constraint(RequestedConstraint::PointToPoint, end("", "", at - DVec3::X * 0.2), hung),
        );
        let kind = match pair % 6 {
            0 => RequestedConstraint::Weld,
            1 => RequestedConstraint::PointToPoint,
            2 => RequestedConstraint::Hinge { axis: DVec3::Y },
            3 => RequestedConstraint::Slide { axis: DVec3::Z },
            4 => RequestedConstraint::Distance { length: None, is_rope: false },
            _ => RequestedConstraint::Distance { length: None, is_rope: true },
        };
        create(&mut world, constraint(kind, end(&names[0], "body", DVec3::X * 0.15), as_it_is(&names[1])));
    }
    world
}

/// The pose of an end after a step takes a walk along its robot. For a long robot with many constraints such
/// walks are most of a step. The interrupt is called once for each constraint that is measured. It is called
/// once more for each of the two predictions of its errors after the step.
#[test]
fn a_step_can_be_given_up_at_each_look_at_a_constraint() {
    let mut world = world_of(Integrator::Leapfrog, GRAVITY);
    add_body(&mut world, "box", body(1.0, DVec3::splat(0.2)), DVec3::Z);
    let count = 100;
    for _ in 0..count {
        let point = RequestedConstraint::PointToPoint;
        create(&mut world, constraint(point, end("", "", DVec3::Z), as_it_is("box")));
    }
    run(&mut world, 0.1);
    let asked = std::sync::atomic::AtomicU64::new(0);
    let interrupt = || {
        asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        false
    };
    assert!(world.step_interruptible(&interrupt));
    let asked = asked.into_inner();
    assert!(asked >= 2 * count, "{asked}");
}

#[test]
fn constraints_are_equal_to_the_bit_on_threads() {
    let (mut alone, mut shared) = (pairs(), pairs());
    shared.set_pool(Some(Arc::new(ThreadEach)));
    for step in 0..40 {
        alone.step();
        shared.step();
        assert_eq!(alone.fingerprint(), shared.fingerprint(), "step {step}");
    }
    // Interrupted and restored.
    let asked = std::sync::atomic::AtomicU64::new(0);
    let interrupt = || asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed) >= 100;
    assert!(!shared.step_interruptible(&interrupt));
    assert_eq!(alone.fingerprint(), shared.fingerprint());
    shared.set_pool(None);
    alone.step();
    shared.step();
    assert_eq!(alone.fingerprint(), shared.fingerprint());
}

//! Wrenches on links: their durations and effects.

use super::*;

/// A step of 1 ms over the arm's inertia about its joint, kg m^2: its centre's and Steiner's part.
const GAIN: f64 = 1e-3 / (0.0032199 + 0.19992 * 0.16597 * 0.16597);

#[test]
fn a_wrench_acts_for_one_step_or_until_it_is_cleared() {
    let mut world = weightless_arm();
    world.apply(&push(0.5, WrenchDuration::NextStep)).unwrap();
    let seen = run(&mut world, 0.01);
    assert!((seen.velocities[0] - 0.5 * GAIN).abs() < 1e-12);
    world.apply(&push(0.5, WrenchDuration::UntilCleared)).unwrap();
    let seen = run(&mut world, 0.01);
    assert!((seen.velocities[0] - 11.0 * 0.5 * GAIN).abs() < 1e-9);
    world.apply(&push(0.0, WrenchDuration::UntilCleared)).unwrap();
    let before = seen.velocities[0];
    assert!((run(&mut world, 0.01).velocities[0] - before).abs() < 1e-12);
}

#[test]
fn the_force_of_a_wrench_or_a_pull_ends_with_it_when_another_client_claims_the_robot() {
    let lasting = push(0.5, WrenchDuration::UntilCleared);
    let pull = LinkPull {
        robot: "arm".into(),
        link: "arm".into(),
        point: DVec3::X * 0.1,
        target: Some(DVec3::Z),
        stiffness: Some(20.0),
        max_force: Some(100.0),
        duration: Some(10.0),
    };
    for force in [lasting, push(0.5, WrenchDuration::For(9.0)), Command::PullLink(pull)] {
        let mut world = weightless_arm();
        world.apply(&force).unwrap();
        assert!(run(&mut world, 0.01).velocities[0] != 0.0, "{force:?}");
        let joints = vec![JointSelection { robot: "arm".into(), joints: Vec::new() }];
        let claim = ClaimRequest { claim: ClaimId(7), joints, ..ClaimRequest::default() };
        world.apply(&Command::Claim(claim)).unwrap();
        // The integrator still takes the mean of the accelerations before and after the change.
        let before = run(&mut world, 1e-3).velocities[0];
        let after = run(&mut world, 0.01).velocities[0];
        assert!((after - before).abs() < 1e-12, "{force:?}: {before} became {after}");
    }
}

/// Returns a torque on the arm about its joint, N m.
fn push(torque: f64, duration: WrenchDuration) -> Command {
    Command::ApplyWrench(LinkWrench {
        robot: "arm".into(),
        link: "arm".into(),
        force: DVec3::ZERO,
        torque: DVec3::new(0.0, torque, 0.0),
        in_link_axes: false,
        point: DVec3::ZERO,
        duration,
    })
}

/// Returns the passive arm without gravity: a torque of T for n steps gives it T n [`GAIN`] rad/s.
fn weightless_arm() -> Simulation {
    let mut world = world_with(1e-3, Spawn { passive: true, ..spawn("arm", arm()) });
    let physics = PhysicsChange { gravity: Some(DVec3::ZERO), ..PhysicsChange::default() };
    world.apply(&Command::SetPhysics(physics)).unwrap();
    world
}

/// Returns the number of steps with 1 N m that the arm received; exact except for the rounding of the sums.
fn newton_metre_steps(world: &Simulation) -> f64 {
    look(world).velocities[0] / GAIN
}

#[test]
fn a_wrench_with_a_duration_ends_at_the_step_of_its_time() {
    for (duration, steps) in [(0.2, 200), (0.0104, 10), (1e-9, 1), (0.0, 1)] {
        let mut world = weightless_arm();
        world.apply(&push(1.0, WrenchDuration::For(duration))).unwrap();
        for done in 1..=steps + 5 {
            world.step();
            let expected = f64::from(done.min(steps));
            assert!((newton_metre_steps(&world) - expected).abs() < 1e-6, "{duration} s, step {done}");
        }
    }
    // The last of two durations counts, from its own start.
    let mut world = weightless_arm();
    world.apply(&push(1.0, WrenchDuration::For(0.01))).unwrap();
    run(&mut world, 0.005);
    world.apply(&push(2.0, WrenchDuration::For(0.01))).unwrap();
    run(&mut world, 0.05);
    assert!((newton_metre_steps(&world) - 25.0).abs() < 1e-6);
    // Zero ends it.
    world.apply(&push(1.0, WrenchDuration::For(10.0))).unwrap();
    run(&mut world, 0.005);
    world.apply(&push(0.0, WrenchDuration::For(10.0))).unwrap();
    run(&mut world, 0.005);
    assert!((newton_metre_steps(&world) - 30.0).abs() < 1e-6);
    for seconds in [-1.0, f64::NAN, f64::INFINITY, 1e9] {
        assert!(matches!(
            world.apply(&push(1.0, WrenchDuration::For(seconds))),
            Err(Error::InvalidValue { .. })
        ));
    }
}

#[test]
fn a_persistent_wrench_waits_for_one_with_a_duration_and_ends_it_where_it_comes_later() {
    let mut world = weightless_arm();
    world.apply(&push(1.0, WrenchDuration::UntilCleared)).unwrap();
    run(&mut world, 0.01);
    world.apply(&push(-3.0, WrenchDuration::For(0.01))).unwrap();
    run(&mut world, 0.01);
    assert!((newton_metre_steps(&world) + 20.0).abs() < 1e-6);
    run(&mut world, 0.01);
    assert!((newton_metre_steps(&world) + 10.0).abs() < 1e-6, "it acts again");
    // A wrench that is renewed in the step after it ended leaves no gap.
    world.apply(&push(-3.0, WrenchDuration::For(0.001))).unwrap();
    world.step();
    world.apply(&push(-3.0, WrenchDuration::For(0.001))).unwrap();
    world.step();
    assert!((newton_metre_steps(&world) + 16.0).abs() < 1e-6);
    world.apply(&push(-3.0, WrenchDuration::For(10.0))).unwrap();
    world.apply(&push(2.0, WrenchDuration::UntilCleared)).unwrap();
    run(&mut world, 0.01);
    assert!((newton_metre_steps(&world) - 4.0).abs() < 1e-6, "the later one ends it");
    world.apply(&push(-3.0, WrenchDuration::For(10.0))).unwrap();
    world.apply(&push(0.0, WrenchDuration::UntilCleared)).unwrap();
    run(&mut world, 0.01);
    assert!((newton_metre_steps(&world) - 4.0).abs() < 1e-6, "all is clear");
    assert!(world.entities[0].state.applied_wrenches.is_empty());
}

#[test]
fn the_rest_of_a_wrench_is_part_of_the_world() {
    let mut world = weightless_arm();
    world.apply(&push(0.5, WrenchDuration::UntilCleared)).unwrap();
    world.apply(&push(1.0, WrenchDuration::For(0.02))).unwrap();
    run(&mut world, 0.01);
    world.apply(&Command::SaveState { name: "half".into() }).unwrap();
    let run_on = |world: &mut Simulation| {
        run(world, 0.03);
        look(world).velocities[0].to_bits()
    };
    let first = run_on(&mut world);
    assert!((newton_metre_steps(&world) - 30.0).abs() < 1e-6, "20 of 1, then 20 of a half");
    world.apply(&Command::RestoreState { name: "half".into() }).unwrap();
    let restored = world.fingerprint();
    assert_eq!(run_on(&mut world), first);
    world.apply(&Command::RestoreState { name: "half".into() }).unwrap();
    assert_eq!(world.fingerprint(), restored);
    world.apply(&push(1.0, WrenchDuration::For(0.02))).unwrap();
    assert_ne!(world.fingerprint(), restored, "the same push, for longer");
    world.apply(&Command::Reset(ResetScope { state: true, ..Default::default() })).unwrap();
    run(&mut world, 0.01);
    assert_eq!(look(&world).velocities, [0.0]);
}

/// A thousand wrenches for the next step on a paused world equal one of a thousand times the size.
#[test]
fn passing_wrenches_add_up_until_the_next_step() {
    let mut world = world_with(1e-3, Spawn { passive: true, ..spawn("arm", arm()) });
    let physics = PhysicsChange { gravity: Some(DVec3::ZERO), ..PhysicsChange::default() };
    world.apply(&Command::SetPhysics(physics)).unwrap();
    // Half of it as a couple, half as a force on a lever of half a metre.
    for i in 0..1000 {
        let lever = i % 2 == 0;
        let wrench = LinkWrench {
            robot: "arm".into(),
            link: "arm".into(),
            force: if lever { DVec3::new(0.0, 0.0, -1e-3) } else { DVec3::ZERO },
            torque: if lever { DVec3::ZERO } else { DVec3::new(0.0, 5e-4, 0.0) },
            in_link_axes: lever,
            point: DVec3::new(0.5, 0.0, 0.0),
            duration: WrenchDuration::NextStep,
        };
        world.apply(&Command::ApplyWrench(wrench)).unwrap();
    }
    assert!(world.entities[0].state.applied_wrenches.len() <= 2);
    let gain = 1e-3 / (0.0032199 + 0.19992 * 0.16597f64.powi(2));
    let seen = run(&mut world, 0.002);
    assert!((seen.velocities[0] - 0.5 * gain).abs() < 1e-9, "{seen:?}");
}

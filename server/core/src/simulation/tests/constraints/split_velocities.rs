//! Position correction by constraints, in addition to velocities.

use super::*;

/// Returns two boxes in space that turn, and a weld whose target is this far from the second one's pose, m
/// and rad.
fn pair(integrator: Integrator, off: f64) -> Simulation {
    let mut world = world_of(integrator, 0.0);
    add_body(&mut world, "a", body(1.0, DVec3::new(0.2, 0.1, 0.3)), DVec3::Z);
    add_body(&mut world, "b", body(2.0, DVec3::new(0.1, 0.2, 0.2)), DVec3::new(0.5, 0.0, 1.0));
    let twists = [("a", DVec3::new(0.1, 0.5, -0.2)), ("b", DVec3::new(-0.3, -0.4, 0.2))];
    for (robot, linear) in twists {
        let twist = Some((linear, DVec3::new(1.0, 2.0, 3.0)));
        world.apply(&Command::SetEntityState { robot: robot.into(), pose: None, twist }).unwrap();
    }
    let turn = DQuat::from_rotation_y(off);
    let frame = DPose3::from_parts(DVec3::new(-0.5 + off, off, 0.0), turn);
    let child = RequestedEnd { pose: Some(frame), ..as_it_is("b") };
    create(&mut world, constraint(RequestedConstraint::Weld, as_it_is("a"), child));
    world
}

/// A correction in only positions changes the arms, but not the momenta: within a hundredth of the change of
/// r x p.
#[test]
fn corrected_bodies_in_space_keep_their_momenta() {
    for integrator in [Integrator::Leapfrog, Integrator::Euler] {
        let off = 5e-4;
        let mut world = pair(integrator, off);
        let (linear, angular, _) = momenta(&look(&world));
        let state = run(&mut world, 0.2);
        let reading = state_of(&state, "constraint_1");
        assert!(reading.position_error < 1e-7 && reading.angle_error < 1e-7, "{integrator:?} {reading:?}");
        let now = momenta(&state);
        assert!((now.0 - linear).length() < 1e-12, "{integrator:?} {now:?} {linear}");
        // Semi-implicit Euler changes a turning body's angular momentum by more than this alone.
        let change = (now.1 - angular).length();
        assert!(change < 0.01 * off || integrator == Integrator::Euler, "{integrator:?} {change:e}");
    }
}

/// A correction over a large distance does not spin bodies up, as drawing in the arms does a skater.
#[test]
fn bodies_joined_from_afar_gain_no_energy() {
    // Semi-implicit Euler is of first order, with and without constraints.
    for (integrator, most) in [(Integrator::Leapfrog, 1e-6), (Integrator::Euler, 0.05)] {
        let mut world = pair(integrator, 20.0);
        let (_, _, before) = momenta(&look(&world));
        let mut state = PublishedState::default();
        for _ in 0..8_000 {
            world.step();
            world.observe(&mut state);
            let (_, _, energy) = momenta(&state);
            assert!(energy < before * (1.0 + most), "{integrator:?} {energy} {before}");
        }
        let reading = state_of(&state, "constraint_1");
        assert!(reading.position_error < 1e-6 && reading.angle_error < 1e-6, "{integrator:?} {reading:?}");
    }
}

/// A box that a correction moves has no velocity on its path, which takes 4 s.
#[test]
fn a_box_that_is_on_its_way_does_not_fall_asleep() {
    let mut world = world_of(Integrator::Leapfrog, 0.0);
    add_body(&mut world, "box", body(1.0, DVec3::splat(0.2)), DVec3::Z * 50.0);
    let kind = RequestedConstraint::Distance { length: Some(10.0), is_rope: true };
    create(&mut world, constraint(kind, end("", "", DVec3::ZERO), end("box", "", DVec3::ZERO)));
    let state = run(&mut world, 6.0);
    assert!((state.roots[0].pose.translation - DVec3::Z * 10.0).length() < 1e-6, "{:?}", state.roots[0]);
    assert!(world.entities.iter().all(|entity| entity.state.asleep));
}

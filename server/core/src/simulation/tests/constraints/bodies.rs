//! Constraints between free bodies, and between bodies and the world.

use super::*;

#[test]
fn a_weld_to_the_world_carries_the_weight() {
    for integrator in [Integrator::Leapfrog, Integrator::Euler] {
        let mut world = world_of(integrator, GRAVITY);
        add_body(&mut world, "box", body(2.0, DVec3::splat(0.2)), DVec3::Z);
        // Held at a corner.
        let name = create(
            &mut world,
            constraint(RequestedConstraint::Weld, end("", "", DVec3::new(0.1, 0.1, 1.1)), as_it_is("box")),
        );
        let state = run(&mut world, 1.0);
        let reading = state_of(&state, &name);
        assert!((reading.force - DVec3::Z * (2.0 * GRAVITY)).length() < 1e-6, "{reading:?}");
        let torque = DVec3::new(-0.1, -0.1, -0.1).cross(DVec3::Z * (-2.0 * GRAVITY));
        assert!((reading.torque + torque).length() < 1e-6, "{reading:?} {torque}");
        assert!(state.roots[0].pose.translation.distance(DVec3::Z) < 1e-8);
        // Deflection by R: 5 h^2 R F, and for the angle the same times the arm over the radius of inertia.
        assert!(reading.position_error < 1e-8 && reading.angle_error < 1e-7, "{reading:?}");
    }
}

#[test]
fn a_rope_of_fifty_links_carries_a_weight() {
    for integrator in [Integrator::Leapfrog, Integrator::Euler] {
        let mut world = world_of(integrator, GRAVITY);
        let (count, length) = (50, 0.02);
        let model = body(0.02, DVec3::new(0.01, 0.01, length));
        for i in 0..count {
            let at = DVec3::Z * (2.0 - length * (f64::from(i) + 0.5));
            add_body(&mut world, &format!("link_{i}"), Arc::clone(&model), at);
            let parent = match i {
                0 => end("", "", DVec3::Z * 2.0),
                i => end(&format!("link_{}", i - 1), "", DVec3::Z * (-0.5 * length)),
            };
            let child = end(&format!("link_{i}"), "", DVec3::Z * (0.5 * length));
            create(&mut world, constraint(RequestedConstraint::PointToPoint, parent, child));
        }
        add_body(&mut world, "weight", body(1.0, DVec3::splat(0.1)), DVec3::Z * 0.95);
        let parent = end(&format!("link_{}", count - 1), "", DVec3::Z * (-0.5 * length));
        create(
            &mut world,
            constraint(RequestedConstraint::PointToPoint, parent, end("weight", "", DVec3::Z * 0.05)),
        );
        // Pushed to the side for half a second.
        let push = LinkWrench {
            robot: "weight".into(),
            link: "body".into(),
            force: DVec3::X * 2.0,
            torque: DVec3::ZERO,
            in_link_axes: false,
            point: DVec3::ZERO,
            duration: WrenchDuration::For(0.5),
        };
        world.apply(&Command::ApplyWrench(push)).unwrap();
        let mut state = PublishedState::default();
        let mut error = 0.0f64;
        for _ in 0..2_000 {
            world.step();
            world.observe(&mut state);
            error = state.constraint_states.iter().fold(error, |error, of| error.max(of.position_error));
        }
        assert!(error < 1e-5, "{integrator:?} {error:e}");
        // It swings by some centimetres: the top one carries all, and a little more when the weight is at its
        // lowest.
        let (weight, force) = (2.0 * GRAVITY, state.constraint_states[0].force.length());
        assert!((force / weight - 1.0).abs() < 0.1, "{force} {weight}");
    }
}

/// Two welded boxes turn as one body of their sum. A symmetric one that spins about its axis continues to do
/// so, and momenta are conserved to rounding.
#[test]
fn two_welded_boxes_are_one() {
    for integrator in [Integrator::Leapfrog, Integrator::Euler] {
        let mut world = world_of(integrator, 0.0);
        let size = DVec3::new(0.2, 0.2, 0.1);
        let spin = 5.0;
        for (name, side) in [("left", -0.1), ("right", 0.1)] {
            add_body(&mut world, name, body(1.0, size), DVec3::X * side);
            let twist = Some((DVec3::Y * (spin * side) + DVec3::X * 0.3, DVec3::Z * spin));
            world.apply(&Command::SetEntityState { robot: name.into(), pose: None, twist }).unwrap();
        }
        let parent = end("left", "", DVec3::X * 0.1);
        let name = create(&mut world, constraint(RequestedConstraint::Weld, parent, as_it_is("right")));
        let before = momenta(&look(&world));
        let state = run(&mut world, 2.0);
        let after = momenta(&state);
        assert!(
            (before.0 - after.0).length() < 1e-12 && (before.1 - after.1).length() < 1e-12,
            "{integrator:?}"
        );
        // The velocities in the middle of a step exceed those at its ends by a part (w h)^2 / 8.
        assert!((after.2 / before.2 - 1.0).abs() < 1e-5, "{integrator:?} {before:?} {after:?}");
        let angle = spin * 2.0;
        let expected = DVec3::new(0.1 * angle.cos() + 0.6, 0.1 * angle.sin(), 0.0);
        let error = state.roots[1].pose.translation.distance(expected);
        assert!(error < 1e-5, "{integrator:?} {error:e}");
        let angle_between = state.roots[0].pose.rotation.angle_between(state.roots[1].pose.rotation);
        assert!(angle_between < 1e-7 && state_of(&state, &name).position_error < 1e-9, "{angle_between:e}");
    }
}

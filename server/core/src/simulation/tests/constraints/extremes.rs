//! Strong pulls, redundant constraints, and constraints without force.

use super::*;

const LINKS: usize = 50;
const LINK: f64 = 0.04;
const ROPE: f64 = LINK * LINKS as f64;

/// Times in ms, positions of the load at these times, and tolerances. Positions are by SHAKE at 0.1, 0.05 and
/// 0.025 ms, which differ by less than 4e-5 m. After 3.8 s they depend on rounding.
const PLACES: [(u32, DVec3, f64); 3] = [
    (2_400, DVec3::new(0.068782, 0.0, -1.763717), 2e-3),
    (2_600, DVec3::new(1.006898, 0.0, -1.611113), 2.5e-3),
    (3_600, DVec3::new(0.719161, 0.0, -1.029814), 3e-3),
];

/// Returns fifty links of 10 g from the horizontal, with a kilogram at the end.
fn rope(integrator: Integrator) -> Simulation {
    let mut world = world_of(integrator, GRAVITY);
    let link = body(0.01, DVec3::new(0.03, 0.006, 0.006));
    let names = |index: usize| if index == LINKS { "load".into() } else { format!("link-{index}") };
    let mut parent = end("", "", DVec3::ZERO);
    for index in 0..=LINKS {
        let (name, half) = (names(index), if index == LINKS { 0.025 } else { 0.5 * LINK });
        let model = if index == LINKS { body(1.0, DVec3::splat(0.05)) } else { Arc::clone(&link) };
        add_body(&mut world, &name, model, DVec3::X * (LINK * index as f64 + half));
        let child = end(&name, "", DVec3::X * -half);
        create(&mut world, constraint(RequestedConstraint::PointToPoint, parent, child));
        parent = end(&name, "", DVec3::X * half);
    }
    world
}

fn energy(state: &PublishedState) -> f64 {
    let (_, _, kinetic) = momenta(state);
    let potential = |(root, mass): (&crate::simulation::published_state::RootState, f64)| {
        mass * GRAVITY * root.pose.translation.z
    };
    let masses = std::iter::repeat_n(0.01, LINKS).chain([1.0]);
    kinetic + state.roots.iter().zip(masses).map(potential).sum::<f64>()
}

/// It snaps tight after 2.54 s, with some 660 N. A free link would then swing by six radians in a step of 1
/// ms. No link leaves another one, no energy is gained, and the load is where a step that is twenty times as
/// short moves it.
#[test]
fn a_light_rope_that_snaps_tight_holds() {
    for integrator in [Integrator::Leapfrog, Integrator::Euler] {
        let mut world = rope(integrator);
        let mut state = PublishedState::default();
        let (mut error, mut gain, mut reach) = (0.0f64, 0.0f64, 0.0f64);
        for step in 1..=5_000 {
            world.step();
            world.observe(&mut state);
            error = state.constraint_states.iter().fold(error, |error, of| error.max(of.position_error));
            gain = gain.max(energy(&state));
            reach = reach.max(state.roots[LINKS].pose.translation.length());
            // Single bodies on constraints begin with a whole kick, and are half a step ahead.
            let load = &state.roots[LINKS];
            let place = load.pose.translation - load.linear * 5e-4;
            for (_, exact, most) in PLACES.iter().filter(|(at, ..)| *at == step) {
                assert!(place.distance(*exact) < *most, "{integrator:?} {step}: {place} {exact}");
            }
        }
        assert!(state.roots.iter().all(|root| root.disabled.is_none()));
        assert!(error < 1e-4, "{integrator:?}: {error:e}");
        assert!(reach < ROPE + 0.025 + 1e-4, "{integrator:?}: {reach}");
        let most = 1.01 * GRAVITY * ROPE;
        // Kinetic energy belongs to the middle of a step, and potential energy to its end.
        assert!(gain < 0.01 * most, "{integrator:?}: {gain}");
    }
}

/// A box on a hundred welds at one place has its weight, and each of them carries an equal share.
#[test]
fn a_hundred_constraints_share_what_one_carries() {
    let mut world = world_of(Integrator::Leapfrog, GRAVITY);
    add_body(&mut world, "box", body(1.0, DVec3::splat(0.2)), DVec3::Z);
    for kind in [RequestedConstraint::Weld, RequestedConstraint::PointToPoint] {
        for _ in 0..50 {
            create(&mut world, constraint(kind, end("", "", DVec3::Z), as_it_is("box")));
        }
    }
    let state = run(&mut world, 0.5);
    let sum: DVec3 = state.constraint_states.iter().map(|of| of.force).sum();
    assert!((sum - DVec3::Z * GRAVITY).length() < 1e-6, "{sum}");
    for of in &state.constraint_states {
        assert!((of.force.z - 0.01 * GRAVITY).abs() < 1e-6, "{of:?}");
    }
    assert!(state.roots[0].pose.translation.distance(DVec3::Z) < 1e-8);
    // All of them are deleted with the robot, in one command.
    world.take_events();
    world.apply(&Command::Delete { robot: "box".into() }).unwrap();
    assert!(look(&world).constraints.is_empty());
    run(&mut world, 0.01);
}

/// Two constraints on one pair of links equal one, also if the links turn and are pulled.
#[test]
fn the_same_links_may_be_held_twice() {
    let places: Vec<Vec<DVec3>> = [1, 2]
        .into_iter()
        .map(|times| {
            let mut world = world_of(Integrator::Leapfrog, GRAVITY);
            add_body(&mut world, "upper", body(1.0, DVec3::new(0.3, 0.1, 0.1)), DVec3::X * 0.2);
            add_body(&mut world, "lower", body(0.5, DVec3::new(0.3, 0.1, 0.1)), DVec3::X * 0.6);
            for _ in 0..times {
                let point = RequestedConstraint::PointToPoint;
                create(&mut world, constraint(point, end("", "", DVec3::ZERO), as_it_is("upper")));
                let hinge = RequestedConstraint::Hinge { axis: DVec3::Y };
                create(&mut world, constraint(hinge, end("upper", "", DVec3::X * 0.2), as_it_is("lower")));
            }
            let state = run(&mut world, 1.0);
            assert!(state.constraint_states.iter().all(|of| of.position_error < 1e-7), "{times}");
            state.roots.iter().map(|root| root.pose.translation).collect()
        })
        .collect();
    for (once, twice) in places[0].iter().zip(&places[1]) {
        // R differs.
        assert!(once.distance(*twice) < 1e-5, "{once} {twice}");
    }
}

/// A constraint with zero force does nothing.
#[test]
fn a_constraint_without_force_lets_go() {
    let fall = |is_held: bool| {
        let mut world = world_of(Integrator::Leapfrog, GRAVITY);
        add_body(&mut world, "box", body(1.0, DVec3::splat(0.2)), DVec3::Z);
        if is_held {
            let weld = constraint(RequestedConstraint::Weld, end("", "", DVec3::Z), as_it_is("box"));
            create(&mut world, CreateConstraint { max_force: Some(0.0), max_torque: Some(0.0), ..weld });
        }
        run(&mut world, 0.5)
    };
    let (held, free) = (fall(true), fall(false));
    let at = |state: &PublishedState| state.roots[0].pose.translation;
    // It begins with a whole kick, and is half a step ahead: g h t / 2.
    assert!(at(&held).distance(at(&free)) < 3e-3, "{} {}", at(&held), at(&free));
    let reading = held.constraint_states[0];
    assert!(reading.is_saturated && reading.force == DVec3::ZERO && reading.torque == DVec3::ZERO);
    assert!(reading.position_error > 1.0, "{reading:?}");
}

/// The frame of an end may be far from its link, and be moved while the world runs.
#[test]
fn frames_that_are_far_away_settle() {
    let mut world = world_of(Integrator::Leapfrog, GRAVITY);
    add_body(&mut world, "box", body(1.0, DVec3::splat(0.2)), DVec3::Z);
    let weld = constraint(RequestedConstraint::Weld, end("", "", DVec3::Z), end("box", "", DVec3::ZERO));
    let name = create(&mut world, weld);
    for (place, turn) in [(DVec3::new(3.0, -2.0, 4.0), 3.1), (DVec3::ZERO, -1.0), (DVec3::splat(50.0), 0.0)] {
        let pose = DPose3::from_parts(place, DQuat::from_rotation_x(turn));
        let change = ChangeConstraint { name: name.clone(), parent_pose: Some(pose), ..Default::default() };
        world.apply(&Command::ChangeConstraint(Box::new(change))).unwrap();
        // At most 10 m/s and 30 rad/s.
        let state = run(&mut world, 10.0);
        assert!(state.roots[0].disabled.is_none());
        let error = state.roots[0].pose.translation.distance(place);
        assert!(error < 1e-6, "{error:e}");
        assert!(state.roots[0].pose.rotation.angle_between(pose.rotation) < 1e-6);
    }
}

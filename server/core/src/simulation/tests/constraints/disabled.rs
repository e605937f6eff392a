//! Constraints on disabled robots.

use super::*;
use crate::dynamics::constraint::link_constraint::LinkConstraint;

/// Returns two boxes that hang in the world, the second on the first.
fn hanging() -> Simulation {
    let mut world = world_of(Integrator::Leapfrog, GRAVITY);
    add_body(&mut world, "a", body(1.0, DVec3::splat(0.2)), DVec3::Z);
    add_body(&mut world, "b", body(2.0, DVec3::splat(0.2)), DVec3::new(0.3, 0.0, 1.0));
    create(&mut world, constraint(RequestedConstraint::Weld, end("", "", DVec3::Z), as_it_is("a")));
    create(&mut world, constraint(RequestedConstraint::Weld, end("a", "", DVec3::X * 0.15), as_it_is("b")));
    world
}

/// NaN is removed in the step in which robots are disabled, and their constraints show nothing. A state that
/// is saved then can be imported elsewhere, and reset robots continue as before.
#[test]
fn constraints_of_disabled_robots_keep_nothing_of_the_step() {
    let mut world = hanging();
    run(&mut world, 0.1);
    world.constraints.list[1].impulses[0] = [f64::NAN; 3];
    world.step();
    let state = look(&world);
    assert!(state.roots.iter().all(|root| root.disabled.is_some()), "{:?}", state.roots);
    for of in &world.constraints.list {
        assert_eq!(*of, LinkConstraint::new(of.definition.clone()));
    }
    assert!(state.constraint_states.iter().all(|of| *of == ConstraintState::default()));
    world.apply(&Command::SaveState { name: "then".into() }).unwrap();
    let saved = look(&world).saved("then").unwrap().saved().clone();
    Saved::new(saved.world_state().clone(), saved.parts()).unwrap();
    for robot in ["a", "b"] {
        let back = Command::SetEntityState { robot: robot.into(), pose: None, twist: None };
        world.apply(&back).unwrap();
    }
    let state = run(&mut world, 0.1);
    assert!(state.roots.iter().all(|root| root.disabled.is_none()), "{:?}", state.roots);
    let force = state_of(&state, "constraint_1").force;
    assert!((force - DVec3::Z * (3.0 * GRAVITY)).length() < 1e-3, "{force}");
}

/// A box hangs from an arm and is disabled alone. The force between the two is no longer shown, nor part of
/// the load of the arm's joint, which is the arm's own weight.
#[test]
fn a_constraint_with_a_disabled_robot_pulls_at_nothing() {
    let mut world = world_of(Integrator::Leapfrog, GRAVITY);
    world.apply(&Command::Spawn(Box::new(spawn("arm", arm())))).unwrap();
    add_body(&mut world, "box", body(0.1, DVec3::splat(0.1)), DVec3::new(0.3, 0.0, 0.2));
    let weld = constraint(RequestedConstraint::Weld, end("arm", "arm", DVec3::X * 0.3), as_it_is("box"));
    let name = create(&mut world, weld);
    let carried = |state: &PublishedState| {
        let reactions = state.joint_reactions(0, DVec3::Z * -GRAVITY).unwrap();
        reactions[0][0].length()
    };
    let state = run(&mut world, 2.0);
    assert!((carried(&state) - 0.29992 * GRAVITY).abs() < 1e-3, "{}", carried(&state));
    world.entities[1].body.velocities_mut()[0] = f64::NAN;
    let state = run(&mut world, 2.0);
    assert!(state.roots[1].disabled.is_some() && state.roots[0].disabled.is_none());
    assert_eq!(state_of(&state, &name), ConstraintState::default());
    assert!((carried(&state) - 0.19992 * GRAVITY).abs() < 1e-3, "{}", carried(&state));
}

/// A limit would move an arm that holds one of the boxes to infinity in a step: the solution for all three is
/// unusable. The arm caused that and is disabled; the boxes continue to hang, in the same step.
#[test]
fn a_robot_with_rows_that_cannot_be_computed_is_left_out_of_what_the_others_are_solved_with() {
    let mut world = hanging();
    world.apply(&Command::Spawn(Box::new(Spawn { passive: true, ..spawn("arm", arm()) }))).unwrap();
    let kind = RequestedConstraint::PointToPoint;
    create(&mut world, constraint(kind, end("arm", "arm", DVec3::X * 0.3), as_it_is("b")));
    run(&mut world, 0.1);
    world.entities[2].body.axes_mut()[0].settings.limits.lower = Some(1e300);
    for step in 0..3 {
        world.step();
        let state = look(&world);
        let disabled = state.roots.iter().map(|root| root.disabled.is_some()).collect::<Vec<_>>();
        assert_eq!(disabled, [false, false, true], "step {step}");
        let force = state_of(&state, "constraint_1").force;
        assert!((force - DVec3::Z * (3.0 * GRAVITY)).length() < 0.5, "step {step}: {force}");
    }
}

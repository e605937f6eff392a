//! Limits, breaking, claims and lifetime of constraints.

use super::*;
use crate::simulation::event::ConstraintDeletion;

fn two_boxes(gravity: f64) -> Simulation {
    let mut world = world_of(Integrator::Leapfrog, gravity);
    add_body(&mut world, "a", body(1.0, DVec3::splat(0.2)), DVec3::Z);
    add_body(&mut world, "b", body(2.0, DVec3::splat(0.2)), DVec3::new(0.3, 0.0, 1.0));
    world
}

fn weld() -> CreateConstraint {
    constraint(RequestedConstraint::Weld, end("a", "", DVec3::X * 0.15), as_it_is("b"))
}

fn gone(world: &mut Simulation) -> Vec<(String, ConstraintDeletion)> {
    let gone = world.take_events().into_iter().filter_map(|event| match event.kind {
        EventKind::ConstraintDeleted { constraint, cause } => Some((constraint, cause)),
        _ => None,
    });
    gone.collect()
}

#[test]
fn a_weld_lets_go_at_its_maximal_force() {
    for breaks in [true, false] {
        let mut world = world_of(Integrator::Leapfrog, GRAVITY);
        add_body(&mut world, "box", body(1.0, DVec3::splat(0.2)), DVec3::Z);
        let weld = constraint(RequestedConstraint::Weld, end("", "", DVec3::Z), as_it_is("box"));
        let name = create(&mut world, CreateConstraint { max_force: Some(15.0), breaks, ..weld });
        let state = run(&mut world, 0.5);
        assert!((state_of(&state, &name).force.z - GRAVITY).abs() < 1e-6, "{breaks}");
        // With a further 10 N it would need 19.81 N.
        let push = LinkWrench {
            robot: "box".into(),
            link: "body".into(),
            force: DVec3::Z * -10.0,
            torque: DVec3::ZERO,
            in_link_axes: false,
            point: DVec3::ZERO,
            duration: WrenchDuration::UntilCleared,
        };
        world.apply(&Command::ApplyWrench(push)).unwrap();
        world.step();
        let state = look(&world);
        if breaks {
            assert!(state.constraints.is_empty() && state.constraint_states.is_empty());
            assert_eq!(gone(&mut world), [(name, ConstraintDeletion::Broke)]);
        } else {
            let state = run(&mut world, 0.2);
            let reading = state_of(&state, &name);
            assert!(reading.is_saturated && (reading.force.length() - 15.0).abs() < 1e-9, "{reading:?}");
            // It slides down with the remaining force: 19.81 - 15 N.
            let accelerations = state.roots[0].accelerations;
            assert!((accelerations[2] + 4.81).abs() < 1e-6, "{accelerations:?}");
        }
    }
}

#[test]
fn removal_leaves_momenta_as_they_were() {
    let mut world = two_boxes(0.0);
    let twist = Some((DVec3::new(0.1, 0.5, -0.2), DVec3::new(1.0, 2.0, 3.0)));
    world.apply(&Command::SetEntityState { robot: "a".into(), pose: None, twist }).unwrap();
    let before = momenta(&look(&world));
    let name = create(&mut world, weld());
    let held = momenta(&run(&mut world, 0.5));
    world.apply(&Command::DeleteConstraint { name }).unwrap();
    let after = momenta(&run(&mut world, 0.5));
    for (one, other) in [(before, held), (held, after)] {
        assert!((one.0 - other.0).length() < 1e-12, "{one:?} {other:?}");
        assert!((one.1 - other.1).length() < 1e-9, "{one:?} {other:?}");
    }
    // The weld was a plastic hit: energy is lost only once.
    assert!(held.2 < before.2 && (after.2 - held.2).abs() < 1e-4 * held.2, "{before:?} {held:?} {after:?}");
}

/// Two welds hold one box 1 m apart from each other's place: it settles in the middle, and both report
/// errors.
#[test]
fn constraints_that_contradict_each_other_settle() {
    let mut world = world_of(Integrator::Leapfrog, GRAVITY);
    add_body(&mut world, "box", body(1.0, DVec3::splat(0.2)), DVec3::Z);
    let at = |x: f64| end("", "", DVec3::new(x, 0.0, 1.0));
    for (x, max_force) in [(-0.5, None), (0.5, None), (0.5, Some(50.0))] {
        let weld = constraint(RequestedConstraint::Weld, at(x), end("box", "", DVec3::ZERO));
        create(&mut world, CreateConstraint { max_force, ..weld });
    }
    let state = run(&mut world, 2.0);
    let now = state.roots[0].pose.translation;
    assert!((now - DVec3::Z).length() < 1e-3, "{now}");
    assert!(state.roots[0].linear.length() < 1e-9, "{:?}", state.roots[0]);
    for name in ["constraint_1", "constraint_2"] {
        let reading = state_of(&state, name);
        assert!((reading.position_error - 0.5).abs() < 1e-3, "{reading:?}");
    }
    let limited = state_of(&state, "constraint_3");
    assert!(limited.is_saturated && (limited.force.length() - 50.0).abs() < 1e-9, "{limited:?}");
    assert!(limited.velocity_residual > 0.1, "{limited:?}");
}

#[test]
fn a_gear_keeps_its_ratio() {
    for integrator in [Integrator::Leapfrog, Integrator::Euler] {
        let mut world = world_of(integrator, GRAVITY);
        for name in ["left", "right"] {
            world.apply(&Command::Spawn(Box::new(Spawn { passive: true, ..spawn(name, arm()) }))).unwrap();
        }
        let joint = |robot: &str| RequestedEnd {
            robot: robot.into(),
            joint: "shoulder".into(),
            ..Default::default()
        };
        let kind = RequestedConstraint::Gear { ratio: -2.5, offset: None };
        let name = create(&mut world, constraint(kind, joint("left"), joint("right")));
        let mut state = PublishedState::default();
        let mut moved = 0.0f64;
        for _ in 0..3_000 {
            world.step();
            world.observe(&mut state);
            let error = state.positions[1] + 2.5 * state.positions[0];
            // Deflection by R under an arm's weight.
            assert!(error.abs() < 1e-8, "{integrator:?} {error:e}");
            moved = moved.max(state.positions[0].abs());
        }
        assert!(moved > 0.2, "{moved}");
        let target = RobotTargets {
            robot: "left".into(),
            joints: vec![JointTarget { joint: "shoulder".into(), axis: 0, target: Target::position(0.2) }],
            ..RobotTargets::default()
        };
        world
            .apply(&Command::SetTargets(SetTargets { robots: vec![target], ..SetTargets::default() }))
            .unwrap();
        let change = ChangeConstraint {
            name: name.clone(),
            ratio: Some(1.0),
            offset: Some(0.1),
            ..Default::default()
        };
        world.apply(&Command::ChangeConstraint(Box::new(change))).unwrap();
        let state = run(&mut world, 5.0);
        assert!((state.positions[1] - state.positions[0] - 0.1).abs() < 1e-8, "{:?}", state.positions);
        // The left joint's actuator carries both arms.
        let effort = hold_effort(state.positions[0]) + hold_effort(state.positions[1]);
        assert!((state.efforts[0] - effort).abs() < 1e-6, "{} {effort}", state.efforts[0]);
        let torque = state_of(&state, &name).torque;
        assert!((torque.y - hold_effort(state.positions[1])).abs() < 1e-6, "{torque}");
    }
}

/// A slack rope does nothing; a tight one carries the weight and keeps it from going farther.
#[test]
fn a_rope_is_slack_until_it_is_tight() {
    let mut world = world_of(Integrator::Leapfrog, GRAVITY);
    add_body(&mut world, "box", body(1.0, DVec3::splat(0.2)), DVec3::Z);
    let kind = RequestedConstraint::Distance { length: Some(0.5), is_rope: true };
    let name = create(&mut world, constraint(kind, end("", "", DVec3::Z), end("box", "", DVec3::ZERO)));
    let state = run(&mut world, 0.2);
    assert_eq!(state_of(&state, &name).force, DVec3::ZERO);
    assert!((state.roots[0].pose.translation.z - (1.0 - 0.5 * GRAVITY * 0.04)).abs() < 1e-3);
    let state = run(&mut world, 2.0);
    assert!((state.roots[0].pose.translation.z - 0.5).abs() < 1e-6, "{:?}", state.roots[0]);
    assert!((state_of(&state, &name).force.z - GRAVITY).abs() < 1e-6);
}

#[test]
fn a_slide_leaves_its_axis_and_a_hinge_a_turn() {
    let mut world = world_of(Integrator::Leapfrog, GRAVITY);
    add_body(&mut world, "slider", body(1.0, DVec3::splat(0.2)), DVec3::Z);
    add_body(&mut world, "door", body(1.0, DVec3::splat(0.2)), DVec3::new(0.5, 1.0, 1.0));
    let axis = DVec3::new(1.0, 0.0, -1.0);
    create(
        &mut world,
        constraint(
            RequestedConstraint::Slide { axis },
            end("", "", DVec3::Z),
            end("slider", "", DVec3::ZERO),
        ),
    );
    let hinge = RequestedConstraint::Hinge { axis: DVec3::Y };
    create(&mut world, constraint(hinge, end("", "", DVec3::new(0.0, 1.0, 1.0)), as_it_is("door")));
    let state = run(&mut world, 0.3);
    // Half of gravity's square root two, along the slope: g sin 45 degrees.
    let along = 0.5 * GRAVITY * std::f64::consts::FRAC_1_SQRT_2 * 0.3 * 0.3;
    let at = state.roots[0].pose.translation - DVec3::Z;
    assert!((at.dot(axis.normalize()) - along).abs() < 2e-3, "{at} {along}");
    assert!(at.cross(axis.normalize()).length() < 1e-8, "{at}");
    assert!(state.roots[0].pose.rotation.angle_between(DQuat::IDENTITY) < 1e-7);
    let door = &state.roots[1];
    let arm = door.pose.translation - DVec3::new(0.0, 1.0, 1.0);
    assert!((arm.length() - 0.5).abs() < 1e-6 && arm.y.abs() < 1e-9, "{arm}");
    assert!(arm.z < -0.1 && door.angular.x.abs() + door.angular.z.abs() < 1e-6, "{door:?}");
}

#[test]
fn a_sleeping_box_wakes_where_its_partner_moves() {
    let mut world = two_boxes(0.0);
    create(&mut world, weld());
    run(&mut world, 1.5);
    assert!(world.entities.iter().all(|entity| entity.state.asleep));
    let twist = Some((DVec3::X, DVec3::ZERO));
    world.apply(&Command::SetEntityState { robot: "a".into(), pose: None, twist }).unwrap();
    let state = run(&mut world, 0.01);
    assert!((state.roots[1].linear.x - 1.0 / 3.0).abs() < 1e-6, "{:?}", state.roots);
}

#[test]
fn a_constraint_goes_with_its_robot_and_stays_over_resets() {
    let mut world = two_boxes(GRAVITY);
    add_body(&mut world, "c", body(1.0, DVec3::splat(0.2)), DVec3::new(0.6, 0.0, 1.0));
    let first = create(&mut world, weld());
    let second = create(
        &mut world,
        constraint(RequestedConstraint::PointToPoint, end("b", "", DVec3::X * 0.15), as_it_is("c")),
    );
    run(&mut world, 0.1);
    world.apply(&Command::Reset(ResetScope { state: true, ..ResetScope::default() })).unwrap();
    assert_eq!(look(&world).constraints.len(), 2);
    world.take_events();
    world.apply(&Command::Delete { robot: "a".into() }).unwrap();
    assert_eq!(gone(&mut world), [(first, ConstraintDeletion::RobotDeleted)]);
    let state = run(&mut world, 0.2);
    assert_eq!(state.constraints[0].name, second);
    assert_eq!(state.constraints[0].robots().collect::<Vec<_>>(), [0, 1]);
    assert!(state.constraint_states[0].position_error < 1e-6, "{:?}", state.constraint_states);
}

#[test]
fn constraints_are_part_of_the_state() {
    for integrator in [Integrator::Leapfrog, Integrator::Euler] {
        let mut world = two_boxes(GRAVITY);
        world
            .apply(&Command::SetPhysics(PhysicsChange { integrator: Some(integrator), ..Default::default() }))
            .unwrap();
        create(&mut world, weld());
        let kind = RequestedConstraint::Distance { length: Some(1.2), is_rope: true };
        create(
            &mut world,
            constraint(kind, end("", "", DVec3::new(0.0, 0.3, 2.0)), end("a", "", DVec3::Y * 0.1)),
        );
        run(&mut world, 0.4);
        world.apply(&Command::SaveState { name: "here".into() }).unwrap();
        let run_on = |world: &mut Simulation| {
            (0..5_000)
                .map(|_| {
                    world.step();
                    world.fingerprint()
                })
                .collect::<Vec<_>>()
        };
        let first = run_on(&mut world);
        let names: Vec<String> = look(&world).constraints.iter().map(|of| of.name.clone()).collect();
        for name in names {
            world.apply(&Command::DeleteConstraint { name }).unwrap();
        }
        world.apply(&Command::RestoreState { name: "here".into() }).unwrap();
        assert!(first == run_on(&mut world), "{integrator:?}");
    }
}

#[test]
fn a_constraint_on_a_claimed_robot_is_refused() {
    let mut world = two_boxes(0.0);
    let claim = ClaimRequest {
        claim: ClaimId(7),
        holder: "another".into(),
        joints: vec![JointSelection { robot: "b".into(), joints: Vec::new() }],
        ..ClaimRequest::default()
    };
    world.apply(&Command::Claim(claim)).unwrap();
    let make = Command::CreateConstraint(Box::new(weld()));
    assert!(matches!(world.apply(&make), Err(Error::RobotClaimed { .. })));
    world.apply_for(&make, Some(ClaimId(7))).unwrap();
    let name = "constraint_1".to_owned();
    let change = ChangeConstraint { name: name.clone(), max_force: Some(1.0), ..Default::default() };
    let change = Command::ChangeConstraint(Box::new(change));
    let delete = Command::DeleteConstraint { name };
    for command in [&change, &delete] {
        assert!(matches!(world.apply(command), Err(Error::RobotClaimed { .. })));
        world.apply_for(command, Some(ClaimId(7))).unwrap();
    }
}

#[test]
fn invalid_constraints_are_refused_and_named() {
    let mut world = two_boxes(0.0);
    world.apply(&Command::Spawn(Box::new(spawn("arm", arm())))).unwrap();
    let refused = |world: &mut Simulation, create: CreateConstraint| {
        let before = world.fingerprint();
        let error = world.apply(&Command::CreateConstraint(Box::new(create))).unwrap_err();
        assert_eq!(world.fingerprint(), before);
        error.to_string()
    };
    let nan = f64::NAN;
    let of = |kind| constraint(kind, as_it_is("a"), as_it_is("b"));
    for (create, part) in [
        (CreateConstraint { max_force: Some(nan), ..weld() }, "max_force is NaN"),
        (CreateConstraint { max_torque: Some(-1.0), ..weld() }, "max_torque is -1"),
        (CreateConstraint { name: "a b".into(), ..weld() }, "name is"),
        (of(RequestedConstraint::Hinge { axis: DVec3::ZERO }), "axis is"),
        (of(RequestedConstraint::Distance { length: Some(-1.0), is_rope: false }), "length is -1"),
        (constraint(RequestedConstraint::Weld, as_it_is("a"), as_it_is("a")), "child.link"),
        (constraint(RequestedConstraint::Weld, as_it_is(""), as_it_is("")), "child is"),
        (constraint(RequestedConstraint::Weld, as_it_is("arm"), as_it_is("")), "child is"),
        (constraint(RequestedConstraint::Weld, as_it_is("missing"), as_it_is("")), "missing"),
        (
            constraint(RequestedConstraint::Weld, end("a", "", DVec3::splat(nan)), as_it_is("b")),
            "parent.pose.position.x is NaN",
        ),
        (
            of(RequestedConstraint::Gear { ratio: 1.0, offset: None }),
            "parent.joint is empty; a gear is between two joints: it must name one of robot \"a\"",
        ),
    ] {
        let said = refused(&mut world, create);
        assert!(said.contains(part), "{said:?} {part:?}");
    }
    create(&mut world, CreateConstraint { name: "one".into(), ..weld() });
    let said = refused(&mut world, CreateConstraint { name: "one".into(), ..weld() });
    assert!(said.contains("already"), "{said}");
    let change = ChangeConstraint { name: "one".into(), ratio: Some(2.0), ..Default::default() };
    let said = world.apply(&Command::ChangeConstraint(Box::new(change))).unwrap_err().to_string();
    assert!(said.contains("only a gear"), "{said}");
}

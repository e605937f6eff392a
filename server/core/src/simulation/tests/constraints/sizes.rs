//! Limits of lengths, sizes and numbers of constraints, and free names.

use simd_model::LARGEST_GIVEN;

use super::*;
use crate::simulation::published_state::ConstraintKind;
use crate::simulation::world_state::WorldState;

fn two_boxes() -> Simulation {
    let mut world = world_of(Integrator::Leapfrog, GRAVITY);
    add_body(&mut world, "a", body(1.0, DVec3::splat(0.2)), DVec3::Z);
    add_body(&mut world, "b", body(2.0, DVec3::splat(0.2)), DVec3::new(0.3, 0.0, 1.0));
    world
}

fn rope(length: f64, is_rope: bool) -> CreateConstraint {
    let kind = RequestedConstraint::Distance { length: Some(length), is_rope };
    constraint(kind, end("a", "", DVec3::ZERO), end("b", "", DVec3::ZERO))
}

/// A rope of 1e306 m requires an infinite velocity, and 0 across it, which gives NaN.
#[test]
fn sizes_beyond_the_range_of_steps_are_refused_and_named() {
    let mut world = two_boxes();
    let (far, point) = (DVec3::X * 1e306, RequestedConstraint::PointToPoint);
    let refused = |world: &mut Simulation, command: &Command| {
        let before = world.fingerprint();
        let said = world.apply(command).unwrap_err().to_string();
        assert_eq!(world.fingerprint(), before);
        said
    };
    for (create, part) in [
        (rope(1e306, true), "length is 1e306"),
        (rope(1e306, false), "length is 1e306"),
        (constraint(point, end("a", "", far), as_it_is("b")), "parent.pose.position.x is 1e306"),
        (constraint(point, as_it_is("a"), end("b", "", far)), "child.pose.position.x is 1e306"),
    ] {
        let said = refused(&mut world, &Command::CreateConstraint(Box::new(create)));
        assert!(said.contains(part) && said.contains("1e12"), "{said:?} {part:?}");
    }
    let name = create(&mut world, rope(0.3, true));
    let pose = Some(DPose3::from_translation(far));
    let of = || ChangeConstraint { name: name.clone(), ..Default::default() };
    for (change, part) in [
        (ChangeConstraint { length: Some(1e306), ..of() }, "length is 1e306"),
        (ChangeConstraint { parent_pose: pose, ..of() }, "parent_pose.position.x is 1e306"),
        (ChangeConstraint { child_pose: pose, ..of() }, "child_pose.position.x is 1e306"),
    ] {
        let said = refused(&mut world, &Command::ChangeConstraint(Box::new(change)));
        assert!(said.contains(part) && said.contains("1e12"), "{said:?} {part:?}");
    }
    // If the ends are that far apart, their distance would be infinite.
    let state = |pose, twist| Command::SetEntityState { robot: "a".into(), pose, twist };
    for (command, part) in [
        (state(pose, None), "pose.position.x is 1e306"),
        (state(None, Some((far, DVec3::ZERO))), "twist.linear.x is 1e306"),
        (state(None, Some((DVec3::ZERO, far))), "twist.angular.x is 1e306"),
    ] {
        let said = refused(&mut world, &command);
        assert!(said.contains(part) && said.contains("1e12"), "{said:?} {part:?}");
    }
}

/// A saved state of another daemon may have no coordinate that steps cannot compute with.
#[test]
fn a_state_with_what_no_step_can_compute_with_is_refused() {
    let mut world = two_boxes();
    for robot in ["left", "right"] {
        world.apply(&Command::Spawn(Box::new(spawn(robot, arm())))).unwrap();
    }
    create(&mut world, rope(0.3, true));
    let joint =
        |robot: &str| RequestedEnd { robot: robot.into(), joint: "shoulder".into(), ..Default::default() };
    let gear = RequestedConstraint::Gear { ratio: 1.0, offset: None };
    create(&mut world, constraint(gear, joint("left"), joint("right")));
    let saved = world.to_saved();
    let refused = |change: &dyn Fn(&mut WorldState)| {
        let mut state = saved.world_state().clone();
        change(&mut state);
        Saved::new(state, saved.parts()).unwrap_err().to_string()
    };
    assert!(Saved::new(saved.world_state().clone(), saved.parts()).is_ok());
    let far = 1e306;
    let distance = |length: f64| ConstraintKind::Distance { length, is_rope: true };
    let gear = |ratio: f64, offset: f64| ConstraintKind::Gear { ratio, offset };
    for (said, part) in [
        (refused(&|state| state.constraints[0].definition.kind = distance(far)), "a length of 1e306"),
        (refused(&|state| state.constraints[0].definition.kind = distance(f64::NAN)), "a length of NaN"),
        (refused(&|state| state.constraints[0].definition.kind = distance(-1.0)), "a length of -1"),
        (refused(&|state| state.constraints[1].definition.kind = gear(far, 0.0)), "a ratio of 1e306"),
        (refused(&|state| state.constraints[1].definition.kind = gear(1.0, far)), "an offset of 1e306"),
        (
            refused(&|state| state.constraints[0].definition.ends[1].frame.translation.y = far),
            "a frame with a coordinate of 1e306",
        ),
    ] {
        assert!(said.contains(part), "{said:?} {part:?}");
    }
}

/// The largest accepted lengths and frames keep numbers finite.
#[test]
fn the_largest_distances_give_finite_numbers() {
    let far = DVec3::X * LARGEST_GIVEN;
    let frames = |kind: RequestedConstraint| constraint(kind, end("a", "", -far), end("b", "", far));
    for create_one in [
        rope(LARGEST_GIVEN, true),
        rope(LARGEST_GIVEN, false),
        frames(RequestedConstraint::PointToPoint),
        frames(RequestedConstraint::Weld),
        frames(RequestedConstraint::Distance { length: Some(0.0), is_rope: true }),
    ] {
        let mut world = two_boxes();
        let kind = create_one.kind;
        create(&mut world, create_one);
        let state = run(&mut world, 0.1);
        assert!(state.roots.iter().all(|root| root.disabled.is_none()), "{kind:?}");
        let of = &state.constraint_states[0];
        let are_numbers = of.force.is_finite() && of.torque.is_finite() && of.position_error.is_finite();
        assert!(are_numbers, "{kind:?} {of:?}");
        Saved::new(world.to_saved().world_state().clone(), world.to_saved().parts()).unwrap();
    }
}

/// A constraint without a name gets the first free number, and no other name counts as one with a number.
#[test]
fn a_constraint_without_a_name_has_the_first_free_number() {
    let mut world = two_boxes();
    let named = |name: &str| CreateConstraint { name: name.into(), ..rope(0.3, true) };
    for name in ["constraint_2", "constraint_01", "constraint_x", "constraint_99999999999999999999"] {
        create(&mut world, named(name));
    }
    let next: Vec<String> = (0..3).map(|_| create(&mut world, named(""))).collect();
    assert_eq!(next, ["constraint_1", "constraint_3", "constraint_4"]);
    world.apply(&Command::DeleteConstraint { name: "constraint_3".into() }).unwrap();
    assert_eq!(create(&mut world, named("")), "constraint_3");
}

//! Pulls of links to points of the world.

use super::*;

/// Moment of inertia of the arm about its joint, kg m^2: its centre's and Steiner's part.
const INERTIA: f64 = 0.0032199 + 0.19992 * 0.16597 * 0.16597;
/// Distance of the pulled point from the joint, in the arm's frame, metres.
const REACH: f64 = 0.3;

/// Returns the passive arm without gravity.
fn weightless_arm(time_step: f64) -> Simulation {
    let mut world = world_with(time_step, Spawn { passive: true, ..spawn("arm", arm()) });
    let physics = PhysicsChange { gravity: Some(DVec3::ZERO), ..PhysicsChange::default() };
    world.apply(&Command::SetPhysics(physics)).unwrap();
    world
}

/// Returns the position of the pulled point at this angle of the joint, world.
fn place(angle: f64) -> DVec3 {
    let joint = arm_joint().parent_from_joint;
    joint.translation + joint.rotation * (DQuat::from_rotation_y(angle) * (DVec3::X * REACH))
}

fn pull() -> LinkPull {
    LinkPull {
        robot: "arm".into(),
        link: "arm".into(),
        point: DVec3::X * REACH,
        target: Some(place(0.5)),
        stiffness: Some(20.0),
        max_force: Some(100.0),
        duration: Some(10.0),
    }
}

/// The point reaches its target and stays, without overshoot: the damper is critical for the mass that the
/// arm has at the point, [`INERTIA`] / [`REACH`]^2. A linear spring would not overshoot. The bound of a
/// thousandth of the path covers the turning lever and the steps of 1 ms.
#[test]
fn a_pulled_point_comes_to_its_target_without_swinging() {
    let mut world = weightless_arm(1e-3);
    world.apply(&Command::PullLink(pull())).unwrap();
    let mass = INERTIA / (REACH * REACH);
    let damping = world.entities[0].state.pulls[0].damping;
    assert!((damping - 2.0 * (20.0 * mass).sqrt()).abs() < 1e-9 * damping, "{damping}");
    let mut farthest = f64::NEG_INFINITY;
    for _ in 0..3000 {
        world.step();
        farthest = farthest.max(look(&world).positions[0]);
    }
    assert!((look(&world).positions[0] - 0.5).abs() < 1e-4, "{}", look(&world).positions[0]);
    assert!(farthest < 0.5005, "{farthest}");
}

#[test]
fn a_pull_ends_automatically_and_is_renewed_by_the_next_one() {
    let mut world = weightless_arm(1e-3);
    world.apply(&Command::PullLink(LinkPull { duration: Some(0.01), ..pull() })).unwrap();
    run(&mut world, 0.005);
    world.apply(&Command::PullLink(LinkPull { duration: Some(0.01), ..pull() })).unwrap();
    run(&mut world, 0.01);
    assert_eq!(look(&world).applied_wrenches.len(), 1, "it acted over the last step");
    assert!(world.entities[0].state.pulls.is_empty());
    world.step();
    let coasting = look(&world);
    assert!(coasting.velocities[0] != 0.0 && coasting.applied_wrenches.is_empty());
    let then = run(&mut world, 0.1);
    assert!((then.velocities[0] - coasting.velocities[0]).abs() < 1e-12);
    // The default is half a second.
    world.apply(&Command::PullLink(LinkPull { duration: None, ..pull() })).unwrap();
    run(&mut world, 0.499);
    assert_eq!(world.entities[0].state.pulls.len(), 1);
    world.step();
    assert!(world.entities[0].state.pulls.is_empty());
}

#[test]
fn no_target_lets_go_at_once() {
    let mut world = weightless_arm(1e-3);
    world.apply(&Command::PullLink(pull())).unwrap();
    run(&mut world, 0.01);
    world.apply(&Command::PullLink(LinkPull { target: None, ..pull() })).unwrap();
    world.step();
    let before = look(&world).velocities[0];
    assert!(before > 0.0);
    assert!((run(&mut world, 0.1).velocities[0] - before).abs() < 1e-12);
}

/// A force of 0.01 N acts on a lever of 0.3 m for 10 ms, far from the target. The arm gets F r t / I.
#[test]
fn the_force_is_at_most_what_is_asked_for() {
    let mut world = weightless_arm(1e-3);
    // In the direction in which the point can move at angle zero.
    let target = place(0.0) + arm_joint().parent_from_joint.rotation * (DVec3::NEG_Z * 50.0);
    let pull = LinkPull { target: Some(target), max_force: Some(0.01), ..pull() };
    world.apply(&Command::PullLink(pull)).unwrap();
    let seen = run(&mut world, 0.01);
    let expected = 0.01 * REACH * 0.01 / INERTIA;
    assert!((seen.velocities[0] - expected).abs() < 1e-3 * expected, "{} {expected}", seen.velocities[0]);
    let [applied] = &seen.applied_wrenches[..] else { panic!("{:?}", seen.applied_wrenches) };
    assert!((applied.force.length() - 0.01).abs() < 1e-12);
}

/// The spring is as soft as a step can follow. A stiffness of 1e12 N/m with steps of 20 ms keeps the arm
/// finite, and brings it to its target.
#[test]
fn a_pull_that_is_too_stiff_for_the_step_is_stable() {
    let mut world = weightless_arm(2e-2);
    let pull = LinkPull { stiffness: Some(1e12), max_force: Some(1e12), ..pull() };
    world.apply(&Command::PullLink(pull)).unwrap();
    let seen = run(&mut world, 5.0);
    assert!(seen.roots[0].disabled.is_none());
    assert!((seen.positions[0] - 0.5).abs() < 1e-3, "{}", seen.positions[0]);
}

/// A longer step softens existing springs, to the bound of
/// [`a_pull_that_is_too_stiff_for_the_step_is_stable`].
#[test]
fn a_pull_that_a_longer_step_finds_too_stiff_is_stable() {
    let mut world = weightless_arm(1e-4);
    let pull = LinkPull { stiffness: Some(1e12), max_force: Some(1e12), ..pull() };
    world.apply(&Command::PullLink(pull)).unwrap();
    let longer = PhysicsChange { time_step: Some(2e-2), ..PhysicsChange::default() };
    world.apply(&Command::SetPhysics(longer)).unwrap();
    let seen = run(&mut world, 5.0);
    assert!(seen.roots[0].disabled.is_none());
    assert!((seen.positions[0] - 0.5).abs() < 1e-3, "{}", seen.positions[0]);
}

/// Pulls on links of one body add up, at any number: eight of them bring it to their target, and a ninth is
/// refused.
#[test]
fn pulls_on_many_links_of_one_body_are_stable_and_have_a_bound() {
    let mut links =
        vec![link("l0", Inertial { mass: 1.0, center_of_mass: DVec3::ZERO, inertia: DMat3::IDENTITY })];
    let mut joints = Vec::new();
    for child in 1..9 {
        links.push(link(&format!("l{child}"), Inertial::ZERO));
        let (name, kind) = (format!("j{child}"), JointKind::Fixed);
        joints.push(Joint { name, kind, child, parent_from_joint: DPose3::IDENTITY, ..arm_joint() });
    }
    let model = RobotModel { name: "b".into(), links, joints, ..RobotModel::default() };
    let mut world = world_with(1e-3, Spawn { fixed_base: Some(false), ..spawn("b", Arc::new(model)) });
    let pull = |link: usize| LinkPull {
        robot: "b".into(),
        link: format!("l{link}"),
        point: DVec3::ZERO,
        target: Some(DVec3::X),
        stiffness: Some(1e12),
        max_force: Some(1e12),
        duration: Some(60.0),
    };
    for link in 0..8 {
        world.apply(&Command::PullLink(pull(link))).unwrap();
    }
    let before = world.fingerprint();
    let refused = world.apply(&Command::PullLink(pull(8))).unwrap_err();
    assert_eq!(refused.to_string(), "pulls on links of robot \"b\" would be 9, and the limit is 8");
    assert_eq!(world.fingerprint(), before);
    // An existing one is changed.
    world.apply(&Command::PullLink(pull(7))).unwrap();
    let seen = run(&mut world, 2.0);
    let place = seen.roots[0].pose.translation;
    // Gravity stretches the spring by m g / k, 9.81 h^2 sum / 0.25 with a mobility of 3 in all: 0.12 mm.
    assert!((place - DVec3::X).length() < 1e-3, "{place}");
}

#[test]
fn the_rest_of_a_pull_is_part_of_the_world() {
    let mut world = weightless_arm(1e-3);
    world.apply(&Command::PullLink(LinkPull { duration: Some(0.05), ..pull() })).unwrap();
    run(&mut world, 0.02);
    world.apply(&Command::SaveState { name: "half".into() }).unwrap();
    let run_on = |world: &mut Simulation| run(world, 0.1).velocities[0].to_bits();
    let first = run_on(&mut world);
    world.apply(&Command::RestoreState { name: "half".into() }).unwrap();
    let restored = world.fingerprint();
    assert_eq!(run_on(&mut world), first);
    world.apply(&Command::RestoreState { name: "half".into() }).unwrap();
    world.apply(&Command::PullLink(LinkPull { duration: Some(0.05), ..pull() })).unwrap();
    assert_ne!(world.fingerprint(), restored, "the same pull, for longer");
    world.apply(&Command::Reset(ResetScope { state: true, ..Default::default() })).unwrap();
    assert!(world.entities[0].state.pulls.is_empty());
}

#[test]
fn a_pull_on_what_cannot_move_does_nothing() {
    let mut world = weightless_arm(1e-3);
    world.apply(&Command::PullLink(LinkPull { link: "base_link".into(), ..pull() })).unwrap();
    assert_eq!(run(&mut world, 0.05).velocities, [0.0]);
    assert!(world.entities[0].state.pulls.is_empty());
}

#[test]
fn numbers_that_cannot_be_are_refused_by_the_name_of_their_field() {
    let mut world = weightless_arm(1e-3);
    let nan = DVec3::new(0.0, f64::NAN, 0.0);
    for (field, wrong) in [
        ("point.y", LinkPull { point: nan, ..pull() }),
        ("target.y", LinkPull { target: Some(nan), ..pull() }),
        ("target.x", LinkPull { target: Some(DVec3::X * 1e13), ..pull() }),
        ("stiffness", LinkPull { stiffness: Some(-1.0), ..pull() }),
        ("max_force", LinkPull { max_force: Some(f64::INFINITY), ..pull() }),
        ("duration", LinkPull { duration: Some(61.0), ..pull() }),
    ] {
        let before = world.fingerprint();
        match world.apply(&Command::PullLink(wrong)) {
            Err(Error::InvalidValue { element, .. }) => assert_eq!(element, field),
            other => panic!("{field}: {other:?}"),
        }
        assert_eq!(world.fingerprint(), before);
    }
}

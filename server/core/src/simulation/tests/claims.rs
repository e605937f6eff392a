//! Claims: actions that they forbid others, and their end.

use super::super::event::Claimed;
use super::*;

const PLANNER: ClaimId = ClaimId(7);
const OTHER: ClaimId = ClaimId(8);

fn all_of(robot: &str) -> Vec<JointSelection> {
    vec![JointSelection { robot: robot.into(), joints: Vec::new() }]
}

fn request(claim: ClaimId, holder: &str, joints: Vec<JointSelection>) -> ClaimRequest {
    ClaimRequest { claim, holder: holder.into(), joints, ..ClaimRequest::default() }
}

fn claim(world: &mut Simulation, request: ClaimRequest) -> Result<Vec<ClaimId>, Error> {
    match world.apply(&Command::Claim(request))?.reply {
        Reply::Claimed { ended } => Ok(ended),
        other => panic!("{other:?}"),
    }
}

/// Returns a world with the robots "arm" and "other"; the planner has claimed "arm".
fn claimed() -> Simulation {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    world.apply(&Command::Spawn(Box::new(spawn("other", arm())))).unwrap();
    claim(&mut world, request(PLANNER, "planner", all_of("arm"))).unwrap();
    world
}

fn target(target: Target) -> Command {
    let joints = vec![JointTarget { joint: "shoulder".into(), axis: 0, target }];
    let robots = vec![RobotTargets { robot: "arm".into(), joints, ..RobotTargets::default() }];
    Command::SetTargets(SetTargets { robots, ..SetTargets::default() })
}

/// Returns every command that changes the robot "arm".
fn changes_of_arm() -> Vec<Command> {
    let robot = || "arm".to_owned();
    let joint = || "shoulder".to_owned();
    let reset = JointReset { joint: joint(), axis: 0, position: 0.0, velocity: 0.0, ..Default::default() };
    let damping = JointProperties { joint: joint(), damping: Some(0.5), ..JointProperties::default() };
    let wrench = LinkWrench {
        robot: robot(),
        link: "arm".into(),
        force: DVec3::Z,
        torque: DVec3::ZERO,
        in_link_axes: false,
        point: DVec3::ZERO,
        duration: WrenchDuration::NextStep,
    };
    let pair =
        CollisionPair { other_robot: robot(), link: "arm".into(), other_link: "arm".into(), enabled: None };
    vec![
        target(position(0.1)),
        Command::ResetJoints { robots: vec![RobotReset { robot: robot(), joints: Vec::new() }] },
        Command::ResetJoints { robots: vec![RobotReset { robot: robot(), joints: vec![reset] }] },
        Command::SetJointProperties { robot: robot(), joints: vec![damping] },
        Command::SetLinkProperties { robot: robot(), links: Vec::new(), stays_awake: None },
        Command::SetCollisionFilter(CollisionFilterChange { robot: robot(), ..Default::default() }),
        Command::SetCollisionFilter(CollisionFilterChange {
            robot: "other".into(),
            pairs: vec![pair],
            ..Default::default()
        }),
        Command::SetEntityState { robot: robot(), pose: Some(DPose3::IDENTITY), twist: None },
        Command::ApplyWrench(wrench),
        Command::PullLink(LinkPull { robot: robot(), link: "arm".into(), ..LinkPull::default() }),
        Command::Reload(Box::new(Reload { robot: robot(), model: arm(), shapes: Default::default() })),
        Command::Delete { robot: robot() },
    ]
}

/// Returns every command that concerns the whole world.
fn changes_of_the_world() -> Vec<Command> {
    vec![
        Command::SetPhysics(PhysicsChange { substeps: Some(2), ..PhysicsChange::default() }),
        Command::Reset(ResetScope { state: true, ..ResetScope::default() }),
        Command::RestoreState { name: "saved".into() },
    ]
}

#[test]
fn a_claimed_robot_is_changed_by_its_holder_alone() {
    let mut world = claimed();
    for command in changes_of_arm() {
        for other in [None, Some(OTHER)] {
            if other.is_some() {
                claim(&mut world, request(OTHER, "other", all_of("other"))).unwrap();
            }
            let before = world.fingerprint();
            let refused = world.apply_for(&command, other).unwrap_err();
            let is_named = matches!(&refused, Error::RobotClaimed { holder, .. } | Error::JointClaimed { holder, .. }
                if holder == "planner");
            assert!(is_named, "{command:?}: {refused}");
            assert_eq!(world.fingerprint(), before, "{command:?}");
            if other.is_some() {
                world.apply(&Command::Release { claim: OTHER, cause: ReleaseCause::Released }).unwrap();
            }
        }
        let of_other = matches!(&command, Command::SetCollisionFilter(change) if change.robot == "other");
        match world.apply_for(&command, Some(PLANNER)) {
            Ok(_) => {}
            // A robot's link with itself is not a pair, but the claim did not prevent it.
            Err(error) => {
                assert!(of_other && !matches!(error, Error::RobotClaimed { .. }), "{command:?}: {error}")
            }
        }
    }
}

#[test]
fn a_joint_that_is_claimed_alone_keeps_others_from_the_robot_but_not_from_its_other_joints() {
    let mut longer = (*arm()).clone();
    longer.links.push(link("hand", Inertial { mass: 0.01, ..Inertial::ZERO }));
    longer.joints.push(Joint { name: "wrist".into(), parent: 1, child: 2, ..arm_joint() });
    let mut world = world_with(1e-3, spawn("arm", Arc::new(longer)));
    let wrist = vec![JointSelection { robot: "arm".into(), joints: vec!["wrist".into()] }];
    claim(&mut world, request(PLANNER, "planner", wrist)).unwrap();
    set(&mut world, position(0.1)).unwrap();
    let refused = world.apply(&Command::Delete { robot: "arm".into() }).unwrap_err();
    assert_eq!(refused.to_string(), "joint \"wrist\" of robot \"arm\" is claimed by \"planner\"");
    let refused = claim(&mut world, request(OTHER, "other", all_of("arm"))).unwrap_err();
    assert_eq!(refused.to_string(), "joint \"wrist\" of robot \"arm\" is claimed by \"planner\"");
    let shoulder = vec![JointSelection { robot: "arm".into(), joints: vec!["shoulder".into()] }];
    claim(&mut world, request(OTHER, "other", shoulder)).unwrap();
    set(&mut world, position(0.1)).unwrap_err();
}

#[test]
fn commands_for_all_clients_need_the_world_while_another_client_holds_a_claim() {
    let mut world = claimed();
    world.apply(&Command::SaveState { name: "saved".into() }).unwrap();
    for command in changes_of_the_world() {
        let refused = world.apply(&command).unwrap_err();
        assert!(matches!(&refused, Error::WorldShared { holder } if holder == "planner"), "{refused}");
        // No other client is concerned.
        world.apply_for(&command, Some(PLANNER)).unwrap();
    }
    claim(&mut world, ClaimRequest { world: true, ..request(OTHER, "operator", Vec::new()) }).unwrap();
    assert_eq!(look(&world).claimed_by.as_deref(), Some("operator"));
    for command in changes_of_the_world() {
        let refused = world.apply_for(&command, Some(PLANNER)).unwrap_err();
        assert!(matches!(&refused, Error::WorldClaimed { holder } if holder == "operator"), "{refused}");
        world.apply_for(&command, Some(OTHER)).unwrap();
    }
    // No other client may step either; the robots' claims stay.
    world.allow_step(Some(PLANNER)).unwrap_err();
    world.apply_for(&target(position(0.1)), Some(OTHER)).unwrap_err();
    world.apply_for(&target(position(0.1)), Some(PLANNER)).unwrap();
    world.apply(&Command::Release { claim: OTHER, cause: ReleaseCause::Lapsed }).unwrap();
    assert_eq!(look(&world).claimed_by, None);
    world.allow_step(None).unwrap();
}

#[test]
fn a_higher_priority_takes_over_and_the_claim_that_was_in_the_way_ends_whole() {
    let mut world = claimed();
    let both = [all_of("arm"), all_of("other")].concat();
    for priority in [0, 1] {
        let wanted = ClaimRequest { priority, ..request(OTHER, "safety", both.clone()) };
        match priority {
            0 => assert!(matches!(claim(&mut world, wanted), Err(Error::RobotClaimed { .. }))),
            _ => assert_eq!(claim(&mut world, wanted).unwrap(), [PLANNER]),
        }
    }
    let refused = world.apply_for(&target(position(0.1)), Some(PLANNER)).unwrap_err();
    assert!(matches!(refused, Error::ClaimNotFound), "{refused}");
    let ends = world.take_events().into_iter().filter_map(|event| match event.kind {
        EventKind::JointsReleased { holder, released, cause } => Some((holder, released, cause)),
        _ => None,
    });
    let released = Claimed { robots: vec!["arm".into()], joints: vec!["arm/shoulder".into()], world: false };
    assert_eq!(
        ends.collect::<Vec<_>>(),
        [("planner".to_owned(), released, ReleaseCause::TakenOver { by: "safety".into() })]
    );
    // No priority keeps an administrator out.
    let admin = ClaimRequest { take_over: true, ..request(PLANNER, "admin", all_of("other")) };
    assert_eq!(claim(&mut world, admin).unwrap(), [OTHER]);
    set(&mut world, position(0.1)).unwrap();
}

#[test]
fn a_claimed_joint_takes_targets_of_its_holder_only_and_holds_when_released() {
    let mut world = claimed();
    assert_eq!(
        set(&mut world, position(0.1)).unwrap_err().to_string(),
        "joint \"shoulder\" of robot \"arm\" is claimed by \"planner\""
    );
    world.apply_for(&target(velocity(1.0)), Some(PLANNER)).unwrap();
    run(&mut world, 0.1);
    world.apply(&Command::Release { claim: PLANNER, cause: ReleaseCause::Lapsed }).unwrap();
    assert_eq!(look(&world).modes[0], Mode::Hold);
    set(&mut world, position(0.1)).unwrap();
}

/// Claims are agreements between clients: a restored state neither ends nor restores one.
#[test]
fn a_restored_state_leaves_claims_as_they_are() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    world.apply(&Command::SaveState { name: "before".into() }).unwrap();
    claim(&mut world, request(PLANNER, "planner", all_of("arm"))).unwrap();
    world.apply(&Command::SaveState { name: "claimed".into() }).unwrap();
    world.apply_for(&Command::RestoreState { name: "before".into() }, Some(PLANNER)).unwrap();
    assert!(matches!(set(&mut world, position(0.1)), Err(Error::JointClaimed { .. })));
    let delete = Command::Delete { robot: "arm".into() };
    assert!(matches!(world.apply(&delete), Err(Error::RobotClaimed { .. })));
    world.apply(&Command::Release { claim: PLANNER, cause: ReleaseCause::Released }).unwrap();
    world.apply(&Command::RestoreState { name: "claimed".into() }).unwrap();
    set(&mut world, position(0.1)).unwrap();
}

#[test]
fn a_claim_on_what_is_gone_forbids_nothing() {
    let mut world = claimed();
    world.apply_for(&Command::Delete { robot: "arm".into() }, Some(PLANNER)).unwrap();
    for command in &changes_of_the_world()[..2] {
        world.apply(command).unwrap();
    }
    world.apply(&Command::Spawn(Box::new(spawn("arm", arm())))).unwrap();
    set(&mut world, position(0.1)).unwrap();
}

#[test]
fn motions_of_others_end_with_a_claim_and_targets_stay() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    let path = |begin| FollowTrajectory {
        robot: "arm".into(),
        joints: vec!["shoulder".into()],
        points: Arc::new(vec![TrajectoryPoint { time: 6.0, positions: vec![2.0], ..Default::default() }]),
        begin,
        ..FollowTrajectory::default()
    };
    for begin in [Begin::After(0.0), Begin::After(1.0)] {
        let push = LinkWrench {
            robot: "arm".into(),
            link: "arm".into(),
            force: DVec3::Z,
            torque: DVec3::ZERO,
            in_link_axes: false,
            point: DVec3::ZERO,
            duration: WrenchDuration::UntilCleared,
        };
        world.apply(&target(position(0.3))).unwrap();
        world.apply(&Command::ApplyWrench(push)).unwrap();
        world.apply(&Command::FollowTrajectory(path(begin))).unwrap();
        claim(&mut world, request(PLANNER, "planner", all_of("arm"))).unwrap();
        let state = &world.entities[0].state;
        assert!(state.trajectories.is_empty() && state.applied_wrenches.is_empty() && state.pulls.is_empty());
        let target_now = |world: &Simulation| look(world).targets;
        let before = target_now(&world);
        (0..2_000).for_each(|_| world.step());
        assert_eq!(target_now(&world), before, "the target stays, and is the holder's to change");
        world.apply(&Command::Release { claim: PLANNER, cause: ReleaseCause::Released }).unwrap();
    }
}

#[test]
fn a_robot_that_is_welded_to_a_claimed_one_is_deleted_and_reloaded_by_the_holder_alone() {
    let mut world = claimed();
    let end =
        |robot: &str| RequestedEnd { robot: robot.into(), link: "arm".into(), ..RequestedEnd::default() };
    let weld = CreateConstraint {
        name: "weld".into(),
        kind: RequestedConstraint::Weld,
        parent: end("arm"),
        child: end("other"),
        max_force: None,
        max_torque: None,
        breaks: false,
        disable_collisions: false,
    };
    world.apply_for(&Command::CreateConstraint(Box::new(weld)), Some(PLANNER)).unwrap();
    let reload = Reload { robot: "other".into(), model: arm(), shapes: Default::default() };
    for command in [Command::Reload(Box::new(reload)), Command::Delete { robot: "other".into() }] {
        let before = world.fingerprint();
        let refused = world.apply(&command).unwrap_err();
        assert_eq!(refused.to_string(), "robot \"arm\" is claimed by \"planner\"");
        assert_eq!(world.fingerprint(), before);
        world.apply_for(&command, Some(PLANNER)).unwrap();
    }
}

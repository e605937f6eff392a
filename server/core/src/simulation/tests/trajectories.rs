//! Trajectories: how joints follow them, and how they end.

use super::super::trajectory::{TrajectoryEnd, Violation};
use super::*;

/// Returns two links of the tutorial's arm in series: joints `shoulder` and `elbow`.
fn two_links() -> Arc<RobotModel> {
    let one = arm();
    let (mut links, mut joints) = (one.links.clone(), one.joints.clone());
    links.push(Link { name: "forearm".into(), ..one.links[1].clone() });
    joints.push(Joint {
        name: "elbow".into(),
        parent: 1,
        child: 2,
        parent_from_joint: DPose3::from_translation(DVec3::new(0.3, 0.0, 0.0)),
        ..arm_joint()
    });
    Arc::new(RobotModel { name: "arm".into(), links, joints, ..RobotModel::default() })
}

fn armed() -> Simulation {
    world_with(1e-3, spawn("arm", two_links()))
}

fn point(time: f64, positions: &[f64]) -> TrajectoryPoint {
    TrajectoryPoint { time, positions: positions.to_vec(), ..TrajectoryPoint::default() }
}

/// Returns a point at rest.
fn smooth(time: f64, positions: &[f64]) -> TrajectoryPoint {
    let zeros = vec![0.0; positions.len()];
    TrajectoryPoint { velocities: zeros.clone(), accelerations: zeros, ..point(time, positions) }
}

fn both(points: Vec<TrajectoryPoint>) -> FollowTrajectory {
    FollowTrajectory {
        robot: "arm".into(),
        joints: vec!["shoulder".into(), "elbow".into()],
        points: Arc::new(points),
        ..FollowTrajectory::default()
    }
}

fn shoulder(points: Vec<TrajectoryPoint>) -> FollowTrajectory {
    FollowTrajectory { joints: vec!["shoulder".into()], ..both(points) }
}

fn follow(world: &mut Simulation, request: FollowTrajectory) -> u64 {
    match world.apply(&Command::FollowTrajectory(request)).unwrap().reply {
        Reply::TrajectoryAccepted { id } => id,
        other => panic!("{other:?}"),
    }
}

/// A saved state with more joints could not be read again.
#[test]
fn a_trajectory_of_more_joints_than_a_saved_state_takes_is_refused() {
    let mut world = armed();
    let joints = 1_001;
    let request = FollowTrajectory {
        joints: vec!["shoulder".into(); joints],
        ..both(vec![point(1.0, &vec![0.0; joints])])
    };
    let refused = world.apply(&Command::FollowTrajectory(request)).unwrap_err();
    assert_eq!(refused.to_string(), "joints is 1001 joints; a trajectory has at most 1000");
}

/// Returns the trajectories that ended since the last call, with the step at which they did.
fn ended(world: &mut Simulation) -> Vec<(u64, TrajectoryEnd, u64)> {
    let ended = world.take_events().into_iter().filter_map(|event| match event.kind {
        EventKind::TrajectoryEnded { robot, id, end } => {
            assert_eq!(robot, "arm");
            Some((id, end, event.at.step))
        }
        _ => None,
    });
    ended.collect()
}

fn ends(world: &mut Simulation) -> Vec<(u64, TrajectoryEnd)> {
    ended(world).into_iter().map(|(id, end, _)| (id, end)).collect()
}

fn cancelled(by: &str) -> TrajectoryEnd {
    TrajectoryEnd::Cancelled { by: by.into() }
}

/// A quintic from rest to rest: s(u) = 10 u^3 - 15 u^4 + 6 u^5. The spring of the default gains, 300 rad/s,
/// lags by the acceleration over its square: 5.8 A / T^2 / 9e4, below 1e-4 rad here. It sags by gravity,
/// below 1 mrad.
#[test]
fn joints_follow_the_interpolated_path_and_the_end_is_reported_at_its_step() {
    let mut world = armed();
    let id = follow(&mut world, both(vec![smooth(1.0, &[0.8, -1.2])]));
    let mut largest = 0.0f64;
    for step in 1..=1000 {
        world.step();
        let u = f64::from(step) * 1e-3;
        let s = 10.0 * u.powi(3) - 15.0 * u.powi(4) + 6.0 * u.powi(5);
        let seen = look(&world);
        largest = largest.max((seen.positions[0] - 0.8 * s).abs()).max((seen.positions[1] + 1.2 * s).abs());
        // The setpoint itself is on the path to rounding.
        assert!((seen.targets[0] - 0.8 * s).abs() < 1e-9, "{u}: {}", seen.targets[0]);
    }
    assert!(largest < 4e-3, "{largest}");
    assert_eq!(ended(&mut world), [(id, TrajectoryEnd::Succeeded, 1000)]);
    let seen = run(&mut world, 1.0);
    assert!(
        (seen.positions[0] - 0.8).abs() < 2e-3 && (seen.positions[1] + 1.2).abs() < 2e-3,
        "it stays there"
    );
    assert!(ends(&mut world).is_empty());
}

#[test]
fn a_joint_that_cannot_follow_ends_it_with_its_name_and_by_how_much() {
    let mut world = armed();
    let tight = Tolerance { position: Some(0.05), velocity: None };
    // Half a turn within a twentieth of a second, with hardly any effort.
    let weak = JointProperties {
        joint: "elbow".into(),
        limits: Some(JointLimits { effort: Some(0.2), ..JointLimits::default() }),
        ..JointProperties::default()
    };
    world.apply(&Command::SetJointProperties { robot: "arm".into(), joints: vec![weak] }).unwrap();
    let id = follow(
        &mut world,
        FollowTrajectory {
            tolerances: vec![[tight, Tolerance::default()]; 2],
            ..both(vec![smooth(0.05, &[0.0, 3.0]), smooth(2.0, &[0.0, 3.0])])
        },
    );
    run(&mut world, 0.2);
    let ends = ends(&mut world);
    let [(ended, TrajectoryEnd::PathToleranceViolated(violation))] = ends.as_slice() else {
        panic!("{ends:?}")
    };
    let Violation { joint, quantity, error, tolerance } = violation;
    assert_eq!((*ended, joint.as_str(), *quantity, *tolerance), (id, "elbow", "position", 0.05));
    assert!(error.abs() > 0.05, "{error}");
    assert_eq!(look(&world).modes, [Mode::Hold, Mode::Hold], "all of its joints hold");
}

#[test]
fn a_goal_that_is_not_reached_in_time_is_a_failure_and_one_that_is_reached_late_a_success() {
    let exact = Tolerance { position: Some(0.02), velocity: Some(0.05) };
    let request = |after: Option<f64>| FollowTrajectory {
        tolerances: vec![[Tolerance::default(), exact]],
        goal_time_tolerance: after,
        ..shoulder(vec![point(0.2, &[0.5])])
    };
    // The corner at the end of the line is cut late: the joint still moves there.
    let mut world = armed();
    let id = follow(&mut world, request(Some(0.5)));
    run(&mut world, 0.7);
    let reported = ended(&mut world);
    assert_eq!((reported[0].0, &reported[0].1), (id, &TrajectoryEnd::Succeeded));
    assert!(reported[0].2 > 200, "after its time: {reported:?}");
    // Held by a wrench, it never arrives.
    let mut world = armed();
    let wrench = LinkWrench {
        robot: "arm".into(),
        link: "arm".into(),
        force: DVec3::ZERO,
        torque: DVec3::new(0.0, -500.0, 0.0),
        in_link_axes: false,
        point: DVec3::ZERO,
        duration: WrenchDuration::UntilCleared,
    };
    world.apply(&Command::ApplyWrench(wrench)).unwrap();
    let id = follow(&mut world, request(Some(0.1)));
    run(&mut world, 0.5);
    let reported = ended(&mut world);
    assert!(
        matches!(reported[0], (ended, TrajectoryEnd::GoalToleranceViolated(_), 300 | 301) if ended == id),
        "{reported:?}"
    );
}

#[test]
fn one_that_is_cancelled_stops_where_it_is() {
    let mut world = armed();
    let id = follow(&mut world, both(vec![smooth(1.0, &[0.8, -1.2])]));
    let middle = run(&mut world, 0.5).positions;
    world.apply(&Command::CancelTrajectory { robot: "arm".into(), id: Some(id) }).unwrap();
    assert_eq!(ends(&mut world), [(id, cancelled("a request"))]);
    let after = run(&mut world, 1.0).positions;
    assert!(
        (after[0] - middle[0]).abs() < 5e-3 && (after[1] - middle[1]).abs() < 5e-3,
        "{middle:?} {after:?}"
    );
    let again = world.apply(&Command::CancelTrajectory { robot: "arm".into(), id: Some(id) });
    assert!(again.unwrap_err().to_string().contains("has not ended"));
    world.apply(&Command::CancelTrajectory { robot: "arm".into(), id: None }).unwrap();
}

/// The new one begins at the old one's position and velocity: no position jumps.
#[test]
fn a_new_trajectory_continues_from_the_old_one_at_once_or_later() {
    for (begin, at) in [(Begin::Now, 500), (Begin::After(0.2), 700)] {
        let mut world = armed();
        let old = follow(&mut world, both(vec![smooth(1.0, &[0.8, -1.2])]));
        run(&mut world, 0.5);
        let new = follow(&mut world, FollowTrajectory { begin, ..shoulder(vec![smooth(0.6, &[0.1])]) });
        let mut before = look(&world).targets[0];
        for _ in 0..800 {
            world.step();
            let target = look(&world).targets[0];
            // 1.5 rad/s is the maximum of the old one, and the new one is as fast.
            assert!((target - before).abs() < 3e-3, "{before} to {target}");
            before = target;
        }
        assert_eq!(
            ended(&mut world),
            [(old, TrajectoryEnd::Superseded, at), (new, TrajectoryEnd::Succeeded, at + 600)]
        );
        assert_eq!(look(&world).modes, [Mode::Position, Mode::Hold], "the elbow has nothing new to do");
    }
}

#[test]
fn those_in_the_queue_follow_one_another_and_go_with_one_that_fails() {
    let mut world = armed();
    let request = |goal: f64| shoulder(vec![smooth(0.3, &[goal])]);
    let queued = |goal| FollowTrajectory { begin: Begin::Queued, ..request(goal) };
    let first = follow(&mut world, queued(0.3));
    let second = follow(&mut world, queued(-0.3));
    let third = follow(&mut world, queued(0.0));
    run(&mut world, 0.4);
    assert_eq!(ended(&mut world), [(first, TrajectoryEnd::Succeeded, 300)]);
    run(&mut world, 0.25);
    assert_eq!(ended(&mut world), [(second, TrajectoryEnd::Succeeded, 600)]);
    world.apply(&Command::CancelTrajectory { robot: "arm".into(), id: Some(third) }).unwrap();
    ends(&mut world);
    let first = follow(&mut world, request(0.3));
    let second = follow(&mut world, queued(0.0));
    world.apply(&Command::CancelTrajectory { robot: "arm".into(), id: Some(first) }).unwrap();
    let expected = [(first, cancelled("a request")), (second, cancelled("the end of the one before it"))];
    assert_eq!(ends(&mut world), expected);
}

#[test]
fn whatever_else_drives_or_moves_a_joint_ends_it() {
    let begun = || {
        let mut world = armed();
        let id = follow(&mut world, both(vec![smooth(1.0, &[0.8, -1.2])]));
        run(&mut world, 0.5);
        (world, id)
    };
    let (mut world, id) = begun();
    set(&mut world, position(0.0)).unwrap();
    assert_eq!(ends(&mut world), [(id, TrajectoryEnd::Superseded)]);
    assert_eq!(look(&world).modes, [Mode::Position, Mode::Hold]);

    let (mut world, id) = begun();
    let joints = vec![JointReset {
        joint: "elbow".into(),
        axis: 0,
        position: 0.5,
        velocity: 0.0,
        ..Default::default()
    }];
    world.apply(&Command::ResetJoints { robots: vec![RobotReset { robot: "arm".into(), joints }] }).unwrap();
    assert_eq!(ends(&mut world), [(id, cancelled("a reset of the joints"))]);
    assert!((run(&mut world, 1.0).positions[1] - 0.5).abs() < 2e-3, "it stays where it was put");

    let (mut world, id) = begun();
    world.apply(&Command::Reset(ResetScope { state: true, ..ResetScope::default() })).unwrap();
    assert_eq!(ends(&mut world), [(id, cancelled("a reset"))]);
    assert!(run(&mut world, 1.0).positions[0].abs() < 2e-3);

    let (mut world, id) = begun();
    world.apply(&Command::Reset(ResetScope { time: true, ..ResetScope::default() })).unwrap();
    run(&mut world, 0.6);
    assert_eq!(ended(&mut world), [(id, TrajectoryEnd::Succeeded, 500)], "it has a time of its own");

    let (mut world, id) = begun();
    world.apply(&Command::Delete { robot: "arm".into() }).unwrap();
    assert_eq!(ends(&mut world), [(id, cancelled("the end of the robot"))]);

    // With another time step it continues, and a teleport of the base does not affect it.
    let (mut world, id) = begun();
    let change = PhysicsChange { time_step: Some(2e-3), ..PhysicsChange::default() };
    world.apply(&Command::SetPhysics(change)).unwrap();
    let pose = Some(DPose3::from_translation(DVec3::X));
    world.apply(&Command::SetEntityState { robot: "arm".into(), pose, twist: None }).unwrap();
    run(&mut world, 0.5);
    assert_eq!(ended(&mut world), [(id, TrajectoryEnd::Succeeded, 750)]);
}

#[test]
fn a_claim_keeps_others_from_its_joints_and_ends_what_they_carry_out_with_it() {
    let mut world = armed();
    let claim = ClaimRequest {
        claim: ClaimId(1),
        holder: "planner".into(),
        joints: vec![JointSelection { robot: "arm".into(), joints: vec!["elbow".into()] }],
        ..ClaimRequest::default()
    };
    world.apply(&Command::Claim(claim)).unwrap();
    let request = Command::FollowTrajectory(both(vec![smooth(1.0, &[0.8, -1.2])]));
    assert!(matches!(world.apply(&request), Err(Error::JointClaimed { .. })));
    let Reply::TrajectoryAccepted { id } = world.apply_for(&request, Some(ClaimId(1))).unwrap().reply else {
        panic!("it is accepted");
    };
    let cancel = Command::CancelTrajectory { robot: "arm".into(), id: None };
    assert!(matches!(world.apply(&cancel), Err(Error::JointClaimed { .. })));
    // Any client may command the shoulder: a target of it ends the whole trajectory.
    run(&mut world, 0.2);
    world.apply(&Command::Release { claim: ClaimId(1), cause: ReleaseCause::Lapsed }).unwrap();
    assert_eq!(ends(&mut world), [(id, cancelled("the end of a claim"))]);
    assert_eq!(look(&world).modes, [Mode::Hold, Mode::Hold]);
}

#[test]
fn a_state_in_the_middle_continues_to_the_bit() {
    let mut world = armed();
    follow(&mut world, both(vec![smooth(0.6, &[0.8, -1.2]), point(1.0, &[0.0, 0.0])]));
    follow(&mut world, FollowTrajectory { begin: Begin::Queued, ..shoulder(vec![smooth(0.3, &[0.4])]) });
    follow(&mut world, FollowTrajectory { begin: Begin::After(0.9), ..shoulder(vec![point(0.3, &[0.4])]) });
    run(&mut world, 0.3);
    world.apply(&Command::SaveState { name: "middle".into() }).unwrap();
    let on = |world: &mut Simulation| -> Vec<u64> {
        (0..1500)
            .map(|_| {
                world.step();
                world.fingerprint()
            })
            .collect()
    };
    ends(&mut world);
    let first = (on(&mut world), ends(&mut world));
    world.apply(&Command::RestoreState { name: "middle".into() }).unwrap();
    world.take_events();
    assert!((on(&mut world), ends(&mut world)) == first);
}

#[test]
fn one_that_a_restored_state_does_not_have_is_reported_to_have_ended() {
    let mut world = armed();
    world.apply(&Command::SaveState { name: "before".into() }).unwrap();
    let id = follow(&mut world, both(vec![smooth(1.0, &[0.8, -1.2])]));
    run(&mut world, 0.5);
    world.apply(&Command::RestoreState { name: "before".into() }).unwrap();
    assert_eq!(ends(&mut world), [(id, cancelled("a state that was restored"))]);
    let id = follow(&mut world, both(vec![smooth(1.0, &[0.8, -1.2])]));
    world.apply(&Command::Reset(ResetScope { spawned: true, ..ResetScope::default() })).unwrap();
    assert_eq!(ends(&mut world), [(id, cancelled("the end of the robot"))]);
}

#[test]
fn invalid_trajectories_are_refused_as_a_whole_with_the_field() {
    let mut world = armed();
    let fingerprint = world.fingerprint();
    let mut refused = |request: FollowTrajectory, part: &str| {
        let error = world.apply(&Command::FollowTrajectory(request)).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    };
    refused(both(Vec::new()), "points[0]");
    refused(both(vec![point(0.5, &[0.0])]), "point 0 has 1 positions; there are 2 joints");
    refused(both(vec![point(f64::NAN, &[0.0, 0.0])]), "the time of point 0");
    refused(both(vec![point(1.0, &[0.0, 0.0]), point(1.0, &[0.0, 0.0])]), "the time of point 1");
    refused(both(vec![point(1.0, &[0.0, f64::INFINITY])]), "among its positions");
    refused(FollowTrajectory { joints: Vec::new(), ..both(vec![point(1.0, &[])]) }, "joints is empty");
    refused(
        shoulder(vec![TrajectoryPoint { velocities: vec![0.0; 2], ..point(1.0, &[0.0]) }]),
        "2 velocities",
    );
    let twice = FollowTrajectory { joints: vec!["elbow".into(); 2], ..both(vec![point(1.0, &[0.0, 0.0])]) };
    refused(twice, "named once");
    refused(FollowTrajectory { robot: "ghost".into(), ..both(vec![point(1.0, &[0.0, 0.0])]) }, "ghost");
    refused(FollowTrajectory { joints: vec!["knee".into()], ..both(vec![point(1.0, &[0.0])]) }, "knee");
    refused(
        FollowTrajectory { begin: Begin::After(-1.0), ..shoulder(vec![point(1.0, &[0.0])]) },
        "delay is -1",
    );
    refused(
        FollowTrajectory { goal_time_tolerance: Some(f64::NAN), ..shoulder(vec![point(1.0, &[0.0])]) },
        "goal_time_tolerance",
    );
    let negative = Tolerance { position: Some(-1.0), velocity: None };
    refused(
        FollowTrajectory { tolerances: vec![[negative; 2]], ..shoulder(vec![point(1.0, &[0.0])]) },
        "tolerances[0].path.position",
    );
    assert_eq!(world.fingerprint(), fingerprint);
    // The maximum number, and no more.
    for _ in 0..16 {
        follow(&mut world, FollowTrajectory { begin: Begin::Queued, ..shoulder(vec![point(9.0, &[0.0])]) });
    }
    let more = Command::FollowTrajectory(shoulder(vec![point(1.0, &[0.0])]));
    assert!(matches!(world.apply(&more), Err(Error::LimitExceeded { limit: 16, .. })));
}

//! Constraints between links, as clients make, change, read and delete them.

use simd_client::proto::{self, ConstraintDeletionCause, ConstraintKind, ErrorReason, event::Kind};
use simd_client::{Client, Target, every_joint};
use simd_tests::daemon::{Daemon, Via, fixed};
use simd_tests::robots::assets;

use crate::{arm, over_every_transport, set};

async fn ball(client: &Client, name: &str, x: f64) {
    let geometry = proto::primitive::Geometry::Sphere(proto::SphereGeometry { radius: 0.1 });
    let primitive = proto::Primitive { geometry: Some(geometry), mass: 1.0, color: None };
    let source = proto::DescriptionSource {
        source: Some(proto::description_source::Source::Primitive(primitive)),
        ..Default::default()
    };
    let request = proto::SpawnEntityRequest {
        source: Some(source),
        name: name.into(),
        pose: Some(at(x)),
        base: proto::Base::Free.into(),
        ..Default::default()
    };
    client.spawn(request).await.unwrap();
}

fn at(x: f64) -> proto::Pose {
    proto::Pose { position: Some(proto::Vector3 { x, y: 0.0, z: 1.0 }), orientation: None }
}

fn end(robot: &str) -> Option<proto::ConstraintEnd> {
    Some(proto::ConstraintEnd { robot: robot.into(), ..Default::default() })
}

fn weld(name: &str, parent: &str, child: &str) -> proto::CreateConstraintRequest {
    proto::CreateConstraintRequest {
        name: name.into(),
        kind: ConstraintKind::Weld.into(),
        parent: end(parent),
        child: end(child),
        ..Default::default()
    }
}

async fn a_constraint_is_made_read_changed_and_deleted(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let client = &daemon.client;
    ball(client, "left", 0.0).await;
    ball(client, "right", 0.5).await;
    let first = proto::CreateConstraintRequest {
        parent: Some(proto::ConstraintEnd { pose: Some(at(0.0)), ..Default::default() }),
        ..weld("", "", "left")
    };
    assert_eq!(client.create_constraint(first).await.unwrap(), "constraint_1");
    assert_eq!(client.create_constraint(weld("pair", "left", "right")).await.unwrap(), "pair");
    client.step(500).await.unwrap();
    let all = client.constraints(None).await.unwrap();
    assert_eq!(all.iter().map(|of| of.name.as_str()).collect::<Vec<_>>(), ["constraint_1", "pair"]);
    // The first one carries both, and the second one the right body at its arm.
    let (g, force) = (9.81, |of: &proto::Constraint| of.force.unwrap().z);
    assert!((force(&all[0]) - 2.0 * g).abs() < 1e-4 && (force(&all[1]) - g).abs() < 1e-4, "{all:?}");
    assert!(all.iter().all(|of| of.position_error < 1e-6 && of.max_force.is_none() && !of.saturated));
    assert_eq!(client.constraints(Some("right")).await.unwrap().len(), 1);
    let change = proto::ChangeConstraintRequest {
        name: "pair".into(),
        max_force: Some(1.0),
        max_torque: Some(1.0),
        ..Default::default()
    };
    client.change_constraint(change).await.unwrap();
    client.step(1).await.unwrap();
    let pair = client.constraints(Some("right")).await.unwrap().remove(0);
    assert!(pair.saturated && pair.max_force == Some(1.0), "{pair:?}");
    client.delete_constraint("constraint_1").await.unwrap();
    assert_eq!(client.constraints(None).await.unwrap().len(), 1);
    client.delete_robot("right").await.unwrap();
    assert!(client.constraints(None).await.unwrap().is_empty());
    let events = client.next_events(0, std::time::Duration::ZERO).await.unwrap().events;
    let gone = events.into_iter().filter_map(|event| match event.kind {
        Some(Kind::ConstraintDeleted(it)) => Some((it.cause(), it.constraint)),
        _ => None,
    });
    let expected =
        [(ConstraintDeletionCause::Deleted, "constraint_1"), (ConstraintDeletionCause::RobotDeleted, "pair")];
    assert_eq!(gone.collect::<Vec<_>>(), expected.map(|(cause, name)| (cause, name.to_owned())));
}

/// A ball that the world holds at its middle, or from half a metre above, by each of the other kinds in turn.
async fn each_kind_is_listed_with_its_force_changed_and_deleted(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let client = &daemon.client;
    let world = |z: f64| {
        let position = Some(proto::Vector3 { x: 0.0, y: 0.0, z });
        let pose = Some(proto::Pose { position, orientation: None });
        Some(proto::ConstraintEnd { pose, ..Default::default() })
    };
    let of = |kind: ConstraintKind| proto::CreateConstraintRequest {
        kind: kind.into(),
        parent: world(1.0),
        ..weld("held", "", "ball")
    };
    let axis = Some(proto::Vector3 { x: 1.0, y: 0.0, z: 0.0 });
    let rod = proto::CreateConstraintRequest { parent: world(1.5), ..of(ConstraintKind::Distance) };
    let rope = proto::CreateConstraintRequest { rope: true, ..rod.clone() };
    for request in [
        proto::CreateConstraintRequest { axis, ..of(ConstraintKind::Hinge) },
        proto::CreateConstraintRequest { axis, ..of(ConstraintKind::Slide) },
        of(ConstraintKind::PointToPoint),
        rod,
        rope,
    ] {
        let (g, is_distance) = (9.81, request.kind() == ConstraintKind::Distance);
        let held = async || client.constraints(Some("ball")).await.unwrap().remove(0);
        ball(client, "ball", 0.0).await;
        assert_eq!(client.create_constraint(request.clone()).await.unwrap(), "held");
        client.step(500).await.unwrap();
        let first = held().await;
        assert_eq!((first.kind, first.axis, first.rope), (request.kind, request.axis, request.rope));
        assert_eq!(first.length, is_distance.then_some(0.5));
        assert!((first.force.unwrap().z - g).abs() < 1e-4 && first.position_error < 1e-6, "{first:?}");

        // Two centimetres lower: a rope lets it fall and catches it.
        let change = proto::ChangeConstraintRequest { name: "held".into(), ..Default::default() };
        let down = match is_distance {
            true => proto::ChangeConstraintRequest { length: Some(0.52), ..change.clone() },
            false => proto::ChangeConstraintRequest {
                parent_pose: world(0.98).and_then(|end| end.pose),
                ..change.clone()
            },
        };
        client.change_constraint(down).await.unwrap();
        client.step(500).await.unwrap();
        let pose = client.robot_state("ball").await.unwrap().pose.unwrap();
        assert!((pose.position.unwrap().z - 0.98).abs() < 1e-5, "{request:?}: {pose:?}");
        let moved = held().await;
        assert_eq!(moved.length, is_distance.then_some(0.52));
        assert!((moved.force.unwrap().z - g).abs() < 1e-4 && moved.position_error < 1e-6, "{moved:?}");

        let weak = proto::ChangeConstraintRequest { max_force: Some(5.0), ..change };
        client.change_constraint(weak).await.unwrap();
        client.step(1).await.unwrap();
        let saturated = held().await;
        assert!(saturated.saturated && saturated.max_force == Some(5.0), "{saturated:?}");
        assert!((saturated.force.unwrap().z - 5.0).abs() < 1e-6, "{saturated:?}");
        client.delete_constraint("held").await.unwrap();
        assert!(client.constraints(None).await.unwrap().is_empty());
        client.delete_robot("ball").await.unwrap();
    }
}

async fn invalid_values_are_refused_by_their_field(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let client = &daemon.client;
    ball(client, "left", 0.0).await;
    ball(client, "right", 0.5).await;
    let unspecified = proto::CreateConstraintRequest { kind: 0, ..weld("", "left", "right") };
    let slack = proto::CreateConstraintRequest { rope: true, ..weld("", "left", "right") };
    let negative = proto::CreateConstraintRequest { max_force: Some(-1.0), ..weld("", "left", "right") };
    for (request, part) in [
        (unspecified, "kind"),
        (slack, "rope"),
        (negative, "max_force"),
        (weld("", "left", "left"), "child.link"),
    ] {
        let refused = client.create_constraint(request).await.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::InvalidValue), "{refused}");
        assert!(refused.to_string().contains(part), "{refused}");
    }
    client.create_constraint(weld("one", "left", "right")).await.unwrap();
    let again = client.create_constraint(weld("one", "left", "right")).await.unwrap_err();
    assert_eq!(again.reason(), Some(ErrorReason::ConstraintExists));
    let unknown = client.delete_constraint("two").await.unwrap_err();
    assert_eq!(unknown.reason(), Some(ErrorReason::ConstraintNotFound));
    let missing = client.create_constraint(weld("", "left", "missing")).await.unwrap_err();
    assert_eq!(missing.reason(), Some(ErrorReason::RobotNotFound));
}

async fn a_gear_is_between_joints_and_goes_into_files(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let client = &daemon.client;
    for name in ["left", "right"] {
        client.load(assets().join("seven_arm"), fixed(name)).await.unwrap();
    }
    let joints = client.joint_layout("left").await.unwrap().joints;
    let joint = joints.iter().find(|joint| joint.position_count == 1).unwrap().name.clone();
    let end = |robot: &str| {
        Some(proto::ConstraintEnd { robot: robot.into(), joint: joint.clone(), ..Default::default() })
    };
    let gear = proto::CreateConstraintRequest {
        name: "gear".into(),
        kind: ConstraintKind::Gear.into(),
        parent: end("left"),
        child: end("right"),
        ratio: Some(-2.0),
        ..Default::default()
    };
    client.create_constraint(gear).await.unwrap();
    client.step(10).await.unwrap();
    let before = client.constraints(None).await.unwrap();
    assert_eq!((before[0].ratio, before[0].child.as_ref().unwrap().joint.clone()), (Some(-2.0), joint));
    let file = tempfile::tempdir().unwrap();
    let path = file.path().join("here.simd");
    client.save_state("here").await.unwrap();
    client.export_saved_state("here", &path).await.unwrap();
    client.delete_constraint("gear").await.unwrap();
    client.import_saved_state(&path, "there").await.unwrap();
    client.restore_state("there").await.unwrap();
    assert_eq!(client.constraints(None).await.unwrap(), before);
}

/// Between the shoulders of two arms: the first is driven, and the second hangs on the gear only.
async fn a_gear_is_changed_breaks_and_is_deleted(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    let beside = proto::Pose { position: Some(proto::Vector3 { x: 0.0, y: 2.0, z: 0.0 }), orientation: None };
    let second = proto::SpawnEntityRequest {
        pose: Some(beside),
        initial_mode: proto::InitialMode::Passive.into(),
        ..fixed("second")
    };
    client.load(assets().join("Bench_Arm-1.2 rev B"), second).await.unwrap();
    let end = |robot: &str| {
        Some(proto::ConstraintEnd { robot: robot.into(), joint: "shoulder".into(), ..Default::default() })
    };
    let gear = proto::CreateConstraintRequest {
        name: "teeth".into(),
        kind: ConstraintKind::Gear.into(),
        parent: end("arm"),
        child: end("second"),
        ratio: Some(-2.0),
        offset: Some(0.0),
        ..Default::default()
    };
    let read = async || client.constraints(Some("second")).await.unwrap().remove(0);
    let positions = async || {
        let robots = vec![every_joint("arm"), every_joint("second")];
        let states = client.joint_states(robots).await.unwrap();
        [states.robots[0].position[0], states.robots[1].position[0]]
    };
    // The arm's mass, kg; the distance of its centre of mass from the axis, m; the joint's zero against the
    // horizontal, rad.
    let weight = |position: f64| 0.19992 * 9.81 * 0.16597 * (position - 0.039919).cos();
    assert_eq!(client.create_constraint(gear.clone()).await.unwrap(), "teeth");
    set(&daemon, Target::position(0.2)).await;
    client.step(3_000).await.unwrap();
    let (made, [parent, child]) = (read().await, positions().await);
    assert_eq!((made.kind(), made.ratio, made.offset), (ConstraintKind::Gear, Some(-2.0), Some(0.0)));
    assert!(parent > 0.1 && (child + 2.0 * parent).abs() < 1e-6, "{parent} {child}");
    assert!((made.torque.unwrap().y + weight(child)).abs() < 1e-3, "{made:?}");

    let change = proto::ChangeConstraintRequest { name: "teeth".into(), ..Default::default() };
    let other = proto::ChangeConstraintRequest { ratio: Some(1.5), offset: Some(0.1), ..change.clone() };
    client.change_constraint(other).await.unwrap();
    client.step(3_000).await.unwrap();
    let (changed, [parent, child]) = (read().await, positions().await);
    assert_eq!((changed.ratio, changed.offset), (Some(1.5), Some(0.1)));
    assert!(parent > 0.1 && (child - 1.5 * parent - 0.1).abs() < 1e-6, "{parent} {child}");
    assert!((changed.torque.unwrap().y + weight(child)).abs() < 1e-3, "{changed:?}");
    let long = proto::ChangeConstraintRequest { length: Some(1.0), ratio: Some(3.0), ..change.clone() };
    let refused = client.change_constraint(long).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::InvalidValue), "{refused}");
    assert_eq!(read().await.ratio, Some(1.5), "all or nothing");

    // It would need three times as much.
    let weak = proto::ChangeConstraintRequest { max_force: Some(0.1), ..change.clone() };
    client.change_constraint(weak).await.unwrap();
    client.step(1).await.unwrap();
    let saturated = read().await;
    assert!(saturated.saturated && saturated.max_force == Some(0.1), "{saturated:?}");
    assert!((saturated.torque.unwrap().y + 0.1).abs() < 1e-6, "{saturated:?}");
    client.change_constraint(proto::ChangeConstraintRequest { breaks: Some(true), ..change }).await.unwrap();
    client.step(1).await.unwrap();
    assert!(client.constraints(None).await.unwrap().is_empty());

    let [parent, child] = positions().await;
    client.create_constraint(proto::CreateConstraintRequest { offset: None, ..gear }).await.unwrap();
    let offset = read().await.offset.unwrap();
    assert!((offset - child - 2.0 * parent).abs() < 1e-12, "as the joints are: {offset}");
    client.delete_constraint("teeth").await.unwrap();
    assert!(client.constraints(None).await.unwrap().is_empty());
    client.step(300).await.unwrap();
    let [parent, child] = positions().await;
    assert!((child + 2.0 * parent - offset).abs() > 0.1, "the second arm falls: {parent} {child}");
    let events = client.next_events(0, std::time::Duration::ZERO).await.unwrap().events;
    let causes = events.into_iter().filter_map(|event| match event.kind {
        Some(Kind::ConstraintDeleted(it)) => Some(it.cause()),
        _ => None,
    });
    let expected = [ConstraintDeletionCause::Broke, ConstraintDeletionCause::Deleted];
    assert_eq!(causes.collect::<Vec<_>>(), expected);
}

over_every_transport! {
    a_constraint_is_made_read_changed_and_deleted,
    each_kind_is_listed_with_its_force_changed_and_deleted,
    invalid_values_are_refused_by_their_field,
    a_gear_is_between_joints_and_goes_into_files,
    a_gear_is_changed_breaks_and_is_deleted,
}

//! If a contact keeps a joint from its target, its state, its layout and an event name the same link, over
//! every transport.

use std::time::Duration;

use simd_client::proto::event::Kind;
use simd_client::proto::{self, Base, SpawnEntityRequest};
use simd_client::{Target, every_joint};
use simd_tests::daemon::{Daemon, Via};
use simd_world::handle::RunState;

use crate::{load_arm, over_every_transport, set};

over_every_transport! {
    a_blocking_link_is_named_until_it_is_gone,
}

async fn a_blocking_link_is_named_until_it_is_gone(via: Via) {
    let daemon = Daemon::start_via(via, |config| config.driver.state = RunState::Paused).await;
    let client = &daemon.client;
    load_arm(client, "arm").await;
    let size = Some(proto::Vector3 { x: 2.0, y: 2.0, z: 0.1 });
    let geometry = Some(proto::primitive::Geometry::Box(proto::BoxGeometry { size }));
    let primitive = proto::Primitive { geometry, mass: 0.0, color: None };
    let source = proto::description_source::Source::Primitive(primitive);
    let position = Some(proto::Vector3 { x: 0.0, y: 0.0, z: -0.15 });
    let request = SpawnEntityRequest {
        source: Some(proto::DescriptionSource { source: Some(source), ..Default::default() }),
        name: "floor".into(),
        base: Base::Fixed.into(),
        pose: Some(proto::Pose { position, ..Default::default() }),
        ..Default::default()
    };
    client.spawn(request).await.unwrap();
    set(&daemon, Target::position(1.5)).await;
    daemon.pass(3.0).await;
    let states = client.joint_states(vec![every_joint("arm")]).await.unwrap();
    let [blocked] = &states.robots[0].obstructions[..] else { panic!("{states:?}") };
    let named = [&blocked.joint, &blocked.link, &blocked.by_robot, &blocked.by_link];
    assert_eq!(named, ["shoulder", "arm", "floor", ""], "a floor has one link");
    assert!(blocked.effort < 0.0, "{blocked:?}");
    let layout = client.joint_layout("arm").await.unwrap();
    assert_eq!(layout.joints[0].obstruction.as_ref().map(|of| of.by_robot.as_str()), Some("floor"));
    let events = client.next_events(0, Duration::ZERO).await.unwrap().events;
    let reported = events.iter().filter(|event| match &event.kind {
        Some(Kind::JointBlocked(of)) => (of.robot.as_str(), of.by_robot.as_str()) == ("arm", "floor"),
        _ => false,
    });
    assert_eq!(reported.count(), 1, "once, however long it lasts");
    client.delete_robot("floor").await.unwrap();
    daemon.pass(3.0).await;
    let states = client.joint_states(vec![every_joint("arm")]).await.unwrap();
    assert!(states.robots[0].obstructions.is_empty(), "{states:?}");
}

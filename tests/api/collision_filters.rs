//! Collision filters of a robot, as clients set and read them.

use simd_client::proto::{self, PairCollision};
use simd_client::{Client, Package};
use simd_tests::daemon::{Daemon, Via, fixed};
use simd_tests::robots::assets;

use crate::over_every_transport;

fn pair(link: &str, other_robot: &str, other_link: &str, collision: PairCollision) -> proto::CollisionPair {
    proto::CollisionPair {
        link: link.into(),
        other_robot: other_robot.into(),
        other_link: other_link.into(),
        collision: collision.into(),
    }
}

fn change(robot: &str, pairs: Vec<proto::CollisionPair>) -> proto::SetCollisionFilterRequest {
    proto::SetCollisionFilterRequest { robot: robot.into(), pairs, ..Default::default() }
}

async fn shape(client: &Client, name: &str, geometry: proto::primitive::Geometry, z: f64) {
    let primitive = proto::Primitive { geometry: Some(geometry), mass: 0.0, color: None };
    let source = proto::DescriptionSource {
        source: Some(proto::description_source::Source::Primitive(primitive)),
        ..Default::default()
    };
    let position = Some(proto::Vector3 { x: 0.0, y: 0.0, z });
    let request = proto::SpawnEntityRequest {
        source: Some(source),
        name: name.into(),
        pose: Some(proto::Pose { position, orientation: None }),
        base: if name == "ground" { proto::Base::Fixed } else { proto::Base::Free }.into(),
        ..Default::default()
    };
    client.spawn(request).await.unwrap();
}

/// Returns a ball of 0.1 m on the ground.
async fn ball_on_ground(via: Via) -> Daemon {
    let daemon = Daemon::paused_via(via).await;
    shape(&daemon.client, "ground", proto::primitive::Geometry::Plane(Default::default()), 0.0).await;
    let ball = proto::primitive::Geometry::Sphere(proto::SphereGeometry { radius: 0.1 });
    shape(&daemon.client, "ball", ball, 0.1).await;
    daemon
}

async fn height(client: &Client) -> f64 {
    client.robot_state("ball").await.unwrap().pose.unwrap().position.unwrap().z
}

async fn a_robot_stays_awake_as_long_as_it_is_asked_to(via: Via) {
    let daemon = ball_on_ground(via).await;
    let client = &daemon.client;
    assert!(!client.stays_awake("ball").await.unwrap());
    client.set_stays_awake("ball", true).await.unwrap();
    assert!(client.stays_awake("ball").await.unwrap() && !client.stays_awake("ground").await.unwrap());
    client.reset(Default::default()).await.unwrap();
    assert!(client.stays_awake("ball").await.unwrap(), "a reset leaves settings");
    client.set_stays_awake("ball", false).await.unwrap();
    assert!(!client.stays_awake("ball").await.unwrap());
    let refused = client.set_stays_awake("none", true).await.unwrap_err();
    assert!(refused.to_string().contains("none"), "{refused}");
}

async fn a_pair_that_is_switched_off_falls_through_and_is_read_back(via: Via) {
    let daemon = ball_on_ground(via).await;
    let client = &daemon.client;
    client.step(10).await.unwrap();
    assert!(height(client).await > 0.0999);
    let off = vec![pair("link", "ground", "link", PairCollision::Disabled)];
    client.set_collision_filter(change("ball", off.clone())).await.unwrap();
    let seen = client.collision_filter("ball").await.unwrap();
    assert_eq!((seen.pairs, seen.self_collision), (off, false));
    let of_ground = client.collision_filter("ground").await.unwrap().pairs;
    assert_eq!(
        of_ground,
        [pair("link", "ball", "link", PairCollision::Disabled)],
        "the other side sees it too"
    );
    client.step(200).await.unwrap();
    assert!(height(client).await < 0.0);
    let default = vec![pair("link", "ground", "link", PairCollision::Default)];
    client.set_collision_filter(change("ball", default)).await.unwrap();
    assert!(client.collision_filter("ball").await.unwrap().pairs.is_empty());
}

async fn groups_are_set_and_read_with_the_surfaces(via: Via) {
    let daemon = ball_on_ground(via).await;
    let client = &daemon.client;
    let before = client.link_properties("ball").await.unwrap();
    assert_eq!((before[0].collision_group, before[0].collision_mask), (Some(1), Some(u32::MAX)));
    let groups = proto::LinkProperties {
        link: "link".into(),
        collision_group: Some(0),
        collision_mask: Some(0),
        ..Default::default()
    };
    client.set_link_properties("ball", vec![groups]).await.unwrap();
    let after = client.link_properties("ball").await.unwrap();
    assert_eq!((after[0].collision_group, after[0].collision_mask), (Some(0), Some(0)));
    assert_eq!(after[0].friction, before[0].friction);
    client.step(200).await.unwrap();
    assert!(height(client).await < 0.0, "it is in no group and touches none");
}

async fn an_srdf_beside_the_urdf_switches_pairs_off_and_its_mistakes_are_reported(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let package = Package::open(assets().join("seven_arm")).unwrap();
    let source = Some(daemon.client.upload(&package).await.unwrap());
    let srdf = "<robot name='seven_arm'>\n<disable_collisions link1='link_1' link2='link_3' reason='Never'/>\n\
                <disable_collisions link1='link_1' link2='hook' reason='Never'/>\n</robot>";
    let request = proto::SpawnEntityRequest {
        source: source.clone(),
        srdf: srdf.into(),
        self_collision: true,
        collision_pairs: vec![pair("link_2", "", "link_4", PairCollision::Enabled)],
        ..fixed("arm")
    };
    let spawned = daemon.client.spawn(request.clone()).await.unwrap();
    let finding = spawned.report.findings.iter().find(|finding| finding.message.contains("hook")).unwrap();
    assert_eq!(finding.message, "the robot has no link \"hook\"; left out");
    assert_eq!((finding.element.as_str(), finding.line), ("SRDF disable_collisions", 3));
    let filter = daemon.client.collision_filter("arm").await.unwrap();
    let expected = [
        pair("link_1", "", "link_3", PairCollision::Disabled),
        pair("link_2", "", "link_4", PairCollision::Enabled),
    ];
    assert!(filter.self_collision);
    assert_eq!(filter.pairs, expected);

    let strict = proto::SpawnEntityRequest { strict: true, name: "strict".into(), ..request.clone() };
    let refused = daemon.client.spawn(strict).await.unwrap_err();
    assert_eq!(refused.reason(), Some(proto::ErrorReason::InvalidDescription), "{refused}");
    assert!(refused.to_string().contains("hook"), "{refused}");
    let other = vec![pair("link_1", "ground", "link", PairCollision::Disabled)];
    let other = proto::SpawnEntityRequest { collision_pairs: other, name: "other".into(), ..request };
    let refused = daemon.client.spawn(other).await.unwrap_err().to_string();
    assert!(refused.contains("collision_pairs[0].other_robot"), "{refused}");
}

async fn faults_are_named_by_their_path(via: Via) {
    let daemon = ball_on_ground(via).await;
    let client = &daemon.client;
    let refusal = async |pairs| client.set_collision_filter(change("ball", pairs)).await.unwrap_err();
    let nothing = refusal(vec![pair("link", "ground", "link", PairCollision::Unspecified)]).await;
    assert!(nothing.to_string().contains("pairs[0].collision"), "{nothing}");
    let lid = refusal(vec![pair("lid", "ground", "link", PairCollision::Disabled)]).await;
    assert_eq!(lid.reason(), Some(proto::ErrorReason::LinkNotFound));
    let moon = refusal(vec![pair("link", "moon", "link", PairCollision::Disabled)]).await;
    assert_eq!(moon.reason(), Some(proto::ErrorReason::RobotNotFound));
    let many = vec![pair("link", "ground", "link", PairCollision::Disabled); 3];
    client.set_collision_filter(change("ball", many)).await.unwrap();
    assert_eq!(
        client.collision_filter("ball").await.unwrap().pairs.len(),
        1,
        "the same pair again and again"
    );
}

over_every_transport! {
    a_robot_stays_awake_as_long_as_it_is_asked_to,
    a_pair_that_is_switched_off_falls_through_and_is_read_back,
    groups_are_set_and_read_with_the_surfaces,
    an_srdf_beside_the_urdf_switches_pairs_off_and_its_mistakes_are_reported,
    faults_are_named_by_their_path,
}

//! Distances, overlaps, bounds, casts and many rays, as clients ask for them.

use simd_client::proto::{self, ErrorReason};
use simd_client::{Client, ray};
use simd_tests::daemon::{Daemon, Via, fixed};
use simd_tests::robots::assets;

use crate::over_every_transport;

fn at(x: f64, z: f64) -> Option<proto::Pose> {
    Some(proto::Pose { position: Some(proto::Vector3 { x, y: 0.0, z }), orientation: None })
}

async fn shape(client: &Client, name: &str, geometry: proto::primitive::Geometry, x: f64, z: f64) {
    let primitive = proto::Primitive { geometry: Some(geometry), mass: 0.0, color: None };
    let source = proto::DescriptionSource {
        source: Some(proto::description_source::Source::Primitive(primitive)),
        ..Default::default()
    };
    let base = proto::Base::Fixed.into();
    let request = proto::SpawnEntityRequest {
        source: Some(source),
        name: name.into(),
        pose: at(x, z),
        base,
        ..Default::default()
    };
    client.spawn(request).await.unwrap();
}

/// Returns the ground, and two balls of 0.1 m, 1 m above it and 1 m apart.
async fn balls(via: Via) -> Daemon {
    let daemon = Daemon::paused_via(via).await;
    let client = &daemon.client;
    shape(client, "ground", proto::primitive::Geometry::Plane(Default::default()), 0.0, 0.0).await;
    for (name, x) in [("left", 0.0), ("right", 1.0)] {
        let ball = proto::primitive::Geometry::Sphere(proto::SphereGeometry { radius: 0.1 });
        shape(client, name, ball, x, 1.0).await;
    }
    daemon
}

fn body(robot: &str) -> Option<proto::QueryBody> {
    Some(proto::QueryBody { robot: robot.into(), ..Default::default() })
}

fn sphere(radius: f64) -> Option<proto::QueryShape> {
    let geometry = Some(proto::query_shape::Geometry::Sphere(proto::SphereGeometry { radius }));
    Some(proto::QueryShape { geometry })
}

async fn links_are_measured_where_robots_are_and_would_be(via: Via) {
    let daemon = balls(via).await;
    let client = &daemon.client;
    let request = proto::GetClosestPointsRequest { a: body("left"), b: body("right"), ..Default::default() };
    let found = client.closest_points(request.clone()).await.unwrap();
    assert_eq!((found.len(), found[0].robot_a.as_str(), found[0].link_b.as_str()), (1, "left", "link"));
    assert!((found[0].distance - 0.8).abs() < 1e-12, "{found:?}");
    assert_eq!(found[0].normal, Some(proto::Vector3 { x: 1.0, y: 0.0, z: 0.0 }));
    let all = proto::GetClosestPointsRequest { b: None, ..request.clone() };
    assert_eq!(client.closest_points(all.clone()).await.unwrap().len(), 2);
    let near = proto::GetClosestPointsRequest { max_distance: Some(0.85), ..all.clone() };
    assert_eq!(client.closest_points(near).await.unwrap().len(), 1);

    // The arm would reach down to the ground.
    client.load(assets().join("seven_arm"), fixed("arm")).await.unwrap();
    let layout = client.joint_layout("arm").await.unwrap();
    let positions: Vec<f64> =
        layout.joints.iter().flat_map(|joint| vec![0.3; joint.position_count as usize]).collect();
    let lying = proto::Configuration { positions, root: at(0.0, -5.0), ..Default::default() };
    let arm = proto::QueryBody { configuration: Some(lying), ..body("arm").unwrap() };
    let below = proto::GetClosestPointsRequest {
        a: Some(arm.clone()),
        b: body("ground"),
        nearest_only: true,
        ..Default::default()
    };
    let below = client.closest_points(below).await.unwrap();
    assert!(below.len() == 1 && below[0].distance < -4.0, "{below:?}");

    let wrong = proto::Configuration { positions: vec![0.0], ..Default::default() };
    let arm = proto::QueryBody { configuration: Some(wrong), ..arm };
    let refused = client.closest_points(proto::GetClosestPointsRequest { a: Some(arm), ..all.clone() }).await;
    assert!(refused.unwrap_err().to_string().contains("a.configuration.positions"));
    for (a, reason) in [(body("moon"), ErrorReason::RobotNotFound), (None, ErrorReason::InvalidValue)] {
        let refused = client.closest_points(proto::GetClosestPointsRequest { a, ..all.clone() }).await;
        assert_eq!(refused.unwrap_err().reason(), Some(reason));
    }
    let lid = Some(proto::QueryBody { link: "lid".into(), ..body("left").unwrap() });
    let refused =
        client.closest_points(proto::GetClosestPointsRequest { a: lid, ..all.clone() }).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::LinkNotFound));
    let nan = proto::GetClosestPointsRequest { max_distance: Some(f64::NAN), ..all };
    assert!(client.closest_points(nan).await.unwrap_err().to_string().contains("max_distance"));
}

fn of_shape(radius: f64, x: f64, z: f64) -> Option<proto::QueryBody> {
    Some(proto::QueryBody { shape: sphere(radius), pose: at(x, z), ..Default::default() })
}

async fn shapes_of_no_robot_are_measured(via: Via) {
    let daemon = balls(via).await;
    let client = &daemon.client;
    let request = proto::GetClosestPointsRequest { a: of_shape(0.2, 3.0, 1.0), ..Default::default() };
    let to = |b| client.closest_points(proto::GetClosestPointsRequest { b, ..request.clone() });
    let found = to(body("right")).await.unwrap();
    let names = |found: &proto::ClosestPoints| {
        [&found.robot_a, &found.link_a, &found.robot_b, &found.link_b].map(String::clone)
    };
    assert_eq!(names(&found[0]), ["", "", "right", "link"]);
    assert!(found.len() == 1 && (found[0].distance - 1.7).abs() < 1e-12, "{found:?}");
    assert_eq!(found[0].normal, Some(proto::Vector3 { x: -1.0, y: 0.0, z: 0.0 }));
    // All robots, and another shape.
    let all = to(None).await.unwrap();
    let distances: Vec<f64> = all.iter().map(|pair| (pair.distance * 1e9).round() / 1e9).collect();
    assert_eq!(distances, [0.8, 2.7, 1.7]);
    let shapes = to(of_shape(0.1, 3.0, 2.0)).await.unwrap();
    assert_eq!(names(&shapes[0]), ["", "", "", ""]);
    assert!((shapes[0].distance - 0.7).abs() < 1e-12, "{shapes:?}");
    let away = proto::GetClosestPointsRequest { max_distance: Some(0.5), filtered: true, ..request.clone() };
    assert!(client.closest_points(away).await.unwrap().is_empty());
    let whole = body("left").unwrap();
    for (side, field) in [
        (proto::QueryBody { shape: sphere(0.1), ..whole.clone() }, "b.shape"),
        (proto::QueryBody { pose: at(0.0, 0.0), ..whole }, "b.pose"),
        (proto::QueryBody { shape: sphere(-1.0), ..Default::default() }, "b.shape"),
        (proto::QueryBody { shape: sphere(0.1), pose: at(f64::NAN, 0.0), ..Default::default() }, "b.pose"),
        (proto::QueryBody { shape: Some(proto::QueryShape::default()), ..Default::default() }, "b.shape"),
    ] {
        let refused = to(Some(side)).await.unwrap_err().to_string();
        assert!(refused.contains(field), "{refused}");
    }
}

async fn shapes_of_no_robot_overlap_and_are_cast(via: Via) {
    let daemon = balls(via).await;
    let client = &daemon.client;
    let request = proto::FindOverlapsRequest { shape: sphere(0.95), pose: at(0.0, 1.0), bounds_only: false };
    let links = client.overlaps(request).await.unwrap();
    assert_eq!(links.iter().map(|of| of.robot.as_str()).collect::<Vec<_>>(), ["left", "right"]);
    let large = proto::FindOverlapsRequest { shape: sphere(1.05), ..request };
    assert_eq!(client.overlaps(large).await.unwrap().len(), 3);
    let way = Some(proto::Vector3 { x: 0.0, y: 0.0, z: -2.0 });
    let cast = proto::CastShapeRequest { shape: sphere(0.1), pose: at(1.0, 2.2), translation: way };
    let hit = client.cast_shape(cast).await.unwrap();
    assert!(hit.hit && hit.robot == "right" && (hit.fraction - 0.5).abs() < 1e-6, "{hit:?}");
    let beside = client.cast_shape(proto::CastShapeRequest { pose: at(3.0, 9.0), ..cast }).await.unwrap();
    assert_eq!(beside, proto::RayHit::default());
    for (wrong, field) in [
        (proto::CastShapeRequest { shape: sphere(-1.0), ..cast }, "shape.sphere.radius"),
        (proto::CastShapeRequest { shape: None, ..cast }, "shape"),
        (proto::CastShapeRequest { translation: None, ..cast }, "translation"),
        (proto::CastShapeRequest { pose: at(f64::NAN, 0.0), ..cast }, "pose.position.x"),
    ] {
        let refused = client.cast_shape(wrong).await.unwrap_err().to_string();
        assert!(refused.contains(field), "{refused}");
    }
}

async fn bounds_are_of_all_robots_or_of_some(via: Via) {
    let daemon = balls(via).await;
    let all = daemon.client.link_bounds(&[]).await.unwrap();
    assert_eq!(
        all.iter().map(|of| of.robot.as_str()).collect::<Vec<_>>(),
        ["left", "right"],
        "a plane has none"
    );
    let right = daemon.client.link_bounds(&["right"]).await.unwrap();
    assert_eq!(right[0].lower, Some(proto::Vector3 { x: 0.9, y: -0.1, z: 0.9 }));
    assert_eq!(right[0].upper, Some(proto::Vector3 { x: 1.1, y: 0.1, z: 1.1 }));
    let refused = daemon.client.link_bounds(&["moon"]).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::RobotNotFound));
}

async fn rays_come_by_the_ten_thousand_in_one_call(via: Via) {
    let daemon = balls(via).await;
    let place = |i: i32| f64::from(i % 100) * 0.02 - 0.5;
    let rays = (0..10_000).map(|i| ray([place(i), place(i / 100), 3.0], [place(i), place(i / 100), -1.0]));
    let hits = daemon.client.cast_rays(rays).await.unwrap();
    assert_eq!(hits.len(), 10_000);
    assert!(hits.iter().all(|hit| hit.hit));
    let count = |robot: &str| hits.iter().filter(|hit| hit.robot == robot).count();
    // A disc of 0.1 m has some pi 0.1^2 / 0.02^2 = 79 rays of a grid of 2 cm.
    assert!((60..100).contains(&count("left")) && (60..100).contains(&count("right")), "{}", count("left"));
    let many = (0..20_001).map(|_| ray([0.0; 3], [1.0; 3]));
    let refused = daemon.client.cast_rays(many).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::LimitExceeded));
}

async fn rays_pass_what_is_in_none_of_their_groups(via: Via) {
    let daemon = balls(via).await;
    let client = &daemon.client;
    let left = proto::LinkProperties { collision_group: Some(4), ..Default::default() };
    client.set_link_properties("left", [left]).await.unwrap();
    let down = || [0.0, 1.0].map(|x| ray([x, 0.0, 3.0], [x, 0.0, -1.0]));
    for (mask, robots) in [
        (None, ["left", "right"]),
        (Some(4), ["left", ""]),
        (Some(1), ["ground", "right"]),
        (Some(5), ["left", "right"]),
        (Some(0), ["", ""]),
    ] {
        let hits = client.cast_rays_in_groups(down(), mask).await.unwrap();
        assert_eq!(hits.iter().map(|hit| hit.robot.as_str()).collect::<Vec<_>>(), robots, "{mask:?}");
    }
    assert_eq!(client.cast_rays(down()).await.unwrap()[0].robot, "left");
}

over_every_transport! {
    links_are_measured_where_robots_are_and_would_be,
    shapes_of_no_robot_are_measured,
    shapes_of_no_robot_overlap_and_are_cast,
    bounds_are_of_all_robots_or_of_some,
    rays_come_by_the_ten_thousand_in_one_call,
    rays_pass_what_is_in_none_of_their_groups,
}

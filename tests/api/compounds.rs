//! A body of several shapes: reading them back, and standing on each of them.

use simd_client::proto::compound_part::Geometry as Part;
use simd_client::proto::shape::Geometry as Drawn;
use simd_client::proto::{self, Base, ErrorReason, SpawnEntityRequest};
use simd_client::{Client, Error, Spawned};
use simd_tests::daemon::{Daemon, Via};

use crate::over_every_transport;

async fn spawn(
    client: &Client,
    name: &str,
    geometry: proto::primitive::Geometry,
    (base, z): (Base, f64),
) -> Result<Spawned, Error> {
    let mass = if base == Base::Free { 5.0 } else { 0.0 };
    let primitive = proto::Primitive { geometry: Some(geometry), mass, color: None };
    let source = proto::description_source::Source::Primitive(primitive);
    let position = Some(proto::Vector3 { x: 0.0, y: 0.0, z });
    let request = SpawnEntityRequest {
        source: Some(proto::DescriptionSource { source: Some(source), ..Default::default() }),
        name: name.into(),
        base: base.into(),
        pose: Some(proto::Pose { position, ..Default::default() }),
        // The ground has no mass, for which a load may warn.
        strict: base == Base::Free,
        ..Default::default()
    };
    client.spawn(request).await
}

/// Height of the middle of a stool's top above the ground, metres.
const HEIGHT: f64 = 0.3;

/// Returns a top on four legs, each with another shape; the cone is turned over and stands on its tip.
fn stool() -> Vec<proto::CompoundPart> {
    let part = |x: f64, y: f64, z: f64, geometry: Part| {
        let position = Some(proto::Vector3 { x, y, z });
        let pose = Some(proto::Pose { position, orientation: None });
        proto::CompoundPart { pose, geometry: Some(geometry) }
    };
    let top = Some(proto::Vector3 { x: 0.4, y: 0.4, z: 0.04 });
    let cone = Part::Cone(proto::ConeGeometry { radius: 0.04, length: 0.28 });
    let mut leg_of_cone = part(-0.15, -0.15, -HEIGHT + 0.14, cone);
    if let Some(pose) = &mut leg_of_cone.pose {
        pose.orientation = Some(proto::Quaternion { x: 1.0, y: 0.0, z: 0.0, w: 0.0 });
    }
    vec![
        part(0.0, 0.0, 0.0, Part::Box(proto::BoxGeometry { size: top })),
        part(
            0.15,
            0.15,
            -HEIGHT + 0.14,
            Part::Cylinder(proto::CylinderGeometry { radius: 0.03, length: 0.28 }),
        ),
        part(
            -0.15,
            0.15,
            -HEIGHT + 0.13,
            Part::Capsule(proto::CapsuleGeometry { radius: 0.03, length: 0.2 }),
        ),
        leg_of_cone,
        part(0.15, -0.15, -HEIGHT + 0.05, Part::Sphere(proto::SphereGeometry { radius: 0.05 })),
    ]
}

fn compound(parts: Vec<proto::CompoundPart>) -> proto::primitive::Geometry {
    proto::primitive::Geometry::Compound(proto::CompoundGeometry { parts })
}

/// Returns the kind of a shape, and its sizes in metres.
fn sizes(geometry: &Drawn) -> (&'static str, Vec<f64>) {
    match geometry {
        Drawn::Box(it) => {
            let size = it.size.unwrap();
            ("box", vec![size.x, size.y, size.z])
        }
        Drawn::Sphere(it) => ("sphere", vec![it.radius]),
        Drawn::Cylinder(it) => ("cylinder", vec![it.radius, it.length]),
        Drawn::Capsule(it) => ("capsule", vec![it.radius, it.length]),
        Drawn::Cone(it) => ("cone", vec![it.radius, it.length]),
        other => panic!("{other:?}"),
    }
}

/// Returns the shape that is drawn of a part.
fn drawn(part: &proto::CompoundPart) -> Drawn {
    match part.geometry.unwrap() {
        Part::Box(it) => Drawn::Box(it),
        Part::Sphere(it) => Drawn::Sphere(it),
        Part::Cylinder(it) => Drawn::Cylinder(it),
        Part::Capsule(it) => Drawn::Capsule(it),
        Part::Cone(it) => Drawn::Cone(it),
    }
}

/// Position and orientation, x y z and x y z w.
fn numbers(pose: Option<proto::Pose>) -> ([f64; 3], [f64; 4]) {
    let pose = pose.unwrap();
    let position = pose.position.unwrap();
    let turn = pose.orientation.unwrap_or(proto::Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 });
    ([position.x, position.y, position.z], [turn.x, turn.y, turn.z, turn.w])
}

/// All shapes are visible, collide, and have the given poses. Numbers keep their values in the description,
/// except for rounding if a shape is turned to the axes of the physics and back.
async fn shapes_of_a_body_are_read_back_as_they_were_sent(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let parts = stool();
    let spawned = spawn(&daemon.client, "stool", compound(parts.clone()), (Base::Free, 1.0)).await.unwrap();
    assert_eq!((spawned.entity.mass, spawned.entity.links.len()), (5.0, 1));
    let scene = daemon.client.scene(&["stool"]).await.unwrap();
    let robot = &scene.robots[0];
    for (of, shapes) in
        [("seen", &robot.visuals), ("described", &robot.collisions), ("touching", &robot.colliders)]
    {
        assert_eq!(shapes.len(), parts.len(), "{of}");
        for (shape, part) in shapes.iter().zip(&parts) {
            let (kind, lengths) = sizes(shape.geometry.as_ref().unwrap());
            let (expected_kind, expected) = sizes(&drawn(part));
            assert_eq!((kind, lengths.len()), (expected_kind, expected.len()), "{of}");
            let off = lengths.iter().zip(&expected).map(|(is, asked)| (is - asked).abs());
            assert!(off.fold(0.0, f64::max) < 1e-12, "{of}, {kind}: {lengths:?}");
            let ((position, turn), (asked, asked_turn)) = (numbers(shape.pose), numbers(part.pose));
            let off = position.iter().zip(&asked).map(|(is, asked)| (is - asked).abs());
            assert!(off.fold(0.0, f64::max) < 1e-12, "{of}, {kind}: {position:?}");
            let dot: f64 = turn.iter().zip(&asked_turn).map(|(is, asked)| is * asked).sum();
            assert!((dot.abs() - 1.0).abs() < 1e-12, "{of}, {kind}: {turn:?}");
        }
    }
}

/// Upright on the ends of its four legs: with a shorter or missing leg it would lean or fall. A loaded
/// contact penetrates by far less than a millimetre.
async fn a_body_stands_on_each_of_its_shapes(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let client = &daemon.client;
    let plane = proto::primitive::Geometry::Plane(Default::default());
    spawn(client, "ground", plane, (Base::Fixed, 0.0)).await.unwrap();
    spawn(client, "stool", compound(stool()), (Base::Free, HEIGHT + 0.01)).await.unwrap();
    daemon.pass(1.5).await;
    let state = client.robot_state("stool").await.unwrap();
    let ([.., z], [x, y, ..]) = numbers(state.pose);
    assert!((z - HEIGHT).abs() < 1e-3, "{state:?}");
    // Half of the angle by which it leans.
    assert!(x.hypot(y) < 2e-3, "{state:?}");
    let linear = state.twist.unwrap().linear.unwrap();
    assert!(linear.x.hypot(linear.y).hypot(linear.z) < 1e-3, "{state:?}");
}

/// The error names the field of the part, and nothing is added.
async fn a_part_that_cannot_be_is_refused_by_its_index(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let mut parts = stool();
    parts[3].geometry = Some(Part::Cone(proto::ConeGeometry { radius: 0.1, length: -1.0 }));
    for (parts, field) in [(parts, "compound.parts[3].cone.length"), (Vec::new(), "compound.parts")] {
        let refused = spawn(&daemon.client, "stool", compound(parts), (Base::Free, 1.0)).await.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::InvalidValue), "{refused}");
        assert!(refused.to_string().contains(field), "{refused}");
    }
    assert!(daemon.client.robots().await.unwrap().is_empty());
}

over_every_transport! {
    shapes_of_a_body_are_read_back_as_they_were_sent,
    a_body_stands_on_each_of_its_shapes,
    a_part_that_cannot_be_is_refused_by_its_index,
}

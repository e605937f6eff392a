//! Shapes of a robot for drawing, in one flat list, each with its link.

use std::fmt::Write as _;

use glamx::{DPose3, DVec3};
use simd_core::collision::{Collider, ColliderGeometry, ConvexMesh};
use simd_core::simulation::published_state::EntityLayout;
use simd_model::robot::{Geometry, TextureRepeat, Visual};
use simd_proto::v1;

use super::geometry;
use super::simulation::count;

/// Converts visuals, collisions and colliders of a robot.
pub fn robot_scene(entity: &EntityLayout) -> v1::RobotScene {
    let links = || entity.model.links.iter().enumerate();
    v1::RobotScene {
        robot: entity.name.clone(),
        layout_version: entity.version,
        visuals: links()
            .flat_map(|(index, link)| link.visuals.iter().map(move |visual| (index, visual)))
            .map(|(index, visual)| visual_shape(index, visual))
            .collect(),
        collisions: links()
            .flat_map(|(index, link)| link.collisions.iter().map(move |collision| (index, collision)))
            .map(|(index, collision)| shape(index, collision.link_from_shape, &collision.geometry))
            .collect(),
        colliders: entity.shapes.colliders(&entity.tree).map(collider).collect(),
    }
}

/// Returns a convex collider as Wavefront OBJ: metres, in the shape's own axes.
pub fn obj(mesh: &ConvexMesh) -> Vec<u8> {
    let mut text = String::new();
    for vertex in &mesh.vertices {
        let _ = writeln!(text, "v {} {} {}", vertex.x, vertex.y, vertex.z);
    }
    for [a, b, c] in &mesh.triangles {
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    text.into_bytes()
}

fn visual_shape(link: usize, visual: &Visual) -> v1::Shape {
    let texture = visual.texture.as_ref();
    v1::Shape {
        color: visual.color.map(color),
        texture: texture.map_or_else(String::new, |picture| picture.image.sha256.to_string()),
        texture_repeat: texture.and_then(|picture| texture_repeat(picture.repeat)),
        ..shape(link, visual.link_from_shape, &visual.geometry)
    }
}

/// Converts how often a texture repeats; absent if the whole picture is on each side.
fn texture_repeat(repeat: TextureRepeat) -> Option<v1::TextureRepeat> {
    let (TextureRepeat::Times([x, y]) | TextureRepeat::PerMetre([x, y])) = repeat;
    let per_metre = matches!(repeat, TextureRepeat::PerMetre(_));
    (repeat != TextureRepeat::default()).then_some(v1::TextureRepeat { x, y, per_metre })
}

fn shape(link: usize, pose: DPose3, geometry: &Geometry) -> v1::Shape {
    let (pose, geometry) = (Some(geometry::pose(pose)), Some(shape_geometry(geometry)));
    v1::Shape { link: count(link), pose, geometry, ..Default::default() }
}

fn collider(collider: Collider) -> v1::Shape {
    let Collider { link, link_from_shape, geometry } = collider;
    let (pose, geometry) = (Some(geometry::pose(link_from_shape)), Some(collider_geometry(&geometry)));
    v1::Shape { link: count(link), pose, geometry, ..Default::default() }
}

fn collider_geometry(geometry: &ColliderGeometry) -> v1::shape::Geometry {
    match geometry {
        ColliderGeometry::Box { size } => box_of(*size),
        ColliderGeometry::Sphere { radius } => sphere(*radius),
        ColliderGeometry::Cylinder { radius, length } => cylinder(*radius, *length),
        ColliderGeometry::Capsule { radius, length } => capsule(*radius, *length),
        ColliderGeometry::Cone { radius, length } => cone(*radius, *length),
        ColliderGeometry::Plane { normal } => plane(*normal),
        ColliderGeometry::Convex { sha256 } => {
            v1::shape::Geometry::Convex(v1::ConvexGeometry { sha256: sha256.to_string() })
        }
    }
}

fn shape_geometry(geometry: &Geometry) -> v1::shape::Geometry {
    match geometry {
        Geometry::Box { size } => box_of(*size),
        Geometry::Sphere { radius } => sphere(*radius),
        Geometry::Cylinder { radius, length } => cylinder(*radius, *length),
        Geometry::Capsule { radius, length } => capsule(*radius, *length),
        Geometry::Cone { radius, length } => cone(*radius, *length),
        Geometry::Plane { normal } => plane(*normal),
        Geometry::Mesh { uri, scale, asset } => v1::shape::Geometry::Mesh(v1::MeshGeometry {
            sha256: asset.as_ref().map(|asset| asset.sha256.to_string()).unwrap_or_default(),
            uri: uri.clone(),
            scale: Some(geometry::vector(*scale)),
            look: asset.as_ref().map(|asset| asset.look().to_string()).unwrap_or_default(),
        }),
    }
}

fn box_of(size: DVec3) -> v1::shape::Geometry {
    v1::shape::Geometry::Box(v1::BoxGeometry { size: Some(geometry::vector(size)) })
}

fn sphere(radius: f64) -> v1::shape::Geometry {
    v1::shape::Geometry::Sphere(v1::SphereGeometry { radius })
}

fn cylinder(radius: f64, length: f64) -> v1::shape::Geometry {
    v1::shape::Geometry::Cylinder(v1::CylinderGeometry { radius, length })
}

fn capsule(radius: f64, length: f64) -> v1::shape::Geometry {
    v1::shape::Geometry::Capsule(v1::CapsuleGeometry { radius, length })
}

fn cone(radius: f64, length: f64) -> v1::shape::Geometry {
    v1::shape::Geometry::Cone(v1::ConeGeometry { radius, length })
}

fn plane(normal: DVec3) -> v1::shape::Geometry {
    v1::shape::Geometry::Plane(v1::PlaneGeometry { normal: Some(geometry::vector(normal)) })
}

fn color([red, green, blue, alpha]: [f64; 4]) -> v1::Color {
    v1::Color { red, green, blue, alpha }
}

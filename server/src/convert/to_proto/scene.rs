//! What is to be drawn of a robot: its shapes in one flat list, each with its link.

use glamx::DPose3;
use simd_core::simulation::snapshot::EntityLayout;
use simd_model::robot::Geometry;
use simd_proto::v1;

use super::geometry;
use super::simulation::count;

/// Visuals and colliders of a robot.
pub fn robot_scene(entity: &EntityLayout) -> v1::RobotScene {
    let links = || entity.model.links.iter().enumerate();
    v1::RobotScene {
        robot: entity.name.clone(),
        layout_version: entity.version,
        visuals: links()
            .flat_map(|(index, link)| link.visuals.iter().map(move |visual| (index, visual)))
            .map(|(index, visual)| {
                shape(index, visual.link_from_shape, &visual.geometry, visual.color.map(color))
            })
            .collect(),
        collisions: links()
            .flat_map(|(index, link)| link.collisions.iter().map(move |collision| (index, collision)))
            .map(|(index, collision)| shape(index, collision.link_from_shape, &collision.geometry, None))
            .collect(),
    }
}

fn shape(link: usize, pose: DPose3, geometry: &Geometry, color: Option<v1::Color>) -> v1::Shape {
    v1::Shape {
        link: count(link),
        pose: Some(geometry::pose(pose)),
        geometry: Some(shape_geometry(geometry)),
        color,
    }
}

fn shape_geometry(geometry: &Geometry) -> v1::shape::Geometry {
    match geometry {
        Geometry::Box { size } => {
            v1::shape::Geometry::Box(v1::BoxGeometry { size: Some(geometry::vector(*size)) })
        }
        Geometry::Sphere { radius } => v1::shape::Geometry::Sphere(v1::SphereGeometry { radius: *radius }),
        Geometry::Cylinder { radius, length } => {
            v1::shape::Geometry::Cylinder(v1::CylinderGeometry { radius: *radius, length: *length })
        }
        Geometry::Capsule { radius, length } => {
            v1::shape::Geometry::Capsule(v1::CapsuleGeometry { radius: *radius, length: *length })
        }
        Geometry::Plane { normal } => {
            v1::shape::Geometry::Plane(v1::PlaneGeometry { normal: Some(geometry::vector(*normal)) })
        }
        Geometry::Mesh { uri, scale, asset } => v1::shape::Geometry::Mesh(v1::MeshGeometry {
            sha256: asset.as_ref().map(|asset| asset.sha256.to_string()).unwrap_or_default(),
            uri: uri.clone(),
            scale: Some(geometry::vector(*scale)),
        }),
    }
}

fn color([red, green, blue, alpha]: [f64; 4]) -> v1::Color {
    v1::Color { red, green, blue, alpha }
}

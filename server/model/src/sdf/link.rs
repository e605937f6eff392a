//! A link: mass, shapes, surface.

use glamx::{DMat3, DPose3, DVec3};

use super::files::joined;
use super::frames;
use crate::inertia;
use crate::report::Disposition::{Defaulted, Ignored, Repaired};
use crate::robot::{Geometry, Inertial, Material, TextureRepeat};
use crate::translation::draft::{DraftGeometry, DraftLink, DraftShape};
use crate::translation::element::{Element, report_unknown};
use crate::translation::ellipsoid::ellipsoid;
use crate::translation::notes::{Notes, Stop};
use crate::urdf::numbers::{self, Shape};

const KNOWN: [&str; 16] = [
    "pose",
    "inertial",
    "visual",
    "collision",
    "sensor",
    "light",
    "audio_source",
    "audio_sink",
    "self_collide",
    "gravity",
    "kinematic",
    "velocity_decay",
    "enable_wind",
    "must_be_base_link",
    "projector",
    "origin",
];

pub(super) fn read(element: Element, notes: &mut Notes) -> Result<DraftLink, Stop> {
    let name = element.word("name").unwrap_or_default().to_owned();
    let mut link = DraftLink::bare(name, (element.file, element.line()));
    for child in element.children("visual") {
        match shape(child, notes) {
            Ok(shape) => link.visuals.extend(shape),
            Err(stop) => notes.pass_over(stop),
        }
    }
    let mut density = None;
    let mut others = false;
    for child in element.children("collision") {
        density = density.or(child.number_of("density", notes)?);
        link.collisions.extend(shape(child, notes)?);
        let material = surface(child, notes)?;
        others |= link.collisions.len() > 1 && material != link.material;
        if link.collisions.len() <= 1 {
            link.material = material;
            link.groups = bits(child, notes);
        }
    }
    if others {
        let message = "its collisions have different surfaces: the first one is used for all of them";
        notes.warn(element, Repaired, message);
    }
    link.inertial = inertial(element, &link, density, notes)?;
    report_unknown(element, &KNOWN, "", notes);
    for child in element.elements() {
        match child.tag() {
            "light" | "audio_source" | "audio_sink" | "projector" => {
                notes.info(child, Ignored, "not read by simd");
            }
            "gravity" if element.says("gravity") == Some(false) => {
                notes.warn(child, Ignored, "gravity acts on every link in simd");
            }
            "kinematic" if element.says("kinematic") == Some(true) => {
                notes.warn(child, Ignored, "only forces move links in simd");
            }
            "velocity_decay" => notes.info(child, Ignored, "not read by simd: damping is of joints"),
            _ => {}
        }
    }
    Ok(link)
}

/// Returns the file's inertial, or SDF's default: 1 kg and moments of 1 kg m^2.
fn inertial(
    element: Element,
    link: &DraftLink,
    density: Option<f64>,
    notes: &mut Notes,
) -> Result<Option<Inertial>, Stop> {
    let Some(node) = element.child("inertial") else {
        notes.info(element, Defaulted, "it has no inertial: 1 kg and moments of 1 kg m^2, as SDF says");
        return Ok(Some(Inertial { mass: 1.0, center_of_mass: DVec3::ZERO, inertia: DMat3::IDENTITY }));
    };
    if matches!(node.word("auto"), Some("true" | "1")) {
        let density = node.number_of("density", notes)?.or(density).unwrap_or(inertia::DENSITY);
        let solid: Option<Vec<(DPose3, Geometry)>> = link
            .collisions
            .iter()
            .map(|shape| Some((shape.link_from_shape, solid(&shape.geometry)?)))
            .collect();
        let found =
            solid.and_then(|solid| inertia::of_shapes(solid.iter().map(|(pose, shape)| (pose, shape))));
        let Some(found) = found else {
            let message = "its inertia is taken from its meshes, at 1000 kg/m^3";
            notes.info(node, Defaulted, message);
            return Ok(None);
        };
        let factor = density / inertia::DENSITY;
        return Ok(Some(Inertial { mass: found.mass * factor, inertia: found.inertia * factor, ..found }));
    }
    let (pose, _) = frames::pose(node, notes)?;
    let mass = node.number_of("mass", notes)?.unwrap_or(1.0);
    let mut moment = |tag: &'static str, default: f64| -> Result<f64, Stop> {
        let Some(tensor) = node.child("inertia") else { return Ok(default) };
        Ok(tensor.number_of(tag, notes)?.unwrap_or(default))
    };
    let [xx, yy, zz] = [moment("ixx", 1.0)?, moment("iyy", 1.0)?, moment("izz", 1.0)?];
    let [xy, xz, yz] = [moment("ixy", 0.0)?, moment("ixz", 0.0)?, moment("iyz", 0.0)?];
    let tensor = DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
    if ![mass, xx, yy, zz, xy, xz, yz].iter().all(|value| value.is_finite()) {
        return Err(Stop::at(node, "its mass or a moment is not finite"));
    }
    let inertia = inertia::rotated(tensor, pose.rotation);
    Ok(Some(Inertial { mass, center_of_mass: pose.translation, inertia }))
}

/// Returns a shape as a solid; meshes are unknown here.
fn solid(geometry: &DraftGeometry) -> Option<Geometry> {
    Some(match *geometry {
        DraftGeometry::Box { size } => Geometry::Box { size },
        DraftGeometry::Sphere { radius } => Geometry::Sphere { radius },
        DraftGeometry::Cylinder { radius, length } => Geometry::Cylinder { radius, length },
        DraftGeometry::Capsule { radius, length } => Geometry::Capsule { radius, length },
        DraftGeometry::Cone { radius, length } => Geometry::Cone { radius, length },
        DraftGeometry::Plane { normal } => Geometry::Plane { normal },
        DraftGeometry::Mesh { .. } => return None,
    })
}

fn shape(element: Element, notes: &mut Notes) -> Result<Option<DraftShape>, Stop> {
    let (mut link_from_shape, relative_to) = frames::pose(element, notes)?;
    if relative_to.is_some() {
        notes.warn(element, Ignored, "the pose of a shape is read as one in its link");
    }
    let Some(geometry) = element.child("geometry") else {
        notes.warn(element, Ignored, "it has no geometry; left out");
        return Ok(None);
    };
    let Some(shape) = geometry.elements().next() else {
        notes.info(geometry, Ignored, "it is empty; left out");
        return Ok(None);
    };
    let length = |tag: &'static str, notes: &mut Notes| -> Result<f64, Stop> {
        Ok(shape.number_of(tag, notes)?.unwrap_or(1.0))
    };
    let geometry = match shape.tag() {
        "box" => {
            let size = shape.child("size").map(|size| size.numbers(notes)).transpose()?.flatten();
            DraftGeometry::Box { size: DVec3::from_array(size.unwrap_or([1.0; 3])) }
        }
        "sphere" => DraftGeometry::Sphere { radius: length("radius", notes)? },
        "cylinder" => {
            DraftGeometry::Cylinder { radius: length("radius", notes)?, length: length("length", notes)? }
        }
        "capsule" => {
            DraftGeometry::Capsule { radius: length("radius", notes)?, length: length("length", notes)? }
        }
        "cone" => DraftGeometry::Cone { radius: length("radius", notes)?, length: length("length", notes)? },
        "ellipsoid" => {
            let radii = shape.child("radii").map(|radii| radii.numbers(notes)).transpose()?.flatten();
            let (turn, geometry, message) = ellipsoid(DVec3::from_array(radii.unwrap_or([1.0; 3])));
            notes.warn(shape, Repaired, message);
            link_from_shape *= turn;
            geometry
        }
        "plane" => {
            let normal = shape.child("normal").map(|normal| normal.numbers(notes)).transpose()?.flatten();
            DraftGeometry::Plane { normal: normal.map_or(DVec3::Z, DVec3::from_array) }
        }
        "mesh" => {
            let Some(uri) = shape.text_of("uri") else {
                notes.warn(shape, Ignored, "it has no uri; left out");
                return Ok(None);
            };
            if let Some(submesh) = shape.child("submesh") {
                notes.warn(submesh, Ignored, "not read by simd: the whole mesh is used");
            }
            let scale = shape.child("scale").map(|scale| scale.numbers(notes)).transpose()?.flatten();
            let scale = DVec3::from_array(scale.unwrap_or([1.0; 3]));
            DraftGeometry::Mesh { uri: joined(shape.folder(), uri), scale }
        }
        "heightmap" => {
            let Some(uri) = shape.text_of("uri") else {
                notes.warn(shape, Ignored, "it has no uri; left out");
                return Ok(None);
            };
            let size = shape.child("size").map(|size| size.numbers(notes)).transpose()?.flatten();
            let at = shape.child("pos").map(|at| at.numbers(notes)).transpose()?.flatten();
            link_from_shape.translation += DVec3::from_array(at.unwrap_or_default());
            DraftGeometry::Mesh {
                uri: joined(shape.folder(), uri),
                scale: DVec3::from_array(size.unwrap_or([1.0; 3])),
            }
        }
        other => {
            notes.warn(shape, Ignored, format!("simd has no shape {other:.40}; left out"));
            return Ok(None);
        }
    };
    let material = element.child("material");
    let color = material.and_then(color);
    let texture = material.and_then(texture).map(|uri| (uri, TextureRepeat::default()));
    Ok(Some(DraftShape { at: (element.file, element.line()), link_from_shape, geometry, color, texture }))
}

/// Returns the URI of a physically based material's colour picture, for either workflow.
fn texture(material: Element) -> Option<String> {
    let map = ["metal", "specular"]
        .into_iter()
        .find_map(|workflow| material.at(&["pbr", workflow, "albedo_map"]))?;
    (!map.text().is_empty()).then(|| joined(map.folder(), map.text()))
}

fn color(material: Element) -> Option<[f64; 4]> {
    // With a picture, the ambient colour does not affect the look.
    let ambient = || material.child("ambient").filter(|_| texture(material).is_none());
    let said = material.child("diffuse").or_else(ambient)?;
    let read = numbers::read(said.text(), Shape::Color).ok()?;
    let color: [f64; 4] = read.values.try_into().ok()?;
    Some(color.map(|part| part.clamp(0.0, 1.0)))
}

fn surface(collision: Element, notes: &mut Notes) -> Result<Material, Stop> {
    let mut material = Material::default();
    let Some(surface) = collision.child("surface") else { return Ok(material) };
    let friction =
        [["friction", "ode", "mu"], ["friction", "bullet", "friction"], ["friction", "dart", "mu"]];
    let friction = friction.iter().find_map(|[a, b, _]| Some((surface.at(&[a, b])?, *b)));
    if let Some((element, engine)) = friction {
        let tag = if engine == "bullet" { "friction" } else { "mu" };
        material.friction = element.number_of(tag, notes)?.filter(|mu| *mu >= 0.0);
        // Gazebo's value for no slip.
        material.friction = material.friction.map(|mu| mu.min(1e6));
    }
    if let Some(bounce) = surface.child("bounce") {
        let restitution = bounce.number_of("restitution_coefficient", notes)?;
        material.restitution = restitution.map(|restitution| restitution.clamp(0.0, 1.0));
    }
    if let Some(torsional) = surface.at(&["friction", "torsional"]) {
        notes.info(torsional, Ignored, "not read by simd");
    }
    Ok(material)
}

/// Returns the bits of `collide_bitmask`: two collide if they have one in common.
fn bits(collision: Element, notes: &mut Notes) -> Option<[u32; 2]> {
    let element = collision.at(&["surface", "contact", "collide_bitmask"])?;
    let text = element.text();
    let read = match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    };
    if read.is_none() {
        notes.warn(element, Ignored, "it is not a bit mask; left out");
    }
    // By default, all 16 bits are set.
    read.filter(|bits| *bits != 0xffff).map(|bits| [bits, bits])
}

//! Single shapes from the wire.

use glamx::{DPose3, DVec3};
use simd_model::Primitive;
use simd_model::robot::Geometry;
use simd_proto::v1;

use super::geometry::finite_vector;
use crate::convert::field::{BadField, Path};

/// Maximum number of shapes of a compound.
const MAX_PARTS: usize = 1_000;

/// Parses a robot of one shape.
pub fn primitive(at: &Path<'_>, given: v1::Primitive) -> Result<Primitive, BadField> {
    let shapes = match at.field("geometry").given(given.geometry)? {
        v1::primitive::Geometry::Compound(given) => parts(&at.field("compound"), given)?,
        given => vec![(DPose3::IDENTITY, geometry(at, given)?)],
    };
    let mass = at.field("mass").at_least_zero(given.mass)?;
    let color = given.color.map(|v1::Color { red, green, blue, alpha }| [red, green, blue, alpha]);
    if let Some(bad) = color.iter().flatten().find(|part| !(0.0..=1.0).contains(*part)) {
        return Err(at.field("color").refuse(bad, "its parts must be 0 to 1"));
    }
    Ok(Primitive { shapes, mass: (mass > 0.0).then_some(mass), color })
}

/// Parses the shapes of a compound, each with its pose.
fn parts(at: &Path<'_>, given: v1::CompoundGeometry) -> Result<Vec<(DPose3, Geometry)>, BadField> {
    let count = given.parts.len();
    if !(1..=MAX_PARTS).contains(&count) {
        let expected = format!("there must be 1 to {MAX_PARTS}");
        return Err(at.field("parts").refuse(count, expected));
    }
    let part = |(index, given): (usize, v1::CompoundPart)| {
        use v1::compound_part::Geometry as Part;
        use v1::primitive::Geometry as Wire;
        let at = &at.item("parts", index);
        let shape = match at.field("geometry").given(given.geometry)? {
            Part::Box(shape) => Wire::Box(shape),
            Part::Sphere(shape) => Wire::Sphere(shape),
            Part::Cylinder(shape) => Wire::Cylinder(shape),
            Part::Capsule(shape) => Wire::Capsule(shape),
            Part::Cone(shape) => Wire::Cone(shape),
        };
        let pose = given.pose.map(|pose| super::geometry::pose(&at.field("pose"), pose)).transpose()?;
        Ok((pose.unwrap_or(DPose3::IDENTITY), geometry(at, shape)?))
    };
    given.parts.into_iter().enumerate().map(part).collect()
}

/// Parses a shape's kind and sizes; compounds are refused.
pub fn geometry(at: &Path<'_>, given: v1::primitive::Geometry) -> Result<Geometry, BadField> {
    use v1::primitive::Geometry as Wire;
    Ok(match given {
        Wire::Box(v1::BoxGeometry { size }) => {
            let at = &at.field("box");
            let at = &at.field("size");
            let size = finite_vector(at, at.given(size)?)?;
            for (axis, side) in ["x", "y", "z"].into_iter().zip(size.to_array()) {
                above_zero(at, axis, side)?;
            }
            Geometry::Box { size }
        }
        Wire::Sphere(v1::SphereGeometry { radius }) => {
            Geometry::Sphere { radius: above_zero(&at.field("sphere"), "radius", radius)? }
        }
        Wire::Cylinder(v1::CylinderGeometry { radius, length }) => {
            let at = &at.field("cylinder");
            let (radius, length) = (above_zero(at, "radius", radius)?, above_zero(at, "length", length)?);
            Geometry::Cylinder { radius, length }
        }
        Wire::Capsule(v1::CapsuleGeometry { radius, length }) => {
            let at = &at.field("capsule");
            let (radius, length) = (above_zero(at, "radius", radius)?, above_zero(at, "length", length)?);
            Geometry::Capsule { radius, length }
        }
        Wire::Cone(v1::ConeGeometry { radius, length }) => {
            let at = &at.field("cone");
            let (radius, length) = (above_zero(at, "radius", radius)?, above_zero(at, "length", length)?);
            Geometry::Cone { radius, length }
        }
        Wire::Compound(_) => return Err(at.field("compound").refuse("given", "a part is a single shape")),
        Wire::Plane(v1::PlaneGeometry { normal }) => {
            let at = &at.field("plane");
            let at = &at.field("normal");
            let given = normal.map_or(Ok(DVec3::Z), |normal| finite_vector(at, normal))?;
            let normal = given.try_normalize().ok_or_else(|| at.refuse(given, "it must have a length"))?;
            Geometry::Plane { normal }
        }
        Wire::Mesh(v1::MeshGeometry { sha256: _, uri, scale, look: _ }) => {
            let at = &at.field("mesh");
            let uri = at.field("uri").name(uri)?;
            let at = &at.field("scale");
            let scale = scale.map_or(Ok(DVec3::ZERO), |scale| finite_vector(at, scale))?;
            Geometry::Mesh { uri, scale: if scale == DVec3::ZERO { DVec3::ONE } else { scale }, asset: None }
        }
    })
}

/// Accepts a length above zero, metres.
fn above_zero(at: &Path<'_>, name: &str, value: f64) -> Result<f64, BadField> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(at.field(name).refuse(value, "it must be finite and above 0"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(geometry: v1::primitive::Geometry, mass: f64) -> Result<Primitive, BadField> {
        let given = v1::Primitive { geometry: Some(geometry), mass, color: None };
        primitive(&Path::ROOT.field("primitive"), given)
    }

    #[test]
    fn invalid_shapes_are_refused_by_the_name_of_the_field() {
        use v1::primitive::Geometry as Wire;
        let flat = v1::Vector3 { x: 1.0, y: 0.0, z: 1.0 };
        let nowhere = v1::Vector3 { x: 0.0, y: 0.0, z: 0.0 };
        let part = |radius| {
            let geometry = Some(v1::compound_part::Geometry::Sphere(v1::SphereGeometry { radius }));
            v1::CompoundPart { pose: None, geometry }
        };
        let compound = |parts| Wire::Compound(v1::CompoundGeometry { parts });
        let sphere = |radius| Wire::Sphere(v1::SphereGeometry { radius });
        for (geometry, mass, field) in [
            (sphere(-1.0), 0.0, "primitive.sphere.radius"),
            (sphere(f64::NAN), 0.0, "primitive.sphere.radius"),
            (sphere(1.0), -1.0, "primitive.mass"),
            (Wire::Box(v1::BoxGeometry { size: None }), 0.0, "primitive.box.size"),
            (Wire::Box(v1::BoxGeometry { size: Some(flat) }), 0.0, "primitive.box.size.y"),
            (Wire::Plane(v1::PlaneGeometry { normal: Some(nowhere) }), 0.0, "primitive.plane.normal"),
            (Wire::Mesh(v1::MeshGeometry::default()), 0.0, "primitive.mesh.uri"),
            (Wire::Cone(v1::ConeGeometry { radius: 1.0, length: 0.0 }), 0.0, "primitive.cone.length"),
            (compound(Vec::new()), 0.0, "primitive.compound.parts"),
            (compound(vec![part(1.0); MAX_PARTS + 1]), 0.0, "primitive.compound.parts"),
            (compound(vec![part(1.0), part(-1.0)]), 0.0, "primitive.compound.parts[1].sphere.radius"),
            (compound(vec![v1::CompoundPart::default()]), 0.0, "primitive.compound.parts[0].geometry"),
        ] {
            assert_eq!(read(geometry, mass).unwrap_err().field, field);
        }
        assert!(read(sphere(1.0), 2.0).is_ok());
        assert_eq!(read(compound(vec![part(1.0), part(2.0)]), 0.0).unwrap().shapes.len(), 2);
    }
}

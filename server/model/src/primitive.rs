//! Single shapes, such as the ground or a box to push, or several as one body, as equivalent URDF.

use std::fmt::Write as _;

use crate::inertia;
use crate::robot::{Geometry, Inertial};
use glamx::{DPose3, DQuat, DVec3};

/// A robot of one link, `link`, with shapes that are visuals and colliders.
#[derive(Clone, Debug, PartialEq)]
pub struct Primitive {
    /// `link_from_shape` and geometry of each shape, at least one. A mesh is named by its URI, without its
    /// content.
    pub shapes: Vec<(DPose3, Geometry)>,
    /// Kilograms, above 0; absent is the mass of water. A plane has none.
    pub mass: Option<f64>,
    /// Red, green, blue, alpha, each 0 to 1.
    pub color: Option<[f64; 4]>,
}

impl Primitive {
    /// Makes it from one shape at the origin of the link.
    pub fn of(geometry: Geometry) -> Self {
        Self { shapes: vec![(DPose3::IDENTITY, geometry)], mass: None, color: None }
    }

    /// Returns its description. The inertia assumes evenly filled shapes. The reader computes a mesh's
    /// inertia, since its content is unknown here.
    pub fn urdf(&self) -> String {
        let name = match &self.shapes[..] {
            [(_, geometry)] => element(geometry).0,
            _ => "compound",
        };
        let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{name}\">\n  <link name=\"link\">\n");
        text += &self.inertial();
        // Writing to a string cannot fail.
        for (pose, geometry) in &self.shapes {
            let (_, shape) = element(geometry);
            let _ = write!(text, "    <visual>\n{}      <geometry>{shape}</geometry>\n", origin(pose));
            if let Some([red, green, blue, alpha]) = self.color {
                let _ = writeln!(
                    text,
                    "      <material name=\"color\"><color rgba=\"{red} {green} {blue} {alpha}\"/></material>"
                );
            }
            text += "    </visual>\n";
        }
        for (pose, geometry) in &self.shapes {
            let (_, shape) = element(geometry);
            let _ = write!(
                text,
                "    <collision>\n{}      <geometry>{shape}</geometry>\n    </collision>\n",
                origin(pose)
            );
        }
        text += "  </link>\n</robot>\n";
        text
    }

    fn inertial(&self) -> String {
        let is_known = self.shapes.iter().all(|(_, shape)| !matches!(shape, Geometry::Mesh { .. }));
        let shapes = self.shapes.iter().filter(|_| is_known).map(|(pose, shape)| (pose, shape));
        match (inertia::of_shapes(shapes), self.mass) {
            (Some(Inertial { mass: of_water, inertia, center_of_mass }), mass) => {
                let mass = mass.unwrap_or(of_water);
                let inertia = inertia * (mass / of_water);
                let (x, y, z) = (inertia.x_axis, inertia.y_axis, inertia.z_axis);
                // For one shape at the origin, the axes are the principal ones, except for rounding.
                let is_plain = matches!(&self.shapes[..], [(pose, _)] if *pose == DPose3::IDENTITY);
                let [xy, xz, yz] = if is_plain { [0.0; 3] } else { [y.x, z.x, z.y] };
                let at = DPose3::from_translation(center_of_mass);
                format!(
                    "    <inertial>\n{}      <mass value=\"{mass}\"/>\n      <inertia ixx=\"{}\" ixy=\"{xy}\" \
                     ixz=\"{xz}\" iyy=\"{}\" iyz=\"{yz}\" izz=\"{}\"/>\n    </inertial>\n",
                    origin(&at),
                    x.x,
                    y.y,
                    z.z
                )
            }
            (None, Some(mass)) => {
                format!("    <inertial>\n      <mass value=\"{mass}\"/>\n    </inertial>\n")
            }
            (None, None) => String::new(),
        }
    }
}

/// Returns the line of a pose; empty for the identity.
fn origin(pose: &DPose3) -> String {
    if *pose == DPose3::IDENTITY {
        return String::new();
    }
    let DVec3 { x, y, z } = pose.translation;
    let DQuat { x: qx, y: qy, z: qz, w: qw } = pose.rotation;
    format!("      <origin xyz=\"{x} {y} {z}\" quat_xyzw=\"{qx} {qy} {qz} {qw}\"/>\n")
}

/// Returns a name for the robot, and the shape's element.
fn element(geometry: &Geometry) -> (&'static str, String) {
    match geometry {
        Geometry::Box { size } => ("box", format!("<box size=\"{} {} {}\"/>", size.x, size.y, size.z)),
        Geometry::Sphere { radius } => ("sphere", format!("<sphere radius=\"{radius}\"/>")),
        Geometry::Cylinder { radius, length } => {
            ("cylinder", format!("<cylinder radius=\"{radius}\" length=\"{length}\"/>"))
        }
        Geometry::Capsule { radius, length } => {
            ("capsule", format!("<capsule radius=\"{radius}\" length=\"{length}\"/>"))
        }
        Geometry::Cone { radius, length } => {
            ("cone", format!("<cone radius=\"{radius}\" length=\"{length}\"/>"))
        }
        Geometry::Plane { normal } => {
            ("plane", format!("<plane normal=\"{} {} {}\"/>", normal.x, normal.y, normal.z))
        }
        Geometry::Mesh { uri, scale, .. } => {
            let uri = escaped(uri);
            ("mesh", format!("<mesh filename=\"{uri}\" scale=\"{} {} {}\"/>", scale.x, scale.y, scale.z))
        }
    }
}

/// Escapes text for an attribute.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use glamx::DVec3;

    use super::*;
    use crate::{Asset, Assets, ReadOptions, read};

    struct Nothing;

    impl Assets for Nothing {
        fn find(&self, _uri: &str) -> Result<Asset, Vec<String>> {
            Err(Vec::new())
        }
    }

    #[test]
    fn a_primitive_is_read_as_it_was_meant_and_without_a_warning() {
        let shapes = [
            Geometry::Box { size: DVec3::new(0.1, 0.2, 0.3) },
            Geometry::Sphere { radius: 0.1 },
            Geometry::Cylinder { radius: 0.1, length: 0.4 },
            Geometry::Capsule { radius: 0.1, length: 0.4 },
            Geometry::Cone { radius: 0.1, length: 0.4 },
        ];
        for geometry in shapes {
            for mass in [None, Some(2.5)] {
                let color = Some([1.0, 0.5, 0.0, 1.0]);
                let primitive = Primitive { mass, color, ..Primitive::of(geometry.clone()) };
                let options = ReadOptions { strict: true, ..ReadOptions::default() };
                let (model, _) = read(primitive.urdf().as_bytes(), &Nothing, &options).unwrap();
                let link = &model.links[0];
                assert_eq!(link.collisions[0].geometry, geometry);
                assert_eq!(link.visuals[0].geometry, geometry);
                assert_eq!(link.visuals[0].color, primitive.color);
                let water = inertia::of_shapes([(&DPose3::IDENTITY, &geometry)].into_iter()).unwrap();
                let expected = mass.unwrap_or(water.mass);
                assert!((link.inertial.mass - expected).abs() < 1e-12 * expected);
                let moment = water.inertia.x_axis.x * expected / water.mass;
                assert!((link.inertial.inertia.x_axis.x - moment).abs() < 1e-12 * moment);
            }
        }
    }

    #[test]
    fn a_plane_is_read_with_its_normal() {
        let geometry = Geometry::Plane { normal: DVec3::new(0.6, 0.0, 0.8) };
        let text = Primitive::of(geometry.clone()).urdf();
        let (model, _) = read(text.as_bytes(), &Nothing, &ReadOptions::default()).unwrap();
        let Geometry::Plane { normal } = model.links[0].collisions[0].geometry else {
            unreachable!("{model:?}")
        };
        assert!((normal - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-12);
    }

    /// An evenly filled box: m (y^2 + z^2) / 12.
    #[test]
    fn the_inertia_is_that_of_the_shape_filled_evenly() {
        let cuboid = Geometry::Box { size: DVec3::new(1.0, 2.0, 3.0) };
        let primitive = Primitive { mass: Some(6.0), ..Primitive::of(cuboid) };
        let (model, _) = read(primitive.urdf().as_bytes(), &Nothing, &ReadOptions::default()).unwrap();
        let inertia = model.links[0].inertial.inertia;
        let moments = DVec3::new(inertia.x_axis.x, inertia.y_axis.y, inertia.z_axis.z);
        assert!((moments - DVec3::new(6.5, 5.0, 2.5)).length() < 1e-12, "{moments}");
    }

    #[test]
    fn a_mesh_keeps_its_uri_whatever_is_in_it() {
        let uri = "a \"b\" & <c>.stl".to_owned();
        let geometry = Geometry::Mesh { uri: uri.clone(), scale: DVec3::ONE, asset: None };
        let text = Primitive { mass: Some(1.0), ..Primitive::of(geometry) }.urdf();
        assert_eq!(
            crate::describe(text.as_bytes(), &crate::LoadLimits::default()).unwrap().asset_uris,
            [uri]
        );
    }

    /// Two unit boxes of 3 kg each, a metre apart: 2 m (1 + 1) / 12 + 2 m (1 / 2)^2 across the line between
    /// them.
    #[test]
    fn several_shapes_are_one_body_about_their_common_centre() {
        let unit = |x: f64| (DPose3::from_translation(DVec3::X * x), Geometry::Box { size: DVec3::ONE });
        let cone = Geometry::Cone { radius: 0.3, length: 0.8 };
        for mass in [None, Some(6.0)] {
            let primitive = Primitive { shapes: vec![unit(1.0), unit(2.0)], mass, color: None };
            let options = ReadOptions { strict: true, ..ReadOptions::default() };
            let (model, _) = read(primitive.urdf().as_bytes(), &Nothing, &options).unwrap();
            let link = &model.links[0];
            assert_eq!((link.collisions.len(), link.visuals.len()), (2, 2));
            let of = mass.unwrap_or(2_000.0);
            assert!((link.inertial.mass - of).abs() < 1e-9);
            assert!((link.inertial.center_of_mass - DVec3::X * 1.5).length() < 1e-12);
            let inertia = link.inertial.inertia;
            let moments = DVec3::new(inertia.x_axis.x, inertia.y_axis.y, inertia.z_axis.z) / of;
            let across = 1.0 / 6.0 + 0.25;
            assert!((moments - DVec3::new(1.0 / 6.0, across, across)).length() < 1e-9, "{moments}");
        }
        // Rotated, and with a mesh, whose inertia the reader computes.
        let turn = DQuat::from_rotation_y(0.7);
        let turned = DPose3::from_parts(DVec3::new(0.1, 0.2, 0.3), turn);
        let mesh = Geometry::Mesh { uri: "a.stl".into(), scale: DVec3::ONE, asset: None };
        let shapes = vec![(turned, cone.clone()), (DPose3::IDENTITY, mesh)];
        let primitive = Primitive { shapes, mass: Some(2.0), color: None };
        assert!(!primitive.urdf().contains("ixx"));
        let (model, _) = read(primitive.urdf().as_bytes(), &Nothing, &ReadOptions::default()).unwrap();
        assert_eq!(model.links[0].collisions[0].geometry, cone);
        assert!(model.links[0].collisions[0].link_from_shape.rotation.angle_between(turn) < 1e-9);
    }

    /// An evenly filled cone: 3 m r^2 / 10 about its axis, its centre a quarter of its length above the base.
    #[test]
    fn a_cone_has_the_inertia_of_its_formula() {
        let (radius, length, mass) = (0.3, 0.8, 2.0);
        let primitive = Primitive { mass: Some(mass), ..Primitive::of(Geometry::Cone { radius, length }) };
        let (model, _) = read(primitive.urdf().as_bytes(), &Nothing, &ReadOptions::default()).unwrap();
        let Inertial { center_of_mass, inertia, .. } = model.links[0].inertial;
        assert!((center_of_mass - DVec3::Z * (-length / 4.0)).length() < 1e-12, "{center_of_mass}");
        let across = 3.0 / 20.0 * mass * radius * radius + 3.0 / 80.0 * mass * length * length;
        let moments = DVec3::new(inertia.x_axis.x, inertia.y_axis.y, inertia.z_axis.z);
        let expected = DVec3::new(across, across, 0.3 * mass * radius * radius);
        assert!((moments - expected).length() < 1e-12, "{moments} {expected}");
    }
}

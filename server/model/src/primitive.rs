//! A single shape, such as the ground or a box to push, as the URDF that says the same.

use std::fmt::Write as _;

use crate::inertia;
use crate::robot::{Geometry, Inertial};
use glamx::DPose3;

/// A robot of one link, `link`, with one shape that is seen and touched.
#[derive(Clone, Debug, PartialEq)]
pub struct Primitive {
    /// A mesh is named by its URI, and needs no content here.
    pub geometry: Geometry,
    /// Kilograms, above 0; absent is that of water. A plane has none.
    pub mass: Option<f64>,
    /// Red, green, blue, alpha, each 0 to 1.
    pub color: Option<[f64; 4]>,
}

impl Primitive {
    /// Its description. The inertia is that of the shape filled evenly; of a mesh, whose
    /// content is not known here, it is left to the reader.
    pub fn urdf(&self) -> String {
        let (name, shape) = element(&self.geometry);
        let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{name}\">\n  <link name=\"link\">\n");
        text += &self.inertial();
        // Writing to a string cannot fail.
        let _ = write!(text, "    <visual>\n      <geometry>{shape}</geometry>\n");
        if let Some([red, green, blue, alpha]) = self.color {
            let _ = writeln!(
                text,
                "      <material name=\"color\"><color rgba=\"{red} {green} {blue} {alpha}\"/></material>"
            );
        }
        let _ = write!(
            text,
            "    </visual>\n    <collision>\n      <geometry>{shape}</geometry>\n    </collision>\n  </link>\n</robot>\n"
        );
        text
    }

    fn inertial(&self) -> String {
        let filled = inertia::of_shapes([(&DPose3::IDENTITY, &self.geometry)].into_iter());
        match (filled, self.mass) {
            (Some(Inertial { mass: of_water, inertia, .. }), mass) => {
                let mass = mass.unwrap_or(of_water);
                let inertia = inertia * (mass / of_water);
                let (ixx, iyy, izz) = (inertia.x_axis.x, inertia.y_axis.y, inertia.z_axis.z);
                format!(
                    "    <inertial>\n      <mass value=\"{mass}\"/>\n      <inertia ixx=\"{ixx}\" ixy=\"0\" ixz=\"0\" \
                     iyy=\"{iyy}\" iyz=\"0\" izz=\"{izz}\"/>\n    </inertial>\n"
                )
            }
            (None, Some(mass)) => {
                format!("    <inertial>\n      <mass value=\"{mass}\"/>\n    </inertial>\n")
            }
            (None, None) => String::new(),
        }
    }
}

/// A name for the robot, and the shape's element.
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
        Geometry::Plane { normal } => {
            ("plane", format!("<plane normal=\"{} {} {}\"/>", normal.x, normal.y, normal.z))
        }
        Geometry::Mesh { uri, scale, .. } => {
            let uri = escaped(uri);
            ("mesh", format!("<mesh filename=\"{uri}\" scale=\"{} {} {}\"/>", scale.x, scale.y, scale.z))
        }
    }
}

/// Text that stands in an attribute.
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
        ];
        for geometry in shapes {
            for mass in [None, Some(2.5)] {
                let primitive =
                    Primitive { geometry: geometry.clone(), mass, color: Some([1.0, 0.5, 0.0, 1.0]) };
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
        let text = Primitive { geometry: geometry.clone(), mass: None, color: None }.urdf();
        let (model, _) = read(text.as_bytes(), &Nothing, &ReadOptions::default()).unwrap();
        let Geometry::Plane { normal } = model.links[0].collisions[0].geometry else {
            unreachable!("{model:?}")
        };
        assert!((normal - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-12);
    }

    /// A box filled evenly: m (y^2 + z^2) / 12.
    #[test]
    fn the_inertia_is_that_of_the_shape_filled_evenly() {
        let primitive = Primitive {
            geometry: Geometry::Box { size: DVec3::new(1.0, 2.0, 3.0) },
            mass: Some(6.0),
            color: None,
        };
        let (model, _) = read(primitive.urdf().as_bytes(), &Nothing, &ReadOptions::default()).unwrap();
        let inertia = model.links[0].inertial.inertia;
        let moments = DVec3::new(inertia.x_axis.x, inertia.y_axis.y, inertia.z_axis.z);
        assert!((moments - DVec3::new(6.5, 5.0, 2.5)).length() < 1e-12, "{moments}");
    }

    #[test]
    fn a_mesh_keeps_its_uri_whatever_is_in_it() {
        let uri = "a \"b\" & <c>.stl".to_owned();
        let geometry = Geometry::Mesh { uri: uri.clone(), scale: DVec3::ONE, asset: None };
        let text = Primitive { geometry, mass: Some(1.0), color: None }.urdf();
        assert_eq!(
            crate::describe(text.as_bytes(), &crate::LoadLimits::default()).unwrap().asset_uris,
            [uri]
        );
    }
}

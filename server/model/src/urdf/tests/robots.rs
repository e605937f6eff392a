//! The test robots of the repository, read from their files.

use std::path::{Path, PathBuf};

use glamx::{DMat3, DQuat, DVec3};

use super::*;
use crate::robot::{Geometry, JointKind, JointLimits};

struct Package {
    folder: PathBuf,
}

impl Package {
    fn new(name: &str) -> Self {
        Self { folder: Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/assets").join(name) }
    }

    fn urdf(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.folder.join("urdf").join(name)).expect("the URDF is committed")
    }
}

impl Assets for Package {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        let name = self.folder.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let inside = uri.strip_prefix(&format!("package://{name}/")).ok_or(vec![uri.to_owned()])?;
        let path = self.folder.join(inside);
        let bytes = std::fs::read(&path).map_err(|_| vec![path.display().to_string()])?;
        Ok(Asset { sha256: Sha256::of(&bytes), bytes: bytes.into() })
    }
}

fn load(package: &str, urdf: &str) -> (RobotModel, LoadReport) {
    let package = Package::new(package);
    let read = read(&package.urdf(urdf), &package, &ReadOptions::default());
    read.unwrap_or_else(|refused| panic!("refused: {refused}"))
}

fn meshes(model: &RobotModel) -> Vec<(&str, f64)> {
    let mut found = Vec::new();
    for link in &model.links {
        for visual in &link.visuals {
            let Geometry::Mesh { asset: Some(mesh), .. } = &visual.geometry else {
                panic!("a mesh is missing")
            };
            let [a, b, c] = [0, 1, 2].map(|corner| {
                let corner = |triangle: &[u32; 3]| mesh.vertices[triangle[corner] as usize];
                mesh.triangles.iter().map(corner).collect::<Vec<DVec3>>()
            });
            let volume: f64 = a.iter().zip(&b).zip(&c).map(|((a, b), c)| a.dot(b.cross(*c)) / 6.0).sum();
            found.push((link.name.as_str(), volume));
        }
    }
    found
}

#[test]
fn the_bench_arm_is_read_without_a_warning() {
    let (model, report) = load("Bench_Arm-1.2 rev B", "Bench_Arm-1.2 rev B.urdf");
    assert_eq!(report.summary(&model), "bench_arm: 2 links, 1 moving joint; no warnings");
    let joint = &model.joints[0];
    assert_eq!((joint.name.as_str(), joint.kind, joint.axis), ("shoulder", JointKind::Continuous, DVec3::Y));
    assert_eq!(joint.limits, JointLimits::default());
    assert_eq!(joint.parent_from_joint.translation, DVec3::new(0.0, -0.022595, 0.19765));
    assert_eq!(joint.parent_from_joint.rotation, DQuat::from_rotation_y(-0.039919));
    let arm = &model.links[1];
    assert_eq!((arm.name.as_str(), arm.inertial.mass), ("arm", 0.19992));
    assert_eq!(arm.inertial.center_of_mass, DVec3::new(0.16597, 0.053505, -1.9429e-16));
    let (ixy, ixz, iyz) = (-0.00013781, 4.4037e-18, 1.9297e-19);
    let inertia = [4.6655e-5, ixy, ixz, ixy, 0.0032199, iyz, ixz, iyz, 0.0032364];
    assert_eq!(arm.inertial.inertia, DMat3::from_cols_array(&inertia));
}

#[test]
fn the_bench_arms_meshes_are_closed_solids_of_its_size() {
    let (model, _) = load("Bench_Arm-1.2 rev B", "Bench_Arm-1.2 rev B.urdf");
    for (link, volume) in meshes(&model) {
        // Outward triangles: a positive volume, in cubic metres, of a desktop object.
        assert!((1e-4..1e-3).contains(&volume), "{link}: {volume}");
    }
}

#[test]
fn the_bench_arms_files_are_listed_by_the_description() {
    let package = Package::new("Bench_Arm-1.2 rev B");
    let described = describe(&package.urdf("Bench_Arm-1.2 rev B.urdf")).unwrap();
    let base = "package://Bench_Arm-1.2 rev B/meshes/";
    assert_eq!(described.asset_uris, [format!("{base}base_link.STL"), format!("{base}arm.STL")]);
}

#[test]
fn the_two_links_with_spaces_crlf_and_a_byte_order_mark_are_read() {
    let urdf = Package::new("Two Link.v2").urdf("Two Link.v2.urdf");
    assert!(urdf.starts_with(b"\xEF\xBB\xBF<?xml") && urdf.windows(2).any(|pair| pair == b"\r\n"));
    let (model, report) = load("Two Link.v2", "Two Link.v2.urdf");
    assert_eq!(report.summary(&model), "two_link: 3 links, 2 moving joints; 1 warning");
    assert_eq!(warnings(&report), ["the axis has length 2.000000 and was normalized"]);
    let names: Vec<_> = model.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["shoulder joint", "elbow joint"]);
    assert_eq!(model.joints[0].limits, JointLimits::default());
    let elbow = &model.joints[1];
    assert_eq!((elbow.axis, elbow.damping, elbow.friction), (DVec3::Y, 0.02, 0.01));
    assert_eq!((elbow.limits.lower, elbow.limits.upper), (Some(-2.1), Some(2.4)));
    assert!(meshes(&model).iter().all(|(_, volume)| *volume > 5e-5));
}

#[test]
fn the_seven_arm_is_read_without_a_warning() {
    let (model, report) = load("seven_arm", "seven_arm.urdf");
    assert_eq!(report.summary(&model), "seven_arm: 8 links, 7 moving joints; no warnings");
    assert!(model.links.iter().all(|link| link.inertial.mass > 0.0 && link.visuals[0].color.is_some()));
    assert!(model.joints.iter().all(|joint| joint.axis == DVec3::Z && joint.damping == 0.0));
    assert!(model.joints.iter().all(|joint| joint.limits.lower.is_some() && joint.limits.effort.is_some()));
    assert_ne!(model.links[3].inertial.inertia.x_axis.y, 0.0007, "the tensor is turned into the link's axes");
}

//! Memory that robots share, and its limit.

use glamx::{DPose3, DVec3};
use simd_core::collision::MeshShapes;
use simd_model::RobotModel;
use simd_model::robot::{Collision, Geometry, Inertial, Link, Material};

use super::*;

struct Nowhere;

impl Assets for Nowhere {
    fn find(&self, _uri: &str) -> Result<Asset, Vec<String>> {
        Err(Vec::new())
    }
}

/// Returns a mesh of 1200 bytes.
fn mesh(n: u8) -> MeshAsset {
    MeshAsset {
        sha256: Sha256::of(&[n]),
        vertices: vec![DVec3::ZERO; 40],
        triangles: vec![[0, 1, 2]; 20],
        paints: Vec::new(),
        files: Vec::new(),
        grid: None,
    }
}

fn get(decoding: &Decoding, n: u8, reads: &Cell<u32>) -> Result<Arc<MeshAsset>, String> {
    decoding.mesh(Sha256::of(&[n]), "stl", &mut || {
        reads.set(reads.get() + 1);
        Ok(mesh(n))
    })
}

#[test]
fn a_file_is_decoded_once_while_it_is_used() {
    let (decoded, reads) = (Decoded::new(10_000), Cell::new(0));
    let [one, other] = [Decoding::new(&decoded, &Nowhere), Decoding::new(&decoded, &Nowhere)];
    let [first, second] = [get(&one, 1, &reads).unwrap(), get(&other, 1, &reads).unwrap()];
    assert!(Arc::ptr_eq(&first, &second));
    assert_eq!(reads.get(), 1);
    drop((first, second));
    get(&other, 1, &reads).unwrap();
    assert_eq!(reads.get(), 2, "nothing unused is kept");
}

#[test]
fn all_meshes_together_stay_within_the_limit() {
    let (decoded, reads) = (Decoded::new(2400), Cell::new(0));
    let decoding = Decoding::new(&decoded, &Nowhere);
    let kept = [1, 2].map(|n| get(&decoding, n, &reads).unwrap());
    decoding.check().unwrap();
    get(&decoding, 3, &reads).unwrap_err();
    let refused = decoding.check().unwrap_err().to_string();
    assert!(refused.ends_with("would be 3600, and the limit is 2400"), "{refused}");
    assert!(get(&decoding, 4, &reads).is_err());
    assert_eq!(reads.get(), 3, "the fourth is not read");
    drop(kept);
    let decoding = Decoding::new(&decoded, &Nowhere);
    get(&decoding, 3, &reads).unwrap();
    decoding.check().unwrap();
}

#[test]
fn deleted_meshes_count_until_they_are_forgotten_and_never_twice() {
    let (decoded, reads) = (Decoded::new(10_000), Cell::new(0));
    let decoding = Decoding::new(&decoded, &Nowhere);
    drop(get(&decoding, 1, &reads).unwrap());
    assert_eq!(decoded.lock().bytes, 1200);
    drop(get(&decoding, 1, &reads).unwrap());
    assert_eq!((decoded.lock().bytes, reads.get()), (1200, 2));
    decoded.tidy();
    assert_eq!(decoded.lock().bytes, 0);
}

#[test]
fn a_mesh_is_found_by_its_look_whichever_format_it_was_read_as() {
    let decoded = Decoded::new(10_000);
    let decoding = Decoding::new(&decoded, &Nowhere);
    let read = |n: u8, format: &str| decoding.mesh(Sha256::of(&[n]), format, &mut || Ok(mesh(n))).unwrap();
    let [stl, obj, other] = [read(1, "stl"), read(1, "obj"), read(2, "dae")];
    let find = |n: u8| decoded.find(&Sha256::of(&[n]));
    assert!(Arc::ptr_eq(&find(1).unwrap(), &obj), "the first by the format's name");
    assert!(Arc::ptr_eq(&find(2).unwrap(), &other));
    assert!(find(3).is_none());
    drop(obj);
    assert!(Arc::ptr_eq(&find(1).unwrap(), &stl));
}

/// Returns collision shapes with these meshes, each a tetrahedron, with reuse of other robots' results.
fn shapes(decoded: &Decoded, meshes: &[u8]) -> Arc<Shapes> {
    let collision = |n: &u8| {
        let asset = MeshAsset {
            vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            ..mesh(*n)
        };
        let geometry =
            Geometry::Mesh { uri: format!("{n}.stl"), scale: DVec3::ONE, asset: Some(Arc::new(asset)) };
        Collision { link_from_shape: DPose3::IDENTITY, geometry, material: Material::default() }
    };
    let link = Link {
        name: "base".to_owned(),
        inertial: Inertial::ZERO,
        visuals: Vec::new(),
        collisions: meshes.iter().map(collision).collect(),
    };
    let model = RobotModel { links: vec![link], ..RobotModel::default() };
    let shapes = Arc::new(Shapes::reusing(&model, false, MeshShapes::Hull, &decoded.shapes()));
    decoded.admit_shapes(&shapes).unwrap();
    shapes
}

#[test]
fn robots_that_are_alike_count_once_and_one_of_them_is_looked_at() {
    let decoded = Decoded::new(100_000);
    let robots: Vec<_> = (0..100).map(|_| shapes(&decoded, &[1, 2])).collect();
    let each: u64 = robots[0].mesh_bytes().map(|(_, bytes)| bytes).sum();
    let bytes = || decoded.lock().bytes;
    assert_eq!((bytes(), decoded.shapes().len()), (each, 1));
    let more = shapes(&decoded, &[2, 3]);
    assert_eq!((bytes(), decoded.shapes().len()), (each + each / 2, 2));
    drop((robots, more));
    decoded.tidy();
    assert_eq!((bytes(), decoded.shapes().len()), (0, 0));
}

#[test]
fn shapes_of_a_mesh_are_known_while_any_robot_has_it() {
    let decoded = Decoded::new(100_000);
    let first = shapes(&decoded, &[1]);
    let others = [shapes(&decoded, &[1]), shapes(&decoded, &[1, 2])];
    drop(others);
    let found = decoded.shapes();
    assert_eq!(found.len(), 1);
    assert!(Arc::ptr_eq(&found[0], &first));
    decoded.tidy();
    assert_eq!(decoded.lock().made.len(), 1);
    drop((first, found));
    assert!(decoded.shapes().is_empty());
}

//! Distances between random pairs of primitives and hulls compared with coal's, apart and overlapping.
//!
//! The figures are in `tests/reference/distances.json`, with the script that made them.

use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use serde::Deserialize;
use simd_core::simulation::queries::{DistanceQuery, QueryBody};
use simd_model::robot::{Geometry, MeshAsset, Sha256};
use simd_tests::scenes::{look, robot, solid, spawn, world};

#[derive(Deserialize)]
struct Reference {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    shapes: [String; 2],
    sizes: [Vec<f64>; 2],
    /// x y z, quaternion x y z w.
    poses: [[f64; 7]; 2],
    distance: f64,
}

fn geometry(kind: &str, sizes: &[f64], number: u8) -> Geometry {
    match (kind, sizes) {
        ("box", &[x, y, z]) => Geometry::Box { size: DVec3::new(x, y, z) },
        ("sphere", &[radius]) => Geometry::Sphere { radius },
        ("cylinder", &[radius, length]) => Geometry::Cylinder { radius, length },
        ("capsule", &[radius, length]) => Geometry::Capsule { radius, length },
        ("cone", &[radius, length]) => Geometry::Cone { radius, length },
        _ => {
            let vertices: Vec<DVec3> = sizes.chunks_exact(3).map(DVec3::from_slice).collect();
            let triangles = vec![[0, 1, 2]];
            let asset = MeshAsset {
                sha256: Sha256([number; 32]),
                vertices,
                triangles,
                paints: Vec::new(),
                files: Vec::new(),
                grid: None,
            };
            Geometry::Mesh { uri: "hull.stl".into(), scale: DVec3::ONE, asset: Some(Arc::new(asset)) }
        }
    }
}

fn body(robot: usize) -> QueryBody {
    QueryBody { robot, link: None, configuration: None }
}

/// 1e-6 m is the requested precision. The reported points are on both surfaces, and their distance is the
/// reported one: along the normal if the shapes overlap.
#[test]
fn distances_are_those_of_coal() {
    let reference: Reference = serde_json::from_str(include_str!("../reference/distances.json")).unwrap();
    let (mut worst, mut overlapping): (f64, usize) = (0.0, 0);
    for case in &reference.cases {
        let mut world = world(1e-3);
        for side in 0..2 {
            let shape = geometry(&case.shapes[side], &case.sizes[side], side as u8);
            let [x, y, z, qx, qy, qz, qw] = case.poses[side];
            let turn = DQuat::from_xyzw(qx, qy, qz, qw).normalize();
            let pose = DPose3::from_parts(DVec3::new(x, y, z), turn);
            let model = solid(&[(DPose3::IDENTITY, shape)], 1.0);
            spawn(&mut world, robot(&format!("body-{side}"), &model, pose, true));
        }
        let seen = look(&world);
        let query = DistanceQuery {
            a: body(0).into(),
            b: Some(body(1).into()),
            within: f64::INFINITY,
            nearest_only: false,
            filtered: false,
        };
        let found = seen.distances(&query, &|| false).unwrap();
        let [found] = &found[..] else { panic!("{found:?}") };
        let error = (found.distance - case.distance).abs();
        worst = worst.max(error);
        overlapping += usize::from(case.distance < 0.0);
        assert!(
            error < 1e-6,
            "{:?} at {:?}: {} and {}",
            case.shapes,
            case.poses,
            found.distance,
            case.distance
        );
        let between = (found.points[1] - found.points[0]).dot(found.normal);
        assert!((between - found.distance).abs() < 1e-6, "{found:?}");
        assert!((found.normal.length() - 1.0).abs() < 1e-6, "{found:?}");
        // The same in the other order.
        let query = DistanceQuery { a: body(1).into(), b: None, nearest_only: true, ..query };
        let back = seen.distances(&query, &|| false).unwrap();
        assert!((back[0].distance - case.distance).abs() < 1e-6, "{back:?}");
    }
    println!("{} pairs, {overlapping} overlap, largest difference {worst:.1e} m", reference.cases.len());
    assert!(overlapping > 20);
}

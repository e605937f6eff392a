//! Queries with numbers of all sizes: each is refused, or has an answer that keeps the promises. A seed makes
//! each run the same; `SIMD_MUTATIONS` asks for more of them.
#![cfg(test)]

use std::fs;

use fastrand::Rng;
use prost::Message;
use simd_fuzz_targets::queries;
use simd_proto::v1::{self, query_shape::Geometry};

/// Robots of the queried world.
const ROBOTS: [&str; 7] = ["arm", "ball", "plane", "mesh", "field", "hull", "round"];

const NUMBERS: &[f64] = &[
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    -0.0,
    0.0,
    1e-300,
    1e-12,
    1e-6,
    1.0,
    1e3,
    1e6,
    1e12,
    -1e12,
    1e13,
    1e150,
    1e300,
    f64::MAX,
    f64::MIN,
];

/// One in thirty is of another size than the world.
fn number(rng: &mut Rng) -> f64 {
    match rng.u8(0..30) {
        0 => NUMBERS[rng.usize(..NUMBERS.len())],
        1 => 0.1 * f64::from(rng.i8(-20..20)),
        _ => 6.0 * rng.f64() - 3.0,
    }
}

/// Returns the size of a shape, which is refused if it is negative.
fn size(rng: &mut Rng) -> f64 {
    match rng.u8(0..30) {
        0 => number(rng),
        1 => 10f64.powi(rng.i32(-12..12)),
        _ => 0.01 + rng.f64(),
    }
}

fn vector(rng: &mut Rng) -> v1::Vector3 {
    v1::Vector3 { x: number(rng), y: number(rng), z: number(rng) }
}

fn pose(rng: &mut Rng) -> Option<v1::Pose> {
    let orientation = v1::Quaternion { x: number(rng), y: number(rng), z: number(rng), w: number(rng) };
    let pose = v1::Pose {
        position: (rng.u8(0..8) > 0).then(|| vector(rng)),
        orientation: rng.bool().then_some(orientation),
    };
    (rng.u8(0..8) > 0).then_some(pose)
}

fn shape(rng: &mut Rng) -> Option<v1::QueryShape> {
    let (radius, length) = (size(rng), size(rng));
    let geometry = match rng.u8(0..5) {
        0 => {
            let size = Some(v1::Vector3 { x: size(rng), y: size(rng), z: size(rng) });
            Geometry::Box(v1::BoxGeometry { size })
        }
        1 => Geometry::Sphere(v1::SphereGeometry { radius }),
        2 => Geometry::Cylinder(v1::CylinderGeometry { radius, length }),
        3 => Geometry::Capsule(v1::CapsuleGeometry { radius, length }),
        _ => Geometry::Cone(v1::ConeGeometry { radius, length }),
    };
    Some(v1::QueryShape { geometry: Some(geometry) })
}

fn ray(rng: &mut Rng) -> v1::Ray {
    v1::Ray { from: Some(vector(rng)), to: Some(vector(rng)) }
}

fn body(rng: &mut Rng) -> v1::QueryBody {
    if rng.u8(0..3) == 0 {
        return v1::QueryBody { shape: shape(rng), pose: pose(rng), ..Default::default() };
    }
    let robot = ROBOTS[rng.usize(..ROBOTS.len())];
    let positions = if robot == "arm" { vec![number(rng)] } else { Vec::new() };
    let configuration = v1::Configuration { positions, root: pose(rng), ..Default::default() };
    v1::QueryBody {
        robot: robot.into(),
        link: if rng.bool() { "a".into() } else { String::new() },
        configuration: rng.bool().then_some(configuration),
        ..Default::default()
    }
}

/// Returns a question as it is in a sequence.
fn question(rng: &mut Rng) -> Vec<u8> {
    let kind = rng.u8(0..5);
    let message = match kind {
        0 => v1::GetClosestPointsRequest {
            a: Some(body(rng)),
            b: rng.bool().then(|| body(rng)),
            max_distance: rng.bool().then(|| number(rng)),
            nearest_only: rng.bool(),
            filtered: rng.bool(),
        }
        .encode_to_vec(),
        1 => {
            let (shape, pose) = (shape(rng), pose(rng));
            v1::FindOverlapsRequest { shape, pose, bounds_only: rng.bool() }.encode_to_vec()
        }
        2 => {
            let (shape, pose, translation) = (shape(rng), pose(rng), Some(vector(rng)));
            v1::CastShapeRequest { shape, pose, translation }.encode_to_vec()
        }
        3 => {
            let rays = (0..rng.usize(0..8)).map(|_| ray(rng)).collect();
            v1::CastRaysRequest { rays, collision_mask: rng.bool().then(|| rng.u32(0..4)) }.encode_to_vec()
        }
        _ => {
            let robots = (0..rng.usize(0..4)).map(|_| ROBOTS[rng.usize(..ROBOTS.len())].to_owned());
            v1::GetLinkBoundsRequest { robots: robots.collect() }.encode_to_vec()
        }
    };
    let length = u16::try_from(message.len()).unwrap().to_le_bytes();
    [&[kind][..], &length, &message].concat()
}

#[test]
fn no_number_of_a_question_breaks_a_promise() {
    let each: u32 = std::env::var("SIMD_MUTATIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(400);
    let rng = &mut Rng::with_seed(9);
    let (all, mut answered) = (20 * each, 0);
    for _ in 0..all {
        let bytes = question(rng);
        match std::panic::catch_unwind(|| queries(&bytes)) {
            Ok(count) => answered += u32::try_from(count).unwrap(),
            Err(_panic) => {
                let found = std::env::temp_dir().join("simd_queries_found");
                fs::write(&found, &bytes).unwrap();
                panic!("a question breaks on the bytes in {}", found.display());
            }
        }
    }
    println!("{answered} of {all} were answered");
    // Numbers that cannot be are refused.
    assert!(answered > all / 2 && answered < all, "{answered} of {all}");
}

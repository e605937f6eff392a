//! Rays in simd, as a server casts them: from a published state, whose shapes are put into a tree for each
//! call.

use std::error::Error;
use std::f64::consts::PI;
use std::time::Instant;

use glamx::DVec3;
use simd_core::Simulation;
use simd_tests::scenes::look;

/// Returns the directions of a Fibonacci lattice on the sphere, as `rays.py` has them.
fn direction(index: usize, count: usize) -> DVec3 {
    let z = 1.0 - (2.0 * index as f64 + 1.0) / count as f64;
    let (sin, cos) = (PI * (3.0 - 5f64.sqrt()) * index as f64).sin_cos();
    let across = (1.0 - z * z).sqrt();
    DVec3::new(across * cos, across * sin, z)
}

pub(crate) fn timed(
    world: &Simulation,
    calls: usize,
    start: DVec3,
    reach: f64,
    count: usize,
) -> Result<serde_json::Value, Box<dyn Error>> {
    let state = look(world);
    let rays: Vec<[DVec3; 2]> =
        (0..count).map(|index| [start, start + direction(index, count) * reach]).collect();
    let mut hits = state.cast_rays(&rays, None, &|| false)?;
    let began = Instant::now();
    for _ in 0..calls {
        hits = state.cast_rays(&rays, None, &|| false)?;
    }
    let seconds = began.elapsed().as_secs_f64();
    let distance = |hit: &Option<_>| {
        hit.as_ref().map_or(reach, |hit: &simd_core::simulation::rays::RayReport| hit.fraction * reach)
    };
    let distances: Vec<f64> = hits.iter().map(distance).collect();
    Ok(serde_json::json!({ "seconds": seconds, "distances": distances }))
}

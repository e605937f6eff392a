//! A room of 100,000 triangles, for rays. It is a box of 20 m by 16 m by 6 m whose sides are waves, all seen
//! from inside.

use std::f64::consts::TAU;
use std::io;
use std::path::{Path, PathBuf};

use glamx::DVec3;

/// Its inner lengths, m. It stands on z = -0.3, about the z axis.
const SIZE: DVec3 = DVec3::new(20.0, 16.0, 6.0);
/// Squares along each edge of a side: 6 x 91 x 91 x 2 triangles.
const SQUARES: usize = 91;
/// Amplitude of the waves of the sides, as a part of the room, and number of waves.
const WAVE: (f64, f64) = (0.02, 5.0);

/// Its triangles, corners counter-clockwise as seen from inside.
pub fn triangles() -> Vec<[DVec3; 3]> {
    let mut triangles = Vec::with_capacity(12 * SQUARES * SQUARES);
    for side in 0..6 {
        let corner = |i: usize, j: usize| corner(side, i as f64 / SQUARES as f64, j as f64 / SQUARES as f64);
        for (i, j) in (0..SQUARES).flat_map(|i| (0..SQUARES).map(move |j| (i, j))) {
            let (a, b) = (corner(i, j), corner(i + 1, j));
            let (c, d) = (corner(i + 1, j + 1), corner(i, j + 1));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles
}

/// Returns a point of a side: its edges are straight, so that sides meet.
fn corner(side: usize, u: f64, v: f64) -> DVec3 {
    let wave = WAVE.0 * (WAVE.1 * TAU * u).sin() * (WAVE.1 * TAU * v).sin();
    // In each pair of sides one is the other's mirror image, with u and v exchanged, so that both are seen
    // from inside.
    let (u, v, w) = if side.is_multiple_of(2) { (u, v, wave) } else { (v, u, 1.0 - wave) };
    let unit = match side / 2 {
        0 => DVec3::new(u, v, w),
        1 => DVec3::new(w, u, v),
        _ => DVec3::new(v, w, u),
    };
    (unit - DVec3::new(0.5, 0.5, 0.0)) * SIZE - DVec3::Z * 0.3
}

/// Writes it into a folder, as `room.stl` and a URDF that names it. Returns the URDF.
///
/// # Errors
/// Returns an error if the folder cannot be written to.
pub fn write(folder: &Path) -> io::Result<PathBuf> {
    let triangles = triangles();
    let mut stl = vec![0; 80];
    stl.extend((triangles.len() as u32).to_le_bytes());
    for triangle in &triangles {
        let [a, b, c] = *triangle;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for point in [normal, a, b, c] {
            stl.extend(point.to_array().iter().flat_map(|part| (*part as f32).to_le_bytes()));
        }
        stl.extend([0, 0]);
    }
    std::fs::write(folder.join("room.stl"), stl)?;
    let urdf = folder.join("room.urdf");
    let mesh = "<geometry><mesh filename=\"room.stl\"/></geometry>";
    let link = format!("<link name=\"room\"><collision>{mesh}</collision></link>");
    std::fs::write(&urdf, format!("<robot name=\"room\">{link}</robot>"))?;
    Ok(urdf)
}

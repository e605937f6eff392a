//! Triangles of boxes, balls, cylinders, capsules, cones and planes, about z as in URDF. Round ones have
//! enough triangles that the depth error is little more than [`ROUND`]. Boxes, balls and cylinders have unit
//! size, so that all sizes share one mesh. Texture coordinates are those of three.js, which the page draws
//! with.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glamx::DVec3;

use crate::scene::{Mesh, Vertex};

/// Metres between a round surface and its triangles, as far as [`MAX_SEGMENTS`] allows.
const ROUND: f64 = 1e-4;
/// Number of segments about an axis.
const LEAST_SEGMENTS: u32 = 24;
const MAX_SEGMENTS: u32 = 256;
/// Radius of a drawn plane, metres: a plane is not visible beyond it.
pub(crate) const PLANE_RADIUS: f64 = 1000.0;

/// Makes a cube with sides of 1 m.
pub(crate) fn cube() -> Mesh {
    let mut made = Made::default();
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
    // Directions of a picture's right side and its upper side.
    let faces = [(x, -z, y), (-x, z, y), (y, x, -z), (-y, x, z), (z, x, y), (-z, -x, y)];
    for (normal, across, up) in faces {
        let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
        let at = corners.map(|(right, high)| {
            let uv = [(right + 0.5) as f32, (0.5 - high) as f32];
            made.corner(normal / 2.0 + across * right + up * high, normal, uv)
        });
        made.triangle([at[0], at[1], at[2]]);
        made.triangle([at[0], at[2], at[3]]);
    }
    made.mesh()
}

/// Makes a ball with a radius of 1 m and `around` segments about its axis.
pub(crate) fn ball(around: u32) -> Mesh {
    let mut ball = capsule(around, 1.0, 0.0);
    for Vertex { position, normal, .. } in &mut ball.vertices {
        // The picture's poles are along y.
        for vector in [position, normal] {
            let [x, y, z] = *vector;
            *vector = [y, z, x];
        }
    }
    ball
}

/// Makes a capsule; metres, `length` without the caps.
pub(crate) fn capsule(around: u32, radius: f64, length: f64) -> Mesh {
    let rings = (around / 2).next_multiple_of(2);
    let mut made = Made::default();
    let mut profile: Vec<(f64, DVec3)> = Vec::new();
    for ring in 0..=rings {
        let polar = PI * f64::from(ring) / f64::from(rings);
        let normal = DVec3::new(polar.sin(), 0.0, polar.cos());
        // The equator appears twice: above and below the cylinder.
        let shifts: &[f64] = match (ring * 2).cmp(&rings) {
            std::cmp::Ordering::Less => &[0.5],
            std::cmp::Ordering::Equal => &[0.5, -0.5],
            std::cmp::Ordering::Greater => &[-0.5],
        };
        profile.extend(shifts.iter().map(|shift| (shift * length, normal)));
    }
    let last = profile.len().saturating_sub(1).max(1) as f64;
    for (index, (shift, normal)) in profile.iter().enumerate() {
        let point = *normal * radius + DVec3::Z * *shift;
        made.ring(around, point, *normal, (index as f64 / last) as f32);
    }
    made.bands(around, profile.len());
    made.mesh()
}

/// Makes a cylinder with a radius and a length of 1 m and `around` segments.
pub(crate) fn cylinder(around: u32) -> Mesh {
    let mut made = Made::default();
    for (shift, v) in [(0.5, 0.0), (-0.5, 1.0)] {
        made.ring(around, DVec3::new(1.0, 0.0, shift), DVec3::X, v);
    }
    made.bands(around, 2);
    for normal in [DVec3::Z, -DVec3::Z] {
        made.disc(around, 1.0, normal / 2.0, normal);
    }
    made.mesh()
}

/// Makes a cone; metres, `around` segments. The normals of its side depend on its slope, so that a stretched
/// one is another mesh.
pub(crate) fn cone(around: u32, radius: f64, length: f64) -> Mesh {
    let mut made = Made::default();
    let normal = DVec3::new(length, 0.0, radius).normalize_or(DVec3::X);
    for (at, v) in [(DVec3::new(0.0, 0.0, length / 2.0), 0.0), (DVec3::new(radius, 0.0, -length / 2.0), 1.0)]
    {
        made.ring(around, at, normal, v);
    }
    made.bands(around, 2);
    made.disc(around, radius, DVec3::Z * (-length / 2.0), -DVec3::Z);
    made.mesh()
}

/// Makes the plane of x and y, up to its drawn radius.
pub(crate) fn plane() -> Mesh {
    let mut made = Made::default();
    made.disc(64, PLANE_RADIUS, DVec3::ZERO, DVec3::Z);
    made.mesh()
}

/// Returns the number of segments with which their middle is [`ROUND`] inside of the circle. Only a few
/// numbers occur, so that meshes are shared.
pub(crate) fn segments(radius: f64) -> u32 {
    let half_angle = (1.0 - ROUND / radius.max(ROUND)).clamp(-1.0, 1.0).acos();
    let wanted = (PI / half_angle.max(PI / f64::from(MAX_SEGMENTS))).ceil();
    (wanted as u32).clamp(LEAST_SEGMENTS, MAX_SEGMENTS).next_multiple_of(8)
}

/// A mesh while it is made.
#[derive(Default)]
struct Made {
    vertices: Vec<Vertex>,
    indices: Vec<u32>,
}

impl Made {
    fn corner(&mut self, position: DVec3, normal: DVec3, uv: [f32; 2]) -> u32 {
        let index = u32::try_from(self.vertices.len()).unwrap_or(u32::MAX);
        let [position, normal] = [position, normal].map(|vector| vector.as_vec3().to_array());
        self.vertices.push(Vertex { position, normal, uv });
        index
    }

    fn triangle(&mut self, corners: [u32; 3]) {
        self.indices.extend(corners);
    }

    /// Adds a ring of vertices about z, from a point and its normal in the plane of x and z. The first vertex
    /// is repeated at the end.
    fn ring(&mut self, around: u32, point: DVec3, normal: DVec3, v: f32) {
        for step in 0..=around {
            let part = f64::from(step) / f64::from(around);
            // From -y on.
            let (sin, cos) = (TAU * part - FRAC_PI_2).sin_cos();
            let turned = |vector: DVec3| DVec3::new(vector.x * cos, vector.x * sin, vector.z);
            self.corner(turned(point), turned(normal), [part as f32, v]);
        }
    }

    /// Adds triangles between the first `rings` rings.
    fn bands(&mut self, around: u32, rings: usize) {
        let rings = u32::try_from(rings).unwrap_or(u32::MAX);
        for ring in 1..rings {
            let (above, below) = ((ring - 1) * (around + 1), ring * (around + 1));
            for step in 0..around {
                self.triangle([above + step, below + step, below + step + 1]);
                self.triangle([above + step, below + step + 1, above + step + 1]);
            }
        }
    }

    fn disc(&mut self, around: u32, radius: f64, center: DVec3, normal: DVec3) {
        let middle = self.corner(center, normal, [0.5, 0.5]);
        let mut before = None;
        for step in 0..=around {
            let (sin, cos) = (TAU * f64::from(step) / f64::from(around)).sin_cos();
            let uv = [(0.5 - 0.5 * sin) as f32, (0.5 - 0.5 * cos * normal.z) as f32];
            let at = self.corner(center + DVec3::new(cos, sin, 0.0) * radius, normal, uv);
            if let Some(before) = before {
                self.triangle([middle, before, at]);
            }
            before = Some(at);
        }
    }

    fn mesh(self) -> Mesh {
        Mesh::plain(self.vertices, self.indices)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the volume of the closed surface by the divergence theorem: a sixth of the triple products,
    /// each triangle turned outwards.
    fn volume(mesh: &Mesh) -> f64 {
        let corner = |index: u32| DVec3::from_array(mesh.vertices[index as usize].position.map(f64::from));
        let normal = |index: u32| DVec3::from_array(mesh.vertices[index as usize].normal.map(f64::from));
        mesh.indices
            .chunks_exact(3)
            .map(|at| {
                let [a, b, c] = [corner(at[0]), corner(at[1]), corner(at[2])];
                let mean = normal(at[0]) + normal(at[1]) + normal(at[2]);
                let outwards = (b - a).cross(c - a).dot(mean).signum();
                outwards * a.dot(b.cross(c)) / 6.0
            })
            .sum()
    }

    #[test]
    fn solids_have_the_volumes_of_their_formulas() {
        let near = |mesh: Mesh, formula: f64| {
            let part = volume(&mesh) / formula;
            assert!((0.99..=1.0 + 1e-6).contains(&part), "{part}");
        };
        near(cube(), 1.0);
        near(ball(96), 4.0 * PI / 3.0);
        near(cylinder(96), PI);
        near(capsule(96, 0.5, 2.0), PI / 6.0 + PI / 2.0);
        near(cone(96, 0.5, 2.0), PI / 6.0);
    }

    #[test]
    fn triangles_of_round_things_are_within_a_tenth_of_a_millimetre() {
        for radius in [0.01, 0.1, 1.0] {
            let mesh = ball(segments(radius));
            for at in mesh.indices.chunks_exact(3) {
                let corner = |index: u32| {
                    DVec3::from_array(mesh.vertices[index as usize].position.map(f64::from)) * radius
                };
                let middle = (corner(at[0]) + corner(at[1])) / 2.0;
                assert!(radius - middle.length() < 2.5 * ROUND, "{radius} {}", middle.length());
            }
        }
    }
}

//! Point of view and projection of a picture, as matrices of OpenGL: camera axes have x to the right, y up
//! and z backwards.

use glamx::{DPose3, DVec3};
use simd_model::sensor::Camera;

/// Maximum deviation of columns from those of a rotation: matrices come from single precision.
const ROUGH: f64 = 1e-3;

/// Largest magnitude of a matrix element: pictures are drawn in single precision, where the squares of larger
/// numbers are infinite.
const LARGEST: f64 = 1e12;

/// Intrinsics of a pinhole camera, pixels: see `CameraIntrinsics` of the schema.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Focal length divided by the width of a pixel.
    pub fx: f64,
    /// Focal length divided by the height of a pixel.
    pub fy: f64,
    /// Distance of the optical axis from the centre of the leftmost pixel.
    pub cx: f64,
    /// Distance of the optical axis from the centre of the topmost pixel.
    pub cy: f64,
}

/// Point of view and projection.
#[derive(Clone, Debug, PartialEq)]
pub struct Lens {
    /// `camera_from_world`, column by column.
    pub view: [f64; 16],
    /// `clip_from_camera`, column by column: visible points are between -1 and 1 times w.
    pub projection: [f64; 16],
    /// Intrinsics, for a robot's camera.
    pub intrinsics: Option<Intrinsics>,
    /// Distance of the near clipping plane, metres.
    pub near: f64,
    /// Distance of the far clipping plane, metres.
    pub far: f64,
}

/// Refusal of a matrix that cannot belong to a camera.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{element} is {value}; {expected}")]
pub struct BadMatrix {
    /// Name of the matrix or element.
    pub element: &'static str,
    /// Value.
    pub value: String,
    /// Permitted values, as "it must be ...".
    pub expected: &'static str,
}

/// Returns a camera's intrinsics. The optical axis is in the middle of the picture.
pub fn intrinsics(camera: &Camera) -> Intrinsics {
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let focal = 0.5 * width / (0.5 * camera.horizontal_field_of_view).tan();
    Intrinsics { fx: focal, fy: focal, cx: 0.5 * (width - 1.0), cy: 0.5 * (height - 1.0) }
}

impl Lens {
    /// Returns `fx`, `fy`, `cx`, `cy`, pixels; zeros unless it is a pinhole camera.
    pub fn pinhole(&self) -> [f64; 4] {
        self.intrinsics.map_or([0.0; 4], |Intrinsics { fx, fy, cx, cy }| [fx, fy, cx, cy])
    }

    /// Makes the lens of a sensor at `world_from_sensor`, which looks along x with z up.
    pub(super) fn of_camera(camera: &Camera, world_from_sensor: DPose3) -> Self {
        let (turn, from) = (world_from_sensor.rotation, world_from_sensor.translation);
        let (right, up, back) = (turn * -DVec3::Y, turn * DVec3::Z, turn * -DVec3::X);
        let of = intrinsics(camera);
        let Camera { width, height, near, far, .. } = *camera;
        // Shreiner et al., OpenGL Programming Guide, appendix on homogeneous coordinates: glFrustum.
        let depth = far - near;
        let mut projection = [0.0; 16];
        projection[0] = 2.0 * of.fx / f64::from(width);
        projection[5] = 2.0 * of.fy / f64::from(height);
        projection[10] = -(far + near) / depth;
        projection[11] = -1.0;
        projection[14] = -2.0 * far * near / depth;
        let view = [
            right.x,
            up.x,
            back.x,
            0.0,
            right.y,
            up.y,
            back.y,
            0.0,
            right.z,
            up.z,
            back.z,
            0.0,
            -right.dot(from),
            -up.dot(from),
            -back.dot(from),
            1.0,
        ];
        Self { view, projection, intrinsics: Some(of), near, far }
    }

    /// Makes a lens from matrices of a client.
    ///
    /// # Errors
    /// Returns an error if they cannot belong to a camera.
    pub fn of_matrices(view: [f64; 16], projection: [f64; 16]) -> Result<Self, BadMatrix> {
        let refuse = |element, value, expected| BadMatrix { element, value, expected };
        for (element, numbers) in [("view", &view), ("projection", &projection)] {
            if let Some(bad) = numbers.iter().find(|number| !(-LARGEST..=LARGEST).contains(*number)) {
                let expected = "all of its numbers must be between -1e12 and 1e12";
                return Err(refuse(element, format!("a matrix with {bad}"), expected));
            }
        }
        if !is_rigid(&view) {
            let expected = "it must turn and move, and nothing else, column by column";
            return Err(refuse("view", format!("{view:?}"), expected));
        }
        let (a, b) = (projection[10], projection[14]);
        let (near, far) = match (projection[11], projection[15]) {
            (-1.0, 0.0) => (b / (a - 1.0), b / (a + 1.0)),
            (0.0, 1.0) => ((b + 1.0) / a, (b - 1.0) / a),
            _ => {
                let expected = "it must be as gluPerspective, glFrustum or glOrtho make it, column by column";
                return Err(refuse("projection", format!("{projection:?}"), expected));
            }
        };
        let is_flat = projection[0] == 0.0 || projection[5] == 0.0;
        let is_behind = projection[11] == -1.0 && near <= 0.0;
        if is_flat || is_behind || !near.is_finite() || !far.is_finite() || far <= near {
            let value = format!("one from {near} m to {far} m");
            return Err(refuse(
                "projection",
                value,
                "it must have a width, a height, and be far beyond near",
            ));
        }
        Ok(Self { view, projection, intrinsics: None, near, far })
    }
}

/// Returns whether a matrix only rotates and translates.
fn is_rigid(matrix: &[f64; 16]) -> bool {
    let column = |first: usize| DVec3::new(matrix[first], matrix[first + 1], matrix[first + 2]);
    let (x, y, z) = (column(0), column(4), column(8));
    let is = |value: f64, wanted: f64| (value - wanted).abs() <= ROUGH;
    [x, y, z].iter().all(|axis| is(axis.length_squared(), 1.0))
        && [x.dot(y), y.dot(z), z.dot(x)].iter().all(|dot| is(*dot, 0.0))
        && is(x.cross(y).dot(z), 1.0)
        && [matrix[3], matrix[7], matrix[11]].iter().all(|number| *number == 0.0)
        && matrix[15] == 1.0
}

#[cfg(test)]
mod tests {
    use simd_model::sensor::Picture;

    use super::*;

    fn camera() -> Camera {
        Camera {
            picture: Picture::Color,
            width: 640,
            height: 480,
            horizontal_field_of_view: 1.2,
            near: 0.1,
            far: 50.0,
        }
    }

    /// Returns the normalised coordinates at which a point is seen, and its depth.
    fn seen(lens: &Lens, point: DVec3) -> (f64, f64, f64) {
        let apply = |m: &[f64; 16], v: [f64; 4]| -> [f64; 4] {
            std::array::from_fn(|row| (0..4).map(|column| m[4 * column + row] * v[column]).sum())
        };
        let [x, y, z, w] = apply(&lens.projection, apply(&lens.view, [point.x, point.y, point.z, 1.0]));
        (x / w, y / w, z / w)
    }

    #[test]
    fn a_camera_looks_along_x_with_z_up() {
        let pose = DPose3::new(DVec3::new(1.0, 2.0, 3.0), DVec3::Z * std::f64::consts::FRAC_PI_2);
        let lens = Lens::of_camera(&camera(), pose);
        // Rotated by a quarter turn to the left, it looks along y of the world.
        let (x, y, z) = seen(&lens, DVec3::new(1.0, 2.1, 3.0));
        assert!(x.abs() < 1e-9 && y.abs() < 1e-9 && (z + 1.0).abs() < 1e-9, "{x} {y} {z}");
        let (_, _, z) = seen(&lens, DVec3::new(1.0, 52.0, 3.0));
        assert!((z - 1.0).abs() < 1e-9, "{z}");
        // At the edge of the picture, 0.6 rad to the right, and above.
        let (x, y, _) = seen(&lens, DVec3::new(1.0 + 5.0 * 0.6_f64.tan(), 7.0, 3.0));
        assert!((x - 1.0).abs() < 1e-9 && y.abs() < 1e-9, "{x} {y}");
        let (_, y, _) = seen(&lens, DVec3::new(1.0, 7.0, 3.0 + 5.0 * 0.6_f64.tan() * 0.75));
        assert!((y - 1.0).abs() < 1e-9, "{y}");
    }

    #[test]
    fn intrinsics_say_what_the_projection_says() {
        let (lens, of) = (Lens::of_camera(&camera(), DPose3::IDENTITY), intrinsics(&camera()));
        let (forwards, right, down) = (4.0, 0.7, -0.3);
        let (x, y, _) = seen(&lens, DVec3::new(forwards, -right, -down));
        let (u, v) = (of.fx * right / forwards + of.cx, of.fy * down / forwards + of.cy);
        // Edges of the picture are half a pixel beyond the centres of its outer pixels.
        assert!((u - (0.5 * (x + 1.0) * 640.0 - 0.5)).abs() < 1e-9, "{u}");
        assert!((v - (0.5 * (1.0 - y) * 480.0 - 0.5)).abs() < 1e-9, "{v}");
    }

    #[test]
    fn matrices_say_how_far_is_seen_and_others_are_refused() {
        let lens = Lens::of_camera(&camera(), DPose3::IDENTITY);
        let again = Lens::of_matrices(lens.view, lens.projection).unwrap();
        assert!((again.near - 0.1).abs() < 1e-9 && (again.far - 50.0).abs() < 1e-6, "{again:?}");
        let mut parallel = [0.0; 16];
        // glOrtho(-2, 2, -1, 1, 0.5, 10.5)
        [parallel[0], parallel[5], parallel[10], parallel[14], parallel[15]] = [0.5, 1.0, -0.2, -1.1, 1.0];
        let of = Lens::of_matrices(lens.view, parallel).unwrap();
        assert!((of.near - 0.5).abs() < 1e-9 && (of.far - 10.5).abs() < 1e-9, "{of:?}");
        let mut scaled = lens.view;
        // The camera looks along x: its right is -y of the world.
        scaled[4] *= 2.0;
        let mut broken = lens.projection;
        broken[14] = f64::NAN;
        let mut endless = lens.projection;
        endless[0] = 1e300;
        for (view, projection, blamed) in [
            (scaled, lens.projection, "view"),
            ([0.0; 16], lens.projection, "view"),
            (lens.view, [0.0; 16], "projection"),
            (lens.view, broken, "projection"),
            (lens.view, endless, "projection"),
        ] {
            let refused = Lens::of_matrices(view, projection).unwrap_err().to_string();
            assert!(refused.starts_with(blamed), "{refused}");
        }
    }
}

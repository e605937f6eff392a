//! Rows of items and materials for the GPU, and the draw calls that cover them.

use std::cmp::Reverse;
use std::ops::Range;
use std::sync::Arc;

use glamx::{DAffine3, DMat3, DMat4, DVec3};

use crate::scene::{Item, Scene};

use super::pipelines::ITEM_BYTES;

/// A draw call: neighbouring rows with the same triangles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Drawn {
    /// Index of one of the items.
    pub(super) item: usize,
    pub(super) part: usize,
    pub(super) rows: Range<u32>,
}

/// Rows of one picture; their memory is reused for the next one.
#[derive(Debug, Default)]
pub(super) struct Rows {
    bytes: Vec<u8>,
    /// Opaque ones come first.
    drawn: Vec<Drawn>,
    opaque: usize,
    order: Vec<Entry>,
}

/// A part of an item that may be visible.
#[derive(Clone, Copy, Debug)]
struct Entry {
    item: usize,
    part: usize,
    is_translucent: bool,
    /// For translucent parts: their distance, as bits that sort like the number.
    depth: u64,
    /// Identity of the surface: parts of the same surface are drawn together.
    surface: usize,
}

impl Rows {
    /// Takes the items of a scene that may be visible. Translucent ones come last, the farthest first.
    pub(super) fn fill(&mut self, scene: &Scene) {
        let bounds = Bounds::new(scene.projection);
        self.fill_with(scene, |center, radius, _| bounds.may_show(center, radius));
    }

    /// Takes the items that cast shadows, wherever they are.
    pub(super) fn fill_casters(&mut self, scene: &Scene, casts: fn(&Item) -> bool) {
        self.fill_with(scene, |_, _, item| casts(item));
    }

    /// Takes items by their bounding balls, in the camera's frame.
    fn fill_with(&mut self, scene: &Scene, takes: impl Fn(DVec3, f64, &Item) -> bool) {
        self.bytes.clear();
        self.drawn.clear();
        self.order.clear();
        let camera_from_world = DAffine3::from_mat4(scene.view);
        for (index, item) in scene.items.iter().enumerate() {
            let (center, radius) = ball_of(item, &camera_from_world);
            if takes(center, radius, item) {
                self.sort_in(index, item, center);
            }
        }
        self.order.sort_unstable_by_key(|entry| {
            (entry.is_translucent, Reverse(entry.depth), entry.surface, entry.part, entry.item)
        });
        self.opaque = 0;
        let order = std::mem::take(&mut self.order);
        let mut last = None;
        for entry in &order {
            let Some(item) = scene.items.get(entry.item) else { continue };
            let row = self.write(item, entry.part, camera_from_world * item.world_from_mesh);
            let triangles = (entry.surface, entry.part, entry.is_translucent);
            match self.drawn.last_mut() {
                Some(drawn) if last == Some(triangles) => drawn.rows.end = row + 1,
                _ => self.drawn.push(Drawn { item: entry.item, part: entry.part, rows: row..row + 1 }),
            }
            last = Some(triangles);
            if !entry.is_translucent {
                self.opaque = self.drawn.len();
            }
        }
        self.order = order;
    }

    /// Returns the opaque ones.
    pub(super) fn opaque(&self) -> &[Drawn] {
        self.drawn.get(..self.opaque).unwrap_or_default()
    }

    /// Returns the translucent ones, the farthest first.
    pub(super) fn translucent(&self) -> &[Drawn] {
        self.drawn.get(self.opaque..).unwrap_or_default()
    }

    /// Returns the bytes for the GPU.
    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    fn sort_in(&mut self, index: usize, item: &Item, center: DVec3) {
        for (part, _) in item.surface.parts.iter().enumerate() {
            let alpha = color_of(item, part).map_or(0.0, |color| color[3]);
            if alpha <= 0.0 {
                continue;
            }
            let is_translucent = shows_through(item, part);
            // Positive floats sort as their bits.
            let depth = if is_translucent { (-center.z).max(0.0).to_bits() } else { 0 };
            let surface = Arc::as_ptr(&item.surface) as usize;
            self.order.push(Entry { item: index, part, is_translucent, depth, surface });
        }
    }

    /// Appends a row, and returns its number.
    fn write(&mut self, item: &Item, part: usize, camera_from_mesh: DAffine3) -> u32 {
        let row = u32::try_from(self.bytes.len() as u64 / ITEM_BYTES).unwrap_or(u32::MAX);
        let linear = camera_from_mesh.matrix3.transpose();
        let shift = camera_from_mesh.translation;
        for (axis, shift) in [(linear.x_axis, shift.x), (linear.y_axis, shift.y), (linear.z_axis, shift.z)] {
            self.put(&[axis.x, axis.y, axis.z, shift].map(|value| value as f32));
        }
        let turn = turn_of_normals(camera_from_mesh.matrix3).transpose();
        for axis in [turn.x_axis, turn.y_axis, turn.z_axis] {
            self.put(&axis.to_array().map(|value| value as f32));
        }
        self.put(&color_of(item, part).unwrap_or_default());
        self.bytes.extend_from_slice(&item.id.to_ne_bytes());
        row
    }

    fn put(&mut self, values: &[f32]) {
        self.bytes.extend(values.iter().flat_map(|value| value.to_ne_bytes()));
    }
}

/// Returns the bounding ball of an item, in a frame.
pub(super) fn ball_of(item: &Item, frame_from_world: &DAffine3) -> (DVec3, f64) {
    let frame_from_mesh = *frame_from_world * item.world_from_mesh;
    let matrix = frame_from_mesh.matrix3;
    // The Frobenius norm bounds the stretch in every direction.
    let stretch =
        (matrix.x_axis.length_squared() + matrix.y_axis.length_squared() + matrix.z_axis.length_squared())
            .sqrt();
    let center = frame_from_mesh.transform_point3(DVec3::from_array(item.surface.center));
    (center, stretch * item.surface.radius)
}

/// Returns whether any part of it hides the surfaces behind.
pub(super) fn hides(item: &Item) -> bool {
    (0..item.surface.parts.len()).any(|part| !shows_through(item, part))
}

/// Returns the part's own colour, or the item's.
fn color_of(item: &Item, part: usize) -> Option<[f32; 4]> {
    item.surface.parts.get(part).map(|part| part.color.unwrap_or(item.color))
}

/// Returns whether surfaces behind it are visible through it.
fn shows_through(item: &Item, part: usize) -> bool {
    let has_holes = item.surface.parts.get(part).is_some_and(|part| part.is_translucent);
    has_holes || color_of(item, part).is_some_and(|[.., alpha]| alpha < 1.0)
}

/// Returns the matrix for normals: the transpose of the inverse, which keeps them perpendicular on stretched
/// surfaces. For flattened ones, returns the matrix itself.
fn turn_of_normals(matrix: DMat3) -> DMat3 {
    let turn = matrix.inverse().transpose();
    if turn.is_finite() { turn } else { matrix }
}

/// Planes that bound the camera's view, in its frame: visible points have `n . x + d` of at least 0 for each.
#[derive(Debug)]
struct Bounds([(DVec3, f64); 6]);

impl Bounds {
    /// Computes them from the rows of the projection (Gribb and Hartmann, *Fast extraction of viewing frustum
    /// planes*, 2001).
    fn new(projection: DMat4) -> Self {
        let rows = projection.transpose();
        let (x, y, z, w) = (rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis);
        Self([w + x, w - x, w + y, w - y, w + z, w - z].map(|plane| {
            let normal = plane.truncate();
            let length = normal.length();
            (normal / length, plane.w / length)
        }))
    }

    /// Returns whether a part of a ball may be visible. A degenerate plane, such as the far one of an endless
    /// projection, bounds nothing.
    fn may_show(&self, center: DVec3, radius: f64) -> bool {
        self.0.iter().all(|(normal, shift)| {
            let distance = normal.dot(center) + shift;
            distance.is_nan() || distance >= -radius
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_behind_or_outside_of_the_view_are_left_out() {
        let bounds = Bounds::new(glamx::dcamera::rh::proj::opengl::perspective(
            std::f64::consts::FRAC_PI_2,
            1.0,
            0.1,
            10.0,
        ));
        for (center, radius, is_seen) in [
            (DVec3::new(0.0, 0.0, -5.0), 0.1, true),
            (DVec3::new(0.0, 0.0, 5.0), 1.0, false),
            (DVec3::new(0.0, 0.0, 0.5), 1.0, true),
            (DVec3::new(7.0, 0.0, -5.0), 1.0, false),
            (DVec3::new(6.0, 0.0, -5.0), 1.0, true),
            (DVec3::new(0.0, 0.0, -12.0), 1.0, false),
        ] {
            assert_eq!(bounds.may_show(center, radius), is_seen, "{center} {radius}");
        }
    }

    #[test]
    fn normals_of_what_is_stretched_stay_upright() {
        let matrix = DMat3::from_diagonal(DVec3::new(2.0, 1.0, 1.0));
        // The normal of the plane x + y = 1, which becomes x / 2 + y = 1.
        let normal = (turn_of_normals(matrix) * DVec3::new(1.0, 1.0, 0.0)).normalize();
        assert!(normal.distance(DVec3::new(0.5, 1.0, 0.0).normalize()) < 1e-12);
        let flat = DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0));
        assert_eq!(turn_of_normals(flat), flat);
    }
}

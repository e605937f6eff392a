//! Surfaces of triangles: meshes and height fields.

use std::sync::Arc;

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::bounding_volume::Aabb;
use rapier3d_f64::parry::query::PointQuery as _;
use rapier3d_f64::parry::shape::{HeightField, Shape, TriMesh, Triangle};

/// Neighbours of each triangle beyond its edges, from corner 0 to 1, 1 to 2 and 2 to 0. A neighbour is
/// [`NONE`] if there is not exactly one.
pub(super) type Neighbours = Vec<[u32; 3]>;

const NONE: u32 = u32::MAX;

/// A surface of triangles.
#[derive(Clone, Copy)]
pub(super) enum Facets<'a> {
    /// A mesh; both of its sides touch.
    Mesh(&'a TriMesh, &'a Neighbours),
    /// A height field; all that is below it, along parry's y, is inside.
    Field(&'a HeightField),
}

impl<'a> Facets<'a> {
    /// Returns the surface of a shape that consists of triangles.
    pub(super) fn of(shape: &'a dyn Shape, neighbours: Option<&'a Arc<Neighbours>>) -> Option<Self> {
        if let Some(field) = shape.as_heightfield() {
            return Some(Self::Field(field));
        }
        Some(Self::Mesh(shape.as_trimesh()?, neighbours?))
    }

    /// Fills in the triangles that may be within a box, in order.
    pub(super) fn within(self, bounds: &Aabb, found: &mut Vec<u32>) {
        found.clear();
        match self {
            Self::Mesh(mesh, _) => found.extend(mesh.bvh().intersect_aabb(bounds)),
            Self::Field(field) => {
                // Heights are ignored: everything far below the surface is inside.
                let most = field.root_aabb().maxs.y.max(bounds.maxs.y);
                let column = Aabb::new(bounds.mins, bounds.maxs.with_y(most));
                field.map_elements_in_local_aabb(&column, &mut |id, _triangle| found.push(id));
            }
        }
        // The tree returns them in a different order.
        found.sort_unstable();
    }

    /// Fills in the triangles within a box, and returns true, if there are at most `most`; else returns
    /// false.
    pub(super) fn few_within(self, bounds: &Aabb, most: usize, found: &mut Vec<u32>) -> bool {
        match self {
            Self::Mesh(mesh, _) => {
                found.clear();
                found.extend(mesh.bvh().intersect_aabb(bounds).take(most + 1));
                found.sort_unstable();
            }
            Self::Field(field) => {
                let size = bounds.maxs - bounds.mins;
                let cells = (size.x / field.cell_width() + 1.0) * (size.z / field.cell_height() + 1.0);
                // Two triangles for each cell; some are outside.
                if cells > most as f64 {
                    return false;
                }
                self.within(bounds, found);
            }
        }
        found.len() <= most
    }

    /// Returns whether it is a mesh without a border, which has an inside.
    pub(super) fn is_closed(self) -> bool {
        match self {
            Self::Mesh(_, neighbours) => neighbours.iter().flatten().all(|next| *next != NONE),
            Self::Field(_) => false,
        }
    }

    /// Returns a triangle.
    pub(super) fn triangle(self, id: u32) -> Option<Triangle> {
        match self {
            Self::Mesh(mesh, neighbours) => ((id as usize) < neighbours.len()).then(|| mesh.triangle(id)),
            Self::Field(field) => field.triangle_at_id(id),
        }
    }

    /// Returns a point of the surface near another one; for a mesh the nearest.
    pub(super) fn near(self, point: DVec3) -> Option<DVec3> {
        match self {
            Self::Mesh(mesh, _) => Some(mesh.project_local_point(point, false).point),
            Self::Field(field) => {
                let (i, j) = field.closest_cell_at_point(point);
                let (first, second) = field.triangles_at(i, j);
                let found = first.or(second)?.project_local_point(point, false);
                Some(found.point)
            }
        }
    }

    /// Returns the triangle beyond an edge.
    pub(super) fn beyond(self, id: u32, edge: usize) -> Option<Triangle> {
        let next = match self {
            Self::Mesh(_, neighbours) => neighbours.get(id as usize)?[edge],
            Self::Field(field) => beyond_in_field(field, id, edge)?,
        };
        self.triangle(next)
    }
}

/// Returns the triangle beyond an edge of a height field. parry numbers cells along its z first, then along
/// its x. The halves of all cells are in sequence: first those with the cell's least corner, then those with
/// its greatest.
fn beyond_in_field(field: &HeightField, id: u32, edge: usize) -> Option<u32> {
    let (rows, columns) = (field.nrows() as u32, field.ncols() as u32);
    let cells = rows * columns;
    let is_first = id < cells;
    let cell = if is_first { id } else { id - cells };
    let (i, j) = (cell % rows, cell / rows);
    let at = |i: Option<u32>, j: Option<u32>| {
        let (i, j) = (i.filter(|i| *i < rows)?, j.filter(|j| *j < columns)?);
        Some(j * rows + i)
    };
    if is_first {
        let cell = match edge {
            0 => at(Some(i), j.checked_sub(1)),
            1 => Some(cell),
            _ => at(i.checked_sub(1), Some(j)),
        };
        cell.map(|cell| cell + cells)
    } else {
        match edge {
            0 => at(Some(i + 1), Some(j)),
            1 => at(Some(i), Some(j + 1)),
            _ => Some(cell),
        }
    }
}

/// Returns the neighbours of triangles.
pub(super) fn neighbours(triangles: &[[u32; 3]]) -> Neighbours {
    let mut edges: Vec<([u32; 2], u32, u8)> = Vec::with_capacity(3 * triangles.len());
    for (id, corners) in (0..).zip(triangles) {
        for edge in 0..3_u8 {
            let (from, to) = (corners[usize::from(edge)], corners[(usize::from(edge) + 1) % 3]);
            edges.push(([from.min(to), from.max(to)], id, edge));
        }
    }
    edges.sort_unstable();
    let mut neighbours = vec![[NONE; 3]; triangles.len()];
    for shared in edges.chunk_by(|a, b| a.0 == b.0) {
        if let &[(_, a, edge_a), (_, b, edge_b)] = shared {
            neighbours[a as usize][usize::from(edge_a)] = b;
            neighbours[b as usize][usize::from(edge_b)] = a;
        }
    }
    neighbours
}

/// Returns a height field and the ground below it, as deep as it is long or wide, in its axes.
pub(super) fn ground(field: &HeightField) -> Aabb {
    let Aabb { mins, maxs } = *field.root_aabb();
    Aabb::new(mins - DVec3::Y * (maxs - mins).max_element(), maxs)
}

/// Returns the triangle above the centre of a shape, in a height field's axes, if it is below the surface.
pub(super) fn above(field: &HeightField, middle: DVec3) -> Option<Triangle> {
    let (i, j) = field.cell_at_point(middle)?;
    let (first, second) = field.triangles_at(i, j);
    // The first half has the corner at the cell's least x and z.
    let along = |start: f64, size: f64, at: f64| (at - start) / size;
    let is_first = along(field.x_at(j), field.cell_width(), middle.x)
        + along(field.z_at(i), field.cell_height(), middle.z)
        <= 1.0;
    let triangle = if is_first { first? } else { second? };
    let normal = (triangle.b - triangle.a).cross(triangle.c - triangle.a);
    ((middle - triangle.a).dot(normal) < 0.0).then_some(triangle)
}

/// Returns a triangle's normal of unit length; `None` if it has no area.
pub(super) fn unit_normal(triangle: &Triangle) -> Option<DVec3> {
    (triangle.b - triangle.a).cross(triangle.c - triangle.a).try_normalize()
}

/// Returns `world_from_other` in the axes of a surface.
pub(super) fn relative(world_from_surface: &DPose3, world_from_other: &DPose3) -> DPose3 {
    world_from_surface.inverse() * *world_from_other
}

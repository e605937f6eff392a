//! Contacts of a convex shape with a surface of triangles.
//!
//! Each triangle is tested separately, so a shape that lies across the edge of two would touch that edge from
//! whatever direction is the nearest. The two triangles that meet in an edge determine the directions from
//! which it can be touched: those that lead into neither of them. From any other direction the face touches,
//! or nothing does.

use glamx::{DMat3, DPose3, DVec3};
use rapier3d_f64::parry::bounding_volume::{Aabb, BoundingVolume as _};
use rapier3d_f64::parry::query::ContactManifold;
use rapier3d_f64::parry::query::details::NormalConstraints;
use rapier3d_f64::parry::shape::{Shape, Triangle};

use super::clip::{clip_convex, is_capsule};
use super::facets::{Facets, above, unit_normal};
use super::hull::Graph;
use super::plane::{ROUNDING, outermost_beyond};
use super::reduce::{MAX_POINTS, needs_middle, reduce};
use super::seams::{passes_edge, seam_height};

/// Maximum number of points of two colliders: eight directions.
pub const MAX_PAIR_POINTS: usize = 8 * MAX_POINTS;

/// Points whose normals differ by less than this angle, as a cosine, are of one contact: 5 degrees.
pub(super) const SAME_DIRECTION: f64 = 0.9962;

/// Largest angle at which a direction does not count as leading into a triangle, radians.
const MAX_INWARD_ANGLE: f64 = 1e-9;

/// Tolerance at which corners are equally far along a direction, as a part of the triangle's size; both are
/// then touched.
const SAME_REACH: f64 = 1e-6;

/// Smallest angle between a direction and a face that shows the touched side, radians.
const SIDEWAYS: f64 = 0.05;

/// Factor of the distance from a plane at which a shape does not touch it, relative to its radius plus the
/// contact distance.
const FAR: f64 = 1.000_001;

/// Smallest radial part of a direction that touches a cylinder's side; below it the cylinder stands on its
/// end.
const LEAST_RADIAL: f64 = 0.1;

/// Angle from the line of contact beyond which points of a cylinder's side are dropped, radians.
const MAX_LINE_ANGLE: f64 = 1e-3;

/// Number of triangles between two calls of the interrupt.
const BETWEEN_INTERRUPTS: usize = 1_024;

/// Contact of a shape with a triangle, in the axes of the surface and of the shape.
#[derive(Clone, Copy, Debug)]
pub(super) struct FacetPoint {
    pub(super) on_surface: DVec3,
    pub(super) on_shape: DVec3,
    /// Normal from the surface to the shape, in the surface's axes.
    pub(super) normal: DVec3,
    pub(super) distance: f64,
}

impl FacetPoint {
    /// Returns the midpoint of two points of one direction.
    fn between(p: &Self, q: &Self) -> Self {
        Self {
            on_surface: p.on_surface.midpoint(q.on_surface),
            on_shape: p.on_shape.midpoint(q.on_shape),
            normal: p.normal,
            distance: 0.5 * (p.distance + q.distance),
        }
    }
}

/// A convex shape that may touch a surface.
pub(super) struct Convex<'a> {
    pub(super) shape: &'a dyn Shape,
    /// Edges of a hull of many corners.
    pub(super) graph: Option<&'a Graph>,
    /// Centre in its axes, and its largest distance from there.
    pub(super) middle: DVec3,
    pub(super) radius: f64,
    /// Box around it, as centre and half lengths in its axes.
    pub(super) local_box: [DVec3; 2],
    /// Box around it and its contact distance, in the surface's axes.
    pub(super) bounds: Aabb,
}

/// Finds contacts with triangles. Reuses its memory, and keeps no other state.
#[derive(Default)]
pub(super) struct FacetContact {
    manifold: ContactManifold<(), ()>,
    triangles: Vec<u32>,
    found: Vec<FacetPoint>,
    /// Points of one direction.
    group: Vec<usize>,
    places: Vec<(DVec3, f64)>,
    kept: Vec<FacetPoint>,
}

impl FacetContact {
    /// Finds the contacts of a surface and a convex shape that are nearer than `within`; `None` if
    /// interrupted. If known, the triangles that may be near come with the surface, in order and each with
    /// its box.
    pub(super) fn find(
        &mut self,
        (surface, known): (Facets<'_>, Option<&[(u32, Aabb)]>),
        convex: &Convex<'_>,
        surface_from_shape: &DPose3,
        within: f64,
        interrupt: &dyn Fn() -> bool,
    ) -> Option<&[FacetPoint]> {
        self.found.clear();
        let middle = surface_from_shape.transform_point(convex.middle);
        let sunk = match surface {
            Facets::Field(field) => above(field, middle),
            Facets::Mesh(..) => None,
        };
        if let Some(triangle) = sunk {
            self.below(&triangle, convex, surface_from_shape, within);
        } else {
            let mut triangles = std::mem::take(&mut self.triangles);
            match known {
                Some(known) => {
                    triangles.clear();
                    let near = known.iter().filter(|(_, bounds)| bounds.intersects(&convex.bounds));
                    triangles.extend(near.map(|(id, _)| *id));
                }
                None => surface.within(&convex.bounds, &mut triangles),
            }
            let is_whole =
                self.touch_all(surface, &triangles, convex, surface_from_shape, (middle, within), interrupt);
            self.triangles = triangles;
            if !is_whole {
                return None;
            }
        }
        self.roll_on_line(convex.shape, surface_from_shape);
        self.reduce(is_capsule(convex.shape));
        Some(&self.kept)
    }

    /// Tests these triangles. Returns false if interrupted.
    fn touch_all(
        &mut self,
        surface: Facets<'_>,
        triangles: &[u32],
        convex: &Convex<'_>,
        surface_from_shape: &DPose3,
        (middle, within): (DVec3, f64),
        interrupt: &dyn Fn() -> bool,
    ) -> bool {
        if triangles.is_empty() {
            return true;
        }
        let reach = Reach::new(convex.local_box, surface_from_shape, within);
        for (count, &id) in (1..).zip(triangles) {
            if count % BETWEEN_INTERRUPTS == 0 && interrupt() {
                return false;
            }
            let Some(triangle) = surface.triangle(id).filter(|triangle| reach.meets(triangle)) else {
                continue;
            };
            self.touch(surface, (id, &triangle), (convex, middle), surface_from_shape, within);
        }
        true
    }

    /// Adds the contact of a shape whose centre is in the ground with the plane of the triangle above it.
    fn below(&mut self, triangle: &Triangle, convex: &Convex<'_>, surface_from_shape: &DPose3, within: f64) {
        let Some(normal) = unit_normal(triangle) else { return };
        let inward = surface_from_shape.rotation.inverse() * -normal;
        let least = (surface_from_shape.translation - triangle.a).dot(normal) - within - ROUNDING;
        outermost_beyond((convex.shape, convex.graph), (inward, false), least, |point, radius| {
            let at = surface_from_shape.transform_point(point);
            let height = (at - triangle.a).dot(normal);
            if height - radius < within {
                self.found.push(FacetPoint {
                    on_surface: at - normal * height,
                    on_shape: point + inward * radius,
                    normal,
                    distance: height - radius,
                });
            }
        });
    }

    fn touch(
        &mut self,
        surface: Facets<'_>,
        (id, triangle): (u32, &Triangle),
        (convex, middle): (&Convex<'_>, DVec3),
        surface_from_shape: &DPose3,
        within: f64,
    ) {
        // Well above its plane, or below it, as for most triangles of a slope, whose bounds are tall.
        let normal = (triangle.b - triangle.a).cross(triangle.c - triangle.a);
        let height = (middle - triangle.a).dot(normal);
        if height.abs() > FAR * (convex.radius + within) * normal.length() {
            return;
        }
        let Some(cone) = Cone::new(surface, id, triangle, middle) else { return };
        let sides: [(&dyn Shape, Option<&Graph>); 2] = [(triangle, None), (convex.shape, convex.graph)];
        let found = clip_convex(sides, Some(&cone), surface_from_shape, within, &mut self.manifold);
        let normal = self.manifold.local_n1;
        if found.is_none() {
            return;
        }
        let shape = (convex.shape, convex.graph);
        let height = seam_height([convex.radius; 2]);
        let near = self.manifold.points.iter().filter(|point| {
            let on = (point.local_p1, normal);
            point.dist < within
                && !passes_edge(surface, (id, triangle), on, shape, surface_from_shape, height)
        });
        self.found.extend(near.map(|point| FacetPoint {
            on_surface: point.local_p1,
            on_shape: point.local_p2,
            normal,
            distance: point.dist,
        }));
    }

    /// Moves the points of a lying cylinder to its line of contact with a face, and drops the others.
    ///
    /// Points off this line come from neighbours of the triangle below. They would stop a cylinder that rolls
    /// over an edge as it comes down there. Clipping finds the others to 1e-7 m, and a wheel would drift off
    /// its line by that.
    fn roll_on_line(&mut self, shape: &dyn Shape, surface_from_shape: &DPose3) {
        let Some(cylinder) = shape.as_cylinder() else { return };
        let shape_from_surface = surface_from_shape.rotation.inverse();
        self.found.retain_mut(|point| {
            // A cylinder's axis is y.
            let across = |vector: DVec3| DVec3::new(vector.x, 0.0, vector.z);
            let (towards, arm) = (across(shape_from_surface * -point.normal), across(point.on_shape));
            if towards.length() < LEAST_RADIAL || arm.length() < 0.5 * cylinder.radius {
                return true;
            }
            if towards.cross(arm).length() > MAX_LINE_ANGLE * towards.length() * arm.length()
                || towards.dot(arm) < 0.0
            {
                return false;
            }
            let line = towards * (cylinder.radius / towards.length());
            point.on_shape = DVec3::new(line.x, point.on_shape.y, line.z);
            let at = surface_from_shape.transform_point(point.on_shape);
            point.distance = (at - point.on_surface).dot(point.normal);
            point.on_surface = at - point.normal * point.distance;
            true
        });
    }

    /// Keeps points for each direction that carry the same load as all of its points.
    fn reduce(&mut self, is_capsule: bool) {
        let Self { found, group, places, kept, .. } = self;
        kept.clear();
        while kept.len() <= MAX_PAIR_POINTS - MAX_POINTS {
            let deepest = found.iter().min_by(|a, b| a.distance.total_cmp(&b.distance));
            let Some(&FacetPoint { normal, .. }) = deepest else { return };
            group.clear();
            places.clear();
            for (i, point) in found.iter().enumerate() {
                if point.normal.dot(normal) >= SAME_DIRECTION {
                    group.push(i);
                    places.push((point.on_surface, point.distance));
                }
            }
            let mut chosen = [0; MAX_POINTS];
            let count = reduce(places, normal, &mut chosen);
            kept.extend(chosen[..count].iter().map(|&i| found[group[i]]));
            if let ([p, q], false) = (&chosen[..count], is_capsule) {
                let [p, q] = [*p, *q].map(|i| found[group[i]]);
                kept.extend(needs_middle([p.on_surface, q.on_surface]).then(|| FacetPoint::between(&p, &q)));
            }
            found.retain(|point| point.normal.dot(normal) < SAME_DIRECTION);
        }
    }
}

/// Box around a shape in its own axes, and its contact distance. For an oblique slab it is much smaller than
/// its box in the surface's axes.
struct Reach {
    shape_from_surface: DMat3,
    translation: DVec3,
    bounds: Aabb,
}

impl Reach {
    fn new([middle, half]: [DVec3; 2], surface_from_shape: &DPose3, within: f64) -> Self {
        let inverse = surface_from_shape.inverse();
        Self {
            shape_from_surface: DMat3::from_quat(inverse.rotation),
            translation: inverse.translation,
            bounds: Aabb::from_half_extents(middle, half).loosened(within * FAR),
        }
    }

    /// Returns whether a triangle may be within the contact distance.
    fn meets(&self, triangle: &Triangle) -> bool {
        let corner = |corner: DVec3| self.shape_from_surface * corner + self.translation;
        let (a, b, c) = (corner(triangle.a), corner(triangle.b), corner(triangle.c));
        let (least, most) = (a.min(b).min(c), a.max(b).max(c));
        least.cmple(self.bounds.maxs).all() && self.bounds.mins.cmple(most).all()
    }
}

/// Directions from which a triangle can be touched.
struct Cone {
    normal: DVec3,
    corners: [DVec3; 3],
    /// Directions from each edge into the triangle, perpendicular to the edge and in its plane.
    inward: [DVec3; 3],
    /// The same directions for the triangles beyond the edges.
    beyond: [Option<DVec3>; 3],
    /// Side of the other shape's centre: 1 or -1.
    side: f64,
    /// Whether only one side touches.
    one_sided: bool,
}

impl Cone {
    fn new(surface: Facets<'_>, id: u32, triangle: &Triangle, middle: DVec3) -> Option<Self> {
        let normal = unit_normal(triangle)?;
        let corners = [triangle.a, triangle.b, triangle.c];
        let mut inward = [DVec3::ZERO; 3];
        let mut beyond = [None; 3];
        for edge in 0..3 {
            let (from, to) = (corners[edge], corners[(edge + 1) % 3]);
            let along = (to - from).normalize_or_zero();
            let across = |point: DVec3| {
                let way = point - from;
                (way - along * way.dot(along)).try_normalize()
            };
            inward[edge] = across(corners[(edge + 2) % 3])?;
            beyond[edge] = surface.beyond(id, edge).and_then(|next| {
                // Its corner that is not on the edge.
                let off = |point: &DVec3| {
                    let way = *point - from;
                    (way - along * way.dot(along)).length_squared()
                };
                let corner = [next.a, next.b, next.c].into_iter().max_by(|a, b| off(a).total_cmp(&off(b)));
                corner.and_then(across)
            });
        }
        let one_sided = matches!(surface, Facets::Field(_));
        let is_front = (middle - triangle.a).dot(normal) >= 0.0;
        let side = if is_front || one_sided { 1.0 } else { -1.0 };
        Some(Self { normal, corners, inward, beyond, side, one_sided })
    }
}

impl Cone {
    /// Returns the edges that are touched from a direction: the edge that lies farthest along it, or the
    /// edges of the farthest corner. A direction may lead out of an obtuse triangle over an edge that is far
    /// away.
    fn touched(&self, direction: DVec3) -> [bool; 3] {
        let along = self.corners.map(|corner| (corner - self.corners[0]).dot(direction));
        let most = along.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let size =
            self.corners.map(|corner| corner.distance(self.corners[0])).into_iter().fold(0.0, f64::max);
        let is_far = along.map(|along| along >= most - SAME_REACH * size);
        let far = is_far.into_iter().filter(|is_far| *is_far).count();
        [0, 1, 2].map(|edge| {
            let [from, to] = [is_far[edge], is_far[(edge + 1) % 3]];
            if far == 1 { from || to } else { from && to }
        })
    }
}

impl NormalConstraints for Cone {
    fn project_local_normal_mut(&self, direction: &mut DVec3) -> bool {
        let along = direction.dot(self.normal);
        let touched = self.touched(*direction);
        let mut edges =
            self.inward.iter().zip(&self.beyond).zip(touched).filter(|(_, is_touched)| *is_touched);
        let is_open = edges.all(|((inward, beyond), _)| {
            direction.dot(*inward) >= -MAX_INWARD_ANGLE
                || beyond.is_none_or(|beyond| direction.dot(beyond) <= MAX_INWARD_ANGLE)
        });
        if is_open && !(self.one_sided && along <= 0.0) {
            return true;
        }
        let sideways = along.abs() < SIDEWAYS || self.one_sided;
        *direction = self.normal * if sideways { self.side } else { along.signum() };
        true
    }
}

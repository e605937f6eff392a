//! Where a convex shape touches a surface of triangles.
//!
//! Each triangle is looked at on its own, so that a shape which lies across the edge of two would touch that edge, from
//! whatever direction is the nearest. Which directions an edge can be touched from follows from the two triangles that
//! meet in it: those that lead into neither of them. From any other one the face is touched, or nothing.

use glamx::{DMat3, DPose3, DVec3};
use rapier3d_f64::parry::bounding_volume::{Aabb, BoundingVolume as _};
use rapier3d_f64::parry::query::ContactManifold;
use rapier3d_f64::parry::query::details::NormalConstraints;
use rapier3d_f64::parry::shape::{Shape, Triangle};

use super::facets::{Facets, above, unit_normal};
use super::hull::Graph;
use super::narrow::{clip_convex, is_capsule};
use super::plane::{ROUNDING, outermost_beyond};
use super::reduce::{MOST, needs_middle, reduce};
use super::seams::{passes_edge, seam_height};

/// Points of two colliders at the most: those of eight directions.
pub const MOST_OF_PAIR: usize = 8 * MOST;

/// Points whose normals differ by less than this angle, as a cosine, are of one contact: 5 degrees.
const SAME_DIRECTION: f64 = 0.9962;

/// A direction that leads less than this into a triangle does not lead into it, radians.
const INTO: f64 = 1e-9;

/// Corners that lie equally far along a direction, but for this part of the triangle's size, are both touched from there.
const SAME_REACH: f64 = 1e-6;

/// A direction that is at less than this angle to a face, radians, does not say from which side it is touched.
const SIDEWAYS: f64 = 0.05;

/// A shape whose middle is farther from a plane than it reaches, and than contacts are looked for, by this factor, does
/// not touch it.
const FAR: f64 = 1.000_001;

/// A cylinder whose side is touched from a direction with less than this part across its axis stands on its end.
const LEAST_RADIAL: f64 = 0.1;

/// Points of a cylinder's side are beside the line that it touches with from this angle on, radians.
const BESIDE: f64 = 1e-3;

/// Triangles that are looked at before it is asked again whether the step is interrupted.
const BETWEEN_INTERRUPTS: usize = 1_024;

/// A point where a shape touches a triangle, in the axes of the surface and of the shape.
#[derive(Clone, Copy)]
pub(super) struct FacetPoint {
    pub(super) on_surface: DVec3,
    pub(super) on_shape: DVec3,
    /// From the surface to the shape, in the surface's axes.
    pub(super) normal: DVec3,
    pub(super) distance: f64,
}

impl FacetPoint {
    /// The point in the middle of two of one direction.
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
    /// Of a hull of many corners: its edges.
    pub(super) graph: Option<&'a Graph>,
    /// Its middle, in its own axes, and how far it reaches from there.
    pub(super) middle: DVec3,
    pub(super) radius: f64,
    /// The box around it, as middle and half lengths in its axes.
    pub(super) local_box: [DVec3; 2],
    /// A box around it and how far around it contacts are looked for, in the surface's axes.
    pub(super) bounds: Aabb,
}

/// Finds such points. Keeps its memory, and no more.
#[derive(Default)]
pub(super) struct FacetContact {
    manifold: ContactManifold<(), ()>,
    triangles: Vec<u32>,
    found: Vec<FacetPoint>,
    /// Of one direction.
    group: Vec<usize>,
    places: Vec<(DVec3, f64)>,
    kept: Vec<FacetPoint>,
}

impl FacetContact {
    /// Those of a surface and a convex shape, nearer than `within`; `None` where it was interrupted. With a surface come those of its
    /// triangles, in order and each with its box, that alone may be near, where they are known.
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

    /// Looks at these triangles. False where it was interrupted.
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

    /// A shape whose middle is in the ground touches the plane of the triangle above it.
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
        // Well above its plane, or below it: most triangles of a slope, whose bounds are tall.
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

    /// Puts the points of a lying cylinder on the line that it touches a face with, and drops those beside it.
    ///
    /// Points beside it come of triangles next to the one below, and a cylinder that rolls over one would be stopped as it comes down
    /// there. Clipping finds the others to 1e-7 m, and a wheel would leave its line by that.
    fn roll_on_line(&mut self, shape: &dyn Shape, surface_from_shape: &DPose3) {
        let Some(cylinder) = shape.as_cylinder() else { return };
        let shape_from_surface = surface_from_shape.rotation.inverse();
        self.found.retain_mut(|point| {
            // A cylinder stands along y.
            let across = |vector: DVec3| DVec3::new(vector.x, 0.0, vector.z);
            let (towards, arm) = (across(shape_from_surface * -point.normal), across(point.on_shape));
            if towards.length() < LEAST_RADIAL || arm.length() < 0.5 * cylinder.radius {
                return true;
            }
            if towards.cross(arm).length() > BESIDE * towards.length() * arm.length()
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

    /// Keeps of each direction what carries as all of its points would.
    fn reduce(&mut self, is_capsule: bool) {
        let Self { found, group, places, kept, .. } = self;
        kept.clear();
        while kept.len() <= MOST_OF_PAIR - MOST {
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
            let mut chosen = [0; MOST];
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

/// The box around a shape in its own axes, and what it is looked around for: of a slab that lies at an angle much less
/// than its box in the surface's axes.
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

    /// Whether a triangle may be that near.
    fn meets(&self, triangle: &Triangle) -> bool {
        let corner = |corner: DVec3| self.shape_from_surface * corner + self.translation;
        let (a, b, c) = (corner(triangle.a), corner(triangle.b), corner(triangle.c));
        let (least, most) = (a.min(b).min(c), a.max(b).max(c));
        least.cmple(self.bounds.maxs).all() && self.bounds.mins.cmple(most).all()
    }
}

/// The directions from which a triangle can be touched.
struct Cone {
    normal: DVec3,
    corners: [DVec3; 3],
    /// From each edge into the triangle, across the edge and in its plane.
    inward: [DVec3; 3],
    /// The same for what is beyond the edge.
    beyond: [Option<DVec3>; 3],
    /// On which side the middle of the other shape is: 1 or -1.
    side: f64,
    /// Only one side touches.
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
    /// Which edges what comes from a direction touches: the one that lies farthest along it, or those of the corner that does.
    /// Of an obtuse triangle a direction may lead out over an edge that is nowhere near.
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
            direction.dot(*inward) >= -INTO || beyond.is_none_or(|beyond| direction.dot(beyond) <= INTO)
        });
        if is_open && !(self.one_sided && along <= 0.0) {
            return true;
        }
        let sideways = along.abs() < SIDEWAYS || self.one_sided;
        *direction = self.normal * if sideways { self.side } else { along.signum() };
        true
    }
}

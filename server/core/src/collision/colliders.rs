//! Shapes of one robot in the world: their poses, the distance around them within which contacts are looked
//! for, and their surfaces.

mod look_ahead;
mod prefetch;
mod rest_pose;
mod size;

use std::fmt;
use std::sync::Arc;

use glamx::{DMat3, DPose3, DVec3};
use rapier3d_f64::parry::shape::{Shape, ShapeType};
use simd_model::robot::Material;

pub use self::rest_pose::RestPose;
use super::bounds::Bounds;
use super::facets::Facets;
use super::groups::Groups;
use super::hull::Graph;
use super::part::Part;
use super::separation::Inner;
use super::shapes::Shapes;
use super::still::Still;
use super::triangle_tree::TriangleTree;
use crate::dynamics::Tree;
use crate::dynamics::contact_point::Surface;
use crate::dynamics::kinematics::BodyMotion;

/// Pose of a collider.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColliderPose {
    /// Link that it belongs to, by index.
    pub link: usize,
    /// World from shape, in parry's axes for the shape.
    pub world_from_shape: DPose3,
}

/// Link and body of a collider.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// Link, by index.
    pub link: usize,
    /// Body, by index; `None` is the base.
    pub body: Option<usize>,
}

/// Colliders of one robot.
#[derive(Default)]
pub struct RobotColliders {
    shapes: Arc<Shapes>,
    /// Colliders in use, with the data that reject most pairs.
    pub(super) placed: Vec<Placed>,
    /// Other data of each collider.
    pub(super) frames: Vec<Frame>,
    /// Bounds of all colliders.
    pub(super) bounds: Bounds,
    /// Pairs of this robot's own colliders that may touch.
    pub(super) own_pairs: Vec<[usize; 2]>,
    /// Pose of the base when its shapes were last placed.
    base: Option<DPose3>,
    /// Bound on the path of the colliders, metres. Between two placements no point of any of them moved
    /// farther than this has grown.
    pub(super) path: f64,
    /// Largest margin among them.
    pub(super) reach: f64,
    /// Whether the pose of one of them is not finite.
    is_any_lost: bool,
    /// Colliders of the base.
    still: Still,
    /// Whether some of them consist of triangles.
    has_facets: bool,
    /// Whether there is only one, a ball.
    is_ball: bool,
    /// Other colliders than those of the base, in order.
    moving: Vec<usize>,
}

/// Data of a shape in the world that reject most pairs. They are stored separately: the search for contacts
/// reads them for all shapes, but the other data for few.
pub(super) struct Placed {
    /// Index among the shapes.
    part: usize,
    pub(super) link: usize,
    /// Body, by index; `None` is the base.
    pub(super) body: Option<usize>,
    /// Largest distance of the shape from its centre, metres.
    pub(super) radius: f64,
    /// Whether it is a ball of that radius.
    pub(super) is_ball: bool,
    /// Position of the centre, world.
    pub(super) world_middle: DVec3,
    /// Distance from the shape within which contacts are looked for, metres.
    pub(super) margin: f64,
    /// Look-ahead along the motion of its centre, metres; also if the margin is bounded and therefore
    /// smaller.
    drift: DVec3,
    /// Remaining look-ahead, metres.
    beside_drift: f64,
    /// Bounds of the shape with its margin.
    pub(super) bounds: Bounds,
    pub(super) groups: Groups,
}

/// Other data of a shape in the world.
pub(super) struct Frame {
    pub(super) body_from_shape: DPose3,
    /// Centre of the shape, in its axes.
    pub(super) middle: DVec3,
    pub(super) world_from_shape: DPose3,
    pub(super) surface: Surface,
}

impl Placed {
    /// Moves it to a pose. Returns its axes in the world, and a bound on the displacement of its points.
    fn put(&mut self, frame: &mut Frame, world_from_shape: DPose3) -> (DMat3, f64) {
        let (p, middle) = (frame.world_from_shape.rotation, self.world_middle);
        let axes = self.set_pose(frame, world_from_shape);
        let q = world_from_shape.rotation;
        // For a turn by an angle t, the difference of quaternions is 2 sin(t / 4), and a chord of radius 1 is
        // 2 sin(t / 2).
        let turned = 2.0 * (q - p).length_squared().min((q + p).length_squared()).sqrt();
        (axes, self.world_middle.distance(middle) + turned * self.radius)
    }

    /// Sets its pose. Returns its axes in the world: a matrix rotates a point in half of the time of a
    /// quaternion.
    fn set_pose(&mut self, frame: &mut Frame, world_from_shape: DPose3) -> DMat3 {
        let axes = DMat3::from_quat(world_from_shape.rotation);
        frame.world_from_shape = world_from_shape;
        self.world_middle = world_from_shape.translation + axes * frame.middle;
        axes
    }

    /// Returns a lower bound of the distance between the two, metres; negative if the spheres around them
    /// meet.
    pub(super) fn sphere_gap(&self, other: &Self) -> f64 {
        self.world_middle.distance(other.world_middle) - self.radius - other.radius
    }

    /// Updates its bounds.
    fn bound(&mut self, frame: &Frame, axes: DMat3, shapes: &Shapes) {
        let part = &shapes.parts[self.part];
        self.bounds = match part.shape.shape_type() {
            ShapeType::ConvexPolyhedron | ShapeType::Cuboid => {
                let origin = frame.world_from_shape.translation;
                Bounds::of_turned_box(part.local_box, axes, origin, self.margin)
            }
            ShapeType::Ball => Bounds::about(self.world_middle, DVec3::splat(self.radius + self.margin)),
            _ => Bounds::of(&*part.shape, &frame.world_from_shape, self.margin),
        };
    }
}

impl fmt::Debug for RobotColliders {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} colliders", self.placed.len())
    }
}

impl RobotColliders {
    /// Creates the colliders of a robot whose surfaces are `surface` unless its description says otherwise.
    /// They have no pose until [`RobotColliders::update_poses`] sets them, and do not touch each other until
    /// [`RobotColliders::set_filter`] allows it. A plane that could move touches nothing.
    pub fn new(tree: &Tree, shapes: &Arc<Shapes>, surface: Surface) -> Self {
        let make = |(part, of): (usize, &Part)| {
            let frame = tree.links.get(of.link).filter(|_| of.is_used(tree))?;
            let sphere = of.shape.compute_local_bounding_sphere();
            let placed = Placed {
                part,
                link: of.link,
                body: frame.body,
                radius: sphere.radius,
                is_ball: of.shape.as_ball().is_some(),
                world_middle: sphere.center,
                margin: 0.0,
                drift: DVec3::ZERO,
                beside_drift: 0.0,
                bounds: Bounds::default(),
                groups: Groups::default(),
            };
            let frame = Frame {
                body_from_shape: frame.body_from_link * of.link_from_shape,
                middle: sphere.center,
                world_from_shape: DPose3::IDENTITY,
                surface: surface.with(&of.material),
            };
            Some((placed, frame))
        };
        let (placed, frames): (Vec<Placed>, Vec<Frame>) =
            shapes.parts.iter().enumerate().filter_map(make).unzip();
        let moving = placed.iter().enumerate().filter(|(_, placed)| placed.body.is_some());
        let is_facets = |placed: &Placed| {
            let part = &shapes.parts[placed.part];
            Facets::of(&*part.shape, part.neighbours.as_ref()).is_some()
        };
        Self {
            has_facets: placed.iter().any(is_facets),
            is_ball: matches!(&placed[..], [placed] if placed.is_ball),
            shapes: Arc::clone(shapes),
            moving: moving.map(|(index, _)| index).collect(),
            placed,
            frames,
            ..Self::default()
        }
    }

    /// Returns the number of colliders.
    pub fn len(&self) -> usize {
        self.placed.len()
    }

    /// Returns whether the robot touches nothing.
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }

    /// Returns whether there is only one collider, a ball: the bounds are around it.
    pub(super) fn is_ball(&self) -> bool {
        self.is_ball
    }

    /// Returns whether no collider belongs to a body that moves relative to the base.
    pub(super) fn is_still(&self) -> bool {
        self.moving.is_empty()
    }

    /// Returns whether the base is where its shapes were last placed.
    pub fn are_placed_for(&self, base: DPose3) -> bool {
        self.base == Some(base)
    }

    /// Fills in the colliders whose bounds meet others, in order.
    pub(super) fn near(&self, bounds: &Bounds, found: &mut Vec<usize>) {
        found.clear();
        self.still.candidates(bounds, found);
        found.extend_from_slice(&self.moving);
        found.retain(|&index| self.placed[index].bounds.meets(bounds));
        found.sort_unstable();
    }

    /// Pairs of colliders that may touch each other.
    pub(super) fn own_collider_pairs(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        self.own_pairs.iter().copied()
    }

    /// The shape that a collider is.
    pub(super) fn part(&self, collider: usize) -> &Part {
        &self.shapes.parts[self.placed[collider].part]
    }

    /// Whether some of them may touch others of the same robot.
    pub fn has_self_collision(&self) -> bool {
        !self.own_pairs.is_empty()
    }

    /// Applies a material to the colliders of a link, or of all links.
    pub fn set_material(&mut self, link: Option<usize>, material: &Material) {
        for (placed, frame) in self.placed.iter().zip(&mut self.frames) {
            if link.is_none_or(|link| placed.link == link) {
                frame.surface = frame.surface.with(material);
            }
        }
    }

    /// Returns the surface of a link's first collider; `None` if it has none.
    pub fn surface(&self, link: usize) -> Option<Surface> {
        self.placed.iter().position(|placed| placed.link == link).map(|index| self.frames[index].surface)
    }

    /// Returns the surface of each collider.
    pub fn surfaces(&self) -> impl Iterator<Item = Surface> + '_ {
        self.frames.iter().map(|frame| frame.surface)
    }

    /// Returns whether all poses are finite. Other colliders are never found.
    pub fn are_finite(&self) -> bool {
        !self.is_any_lost
    }

    /// Updates the poses from the poses of the bodies. Contacts are looked for within `slack` metres and
    /// twice the motion in a step of `h` seconds. The speed counts up to
    /// [`FASTEST_LOOKED_AHEAD`](crate::dynamics::contact_point::FASTEST_LOOKED_AHEAD).
    pub fn update_poses(&mut self, base: DPose3, slack: f64, h: f64, body: impl Fn(usize) -> BodyMotion) {
        let still = self.base == Some(base);
        if still && self.is_still() {
            return;
        }
        self.base = Some(base);
        self.bounds = Bounds::default();
        // Shapes of one body are mostly adjacent.
        let mut last: Option<(usize, BodyMotion, f64)> = None;
        let mut farthest = 0.0f64;
        self.reach = 0.0;
        self.is_any_lost = false;
        for (placed, frame) in self.placed.iter_mut().zip(&mut self.frames) {
            match placed.body {
                None if still => {}
                None => {
                    let (axes, moved) = placed.put(frame, base * frame.body_from_shape);
                    farthest = farthest.max(moved);
                    placed.set_margin(0.0, DVec3::ZERO);
                    placed.bound(frame, axes, &self.shapes);
                }
                Some(index) => {
                    let (_, motion, spin) = last.filter(|(of, ..)| *of == index).unwrap_or_else(|| {
                        let motion = body(index);
                        (index, motion, motion.angular.length())
                    });
                    last = Some((index, motion, spin));
                    let (axes, moved) = placed.put(frame, motion.pose * frame.body_from_shape);
                    farthest = farthest.max(moved);
                    placed.look_ahead(motion, spin, slack, h);
                    placed.bound(frame, axes, &self.shapes);
                }
            }
            self.bounds = self.bounds.around(placed.bounds);
            self.reach = self.reach.max(placed.margin);
            self.is_any_lost |= !placed.world_middle.is_finite();
        }
        if !still {
            let base = self.placed.iter().enumerate().filter(|(_, placed)| placed.body.is_none());
            self.still.replace(base.map(|(index, placed)| (index, placed.bounds)));
        }
        // Rounded up, so that displacements too small to be added to a long path are not lost.
        self.path = (self.path + farthest).next_up();
        if !self.path.is_finite() {
            self.path = 0.0;
        }
    }

    /// Returns the shapes that they are made from.
    pub fn shapes(&self) -> &Arc<Shapes> {
        &self.shapes
    }

    /// Returns link and body of a collider.
    pub fn side(&self, collider: usize) -> Option<Side> {
        self.placed.get(collider).map(|placed| Side { link: placed.link, body: placed.body })
    }

    /// Sets the surface of each collider; there is one for each.
    pub fn set_surfaces(&mut self, surfaces: &[Surface]) {
        self.frames.iter_mut().zip(surfaces).for_each(|(frame, surface)| frame.surface = *surface);
    }

    /// Returns the poses, in the order of the shapes.
    pub fn poses(&self) -> Vec<ColliderPose> {
        let pose = |(placed, frame): (&Placed, &Frame)| ColliderPose {
            link: placed.link,
            world_from_shape: frame.world_from_shape,
        };
        self.placed.iter().zip(&self.frames).map(pose).collect()
    }

    /// Returns the shape of a collider.
    pub(super) fn shape(&self, placed: &Placed) -> &dyn Shape {
        &*self.shapes.parts[placed.part].shape
    }

    /// Returns the shape of a collider and the edges of a hull of many corners.
    pub(super) fn shape_and_graph(&self, placed: &Placed) -> (&dyn Shape, Option<&Graph>) {
        let part = &self.shapes.parts[placed.part];
        (&*part.shape, part.graph.as_deref())
    }

    /// Returns the triangles of a collider that consists of them.
    pub(super) fn facets(&self, placed: &Placed) -> Option<Facets<'_>> {
        let part = &self.shapes.parts[placed.part];
        Facets::of(&*part.shape, part.neighbours.as_ref())
    }

    /// The triangles of two of its colliders, where a hull of one of them is too coarse to touch another link with.
    pub(super) fn coarse_surfaces(&self, pair: [usize; 2]) -> Option<[&TriangleTree; 2]> {
        let [a, b] = pair.map(|index| self.part(index));
        if !(a.is_coarse() || b.is_coarse()) {
            return None;
        }
        Some([a.tree.as_deref()?, b.tree.as_deref()?])
    }

    /// Whether some are of triangles.
    pub(super) fn has_facets(&self) -> bool {
        self.has_facets
    }

    /// Returns the box around the shape of a collider, as centre and half lengths in its axes.
    pub(super) fn local_box(&self, placed: &Placed) -> [DVec3; 2] {
        self.shapes.parts[placed.part].local_box
    }

    /// Returns a ball inside the shape of a collider.
    pub(super) fn inner(&self, placed: &Placed) -> &Inner {
        &self.shapes.parts[placed.part].inner
    }
}

//! The shapes of one robot in the world: where its bodies carry them, how far around them
//! contacts are looked for, and what their surfaces are like.

mod fetch;
mod look_ahead;
mod rest_pose;

use std::fmt;
use std::sync::Arc;

use glamx::{DMat3, DPose3, DVec3};
use rapier3d_f64::parry::shape::{Shape, ShapeType};
use simd_model::robot::Material;

pub use self::rest_pose::RestPose;
use super::Shapes;
use super::bounds::Bounds;
use super::facets::Facets;
use super::filter::Groups;
use super::hull::Graph;
use super::separation::Inner;
use super::still::Still;
use crate::dynamics::Tree;
use crate::dynamics::contact_point::Surface;
use crate::dynamics::kinematics::BodyMotion;

/// Where a collider is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColliderPose {
    /// Index of the link that it belongs to.
    pub link: usize,
    /// World from the shape, in parry's axes for it.
    pub world_from_shape: DPose3,
}

/// What a collider is of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// Index of the link.
    pub link: usize,
    /// Index of the body; `None` is the base.
    pub body: Option<usize>,
}

/// The colliders of one robot.
#[derive(Default)]
pub struct RobotColliders {
    shapes: Arc<Shapes>,
    /// Those of the shapes that are used: of each what is enough to reject most pairs.
    pub(super) placed: Vec<Placed>,
    /// The rest of each.
    pub(super) frames: Vec<Frame>,
    /// Around all of them.
    pub(super) bounds: Bounds,
    /// Pairs of this robot's own that may touch.
    pub(super) own_pairs: Vec<[usize; 2]>,
    /// Where the base was when its shapes were last put in place.
    base: Option<DPose3>,
    /// How far they have moved at the most, metres: between two times at which they were put in place no point of
    /// any of them moved farther than this has grown.
    pub(super) path: f64,
    /// The largest margin among them.
    pub(super) reach: f64,
    /// Where one of them is, is no number.
    is_any_lost: bool,
    /// Those of the base.
    still: Still,
    /// Some of them are of triangles.
    has_facets: bool,
    /// There is one, which is a ball.
    is_ball: bool,
    /// The others, in order.
    moving: Vec<usize>,
}

/// What of a shape in the world is enough to reject most pairs. It lies by itself: where contacts are looked for all shapes are looked at, but
/// the rest of few.
pub(super) struct Placed {
    /// Its index among the shapes.
    part: usize,
    pub(super) link: usize,
    /// `None` is the base.
    pub(super) body: Option<usize>,
    /// How far the shape reaches from its middle.
    pub(super) radius: f64,
    /// It is a ball of that radius.
    pub(super) is_ball: bool,
    /// Where the middle is.
    pub(super) world_middle: DVec3,
    /// Contacts are looked for this far from the shape, metres.
    pub(super) margin: f64,
    /// How far ahead of its middle it is looked, along its motion, also where the margin is bounded and so is less.
    drift: DVec3,
    /// How far it is looked beside that.
    beside_drift: f64,
    /// Around the shape and its margin.
    pub(super) bounds: Bounds,
    pub(super) groups: Groups,
}

/// The rest of a shape in the world.
pub(super) struct Frame {
    pub(super) body_from_shape: DPose3,
    /// The middle of the shape, in its axes.
    pub(super) middle: DVec3,
    pub(super) world_from_shape: DPose3,
    pub(super) surface: Surface,
}

impl Placed {
    /// Puts it there. Its axes in the world, and how far any point of it moved, at the most.
    fn put(&mut self, frame: &mut Frame, world_from_shape: DPose3) -> (DMat3, f64) {
        let (p, middle) = (frame.world_from_shape.rotation, self.world_middle);
        let axes = self.set_pose(frame, world_from_shape);
        let q = world_from_shape.rotation;
        // Of a turn by an angle t the difference of quaternions is 2 sin(t / 4), a chord of radius 1 2 sin(t / 2).
        let turned = 2.0 * (q - p).length_squared().min((q + p).length_squared()).sqrt();
        (axes, self.world_middle.distance(middle) + turned * self.radius)
    }

    /// Its axes in the world: a point is turned by them in half of what it takes by a quaternion.
    fn set_pose(&mut self, frame: &mut Frame, world_from_shape: DPose3) -> DMat3 {
        let axes = DMat3::from_quat(world_from_shape.rotation);
        frame.world_from_shape = world_from_shape;
        self.world_middle = world_from_shape.translation + axes * frame.middle;
        axes
    }

    /// At least so far apart are the two, metres; negative where the spheres around them meet.
    pub(super) fn sphere_gap(&self, other: &Self) -> f64 {
        self.world_middle.distance(other.world_middle) - self.radius - other.radius
    }

    /// Finds its bounds anew.
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
    /// Those of a robot whose surfaces are `surface` where its description gives nothing else.
    /// They have no pose until [`RobotColliders::update_poses`] puts them, and do not touch each other until
    /// [`RobotColliders::set_filter`] says so. A plane that could move touches nothing.
    pub fn new(tree: &Tree, shapes: &Arc<Shapes>, surface: Surface) -> Self {
        let make = |(part, of): (usize, &super::shapes::Part)| {
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

    /// How many there are.
    pub fn len(&self) -> usize {
        self.placed.len()
    }

    /// Whether the robot touches nothing.
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }

    /// Whether there is one, which is a ball: its bounds are around that.
    pub(super) fn is_ball(&self) -> bool {
        self.is_ball
    }

    /// Whether none of them is of a body that moves against the base.
    pub(super) fn is_still(&self) -> bool {
        self.moving.is_empty()
    }

    /// Whether a base there is where its shapes were last put in place.
    pub fn are_placed_for(&self, base: DPose3) -> bool {
        self.base == Some(base)
    }

    /// Fills in those whose bounds meet others, in order.
    pub(super) fn near(&self, bounds: &Bounds, found: &mut Vec<usize>) {
        found.clear();
        self.still.candidates(bounds, found);
        found.extend_from_slice(&self.moving);
        found.retain(|&index| self.placed[index].bounds.meets(bounds));
        found.sort_unstable();
    }

    /// Whether some of them may touch others of the same robot.
    pub fn has_self_collision(&self) -> bool {
        !self.own_pairs.is_empty()
    }

    /// Gives the colliders of a link, or of all, what a material gives.
    pub fn set_material(&mut self, link: Option<usize>, material: &Material) {
        for (placed, frame) in self.placed.iter().zip(&mut self.frames) {
            if link.is_none_or(|link| placed.link == link) {
                frame.surface = frame.surface.with(material);
            }
        }
    }

    /// What the surface of a link's first collider is like; `None` where it has none.
    pub fn surface(&self, link: usize) -> Option<Surface> {
        self.placed.iter().position(|placed| placed.link == link).map(|index| self.frames[index].surface)
    }

    /// What each collider's surface is like.
    pub fn surfaces(&self) -> impl Iterator<Item = Surface> + '_ {
        self.frames.iter().map(|frame| frame.surface)
    }

    /// Whether numbers say where each of them is. Of others nothing can be found.
    pub fn are_finite(&self) -> bool {
        !self.is_any_lost
    }

    /// Updates their poses from those of the bodies. Contacts are looked for within `slack` metres and
    /// twice what a step of `h` seconds moves them, where of their speed no more counts than
    /// [`FASTEST_LOOKED_AHEAD`](crate::dynamics::contact_point::FASTEST_LOOKED_AHEAD).
    pub fn update_poses(&mut self, base: DPose3, slack: f64, h: f64, body: impl Fn(usize) -> BodyMotion) {
        let still = self.base == Some(base);
        if still && self.is_still() {
            return;
        }
        self.base = Some(base);
        self.bounds = Bounds::default();
        // Shapes of one body mostly come one after the other.
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
        // Upwards, so that ways too small to be added to a long one are not lost.
        self.path = (self.path + farthest).next_up();
        if !self.path.is_finite() {
            self.path = 0.0;
        }
    }

    /// What they are made from.
    pub fn shapes(&self) -> &Arc<Shapes> {
        &self.shapes
    }

    /// Which link and body a collider is of.
    pub fn side(&self, collider: usize) -> Option<Side> {
        self.placed.get(collider).map(|placed| Side { link: placed.link, body: placed.body })
    }

    /// Gives each collider its surface; there is one for each.
    pub fn set_surfaces(&mut self, surfaces: &[Surface]) {
        self.frames.iter_mut().zip(surfaces).for_each(|(frame, surface)| frame.surface = *surface);
    }

    /// Where they are, in the order of the shapes.
    pub fn poses(&self) -> Vec<ColliderPose> {
        let pose = |(placed, frame): (&Placed, &Frame)| ColliderPose {
            link: placed.link,
            world_from_shape: frame.world_from_shape,
        };
        self.placed.iter().zip(&self.frames).map(pose).collect()
    }

    /// The shape of a collider.
    pub(super) fn shape(&self, placed: &Placed) -> &dyn Shape {
        &*self.shapes.parts[placed.part].shape
    }

    /// The shape of a collider and, of a hull of many corners, its edges.
    pub(super) fn shape_and_graph(&self, placed: &Placed) -> (&dyn Shape, Option<&Graph>) {
        let part = &self.shapes.parts[placed.part];
        (&*part.shape, part.graph.as_deref())
    }

    /// The triangles of a collider that is made of them.
    pub(super) fn facets(&self, placed: &Placed) -> Option<Facets<'_>> {
        let part = &self.shapes.parts[placed.part];
        Facets::of(&*part.shape, part.neighbours.as_ref())
    }

    /// Whether some are of triangles.
    pub(super) fn has_facets(&self) -> bool {
        self.has_facets
    }

    /// The box around the shape of a collider, as middle and half lengths in its axes.
    pub(super) fn local_box(&self, placed: &Placed) -> [DVec3; 2] {
        self.shapes.parts[placed.part].local_box
    }

    /// A ball inside the shape of a collider.
    pub(super) fn inner(&self, placed: &Placed) -> &Inner {
        &self.shapes.parts[placed.part].inner
    }
}

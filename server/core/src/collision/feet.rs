//! Balls of a robot that touch planes which do not move, one by one: what the narrow phase finds of them, for a copy of the robot of
//! which no more than how a body moves is known.

use std::fmt;

use glamx::{DMat3, DPose3};
use rapier3d_f64::parry::shape::ShapeType;

use super::colliders::RobotColliders;
use super::filter::Filter;
use super::narrow::NarrowPhase;
use super::near_facets::NearFacets;
use crate::dynamics::Tree;
use crate::dynamics::contact_point::{ContactPoint, Surface, SurfaceCombination};
use crate::dynamics::kinematics::BodyMotion;
use crate::dynamics::lanes::{FootPair, FootSearch, Guard, MOST_FEET, can_be_foot};

/// The feet of a robot, planes that they may touch, and what else of it may touch those.
pub struct RobotFeet {
    own: RobotColliders,
    /// Robots with planes, by index in the world.
    grounds: Vec<(usize, RobotColliders)>,
    pairs: Vec<FootPair>,
    guards: Vec<Guard>,
    narrow: NarrowPhase,
    facets: NearFacets,
    /// Contacts are looked for at least this far from what moves, metres, in parts of a step that take so many seconds.
    slack: f64,
    h: f64,
}

impl fmt::Debug for RobotFeet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} feet", self.pairs.len())
    }
}

impl RobotFeet {
    /// Those of a robot, the index and the colliders of which are `own`, on planes of `grounds` whose bases are there. `None` where
    /// there are no feet, or more than lanes take.
    pub fn new<'a>(
        (robot, own): (usize, &RobotColliders),
        tree: &Tree,
        grounds: impl Iterator<Item = (usize, &'a RobotColliders, &'a Tree, DPose3)>,
        filter: impl Fn([usize; 2]) -> Filter<'a>,
        (slack, h): (f64, f64),
    ) -> Option<Self> {
        let mut feet = Self {
            own: RobotColliders::new(tree, own.shapes(), Surface::default()),
            grounds: Vec::new(),
            pairs: Vec::new(),
            guards: Vec::new(),
            narrow: NarrowPhase::default(),
            facets: NearFacets::default(),
            slack,
            h,
        };
        for (index, ground, ground_tree, base) in grounds {
            let mut placed = RobotColliders::new(ground_tree, ground.shapes(), Surface::default());
            let still = BodyMotion { pose: base, linear: glamx::DVec3::ZERO, angular: glamx::DVec3::ZERO };
            placed.update_poses(base, slack, h, |_| still);
            let filter = filter([robot.min(index), robot.max(index)]);
            let found = feet.list((robot, own), tree, (index, ground, &placed), filter);
            if !found {
                return None;
            }
            feet.grounds.push((index, placed));
        }
        feet.pairs.sort_unstable_by_key(|pair| (pair.robots, pair.colliders));
        (!feet.pairs.is_empty() && feet.pairs.len() <= MOST_FEET).then_some(feet)
    }

    /// Lists what of a robot may touch planes of another one. False where a ball is none that lanes can have.
    fn list(
        &mut self,
        (robot, own): (usize, &RobotColliders),
        tree: &Tree,
        (index, ground, placed): (usize, &RobotColliders, &RobotColliders),
        filter: Filter<'_>,
    ) -> bool {
        for (j, plane) in ground.placed.iter().enumerate() {
            let Some(half_space) = ground.shape(plane).as_halfspace() else { continue };
            let frame = &placed.frames[j].world_from_shape;
            let normal = frame.rotation * half_space.normal;
            for (i, part) in own.placed.iter().enumerate() {
                let allowed =
                    if robot < index { filter.allows(part, plane) } else { filter.allows(plane, part) };
                let (Some(body), true) = (part.body, allowed) else { continue };
                let side = usize::from(robot > index);
                let (mut robots, mut colliders) = ([robot, index], [i, j]);
                if side == 1 {
                    robots.reverse();
                    colliders.reverse();
                }
                if own.shape(part).shape_type() == ShapeType::Ball {
                    if !can_be_foot(tree, body) {
                        return false;
                    }
                    self.pairs.push(FootPair { robots, colliders, side, body });
                    continue;
                }
                let [middle, half] = own.local_box(part);
                let body_from_shape = own.frames[i].body_from_shape;
                self.guards.push(Guard {
                    body,
                    middle: body_from_shape.transform_point(middle),
                    axes: DMat3::from_quat(body_from_shape.rotation),
                    half,
                    normal,
                    height: normal.dot(frame.translation),
                });
            }
        }
        true
    }

    /// The pairs, in the order of contacts.
    pub fn pairs(&self) -> &[FootPair] {
        &self.pairs
    }

    /// What else may touch the planes.
    pub fn guards(&self) -> &[Guard] {
        &self.guards
    }

    /// What the surfaces of each pair are like together, of robots with these colliders.
    pub fn surfaces<'a>(
        &self,
        colliders: impl Fn(usize) -> &'a RobotColliders,
        combination: SurfaceCombination,
    ) -> Vec<Surface> {
        let of = |pair: &FootPair| {
            let [a, b] = [0, 1].map(|side| {
                colliders(pair.robots[side]).frames.get(pair.colliders[side]).map_or(
                    // None that lanes take.
                    Surface { restitution: 1.0, ..Surface::default() },
                    |frame| frame.surface,
                )
            });
            a.against(b, combination)
        };
        self.pairs.iter().map(of).collect()
    }
}

impl FootSearch for RobotFeet {
    fn find(&mut self, pair: usize, motion: BodyMotion) -> Option<ContactPoint> {
        let FootPair { robots, colliders, side, .. } = *self.pairs.get(pair)?;
        let index = colliders[side];
        let (placed, frame) = (self.own.placed.get_mut(index)?, self.own.frames.get_mut(index)?);
        placed.set_pose(frame, motion.pose * frame.body_from_shape);
        placed.look_ahead(motion, motion.angular.length(), self.slack, self.h);
        let ground = robots[1 - side];
        let (_, ground) = self.grounds.iter().find(|(index, _)| *index == ground)?;
        let own = &self.own;
        let both = if side == 0 { [own, ground] } else { [ground, own] };
        let parts = [&both[0].placed[colliders[0]], &both[1].placed[colliders[1]]];
        let mut found = None;
        let Self { narrow, facets, .. } = self;
        narrow.pair(colliders, both, parts, facets, &|| false, &mut |point| found = Some(point));
        found
    }
}

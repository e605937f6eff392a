//! Balls of a robot that may touch fixed planes, and its other shapes that may: for steps in lanes, which
//! find such contacts themselves.

use glamx::{DMat3, DPose3};

use super::colliders::RobotColliders;
use super::filter::Filter;
use crate::dynamics::Tree;
use crate::dynamics::contact_point::{Surface, SurfaceCombination};
use crate::dynamics::lanes::{FootPair, Guard, MAX_FEET, can_be_foot};

/// Feet of a robot, planes that they may touch, and other shapes that may touch those.
#[derive(Debug)]
pub struct RobotFeet {
    pairs: Vec<FootPair>,
    guards: Vec<Guard>,
    /// Robots with planes, and the poses of their bases.
    grounds: Vec<(usize, DPose3)>,
}

impl RobotColliders {
    /// Returns whether a collider is a ball that moves.
    pub fn is_moving_ball(&self, collider: usize) -> bool {
        self.placed
            .get(collider)
            .is_some_and(|placed| placed.body.is_some() && self.shape(placed).as_ball().is_some())
    }

    /// Returns whether a collider is a plane.
    pub fn is_plane(&self, collider: usize) -> bool {
        self.placed.get(collider).is_some_and(|placed| self.shape(placed).as_halfspace().is_some())
    }
}

impl RobotFeet {
    /// Returns the feet of a robot, given by its index and colliders as `own`, on planes of `grounds` with
    /// these base poses. Returns `None` if there are no feet, or more than lanes take.
    pub fn new<'a>(
        (robot, own): (usize, &RobotColliders),
        tree: &Tree,
        grounds: impl Iterator<Item = (usize, &'a RobotColliders, DPose3)>,
        filter: impl Fn([usize; 2]) -> Filter<'a>,
    ) -> Option<Self> {
        let mut feet = Self { pairs: Vec::new(), guards: Vec::new(), grounds: Vec::new() };
        for (index, ground, base) in grounds {
            let filter = filter([robot.min(index), robot.max(index)]);
            let before = (feet.pairs.len(), feet.guards.len());
            if !feet.list((robot, own), tree, (index, ground, base), filter) {
                return None;
            }
            if (feet.pairs.len(), feet.guards.len()) != before {
                feet.grounds.push((index, base));
            }
        }
        feet.pairs.sort_unstable_by_key(|pair| (pair.robots, pair.colliders));
        (!feet.pairs.is_empty() && feet.pairs.len() <= MAX_FEET).then_some(feet)
    }

    /// Lists the shapes that may touch planes of another robot. Returns false if lanes cannot take one of the
    /// balls.
    fn list(
        &mut self,
        (robot, own): (usize, &RobotColliders),
        tree: &Tree,
        (index, ground, base): (usize, &RobotColliders, DPose3),
        filter: Filter<'_>,
    ) -> bool {
        for (j, plane) in ground.placed.iter().enumerate() {
            let Some(half_space) = ground.shape(plane).as_halfspace() else { continue };
            let frame = base * ground.frames[j].body_from_shape;
            let normal = frame.rotation * half_space.normal;
            for (i, part) in own.placed.iter().enumerate() {
                let allowed =
                    if robot < index { filter.allows(part, plane) } else { filter.allows(plane, part) };
                let (Some(body), true) = (part.body, allowed) else { continue };
                let side = usize::from(robot > index);
                let (mut robots, mut colliders, mut links) =
                    ([robot, index], [i, j], [part.link, plane.link]);
                if side == 1 {
                    robots.reverse();
                    colliders.reverse();
                    links.reverse();
                }
                let body_from_shape = own.frames[i].body_from_shape;
                if let Some(ball) = own.shape(part).as_ball() {
                    if !can_be_foot(tree, body) {
                        return false;
                    }
                    self.pairs.push(FootPair {
                        robots,
                        colliders,
                        side,
                        body,
                        links,
                        radius: ball.radius,
                        body_from_ball: body_from_shape,
                        plane: frame,
                        normal: half_space.normal,
                    });
                    continue;
                }
                let [middle, half] = own.local_box(part);
                self.guards.push(Guard {
                    body,
                    middle: body_from_shape.transform_point(middle),
                    axes: DMat3::from_quat(body_from_shape.rotation),
                    half,
                    reach: part.farthest(&own.frames[i]),
                    normal,
                    height: normal.dot(frame.translation),
                });
            }
        }
        true
    }

    /// Returns the pairs, in the order of contacts.
    pub fn pairs(&self) -> &[FootPair] {
        &self.pairs
    }

    /// Returns the other shapes that may touch the planes.
    pub fn guards(&self) -> &[Guard] {
        &self.guards
    }

    /// Returns whether the planes are unmoved, given the base poses of robots.
    pub fn stand_on(&self, base: impl Fn(usize) -> DPose3) -> bool {
        self.grounds.iter().all(|(robot, known)| base(*robot) == *known)
    }

    /// Returns the combined surfaces of each pair, for robots with these colliders. Returns `None` if one of
    /// them lacks one of the colliders.
    pub fn surfaces<'a>(
        &self,
        colliders: impl Fn(usize) -> &'a RobotColliders,
        combination: SurfaceCombination,
    ) -> Option<Vec<Surface>> {
        let of = |pair: &FootPair| {
            let [a, b] = [0, 1].map(|side| colliders(pair.robots[side]).frames.get(pair.colliders[side]));
            Some(a?.surface.against(b?.surface, combination))
        };
        self.pairs.iter().map(of).collect()
    }
}

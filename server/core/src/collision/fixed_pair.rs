//! Pairs of colliders that joint motion may be unable to separate: within one robot, and between two robots
//! fixed to the world. Initial overlaps between them are ignored.

use glamx::DPose3;

use super::colliders::RobotColliders;
use super::filter::Filter;
use super::narrow::{FixedPairScratch, NarrowPhase};
use super::near_facets::NearFacets;
use super::separation::{Solid, overlap_by, separation};
use super::surface_contact::SHELL;
use super::triangle_tree::TriangleTree;
use crate::dynamics::contact_point::ContactPoint;

/// Depth from which an initial overlap is ignored, metres: rounding and resting contacts cause smaller ones.
/// For thin shapes it is half of the ball inside them.
const DEEP: f64 = 1e-3;

/// Lower bound of that depth, metres.
const LEAST_DEEP: f64 = 1e-4;

/// Gap beyond which colliders are not tested one by one, metres.
const TESTED_GAP: f64 = 0.1;

/// Part of a distance that is relied on: GJK ends within 1e-7 of it.
const EXACT: f64 = 0.999;

/// Part of the distance to separation of an ignored pair that is relied on.
const TRUSTED: f64 = 0.5;

/// Knowledge about two robots, or about one and itself.
///
/// The ignored pairs are state of the world. The rest is a cache, and results are equal without it. As long
/// as no shape has moved by the nearest pair's distance, or by the shallowest ignored pair's, nothing touches
/// and nothing separates.
#[derive(Clone, Debug)]
pub struct FixedPair {
    /// Robots, by index, the smaller first.
    pub robots: [usize; 2],
    /// Pairs of colliders that overlapped initially and have not separated since, in order.
    pub ignored: Vec<[usize; 2]>,
    /// Sum of the two robots' paths and reaches below which nothing touches.
    separated_until: f64,
    /// Sum of their paths below which nothing separates.
    overlapping_until: f64,
}

impl FixedPair {
    /// Creates the pair with these ignored pairs of colliders.
    pub fn new(robots: [usize; 2], ignored: Vec<[usize; 2]>) -> Self {
        Self { robots, ignored, separated_until: f64::NEG_INFINITY, overlapping_until: f64::NEG_INFINITY }
    }

    /// Discards known distances. Call it when the set of colliders that may touch has changed.
    pub fn forget_distances(&mut self) {
        (self.separated_until, self.overlapping_until) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    }
}

/// Query of two robots.
#[derive(Clone, Copy)]
struct Query<'a> {
    robots: [&'a RobotColliders; 2],
    /// Collision filter between two robots.
    filter: Filter<'a>,
    /// Whether the two are one robot.
    own: bool,
    /// Whether one of them was teleported since the last query.
    teleported: bool,
    /// Minimum distance from moving colliders within which contacts are looked for, metres.
    slack: f64,
    /// Sum of their paths.
    path: f64,
    interrupt: &'a dyn Fn() -> bool,
}

impl NarrowPhase {
    /// Like [`NarrowPhase::between`] for two robots that are fixed to the world, or for one and itself, but
    /// ignores initial overlaps. `teleported` says whether one of them was since the last query. Contacts are
    /// looked for at least `slack` metres from moving colliders. Returns false if interrupted; `known` is
    /// then unusable.
    ///
    /// * A pair that overlaps by more than [`DEEP`] after a teleport is ignored.
    /// * A pair of two robots within the contact distance at rest is ignored if each of its bodies is in one
    ///   of those deep pairs. Two arms at one place have neighbours that overlap a little, or nearly.
    /// * An ignored pair does not touch until it is farther apart than the contact distance at rest.
    pub fn between_fixed(
        &mut self,
        robots @ [a, b]: [&RobotColliders; 2],
        filter: Filter<'_>,
        (teleported, slack): (bool, f64),
        interrupt: &dyn Fn() -> bool,
        known: &mut FixedPair,
        found: impl FnMut(ContactPoint),
    ) -> bool {
        let (path, reach) = (a.path + b.path, a.reach + b.reach);
        if !teleported && path + reach < known.separated_until && path < known.overlapping_until {
            return true;
        }
        let own = known.robots[0] == known.robots[1];
        let query = Query { robots, filter, own, teleported, slack, path, interrupt };
        let mut scratch = std::mem::take(&mut self.fixed_pairs);
        let FixedPairScratch { before, points, stuck, .. } = &mut scratch;
        std::mem::swap(before, &mut known.ignored);
        known.ignored.clear();
        points.clear();
        stuck.clear();
        (known.separated_until, known.overlapping_until) = (f64::INFINITY, f64::INFINITY);
        let mut is_whole = true;
        if own {
            is_whole = a.own_pairs.iter().all(|&pair| self.classify(&query, pair, known, &mut scratch));
        } else {
            let mut near = std::mem::take(&mut scratch.near);
            let [near_b, near_first] = &mut near;
            // Colliders that are not near have a gap of at least `TESTED_GAP`.
            a.near(&b.bounds.loosened(TESTED_GAP), near_b);
            let mut far = near_b.len() < a.placed.len();
            for &i in &*near_b {
                let first = &a.placed[i];
                if first.bounds.meets(&b.bounds) {
                    b.near(&first.bounds.loosened(TESTED_GAP), near_first);
                    self.compared += near_first.len() as u64;
                    is_whole = is_whole
                        && near_first.iter().all(|&j| self.classify(&query, [i, j], known, &mut scratch));
                    far |= near_first.len() < b.placed.len();
                } else {
                    known.note_separation(&query, first.bounds.gap(&b.bounds) + first.margin);
                }
            }
            if far {
                known.note_separation(&query, TESTED_GAP);
            }
            scratch.near = near;
        }
        if teleported && !own {
            ignore_near(&query, known, &scratch);
        }
        scratch.points.retain(|point| known.ignored.binary_search(&point.colliders).is_err());
        scratch.points.iter().copied().for_each(found);
        self.fixed_pairs = scratch;
        is_whole
    }

    /// Decides whether a pair of colliders is ignored, separate or in contact. Returns false if interrupted.
    fn classify(
        &mut self,
        query: &Query<'_>,
        pair: [usize; 2],
        known: &mut FixedPair,
        scratch: &mut FixedPairScratch,
    ) -> bool {
        let Query { robots: [a, b], filter, own, teleported, slack, path, interrupt } = *query;
        let [first, second] = [&a.placed[pair[0]], &b.placed[pair[1]]];
        let moving = [first, second].into_iter().filter(|placed| placed.body.is_some()).count();
        let surfaces = if own { a.coarse_surfaces(pair) } else { None };
        // Surfaces touch that much before they meet.
        let shell = if surfaces.is_some() { SHELL } else { 0.0 };
        if (moving == 0 && (own || !teleported)) || (!own && !filter.allows(first, second)) {
            return true;
        }
        if !first.bounds.meets(&second.bounds) {
            if moving > 0 {
                let margins = first.margin + second.margin;
                known.note_separation(query, first.bounds.gap(&second.bounds) + margins - shell);
            }
            return true;
        }
        let within = first.within(second);
        let was = scratch.before.binary_search(&pair).is_ok();
        let gap = first.sphere_gap(second) - shell;
        if gap >= within && !was && !teleported && moving > 0 {
            known.note_separation(query, gap);
            return true;
        }
        if self.is_interrupted(interrupt) {
            return false;
        }
        let [one, other] = query.solids(pair);
        let [frame, other_frame] = [&a.frames[pair[0]], &b.frames[pair[1]]];
        let a_from_b = frame.world_from_shape.inverse() * other_frame.world_from_shape;
        let deep = DEEP.min(one.inner.radius().min(other.inner.radius()) / 2.0).max(LEAST_DEEP);
        let both = [(0, first.body), (1, second.body)];
        if moving == 0 {
            // It exerts no force, but shows which bodies overlap deeply.
            if overlap_by(deep, one, other, &a_from_b) {
                scratch.stuck.extend(both);
            }
            return true;
        }
        let is_deep = teleported && overlap_by(deep, one, other, &a_from_b);
        let mut separation = separation(one, other, &a_from_b) - shell;
        if is_deep {
            scratch.stuck.extend(both);
        }
        if is_deep || (was && separation < slack * moving as f64) {
            known.ignored.push(pair);
            known.overlapping_until =
                known.overlapping_until.min(path + TRUSTED * (slack * moving as f64 - separation));
            return true;
        }
        if let Some(trees) = surfaces.filter(|_| separation < within) {
            match self.touch_surfaces(pair, a, (trees, &a_from_b), within, &mut scratch.points) {
                Some(0) => {
                    let distance = self.surface_contact.distance(trees, &a_from_b, within + SHELL);
                    separation = (distance - SHELL).max(within);
                }
                Some(_) => {
                    known.separated_until = f64::NEG_INFINITY;
                    return true;
                }
                None => {}
            }
        }
        if separation >= within {
            known.note_separation(query, separation);
            return true;
        }
        // A contact is possible: the cache is invalid for the next query.
        known.separated_until = f64::NEG_INFINITY;
        let start = scratch.points.len();
        let is_whole =
            self.pair(pair, [a, b], [first, second], &NearFacets::default(), interrupt, &mut |point| {
                scratch.points.push(point);
            });
        if teleported && scratch.points[start..].iter().any(|point| point.distance < -deep) {
            scratch.stuck.extend(both);
            known.ignored.push(pair);
        }
        is_whole
    }

    /// Adds the points where the surfaces of two of a robot's colliders touch, and counts them. `None` where they cross and have no
    /// direction out: then their hulls stand in.
    fn touch_surfaces(
        &mut self,
        pair: [usize; 2],
        robot: &RobotColliders,
        (trees, a_from_b): ([&TriangleTree; 2], &DPose3),
        within: f64,
        points: &mut Vec<ContactPoint>,
    ) -> Option<usize> {
        let combination = self.combination;
        let found = self.surface_contact.find(trees, a_from_b, within)?;
        let [(a, frame), (b, other)] = pair.map(|index| (&robot.placed[index], &robot.frames[index]));
        points.extend(found.iter().map(|point| {
            let middle = point.on_surface + point.normal * (point.distance / 2.0);
            ContactPoint {
                colliders: pair,
                links: [a.link, b.link],
                bodies: [a.body, b.body],
                on: [point.on_surface, point.on_shape],
                position: frame.world_from_shape.transform_point(middle),
                normal: frame.world_from_shape.rotation * point.normal,
                distance: point.distance,
                surface: frame.surface.against(other.surface, combination),
            }
        }));
        Some(found.len())
    }
}

impl Query<'_> {
    fn solids(&self, pair: [usize; 2]) -> [Solid<'_>; 2] {
        [0, 1].map(|side| {
            let placed = &self.robots[side].placed[pair[side]];
            Solid { shape: self.robots[side].shape(placed), inner: self.robots[side].inner(placed) }
        })
    }
}

impl FixedPair {
    /// Records the distance of a pair.
    fn note_separation(&mut self, query: &Query<'_>, distance: f64) {
        self.separated_until = self.separated_until.min(query.path + EXACT * distance);
    }
}

/// Ignores pairs that are near each other and whose bodies both overlap deeply.
fn ignore_near(query: &Query<'_>, known: &mut FixedPair, scratch: &FixedPairScratch) {
    let deep = known.ignored.len();
    for points in scratch.points.chunk_by(|a, b| a.colliders == b.colliders) {
        let ContactPoint { colliders, bodies, .. } = points[0];
        let moving = bodies.iter().filter(|body| body.is_some()).count();
        let near = points.iter().any(|point| point.distance < query.slack * moving as f64);
        let stuck = [0, 1].iter().all(|&side| scratch.stuck.contains(&(side, bodies[side])));
        if near && stuck && known.ignored[..deep].binary_search(&colliders).is_err() {
            known.ignored.push(colliders);
        }
    }
    known.ignored.sort_unstable();
}

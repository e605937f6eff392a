//! Pairs of colliders that no motion of joints is sure to part: those of one robot, and of two that are fixed to
//! the world. Where they are put into each other they are left alone.

use super::colliders::RobotColliders;
use super::narrow::{Narrow, Touch};
use super::separation::{Solid, overlap_by, separation};

/// What is put into something else by more than this is left alone with it, metres: less is what rounding and
/// rest leave. Of thin shapes half of what fits into them.
const DEEP: f64 = 1e-3;

/// The same at the least.
const LEAST_DEEP: f64 = 1e-4;

/// Of a distance that has been found, so much is relied on: GJK ends within 1e-7 of it.
const EXACT: f64 = 0.999;

/// Of what parts a merged pair from coming apart, so much is relied on.
const TRUSTED: f64 = 0.5;

/// What is known of two robots, or of one and itself.
///
/// The pairs of colliders that are put into each other are state of the world. The rest is a cache, and what is
/// found is the same without it: as long as nothing has moved as far as the nearest pair is from touching, or the
/// pair that is least merged from coming apart, nothing touches and nothing comes apart.
#[derive(Clone, Debug)]
pub struct Fixed {
    /// Places of the two robots, the earlier first.
    pub robots: [usize; 2],
    /// Pairs of colliders that were put into each other and have not come apart since, in order.
    pub merged: Vec<[usize; 2]>,
    /// Nothing touches while the two robots' paths and reaches together are below this.
    apart: f64,
    /// Nothing comes apart while their paths together are below this.
    together: f64,
}

impl Fixed {
    /// Of two robots of which these pairs of colliders are put into each other.
    pub fn new(robots: [usize; 2], merged: Vec<[usize; 2]>) -> Self {
        Self { robots, merged, apart: f64::NEG_INFINITY, together: f64::NEG_INFINITY }
    }
}

/// One look at two robots.
#[derive(Clone, Copy)]
struct Look<'a> {
    robots: [&'a RobotColliders; 2],
    /// They are one.
    own: bool,
    /// One of them was put where it is since the last look.
    put: bool,
    /// Contacts are looked for at least this far from what moves, metres.
    slack: f64,
    /// Their paths together.
    path: f64,
}

/// The memory of a look.
#[derive(Default)]
pub(super) struct LookMemory {
    /// Pairs that were merged before it.
    before: Vec<[usize; 2]>,
    touches: Vec<Touch>,
    /// Robots, 0 or 1, and bodies of them that were put deep into the other one.
    stuck: Vec<(usize, Option<usize>)>,
}

impl Narrow {
    /// Like [`Narrow::between`] for two robots that are fixed to the world, or for one and itself, but for what is put
    /// into each other. `put` says whether one of them was since the last look; contacts are looked for at least
    /// `slack` metres from what moves.
    ///
    /// * A pair that was put more than [`DEEP`] into each other is merged.
    /// * Of two robots a pair that was put nearer to each other than contacts are looked for at rest is
    ///   merged where each of its bodies is in one of those deep pairs: two arms at one place have neighbours that
    ///   overlap a little, or nearly.
    /// * What is merged does not touch until it is farther apart than contacts are looked for at rest.
    pub fn between_fixed(
        &mut self,
        robots @ [a, b]: [&RobotColliders; 2],
        (put, slack): (bool, f64),
        known: &mut Fixed,
        found: impl FnMut(Touch),
    ) {
        let (path, reach) = (a.path + b.path, a.reach + b.reach);
        if !put && path + reach < known.apart && path < known.together {
            return;
        }
        let own = known.robots[0] == known.robots[1];
        let look = Look { robots, own, put, slack, path };
        let mut memory = std::mem::take(&mut self.look);
        let LookMemory { before, touches, stuck } = &mut memory;
        std::mem::swap(before, &mut known.merged);
        known.merged.clear();
        touches.clear();
        stuck.clear();
        (known.apart, known.together) = (f64::INFINITY, f64::INFINITY);
        if own {
            a.own_pairs.iter().for_each(|&pair| self.judge(&look, pair, known, &mut memory));
        } else {
            for (i, first) in a.placed.iter().enumerate() {
                if first.bounds.meets(&b.bounds) {
                    (0..b.placed.len()).for_each(|j| self.judge(&look, [i, j], known, &mut memory));
                } else {
                    known.stays_apart(&look, first.bounds.gap(&b.bounds) + first.margin);
                }
            }
        }
        if put && !own {
            merge_near(&look, known, &memory);
        }
        memory.touches.retain(|touch| known.merged.binary_search(&touch.colliders).is_err());
        memory.touches.iter().copied().for_each(found);
        self.look = memory;
    }

    /// Finds what a pair of colliders is.
    fn judge(&mut self, look: &Look<'_>, pair: [usize; 2], known: &mut Fixed, memory: &mut LookMemory) {
        let Look { robots: [a, b], own, put, slack, path } = *look;
        let [first, second] = [&a.placed[pair[0]], &b.placed[pair[1]]];
        let moving = [first, second].into_iter().filter(|placed| placed.body.is_some()).count();
        let within = first.margin + second.margin;
        if moving == 0 && (own || !put) {
            return;
        }
        if !first.bounds.meets(&second.bounds) {
            if moving > 0 {
                known.stays_apart(look, first.bounds.gap(&second.bounds) + within);
            }
            return;
        }
        let [one, other] = look.solids(pair);
        let a_from_b = first.world_from_shape.inverse() * second.world_from_shape;
        let deep = DEEP.min(one.inner.radius().min(other.inner.radius()) / 2.0).max(LEAST_DEEP);
        let both = [(0, first.body), (1, second.body)];
        if moving == 0 {
            // It cannot push, but says what is in what.
            if overlap_by(deep, one, other, &a_from_b) {
                memory.stuck.extend(both);
            }
            return;
        }
        let was = memory.before.binary_search(&pair).is_ok();
        let is_deep = put && overlap_by(deep, one, other, &a_from_b);
        let separation = separation(one, other, &a_from_b);
        if is_deep {
            memory.stuck.extend(both);
        }
        if is_deep || (was && separation < slack * moving as f64) {
            known.merged.push(pair);
            known.together = known.together.min(path + TRUSTED * (slack * moving as f64 - separation));
            return;
        }
        if separation >= within {
            known.stays_apart(look, separation);
            return;
        }
        // Something may touch: the next look is the next time.
        known.apart = f64::NEG_INFINITY;
        let start = memory.touches.len();
        self.pair(pair, [a, b], [first, second], &mut |touch| memory.touches.push(touch));
        if put && memory.touches[start..].iter().any(|touch| touch.distance < -deep) {
            memory.stuck.extend(both);
            known.merged.push(pair);
        }
    }
}

impl Look<'_> {
    fn solids(&self, pair: [usize; 2]) -> [Solid<'_>; 2] {
        [0, 1].map(|side| {
            let placed = &self.robots[side].placed[pair[side]];
            Solid { shape: self.robots[side].shape(placed), inner: self.robots[side].inner(placed) }
        })
    }
}

impl Fixed {
    /// A pair is so far apart.
    fn stays_apart(&mut self, look: &Look<'_>, distance: f64) {
        self.apart = self.apart.min(look.path + EXACT * distance);
    }
}

/// Merges what is near and stuck on both sides.
fn merge_near(look: &Look<'_>, known: &mut Fixed, memory: &LookMemory) {
    let deep = known.merged.len();
    for touching in memory.touches.chunk_by(|a, b| a.colliders == b.colliders) {
        let Touch { colliders, bodies, .. } = touching[0];
        let moving = bodies.iter().filter(|body| body.is_some()).count();
        let near = touching.iter().any(|touch| touch.distance < look.slack * moving as f64);
        let stuck = [0, 1].iter().all(|&side| memory.stuck.contains(&(side, bodies[side])));
        if near && stuck && known.merged[..deep].binary_search(&colliders).is_err() {
            known.merged.push(colliders);
        }
    }
    known.merged.sort_unstable();
}

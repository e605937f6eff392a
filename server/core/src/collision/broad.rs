//! Broad phase: pairs of robots near each other. The bounds of movable robots are sorted along one axis and
//! swept; the others are in a tree.

use pulp::Arch;

use super::RobotColliders;
use super::bounds::Bounds;
use super::still::Still;

/// Finds robots whose bounds overlap. Reuses its memory, and keeps no other state.
#[derive(Default)]
pub struct BroadPhase {
    bounds: Vec<Entry>,
    pairs: Vec<[usize; 2]>,
    /// Immovable robots in order, and their tree. Rebuilt when one of them is moved.
    still: Vec<(usize, Bounds)>,
    tree: Still,
    near: Vec<usize>,
    sorted: Sorted,
}

/// Number of bounds that are compared at once.
const AT_ONCE: usize = 8;

/// Bounds in the order of their lower ends along an axis: lower and upper ends along that axis and the two
/// others, one list each.
///
/// Some sentinels follow the last one; they overlap with nothing, not even with infinite bounds.
#[derive(Default)]
struct Sorted {
    least: [Vec<f64>; 3],
    most: [Vec<f64>; 3],
}

impl Sorted {
    fn replace(&mut self, entries: &[Entry], axis: usize) {
        let Self { least, most } = self;
        for (k, (least, most)) in least.iter_mut().zip(most).enumerate() {
            let axis = (axis + k) % 3;
            least.clear();
            least.extend(entries.iter().map(|entry| entry.bounds.least[axis]));
            least.extend([f64::NAN; AT_ONCE]);
            most.clear();
            most.extend(entries.iter().map(|entry| entry.bounds.most[axis]));
            most.extend([f64::NAN; AT_ONCE]);
        }
    }

    /// Calls `found` with each one after the `i`th whose bounds overlap with the `i`th's.
    #[inline(always)]
    fn later(&self, i: usize, mut found: impl FnMut(usize)) {
        let ([a, b, c], [a_most, b_most, c_most]) = (&self.least, &self.most);
        let (end, b_least, b_end, c_least, c_end) = (a_most[i], b[i], b_most[i], c[i], c_most[i]);
        let mut at = i + 1;
        while let (Some(a), Some(b), Some(b_most), Some(c), Some(c_most)) =
            (eight(a, at), eight(b, at), eight(b_most, at), eight(c, at), eight(c_most, at))
        {
            let mut meets = [false; AT_ONCE];
            for k in 0..AT_ONCE {
                meets[k] = (a[k] <= end)
                    & (b[k] <= b_end)
                    & (b_least <= b_most[k])
                    & (c[k] <= c_end)
                    & (c_least <= c_most[k]);
            }
            if meets != [false; AT_ONCE] {
                (0..AT_ONCE).filter(|&k| meets[k]).for_each(|k| found(at + k));
            }
            if a[AT_ONCE - 1] > end {
                break;
            }
            at += AT_ONCE;
        }
    }
}

/// Returns [`AT_ONCE`] numbers from an index on.
#[inline(always)]
fn eight(numbers: &[f64], at: usize) -> Option<&[f64; AT_ONCE]> {
    numbers.get(at..)?.first_chunk()
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    robot: usize,
    /// Whether it moves, and is not asleep.
    awake: bool,
    /// Whether it may touch itself.
    own: bool,
    /// Whether it is a ball, as large as its bounds.
    is_ball: bool,
    bounds: Bounds,
}

impl Entry {
    /// Returns whether two robots whose bounds meet are balls that do not.
    #[inline(always)]
    fn is_beside(&self, other: &Self) -> bool {
        let size = |bounds: &Bounds| bounds.most - bounds.least;
        let reach = (size(&self.bounds).x + size(&other.bounds).x) * (1.0 + ROUNDING);
        let way = (self.bounds.least - other.bounds.least) + (self.bounds.most - other.bounds.most);
        self.is_ball && other.is_ball && way.length_squared() > reach * reach
    }
}

/// Relative tolerance: balls whose distance exceeds their radii by no more than this part may touch.
const ROUNDING: f64 = 1e-9;

impl std::fmt::Debug for BroadPhase {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("broad phase")
    }
}

impl BroadPhase {
    /// Returns pairs of robots in order, the earlier robot first. They are the pairs of which one robot is
    /// awake and whose bounds overlap, except two balls that do not meet. An awake robot that may touch
    /// itself forms a pair with itself.
    ///
    /// `robots` are in order, with their colliders in place, and whether they are awake; disabled robots are
    /// left out. If `others_stay`, immovable robots are unchanged since the last call, whether they are
    /// listed or not.
    ///
    /// Cohen, Lin, Manocha and Ponamgi, "I-COLLIDE" (1995): sweep and prune, along the axis with the largest
    /// spread of robots.
    pub fn pairs<'a>(
        &mut self,
        robots: impl Iterator<Item = (usize, &'a RobotColliders, bool)>,
        others_stay: bool,
    ) -> &[[usize; 2]] {
        let Self { bounds: moving, pairs, still, tree, near, sorted } = self;
        pairs.clear();
        moving.clear();
        let (mut count, mut is_new) = (0, false);
        for (robot, colliders, awake) in robots.filter(|(_, colliders, _)| !colliders.is_empty()) {
            let bounds = colliders.bounds;
            if awake || !colliders.is_still() {
                let (own, is_ball) = (colliders.has_self_collision(), colliders.is_ball());
                moving.push(Entry { robot, awake, own, is_ball, bounds });
            } else if !others_stay {
                if still.get(count) != Some(&(robot, bounds)) {
                    still.truncate(count);
                    still.push((robot, bounds));
                    is_new = true;
                }
                count += 1;
            }
        }
        if !others_stay && (is_new || count < still.len()) {
            still.truncate(count);
            tree.replace(still.iter().copied());
        }
        let axis = widest_axis(moving);
        moving.sort_unstable_by(|a, b| {
            a.bounds.least[axis].total_cmp(&b.bounds.least[axis]).then(a.robot.cmp(&b.robot))
        });
        sorted.replace(moving, axis);
        pairs.extend(moving.iter().filter(|a| a.awake && a.own).map(|a| [a.robot; 2]));
        Arch::new().dispatch(
            #[inline(always)]
            || {
                for (i, a) in moving.iter().enumerate() {
                    sorted.later(i, |j| {
                        let b = &moving[j];
                        if (a.awake || b.awake) && !a.is_beside(b) {
                            pairs.push([a.robot.min(b.robot), a.robot.max(b.robot)]);
                        }
                    });
                }
            },
        );
        for a in moving.iter().filter(|a| a.awake) {
            near.clear();
            tree.candidates(&a.bounds, near);
            for &other in &*near {
                let found = still.binary_search_by_key(&other, |(robot, _)| *robot);
                let meets = found.is_ok_and(|index| still[index].1.meets(&a.bounds));
                if meets {
                    pairs.push([a.robot.min(other), a.robot.max(other)]);
                }
            }
        }
        pairs.sort_unstable();
        pairs
    }
}

/// Returns the axis along which the centres of bounded robots vary most.
fn widest_axis(entries: &[Entry]) -> usize {
    let (mut sum, mut squares, mut count) = ([0.0; 3], [0.0; 3], 0.0);
    for Entry { bounds, .. } in entries {
        let middle = ((bounds.least + bounds.most) / 2.0).to_array();
        if (bounds.most - bounds.least).max_element() < 1e6 {
            count += 1.0;
            for i in 0..3 {
                sum[i] += middle[i];
                squares[i] += middle[i] * middle[i];
            }
        }
    }
    let spread = |i: &usize| squares[*i] * count - sum[*i] * sum[*i];
    (0..3).max_by(|a, b| spread(a).total_cmp(&spread(b))).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use glamx::DVec3;

    use super::*;

    #[test]
    fn balls_are_apart_where_their_bounds_meet_at_a_corner_alone() {
        let ball = |middle: DVec3, radius: f64| {
            let bounds = Bounds { least: middle - radius, most: middle + radius };
            Entry { robot: 0, awake: true, own: false, is_ball: true, bounds }
        };
        let first = ball(DVec3::new(3.0, -2.0, 0.1), 0.5);
        for (way, size) in
            [(DVec3::X, 0.2), (DVec3::new(1.0, 1.0, -1.0), 0.4), (DVec3::new(0.3, -0.2, 0.9), 1.5)]
        {
            let at = |gap: f64| first.bounds.least + 0.5 + way.normalize() * (0.5 + size + gap);
            assert!(first.is_beside(&ball(at(1e-6), size)), "{way}");
            assert!(!first.is_beside(&ball(at(0.0), size)), "{way}");
            assert!(!first.is_beside(&ball(at(-1e-6), size)), "{way}");
            let cube = Entry { is_ball: false, ..ball(at(1e-6), size) };
            assert!(!first.is_beside(&cube) && !cube.is_beside(&first));
        }
    }

    #[test]
    fn sorted_bounds_find_what_overlaps_and_nothing_else() {
        // Quasi-random numbers by the golden ratio.
        let mut at = 0.0;
        let mut next = || {
            at = (at + 0.618_033_988_749_894_9_f64).fract();
            at
        };
        for count in [0, 1, 7, 8, 9, 60] {
            for axis in 0..3 {
                let mut entries: Vec<_> = (0..count)
                    .map(|robot| {
                        let least = DVec3::new(next(), next(), next());
                        let bounds = Bounds { least, most: least + 0.4 * next() };
                        Entry { robot, awake: true, own: false, is_ball: false, bounds }
                    })
                    .collect();
                if let Some(entry) = entries.get_mut(3) {
                    entry.bounds.least = DVec3::NEG_INFINITY;
                    entry.bounds.most = DVec3::INFINITY;
                }
                entries.sort_by(|a, b| a.bounds.least[axis].total_cmp(&b.bounds.least[axis]));
                let mut sorted = Sorted::default();
                sorted.replace(&entries, axis);
                for (i, entry) in entries.iter().enumerate() {
                    let mut found = Vec::new();
                    sorted.later(i, |j| found.push(j));
                    let expected: Vec<_> =
                        (i + 1..count).filter(|&j| entry.bounds.meets(&entries[j].bounds)).collect();
                    assert_eq!(found, expected, "{i} of {count} along {axis}");
                }
            }
        }
    }
}

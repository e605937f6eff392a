//! Which robots are near each other: of those that can move the bounds sorted along one axis, and swept; the others in a
//! tree.

use super::RobotColliders;
use super::bounds::Bounds;
use super::still::Still;

/// Finds robots whose bounds overlap. Keeps its memory from step to step, and no more.
#[derive(Default)]
pub struct BroadPhase {
    bounds: Vec<Entry>,
    pairs: Vec<[usize; 2]>,
    /// Robots that cannot move, in order, and the tree of them. Made anew when one of them is elsewhere.
    still: Vec<(usize, Bounds)>,
    tree: Still,
    near: Vec<usize>,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    robot: usize,
    /// It moves, and is not asleep.
    awake: bool,
    /// It may touch itself.
    own: bool,
    bounds: Bounds,
}

impl std::fmt::Debug for BroadPhase {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("broad phase")
    }
}

impl BroadPhase {
    /// Pairs of robots, the earlier first, in their order: those of which one is awake, and
    /// whose bounds overlap; and each one that is awake with itself, where it may touch itself. Robots come in their order, with
    /// their colliders in place, and whether they are awake; those that take no part do not come. Where `others_stay`, those that
    /// cannot move are as they were when this was last called, whether they come or not.
    ///
    /// Cohen, Lin, Manocha and Ponamgi, "I-COLLIDE" (1995): sweep and prune, along the axis on which
    /// the robots are spread the most.
    pub fn pairs<'a>(
        &mut self,
        robots: impl Iterator<Item = (usize, &'a RobotColliders, bool)>,
        others_stay: bool,
    ) -> &[[usize; 2]] {
        let Self { bounds: moving, pairs, still, tree, near } = self;
        pairs.clear();
        moving.clear();
        let (mut count, mut is_new) = (0, false);
        for (robot, colliders, awake) in robots.filter(|(_, colliders, _)| !colliders.is_empty()) {
            let bounds = colliders.bounds;
            if awake || !colliders.is_still() {
                moving.push(Entry { robot, awake, own: colliders.has_self_collision(), bounds });
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
        for (i, a) in moving.iter().enumerate() {
            if a.awake && a.own {
                pairs.push([a.robot; 2]);
            }
            let end = a.bounds.most[axis];
            for b in moving[i + 1..].iter().take_while(|b| b.bounds.least[axis] <= end) {
                if (a.awake || b.awake) && a.bounds.meets(&b.bounds) {
                    pairs.push([a.robot.min(b.robot), a.robot.max(b.robot)]);
                }
            }
        }
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

/// The axis along which the middles of bounded robots vary the most.
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

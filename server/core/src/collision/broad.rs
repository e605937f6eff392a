//! Which robots are near each other: their bounds sorted along one axis, and swept.

use super::RobotColliders;
use super::colliders::Bounds;

/// Finds robots whose bounds overlap. Keeps its memory from step to step, and no more.
#[derive(Clone, Debug, Default)]
pub struct Broad {
    bounds: Vec<Entry>,
    pairs: Vec<[usize; 2]>,
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

impl Broad {
    /// Pairs of robots, the earlier first, in their order: those of which one is awake, and
    /// whose bounds overlap; and each one that is awake with itself, where it may touch itself. Robots come as colliders, in place, and whether they are awake;
    /// those that take no part as `None`.
    ///
    /// Cohen, Lin, Manocha and Ponamgi, "I-COLLIDE" (1995): sweep and prune, along the axis on which
    /// the robots are spread the most.
    pub fn pairs<'a>(
        &mut self,
        robots: impl Iterator<Item = Option<(&'a RobotColliders, bool)>>,
    ) -> &[[usize; 2]] {
        self.pairs.clear();
        self.bounds.clear();
        self.bounds.extend(robots.enumerate().filter_map(|(robot, present)| {
            let (colliders, awake) = present.filter(|(colliders, _)| !colliders.is_empty())?;
            Some(Entry { robot, awake, own: colliders.has_self_collision(), bounds: colliders.bounds })
        }));
        let axis = self.widest_axis();
        self.bounds.sort_unstable_by(|a, b| {
            a.bounds.least[axis].total_cmp(&b.bounds.least[axis]).then(a.robot.cmp(&b.robot))
        });
        for (i, a) in self.bounds.iter().enumerate() {
            if a.awake && a.own {
                self.pairs.push([a.robot; 2]);
            }
            let end = a.bounds.most[axis];
            for b in self.bounds[i + 1..].iter().take_while(|b| b.bounds.least[axis] <= end) {
                if (a.awake || b.awake) && a.bounds.meets(&b.bounds) {
                    self.pairs.push([a.robot.min(b.robot), a.robot.max(b.robot)]);
                }
            }
        }
        self.pairs.sort_unstable();
        &self.pairs
    }

    /// The axis along which the middles of bounded robots vary the most.
    fn widest_axis(&self) -> usize {
        let (mut sum, mut squares, mut count) = ([0.0; 3], [0.0; 3], 0.0);
        for Entry { bounds, .. } in &self.bounds {
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
}

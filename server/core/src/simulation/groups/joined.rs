//! Union-find of robots in groups.

/// Sets of robots that are joined pair by pair (Galler and Fischer, "An improved equivalence algorithm",
/// 1964).
#[derive(Debug, Default)]
pub(super) struct Joined {
    /// For each robot: one on the way to the first of its set.
    above: Vec<usize>,
    is_any: bool,
}

impl Joined {
    /// Starts with `count` robots, each of them alone.
    pub(super) fn begin(&mut self, count: usize) {
        self.above.clear();
        self.above.extend(0..count);
        self.is_any = false;
    }

    pub(super) fn join(&mut self, robots: [usize; 2]) {
        let [a, b] = robots.map(|robot| self.find(robot));
        self.above[a.max(b)] = a.min(b);
        self.is_any |= a != b;
    }

    /// Completes the sets after all pairs are joined.
    pub(super) fn end(&mut self) {
        if self.is_any {
            for robot in 0..self.above.len() {
                self.above[robot] = self.find(robot);
            }
        }
    }

    /// Returns whether any two are joined.
    pub(super) fn is_any(&self) -> bool {
        self.is_any
    }

    /// Returns the first robot of a robot's set, once all are joined.
    pub(super) fn first(&self, robot: usize) -> usize {
        self.above[robot]
    }

    /// Returns the first robot of a robot's set before all are joined. Halves the search path for the next
    /// time.
    fn find(&mut self, mut robot: usize) -> usize {
        let above = &mut self.above;
        while above[robot] != robot {
            above[robot] = above[above[robot]];
            robot = above[robot];
        }
        robot
    }
}

//! Which robots are in one group.

/// Sets of robots that are joined one pair after the other (Galler and Fischer, "An improved equivalence algorithm", 1964).
#[derive(Debug, Default)]
pub(super) struct Joined {
    /// Of each robot: one on the way to its set's first.
    above: Vec<usize>,
    is_any: bool,
}

impl Joined {
    /// So many robots, each of which is alone.
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

    /// All are joined that will be.
    pub(super) fn end(&mut self) {
        if self.is_any {
            for robot in 0..self.above.len() {
                self.above[robot] = self.find(robot);
            }
        }
    }

    /// Whether any two are.
    pub(super) fn is_any(&self) -> bool {
        self.is_any
    }

    /// The first robot of a robot's set, once all are joined.
    pub(super) fn first(&self, robot: usize) -> usize {
        self.above[robot]
    }

    /// The same meanwhile. Halves the way for the next time.
    fn find(&mut self, mut robot: usize) -> usize {
        let above = &mut self.above;
        while above[robot] != robot {
            above[robot] = above[above[robot]];
            robot = above[robot];
        }
        robot
    }
}

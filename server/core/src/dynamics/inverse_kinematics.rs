//! Inverse kinematics: joint positions that bring a link to a pose.

use glamx::{DMat3, DQuat, DVec3};

use super::configuration::{Configuration, Kinematics};
use super::jacobian::fill;
use super::spatial::Spatial;
use super::spherical::turn_by;
use super::tree::{Body, JointType, Tree};

/// Desired pose of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Index of the link in the model.
    pub link: usize,
    /// Point to bring to `position`, in the link's frame, metres.
    pub point: DVec3,
    /// Desired position of the point, world axes, metres.
    pub position: DVec3,
    /// Desired `world_from_link`; `None` if only the position counts.
    pub orientation: Option<DQuat>,
}

/// Axis of a joint that may be moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Movable {
    /// Body in the tree; one with six degrees of freedom is not moved.
    pub body: usize,
    /// Lower limit, rad or m; ignored for a ball joint.
    pub lower: f64,
    /// Upper limit, rad or m; ignored for a ball joint.
    pub upper: f64,
}

/// Termination criteria.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverOptions {
    /// Maximum number of steps; each evaluates the kinematics once.
    pub iterations: u32,
    /// Tolerance, metres; radians count as metres.
    pub tolerance: f64,
}

/// Best solution found.
#[derive(Clone, Debug, PartialEq)]
pub struct IkSolution {
    /// Positions of the joints without the root, as in [`Configuration`].
    pub positions: Vec<f64>,
    /// Whether the errors are within the tolerance.
    pub converged: bool,
    /// Error of the position, metres.
    pub position_error: f64,
    /// Error of the orientation, radians; 0 if no orientation was requested.
    pub orientation_error: f64,
    /// Number of steps made.
    pub iterations: u32,
}

/// Damping: initial value, minimum, factor after a step that increased the error, and factor after one that
/// reduced it.
const DAMPING: (f64, f64, f64, f64) = (1e-3, 1e-9, 4.0, 0.25);
/// Number of steps after which a search that has not halved its distance is stuck. Otherwise it converges
/// quadratically.
const MAX_STALLED: u32 = 10;
/// Additional distance of each restart, as a part of the joints' ranges.
const REACH: f64 = 0.25;

/// Moves joints from a guess until the link is at the goal, by damped least squares: dq = J' (J J' + w 1)^-1
/// e. w is adapted as by Levenberg and Marquardt (Nocedal and Wright, "Numerical Optimization" (2006),
/// section 10.3). Joints at a limit that would move beyond it are held there.
///
/// If the search is stuck short of the goal (a stretched arm, a limit in the way), it restarts near the best
/// solution. Each restart is further away. Restarts are deterministic: equal questions have equal answers.
/// Mimic joints follow their leaders. Returns the best solution so far as soon as `is_cancelled` returns
/// true, which is called before each step.
pub fn inverse_kinematics(
    tree: &Tree,
    guess: &Configuration,
    goal: &Goal,
    movables: &[Movable],
    options: SolverOptions,
    is_cancelled: &dyn Fn() -> bool,
) -> IkSolution {
    let (q, qd) = guess.state(tree);
    let mut search = Search::new(tree, guess, goal, movables, &q, vec![0.0; qd.len()]);
    let mut here = search.put(&q);
    let mut best = (here, search.q.clone());
    let (mut damping, mut nudges, mut iterations) = (DAMPING.0, 0_u32, 0);
    // Distance to be halved, and the number of steps since it was.
    let mut halving = (here.size(), 0);
    while best.0.size() > options.tolerance && iterations < options.iterations && !movables.is_empty() {
        if is_cancelled() {
            break;
        }
        iterations += 1;
        if halving.1 >= MAX_STALLED {
            nudges += 1;
            let beside = search.beside(&best.1, nudges);
            here = search.put(&beside);
            (damping, halving) = (DAMPING.0, (here.size(), 0));
        } else {
            let before = search.q.clone();
            let next = search.next(&here, damping);
            let there = search.put(&next);
            if there.size() < here.size() {
                damping = (damping * DAMPING.3).max(DAMPING.1);
                here = there;
            } else {
                damping *= DAMPING.2;
                search.put(&before);
            }
            halving =
                if here.size() < halving.0 / 2.0 { (here.size(), 0) } else { (halving.0, halving.1 + 1) };
        }
        if here.size() < best.0.size() {
            best = (here, search.q.clone());
        }
    }
    let (gap, q) = best;
    IkSolution {
        positions: q.get(tree.root_positions()..).unwrap_or_default().to_vec(),
        converged: gap.size() <= options.tolerance,
        position_error: gap.position.length(),
        orientation_error: gap.rotation.length(),
        iterations,
    }
}

/// Difference between the link's pose and the goal, in the base's axes.
#[derive(Clone, Copy, Debug)]
struct Gap {
    /// Position, metres.
    position: DVec3,
    /// Rotation, axis times angle, radians; zero if no orientation was requested.
    rotation: DVec3,
}

impl Gap {
    fn size(&self) -> f64 {
        (self.position.length_squared() + self.rotation.length_squared()).sqrt()
    }
}

struct Search<'a> {
    tree: &'a Tree,
    goal: &'a Goal,
    /// Goal in the base's axes.
    position: DVec3,
    rotation: Option<DMat3>,
    movables: &'a [Movable],
    /// For each movable, the velocities that it moves and their factors: its own and its followers'.
    moves: Vec<Vec<(usize, f64)>>,
    q: Vec<f64>,
    at_rest: Vec<f64>,
    kinematics: Kinematics,
    columns: Vec<Spatial>,
}

impl<'a> Search<'a> {
    fn new(
        tree: &'a Tree,
        guess: &Configuration,
        goal: &'a Goal,
        movables: &'a [Movable],
        q: &[f64],
        at_rest: Vec<f64>,
    ) -> Self {
        let base = guess.base(tree);
        let base_from_world = base.rotation.transpose();
        Self {
            tree,
            goal,
            position: base_from_world * (goal.position - base.origin),
            rotation: goal.orientation.map(|orientation| base_from_world * DMat3::from_quat(orientation)),
            movables,
            moves: movables.iter().map(|movable| moves(tree, movable.body)).collect(),
            q: q.to_vec(),
            kinematics: Kinematics::new(tree, q, &at_rest),
            columns: vec![Spatial::ZERO; at_rest.len()],
            at_rest,
        }
    }

    /// Moves the joints to positions within their limits, and returns the remaining gap to the goal.
    fn put(&mut self, q: &[f64]) -> Gap {
        self.q.copy_from_slice(q);
        for movable in self.movables {
            let Body { joint_type, position, .. } = self.tree.bodies[movable.body];
            if let JointType::Spherical { .. } = joint_type {
                // Ball joints have no limits.
                continue;
            }
            self.q[position] = self.q[position].max(movable.lower).min(movable.upper);
        }
        self.tree.apply_mimics(&mut self.q);
        self.kinematics.update(self.tree, &self.q, &self.at_rest);
        let link = self.kinematics.link(self.tree, self.goal.link);
        let position = self.position - (link.origin + link.rotation * self.goal.point);
        let rotation = self.rotation.map_or(DVec3::ZERO, |goal| {
            let turn = DQuat::from_mat3(&(goal * link.rotation.transpose())).normalize();
            // The short way round.
            (if turn.w < 0.0 { -turn } else { turn }).to_scaled_axis()
        });
        Gap { position, rotation }
    }

    /// Returns the next positions of the joints.
    fn next(&mut self, gap: &Gap, damping: f64) -> Vec<f64> {
        let link = self.kinematics.link(self.tree, self.goal.link);
        let point = link.origin + link.rotation * self.goal.point;
        fill(self.tree, &self.kinematics, self.goal.link, point, &mut self.columns);
        let turns = self.rotation.is_some();
        let error = rows(Spatial::new(gap.rotation, gap.position), turns);
        let columns: Vec<[f64; 6]> = (self.moves.iter().zip(self.movables))
            .map(|(moves, movable)| {
                let sum =
                    |sum: Spatial, &(velocity, factor): &(usize, f64)| sum + self.columns[velocity] * factor;
                let column = rows(moves.iter().fold(Spatial::ZERO, sum), turns);
                let position = self.q[self.tree.bodies[movable.body].position];
                let pull: f64 = column.iter().zip(&error).map(|(a, b)| a * b).sum();
                let is_held =
                    (pull < 0.0 && position <= movable.lower) || (pull > 0.0 && position >= movable.upper);
                if is_held { [0.0; 6] } else { column }
            })
            .collect();
        let mut matrix = [[0.0; 6]; 6];
        for (i, row) in matrix.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value = columns.iter().map(|column| column[i] * column[j]).sum();
            }
            row[i] += damping;
        }
        let weights = solve(matrix, error);
        let mut next = self.q.clone();
        for (column, movable) in columns.iter().zip(self.movables) {
            let change: f64 = column.iter().zip(&weights).map(|(a, b)| a * b).sum();
            self.move_axis(&mut next, movable.body, change);
        }
        next
    }

    /// Moves a joint along one of its axes; a ball joint turns about its child's.
    fn move_axis(&self, q: &mut [f64], body: usize, change: f64) {
        let body = &self.tree.bodies[body];
        let q = &mut q[body.position..];
        match body.joint_type {
            JointType::Spherical { axis } => turn_by(q, DVec3::AXES[usize::from(axis)] * change),
            _ => q[0] += change,
        }
    }

    /// Returns a point near another, further from it each time. The golden ratio distributes the numbers
    /// evenly (Weyl's sequence), without randomness.
    fn beside(&self, q: &[f64], time: u32) -> Vec<f64> {
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let mut beside = q.to_vec();
        let reach = (f64::from(time) * REACH).min(1.0);
        for (i, movable) in self.movables.iter().enumerate() {
            let span = (movable.upper - movable.lower) / 2.0;
            let span = if span.is_finite() { span.min(std::f64::consts::PI) } else { std::f64::consts::PI };
            let number = ((f64::from(time) + 0.5) * GOLDEN + i as f64 * GOLDEN * GOLDEN).fract();
            self.move_axis(&mut beside, movable.body, (2.0 * number - 1.0) * reach * span);
        }
        beside
    }
}

/// Returns the velocity of a body and of all its followers, with their factors.
fn moves(tree: &Tree, body: usize) -> Vec<(usize, f64)> {
    let mut bodies = vec![(body, 1.0)];
    // Chains of mimic joints are at most as long as the number of pairs.
    for _ in 0..tree.mimics.len() {
        for pair in &tree.mimics {
            let leader = bodies.iter().find(|(known, _)| *known == pair.leader).map(|(_, factor)| *factor);
            if let Some(factor) = leader.filter(|_| bodies.iter().all(|(known, _)| *known != pair.follower)) {
                bodies.push((pair.follower, factor * pair.multiplier));
            }
        }
    }
    let single = |(body, _): &(usize, f64)| !matches!(tree.bodies[*body].joint_type, JointType::Free { .. });
    bodies.into_iter().filter(single).map(|(body, factor)| (tree.bodies[body].velocity, factor)).collect()
}

/// Returns the linear part, then the angular part if it counts.
fn rows(value: Spatial, turns: bool) -> [f64; 6] {
    let (l, a) = (value.linear, if turns { value.angular } else { DVec3::ZERO });
    [l.x, l.y, l.z, a.x, a.y, a.z]
}

/// Solves a symmetric positive definite system by Cholesky's method (Golub and Van Loan, algorithm 4.2.1).
/// The damping on the diagonal makes it definite.
#[allow(clippy::needless_range_loop, reason = "reads as the algorithm does")]
fn solve(mut a: [[f64; 6]; 6], mut x: [f64; 6]) -> [f64; 6] {
    for j in 0..6 {
        for k in 0..j {
            let factor = a[j][k];
            for i in j..6 {
                a[i][j] -= a[i][k] * factor;
            }
        }
        let root = a[j][j].max(f64::MIN_POSITIVE).sqrt();
        for i in j..6 {
            a[i][j] /= root;
        }
    }
    for i in 0..6 {
        for k in 0..i {
            x[i] -= a[i][k] * x[k];
        }
        x[i] /= a[i][i];
    }
    for i in (0..6).rev() {
        for k in i + 1..6 {
            x[i] -= a[k][i] * x[k];
        }
        x[i] /= a[i][i];
    }
    x
}

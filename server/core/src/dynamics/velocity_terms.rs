//! Coriolis, centrifugal and gyroscopic terms at the mean of the old and the new velocities, for trees in
//! which a body spins fast.
//!
//! Let b(q, v) be these terms, which are quadratic in v. The step is `M (u+ - u) + h b(q, (u + u+) / 2) = h
//! f`, the implicit midpoint rule. If M is constant (a flywheel on a free base) it keeps u' M u exactly,
//! since v' b(q, v) = 0 then. It is solved by iteration. If this does not converge fast, Newton's method with
//! the derivative of the terms at the extrapolated velocities solves it. MuJoCo's `implicit` does one
//! iteration of Newton's method.

use glamx::{DMat3, DVec3};

use super::articulated::{MidStep, along, free_velocities, part_mut, write_free};
use super::inertia::Rigid;
use super::kinematics::free_pose;
use super::scratch::Scratch;
use super::spatial::Spatial;
use super::spherical::velocity_product;
use super::tree::{JointType, Tree};

/// Turn of a body in a step from which its robot's velocity terms are solved for, radians.
///
/// The nutation of a body, or of a base with a flywheel in it, is at most twice as fast as the spin. At k rad
/// a step, leapfrog with extrapolated velocities removes the part k^4 / 4 of a nutation's energy in each
/// step. From 0.7 rad on it makes the nutation grow.
pub(super) const FAST: f64 = 0.1;

/// Largest number of degrees of freedom for which the derivative is used. Its cost is cubic and its memory
/// quadratic: with 64 it takes as long as sixty steps, with a thousand a quarter of a second.
const MAX_FACTORISED_DOFS: usize = 64;

/// Maximum number of iterations; five to ten are usual.
const MAX_ITERATIONS: usize = 20;

/// Plain iteration continues while each change is at most this part of the one before.
const CONTRACTS: f64 = 0.1;

/// Iteration ends when no velocity changes by more than this part of the largest.
const SETTLED: f64 = 1e-13;

/// Memory of the solver.
#[derive(Debug)]
pub struct VelocityTerms {
    bodies: Vec<Moving>,
    /// 1 + h/2 M^-1 db/dv, factorised, row by row. It has the largest size that was needed, at most
    /// [`MAX_FACTORISED_DOFS`] squared.
    matrix: Vec<f64>,
    pivots: Vec<usize>,
    /// Terms at the extrapolated velocities.
    explicit: Vec<f64>,
    terms: [Vec<f64>; 2],
    velocities: Vec<f64>,
    response: Vec<f64>,
    first: Vec<f64>,
    /// Change of the new velocities by [`solve`](Self::solve).
    solved: Vec<f64>,
}

/// State of one body, base axes.
#[derive(Clone, Copy, Debug, Default)]
struct Moving {
    inertia: Rigid,
    velocity: Spatial,
    acceleration: Spatial,
    force: Spatial,
}

/// Returns whether a body turns so fast that its robot needs [`VelocityTerms::solve`].
pub fn is_fast(scratch: &Scratch, h: f64) -> bool {
    let most = FAST / h;
    scratch.bodies.iter().any(|body| body.velocity.angular.length_squared() > most * most)
}

impl VelocityTerms {
    /// Creates the memory for robots of this tree. The matrix is allocated when it is needed.
    pub fn new(tree: &Tree) -> Self {
        let list = || vec![0.0; tree.velocity_count];
        Self {
            bodies: vec![Moving::default(); tree.bodies.len()],
            matrix: Vec::new(),
            pivots: Vec::new(),
            explicit: list(),
            terms: [list(), list()],
            velocities: list(),
            response: list(),
            first: list(),
            solved: list(),
        }
    }

    /// Changes `new`, the velocities after a step of `h` from `half` with the terms at `qd`, to those with
    /// the terms at their mean. Needs kinematics, and IA, U and D of this step.
    ///
    /// An iteration costs O(n) for n degrees of freedom. If the matrix is needed and n is at most
    /// [`MAX_FACTORISED_DOFS`], it costs O(n^2) and its factors O(n^3). Above that, only iteration is used. If it
    /// does not converge, the terms stay at `qd`.
    pub fn solve(
        &mut self,
        tree: &Tree,
        MidStep { q, qd, half }: MidStep<'_>,
        h: f64,
        scratch: &mut Scratch,
        new: &mut [f64],
    ) {
        self.fit(tree, scratch);
        let n = new.len();
        self.first.copy_from_slice(new);
        self.velocities.copy_from_slice(qd);
        self.find_terms(tree, q, scratch, 0);
        self.explicit.copy_from_slice(&self.terms[0]);
        let (mut is_factorised, mut before) = (false, f64::INFINITY);
        for _ in 0..MAX_ITERATIONS {
            for ((velocity, half), new) in self.velocities.iter_mut().zip(half).zip(&*new) {
                *velocity = 0.5 * (half + new);
            }
            self.find_terms(tree, q, scratch, 0);
            for (term, explicit) in self.terms[0].iter_mut().zip(&self.explicit) {
                *term -= explicit;
            }
            self.apply_inverse(tree, q, scratch);
            for ((response, first), new) in self.response.iter_mut().zip(&self.first).zip(&*new) {
                *response = new - first + h * *response;
            }
            if is_factorised {
                self.back_substitute();
            }
            let (mut change, mut size) = (0.0f64, 0.0f64);
            for (velocity, off) in new.iter_mut().zip(&self.response) {
                *velocity -= off;
                (change, size) = (change.max(off.abs()), size.max(velocity.abs()));
            }
            if change <= SETTLED * size {
                break;
            }
            if !is_factorised && change > CONTRACTS * before {
                if n <= MAX_FACTORISED_DOFS {
                    self.factorise(tree, q, qd, h, scratch);
                    is_factorised = true;
                } else if change >= before {
                    new.copy_from_slice(&self.first);
                    break;
                }
            }
            before = change;
        }
        for ((solved, new), first) in self.solved.iter_mut().zip(&*new).zip(&self.first) {
            *solved = new - first;
        }
    }

    /// Stores `predicted`, the velocities after a step without constraints, for
    /// [`begin_balance`](Self::begin_balance).
    pub fn keep(&mut self, predicted: &[f64]) {
        self.first.copy_from_slice(predicted);
    }

    /// Prepares [`balance`](Self::balance) for the velocities that were [kept](Self::keep). These follow from
    /// a step from `half` with the terms at `qd`, or with those of [`solve`](Self::solve) if they
    /// `are_solved`. Needs kinematics, and IA, U and D of this step.
    pub fn begin_balance(
        &mut self,
        tree: &Tree,
        MidStep { q, qd, half }: MidStep<'_>,
        scratch: &Scratch,
        are_solved: bool,
    ) {
        self.fit(tree, scratch);
        if are_solved {
            self.first.iter_mut().zip(&self.solved).for_each(|(first, solved)| *first -= solved);
        }
        for (list, velocities) in [qd, half].into_iter().enumerate() {
            self.velocities.copy_from_slice(velocities);
            self.find_terms(tree, q, scratch, list);
        }
        let [at_qd, at_half] = &self.terms;
        for ((explicit, at_qd), at_half) in self.explicit.iter_mut().zip(at_qd).zip(at_half) {
            *explicit = at_qd - 0.5 * at_half;
        }
    }

    /// Prepares [`balance`](Self::balance) for `halved`, the velocities after half of a kick from `given`
    /// ones with the terms at `given`.
    pub fn begin_half_kick(
        &mut self,
        tree: &Tree,
        q: &[f64],
        given: &[f64],
        scratch: &Scratch,
        halved: &[f64],
    ) {
        self.fit(tree, scratch);
        self.first.copy_from_slice(halved);
        self.velocities.copy_from_slice(given);
        self.find_terms(tree, q, scratch, 0);
        let [at_given, _] = &self.terms;
        self.explicit.iter_mut().zip(at_given).for_each(|(explicit, term)| *explicit = 0.5 * term);
    }

    /// Replaces `new`, an estimate of the velocities after the step, by those with the mean of the terms at
    /// both: `M (u+ - u) + h/2 (b(q, u) + b(q, u+)) = h f`. O(n).
    ///
    /// Velocity terms carry the momentum of bodies from axes to axes. They are quadratic: terms at the mean
    /// velocity lose b(q, u+ - u) / 4 if an actuator changes velocities within a step.
    pub fn balance(&mut self, tree: &Tree, q: &[f64], h: f64, scratch: &Scratch, new: &mut [f64]) {
        self.velocities.copy_from_slice(new);
        self.find_terms(tree, q, scratch, 0);
        for (term, explicit) in self.terms[0].iter_mut().zip(&self.explicit) {
            *term = 0.5 * *term - explicit;
        }
        self.apply_inverse(tree, q, scratch);
        for ((new, first), response) in new.iter_mut().zip(&self.first).zip(&self.response) {
            *new = first - h * response;
        }
    }

    /// Returns the change of velocities by the impulses of `change`, where each joint's impulse is multiplied
    /// by its own part. This is `M^-1 T M change`, with the M of the step. Needs IA, U and D of this step.
    /// O(n).
    pub fn part_of(
        &mut self,
        tree: &Tree,
        q: &[f64],
        scratch: &Scratch,
        change: &[f64],
        part: impl Fn(usize) -> f64,
    ) -> &[f64] {
        self.fit(tree, scratch);
        for (i, body) in tree.bodies.iter().enumerate() {
            let above = body.parent.map_or(Spatial::ZERO, |parent| self.bodies[parent].acceleration);
            let at = &scratch.bodies[i];
            let change = &change[body.velocity..];
            let z = at.rotation.z_axis;
            let own = match body.joint_type {
                JointType::Revolute | JointType::Spherical { .. } => Spatial::new(z * change[0], DVec3::ZERO),
                JointType::Prismatic => Spatial::new(DVec3::ZERO, z * change[0]),
                JointType::Free { .. } => free_motion(&q[body.position..], &at.rotation, change),
            };
            let moving = &mut self.bodies[i];
            moving.acceleration = above.motion_at(at.reach) + own;
            moving.force = moving.inertia.times(moving.acceleration);
        }
        self.project_forces(tree, q, scratch, 0);
        for (i, (body, at)) in tree.bodies.iter().zip(&scratch.bodies).enumerate() {
            let efforts = &mut self.terms[0][body.velocity..];
            if !matches!(body.joint_type, JointType::Free { .. }) && at.inverse_d > 0.0 {
                // Armature, springs and dampers in D.
                let own = along(body.joint_type, at.column, at.rotation.z_axis);
                efforts[0] += (1.0 / at.inverse_d - own) * change[body.velocity];
            }
            efforts[..body.joint_type.velocities()].iter_mut().for_each(|effort| *effort *= part(i));
        }
        self.apply_inverse(tree, q, scratch);
        &self.response
    }

    /// Transports `velocities` along a displacement of h times `way`, so that kinetic energy is kept in first
    /// order. This is parallel transport with the connection of M, v' = v - h M^-1 B(way, v), where B is the
    /// symmetric form of the velocity terms. Velocities about a body's own axes also lose h/2 way x v (Bullo
    /// and Lewis, "Geometric Control of Mechanical Systems" (2005), section 4.4). O(n).
    pub fn transport(
        &mut self,
        tree: &Tree,
        q: &[f64],
        (way, h): (&[f64], f64),
        scratch: &Scratch,
        velocities: &mut [f64],
    ) {
        self.fit(tree, scratch);
        self.velocities.iter_mut().zip(&*velocities).zip(way).for_each(|((sum, v), way)| *sum = v + way);
        self.find_terms(tree, q, scratch, 1);
        for own in [&*velocities, way] {
            self.velocities.copy_from_slice(own);
            self.find_terms(tree, q, scratch, 0);
            let [less, sum] = &mut self.terms;
            sum.iter_mut().zip(less).for_each(|(sum, less)| *sum -= *less);
        }
        let [efforts, sum] = &mut self.terms;
        efforts.iter_mut().zip(sum).for_each(|(effort, sum)| *effort = 0.5 * *sum);
        self.apply_inverse(tree, q, scratch);
        for body in &tree.bodies {
            let at = match body.joint_type {
                JointType::Free { .. } => body.velocity + 3,
                JointType::Spherical { axis: 0 } => body.velocity,
                _ => continue,
            };
            let of = |list: &[f64]| DVec3::new(list[at], list[at + 1], list[at + 2]);
            let turn = of(way).cross(of(velocities)) * 0.5;
            for (response, turn) in self.response[at..].iter_mut().zip(turn.to_array()) {
                *response += turn;
            }
        }
        velocities.iter_mut().zip(&self.response).for_each(|(velocity, response)| *velocity -= h * response);
    }

    fn fit(&mut self, tree: &Tree, scratch: &Scratch) {
        for ((moving, body), at) in self.bodies.iter_mut().zip(&tree.bodies).zip(&scratch.bodies) {
            moving.inertia = body.inertia.turned(&at.rotation);
        }
    }

    /// Computes the terms at `velocities` into the list of this number: the efforts that keep the velocities
    /// constant without gravity (Featherstone table 5.1).
    fn find_terms(&mut self, tree: &Tree, q: &[f64], scratch: &Scratch, list: usize) {
        for (i, body) in tree.bodies.iter().enumerate() {
            let above = body.parent.map_or(Moving::default(), |parent| self.bodies[parent]);
            let at = &scratch.bodies[i];
            let qd = &self.velocities[body.velocity..];
            let z = at.rotation.z_axis;
            let (own, own_acceleration) = match body.joint_type {
                JointType::Revolute | JointType::Spherical { .. } => {
                    (Spatial::new(z * qd[0], DVec3::ZERO), Spatial::ZERO)
                }
                JointType::Prismatic => (Spatial::new(DVec3::ZERO, z * qd[0]), Spatial::ZERO),
                JointType::Free { .. } => {
                    // Linear in the parent's axes, which do not turn with the body.
                    let own = free_motion(&q[body.position..], &at.rotation, qd);
                    (own, Spatial::new(DVec3::ZERO, -own.angular.cross(own.linear)))
                }
            };
            let moving = &mut self.bodies[i];
            moving.velocity = above.velocity.motion_at(at.reach) + own;
            let product = match body.joint_type {
                JointType::Spherical { axis: 2 } => {
                    let first = &self.velocities[body.velocity - 2..];
                    velocity_product(&at.rotation, first, moving.velocity)
                }
                JointType::Spherical { .. } => Spatial::ZERO,
                _ => moving.velocity.cross_motion(own),
            };
            moving.acceleration = above.acceleration.motion_at(at.reach) + product + own_acceleration;
            let momentum = moving.inertia.times(moving.velocity);
            moving.force = moving.inertia.times(moving.acceleration) + moving.velocity.cross_force(momentum);
        }
        self.project_forces(tree, q, scratch, list);
    }

    /// Writes S' of the force on each body and its subtree into the list of this number.
    fn project_forces(&mut self, tree: &Tree, q: &[f64], scratch: &Scratch, list: usize) {
        for (i, body) in tree.bodies.iter().enumerate().rev() {
            let (at, force) = (&scratch.bodies[i], self.bodies[i].force);
            let out = &mut self.terms[list][body.velocity..];
            match body.joint_type {
                JointType::Revolute | JointType::Prismatic | JointType::Spherical { .. } => {
                    out[0] = along(body.joint_type, force, at.rotation.z_axis);
                }
                JointType::Free { .. } => {
                    let (_, rotation) = free_pose(&q[body.position..]);
                    let (linear, angular) = free_velocities(force, &at.rotation, rotation);
                    write_free(out, linear, angular);
                }
            }
            if let Some(parent) = body.parent {
                self.bodies[parent].force += force.force_from(at.reach);
            }
        }
    }

    /// Computes 1 + h/2 M^-1 db/dv at `qd`, column by column, and its factors. The terms are quadratic:
    /// differences of any width give the exact derivative.
    fn factorise(&mut self, tree: &Tree, q: &[f64], qd: &[f64], h: f64, scratch: &Scratch) {
        let n = qd.len();
        self.matrix.resize(n * n, 0.0);
        self.pivots.resize(n, 0);
        let width = qd.iter().fold(0.0f64, |largest, velocity| largest.max(velocity.abs()));
        self.velocities.copy_from_slice(qd);
        for (j, &velocity) in qd.iter().enumerate() {
            for (list, sign) in [(0, -1.0), (1, 1.0)] {
                self.velocities[j] = velocity + sign * width;
                self.find_terms(tree, q, scratch, list);
            }
            self.velocities[j] = velocity;
            let [before, after] = &mut self.terms;
            for (before, after) in before.iter_mut().zip(after) {
                *before = (*after - *before) / (2.0 * width);
            }
            self.apply_inverse(tree, q, scratch);
            for (i, response) in self.response.iter().enumerate() {
                self.matrix[i * n + j] = f64::from(i == j) + 0.5 * h * response;
            }
        }
        // L U with row exchanges (Golub and Van Loan, algorithm 3.4.1).
        for k in 0..n {
            let size = |row: &usize| self.matrix[row * n + k].abs();
            let pivot = (k..n).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(k);
            self.pivots[k] = pivot;
            if pivot != k {
                (0..n).for_each(|column| self.matrix.swap(pivot * n + column, k * n + column));
            }
            let (above, below) = self.matrix.split_at_mut((k + 1) * n);
            let row = &above[k * n..];
            for other in below.chunks_exact_mut(n) {
                let factor = other[k] / row[k];
                other[k] = factor;
                for (entry, above) in other[k + 1..].iter_mut().zip(&row[k + 1..]) {
                    *entry -= factor * above;
                }
            }
        }
    }

    /// Solves for `response` in place.
    fn back_substitute(&mut self) {
        let Self { matrix, pivots, response, .. } = self;
        let n = response.len();
        for (k, pivot) in pivots.iter().enumerate() {
            response.swap(k, *pivot);
        }
        for k in 0..n {
            let sum: f64 = matrix[k * n..k * n + k].iter().zip(&*response).map(|(l, x)| l * x).sum();
            response[k] -= sum;
        }
        for k in (0..n).rev() {
            let row = &matrix[k * n..(k + 1) * n];
            let sum: f64 = row[k + 1..].iter().zip(&response[k + 1..]).map(|(u, x)| u * x).sum();
            response[k] = (response[k] - sum) / row[k];
        }
    }

    /// Computes `response` = M^-1 times the first list of terms, with the M of the step, by one backward and
    /// one forward pass.
    fn apply_inverse(&mut self, tree: &Tree, q: &[f64], scratch: &Scratch) {
        let Self { bodies, terms: [efforts, _], response, .. } = self;
        bodies.iter_mut().for_each(|body| body.force = Spatial::ZERO);
        for (i, body) in tree.bodies.iter().enumerate().rev() {
            let (at, p) = (&scratch.bodies[i], bodies[i].force);
            let effort = &efforts[body.velocity..];
            match body.joint_type {
                JointType::Revolute | JointType::Prismatic | JointType::Spherical { .. } => {
                    let impulse = effort[0] - along(body.joint_type, p, at.rotation.z_axis);
                    response[body.velocity] = impulse;
                    if let Some(parent) = body.parent {
                        let p = p + at.column * (at.inverse_d * impulse);
                        bodies[parent].force += p.force_from(at.reach);
                    }
                }
                JointType::Free { .. } => {
                    // The map from motion to velocities is only a rotation: its inverse converts efforts to
                    // forces.
                    let (_, rotation) = free_pose(&q[body.position..]);
                    let linear = rotation.inverse() * DVec3::new(effort[0], effort[1], effort[2]);
                    let angular = DVec3::new(effort[3], effort[4], effort[5]);
                    bodies[i].force -= Spatial::new(at.rotation * angular, at.rotation * linear);
                }
            }
        }
        for (i, body) in tree.bodies.iter().enumerate() {
            let above = body.parent.map_or(Spatial::ZERO, |parent| bodies[parent].acceleration);
            let at = &scratch.bodies[i];
            let carried = above.motion_at(at.reach);
            let out = &mut response[body.velocity..];
            match body.joint_type {
                JointType::Revolute | JointType::Prismatic | JointType::Spherical { .. } => {
                    let change = at.inverse_d * (out[0] - at.column.dot(carried));
                    bodies[i].acceleration = carried;
                    *part_mut(body.joint_type, &mut bodies[i].acceleration) += at.rotation.z_axis * change;
                    out[0] = change;
                }
                JointType::Free { slot } => {
                    let motion = scratch.free[slot].solve(-bodies[i].force);
                    bodies[i].acceleration = motion;
                    let (_, rotation) = free_pose(&q[body.position..]);
                    let (linear, angular) = free_velocities(motion - carried, &at.rotation, rotation);
                    write_free(out, linear, angular);
                }
            }
        }
    }
}

/// Returns a free body's own motion in the base's axes, from six velocities or changes of them.
fn free_motion(q: &[f64], base_from_body: &DMat3, values: &[f64]) -> Spatial {
    let (_, rotation) = free_pose(q);
    let linear = rotation.inverse() * DVec3::new(values[0], values[1], values[2]);
    let angular = DVec3::new(values[3], values[4], values[5]);
    Spatial::new(*base_from_body * angular, *base_from_body * linear)
}

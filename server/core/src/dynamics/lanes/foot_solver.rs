//! Impulses of feet, for all copies, as [`Island`](crate::dynamics::island::Island) finds them for one robot
//! that touches immovable ones.

use pulp::Simd;

use super::foot_rows::Foot;
use super::joint_rows::JointRows;
use super::robot::LaneRobot;
use super::tree_cholesky::TreeCholesky;
use crate::dynamics::constraint::contact_law::Resistance;
use crate::dynamics::direct::anderson::Anderson;
use crate::dynamics::island::{
    CORRECTION_SWEEPS, DIRECT_AT, MAX_SPLIT_VELOCITY, MAX_SWEEPS, SETTLED, SETTLED_ROUNDS, UNCHANGED,
};
use crate::dynamics::lane::number::{Lanes, Mask};
use crate::dynamics::lane::vectors::{Spatial, Vector};
use crate::dynamics::real::{MaskOf as _, Real as _};
use crate::dynamics::tree::Tree;

/// Memory of the solver.
#[derive(Debug)]
pub(super) struct FootSolver<S: Simd> {
    pub(super) feet: Vec<Foot<S>>,
    /// Limits and dry friction of joints.
    pub(super) joints: JointRows<S>,
    /// Velocities of the robot: with impulses, before the step, without impulses, and of position correction.
    pub(super) velocities: Vec<Lanes<S>>,
    before: Vec<Lanes<S>>,
    pub(super) free: Vec<Lanes<S>>,
    split: Vec<Lanes<S>>,
    /// Velocities to restore.
    kept: Vec<Lanes<S>>,
    /// Inertia that impulses act on, in the order of the matrix.
    pub(super) inertia: Vec<Lanes<S>>,
    /// Change of each body's velocity by three impulses on another body.
    pub(super) deltas: Vec<[Spatial<S>; 3]>,
    pub(super) matrix: TreeCholesky<S>,
    /// See [`Direct`](crate::dynamics::direct::Direct).
    pub(super) momentum: Vec<Lanes<S>>,
    pub(super) force: Vec<Lanes<S>>,
    pub(super) change: Vec<Lanes<S>>,
    pub(super) hardness: Lanes<S>,
    pub(super) anderson: Anderson<Lanes<S>>,
    /// Lanes whose initial or present impulses are the least ones.
    pub(super) was_least: Mask<S>,
}

impl<S: Simd> FootSolver<S> {
    /// Creates the memory for a robot with `n` velocities.
    pub(super) fn new(zero: Lanes<S>, n: usize) -> Self {
        Self {
            feet: Vec::new(),
            joints: JointRows::new(zero, n),
            velocities: vec![zero; n],
            before: vec![zero; n],
            free: vec![zero; n],
            split: vec![zero; n],
            kept: vec![zero; n],
            inertia: Vec::new(),
            deltas: Vec::new(),
            matrix: TreeCholesky::new(zero, n),
            momentum: vec![zero; n],
            force: vec![zero; n],
            change: vec![zero; n],
            hardness: zero,
            anderson: Anderson::new(zero, 0),
            was_least: zero.lt(zero),
        }
    }

    /// Returns zero in all lanes.
    #[inline(always)]
    pub(super) fn zero(&self) -> Lanes<S> {
        self.hardness.splat(0.0)
    }

    /// Sets the tree of the robot.
    pub(super) fn set_tree(&mut self, tree: &Tree) {
        let zero = self.zero();
        let count = self.matrix.set_tree(zero, tree);
        self.inertia = vec![zero; count];
        let still = Vector::zero(zero);
        self.deltas = vec![[Spatial { angular: still, linear: still }; 3]; tree.bodies.len()];
    }

    /// Sets the feet, with the columns of each.
    pub(super) fn set_feet(&mut self, columns: impl Iterator<Item = Vec<(usize, bool)>>) {
        let (zero, n) = (self.zero(), self.velocities.len());
        self.feet = columns.map(|columns| Foot::new(zero, columns, n)).collect();
        self.anderson = Anderson::new(zero, self.feet.len());
    }

    /// Returns the bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        let of_feet: usize = self.feet.iter().map(|foot| size_of::<Foot<S>>() + foot.bytes()).sum();
        of_feet
            + 8 * size_of_val(&self.velocities[..])
            + size_of_val(&self.inertia[..])
            + size_of_val(&self.deltas[..])
            + self.matrix.bytes()
            + self.joints.bytes()
            + self.anderson.bytes()
    }

    /// Returns the lanes in which anything touches or is about to.
    #[inline(always)]
    pub(super) fn touching(&self) -> Mask<S> {
        let zero = self.zero();
        let mut any = zero;
        for foot in &self.feet {
            any = any.max(foot.is_there);
        }
        zero.lt(any)
    }

    /// Sets the targets of feet.
    #[inline(always)]
    fn set_targets(&mut self, h: f64) {
        for foot in &mut self.feet {
            foot.set_targets(&self.before, h);
        }
    }

    /// Applies the initial impulses of some lanes to the velocities, unless they are worse than none.
    #[inline(always)]
    fn start(&mut self, lanes: Mask<S>) {
        let zero = self.zero();
        let Self { feet, joints, velocities, free, .. } = self;
        free.copy_from_slice(velocities);
        for foot in &mut *feet {
            foot.unloaded = foot.velocities(velocities);
        }
        for foot in &*feet {
            foot.apply_impulse(foot.impulse, foot.acts & lanes, velocities);
        }
        joints.prepare(lanes, velocities);
        let (mut linear, mut square) = (zero, zero);
        for foot in &*feet {
            let counts = foot.acts & zero.lt(foot.impulse[0]);
            let (before, after) = (foot.unloaded, foot.velocities(velocities));
            let mut own_linear = linear + foot.impulse[0] * foot.target;
            let mut own_square = square;
            for k in 0..3 {
                own_linear -= foot.impulse[k] * before[k];
                own_square += foot.impulse[k] * (after[k] - before[k]);
            }
            linear = counts.select(own_linear, linear);
            square = counts.select(own_square, square);
        }
        let mut sums = [linear, square];
        joints.add_energy(free, velocities, &mut sums);
        let [linear, square] = sums;
        let is_worse = linear.lt(zero.splat(0.5) * square) & lanes;
        if !is_worse.any() {
            return;
        }
        let part = (linear / square).max(zero);
        for foot in &mut *feet {
            for impulse in &mut foot.impulse {
                *impulse = is_worse.select(*impulse * part, *impulse);
            }
        }
        joints.scale(part, is_worse);
        for (velocity, free) in velocities.iter_mut().zip(&*free) {
            *velocity = is_worse.select(*free + part * (*velocity - *free), *velocity);
        }
    }

    /// Sweeps once through all feet of some lanes. Returns the largest change of a row's own velocity.
    #[inline(always)]
    fn sweep(&mut self, lanes: Mask<S>) -> Lanes<S> {
        let zero = self.zero();
        let Self { feet, joints, velocities, .. } = self;
        let mut largest = zero;
        joints.sweep(lanes, velocities, &mut largest);
        for foot in feet {
            let on = foot.acts & lanes;
            let [nn, nt, nu, tt, _, uu] = foot.effect;
            let [before, t0, u0] = foot.impulse;
            let velocity = foot.slip(velocities);
            let (inverse, gradient_step, friction) = (foot.inverse, foot.gradient_step, foot.friction);
            let resistance = Resistance { normal: nn, coupling: [nt, nu], inverse, gradient_step };
            let aim = [foot.target - velocity[0], velocity[1], velocity[2]];
            let new = resistance.next(foot.impulse, friction, aim);
            let (dn, dt, du) = (new[0] - before, new[1] - t0, new[2] - u0);
            for (impulse, new) in foot.impulse.iter_mut().zip(new) {
                *impulse = on.select(new, *impulse);
            }
            let moves = on & !(dn.equals(zero) & dt.equals(zero) & du.equals(zero));
            foot.apply_impulse([dn, dt, du], moves, velocities);
            let change = (dn * nn).abs().max((dt * tt).abs()).max((du * uu).abs());
            largest = moves.select(largest.max(change), largest);
        }
        largest
    }

    /// Finds the impulses of some lanes. If the least ones of the last step still hold, it keeps them.
    /// Otherwise it solves directly, at once or after some sweeps, in lanes that are `is_direct`, and sweeps
    /// in others.
    #[inline(always)]
    fn find_impulses(&mut self, lanes: Mask<S>, is_direct: Mask<S>) {
        let zero = self.zero();
        let swept = lanes & self.was_least;
        let mut least = zero.lt(zero);
        if swept.any() {
            least = swept & self.sweep(swept).le(zero.splat(UNCHANGED));
        }
        let mut open = lanes & !least;
        let mut settled = zero.lt(zero);
        for sweep in 0..MAX_SWEEPS {
            if !open.any() {
                break;
            }
            let mut due = None;
            for (at, rounds) in DIRECT_AT {
                due = if at == sweep { Some(rounds) } else { due };
            }
            let tried = open & is_direct & if due.is_some() { open } else { settled };
            if tried.any() {
                self.keep();
                let solved = self.solve_directly(tried, due.unwrap_or(SETTLED_ROUNDS));
                self.go_back(tried & !solved);
                least = least | solved;
                open = open & !solved;
            }
            open = open & !settled;
            if !open.any() {
                break;
            }
            settled = self.sweep(open).le(zero.splat(SETTLED)) & open;
            open = open & (is_direct | !settled);
        }
        self.was_least = (lanes & least) | (self.was_least & !lanes);
    }

    /// Saves velocities and impulses.
    #[inline(always)]
    fn keep(&mut self) {
        self.kept.copy_from_slice(&self.velocities);
        self.joints.keep();
        for foot in &mut self.feet {
            foot.kept_impulse = foot.impulse;
        }
    }

    /// Restores velocities and impulses in some lanes.
    #[inline(always)]
    fn go_back(&mut self, lanes: Mask<S>) {
        if !lanes.any() {
            return;
        }
        for (velocity, kept) in self.velocities.iter_mut().zip(&self.kept) {
            *velocity = lanes.select(*kept, *velocity);
        }
        self.joints.go_back(lanes);
        for foot in &mut self.feet {
            for (impulse, kept) in foot.impulse.iter_mut().zip(foot.kept_impulse) {
                *impulse = lanes.select(kept, *impulse);
            }
        }
    }

    /// Computes velocities that move positions in addition to the new ones if feet are too deep. Returns the
    /// lanes with any.
    #[inline(always)]
    pub(super) fn correct_positions(&mut self, lanes: Mask<S>) -> Mask<S> {
        let zero = self.zero();
        let Self { feet, velocities, split, .. } = self;
        let mut corrected = zero.lt(zero);
        for foot in &*feet {
            corrected = corrected | (foot.acts & !foot.correction_velocity.equals(zero));
        }
        let corrected = corrected & lanes;
        if !corrected.any() {
            return corrected;
        }
        split.fill(zero);
        for _ in 0..CORRECTION_SWEEPS {
            for foot in &mut *feet {
                let velocity = foot.velocities(split)[0];
                let left = (foot.correction_velocity - velocity) / foot.effect[0];
                let impulse = (foot.split_impulse + left).max(zero);
                let change = impulse - foot.split_impulse;
                let moves = foot.acts & corrected & !change.equals(zero);
                foot.split_impulse = moves.select(impulse, foot.split_impulse);
                foot.apply_impulse([change, zero, zero], moves, split);
            }
        }
        let mut largest = zero;
        for velocity in &*split {
            largest = largest.max(velocity.abs());
        }
        let most = zero.splat(MAX_SPLIT_VELOCITY);
        let scale = most.lt(largest).select(most / largest, zero.splat(1.0));
        for (velocity, split) in velocities.iter_mut().zip(&*split) {
            *velocity = corrected.select(*velocity + scale * *split, *velocity);
        }
        corrected
    }
}

impl<S: Simd> LaneRobot<S> {
    /// Finds the impulses of feet in some lanes, and their new velocities.
    #[inline(always)]
    pub(super) fn solve_feet(&mut self, lanes: Mask<S>, is_first: bool) {
        self.measure_feet();
        let is_direct = self.write_implicit_inertia() & self.feet.are_solved_directly();
        let (first, offset) = (self.first, self.tree.root_velocities());
        let FootSolver { velocities, before, .. } = &mut self.feet.solver;
        if first > 0 {
            velocities[..offset].copy_from_slice(&self.root_new);
            before[..offset].copy_from_slice(&self.root.half_velocities);
        }
        for (i, (at, state)) in self.bodies[first..].iter().zip(&self.states[first..]).enumerate() {
            velocities[offset + i] = at.new_velocity;
            before[offset + i] = state.half_velocity;
        }
        if is_first {
            self.take_joint_rows(lanes);
            self.feet.solver.was_least = self.were_least();
            self.find_arcs();
            self.feet.solver.set_targets(self.stepping.h);
        }
        self.measure_joint_rows();
        self.feet.solver.start(lanes);
        self.feet.solver.find_impulses(lanes, is_direct);
        self.put_joint_rows(lanes);
        let velocities = &self.feet.solver.velocities;
        if first > 0 {
            for (new, velocity) in self.root_new.iter_mut().zip(velocities) {
                *new = lanes.select(*velocity, *new);
            }
        }
        for (at, velocity) in self.bodies[first..].iter_mut().zip(&velocities[offset..]) {
            at.new_velocity = lanes.select(*velocity, at.new_velocity);
        }
    }

    /// Sets the velocities that move positions, once the new ones are known. Returns the lanes in which
    /// contacts have acted on a copy that touches.
    #[inline(always)]
    pub(super) fn set_ways(&mut self, touching: Mask<S>) -> Mask<S> {
        let zero = self.occupied.splat(0.0);
        let (first, offset) = (self.first, self.tree.root_velocities());
        self.root_way = self.root_new;
        for at in &mut self.bodies {
            at.way = at.new_velocity;
        }
        let mut touched = zero.lt(zero);
        if !touching.any() {
            return touched;
        }
        for foot in &self.feet.solver.feet {
            touched = touched | foot.has_impulse();
        }
        let velocities = &mut self.feet.solver.velocities;
        if first > 0 {
            velocities[..offset].copy_from_slice(&self.root_new);
        }
        for (velocity, at) in velocities[offset..].iter_mut().zip(&self.bodies[first..]) {
            *velocity = at.new_velocity;
        }
        let corrected = self.feet.solver.correct_positions(touching);
        let velocities = &self.feet.solver.velocities;
        if first > 0 {
            self.root_way.copy_from_slice(&velocities[..offset]);
        }
        for (at, velocity) in self.bodies[first..].iter_mut().zip(&velocities[offset..]) {
            at.way = *velocity;
        }
        (touched | corrected) & touching
    }
}

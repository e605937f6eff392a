//! Free roots in lanes and their arithmetic: rotations by quaternions, as in glam, operation by operation, so
//! that a lane has the same bits.

use pulp::Simd;

use crate::dynamics::BodyState;
use crate::dynamics::lane::number::{Lanes, Mask};
use crate::dynamics::lane::vectors::{Matrix, Vector};
use crate::dynamics::real::{Real as _, VectorOf as _};

/// State of a free root that a step changes, a part of [`BodyState`]. Zero if the root is fixed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Root<S: Simd> {
    /// Origin x y z, and rotation as a quaternion x y z w, both in the world.
    pub(super) positions: [Lanes<S>; 7],
    /// Linear velocity of its origin, then angular in its own axes.
    pub(super) velocities: [Lanes<S>; 6],
    pub(super) half_velocities: [Lanes<S>; 6],
    pub(super) changes: [Lanes<S>; 6],
    pub(super) changes_before: [Lanes<S>; 6],
}

/// Returns the first three of six numbers, and the last.
#[inline(always)]
pub(super) fn parts<S: Simd>(six: &[Lanes<S>; 6]) -> (Vector<S>, Vector<S>) {
    let [x, y, z, u, v, w] = *six;
    (Vector { x, y, z }, Vector { x: u, y: v, z: w })
}

impl<S: Simd> Root<S> {
    /// Returns zero in all numbers.
    pub(super) fn zero(zero: Lanes<S>) -> Self {
        Self {
            positions: [zero; 7],
            velocities: [zero; 6],
            half_velocities: [zero; 6],
            changes: [zero; 6],
            changes_before: [zero; 6],
        }
    }

    /// Copies the state of a copy.
    pub(super) fn set(&mut self, lane: usize, from: &BodyState) {
        set(&mut self.positions, lane, &from.positions);
        set(&mut self.velocities, lane, &from.velocities);
        set(&mut self.half_velocities, lane, &from.half_velocities);
        set(&mut self.changes, lane, &from.changes);
        set(&mut self.changes_before, lane, &from.changes_before);
    }

    /// Writes the state of a lane to its copy.
    pub(super) fn give_back(&self, lane: usize, into: &mut BodyState) {
        get(&self.positions, lane, &mut into.positions);
        get(&self.velocities, lane, &mut into.velocities);
        get(&self.half_velocities, lane, &mut into.half_velocities);
        get(&self.changes, lane, &mut into.changes);
        get(&self.changes_before, lane, &mut into.changes_before);
    }

    /// Copies one lane from another state.
    pub(super) fn put_back(&mut self, lane: usize, from: &Self) {
        let Self { positions, velocities, half_velocities, changes, changes_before } = self;
        for (slot, value) in positions.iter_mut().zip(&from.positions) {
            slot.set(lane, value.get(lane));
        }
        for (slots, values) in [
            (velocities, &from.velocities),
            (half_velocities, &from.half_velocities),
            (changes, &from.changes),
            (changes_before, &from.changes_before),
        ] {
            slots.iter_mut().zip(values).for_each(|(slot, value)| slot.set(lane, value.get(lane)));
        }
    }

    /// Returns the lanes in which all numbers are usable.
    #[inline(always)]
    pub(super) fn is_usable(&self) -> Mask<S> {
        let mut is_usable = self.positions[0].is_usable();
        for number in &self.positions {
            is_usable = is_usable & number.is_usable();
        }
        for (velocity, half) in self.velocities.iter().zip(&self.half_velocities) {
            is_usable = is_usable & velocity.is_usable() & half.is_usable();
        }
        is_usable
    }

    /// Returns its rotation.
    #[inline(always)]
    pub(super) fn rotation(&self) -> Quaternion<S> {
        let [_, _, _, x, y, z, w] = self.positions;
        Quaternion { vector: Vector { x, y, z }, w }
    }

    /// Returns the largest speed of points within a distance of its origin, at these velocities.
    #[inline(always)]
    pub(super) fn speed_of(velocities: &[Lanes<S>; 6], lever: Lanes<S>) -> Lanes<S> {
        let (linear, angular) = parts(velocities);
        linear.length() + lever * angular.length()
    }

    /// Returns the largest speed of points within a distance of its origin, at its present velocities.
    #[inline(always)]
    pub(super) fn speed(&self, lever: Lanes<S>) -> Lanes<S> {
        Self::speed_of(&self.velocities, lever)
    }
}

/// Writes the first numbers of a list into a lane.
pub(super) fn set<S: Simd>(slots: &mut [Lanes<S>], lane: usize, from: &[f64]) {
    slots.iter_mut().zip(from).for_each(|(slot, value)| slot.set(lane, *value));
}

/// Writes a lane into the first numbers of a list.
pub(super) fn get<S: Simd>(from: &[Lanes<S>], lane: usize, slots: &mut [f64]) {
    slots.iter_mut().zip(from).for_each(|(slot, value)| *slot = value.get(lane));
}

/// A rotation, see [`DQuat`](glamx::DQuat).
#[derive(Clone, Copy, Debug)]
pub(super) struct Quaternion<S: Simd> {
    pub(super) vector: Vector<S>,
    pub(super) w: Lanes<S>,
}

impl<S: Simd> Quaternion<S> {
    /// Returns the rotation as a matrix.
    #[inline(always)]
    pub(super) fn matrix(self) -> Matrix<S> {
        let Self { vector: Vector { x, y, z }, w } = self;
        let one = w.splat(1.0);
        let (x2, y2, z2) = (x + x, y + y, z + z);
        let (xx, xy, xz) = (x * x2, x * y2, x * z2);
        let (yy, yz, zz) = (y * y2, y * z2, z * z2);
        let (wx, wy, wz) = (w * x2, w * y2, w * z2);
        Matrix {
            x: Vector { x: one - (yy + zz), y: xy + wz, z: xz - wy },
            y: Vector { x: xy - wz, y: one - (xx + zz), z: yz + wx },
            z: Vector { x: xz + wy, y: yz - wx, z: one - (xx + yy) },
        }
    }

    /// Returns a vector, rotated.
    #[inline(always)]
    pub(super) fn times(self, v: Vector<S>) -> Vector<S> {
        let Self { vector: b, w } = self;
        let two = w.splat(2.0);
        v * (w * w - b.dot(b)) + b * (v.dot(b) * two) + b.cross(v) * (w * two)
    }
}

//! Spatial vectors side by side, so that operations act on several at a time.
//!
//! All functions are inlined into code that is compiled for the vectors of the processor: see `pulp::Arch`.
//! No operations are fused, and each result has the same bits on all processors.

use glamx::{DMat3, DVec3};

use super::spatial::Spatial;
use super::tree::JointType;

/// `N` spatial vectors, stored by component.
#[derive(Clone, Copy, Debug)]
pub struct Spatials<const N: usize> {
    /// Angular parts, see [`Spatial`].
    pub angular: [[f64; N]; 3],
    /// Linear parts, see [`Spatial`].
    pub linear: [[f64; N]; 3],
}

impl<const N: usize> Default for Spatials<N> {
    fn default() -> Self {
        Self::ZERO
    }
}

impl<const N: usize> Spatials<N> {
    /// Zero vectors.
    pub const ZERO: Self = Self { angular: [[0.0; N]; 3], linear: [[0.0; N]; 3] };

    /// Returns one vector.
    #[inline(always)]
    pub fn get(&self, k: usize) -> Spatial {
        let ([a, b, c], [d, e, f]) = (&self.angular, &self.linear);
        Spatial::new(DVec3::new(a[k], b[k], c[k]), DVec3::new(d[k], e[k], f[k]))
    }

    /// Replaces one vector.
    #[inline(always)]
    pub fn set(&mut self, k: usize, value: Spatial) {
        for i in 0..3 {
            (self.angular[i][k], self.linear[i][k]) = (value.angular[i], value.linear[i]);
        }
    }

    /// Returns [`Spatial::dot`] of each.
    #[inline(always)]
    pub fn dot(&self, other: Spatial) -> [f64; N] {
        let mut sums = products(&self.angular, other.angular);
        let linear = products(&self.linear, other.linear);
        for k in 0..N {
            sums[k] += linear[k];
        }
        sums
    }

    /// Returns S' f of each, for an axis along `z`.
    #[inline(always)]
    pub fn along(&self, joint_type: JointType, z: DVec3) -> [f64; N] {
        match joint_type {
            JointType::Prismatic => products(&self.linear, z),
            _ => products(&self.angular, z),
        }
    }

    /// Adds S times a factor to each, for an axis along `z`.
    #[inline(always)]
    pub fn add_along(&mut self, joint_type: JointType, z: DVec3, factors: &[f64; N]) {
        match joint_type {
            JointType::Prismatic => add_multiples(&mut self.linear, z, factors),
            _ => add_multiples(&mut self.angular, z, factors),
        }
    }

    /// Adds a multiple of a vector to each.
    #[inline(always)]
    pub fn add_multiples(&mut self, vector: Spatial, factors: &[f64; N]) {
        add_multiples(&mut self.angular, vector.angular, factors);
        add_multiples(&mut self.linear, vector.linear, factors);
    }

    /// Returns [`Spatial::motion_at`] of each.
    #[inline(always)]
    pub fn motion_at(&self, reach: DVec3) -> Self {
        Self { angular: self.angular, linear: plus_cross(&self.linear, -reach, &self.angular) }
    }

    /// Returns [`Spatial::force_from`] of each.
    #[inline(always)]
    pub fn force_from(&self, reach: DVec3) -> Self {
        Self { angular: plus_cross(&self.angular, reach, &self.linear), linear: self.linear }
    }

    /// Adds another set of vectors.
    #[inline(always)]
    pub fn add(&mut self, other: &Self) {
        for i in 0..3 {
            for k in 0..N {
                self.angular[i][k] += other.angular[i][k];
                self.linear[i][k] += other.linear[i][k];
            }
        }
    }
}

/// Returns the scalar product of each with a vector.
#[inline(always)]
fn products<const N: usize>(part: &[[f64; N]; 3], v: DVec3) -> [f64; N] {
    let mut out = [0.0; N];
    for k in 0..N {
        out[k] = part[0][k] * v.x + part[1][k] * v.y + part[2][k] * v.z;
    }
    out
}

/// Adds a multiple of a vector to each.
#[inline(always)]
fn add_multiples<const N: usize>(part: &mut [[f64; N]; 3], v: DVec3, factors: &[f64; N]) {
    for i in 0..3 {
        for k in 0..N {
            part[i][k] += v[i] * factors[k];
        }
    }
}

/// Returns sums + v x part, for each.
#[inline(always)]
fn plus_cross<const N: usize>(sums: &[[f64; N]; 3], v: DVec3, part: &[[f64; N]; 3]) -> [[f64; N]; 3] {
    let mut out = *sums;
    for k in 0..N {
        out[0][k] += v.y * part[2][k] - v.z * part[1][k];
        out[1][k] += v.z * part[0][k] - v.x * part[2][k];
        out[2][k] += v.x * part[1][k] - v.y * part[0][k];
    }
    out
}

/// Returns the product of a matrix with each.
#[inline(always)]
pub fn turned<const N: usize>(part: &[[f64; N]; 3], matrix: &DMat3) -> [[f64; N]; 3] {
    let rows = matrix.transpose();
    // No closure: code that is not inlined is compiled for any processor.
    [products(part, rows.x_axis), products(part, rows.y_axis), products(part, rows.z_axis)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_treated_as_it_would_be_alone() {
        let vector = |k: usize| {
            let at = k as f64;
            Spatial::new(DVec3::new(1.0 + at, -0.3 * at, 0.7), DVec3::new(0.2, at * at, -1.5 * at))
        };
        let (reach, other) = (DVec3::new(0.3, -1.1, 0.6), vector(9));
        let mut six = Spatials::<6>::ZERO;
        (0..6).for_each(|k| six.set(k, vector(k)));
        let mut moved = six.motion_at(reach);
        moved.add_multiples(other, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        moved.add_along(JointType::Prismatic, reach, &[1.0; 6]);
        moved.add_along(JointType::Revolute, reach, &[2.0; 6]);
        let mut shifted = six.force_from(reach);
        shifted.add(&six);
        let matrix = DMat3::from_cols(DVec3::new(1.0, 2.0, 3.0), reach, other.linear);
        let turned = turned(&six.linear, &matrix);
        let along = [JointType::Revolute, JointType::Prismatic].map(|kind| six.along(kind, reach));
        for k in 0..6 {
            let near = |a: Spatial, b: Spatial| {
                (a.angular - b.angular).length() + (a.linear - b.linear).length() < 1e-12
            };
            let slid = Spatial::new(reach * 2.0, reach);
            assert!(near(moved.get(k), vector(k).motion_at(reach) + other * (k + 1) as f64 + slid));
            assert!(near(shifted.get(k), vector(k).force_from(reach) + vector(k)));
            assert!((six.dot(other)[k] - vector(k).dot(other)).abs() < 1e-12);
            assert!((along[0][k] - vector(k).angular.dot(reach)).abs() < 1e-12);
            assert!((along[1][k] - vector(k).linear.dot(reach)).abs() < 1e-12);
            let turned = DVec3::from_array([0, 1, 2].map(|i| turned[i][k]));
            assert!((turned - matrix * vector(k).linear).length() < 1e-12);
        }
    }
}

//! Vectors and matrices over lanes, and [`spatial`], [`symmetric`] and [`inertia`] over them.

use std::ops::{Add, Mul, Neg, Sub};

use glamx::{DMat3, DVec3};
use pulp::Simd;

use super::number::Lanes;
use crate::dynamics::real::{MatrixOf, Real as _, VectorOf};
use crate::dynamics::{inertia, spatial, symmetric};

/// See [`symmetric::Symmetric`].
pub(in crate::dynamics) type Symmetric<S> = symmetric::Symmetric<Lanes<S>>;
/// See [`spatial::Spatial`].
pub(in crate::dynamics) type Spatial<S> = spatial::Spatial<Lanes<S>>;
/// See [`inertia::Rigid`].
pub(in crate::dynamics) type Rigid<S> = inertia::Rigid<Lanes<S>>;
/// See [`inertia::Articulated`].
pub(in crate::dynamics) type Articulated<S> = inertia::Articulated<Lanes<S>>;

/// See [`DVec3`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vector<S: Simd> {
    pub(in crate::dynamics) x: Lanes<S>,
    pub(in crate::dynamics) y: Lanes<S>,
    pub(in crate::dynamics) z: Lanes<S>,
}

/// See [`DMat3`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Matrix<S: Simd> {
    pub(in crate::dynamics) x: Vector<S>,
    pub(in crate::dynamics) y: Vector<S>,
    pub(in crate::dynamics) z: Vector<S>,
}

impl<S: Simd> Vector<S> {
    #[inline(always)]
    pub(in crate::dynamics) fn broadcast(simd: S, value: DVec3) -> Self {
        // No closure: code that is not inlined is compiled for any processor.
        Self {
            x: Lanes::broadcast(simd, value.x),
            y: Lanes::broadcast(simd, value.y),
            z: Lanes::broadcast(simd, value.z),
        }
    }

    /// Zero in all lanes.
    #[inline(always)]
    pub(in crate::dynamics) fn zero(zero: Lanes<S>) -> Self {
        Self { x: zero, y: zero, z: zero }
    }

    #[inline(always)]
    pub(in crate::dynamics) fn length(self) -> Lanes<S> {
        self.dot(self).sqrt()
    }

    /// Returns the vector of one lane.
    #[inline(always)]
    pub(in crate::dynamics) fn get(&self, lane: usize) -> DVec3 {
        DVec3::new(self.x.get(lane), self.y.get(lane), self.z.get(lane))
    }

    /// Writes one lane.
    pub(in crate::dynamics) fn set(&mut self, lane: usize, value: DVec3) {
        self.x.set(lane, value.x);
        self.y.set(lane, value.y);
        self.z.set(lane, value.z);
    }
}

impl<S: Simd> VectorOf<Lanes<S>> for Vector<S> {
    #[inline(always)]
    fn of([x, y, z]: [Lanes<S>; 3]) -> Self {
        Self { x, y, z }
    }

    #[inline(always)]
    fn parts(self) -> [Lanes<S>; 3] {
        [self.x, self.y, self.z]
    }
}

impl<S: Simd> Matrix<S> {
    #[inline(always)]
    pub(in crate::dynamics) fn broadcast(simd: S, value: &DMat3) -> Self {
        Self {
            x: Vector::broadcast(simd, value.x_axis),
            y: Vector::broadcast(simd, value.y_axis),
            z: Vector::broadcast(simd, value.z_axis),
        }
    }
}

impl<S: Simd> MatrixOf<Lanes<S>> for Matrix<S> {
    #[inline(always)]
    fn of([x, y, z]: [Vector<S>; 3]) -> Self {
        Self { x, y, z }
    }

    #[inline(always)]
    fn columns(self) -> [Vector<S>; 3] {
        [self.x, self.y, self.z]
    }
}

impl<S: Simd> Mul<Lanes<S>> for Vector<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: Lanes<S>) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }
}

impl<S: Simd> Neg for Vector<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }
}

macro_rules! each_part {
    ($type:ident, $operator:ident, $function:ident) => {
        impl<S: Simd> $operator for $type<S> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self {
                    x: $operator::$function(self.x, other.x),
                    y: $operator::$function(self.y, other.y),
                    z: $operator::$function(self.z, other.z),
                }
            }
        }
    };
}

each_part!(Vector, Add, add);
each_part!(Vector, Sub, sub);
each_part!(Matrix, Add, add);
each_part!(Matrix, Sub, sub);

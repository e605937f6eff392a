//! A number of each of several copies, side by side in a vector of the processor.
//!
//! Every operation is the `f64` operation on each lane alone, and none is fused. A lane therefore has the
//! bits that the same code has for one copy, regardless of the other lanes and their number.

use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub, SubAssign};

use pulp::{Simd, bytemuck};

use super::vectors::{Matrix, Vector};
use crate::dynamics::real::{LARGEST_STATE, MaskOf, Real};
use crate::dynamics::trigonometry;

/// One `f64` for each lane.
#[derive(Clone, Copy, Debug)]
pub(in crate::dynamics) struct Lanes<S: Simd> {
    simd: S,
    values: S::f64s,
}

/// Boolean for each lane.
#[derive(Clone, Copy, Debug)]
pub(in crate::dynamics) struct Mask<S: Simd> {
    simd: S,
    values: S::m64s,
}

impl<S: Simd> Lanes<S> {
    /// Returns the same number in all lanes.
    #[inline(always)]
    pub(in crate::dynamics) fn broadcast(simd: S, value: f64) -> Self {
        Self { simd, values: simd.splat_f64s(value) }
    }

    /// Returns the numbers of the lanes.
    #[inline(always)]
    pub(in crate::dynamics) fn all(&self) -> &[f64] {
        bytemuck::cast_slice::<S::f64s, f64>(std::slice::from_ref(&self.values))
    }

    /// Returns the numbers of the lanes, to change them.
    #[inline(always)]
    pub(in crate::dynamics) fn all_mut(&mut self) -> &mut [f64] {
        bytemuck::cast_slice_mut::<S::f64s, f64>(std::slice::from_mut(&mut self.values))
    }

    /// Returns the number of one lane.
    #[inline(always)]
    pub(in crate::dynamics) fn get(&self, lane: usize) -> f64 {
        self.all()[lane]
    }

    /// Sets the number of one lane.
    #[inline(always)]
    pub(in crate::dynamics) fn set(&mut self, lane: usize, value: f64) {
        self.all_mut()[lane] = value;
    }

    /// Returns sines and cosines, with the bits of one copy's step.
    #[inline(always)]
    pub(in crate::dynamics) fn sin_cos(self) -> (Self, Self) {
        let (mut sin, mut cos) = trigonometry::sin_cos_of_moderate(self);
        if (!self.abs().le(self.splat(trigonometry::LARGEST))).any() {
            for lane in 0..S::F64_LANES {
                let (s, c) = trigonometry::sin_cos(self.get(lane));
                sin.set(lane, s);
                cos.set(lane, c);
            }
        }
        (sin, cos)
    }

    /// Returns the lanes whose number is finite and within [`LARGEST_STATE`].
    #[inline(always)]
    pub(in crate::dynamics) fn is_usable(self) -> Mask<S> {
        self.abs().le(self.splat(LARGEST_STATE))
    }
}

impl<S: Simd> Real for Lanes<S> {
    type Mask = Mask<S>;
    type Vector = Vector<S>;
    type Matrix = Matrix<S>;

    #[inline(always)]
    fn splat(self, value: f64) -> Self {
        Self::broadcast(self.simd, value)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self { simd: self.simd, values: self.simd.sqrt_f64s(self.values) }
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self { simd: self.simd, values: self.simd.abs_f64s(self.values) }
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let sign = self.simd.and_f64s(sign.values, self.simd.splat_f64s(-0.0));
        Self { simd: self.simd, values: self.simd.or_f64s(self.abs().values, sign) }
    }

    /// Returns `other` where `self` is less, else `self`. It returns `self` where either is NaN, unlike
    /// [`f64::max`], and where one is 0 and the other -0.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.lt(other).select(other, self)
    }

    /// Returns `other` where it is less, else `self`; with NaN and -0 as in [`max`](Self::max).
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        other.lt(self).select(other, self)
    }

    #[inline(always)]
    fn clamp(self, least: Self, most: Self) -> Self {
        let above = self.lt(least).select(least, self);
        most.lt(above).select(most, above)
    }

    #[inline(always)]
    fn lt(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, values: self.simd.less_than_f64s(self.values, other.values) }
    }

    #[inline(always)]
    fn le(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, values: self.simd.less_than_or_equal_f64s(self.values, other.values) }
    }

    #[inline(always)]
    fn equals(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, values: self.simd.equal_f64s(self.values, other.values) }
    }

    #[inline(always)]
    fn is_finite(self) -> Mask<S> {
        self.abs().lt(self.splat(f64::INFINITY))
    }
}

impl<S: Simd> MaskOf<Lanes<S>> for Mask<S> {
    #[inline(always)]
    fn select(self, yes: Lanes<S>, no: Lanes<S>) -> Lanes<S> {
        Lanes { simd: self.simd, values: self.simd.select_f64s(self.values, yes.values, no.values) }
    }

    #[inline(always)]
    fn any(self) -> bool {
        self.simd.first_true_m64s(self.values) < S::F64_LANES
    }
}

impl<S: Simd> Mask<S> {
    /// Returns 1 where the mask is true, else 0.
    #[inline(always)]
    pub(in crate::dynamics) fn numbers(self) -> Lanes<S> {
        let zero = Lanes::broadcast(self.simd, 0.0);
        self.select(zero.splat(1.0), zero)
    }
}

macro_rules! each_lane {
    ($operator:ident, $function:ident, $vector:ident) => {
        impl<S: Simd> $operator for Lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self { simd: self.simd, values: self.simd.$vector(self.values, other.values) }
            }
        }
    };
}

each_lane!(Add, add, add_f64s);
each_lane!(Sub, sub, sub_f64s);
each_lane!(Mul, mul, mul_f64s);
each_lane!(Div, div, div_f64s);

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { simd: self.simd, values: self.simd.neg_f64s(self.values) }
    }
}

impl<S: Simd> AddAssign for Lanes<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<S: Simd> SubAssign for Lanes<S> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<S: Simd> BitAnd for Mask<S> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self { simd: self.simd, values: self.simd.and_m64s(self.values, other.values) }
    }
}

impl<S: Simd> BitOr for Mask<S> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self { simd: self.simd, values: self.simd.or_m64s(self.values, other.values) }
    }
}

impl<S: Simd> Not for Mask<S> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self { simd: self.simd, values: self.simd.not_m64s(self.values) }
    }
}

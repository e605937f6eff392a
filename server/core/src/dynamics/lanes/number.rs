//! A number of each of several copies, side by side in a vector of the processor.
//!
//! Every operation is that of `f64` on each lane alone, and none is fused: a lane has the bits that the same lines have for one
//! copy, whatever the other lanes hold and however many there are.

use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub, SubAssign};

use pulp::{Simd, bytemuck};

use crate::dynamics::LARGEST_STATE;
use crate::dynamics::trigonometry::{self, Number};

/// One `f64` a lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lanes<S: Simd> {
    simd: S,
    values: S::f64s,
}

/// Yes or no for each lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mask<S: Simd> {
    simd: S,
    values: S::m64s,
}

impl<S: Simd> Lanes<S> {
    /// The same in all lanes.
    #[inline(always)]
    pub(super) fn splat(simd: S, value: f64) -> Self {
        Self { simd, values: simd.splat_f64s(value) }
    }

    /// Another number, the same in all lanes.
    #[inline(always)]
    pub(super) fn same(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    /// The numbers of the lanes.
    #[inline(always)]
    pub(super) fn all(&self) -> &[f64] {
        bytemuck::cast_slice::<S::f64s, f64>(std::slice::from_ref(&self.values))
    }

    /// To change them.
    #[inline(always)]
    pub(super) fn all_mut(&mut self) -> &mut [f64] {
        bytemuck::cast_slice_mut::<S::f64s, f64>(std::slice::from_mut(&mut self.values))
    }

    /// Of one lane.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> f64 {
        self.all()[lane]
    }

    /// Changes that of one lane.
    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, value: f64) {
        self.all_mut()[lane] = value;
    }

    /// See [`f64::sqrt`].
    #[inline(always)]
    pub(super) fn sqrt(self) -> Self {
        Self { simd: self.simd, values: self.simd.sqrt_f64s(self.values) }
    }

    /// See [`f64::abs`].
    #[inline(always)]
    pub(super) fn abs(self) -> Self {
        Self { simd: self.simd, values: self.simd.abs_f64s(self.values) }
    }

    /// See [`f64::copysign`].
    #[inline(always)]
    pub(super) fn with_sign_of(self, of: Self) -> Self {
        let sign = self.simd.and_f64s(of.values, self.simd.splat_f64s(-0.0));
        Self { simd: self.simd, values: self.simd.or_f64s(self.abs().values, sign) }
    }

    /// The larger one: `other` where `self` is less, else `self`. So it is `self` where either is NaN, unlike
    /// [`f64::max`], and where one is 0 and the other -0.
    #[inline(always)]
    pub(super) fn max(self, other: Self) -> Self {
        self.lt(other).select(other, self)
    }

    /// The smaller one: `other` where it is less, else `self`; with NaN and -0 as in [`max`](Self::max).
    #[inline(always)]
    pub(super) fn min(self, other: Self) -> Self {
        other.lt(self).select(other, self)
    }

    /// See [`f64::clamp`].
    #[inline(always)]
    pub(super) fn clamp(self, least: Self, most: Self) -> Self {
        let above = self.lt(least).select(least, self);
        most.lt(above).select(most, above)
    }

    /// Sines and cosines, those of a step of one copy.
    #[inline(always)]
    pub(super) fn sin_cos(self) -> (Self, Self) {
        let (mut sin, mut cos) = trigonometry::sin_cos_of_moderate(self);
        if (!self.abs().le(self.same(trigonometry::LARGEST))).any() {
            for lane in 0..S::F64_LANES {
                let (s, c) = trigonometry::sin_cos(self.get(lane));
                sin.set(lane, s);
                cos.set(lane, c);
            }
        }
        (sin, cos)
    }

    /// Whether it is less.
    #[inline(always)]
    pub(super) fn lt(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, values: self.simd.less_than_f64s(self.values, other.values) }
    }

    /// Whether it is less or equal.
    #[inline(always)]
    pub(super) fn le(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, values: self.simd.less_than_or_equal_f64s(self.values, other.values) }
    }

    /// Whether it is equal.
    #[inline(always)]
    pub(super) fn is(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, values: self.simd.equal_f64s(self.values, other.values) }
    }

    /// Whether it is a number.
    #[inline(always)]
    pub(super) fn is_number(self) -> Mask<S> {
        self.is(self)
    }

    /// Whether it is finite.
    #[inline(always)]
    pub(super) fn is_finite(self) -> Mask<S> {
        self.abs().lt(self.same(f64::INFINITY))
    }

    /// Whether it is of a size that can be computed with.
    #[inline(always)]
    pub(super) fn is_usable(self) -> Mask<S> {
        self.abs().le(self.same(LARGEST_STATE))
    }
}

impl<S: Simd> Number for Lanes<S> {
    #[inline(always)]
    fn same(self, value: f64) -> Self {
        Lanes::same(self, value)
    }

    #[inline(always)]
    fn select_if(self, value: f64, yes: Self, no: Self) -> Self {
        self.is(Lanes::same(self, value)).select(yes, no)
    }
}

impl<S: Simd> Mask<S> {
    /// In each lane the first where it is yes, else the second.
    #[inline(always)]
    pub(super) fn select(self, yes: Lanes<S>, no: Lanes<S>) -> Lanes<S> {
        Lanes { simd: self.simd, values: self.simd.select_f64s(self.values, yes.values, no.values) }
    }

    /// Whether it is yes in a lane.
    #[inline(always)]
    pub(super) fn any(self) -> bool {
        self.simd.first_true_m64s(self.values) < S::F64_LANES
    }

    /// 1 where it is yes, else 0.
    #[inline(always)]
    pub(super) fn numbers(self) -> Lanes<S> {
        let zero = Lanes::splat(self.simd, 0.0);
        self.select(zero.same(1.0), zero)
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

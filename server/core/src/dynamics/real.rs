//! What the mathematics of a step is written over: a number, or one of each of several copies side by side.
//!
//! A law that is generic over [`Real`] is written once and has the same operations in the same order for both, none of them fused. So
//! a lane has the bits of the step of one robot. What would be a branch for one number is a mask, and where it saves a division, a
//! branch on [`MaskOf::any`], which for one number is that branch.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub, SubAssign};

use glamx::{DMat3, DVec3};

/// A number, or several side by side.
pub trait Real:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// Yes or no for each.
    type Mask: MaskOf<Self>;
    /// Three of them.
    type Vector: VectorOf<Self>;
    /// Nine of them.
    type Matrix: MatrixOf<Self>;

    /// A constant.
    fn splat(self, value: f64) -> Self;

    /// See [`f64::sqrt`].
    fn sqrt(self) -> Self;

    /// See [`f64::abs`].
    fn abs(self) -> Self;

    /// See [`f64::copysign`].
    fn copysign(self, sign: Self) -> Self;

    /// The larger one. Which one where either is NaN, or where one is 0 and the other -0, is up to the type.
    fn max(self, other: Self) -> Self;

    /// The smaller one; the same of NaN and -0.
    fn min(self, other: Self) -> Self;

    /// See [`f64::clamp`].
    fn clamp(self, least: Self, most: Self) -> Self;

    /// Whether it is less.
    fn lt(self, other: Self) -> Self::Mask;

    /// Whether it is less or equal.
    fn le(self, other: Self) -> Self::Mask;

    /// Whether it is equal.
    fn equals(self, other: Self) -> Self::Mask;

    /// Whether it is finite.
    fn is_finite(self) -> Self::Mask;

    /// Whether it is not NaN.
    #[inline(always)]
    fn is_number(self) -> Self::Mask {
        self.equals(self)
    }
}

/// Yes or no for each number of an `R`.
pub trait MaskOf<R>:
    Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// The first where it is yes, else the second.
    fn select(self, yes: R, no: R) -> R;

    /// Whether it is yes for any.
    fn any(self) -> bool;

    /// Whether both say the same.
    #[inline(always)]
    fn matches(self, other: Self) -> Self {
        (self & other) | (!self & !other)
    }
}

/// Three numbers.
pub trait VectorOf<R>:
    Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Neg<Output = Self> + Mul<R, Output = Self>
{
    /// From its components.
    fn new(x: R, y: R, z: R) -> Self;

    /// The first component.
    fn x(self) -> R;

    /// The second component.
    fn y(self) -> R;

    /// The third component.
    fn z(self) -> R;

    /// The scalar product.
    fn dot(self, other: Self) -> R;

    /// The vector product.
    fn cross(self, other: Self) -> Self;
}

/// Three columns of three numbers.
pub trait MatrixOf<R: Real>: Copy + Debug + Add<Output = Self> + Sub<Output = Self> {
    /// From its columns.
    fn of_columns(x: R::Vector, y: R::Vector, z: R::Vector) -> Self;

    /// The first column.
    fn x(self) -> R::Vector;

    /// The second column.
    fn y(self) -> R::Vector;

    /// The third column.
    fn z(self) -> R::Vector;

    /// `self v`.
    #[inline(always)]
    fn times(self, v: R::Vector) -> R::Vector {
        self.x() * v.x() + self.y() * v.y() + self.z() * v.z()
    }

    /// `self' v`, without building the transpose.
    #[inline(always)]
    fn transposed_times(self, v: R::Vector) -> R::Vector {
        R::Vector::new(self.x().dot(v), self.y().dot(v), self.z().dot(v))
    }

    /// `self other`.
    #[inline(always)]
    fn after(self, other: Self) -> Self {
        Self::of_columns(self.times(other.x()), self.times(other.y()), self.times(other.z()))
    }

    /// Its rows as columns.
    #[inline(always)]
    fn transposed(self) -> Self {
        let (x, y, z) = (self.x(), self.y(), self.z());
        Self::of_columns(
            R::Vector::new(x.x(), y.x(), z.x()),
            R::Vector::new(x.y(), y.y(), z.y()),
            R::Vector::new(x.z(), y.z(), z.z()),
        )
    }
}

/// The length of a vector in a plane, without the care of `hypot` for squares that are too small or too large for a number, which takes
/// longer than what it is for.
#[inline(always)]
pub(super) fn length_in_plane<R: Real>(x: R, y: R) -> R {
    (x * x + y * y).sqrt()
}

impl Real for f64 {
    type Mask = bool;
    type Vector = DVec3;
    type Matrix = DMat3;

    #[inline(always)]
    fn splat(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        f64::copysign(self, sign)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        f64::max(self, other)
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        f64::min(self, other)
    }

    #[inline(always)]
    fn clamp(self, least: Self, most: Self) -> Self {
        f64::clamp(self, least, most)
    }

    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    #[allow(clippy::float_cmp, reason = "equality is asked for")]
    fn equals(self, other: Self) -> bool {
        self == other
    }

    #[inline(always)]
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }
}

impl MaskOf<f64> for bool {
    #[inline(always)]
    fn select(self, yes: f64, no: f64) -> f64 {
        if self { yes } else { no }
    }

    #[inline(always)]
    fn any(self) -> bool {
        self
    }
}

impl VectorOf<f64> for DVec3 {
    #[inline(always)]
    fn new(x: f64, y: f64, z: f64) -> Self {
        Self { x, y, z }
    }

    #[inline(always)]
    fn x(self) -> f64 {
        self.x
    }

    #[inline(always)]
    fn y(self) -> f64 {
        self.y
    }

    #[inline(always)]
    fn z(self) -> f64 {
        self.z
    }

    #[inline(always)]
    fn dot(self, other: Self) -> f64 {
        DVec3::dot(self, other)
    }

    #[inline(always)]
    fn cross(self, other: Self) -> Self {
        DVec3::cross(self, other)
    }
}

impl MatrixOf<f64> for DMat3 {
    #[inline(always)]
    fn of_columns(x: DVec3, y: DVec3, z: DVec3) -> Self {
        Self::from_cols(x, y, z)
    }

    #[inline(always)]
    fn x(self) -> DVec3 {
        self.x_axis
    }

    #[inline(always)]
    fn y(self) -> DVec3 {
        self.y_axis
    }

    #[inline(always)]
    fn z(self) -> DVec3 {
        self.z_axis
    }
}

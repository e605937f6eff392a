//! Numeric types of a step's mathematics: a number, or one number of each of several copies side by side.
//!
//! A law that is generic over [`Real`] is written once. It has the same operations in the same order for
//! both, none of them fused, so a lane has the bits of one robot's step. A branch for one number becomes a
//! mask. If it saves a division, it stays a branch on [`MaskOf::any`], which for one number is the original
//! branch.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub, SubAssign};

use glamx::{DMat3, DVec3};
use simd_model::LARGEST_GIVEN;

/// Largest velocity, m/s or rad/s, or position, m or rad, that is used in computations, alone or with others.
/// It far exceeds all results of valid requests.
pub const LARGEST_STATE: f64 = 1e6 * LARGEST_GIVEN;

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
    /// Boolean for each number.
    type Mask: MaskOf<Self>;
    /// Vector of three numbers.
    type Vector: VectorOf<Self>;
    /// Matrix of nine numbers.
    type Matrix: MatrixOf<Self>;

    /// Returns a constant.
    fn splat(self, value: f64) -> Self;

    /// See [`f64::sqrt`].
    fn sqrt(self) -> Self;

    /// See [`f64::abs`].
    fn abs(self) -> Self;

    /// See [`f64::copysign`].
    fn copysign(self, sign: Self) -> Self;

    /// Returns the larger one. The result is up to the type if either is NaN, or if one is 0 and the other
    /// -0.
    fn max(self, other: Self) -> Self;

    /// Returns the smaller one, with the same exceptions as [`max`](Self::max).
    fn min(self, other: Self) -> Self;

    /// See [`f64::clamp`].
    fn clamp(self, least: Self, most: Self) -> Self;

    /// Returns whether it is less.
    fn lt(self, other: Self) -> Self::Mask;

    /// Returns whether it is less or equal.
    fn le(self, other: Self) -> Self::Mask;

    /// Returns whether it is equal.
    fn equals(self, other: Self) -> Self::Mask;

    /// Returns whether it is finite.
    fn is_finite(self) -> Self::Mask;

    /// Returns whether it is not NaN.
    #[inline(always)]
    fn is_number(self) -> Self::Mask {
        self.equals(self)
    }
}

/// Boolean for each number of an `R`.
pub trait MaskOf<R>:
    Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// Returns the first where the mask is true, else the second.
    fn select(self, yes: R, no: R) -> R;

    /// Returns whether any is true.
    fn any(self) -> bool;

    /// Returns whether all are true.
    #[inline(always)]
    fn all(self) -> bool {
        !(!self).any()
    }

    /// Returns whether both are equal.
    #[inline(always)]
    fn matches(self, other: Self) -> Self {
        (self & other) | (!self & !other)
    }
}

/// Three numbers.
pub trait VectorOf<R: Real>:
    Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Neg<Output = Self> + Mul<R, Output = Self>
{
    /// Creates it from its components.
    fn of(parts: [R; 3]) -> Self;

    /// Returns its components.
    fn parts(self) -> [R; 3];

    /// Returns the scalar product.
    #[inline(always)]
    fn dot(self, other: Self) -> R {
        let ([x, y, z], [a, b, c]) = (self.parts(), other.parts());
        (x * a) + (y * b) + (z * c)
    }

    /// Returns the vector product.
    #[inline(always)]
    fn cross(self, other: Self) -> Self {
        let ([x, y, z], [a, b, c]) = (self.parts(), other.parts());
        Self::of([y * c - b * z, z * a - c * x, x * b - a * y])
    }
}

/// Three columns of three numbers.
pub trait MatrixOf<R: Real>: Copy + Debug + Add<Output = Self> + Sub<Output = Self> {
    /// Creates it from its columns.
    fn of(columns: [R::Vector; 3]) -> Self;

    /// Returns its columns.
    fn columns(self) -> [R::Vector; 3];

    /// Returns `self v`.
    #[inline(always)]
    fn times(self, v: R::Vector) -> R::Vector {
        let ([a, b, c], [x, y, z]) = (self.columns(), v.parts());
        a * x + b * y + c * z
    }

    /// Returns `self' v`, without building the transpose.
    #[inline(always)]
    fn transposed_times(self, v: R::Vector) -> R::Vector {
        let [a, b, c] = self.columns();
        R::Vector::of([a.dot(v), b.dot(v), c.dot(v)])
    }

    /// Returns `self other`.
    #[inline(always)]
    fn after(self, other: Self) -> Self {
        let [a, b, c] = other.columns();
        Self::of([self.times(a), self.times(b), self.times(c)])
    }

    /// Returns the transpose.
    #[inline(always)]
    fn transposed(self) -> Self {
        let [a, b, c] = self.columns();
        let ([ax, ay, az], [bx, by, bz], [cx, cy, cz]) = (a.parts(), b.parts(), c.parts());
        Self::of([R::Vector::of([ax, bx, cx]), R::Vector::of([ay, by, cy]), R::Vector::of([az, bz, cz])])
    }
}

/// Returns the length of a vector in a plane. Unlike `hypot` it does not guard against overflow and underflow
/// of the squares, which would take longer than the rest.
#[inline(always)]
pub(super) fn length_in_plane<R: Real>(x: R, y: R) -> R {
    (x * x + y * y).sqrt()
}

/// Methods that delegate to `f64`.
macro_rules! of_f64 {
    ($($name:ident($($other:ident),*);)*) => {
        $(
            #[inline(always)]
            fn $name(self, $($other: Self),*) -> Self {
                f64::$name(self, $($other),*)
            }
        )*
    };
}

impl Real for f64 {
    type Mask = bool;
    type Vector = DVec3;
    type Matrix = DMat3;

    of_f64! {
        sqrt();
        abs();
        copysign(sign);
        max(other);
        min(other);
        clamp(least, most);
    }

    #[inline(always)]
    fn splat(self, value: f64) -> Self {
        value
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
    fn of(parts: [f64; 3]) -> Self {
        Self::from_array(parts)
    }

    #[inline(always)]
    fn parts(self) -> [f64; 3] {
        self.to_array()
    }
}

impl MatrixOf<f64> for DMat3 {
    #[inline(always)]
    fn of([x, y, z]: [DVec3; 3]) -> Self {
        Self::from_cols(x, y, z)
    }

    #[inline(always)]
    fn columns(self) -> [DVec3; 3] {
        [self.x_axis, self.y_axis, self.z_axis]
    }
}

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

    /// Whether it is yes for all.
    #[inline(always)]
    fn all(self) -> bool {
        !(!self).any()
    }

    /// Whether both say the same.
    #[inline(always)]
    fn matches(self, other: Self) -> Self {
        (self & other) | (!self & !other)
    }
}

/// Three numbers.
pub trait VectorOf<R: Real>:
    Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Neg<Output = Self> + Mul<R, Output = Self>
{
    /// From its components.
    fn of(parts: [R; 3]) -> Self;

    /// Its components.
    fn parts(self) -> [R; 3];

    /// The scalar product.
    #[inline(always)]
    fn dot(self, other: Self) -> R {
        let ([x, y, z], [a, b, c]) = (self.parts(), other.parts());
        (x * a) + (y * b) + (z * c)
    }

    /// The vector product.
    #[inline(always)]
    fn cross(self, other: Self) -> Self {
        let ([x, y, z], [a, b, c]) = (self.parts(), other.parts());
        Self::of([y * c - b * z, z * a - c * x, x * b - a * y])
    }
}

/// Three columns of three numbers.
pub trait MatrixOf<R: Real>: Copy + Debug + Add<Output = Self> + Sub<Output = Self> {
    /// From its columns.
    fn of(columns: [R::Vector; 3]) -> Self;

    /// Its columns.
    fn columns(self) -> [R::Vector; 3];

    /// `self v`.
    #[inline(always)]
    fn times(self, v: R::Vector) -> R::Vector {
        let ([a, b, c], [x, y, z]) = (self.columns(), v.parts());
        a * x + b * y + c * z
    }

    /// `self' v`, without building the transpose.
    #[inline(always)]
    fn transposed_times(self, v: R::Vector) -> R::Vector {
        let [a, b, c] = self.columns();
        R::Vector::of([a.dot(v), b.dot(v), c.dot(v)])
    }

    /// `self other`.
    #[inline(always)]
    fn after(self, other: Self) -> Self {
        let [a, b, c] = other.columns();
        Self::of([self.times(a), self.times(b), self.times(c)])
    }

    /// Its rows as columns.
    #[inline(always)]
    fn transposed(self) -> Self {
        let [a, b, c] = self.columns();
        let ([ax, ay, az], [bx, by, bz], [cx, cy, cz]) = (a.parts(), b.parts(), c.parts());
        Self::of([R::Vector::of([ax, bx, cx]), R::Vector::of([ay, by, cy]), R::Vector::of([az, bz, cz])])
    }
}

/// The length of a vector in a plane, without the care of `hypot` for squares that are too small or too large for a number, which takes
/// longer than what it is for.
#[inline(always)]
pub(super) fn length_in_plane<R: Real>(x: R, y: R) -> R {
    (x * x + y * y).sqrt()
}

/// Methods that are those of `f64`.
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

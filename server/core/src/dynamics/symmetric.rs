//! Symmetric 3x3 matrices: six numbers instead of nine.

use std::ops::{Add, AddAssign, Mul};

use glamx::DMat3;

use super::real::{MatrixOf, Real, VectorOf};

/// A symmetric matrix by its upper triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Symmetric<R: Real = f64> {
    /// Row x, column x.
    pub xx: R,
    /// Row x, column y.
    pub xy: R,
    /// Row x, column z.
    pub xz: R,
    /// Row y, column y.
    pub yy: R,
    /// Row y, column z.
    pub yz: R,
    /// Row z, column z.
    pub zz: R,
}

impl Symmetric {
    /// Zero matrix.
    pub const ZERO: Self = Self { xx: 0.0, xy: 0.0, xz: 0.0, yy: 0.0, yz: 0.0, zz: 0.0 };

    /// Creates it from a symmetric matrix, of which it reads the upper triangle.
    pub fn of(m: &DMat3) -> Self {
        Self {
            xx: m.x_axis.x,
            xy: m.y_axis.x,
            xz: m.z_axis.x,
            yy: m.y_axis.y,
            yz: m.z_axis.y,
            zz: m.z_axis.z,
        }
    }
}

impl<R: Real> Symmetric<R> {
    /// Creates it with `factor` on the diagonal.
    #[inline(always)]
    pub fn scalar(factor: R) -> Self {
        let zero = factor.splat(0.0);
        Self { xx: factor, xy: zero, xz: zero, yy: factor, yz: zero, zz: factor }
    }

    /// Returns all nine entries.
    #[inline(always)]
    pub fn matrix(&self) -> R::Matrix {
        let Self { xx, xy, xz, yy, yz, zz } = *self;
        R::Matrix::of([R::Vector::of([xx, xy, xz]), R::Vector::of([xy, yy, yz]), R::Vector::of([xz, yz, zz])])
    }

    /// Returns `self v`.
    #[inline(always)]
    pub fn times(&self, v: R::Vector) -> R::Vector {
        let (Self { xx, xy, xz, yy, yz, zz }, [x, y, z]) = (*self, v.parts());
        R::Vector::of([xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z])
    }

    /// Returns `r self r'`.
    #[inline(always)]
    pub fn turned(&self, r: &R::Matrix) -> Self {
        let [x, y, z] = r.transposed().columns();
        let half = [self.times(x), self.times(y), self.times(z)];
        Self {
            xx: half[0].dot(x),
            xy: half[0].dot(y),
            xz: half[0].dot(z),
            yy: half[1].dot(y),
            yz: half[1].dot(z),
            zz: half[2].dot(z),
        }
    }

    /// Returns `self - factor a a'`.
    #[inline(always)]
    pub fn without(&self, a: R::Vector, factor: R) -> Self {
        let ([x, y, z], [a, b, c]) = (a.parts(), (a * factor).parts());
        Self {
            xx: self.xx - x * a,
            xy: self.xy - x * b,
            xz: self.xz - x * c,
            yy: self.yy - y * b,
            yz: self.yz - y * c,
            zz: self.zz - z * c,
        }
    }

    /// Returns the largest entry of the diagonal.
    #[inline(always)]
    pub fn largest(&self) -> R {
        self.xx.max(self.yy).max(self.zz)
    }
}

impl<R: Real> Mul<R> for Symmetric<R> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: R) -> Self {
        let Self { xx, xy, xz, yy, yz, zz } = self;
        Self {
            xx: xx * factor,
            xy: xy * factor,
            xz: xz * factor,
            yy: yy * factor,
            yz: yz * factor,
            zz: zz * factor,
        }
    }
}

impl<R: Real> Add for Symmetric<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            xz: self.xz + other.xz,
            yy: self.yy + other.yy,
            yz: self.yz + other.yz,
            zz: self.zz + other.zz,
        }
    }
}

impl<R: Real> AddAssign for Symmetric<R> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

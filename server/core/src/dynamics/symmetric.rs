//! Symmetric 3x3 matrices: six numbers instead of nine.

use std::ops::{Add, AddAssign, Mul};

use glamx::{DMat3, DVec3};

/// A symmetric matrix by its upper triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Symmetric {
    /// Row x, column x.
    pub xx: f64,
    /// Row x, column y.
    pub xy: f64,
    /// Row x, column z.
    pub xz: f64,
    /// Row y, column y.
    pub yy: f64,
    /// Row y, column z.
    pub yz: f64,
    /// Row z, column z.
    pub zz: f64,
}

impl Symmetric {
    /// Nothing.
    pub const ZERO: Self = Self { xx: 0.0, xy: 0.0, xz: 0.0, yy: 0.0, yz: 0.0, zz: 0.0 };

    /// `factor` on the diagonal.
    pub const fn scalar(factor: f64) -> Self {
        Self { xx: factor, yy: factor, zz: factor, ..Self::ZERO }
    }

    /// Of a matrix that is symmetric: its upper triangle.
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

    /// All nine entries.
    #[inline(always)]
    pub fn matrix(&self) -> DMat3 {
        let Self { xx, xy, xz, yy, yz, zz } = *self;
        DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz))
    }

    /// `self v`.
    #[inline(always)]
    pub fn times(&self, v: DVec3) -> DVec3 {
        let Self { xx, xy, xz, yy, yz, zz } = *self;
        DVec3::new(
            xx * v.x + xy * v.y + xz * v.z,
            xy * v.x + yy * v.y + yz * v.z,
            xz * v.x + yz * v.y + zz * v.z,
        )
    }

    /// `r self r'`.
    #[inline(always)]
    pub fn turned(&self, r: &DMat3) -> Self {
        let rows = r.transpose();
        let half = [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| self.times(row));
        Self {
            xx: half[0].dot(rows.x_axis),
            xy: half[0].dot(rows.y_axis),
            xz: half[0].dot(rows.z_axis),
            yy: half[1].dot(rows.y_axis),
            yz: half[1].dot(rows.z_axis),
            zz: half[2].dot(rows.z_axis),
        }
    }

    /// `self - factor a a'`.
    #[inline(always)]
    pub fn without(&self, a: DVec3, factor: f64) -> Self {
        let b = a * factor;
        Self {
            xx: self.xx - a.x * b.x,
            xy: self.xy - a.x * b.y,
            xz: self.xz - a.x * b.z,
            yy: self.yy - a.y * b.y,
            yz: self.yz - a.y * b.z,
            zz: self.zz - a.z * b.z,
        }
    }

    /// The largest entry of the diagonal.
    #[inline(always)]
    pub fn largest(&self) -> f64 {
        self.xx.max(self.yy).max(self.zz)
    }
}

impl Mul<f64> for Symmetric {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
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

impl Add for Symmetric {
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

impl AddAssign for Symmetric {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

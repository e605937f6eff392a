//! Vectors, matrices and inertias over lanes: the arithmetic of [`spatial`](crate::dynamics::spatial),
//! [`symmetric`](crate::dynamics::symmetric) and [`inertia`](crate::dynamics::inertia), operation by operation, since a lane has
//! their bits.

use std::ops::{Add, AddAssign, Mul, Sub};

use glamx::{DMat3, DVec3};
use pulp::Simd;

use super::number::Lanes;

/// See [`DVec3`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Vector<S: Simd> {
    pub(super) x: Lanes<S>,
    pub(super) y: Lanes<S>,
    pub(super) z: Lanes<S>,
}

/// See [`DMat3`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Matrix<S: Simd> {
    pub(super) x: Vector<S>,
    pub(super) y: Vector<S>,
    pub(super) z: Vector<S>,
}

/// See [`Symmetric`](crate::dynamics::symmetric::Symmetric).
#[derive(Clone, Copy, Debug)]
pub(super) struct Symmetric<S: Simd> {
    pub(super) xx: Lanes<S>,
    pub(super) xy: Lanes<S>,
    pub(super) xz: Lanes<S>,
    pub(super) yy: Lanes<S>,
    pub(super) yz: Lanes<S>,
    pub(super) zz: Lanes<S>,
}

/// See [`Spatial`](crate::dynamics::spatial::Spatial).
#[derive(Clone, Copy, Debug)]
pub(super) struct Spatial<S: Simd> {
    pub(super) angular: Vector<S>,
    pub(super) linear: Vector<S>,
}

/// See [`Rigid`](crate::dynamics::inertia::Rigid).
#[derive(Clone, Copy, Debug)]
pub(super) struct Rigid<S: Simd> {
    pub(super) mass: Lanes<S>,
    pub(super) first_moment: Vector<S>,
    pub(super) moment: Symmetric<S>,
}

/// See [`Articulated`](crate::dynamics::inertia::Articulated).
#[derive(Clone, Copy, Debug)]
pub(super) struct Articulated<S: Simd> {
    pub(super) moment: Symmetric<S>,
    pub(super) coupling: Matrix<S>,
    pub(super) mass: Symmetric<S>,
}

/// The length of a vector in a plane.
#[inline(always)]
pub(super) fn length_in_plane<S: Simd>(x: Lanes<S>, y: Lanes<S>) -> Lanes<S> {
    (x * x + y * y).sqrt()
}

impl<S: Simd> Vector<S> {
    #[inline(always)]
    pub(super) fn splat(simd: S, value: DVec3) -> Self {
        // No closure: what is not inlined is compiled for any processor.
        Self {
            x: Lanes::splat(simd, value.x),
            y: Lanes::splat(simd, value.y),
            z: Lanes::splat(simd, value.z),
        }
    }

    #[inline(always)]
    pub(super) fn dot(self, other: Self) -> Lanes<S> {
        (self.x * other.x) + (self.y * other.y) + (self.z * other.z)
    }

    #[inline(always)]
    pub(super) fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - other.y * self.z,
            y: self.z * other.x - other.z * self.x,
            z: self.x * other.y - other.x * self.y,
        }
    }

    #[inline(always)]
    pub(super) fn length(self) -> Lanes<S> {
        self.dot(self).sqrt()
    }

    /// Of one lane.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> DVec3 {
        DVec3::new(self.x.get(lane), self.y.get(lane), self.z.get(lane))
    }

    /// Writes one lane.
    pub(super) fn set(&mut self, lane: usize, value: DVec3) {
        self.x.set(lane, value.x);
        self.y.set(lane, value.y);
        self.z.set(lane, value.z);
    }
}

impl<S: Simd> Add for Vector<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl<S: Simd> Sub for Vector<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl<S: Simd> Mul<Lanes<S>> for Vector<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: Lanes<S>) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }
}

impl<S: Simd> Matrix<S> {
    #[inline(always)]
    pub(super) fn splat(simd: S, value: &DMat3) -> Self {
        Self {
            x: Vector::splat(simd, value.x_axis),
            y: Vector::splat(simd, value.y_axis),
            z: Vector::splat(simd, value.z_axis),
        }
    }

    #[inline(always)]
    pub(super) fn transpose(self) -> Self {
        let Self { x, y, z } = self;
        Self {
            x: Vector { x: x.x, y: y.x, z: z.x },
            y: Vector { x: x.y, y: y.y, z: z.y },
            z: Vector { x: x.z, y: y.z, z: z.z },
        }
    }

    #[inline(always)]
    pub(super) fn times(self, v: Vector<S>) -> Vector<S> {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    #[inline(always)]
    pub(super) fn transposed_times(self, v: Vector<S>) -> Vector<S> {
        Vector { x: self.x.dot(v), y: self.y.dot(v), z: self.z.dot(v) }
    }

    #[inline(always)]
    pub(super) fn after(self, other: Self) -> Self {
        Self { x: self.times(other.x), y: self.times(other.y), z: self.times(other.z) }
    }
}

impl<S: Simd> Symmetric<S> {
    #[inline(always)]
    pub(super) fn scalar(factor: Lanes<S>) -> Self {
        let zero = factor.same(0.0);
        Self { xx: factor, xy: zero, xz: zero, yy: factor, yz: zero, zz: factor }
    }

    #[inline(always)]
    pub(super) fn times(self, v: Vector<S>) -> Vector<S> {
        let Self { xx, xy, xz, yy, yz, zz } = self;
        Vector {
            x: xx * v.x + xy * v.y + xz * v.z,
            y: xy * v.x + yy * v.y + yz * v.z,
            z: xz * v.x + yz * v.y + zz * v.z,
        }
    }

    #[inline(always)]
    pub(super) fn matrix(self) -> Matrix<S> {
        let Self { xx, xy, xz, yy, yz, zz } = self;
        Matrix {
            x: Vector { x: xx, y: xy, z: xz },
            y: Vector { x: xy, y: yy, z: yz },
            z: Vector { x: xz, y: yz, z: zz },
        }
    }

    /// `r self r'`.
    #[inline(always)]
    pub(super) fn turned(self, r: Matrix<S>) -> Self {
        let rows = r.transpose();
        let half = [self.times(rows.x), self.times(rows.y), self.times(rows.z)];
        Self {
            xx: half[0].dot(rows.x),
            xy: half[0].dot(rows.y),
            xz: half[0].dot(rows.z),
            yy: half[1].dot(rows.y),
            yz: half[1].dot(rows.z),
            zz: half[2].dot(rows.z),
        }
    }

    /// `self - factor a a'`.
    #[inline(always)]
    pub(super) fn without(self, a: Vector<S>, factor: Lanes<S>) -> Self {
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
    pub(super) fn largest(self) -> Lanes<S> {
        self.xx.max(self.yy).max(self.zz)
    }
}

impl<S: Simd> Add for Symmetric<S> {
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

impl<S: Simd> Spatial<S> {
    #[inline(always)]
    pub(super) fn dot(self, other: Self) -> Lanes<S> {
        self.angular.dot(other.angular) + self.linear.dot(other.linear)
    }

    /// `self x* force`.
    #[inline(always)]
    pub(super) fn cross_force(self, force: Self) -> Self {
        Self {
            angular: self.angular.cross(force.angular) + self.linear.cross(force.linear),
            linear: self.angular.cross(force.linear),
        }
    }

    /// A motion at a point `reach` away.
    #[inline(always)]
    pub(super) fn motion_at(self, reach: Vector<S>) -> Self {
        Self { angular: self.angular, linear: self.linear - reach.cross(self.angular) }
    }

    /// A force at a point `reach` away, seen from here.
    #[inline(always)]
    pub(super) fn force_from(self, reach: Vector<S>) -> Self {
        Self { angular: self.angular + reach.cross(self.linear), linear: self.linear }
    }
}

impl<S: Simd> Add for Spatial<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { angular: self.angular + other.angular, linear: self.linear + other.linear }
    }
}

impl<S: Simd> AddAssign for Spatial<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<S: Simd> Mul<Lanes<S>> for Spatial<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: Lanes<S>) -> Self {
        Self { angular: self.angular * factor, linear: self.linear * factor }
    }
}

impl<S: Simd> Rigid<S> {
    #[inline(always)]
    pub(super) fn turned(self, r: Matrix<S>) -> Self {
        Self { mass: self.mass, first_moment: r.times(self.first_moment), moment: self.moment.turned(r) }
    }

    #[inline(always)]
    pub(super) fn times(self, motion: Spatial<S>) -> Spatial<S> {
        let Spatial { angular, linear } = motion;
        Spatial {
            angular: self.moment.times(angular) + self.first_moment.cross(linear),
            linear: linear * self.mass - self.first_moment.cross(angular),
        }
    }
}

impl<S: Simd> Articulated<S> {
    #[inline(always)]
    pub(super) fn of(rigid: Rigid<S>) -> Self {
        let f = rigid.first_moment;
        let zero = f.x.same(0.0);
        Self {
            moment: rigid.moment,
            coupling: Matrix {
                x: Vector { x: zero, y: f.z, z: -f.y },
                y: Vector { x: -f.z, y: zero, z: f.x },
                z: Vector { x: f.y, y: -f.x, z: zero },
            },
            mass: Symmetric::scalar(rigid.mass),
        }
    }

    #[inline(always)]
    pub(super) fn times(self, motion: Spatial<S>) -> Spatial<S> {
        Spatial {
            angular: self.moment.times(motion.angular) + self.coupling.times(motion.linear),
            linear: self.coupling.transposed_times(motion.angular) + self.mass.times(motion.linear),
        }
    }

    /// U of a joint that turns about `axis`.
    #[inline(always)]
    pub(super) fn times_turn(self, axis: Vector<S>) -> Spatial<S> {
        Spatial { angular: self.moment.times(axis), linear: self.coupling.transposed_times(axis) }
    }

    /// U of a joint that slides along `axis`.
    #[inline(always)]
    pub(super) fn times_slide(self, axis: Vector<S>) -> Spatial<S> {
        Spatial { angular: self.coupling.times(axis), linear: self.mass.times(axis) }
    }

    /// `self - u u' / d`.
    #[inline(always)]
    pub(super) fn without(self, u: Spatial<S>, inverse_d: Lanes<S>) -> Self {
        let scaled = u.linear * inverse_d;
        Self {
            moment: self.moment.without(u.angular, inverse_d),
            coupling: Matrix {
                x: self.coupling.x - u.angular * scaled.x,
                y: self.coupling.y - u.angular * scaled.y,
                z: self.coupling.z - u.angular * scaled.z,
            },
            mass: self.mass.without(u.linear, inverse_d),
        }
    }

    /// About a point from which this origin is `o` away.
    #[inline(always)]
    pub(super) fn shifted(self, o: Vector<S>) -> Self {
        let Self { moment, coupling: c, mass } = self;
        let columns = mass.matrix();
        let s =
            Matrix { x: c.x + o.cross(columns.x), y: c.y + o.cross(columns.y), z: c.z + o.cross(columns.z) };
        let moved = Symmetric {
            xx: (o.y * s.z.x - o.z * s.y.x) + (o.y * c.z.x - o.z * c.y.x),
            xy: (o.z * s.x.x - o.x * s.z.x) + (o.y * c.z.y - o.z * c.y.y),
            xz: (o.x * s.y.x - o.y * s.x.x) + (o.y * c.z.z - o.z * c.y.z),
            yy: (o.z * s.x.y - o.x * s.z.y) + (o.z * c.x.y - o.x * c.z.y),
            yz: (o.x * s.y.y - o.y * s.x.y) + (o.z * c.x.z - o.x * c.z.z),
            zz: (o.x * s.y.z - o.y * s.x.z) + (o.x * c.y.z - o.y * c.x.z),
        };
        Self { moment: moment + moved, coupling: s, mass }
    }
}

impl<S: Simd> AddAssign for Articulated<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.moment = self.moment + other.moment;
        self.coupling = Matrix {
            x: self.coupling.x + other.coupling.x,
            y: self.coupling.y + other.coupling.y,
            z: self.coupling.z + other.coupling.z,
        };
        self.mass = self.mass + other.mass;
    }
}

//! Spatial vectors: motion and force, and their changes of frame.
//!
//! Featherstone, "Rigid Body Dynamics Algorithms" (2008), chapter 2 and appendix A; the angular part comes
//! first.

use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

use glamx::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::real::{Real, VectorOf};
use crate::plain::vector3;

/// Angular and linear part of a motion (velocity, acceleration) or a force (moment about the origin, force),
/// in the axes of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spatial<R: Real = f64> {
    /// Angular part, rad/s or N m.
    pub angular: R::Vector,
    /// Linear part, m/s of the frame's origin or N.
    pub linear: R::Vector,
}

/// Serialized form: its numbers.
#[derive(Serialize, Deserialize)]
#[serde(rename = "Spatial")]
struct Written {
    #[serde(with = "vector3")]
    angular: DVec3,
    #[serde(with = "vector3")]
    linear: DVec3,
}

impl Serialize for Spatial {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Written { angular: self.angular, linear: self.linear }.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Spatial {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Written::deserialize(deserializer).map(|Written { angular, linear }| Self { angular, linear })
    }
}

impl Spatial {
    /// Zero vector.
    pub const ZERO: Self = Self { angular: DVec3::ZERO, linear: DVec3::ZERO };

    /// Creates it from its two parts.
    #[inline(always)]
    pub const fn new(angular: DVec3, linear: DVec3) -> Self {
        Self { angular, linear }
    }
}

impl<R: Real> Spatial<R> {
    /// Returns the scalar product of a motion and a force: a power.
    #[inline(always)]
    pub fn dot(self, other: Self) -> R {
        self.angular.dot(other.angular) + self.linear.dot(other.linear)
    }

    /// Returns `self x motion`, both motions (eq. 2.31).
    #[inline(always)]
    pub fn cross_motion(self, motion: Self) -> Self {
        Self {
            angular: self.angular.cross(motion.angular),
            linear: self.angular.cross(motion.linear) + self.linear.cross(motion.angular),
        }
    }

    /// Returns `self x* force` for a motion and a force (eq. 2.32).
    #[inline(always)]
    pub fn cross_force(self, force: Self) -> Self {
        Self {
            angular: self.angular.cross(force.angular) + self.linear.cross(force.linear),
            linear: self.angular.cross(force.linear),
        }
    }

    /// Returns X m for a shift: the motion at a point `reach` away, in the same axes (eq. 2.21).
    #[inline(always)]
    pub fn motion_at(self, reach: R::Vector) -> Self {
        Self { angular: self.angular, linear: self.linear - reach.cross(self.angular) }
    }

    /// Returns X' f for a shift: the force at a point `reach` away as seen from here, in the same axes.
    #[inline(always)]
    pub fn force_from(self, reach: R::Vector) -> Self {
        Self { angular: self.angular + reach.cross(self.linear), linear: self.linear }
    }
}

impl<R: Real> Add for Spatial<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { angular: self.angular + other.angular, linear: self.linear + other.linear }
    }
}

impl<R: Real> AddAssign for Spatial<R> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<R: Real> Sub for Spatial<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { angular: self.angular - other.angular, linear: self.linear - other.linear }
    }
}

impl<R: Real> SubAssign for Spatial<R> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<R: Real> Neg for Spatial<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { angular: -self.angular, linear: -self.linear }
    }
}

impl<R: Real> Mul<R> for Spatial<R> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: R) -> Self {
        Self { angular: self.angular * factor, linear: self.linear * factor }
    }
}

/// Pose of a child frame in its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// `parent_from_child`.
    pub rotation: DMat3,
    /// The child's origin in the parent's frame.
    pub origin: DVec3,
}

impl Placement {
    /// Identity.
    pub const IDENTITY: Self = Self { rotation: DMat3::IDENTITY, origin: DVec3::ZERO };

    /// Creates it from a quaternion and a translation.
    pub fn new(rotation: DQuat, origin: DVec3) -> Self {
        Self { rotation: DMat3::from_quat(rotation), origin }
    }

    /// Returns `X' f`: a force in the child's frame as seen in the parent's (eq. 2.25).
    #[inline(always)]
    pub fn force_to_parent(&self, force: Spatial) -> Spatial {
        Spatial::new(self.rotation * force.angular, self.rotation * force.linear).force_from(self.origin)
    }

    /// Returns the frame of a grandchild: `self` after `child`.
    #[inline(always)]
    pub fn then(&self, child: &Self) -> Self {
        Self { rotation: self.rotation * child.rotation, origin: self.origin + self.rotation * child.origin }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// f' (X m) = (X' f)' m for every motion and force: X and X' are transposes.
    #[test]
    fn power_is_the_same_at_both_points() {
        let reach = DVec3::new(0.3, -0.2, 0.5);
        let m = Spatial::new(DVec3::new(1.0, -2.0, 0.5), DVec3::new(0.2, 0.4, -0.6));
        let f = Spatial::new(DVec3::new(-0.3, 0.8, 1.5), DVec3::new(2.0, 0.1, -1.0));
        assert!((m.motion_at(reach).dot(f) - m.dot(f.force_from(reach))).abs() < 1e-12);
    }
}

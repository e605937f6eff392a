//! Spatial vectors: motion, force, inertia, and how they change frames.
//!
//! Featherstone, "Rigid Body Dynamics Algorithms" (2008), chapter 2 and
//! appendix A; the angular part comes first.

use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

use glamx::{DMat3, DQuat, DVec3};

/// Angular and linear part of a motion (velocity, acceleration) or a force
/// (moment about the origin, force), in the axes of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spatial {
    /// rad/s, or N m.
    pub angular: DVec3,
    /// m/s of the frame's origin, or N.
    pub linear: DVec3,
}

impl Spatial {
    /// Nothing.
    pub const ZERO: Self = Self { angular: DVec3::ZERO, linear: DVec3::ZERO };

    /// From its two parts.
    #[inline]
    pub const fn new(angular: DVec3, linear: DVec3) -> Self {
        Self { angular, linear }
    }

    /// The scalar product of a motion and a force: a power.
    #[inline]
    pub fn dot(self, other: Self) -> f64 {
        self.angular.dot(other.angular) + self.linear.dot(other.linear)
    }

    /// `self x motion`, both motions (eq. 2.31).
    #[inline]
    pub fn cross_motion(self, motion: Self) -> Self {
        Self {
            angular: self.angular.cross(motion.angular),
            linear: self.angular.cross(motion.linear) + self.linear.cross(motion.angular),
        }
    }

    /// `self x* force` for a motion and a force (eq. 2.32).
    #[inline]
    pub fn cross_force(self, force: Self) -> Self {
        Self {
            angular: self.angular.cross(force.angular) + self.linear.cross(force.linear),
            linear: self.angular.cross(force.linear),
        }
    }

    /// Whether every number in it is finite.
    pub fn is_finite(self) -> bool {
        self.angular.is_finite() && self.linear.is_finite()
    }
}

impl Add for Spatial {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self { angular: self.angular + other.angular, linear: self.linear + other.linear }
    }
}

impl AddAssign for Spatial {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Spatial {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self { angular: self.angular - other.angular, linear: self.linear - other.linear }
    }
}

impl SubAssign for Spatial {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Neg for Spatial {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { angular: -self.angular, linear: -self.linear }
    }
}

impl Mul<f64> for Spatial {
    type Output = Self;
    #[inline]
    fn mul(self, factor: f64) -> Self {
        Self { angular: self.angular * factor, linear: self.linear * factor }
    }
}

/// A child frame in its parent: `X`, the transform of motions from parent to
/// child, with `E = rotation'` and `r = origin` of eq. 2.24.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// `parent_from_child`.
    pub rotation: DMat3,
    /// The child's origin in the parent's frame.
    pub origin: DVec3,
}

impl Placement {
    /// The same frame.
    pub const IDENTITY: Self = Self { rotation: DMat3::IDENTITY, origin: DVec3::ZERO };

    /// From a quaternion and a translation.
    pub fn new(rotation: DQuat, origin: DVec3) -> Self {
        Self { rotation: DMat3::from_quat(rotation), origin }
    }

    /// `X m`: a motion of the parent's frame, seen in the child's.
    #[inline]
    pub fn motion_to_child(&self, motion: Spatial) -> Spatial {
        Spatial {
            angular: transposed_times(&self.rotation, motion.angular),
            linear: transposed_times(&self.rotation, motion.linear - self.origin.cross(motion.angular)),
        }
    }

    /// `X' f`: a force of the child's frame, seen in the parent's.
    #[inline]
    pub fn force_to_parent(&self, force: Spatial) -> Spatial {
        let linear = self.rotation * force.linear;
        Spatial { angular: self.rotation * force.angular + self.origin.cross(linear), linear }
    }

    /// `X' I X`: an inertia of the child's frame, seen in the parent's.
    ///
    /// With R = rotation, A, B, C the blocks and r~ the cross product matrix of
    /// the origin: rotate each block, then shift, as in eq. 2.66 but for an
    /// inertia whose mass depends on the direction.
    #[inline]
    pub fn inertia_to_parent(&self, inertia: &Inertia) -> Inertia {
        let r = &self.rotation;
        let rt = r.transpose();
        let moment = *r * inertia.moment * rt;
        let coupling = *r * inertia.coupling * rt;
        let mass = *r * inertia.mass * rt;
        let shift = cross_matrix(self.origin);
        let shifted = coupling + shift * mass;
        Inertia { moment: moment - shifted * shift + shift * coupling.transpose(), coupling: shifted, mass }
    }

    /// The frame of a grandchild: `self` after `child`.
    #[inline]
    pub fn then(&self, child: &Self) -> Self {
        Self { rotation: self.rotation * child.rotation, origin: self.origin + self.rotation * child.origin }
    }
}

/// A spatial inertia, rigid or articulated: force = I motion, with the blocks
/// `[moment coupling; coupling' mass]`: symmetric, and
/// positive semidefinite.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inertia {
    /// Moment by angular motion: kg m^2.
    pub moment: DMat3,
    /// Moment by linear motion: kg m.
    pub coupling: DMat3,
    /// Force by linear motion: kg.
    pub mass: DMat3,
}

impl Inertia {
    /// Nothing.
    pub const ZERO: Self = Self { moment: DMat3::ZERO, coupling: DMat3::ZERO, mass: DMat3::ZERO };

    /// Of a rigid body (eq. 2.63): mass, centre of mass, moment about that centre.
    pub fn rigid(mass: f64, center: DVec3, moment_about_center: DMat3) -> Self {
        let c = cross_matrix(center);
        Self {
            moment: moment_about_center - c * c * mass,
            coupling: c * mass,
            mass: DMat3::from_diagonal(DVec3::splat(mass)),
        }
    }

    /// The force of a motion.
    #[inline]
    pub fn times(&self, motion: Spatial) -> Spatial {
        Spatial {
            angular: self.moment * motion.angular + self.coupling * motion.linear,
            linear: transposed_times(&self.coupling, motion.angular) + self.mass * motion.linear,
        }
    }

    /// `self - u u' / d`: what is left once one direction is free (eq. 7.44).
    #[inline]
    pub fn without(&self, u: Spatial, inverse_d: f64) -> Self {
        let scaled = u * inverse_d;
        Self {
            moment: self.moment - outer(u.angular, scaled.angular),
            coupling: self.coupling - outer(u.angular, scaled.linear),
            mass: self.mass - outer(u.linear, scaled.linear),
        }
    }
}

impl AddAssign for Inertia {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.moment += other.moment;
        self.coupling += other.coupling;
        self.mass += other.mass;
    }
}

/// `m' v` without building the transpose.
#[inline]
fn transposed_times(m: &DMat3, v: DVec3) -> DVec3 {
    DVec3::new(m.x_axis.dot(v), m.y_axis.dot(v), m.z_axis.dot(v))
}

/// `a b'`.
#[inline]
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// The matrix of `v x` (eq. 2.23).
#[inline]
pub fn cross_matrix(v: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, v.z, -v.y), DVec3::new(-v.z, 0.0, v.x), DVec3::new(v.y, -v.x, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placement() -> Placement {
        Placement::new(DQuat::from_rotation_z(0.7) * DQuat::from_rotation_x(-1.1), DVec3::new(0.3, -0.2, 0.5))
    }

    fn body() -> Inertia {
        let moment = DMat3::from_cols(
            DVec3::new(0.4, 0.01, -0.02),
            DVec3::new(0.01, 0.3, 0.03),
            DVec3::new(-0.02, 0.03, 0.2),
        );
        Inertia::rigid(2.0, DVec3::new(0.1, 0.2, -0.3), moment)
    }

    fn close(a: Spatial, b: Spatial) -> bool {
        (a.angular - b.angular).length() + (a.linear - b.linear).length() < 1e-12
    }

    /// f' (X m) = (X' f)' m for every motion and force: X and X' are transposes.
    #[test]
    fn power_is_the_same_in_both_frames() {
        let x = placement();
        let m = Spatial::new(DVec3::new(1.0, -2.0, 0.5), DVec3::new(0.2, 0.4, -0.6));
        let f = Spatial::new(DVec3::new(-0.3, 0.8, 1.5), DVec3::new(2.0, 0.1, -1.0));
        assert!((x.motion_to_child(m).dot(f) - m.dot(x.force_to_parent(f))).abs() < 1e-12);
    }

    /// X' I X m, computed as a matrix and as three transforms.
    #[test]
    fn an_inertia_moves_as_its_forces_do() {
        let x = placement();
        let m = Spatial::new(DVec3::new(1.0, -2.0, 0.5), DVec3::new(0.2, 0.4, -0.6));
        let stepwise = x.force_to_parent(body().times(x.motion_to_child(m)));
        assert!(close(x.inertia_to_parent(&body()).times(m), stepwise));
    }

    /// (I - U U'/D) S = 0 for U = I S, D = S' U: the free direction has no inertia left.
    #[test]
    fn a_free_direction_has_no_inertia_left() {
        let s = Spatial::new(DVec3::Z, DVec3::ZERO);
        let u = body().times(s);
        let left = body().without(u, 1.0 / s.dot(u)).times(s);
        assert!(close(left, Spatial::ZERO));
    }
}

//! Spatial inertias of a rigid body, and of all bodies that a joint carries.

use std::ops::AddAssign;

use glamx::{DMat3, DVec3};

use super::real::{MatrixOf, Real, VectorOf};
use super::spatial::Spatial;
use super::symmetric::Symmetric;

/// Inertia of a rigid body about the origin of a frame (Featherstone eq. 2.63).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rigid<R: Real = f64> {
    /// Mass, kg.
    pub mass: R,
    /// Mass times the centre of mass, kg m.
    pub first_moment: R::Vector,
    /// Moment about the origin, kg m^2.
    pub moment: Symmetric<R>,
}

impl Rigid {
    /// Creates it from mass, centre of mass, and moment about that centre.
    pub fn new(mass: f64, center: DVec3, moment_about_center: &DMat3) -> Self {
        let parallel_axis = around(center, center * mass);
        Self { mass, first_moment: center * mass, moment: Symmetric::of(moment_about_center) + parallel_axis }
    }
}

impl<R: Real> Rigid<R> {
    /// Returns it in axes rotated by `r`.
    #[inline(always)]
    pub fn turned(&self, r: &R::Matrix) -> Self {
        Self { mass: self.mass, first_moment: r.times(self.first_moment), moment: self.moment.turned(r) }
    }

    /// Returns it about a point from which this origin is `reach` away.
    #[inline(always)]
    pub fn shifted(&self, reach: R::Vector) -> Self {
        let Self { mass, first_moment, moment } = *self;
        let moved = around(reach, first_moment) + around(first_moment, reach) + around(reach, reach * mass);
        Self { mass, first_moment: first_moment + reach * mass, moment: moment + moved }
    }

    /// Returns the momentum of a velocity, or the force of an acceleration.
    #[inline(always)]
    pub fn times(&self, motion: Spatial<R>) -> Spatial<R> {
        let Spatial { angular, linear } = motion;
        Spatial {
            angular: self.moment.times(angular) + self.first_moment.cross(linear),
            linear: linear * self.mass - self.first_moment.cross(angular),
        }
    }
}

impl<R: Real> AddAssign for Rigid<R> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.mass += other.mass;
        self.first_moment = self.first_moment + other.first_moment;
        self.moment += other.moment;
    }
}

/// Returns the symmetric part of -a~ b~ = (a . b) 1 - b a': a point mass' moment if b is m a.
#[inline(always)]
pub(super) fn around<R: Real>(a: R::Vector, b: R::Vector) -> Symmetric<R> {
    let ([ax, ay, az], [bx, by, bz]) = (a.parts(), b.parts());
    let minus_half = ax.splat(-0.5);
    let dot = a.dot(b);
    Symmetric {
        xx: dot + minus_half * (ax * bx + ax * bx),
        xy: minus_half * (ax * by + ay * bx),
        xz: minus_half * (ax * bz + az * bx),
        yy: dot + minus_half * (ay * by + ay * by),
        yz: minus_half * (ay * bz + az * by),
        zz: dot + minus_half * (az * bz + az * bz),
    }
}

/// Resistance to force of a body and its subtree: force = I motion, with the blocks `[moment coupling;
/// coupling' mass]` (Featherstone section 7.1). Its mass depends on the direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Articulated<R: Real = f64> {
    /// Moment by angular motion, kg m^2.
    pub moment: Symmetric<R>,
    /// Moment by linear motion, kg m.
    pub coupling: R::Matrix,
    /// Force by linear motion, kg.
    pub mass: Symmetric<R>,
}

impl<R: Real> Articulated<R> {
    /// Creates the inertia of a body without children.
    #[inline(always)]
    pub fn of(rigid: &Rigid<R>) -> Self {
        let f = rigid.first_moment;
        let [x, y, z] = f.parts();
        let zero = x.splat(0.0);
        Self {
            moment: rigid.moment,
            coupling: R::Matrix::of([
                R::Vector::of([zero, z, -y]),
                R::Vector::of([-z, zero, x]),
                R::Vector::of([y, -x, zero]),
            ]),
            mass: Symmetric::scalar(rigid.mass),
        }
    }

    /// Returns I motion.
    #[inline(always)]
    pub fn times(&self, motion: Spatial<R>) -> Spatial<R> {
        Spatial {
            angular: self.moment.times(motion.angular) + self.coupling.times(motion.linear),
            linear: self.coupling.transposed_times(motion.angular) + self.mass.times(motion.linear),
        }
    }

    /// Returns the force of turning about `axis`: U of a revolute joint.
    #[inline(always)]
    pub fn times_turn(&self, axis: R::Vector) -> Spatial<R> {
        Spatial { angular: self.moment.times(axis), linear: self.coupling.transposed_times(axis) }
    }

    /// Returns the force of sliding along `axis`: U of a prismatic joint.
    #[inline(always)]
    pub fn times_slide(&self, axis: R::Vector) -> Spatial<R> {
        Spatial { angular: self.coupling.times(axis), linear: self.mass.times(axis) }
    }

    /// Returns `self - u u' / d`, the remainder once one direction is free (eq. 7.44).
    #[inline(always)]
    pub fn without(&self, u: Spatial<R>, inverse_d: R) -> Self {
        let [x, y, z] = (u.linear * inverse_d).parts();
        let outer = R::Matrix::of([u.angular * x, u.angular * y, u.angular * z]);
        Self {
            moment: self.moment.without(u.angular, inverse_d),
            coupling: self.coupling - outer,
            mass: self.mass.without(u.linear, inverse_d),
        }
    }

    /// Returns it about a point from which this origin is `o` away: X' I X for a shift.
    ///
    /// With o~ the cross product matrix: coupling + o~ mass, and moment - (coupling + o~ mass) o~ + o~
    /// coupling'. Only its upper triangle is written out.
    #[inline(always)]
    pub fn shifted(&self, o: R::Vector) -> Self {
        let Self { moment, coupling, mass } = *self;
        let [x, y, z] = mass.matrix().columns();
        let shifted = coupling + R::Matrix::of([o.cross(x), o.cross(y), o.cross(z)]);
        let ([x, y, z], s, c) = (o.parts(), shifted.columns(), coupling.columns());
        let (s, c) = ([s[0].parts(), s[1].parts(), s[2].parts()], [c[0].parts(), c[1].parts(), c[2].parts()]);
        // Row i of -s o~ is o x (row i of s); column j of o~ c' is o x (row j of c).
        let moved = Symmetric {
            xx: (y * s[2][0] - z * s[1][0]) + (y * c[2][0] - z * c[1][0]),
            xy: (z * s[0][0] - x * s[2][0]) + (y * c[2][1] - z * c[1][1]),
            xz: (x * s[1][0] - y * s[0][0]) + (y * c[2][2] - z * c[1][2]),
            yy: (z * s[0][1] - x * s[2][1]) + (z * c[0][1] - x * c[2][1]),
            yz: (x * s[1][1] - y * s[0][1]) + (z * c[0][2] - x * c[2][2]),
            zz: (x * s[1][2] - y * s[0][2]) + (x * c[1][2] - y * c[0][2]),
        };
        Self { moment: moment + moved, coupling: shifted, mass }
    }
}

impl<R: Real> AddAssign for Articulated<R> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.moment += other.moment;
        self.coupling = self.coupling + other.coupling;
        self.mass += other.mass;
    }
}

#[cfg(test)]
mod tests {
    use glamx::DQuat;

    use super::*;

    fn body() -> Rigid {
        let moment = DMat3::from_cols(
            DVec3::new(0.4, 0.01, -0.02),
            DVec3::new(0.01, 0.3, 0.03),
            DVec3::new(-0.02, 0.03, 0.2),
        );
        Rigid::new(2.0, DVec3::new(0.1, 0.2, -0.3), &moment)
    }

    fn motion() -> Spatial {
        Spatial::new(DVec3::new(1.0, -2.0, 0.5), DVec3::new(0.2, 0.4, -0.6))
    }

    fn close(a: Spatial, b: Spatial) -> bool {
        (a.angular - b.angular).length() + (a.linear - b.linear).length() < 1e-12
    }

    #[test]
    fn a_rigid_inertia_and_its_articulated_form_give_the_same_force() {
        assert!(close(body().times(motion()), Articulated::of(&body()).times(motion())));
    }

    /// X' I X m, as a shifted inertia and as three shifts of vectors; not only for a rigid body.
    #[test]
    fn an_inertia_shifts_as_its_forces_do() {
        let reach = DVec3::new(0.3, -0.2, 0.5);
        let stepwise = |force: Spatial| force.force_from(reach);
        assert!(close(
            body().shifted(reach).times(motion()),
            stepwise(body().times(motion().motion_at(reach)))
        ));
        let whole = Articulated::of(&body());
        let u = whole.times_turn(DVec3::Z);
        let left = whole.without(u, 1.0 / u.angular.z);
        assert!(close(left.shifted(reach).times(motion()), stepwise(left.times(motion().motion_at(reach)))));
    }

    #[test]
    fn an_inertia_turns_as_its_forces_do() {
        let r = DMat3::from_quat(DQuat::from_rotation_z(0.7) * DQuat::from_rotation_x(-1.1));
        let turn = |s: Spatial, r: &DMat3| Spatial::new(*r * s.angular, *r * s.linear);
        let stepwise = turn(body().times(turn(motion(), &r.transpose())), &r);
        assert!(close(body().turned(&r).times(motion()), stepwise));
    }

    /// (I - U U'/D) S = 0 for U = I S, D = S' U.
    #[test]
    fn a_free_direction_has_no_inertia_left() {
        let whole = Articulated::of(&body());
        let axis = DVec3::new(0.6, 0.0, 0.8);
        let turn = Spatial::new(axis, DVec3::ZERO);
        let u = whole.times_turn(axis);
        assert!(close(whole.without(u, 1.0 / turn.dot(u)).times(turn), Spatial::ZERO));
        let slide = Spatial::new(DVec3::ZERO, axis);
        let u = whole.times_slide(axis);
        assert!(close(whole.without(u, 1.0 / slide.dot(u)).times(slide), Spatial::ZERO));
    }
}

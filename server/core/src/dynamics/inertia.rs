//! Spatial inertias: of a rigid body, and of all that hangs on a joint.

use std::ops::AddAssign;

use glamx::{DMat3, DVec3};

use super::spatial::Spatial;
use super::symmetric::Symmetric;

/// A rigid body's, about the origin of a frame (Featherstone eq. 2.63).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rigid {
    /// kg.
    pub mass: f64,
    /// Mass times the centre of mass, kg m.
    pub first_moment: DVec3,
    /// About the origin, kg m^2.
    pub moment: Symmetric,
}

impl Rigid {
    /// From mass, centre of mass, and moment about that centre.
    pub fn new(mass: f64, center: DVec3, moment_about_center: &DMat3) -> Self {
        let parallel_axis = around(center, center * mass);
        Self { mass, first_moment: center * mass, moment: Symmetric::of(moment_about_center) + parallel_axis }
    }

    /// In axes that `r` turns these into.
    #[inline(always)]
    pub fn turned(&self, r: &DMat3) -> Self {
        Self { mass: self.mass, first_moment: *r * self.first_moment, moment: self.moment.turned(r) }
    }

    /// About a point from which this origin is `reach` away.
    pub fn shifted(&self, reach: DVec3) -> Self {
        let Self { mass, first_moment, moment } = *self;
        let moved = around(reach, first_moment) + around(first_moment, reach) + around(reach, reach * mass);
        Self { mass, first_moment: first_moment + reach * mass, moment: moment + moved }
    }

    /// Momentum, one per degree of freedom, or force by acceleration.
    #[inline(always)]
    pub fn times(&self, motion: Spatial) -> Spatial {
        let Spatial { angular, linear } = motion;
        Spatial {
            angular: self.moment.times(angular) + self.first_moment.cross(linear),
            linear: linear * self.mass - self.first_moment.cross(angular),
        }
    }
}

impl AddAssign for Rigid {
    fn add_assign(&mut self, other: Self) {
        self.mass += other.mass;
        self.first_moment += other.first_moment;
        self.moment += other.moment;
    }
}

/// The symmetric part of -a~ b~ = (a . b) 1 - b a': a point mass' moment where b is m a.
pub(super) fn around(a: DVec3, b: DVec3) -> Symmetric {
    let product = |i: usize, j: usize| -0.5 * (a[i] * b[j] + a[j] * b[i]);
    let dot = a.dot(b);
    Symmetric {
        xx: dot + product(0, 0),
        xy: product(0, 1),
        xz: product(0, 2),
        yy: dot + product(1, 1),
        yz: product(1, 2),
        zz: dot + product(2, 2),
    }
}

/// What a body and all that hangs on it resist a force with: force = I motion, with the
/// blocks `[moment coupling; coupling' mass]` (Featherstone section 7.1). Its mass
/// depends on the direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Articulated {
    /// Moment by angular motion, kg m^2.
    pub moment: Symmetric,
    /// Moment by linear motion, kg m.
    pub coupling: DMat3,
    /// Force by linear motion, kg.
    pub mass: Symmetric,
}

impl Articulated {
    /// Of a body on which nothing hangs.
    #[inline(always)]
    pub fn of(rigid: &Rigid) -> Self {
        let f = rigid.first_moment;
        Self {
            moment: rigid.moment,
            coupling: DMat3::from_cols(
                DVec3::new(0.0, f.z, -f.y),
                DVec3::new(-f.z, 0.0, f.x),
                DVec3::new(f.y, -f.x, 0.0),
            ),
            mass: Symmetric::scalar(rigid.mass),
        }
    }

    /// The force of a motion.
    #[inline(always)]
    pub fn times(&self, motion: Spatial) -> Spatial {
        Spatial {
            angular: self.moment.times(motion.angular) + self.coupling * motion.linear,
            linear: transposed_times(&self.coupling, motion.angular) + self.mass.times(motion.linear),
        }
    }

    /// The force of turning about `axis`: U of a revolute joint.
    #[inline(always)]
    pub fn times_turn(&self, axis: DVec3) -> Spatial {
        Spatial { angular: self.moment.times(axis), linear: transposed_times(&self.coupling, axis) }
    }

    /// The force of sliding along `axis`: U of a prismatic joint.
    #[inline(always)]
    pub fn times_slide(&self, axis: DVec3) -> Spatial {
        Spatial { angular: self.coupling * axis, linear: self.mass.times(axis) }
    }

    /// `self - u u' / d`: what is left once one direction is free (eq. 7.44).
    #[inline(always)]
    pub fn without(&self, u: Spatial, inverse_d: f64) -> Self {
        let scaled = u.linear * inverse_d;
        let outer = DMat3::from_cols(u.angular * scaled.x, u.angular * scaled.y, u.angular * scaled.z);
        Self {
            moment: self.moment.without(u.angular, inverse_d),
            coupling: self.coupling - outer,
            mass: self.mass.without(u.linear, inverse_d),
        }
    }

    /// About a point from which this origin is `o` away: X' I X for a shift.
    ///
    /// With o~ the cross product matrix: coupling + o~ mass, and
    /// moment - (coupling + o~ mass) o~ + o~ coupling', of which the upper triangle is
    /// written out.
    #[inline(always)]
    pub fn shifted(&self, o: DVec3) -> Self {
        let Self { moment, coupling: c, mass } = self;
        let columns = mass.matrix();
        let s = DMat3::from_cols(
            c.x_axis + o.cross(columns.x_axis),
            c.y_axis + o.cross(columns.y_axis),
            c.z_axis + o.cross(columns.z_axis),
        );
        // Row i of -s o~ is o x (row i of s); column j of o~ c' is o x (row j of c).
        let moved = Symmetric {
            xx: (o.y * s.z_axis.x - o.z * s.y_axis.x) + (o.y * c.z_axis.x - o.z * c.y_axis.x),
            xy: (o.z * s.x_axis.x - o.x * s.z_axis.x) + (o.y * c.z_axis.y - o.z * c.y_axis.y),
            xz: (o.x * s.y_axis.x - o.y * s.x_axis.x) + (o.y * c.z_axis.z - o.z * c.y_axis.z),
            yy: (o.z * s.x_axis.y - o.x * s.z_axis.y) + (o.z * c.x_axis.y - o.x * c.z_axis.y),
            yz: (o.x * s.y_axis.y - o.y * s.x_axis.y) + (o.z * c.x_axis.z - o.x * c.z_axis.z),
            zz: (o.x * s.y_axis.z - o.y * s.x_axis.z) + (o.x * c.y_axis.z - o.y * c.x_axis.z),
        };
        Self { moment: *moment + moved, coupling: s, mass: *mass }
    }
}

impl AddAssign for Articulated {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.moment += other.moment;
        self.coupling += other.coupling;
        self.mass += other.mass;
    }
}

/// `m' v` without building the transpose.
#[inline(always)]
fn transposed_times(m: &DMat3, v: DVec3) -> DVec3 {
    DVec3::new(m.x_axis.dot(v), m.y_axis.dot(v), m.z_axis.dot(v))
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

    /// X' I X m, as a shifted inertia and as three shifts of vectors; not only of a rigid one.
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

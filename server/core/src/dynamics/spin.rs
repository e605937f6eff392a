//! A single free body between kicks: its rotation keeps energy and angular momentum exactly, at any speed.

use glamx::{DMat3, DQuat, DVec3};

use super::inertia::Rigid;
use super::symmetric::Symmetric;

/// A body that turns by more than this within a step, radians, is turned in several parts.
const PART_TURN: f64 = 0.5;

/// So many at the most.
const MAX_PARTS: f64 = 64.0;

/// Newton iterations at the most; two or three are the rule, and none for a body that hardly turns.
const MAX_ITERATIONS: usize = 20;

/// A solution is one if it is off by no more than this part of what the body's spin would be about its largest moment.
const SOLVED: f64 = 1e-12;

/// An axis with less than this part of the mean moment counts as one that has so much.
const LEAST_MOMENT: f64 = 1e-6;

/// What the rotation of a single rigid body needs.
#[derive(Clone, Debug)]
pub struct FreeBody {
    /// kg.
    mass: f64,
    /// The centre of mass, in the body's frame.
    center: DVec3,
    /// Moment of inertia about the centre of mass, body axes.
    moment: DMat3,
    /// Its inverse.
    inverse_moment: DMat3,
    /// What a torque is taken by before it acts, where some axis has no moment of its own.
    taken: Option<DMat3>,
}

/// How a body moves: its centre of mass in the parent's axes, and I w about it in its own.
#[derive(Clone, Copy, Debug, Default)]
pub struct Momentum {
    /// m/s.
    pub center_velocity: DVec3,
    /// kg m^2/s.
    pub angular: DVec3,
}

/// The velocities of a free body as a step has them: of its origin in the parent's axes, and its own angular ones.
#[derive(Clone, Copy, Debug, Default)]
pub struct Twist {
    /// m/s.
    pub linear: DVec3,
    /// rad/s.
    pub angular: DVec3,
}

/// How a body goes through a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Drift {
    /// `world_from_body` at its begin.
    pub rotation: DQuat,
    /// After the kick.
    pub before: Momentum,
    /// What moves it.
    pub twist: Twist,
    /// At the end.
    pub after: Momentum,
}

impl FreeBody {
    /// `None` for one without mass or without any moment.
    pub fn new(rigid: &Rigid) -> Option<Self> {
        let center = rigid.first_moment / rigid.mass;
        let about_origin = Rigid::new(rigid.mass, center, &DMat3::ZERO).moment.matrix();
        let given = rigid.moment.matrix() - about_origin;
        let mean = (given.x_axis.x + given.y_axis.y + given.z_axis.z) / 3.0;
        let can_turn = rigid.mass > 0.0 && mean > 0.0;
        if !can_turn {
            return None;
        }
        // A rod without a moment about its own axis keeps its spin, and no torque about that axis changes it.
        let is_thin = given.determinant() < LEAST_MOMENT * mean * mean * mean;
        let least = if is_thin { LEAST_MOMENT * mean } else { 0.0 };
        let moment = given + DMat3::from_diagonal(DVec3::splat(least));
        let inverse_moment = Symmetric::of(&moment.inverse()).matrix();
        let taken = is_thin.then(|| given * inverse_moment);
        inverse_moment.is_finite().then_some(Self { mass: rigid.mass, center, moment, inverse_moment, taken })
    }

    /// The centre of mass, and the moment of inertia about it; body axes.
    pub fn about_own_center(&self) -> (DVec3, Symmetric) {
        (self.center, Symmetric::of(&self.moment))
    }

    /// From the velocities at a moment.
    pub fn momentum(&self, world_from_body: DQuat, twist: Twist) -> Momentum {
        let arm = twist.angular.cross(self.center);
        Momentum {
            center_velocity: twist.linear + world_from_body * arm,
            angular: self.moment * twist.angular,
        }
    }

    /// The velocities at a moment.
    pub fn twist(&self, world_from_body: DQuat, momentum: Momentum) -> Twist {
        let angular = self.inverse_moment * momentum.angular;
        let arm = angular.cross(self.center);
        Twist { linear: momentum.center_velocity - world_from_body * arm, angular }
    }

    /// Momentum after a torque about the centre of mass, body axes, and a force, world axes, have acted for
    /// `h` seconds; `acceleration` is gravity's.
    pub fn kick(
        &self,
        momentum: Momentum,
        torque: DVec3,
        force: DVec3,
        acceleration: DVec3,
        h: f64,
    ) -> Momentum {
        let torque = self.taken.map_or(torque, |taken| taken * torque);
        Momentum {
            center_velocity: momentum.center_velocity + (acceleration + force / self.mass) * h,
            angular: momentum.angular + torque * h,
        }
    }

    /// The torque about the centre of mass of one about the origin.
    pub fn about_center(&self, torque: DVec3, force: DVec3) -> DVec3 {
        torque - self.center.cross(force)
    }

    /// Momentum after an impulse that changes the velocities by this.
    pub fn push(&self, world_from_body: DQuat, momentum: Momentum, change: Twist) -> Momentum {
        let change = self.momentum(world_from_body, change);
        Momentum {
            center_velocity: momentum.center_velocity + change.center_velocity,
            angular: momentum.angular + change.angular,
        }
    }

    /// How a body without forces goes through a step of `h` from this rotation: the velocities that move it, constant
    /// ones with which positions are integrated, and its momentum after the step. Its centre of mass goes straight on.
    ///
    /// With m = I w the angular momentum in body axes before the step, m+ after it, and u the velocity in between:
    ///
    /// ```text
    /// I u = (m + m+) / 2,   m+ = exp(-h u) m,   R+ = R exp(h u)
    /// ```
    ///
    /// (Simo and Wong, "Unconditionally stable algorithms for rigid body dynamics that exactly preserve energy and
    /// momentum" (1991), with the angle of the turn exact.) R m is kept by the second and third equation. Energy is:
    /// m+ - m is perpendicular to u = I^-1 (m + m+) / 2, and their product is the change of m' I^-1 m / 2. Both
    /// hold for any h; the direction is of second order. Solved for u: I u + s u x I u = m with
    /// s = tan(h |u| / 2) / |u|, by Newton's method.
    pub fn drift(&self, world_from_body: DQuat, before: Momentum, h: f64) -> Drift {
        let Momentum { center_velocity, angular: mut m } = before;
        let spin = self.inverse_moment * m;
        let parts = (spin.length() * h / PART_TURN).ceil().clamp(1.0, MAX_PARTS);
        let angular = if parts > 1.0 {
            let part = h / parts;
            let mut turned = DQuat::IDENTITY;
            let mut left = parts;
            while left > 0.0 {
                let u = self.solve(&mut m, part);
                turned *= turn(u, part);
                left -= 1.0;
            }
            turned.normalize().to_scaled_axis() / h
        } else {
            self.solve(&mut m, h)
        };
        let swing = (turn(angular, h) * self.center - self.center) / h;
        let linear = center_velocity - world_from_body * swing;
        let rotation = world_from_body;
        Drift {
            rotation,
            before,
            twist: Twist { linear, angular },
            after: Momentum { center_velocity, angular: m },
        }
    }

    /// The velocity u of a part, which takes the momentum to its end.
    fn solve(&self, m: &mut DVec3, h: f64) -> DVec3 {
        let goal = *m;
        let miss = |u: DVec3| {
            let along = self.moment * u;
            along + u.cross(along) * half_turn(u, h) - goal
        };
        let size = goal.length();
        let mut u = self.inverse_moment * goal;
        let mut off = miss(u);
        for _ in 0..MAX_ITERATIONS {
            if off.length() <= 2.0 * f64::EPSILON * size {
                break;
            }
            // Half of the way, and half of that, until it is nearer: the own axis of a rod is hard to find.
            let change = self.slope(u, h).inverse() * off;
            let ways = [1.0, 0.5, 0.25, 0.125, 1.0 / 16.0, 1.0 / 64.0, 1.0 / 256.0];
            let nexts = ways.into_iter().map(|part| u - change * part).map(|next| (next, miss(next)));
            let Some(next) = nexts.into_iter().find(|next| next.1.length() < off.length()) else { break };
            (u, off) = next;
        }
        let moment = &self.moment;
        let trace = moment.x_axis.x + moment.y_axis.y + moment.z_axis.z;
        if off.length() > SOLVED * trace * u.length() {
            // It turns as if its inertia were alike in all directions: no energy is gained so.
            return self.inverse_moment * goal;
        }
        *m = turn(-u, h) * goal;
        u
    }

    /// The derivative of I u + s u x I u by u.
    fn slope(&self, u: DVec3, h: f64) -> DMat3 {
        let along = self.moment * u;
        let s = half_turn(u, h);
        let gyro = u.cross(along);
        let [x, y, z] =
            [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis.cross(along) + u.cross(self.moment * axis));
        let size_squared = u.length_squared();
        // ds/du = u (h/2 (1 + s^2 |u|^2) - s) / |u|^2.
        let stretch = if size_squared * h * h > SMALL {
            u * ((0.5 * h * (1.0 + s * s * size_squared) - s) / size_squared)
        } else {
            DVec3::ZERO
        };
        let gyro_columns = DMat3::from_cols(x, y, z) * s;
        let outer = DMat3::from_cols(gyro * stretch.x, gyro * stretch.y, gyro * stretch.z);
        self.moment + gyro_columns + outer
    }
}

/// s = tan(h |u| / 2) / |u|.
fn half_turn(u: DVec3, h: f64) -> f64 {
    let square = u.length_squared() * h * h;
    let factor = if square < SMALL {
        1.0 + square * (1.0 / 12.0 + square / 120.0)
    } else {
        let half = 0.5 * square.sqrt();
        half.tan() / half
    };
    0.5 * h * factor
}

/// The square of a turn below which its tangent is a series, with an error below rounding.
const SMALL: f64 = 1e-5;

/// The turn by h times an angular velocity.
fn turn(angular: DVec3, h: f64) -> DQuat {
    DQuat::from_scaled_axis(angular * h)
}

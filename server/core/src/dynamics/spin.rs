//! Rotation of a single free body between kicks, which keeps energy and angular momentum exactly at any
//! speed.

use glamx::{DMat3, DQuat, DVec3};

use super::inertia::Rigid;
use super::symmetric::Symmetric;

/// Largest turn of a body in one part of a step, radians; larger turns are divided into parts.
const PART_TURN: f64 = 0.5;

/// Maximum number of parts.
const MAX_PARTS: f64 = 64.0;

/// Maximum number of Newton iterations. Two or three are usual; a body that hardly turns needs none.
const MAX_ITERATIONS: usize = 20;

/// Tolerance of a solution, as a part of the angular momentum of the same spin about the largest moment.
const SOLVED: f64 = 1e-12;

/// Smallest moment of an axis, as a part of the mean moment; smaller ones are raised to it.
const LEAST_MOMENT: f64 = 1e-6;

/// Inertia for the rotation of a single rigid body.
#[derive(Clone, Debug)]
pub struct FreeBody {
    /// Mass, kg.
    mass: f64,
    /// Centre of mass, in the body's frame, metres.
    center: DVec3,
    /// Moment of inertia about the centre of mass, body axes, kg m^2.
    moment: DMat3,
    /// Inverse of `moment`.
    inverse_moment: DMat3,
    /// Matrix that a torque is multiplied by before it acts, if some axis has no moment.
    taken: Option<DMat3>,
}

/// Motion of a body: velocity of its centre of mass in the parent's axes, and I w about it in its own.
#[derive(Clone, Copy, Debug, Default)]
pub struct Momentum {
    /// Velocity of the centre of mass, m/s.
    pub center_velocity: DVec3,
    /// Angular momentum, kg m^2/s.
    pub angular: DVec3,
}

/// Velocities of a free body in a step: of its origin in the parent's axes, and angular in its own.
#[derive(Clone, Copy, Debug, Default)]
pub struct Twist {
    /// Velocity of the origin, m/s.
    pub linear: DVec3,
    /// Angular velocity, rad/s.
    pub angular: DVec3,
}

/// Motion of a body through a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Drift {
    /// `world_from_body` at the start of the step.
    pub rotation: DQuat,
    /// Momentum after the kick.
    pub before: Momentum,
    /// Velocities that integrate its position.
    pub twist: Twist,
    /// Momentum at the end.
    pub after: Momentum,
}

impl FreeBody {
    /// Returns `None` for a body without mass or without any moment.
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

    /// Returns the centre of mass, and the moment of inertia about it; body axes.
    pub fn about_own_center(&self) -> (DVec3, Symmetric) {
        (self.center, Symmetric::of(&self.moment))
    }

    /// Returns the momentum of velocities.
    pub fn momentum(&self, world_from_body: DQuat, twist: Twist) -> Momentum {
        let arm = twist.angular.cross(self.center);
        Momentum {
            center_velocity: twist.linear + world_from_body * arm,
            angular: self.moment * twist.angular,
        }
    }

    /// Returns the velocities of a momentum.
    pub fn twist(&self, world_from_body: DQuat, momentum: Momentum) -> Twist {
        let angular = self.inverse_moment * momentum.angular;
        let arm = angular.cross(self.center);
        Twist { linear: momentum.center_velocity - world_from_body * arm, angular }
    }

    /// Returns the momentum after `h` seconds of a torque about the centre of mass, body axes, and a force,
    /// world axes. `acceleration` is gravity's.
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

    /// Converts a torque about the origin to one about the centre of mass.
    pub fn about_center(&self, torque: DVec3, force: DVec3) -> DVec3 {
        torque - self.center.cross(force)
    }

    /// Returns the momentum after an impulse that changes the velocities by `change`.
    pub fn push(&self, world_from_body: DQuat, momentum: Momentum, change: Twist) -> Momentum {
        let change = self.momentum(world_from_body, change);
        Momentum {
            center_velocity: momentum.center_velocity + change.center_velocity,
            angular: momentum.angular + change.angular,
        }
    }

    /// Returns the motion of a body without forces through a step of `h` from this rotation. It has the
    /// constant velocities that integrate the position, and the momentum after the step. Its centre of mass
    /// moves in a straight line.
    ///
    /// With m = I w the angular momentum in body axes before the step, m+ after it, and u the velocity in
    /// between:
    ///
    /// ```text
    /// I u = (m + m+) / 2,   m+ = exp(-h u) m,   R+ = R exp(h u)
    /// ```
    ///
    /// (Simo and Wong, "Unconditionally stable algorithms for rigid body dynamics that exactly preserve
    /// energy and momentum" (1991), with the exact angle of the turn.) The second and third equation conserve
    /// R m. Energy is conserved because m+ - m is perpendicular to u = I^-1 (m + m+) / 2, and their product
    /// is the change of m' I^-1 m / 2. Both hold for any h; the direction is of second order. Solved for u: I
    /// u + s u x I u = m with s = tan(h |u| / 2) / |u|, by Newton's method.
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

    /// Returns the velocity u of a part, and advances the momentum to its end.
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
            // Half of the step, and half of that, until the error shrinks: the axis of a rod is hard to find.
            let change = self.slope(u, h).inverse() * off;
            let ways = [1.0, 0.5, 0.25, 0.125, 1.0 / 16.0, 1.0 / 64.0, 1.0 / 256.0];
            let nexts = ways.into_iter().map(|part| u - change * part).map(|next| (next, miss(next)));
            let Some(next) = nexts.into_iter().find(|next| next.1.length() < off.length()) else { break };
            (u, off) = next;
        }
        let moment = &self.moment;
        let trace = moment.x_axis.x + moment.y_axis.y + moment.z_axis.z;
        if off.length() > SOLVED * trace * u.length() {
            // It turns as if its inertia were the same in all directions, which adds no energy.
            return self.inverse_moment * goal;
        }
        *m = turn(-u, h) * goal;
        u
    }

    /// Returns the derivative of I u + s u x I u by u.
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

/// Returns s = tan(h |u| / 2) / |u|.
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

/// Square of the turn below which its tangent is computed as a series, with an error below rounding.
const SMALL: f64 = 1e-5;

/// Returns the rotation by h times an angular velocity.
fn turn(angular: DVec3, h: f64) -> DQuat {
    DQuat::from_scaled_axis(angular * h)
}

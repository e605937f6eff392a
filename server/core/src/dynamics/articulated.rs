//! Second and third pass: the articulated-body algorithm, with actuators and
//! damping implicit in each joint's own entry.

use glamx::{DMat3, DQuat, DVec3};

use super::actuator::{Axis, Drive};
use super::inertia::Articulated;
use super::kinematics::free_pose;
use super::six::SixByFactors;
use super::spatial::{Placement, Spatial};
use super::tree::{Freedom, Tree};
use super::work::Workspace;

/// An axis whose D is below this part of its body's largest inertia has none of
/// its own: what is left is rounding, and dividing by it would be noise.
const SINGULAR: f64 = 1e-13;

/// Second pass, leaves to root: IA, pA, U, D and u of each body (Featherstone
/// table 7.1, second loop, eq. 7.43 to 7.47).
///
/// D = S'U + armature + h (kd + damping) + h^2 kp makes spring and damper act at
/// the end of the step: (M + h K_d + h^2 K_p) qdd = ... , joint by joint.
pub fn gather_inertia(
    tree: &Tree,
    axes: &[Axis],
    drives: &[Drive],
    external: &[Spatial],
    (q, qd): (&[f64], &[f64]),
    h: f64,
    work: &mut Workspace,
) {
    for ((body, at), push) in tree.bodies.iter().zip(&mut work.bodies).zip(external) {
        let inertia = body.inertia.turned(&at.rotation);
        at.articulated = Articulated::of(&inertia);
        at.bias = at.velocity.cross_force(inertia.times(at.velocity));
        if *push != Spatial::ZERO {
            at.bias -= Spatial::new(at.rotation * push.angular, at.rotation * push.linear);
        }
    }
    for (i, body) in tree.bodies.iter().enumerate().rev() {
        let at = &mut work.bodies[i];
        let z = at.rotation.z_axis;
        let (column, largest) = match body.freedom {
            Freedom::Revolute => (at.articulated.times_turn(z), at.articulated.moment.largest()),
            Freedom::Prismatic => (at.articulated.times_slide(z), at.articulated.mass.largest()),
            Freedom::Free { slot } => {
                // D is the whole of IA: nothing of it reaches the parent.
                work.free[slot] = SixByFactors::new(&at.articulated);
                continue;
            }
        };
        let own = along(body.freedom, column, z);
        let (axis, drive) = (&axes[body.velocity], &drives[body.velocity]);
        let (position, rate) = (q[body.position], qd[body.velocity]);
        let damping = axis.settings.damping;
        let d = own + axis.settings.resistance(h) + drive.resistance(h);
        let effort = drive.saturated.unwrap_or_else(|| drive.law(position, rate, h)) - damping * rate;
        at.column = column;
        at.inverse_d = if d > largest * SINGULAR { 1.0 / d } else { 0.0 };
        at.drive = effort - along(body.freedom, at.bias, z);
        let Some(parent) = body.parent else { continue };
        let left = at.articulated.without(column, at.inverse_d);
        let bias = at.bias + left.times(at.velocity_product) + column * (at.inverse_d * at.drive);
        let (left, bias) = (left.shifted(at.reach), bias.force_from(at.reach));
        let above = &mut work.bodies[parent];
        above.articulated += left;
        above.bias += bias;
    }
}

/// Third pass, root to leaves: accelerations, and from them the new rates
/// (Featherstone table 7.1, third loop, eq. 7.48).
///
/// `base_acceleration` is minus gravity in the base's axes, which is how gravity
/// comes in. Semi-implicit Euler: `rates` = qd + h qdd.
pub fn accelerate(
    tree: &Tree,
    base_acceleration: DVec3,
    (q, qd): (&[f64], &[f64]),
    h: f64,
    work: &mut Workspace,
    rates: &mut [f64],
) {
    let base = Spatial::new(DVec3::ZERO, base_acceleration);
    for (i, body) in tree.bodies.iter().enumerate() {
        let above = body.parent.map_or(base, |parent| work.bodies[parent].acceleration);
        let at = &mut work.bodies[i];
        let carried = above.motion_at(at.reach) + at.velocity_product;
        let first = body.velocity;
        match body.freedom {
            Freedom::Revolute | Freedom::Prismatic => {
                let qdd = at.inverse_d * (at.drive - at.column.dot(carried));
                at.acceleration = carried;
                *part_mut(body.freedom, &mut at.acceleration) += at.rotation.z_axis * qdd;
                rates[first] = qd[first] + h * qdd;
            }
            Freedom::Free { slot } => {
                at.acceleration = work.free[slot].solve(-at.bias);
                let (linear_qdd, angular_qdd) =
                    free_rates(at.acceleration - carried, &at.rotation, free_pose(&q[body.position..]).1);
                let rate = &qd[first..];
                let angular = DVec3::new(rate[3], rate[4], rate[5]);
                let linear = DVec3::new(rate[0], rate[1], rate[2]);
                // The linear rate is kept in the parent's axes, which do not turn with the
                // body: d/dt (R v) = R (a + w x v).
                let (_, rotation) = free_pose(&q[body.position..]);
                let linear_qdd = linear_qdd + (rotation * angular).cross(linear);
                write_free(&mut rates[first..], linear + linear_qdd * h, angular + angular_qdd * h);
            }
        }
    }
}

/// Writes the six rates of a free body.
pub fn write_free(rates: &mut [f64], linear: DVec3, angular: DVec3) {
    rates[..3].copy_from_slice(&linear.to_array());
    rates[3..6].copy_from_slice(&angular.to_array());
}

/// A free body's motion relative to its parent, from the base's axes to those that its
/// rates are kept in: linear in the parent's, angular in its own.
#[inline]
pub fn free_rates(motion: Spatial, base_from_body: &DMat3, parent_from_body: DQuat) -> (DVec3, DVec3) {
    let own_from_base = base_from_body.transpose();
    (parent_from_body * (own_from_base * motion.linear), own_from_base * motion.angular)
}

/// S' f for an axis along `z`.
#[inline]
pub fn along(freedom: Freedom, force: Spatial, z: DVec3) -> f64 {
    match freedom {
        Freedom::Prismatic => force.linear.dot(z),
        _ => force.angular.dot(z),
    }
}

/// The part of a motion that S qd adds to.
#[inline]
pub fn part_mut(freedom: Freedom, motion: &mut Spatial) -> &mut DVec3 {
    match freedom {
        Freedom::Prismatic => &mut motion.linear,
        _ => &mut motion.angular,
    }
}

/// Minus gravity in the base's axes.
pub fn base_acceleration(world_from_base: &Placement, gravity: DVec3) -> DVec3 {
    world_from_base.rotation.transpose() * -gravity
}

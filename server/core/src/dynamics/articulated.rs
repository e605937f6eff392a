//! Second and third pass: the articulated-body algorithm, with actuators and
//! damping implicit in each joint's own entry.

use glamx::DVec3;

use super::actuator::{Axis, Drive};
use super::kinematics::free_pose;
use super::six::SixByFactors;
use super::spatial::{Inertia, Placement, Spatial};
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
        at.articulated = body.inertia;
        at.bias = at.velocity.cross_force(body.inertia.times(at.velocity)) - *push;
    }
    for (i, body) in tree.bodies.iter().enumerate().rev() {
        let at = &mut work.bodies[i];
        let (column, own, scale) = match body.freedom {
            Freedom::Revolute => turning(&at.articulated),
            Freedom::Prismatic => sliding(&at.articulated),
            Freedom::Free { slot } => {
                // D is the whole of IA: nothing of it reaches the parent.
                work.free[slot] = SixByFactors::new(&at.articulated);
                continue;
            }
        };
        let (axis, drive) = (&axes[body.velocity], &drives[body.velocity]);
        let (position, rate) = (q[body.position], qd[body.velocity]);
        let damping = axis.settings.damping;
        let d = own + axis.settings.resistance(h) + drive.resistance(h);
        let effort = drive.saturated.unwrap_or_else(|| drive.law(position, rate, h)) - damping * rate;
        at.column = column;
        at.inverse_d = if d > scale * SINGULAR { 1.0 / d } else { 0.0 };
        at.drive = effort - along(body.freedom, at.bias);
        let Some(parent) = body.parent else { continue };
        let left = at.articulated.without(column, at.inverse_d);
        let bias = at.bias + left.times(at.velocity_product) + column * (at.inverse_d * at.drive);
        let (left, bias) =
            (at.parent_from_body.inertia_to_parent(&left), at.parent_from_body.force_to_parent(bias));
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
        let carried = at.parent_from_body.motion_to_child(above) + at.velocity_product;
        let first = body.velocity;
        match body.freedom {
            Freedom::Revolute | Freedom::Prismatic => {
                let qdd = at.inverse_d * (at.drive - at.column.dot(carried));
                at.acceleration = carried;
                *along_mut(body.freedom, &mut at.acceleration) += qdd;
                rates[first] = qd[first] + h * qdd;
            }
            Freedom::Free { slot } => {
                at.acceleration = work.free[slot].solve(-at.bias);
                let qdd = at.acceleration - carried;
                // The linear rate is kept in the parent's axes, which do not turn with the
                // body: d/dt (R v) = R (a + w x v).
                let (_, rotation) = free_pose(&q[body.position..]);
                let rate = &qd[first..];
                let angular = DVec3::new(rate[3], rate[4], rate[5]);
                let linear = DVec3::new(rate[0], rate[1], rate[2]);
                let linear_qdd = rotation * qdd.linear + (rotation * angular).cross(linear);
                write_free(&mut rates[first..], linear + linear_qdd * h, angular + qdd.angular * h);
            }
        }
    }
}

/// Writes the six rates of a free body.
pub fn write_free(rates: &mut [f64], linear: DVec3, angular: DVec3) {
    rates[..3].copy_from_slice(&linear.to_array());
    rates[3..6].copy_from_slice(&angular.to_array());
}

/// S' f for an axis along z.
#[inline]
pub fn along(freedom: Freedom, force: Spatial) -> f64 {
    match freedom {
        Freedom::Prismatic => force.linear.z,
        _ => force.angular.z,
    }
}

/// The entry of a motion that S qd adds to, for an axis along z.
#[inline]
pub fn along_mut(freedom: Freedom, motion: &mut Spatial) -> &mut f64 {
    match freedom {
        Freedom::Prismatic => &mut motion.linear.z,
        _ => &mut motion.angular.z,
    }
}

/// U, S'U and the largest inertia of its kind, for S a turn about z.
#[inline]
pub fn turning(inertia: &Inertia) -> (Spatial, f64, f64) {
    let (moment, coupling) = (&inertia.moment, &inertia.coupling);
    let row = DVec3::new(coupling.x_axis.z, coupling.y_axis.z, coupling.z_axis.z);
    let largest = moment.x_axis.x.max(moment.y_axis.y).max(moment.z_axis.z);
    (Spatial::new(moment.z_axis, row), moment.z_axis.z, largest)
}

/// U, S'U and the largest inertia of its kind, for S a slide along z.
#[inline]
pub fn sliding(inertia: &Inertia) -> (Spatial, f64, f64) {
    let (mass, coupling) = (&inertia.mass, &inertia.coupling);
    let largest = mass.x_axis.x.max(mass.y_axis.y).max(mass.z_axis.z);
    (Spatial::new(coupling.z_axis, mass.z_axis), mass.z_axis.z, largest)
}

/// Minus gravity in the base's axes.
pub fn base_acceleration(world_from_base: &Placement, gravity: DVec3) -> DVec3 {
    world_from_base.rotation.transpose() * -gravity
}

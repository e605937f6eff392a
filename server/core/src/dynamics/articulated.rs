//! Second and third pass: the articulated-body algorithm, with actuators and damping implicit in each joint's
//! diagonal entry.

use glamx::{DMat3, DQuat, DVec3};
use pulp::{Arch, Simd, WithSimd};

use super::actuator::{Axis, Drive};
use super::inertia::Articulated;
use super::integrator::{Implicitness, Integrator};
use super::kinematics::free_pose;
use super::ldlt::Ldlt6;
use super::real::{Real, VectorOf as _};
use super::scratch::Scratch;
use super::spatial::{Placement, Spatial};
use super::tree::{JointType, Tree};

/// Smallest D of an axis, as a part of its body's largest inertia. An axis below it has no inertia: the
/// remainder is rounding, and dividing by it would be noise.
pub(super) const SINGULAR: f64 = 1e-13;

/// Second pass, leaves to root: IA, pA, U, D and u of each body (Featherstone table 7.1, second loop, eq.
/// 7.43 to 7.47).
///
/// D = S'U + armature + h (kd + damping) + h^2 kp makes spring and damper act at the end of the step: (M + h
/// K_d + h^2 K_p) qdd = ... , joint by joint. In leapfrog each joint has its own [`Implicitness`], which
/// depends on D without spring and damper.
///
/// This pass is a third of an arm's step. It is compiled for the vectors of the processor, with all its
/// callees inlined, which makes the step 5 % faster.
pub struct InertiaPass<'a> {
    /// Structure of the robot.
    pub tree: &'a Tree,
    /// Axes, one for each velocity.
    pub axes: &'a [Axis],
    /// Actuator laws of this step, one for each velocity.
    pub drives: &'a [Drive],
    /// External forces on each body, in its own frame.
    pub external: &'a [Spatial],
    /// Positions q.
    pub positions: &'a [f64],
    /// Velocities that the step changes. Springs and dampers act on these, all other terms on those that
    /// kinematics were computed with.
    pub half_velocities: &'a [f64],
    /// Time step, seconds.
    pub h: f64,
    /// Integrator, which determines each joint's [`Implicitness`].
    pub integrator: Integrator,
    /// Results of the kinematics pass; this pass adds its own.
    pub scratch: &'a mut Scratch,
}

impl InertiaPass<'_> {
    /// Runs the pass.
    pub fn run(self) {
        Arch::new().dispatch(self);
    }
}

impl WithSimd for InertiaPass<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        gather_inertia(self);
    }
}

#[inline(always)]
fn gather_inertia(pass: InertiaPass<'_>) {
    let InertiaPass {
        tree,
        axes,
        drives,
        external,
        positions: q,
        half_velocities: half,
        h,
        integrator,
        scratch,
    } = pass;
    for ((body, at), push) in tree.bodies.iter().zip(&mut scratch.bodies).zip(external) {
        let inertia = body.inertia.turned(&at.rotation);
        at.articulated = Articulated::of(&inertia);
        at.bias = at.velocity.cross_force(inertia.times(at.velocity));
        if *push != Spatial::ZERO {
            at.bias -= Spatial::new(at.rotation * push.angular, at.rotation * push.linear);
        }
    }
    // For a ball joint, whose bodies follow each other.
    let mut largest_of_child = 0.0;
    for (i, body) in tree.bodies.iter().enumerate().rev() {
        let at = &mut scratch.bodies[i];
        let z = at.rotation.z_axis;
        let (column, largest) = match body.joint_type {
            JointType::Revolute => (at.articulated.times_turn(z), at.articulated.moment.largest()),
            JointType::Prismatic => (at.articulated.times_slide(z), at.articulated.mass.largest()),
            JointType::Spherical { axis } => {
                // The remaining inertia of the child may be nothing but rounding: compare with all of it.
                if axis == 2 {
                    largest_of_child = at.articulated.moment.largest();
                }
                (at.articulated.times_turn(z), largest_of_child)
            }
            JointType::Free { slot } => {
                // D is the whole IA, so none of it reaches the parent.
                scratch.free[slot] = Ldlt6::new(&at.articulated);
                at.implicitness = Implicitness::MEAN;
                continue;
            }
        };
        let own = along(body.joint_type, column, z);
        let (axis, drive) = (&axes[body.velocity], &drives[body.velocity]);
        let (position, velocity) = (q[body.position], half[body.velocity]);
        let settings = &axis.settings;
        // For an axis of a ball joint only its spring needs the position; target laws use differences.
        let is_sprung_ball =
            settings.spring_stiffness > 0.0 && matches!(body.joint_type, JointType::Spherical { .. });
        let of_spring = if is_sprung_ball { tree.position_of_axis(i, q) } else { position };
        let forces = settings.own_forces();
        // D = first / second.
        let resistance;
        (at.implicitness, at.of_law, resistance) =
            drive.resist(drive.saturated.is_some(), own, &forces, (integrator, h));
        let implicitness = at.implicitness;
        let law = || drive.steady_law(position, velocity, h, implicitness);
        let effort =
            drive.saturated.unwrap_or_else(law) + forces.steady_effort(of_spring, velocity, h, implicitness);
        at.column = column;
        let (first, second) = resistance;
        at.inverse_d = if first > largest * SINGULAR * second { second / first } else { 0.0 };
        at.drive = effort - along(body.joint_type, at.bias, z);
        let Some(parent) = body.parent else { continue };
        let left = at.articulated.without(column, at.inverse_d);
        let bias = at.bias + left.times(at.velocity_product) + column * (at.inverse_d * at.drive);
        let (left, bias) = (left.shifted(at.reach), bias.force_from(at.reach));
        let above = &mut scratch.bodies[parent];
        above.articulated += left;
        above.bias += bias;
    }
}

/// Positions and velocities within a step, in the order of the tree.
#[derive(Clone, Copy, Debug)]
pub struct MidStep<'a> {
    /// Positions that kinematics were computed with.
    pub q: &'a [f64],
    /// Velocities that kinematics were computed with.
    pub qd: &'a [f64],
    /// Velocities that accelerations are added to.
    pub half: &'a [f64],
}

/// Third pass, root to leaves: accelerations, and the new velocities from them (Featherstone table 7.1, third
/// loop, eq. 7.48).
///
/// `base_acceleration` is minus gravity in the base's axes, which brings gravity in. `velocities` = half + h
/// qdd, with the qd that kinematics were computed with.
pub fn accelerate(
    tree: &Tree,
    base_acceleration: DVec3,
    MidStep { q, qd, half }: MidStep<'_>,
    h: f64,
    scratch: &mut Scratch,
    velocities: &mut [f64],
) {
    let base = Spatial::new(DVec3::ZERO, base_acceleration);
    for (i, body) in tree.bodies.iter().enumerate() {
        let above = body.parent.map_or(base, |parent| scratch.bodies[parent].acceleration);
        let at = &mut scratch.bodies[i];
        let carried = above.motion_at(at.reach) + at.velocity_product;
        let first = body.velocity;
        match body.joint_type {
            JointType::Revolute | JointType::Prismatic | JointType::Spherical { .. } => {
                let qdd = at.inverse_d * (at.drive - at.column.dot(carried));
                at.acceleration = carried;
                *part_mut(body.joint_type, &mut at.acceleration) += at.rotation.z_axis * qdd;
                velocities[first] = half[first] + h * qdd;
            }
            JointType::Free { slot } => {
                at.acceleration = scratch.free[slot].solve(-at.bias);
                let (linear_qdd, angular_qdd) = free_velocities(
                    at.acceleration - carried,
                    &at.rotation,
                    free_pose(&q[body.position..]).1,
                );
                let velocity = &qd[first..];
                let angular = DVec3::new(velocity[3], velocity[4], velocity[5]);
                let linear = DVec3::new(velocity[0], velocity[1], velocity[2]);
                // The linear velocity is in the parent's axes, which do not turn with the body: d/dt (R v) =
                // R (a + w x v).
                let (_, rotation) = free_pose(&q[body.position..]);
                let linear_qdd = linear_qdd + (rotation * angular).cross(linear);
                let half = &half[first..];
                let angular = DVec3::new(half[3], half[4], half[5]);
                let linear = DVec3::new(half[0], half[1], half[2]);
                write_free(&mut velocities[first..], linear + linear_qdd * h, angular + angular_qdd * h);
            }
        }
    }
}

/// Writes the six velocities of a free body.
pub fn write_free(velocities: &mut [f64], linear: DVec3, angular: DVec3) {
    velocities[..3].copy_from_slice(&linear.to_array());
    velocities[3..6].copy_from_slice(&angular.to_array());
}

/// Converts a free body's motion relative to its parent from base axes to the axes of its velocities. These
/// are the parent's for the linear part and its own for the angular one.
#[inline]
pub fn free_velocities(motion: Spatial, base_from_body: &DMat3, parent_from_body: DQuat) -> (DVec3, DVec3) {
    let own_from_base = base_from_body.transpose();
    (parent_from_body * (own_from_base * motion.linear), own_from_base * motion.angular)
}

/// Returns S' f for an axis along `z`.
#[inline(always)]
pub fn along<R: Real>(joint_type: JointType, force: Spatial<R>, z: R::Vector) -> R {
    match joint_type {
        JointType::Prismatic => force.linear.dot(z),
        _ => force.angular.dot(z),
    }
}

/// Returns the part of a motion that S qd adds to.
#[inline(always)]
pub fn part_mut<R: Real>(joint_type: JointType, motion: &mut Spatial<R>) -> &mut R::Vector {
    match joint_type {
        JointType::Prismatic => &mut motion.linear,
        _ => &mut motion.angular,
    }
}

/// Returns minus gravity in the base's axes.
pub fn base_acceleration(world_from_base: &Placement, gravity: DVec3) -> DVec3 {
    world_from_base.rotation.transpose() * -gravity
}

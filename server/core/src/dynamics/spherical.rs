//! Ball joints: three axes through one point, those of the child's frame, which turn with it.
//!
//! A ball joint is three bodies at one place, the first two without mass. The passes through a tree therefore
//! meet only joints of one axis. The axes are x, y and z of the child at its present orientation. Their
//! velocities are the child's angular velocity relative to its parent, in its own axes (MuJoCo's and
//! Featherstone's choice). The position is a quaternion, `parent_from_child` at the joint, and belongs to the
//! first body: no angles are stored, and there is no gimbal lock.
//!
//! Targets are orientations. A target is stored as its rotation vector, one component for each axis: the axis
//! of the turn times its angle, in the joint's frame. A spring pulls along the rotation vector from the child
//! to the setpoint, the short way round, in the child's axes. If all axes have one stiffness, half of it
//! times the angle squared is the spring's energy.

use glamx::{DMat3, DQuat, DVec3};

use super::actuator::{Axis, Drive, Mode};
use super::spatial::Spatial;
use super::tree::{JointType, Tree};

/// Returns the orientation of a ball joint, `parent_from_child` at the joint, from the first four numbers.
#[inline]
pub fn orientation(q: &[f64]) -> DQuat {
    DQuat::from_xyzw(q[0], q[1], q[2], q[3])
}

/// Writes the orientation of a ball joint.
pub fn write_orientation(q: &mut [f64], orientation: DQuat) {
    q[..4].copy_from_slice(&orientation.to_array());
}

/// Returns axis times angle, at most half a turn long, rad.
pub fn rotation_vector(orientation: DQuat) -> DVec3 {
    let DQuat { x, y, z, w } = orientation;
    // The short way round.
    let (part, w) = if w < 0.0 { (-DVec3::new(x, y, z), -w) } else { (DVec3::new(x, y, z), w) };
    let sine = part.length();
    // Half of the angle is asin(sine); atan2 is accurate both near 0 and near a half turn.
    if sine > 0.0 { part * (2.0 * sine.atan2(w) / sine) } else { part * 2.0 }
}

/// Returns the turn about a rotation vector, rad.
pub fn turn(vector: DVec3) -> DQuat {
    let angle = vector.length();
    if angle.is_finite() { DQuat::from_scaled_axis(vector).normalize() } else { DQuat::IDENTITY }
}

/// Returns v x S qd of the three axes together, which belongs to the last body: S turns with the child.
/// `first` starts with the velocities of the joint; `velocity` is the child's, base axes.
#[inline]
pub fn velocity_product(base_from_child: &DMat3, first: &[f64], velocity: Spatial) -> Spatial {
    velocity.cross_motion(own_motion(base_from_child, first))
}

/// Returns the child's motion relative to its parent, in the base's axes.
#[inline]
pub fn own_motion(base_from_child: &DMat3, first: &[f64]) -> Spatial {
    Spatial::new(*base_from_child * DVec3::new(first[0], first[1], first[2]), DVec3::ZERO)
}

/// Turns a ball joint by a rotation vector in the child's axes.
pub fn turn_by(q: &mut [f64], vector: DVec3) {
    let turned = orientation(q) * DQuat::from_scaled_axis(vector);
    write_orientation(q, turned.normalize());
}

/// Returns whether an axis has a setpoint.
fn has_setpoint(axis: &Axis) -> bool {
    matches!(axis.actuator.mode, Mode::Position | Mode::Hold)
}

/// Advances the setpoint of a ball joint by a step of `h`, and determines the laws of its three axes. `q`
/// begins with the joint's position; `axes` and `drives` are its three axes'.
///
/// Profile and anti-windup of each axis are as for a joint of one axis, along the rotation vector from the
/// setpoint to the target. Laws take the child's position from the first number of `q`, which a step does not
/// change. They use it only to compute the distance to the setpoint.
pub fn set_drives(q: &[f64], (axes, drives): (&mut [Axis], &mut [Drive]), h: f64) {
    let here = orientation(q);
    let saturated: [Option<f64>; 3] = std::array::from_fn(|k| drives[k].saturated);
    let mut to_setpoint = DVec3::ZERO;
    if axes.iter().any(has_setpoint) {
        // The setpoint of other axes is their position.
        let position = rotation_vector(here);
        let vector = |get: fn(&Axis) -> f64| {
            DVec3::from_array(std::array::from_fn(|k| {
                if has_setpoint(&axes[k]) { get(&axes[k]) } else { position[k] }
            }))
        };
        let target = vector(|axis| axis.actuator.target);
        let before = vector(|axis| axis.actuator.setpoint);
        let setpoint = advance(before, target, axes, h);
        if setpoint != before {
            for (k, axis) in axes.iter_mut().enumerate().filter(|(_, axis)| has_setpoint(axis)) {
                axis.actuator.setpoint = setpoint[k];
            }
        }
        to_setpoint = rotation_vector(here.inverse() * turn(setpoint));
    }
    for (k, (axis, drive)) in axes.iter().zip(drives).enumerate() {
        *drive = Drive { position: q[0] + to_setpoint[k], ..axis.drive(h) };
        // As in joints of one axis: an axis that saturated in the last step mostly saturates in this one.
        drive.saturated = saturated[k].map(|effort| drive.limit.copysign(effort)).filter(|e| e.is_finite());
    }
}

/// Keeps the setpoint of a ball joint within reach of saturated actuators at the end of a step, as
/// [`Axis::anti_windup`] does. `laws` are the requested efforts, `velocities` those after the step, and `q`
/// the position at its start.
pub fn anti_windup(q: &[f64], (axes, drives): (&mut [Axis], &[Drive]), laws: [f64; 3], velocities: &[f64]) {
    if !axes.iter().any(has_setpoint) {
        return;
    }
    let here = orientation(q);
    let from_child = DVec3::from_array(std::array::from_fn(|k| drives[k].position - q[0]));
    let mut kept = from_child;
    for (k, axis) in axes.iter_mut().enumerate() {
        let setpoint = std::mem::replace(&mut axis.actuator.setpoint, from_child[k]);
        axis.anti_windup(&drives[k], laws[k], velocities[k]);
        kept[k] = std::mem::replace(&mut axis.actuator.setpoint, setpoint);
    }
    if kept != from_child {
        let setpoint = rotation_vector(here * turn(kept));
        for (k, axis) in axes.iter_mut().enumerate().filter(|(_, axis)| has_setpoint(axis)) {
            axis.actuator.setpoint = setpoint[k];
        }
    }
}

/// Returns the setpoint after a step of `h` on its way to the target.
fn advance(setpoint: DVec3, target: DVec3, axes: &mut [Axis], h: f64) -> DVec3 {
    let is_still = |axis: &Axis| axis.actuator.setpoint_velocity == 0.0;
    if setpoint == target && axes.iter().all(is_still) {
        return target;
    }
    let left = rotation_vector(turn(setpoint).inverse() * turn(target));
    let mut moved = left;
    for (k, axis) in axes.iter_mut().enumerate().filter(|(_, axis)| has_setpoint(axis)) {
        let (own_target, own_setpoint) = (axis.actuator.target, axis.actuator.setpoint);
        (axis.actuator.target, axis.actuator.setpoint) = (left[k], 0.0);
        axis.advance_setpoint(h);
        moved[k] = axis.actuator.setpoint;
        (axis.actuator.target, axis.actuator.setpoint) = (own_target, own_setpoint);
    }
    if moved == left { target } else { rotation_vector(turn(setpoint) * turn(moved)) }
}

impl Tree {
    /// Returns the target at which the axis of a body would be at its present position. This is the position
    /// of the joint, or for an axis of a ball joint its component of the rotation vector. `q` are all
    /// positions. Not for bodies with six degrees of freedom.
    pub fn position_of_axis(&self, body: usize, q: &[f64]) -> f64 {
        let body = &self.bodies[body];
        match body.joint_type {
            JointType::Spherical { axis } => {
                rotation_vector(orientation(&q[body.position..]))[usize::from(axis)]
            }
            _ => q[body.position],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::tree::NEXT_AXIS;

    /// exp and log are inverse to each other, near 0, near half a turn and beyond.
    #[test]
    fn a_rotation_vector_gives_back_its_turn() {
        let axis = DVec3::new(0.6, -0.48, 0.64);
        for angle in [0.0, 1e-300, 1e-12, 1e-3, 1.0, 3.0, std::f64::consts::PI - 1e-12, std::f64::consts::PI]
        {
            let vector = axis * angle;
            let back = rotation_vector(turn(vector));
            assert!((back - vector).length() <= 1e-15 + 4e-15 * angle, "{angle}: {back}");
        }
        let far = rotation_vector(turn(axis * 4.0));
        assert!((far + axis * (std::f64::consts::TAU - 4.0)).length() < 1e-14, "the short way: {far}");
        assert_eq!(turn(DVec3::splat(1e200)), DQuat::IDENTITY, "no angle is that large");
    }

    #[test]
    fn the_axes_of_the_three_bodies_are_x_y_and_z_of_the_last() {
        let [first, second] = [NEXT_AXIS, NEXT_AXIS * NEXT_AXIS];
        assert_eq!((first.z_axis, second.z_axis), (DVec3::X, DVec3::Y));
        assert_eq!(second * NEXT_AXIS, DMat3::IDENTITY);
    }

    fn driven(target: DVec3, limit: Option<f64>) -> [Axis; 3] {
        std::array::from_fn(|k| {
            let mut axis = Axis::default();
            axis.settings.composite_inertia = 0.1;
            axis.settings.limits.velocity = limit;
            axis.actuator.mode = Mode::Position;
            axis.actuator.target = target[k];
            axis
        })
    }

    /// Without limits the setpoint reaches the target at once, and takes the short way.
    #[test]
    fn a_law_pulls_the_short_way_to_its_target() {
        let here = turn(DVec3::new(0.0, 0.0, 3.0));
        let mut q = [0.0; 4];
        write_orientation(&mut q, here);
        let mut axes = driven(DVec3::new(0.0, 0.0, -3.0), None);
        let mut drives = <[Drive; 3]>::default();
        set_drives(&q, (&mut axes, &mut drives), 1e-3);
        let pull = drives.map(|drive| drive.position - q[0]);
        let wanted = std::f64::consts::TAU - 6.0;
        assert!(pull[0].abs() + pull[1].abs() < 1e-14 && (pull[2] - wanted).abs() < 1e-14, "{pull:?}");
        assert_eq!(axes[2].actuator.setpoint, -3.0);
    }

    /// A velocity limit holds for each axis, and the setpoint arrives exactly.
    #[test]
    fn a_setpoint_advances_no_faster_than_the_limit_and_arrives() {
        let target = DVec3::new(1.0, -0.5, 2.0);
        let mut axes = driven(target, Some(2.0));
        let mut drives = <[Drive; 3]>::default();
        let q = DQuat::IDENTITY.to_array();
        let (h, mut last) = (1e-3, DQuat::IDENTITY);
        for _ in 0..2000 {
            set_drives(&q, (&mut axes, &mut drives), h);
            let next = turn(DVec3::from_array(std::array::from_fn(|k| axes[k].actuator.setpoint)));
            let moved = rotation_vector(last.inverse() * next);
            assert!(moved.abs().max_element() < 2.0 * h * (1.0 + 1e-6), "{moved}");
            last = next;
        }
        let arrived: [f64; 3] = std::array::from_fn(|k| axes[k].actuator.setpoint);
        assert_eq!(DVec3::from_array(arrived), target);
    }
}

//! Scales a robot.

use glamx::DPose3;

use super::findings::Refusal;
use crate::limits;
use crate::robot::{Geometry, JointKind, Picture, RobotModel, TextureRepeat};
use crate::setup::{ConstraintOn, LinkConstraintKind, Setup};

/// Checks a scale.
pub(super) fn check(scale: f64) -> Result<(), Refusal> {
    if scale.is_finite() && scale > 0.0 && scale <= limits::SCALE {
        return Ok(());
    }
    let cap = limits::SCALE;
    Err(Refusal::of_file(format!("the scale is {scale}; it must be above 0 and at most {cap}")))
}

/// Multiplies lengths by `scale` and inertias by its square. Masses do not change, nor do efforts, damping
/// and friction: they belong to the motor.
pub(super) fn apply(model: &mut RobotModel, scale: f64) {
    if scale == 1.0 {
        return;
    }
    for link in &mut model.links {
        link.inertial.center_of_mass *= scale;
        link.inertial.inertia *= scale * scale;
        for visual in &mut link.visuals {
            pose(&mut visual.link_from_shape, scale);
            geometry(&mut visual.geometry, scale);
            if let Some(Picture { repeat: TextureRepeat::PerMetre(often), .. }) = &mut visual.texture {
                *often = often.map(|often| often / scale);
            }
        }
        for collision in &mut link.collisions {
            pose(&mut collision.link_from_shape, scale);
            geometry(&mut collision.geometry, scale);
        }
    }
    let slides: Vec<bool> = model.joints.iter().map(|joint| joint.kind == JointKind::Prismatic).collect();
    let factor = |joint: usize| if slides.get(joint) == Some(&true) { scale } else { 1.0 };
    for joint in &mut model.setup.joints {
        joint.position = joint.position.map(|position| position * factor(joint.joint));
        if let Some(spring) = &mut joint.spring {
            spring.rest *= factor(joint.joint);
        }
    }
    for (joint, position) in model.setup.states.iter_mut().flat_map(|state| &mut state.positions) {
        *position *= factor(*joint);
    }
    for tendon in &mut model.setup.tendons {
        let own = factor(tendon.joint);
        tendon.offset *= own;
        for (joint, by) in &mut tendon.terms {
            *by *= own / factor(*joint);
        }
    }
    constraints(&mut model.setup, &slides, scale);
    // Ranges and noise belong to the device.
    model.setup.sensors.iter_mut().for_each(|sensor| pose(&mut sensor.pose, scale));
    for (joint, slides_itself) in model.joints.iter_mut().zip(&slides) {
        pose(&mut joint.parent_from_joint, scale);
        let own = if *slides_itself { scale } else { 1.0 };
        let limits = &mut joint.limits;
        for length in [&mut limits.lower, &mut limits.upper, &mut limits.velocity] {
            *length = length.map(|length| length * own);
        }
        if let Some(mimic) = &mut joint.mimic {
            let leader = if slides.get(mimic.joint) == Some(&true) { scale } else { 1.0 };
            mimic.offset *= own;
            mimic.multiplier *= own / leader;
        }
    }
}

fn constraints(setup: &mut Setup, slides: &[bool], scale: f64) {
    for constraint in &mut setup.constraints {
        let factor = |on: &ConstraintOn| match on {
            ConstraintOn::Own(joint) if slides.get(*joint) == Some(&true) => scale,
            _ => 1.0,
        };
        let [parent, child] = [factor(&constraint.ends[0].on), factor(&constraint.ends[1].on)];
        match &mut constraint.kind {
            LinkConstraintKind::Gear { ratio, offset } => {
                *ratio *= child / parent;
                *offset = offset.map(|offset| offset * child);
            }
            LinkConstraintKind::Distance { length, .. } => *length = length.map(|length| length * scale),
            _ => {}
        }
        constraint.ends.iter_mut().filter_map(|end| end.pose.as_mut()).for_each(|end| pose(end, scale));
    }
}

fn pose(pose: &mut DPose3, scale: f64) {
    pose.translation *= scale;
}

fn geometry(geometry: &mut Geometry, by: f64) {
    match geometry {
        Geometry::Box { size } => *size *= by,
        Geometry::Sphere { radius } => *radius *= by,
        Geometry::Cylinder { radius, length }
        | Geometry::Capsule { radius, length }
        | Geometry::Cone { radius, length } => {
            *radius *= by;
            *length *= by;
        }
        Geometry::Plane { .. } => {}
        Geometry::Mesh { scale, .. } => *scale *= by,
    }
}

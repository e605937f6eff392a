//! Joints of bodies, and their settings in actuators and equalities.

use std::collections::BTreeMap;

use glamx::{DPose3, DVec3};

use super::body::Body;
use super::compiler::Compiler;
use super::coupling::Couplings;
use super::defaults::Classed;
use super::tendon::{Independent, Tendons};
use super::value;
use crate::report::Disposition::{Ignored, Repaired};
use crate::robot::JointLimits;
use crate::translation::draft::{At, DraftDrive};
use crate::translation::notes::{Notes, Stop};
use crate::urdf::findings::quoted;

/// Type of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Hinge,
    Slide,
    Ball,
}

/// A joint of a body, in the body's frame.
#[derive(Clone, Debug)]
pub(super) struct BodyJoint {
    pub(super) name: String,
    pub(super) at: At,
    pub(super) kind: Kind,
    pub(super) anchor: DVec3,
    pub(super) axis: DVec3,
    pub(super) limits: JointLimits,
    pub(super) damping: f64,
    pub(super) friction: f64,
    pub(super) armature: f64,
    /// Position of the joint in the file's pose of the body.
    pub(super) reference: f64,
    /// Stiffness, and rest position.
    pub(super) spring: Option<[f64; 2]>,
    /// Rest position of its spring.
    pub(super) rest: f64,
    /// Time constant, s, and damping ratio, both above 0: replace stiffness and damping, see `spring_damper`.
    pub(super) spring_damper: Option<[f64; 2]>,
}

/// Settings of joints outside of bodies, by name.
#[derive(Clone, Debug, Default)]
pub(super) struct Joints {
    pub(super) known: BTreeMap<String, Known>,
    pub(super) tendons: Tendons,
    /// Joints that follow one another, by a mimic or a gear.
    pub(super) couplings: Couplings,
    pub(super) drives: BTreeMap<String, DraftDrive>,
    /// Maximum effort of their actuators.
    pub(super) efforts: BTreeMap<String, f64>,
    /// Joint that one follows, multiplier, offset.
    pub(super) mimics: BTreeMap<String, (String, f64, f64)>,
    /// Tendons of joints that move independently.
    pub(super) independent: Vec<Independent>,
}

/// A joint of a body, for settings outside of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    pub(super) kind: Kind,
    /// Position in the file's pose.
    pub(super) reference: f64,
    /// Rest position of its spring.
    pub(super) rest: f64,
}

impl Joints {
    /// Makes it without settings.
    pub(super) fn of(bodies: &[Body]) -> Self {
        let joints = bodies.iter().flat_map(|body| &body.joints);
        let known = |joint: &BodyJoint| {
            let BodyJoint { kind, reference, rest, .. } = *joint;
            (joint.name.clone(), Known { kind, reference, rest })
        };
        let known = joints.map(known).collect();
        Self { known, ..Self::default() }
    }
}

pub(super) fn read(
    joint: &Classed,
    name: String,
    body_from_frame: &DPose3,
    compiler: &Compiler,
    notes: &mut Notes,
) -> Result<BodyJoint, Stop> {
    let at = joint.element;
    let kind = match joint.word("type").unwrap_or("hinge") {
        "hinge" => Kind::Hinge,
        "slide" => Kind::Slide,
        "ball" => Kind::Ball,
        other => return Err(Stop::at(at, format!("simd knows no joint of type {}", quoted(other)))),
    };
    let length = |value: f64| if kind == Kind::Slide { value } else { compiler.angle(value) };
    let anchor = joint.numbers("pos", notes)?.map_or(DVec3::ZERO, DVec3::from_array);
    let axis = joint.numbers("axis", notes)?.map_or(DVec3::Z, DVec3::from_array);
    let least = |value: Option<f64>| value.unwrap_or(0.0).max(0.0);
    let reference = length(joint.number("ref")?.unwrap_or(0.0));
    let stiffness = least(joint.number("stiffness")?);
    let rest = length(joint.number("springref")?.unwrap_or(0.0));
    let mut limits = JointLimits::default();
    if let (Some([lower, upper]), true) = (joint.numbers::<2>("range", notes)?, kind != Kind::Ball)
        && is_limited(joint, "limited", true, compiler)
    {
        let (lower, upper) = (length(lower), length(upper));
        if lower < upper {
            (limits.lower, limits.upper) = (Some(lower), Some(upper));
        } else {
            notes.warn(at, Repaired, "its range is empty: it has no limits");
        }
    } else if kind == Kind::Ball && joint.word("range").is_some() {
        notes.warn(at, Ignored, "the range of a ball joint is not read");
    }
    if let Some([lower, upper]) = joint.numbers::<2>("actuatorfrcrange", notes)?
        && is_limited(joint, "actuatorfrclimited", true, compiler)
    {
        limits.effort = Some(lower.abs().max(upper.abs())).filter(|most| *most > 0.0);
    }
    let spring_damper = joint.numbers::<2>("springdamper", notes)?.filter(|both| *both != [0.0, 0.0]);
    let is_positive = |both: &[f64; 2]| both.iter().all(|value| *value > 0.0);
    if spring_damper.as_ref().is_some_and(|both| !is_positive(both)) {
        notes.warn(at, Ignored, "the numbers of springdamper are not both above 0: left out");
    }
    if joint.number("margin")?.is_some_and(|margin| margin != 0.0) {
        notes.info(at, Ignored, "margin is not read");
    }
    Ok(BodyJoint {
        name,
        at: (at.file, at.line()),
        kind,
        anchor: body_from_frame.transform_point(anchor),
        axis: body_from_frame.rotation * value::direction(at, axis)?,
        limits,
        damping: least(joint.number("damping")?),
        friction: least(joint.number("frictionloss")?),
        armature: least(joint.number("armature")?),
        reference,
        spring: (stiffness > 0.0).then_some([stiffness, rest]),
        rest,
        spring_damper: spring_damper.filter(is_positive),
    })
}

/// Returns whether a range applies, by the attribute that says so.
pub(super) fn is_limited(of: &Classed, name: &str, has_range: bool, compiler: &Compiler) -> bool {
    match of.word(name) {
        Some("true") => true,
        Some("false") => false,
        _ => compiler.auto_limits && has_range,
    }
}

//! A joint: its frame in the model's, its axes, limits, damping and friction.

use std::collections::BTreeSet;

use glamx::{DPose3, DVec3};

use super::frames::{Frames, MODEL};
use super::model::Model;
use super::sensor;
use crate::report::Disposition::{Ignored, Repaired};
use crate::robot::JointLimits;
use crate::translation::draft::{At, DraftDrive, DraftSensor};
use crate::translation::element::{Element, report_unknown};
use crate::translation::notes::{Notes, Stop};
use crate::urdf::findings::quoted;

/// Name of the fixed world.
pub(super) const WORLD: &str = "world";

/// A joint between links of a model, or of one and the world.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    pub(super) name: String,
    pub(super) at: At,
    /// `None` is the world.
    pub(super) parent: Option<String>,
    pub(super) child: String,
    pub(super) model_from_joint: DPose3,
    /// None fixes the child, one moves it along or about an axis, two act in series.
    pub(super) axes: Vec<Axis>,
    /// Whether it turns about any axis.
    pub(super) is_ball: bool,
    /// Joint that it follows, multiplier, offset.
    pub(super) mimic: Option<(String, f64, f64)>,
    /// In the joint's frame.
    pub(super) sensors: Vec<DraftSensor>,
}

#[derive(Clone, Debug)]
pub(super) struct Axis {
    /// Type in URDF.
    pub(super) kind: &'static str,
    /// In the joint's frame.
    pub(super) direction: DVec3,
    pub(super) limits: JointLimits,
    pub(super) damping: f64,
    pub(super) friction: f64,
    /// Stiffness, and rest position.
    pub(super) spring: Option<[f64; 2]>,
    /// The armature, drive and position of an included URDF.
    pub(super) armature: f64,
    pub(super) drive: Option<DraftDrive>,
    /// Initial position.
    pub(super) position: Option<f64>,
}

const KNOWN: [&str; 11] = [
    "pose",
    "parent",
    "child",
    "axis",
    "axis2",
    "physics",
    "sensor",
    "gearbox_ratio",
    "gearbox_reference_body",
    "thread_pitch",
    "screw_thread_pitch",
];

impl Joint {
    /// Moves the joint to an outer model: changes its names and its pose.
    pub(super) fn moved(&mut self, full: &impl Fn(&str) -> String, outer_from_model: &DPose3) {
        self.name = full(&self.name);
        self.child = full(&self.child);
        self.parent = self.parent.as_deref().map(full);
        if let Some((leader, _, _)) = &mut self.mimic {
            *leader = full(leader);
        }
        self.model_from_joint = *outer_from_model * self.model_from_joint;
    }
}

/// Returns an end of a joint that belongs to an include that is not there.
pub(super) fn lost_end<'a>(joint: Element<'a>, absent: &BTreeSet<String>) -> Option<&'a str> {
    let mut ends = ["parent", "child"].into_iter().filter_map(|tag| joint.text_of(tag));
    ends.find(|end| absent.contains(end.split_once("::").map_or(*end, |(of, _)| of)))
}

/// Reads a joint with a known frame, in a model with known links.
pub(super) fn read(
    element: Element,
    version: (u32, u32),
    frames: &mut Frames,
    model: &Model,
    notes: &mut Notes,
) -> Result<Option<Joint>, Stop> {
    let Some(name) = element.word("name") else { return Err(Stop::at(element, "it has no name")) };
    if let Some(lost) = lost_end(element, &model.absent) {
        let message = format!("{} belongs to an include that is not there: left out", quoted(lost));
        notes.warn(element, Ignored, message);
        return Ok(None);
    }
    let end = |tag: &'static str| -> Result<Option<String>, Stop> {
        let Some(said) = element.child(tag) else {
            return Err(Stop::at(element, format!("it has no {tag}")));
        };
        // Before version 1.4 it was an attribute.
        let said_name =
            Some(said.text()).filter(|text| !text.is_empty()).or(said.word("link")).unwrap_or_default();
        // Old files may have a link of this name, which then takes precedence; a joint of this name does not.
        if said_name == WORLD && model.attached.get(WORLD).map(String::as_str) != Some(WORLD) {
            return Ok(None);
        }
        let link = match said_name {
            MODEL => model.canonical.clone(),
            name => model.attached.get(name).cloned(),
        };
        let link = link.ok_or_else(|| {
            Stop::at(said, format!("its {tag} {} is not a link or frame of the model", quoted(said_name)))
        })?;
        Ok(Some(link))
    };
    let (parent, child) = (end("parent")?, end("child")?);
    let Some(child) = child else {
        return Err(Stop::at(element, "its child is the world, which nothing moves"));
    };
    if parent.as_ref() == Some(&child) {
        return Err(Stop::at(
            element,
            format!("its parent and its child are the same link {}", quoted(&child)),
        ));
    }
    report_unknown(element, &KNOWN, "", notes);
    let model_from_joint = frames.resolve(name, element)?;
    let sensors = sensor::read(element, &model_from_joint, frames, notes);
    let kind = element.word("type").unwrap_or_default();
    let mut axis = |tag: &'static str, kind: &'static str, notes: &mut Notes| {
        axis(element, tag, kind, version, &model_from_joint, frames, notes)
    };
    let mut is_ball = false;
    let axes = match kind {
        "fixed" => Vec::new(),
        "revolute" | "continuous" | "hinge" => vec![axis("axis", "revolute", notes)?],
        "prismatic" => vec![axis("axis", "prismatic", notes)?],
        "revolute2" | "universal" => {
            vec![axis("axis", "revolute", notes)?, axis("axis2", "revolute", notes)?]
        }
        "ball" => {
            is_ball = true;
            Vec::new()
        }
        "gearbox" => {
            notes.warn(
                element,
                Ignored,
                "simd has no such joint in a description: a constraint is its gear; left out",
            );
            return Ok(None);
        }
        other => {
            let message = format!("simd knows no joint of type {}", quoted(other));
            return Err(Stop::at(element, message));
        }
    };
    let mimic = match element.at(&["axis", "mimic"]) {
        Some(mimic) => {
            let number = |tag: &'static str, notes: &mut Notes| mimic.number_of(tag, notes);
            let multiplier = number("multiplier", notes)?.unwrap_or(1.0);
            let offset = number("offset", notes)?.unwrap_or(0.0)
                - multiplier * number("reference", notes)?.unwrap_or(0.0);
            mimic.word("joint").map(|leader| (leader.to_owned(), multiplier, offset))
        }
        None => None,
    };
    let at = (element.file, element.line());
    let name = name.to_owned();
    Ok(Some(Joint { name, at, parent, child, model_from_joint, axes, is_ball, mimic, sensors }))
}

fn axis(
    joint: Element,
    tag: &'static str,
    kind: &'static str,
    version: (u32, u32),
    model_from_joint: &DPose3,
    frames: &mut Frames,
    notes: &mut Notes,
) -> Result<Axis, Stop> {
    let mut axis = Axis {
        kind,
        direction: DVec3::Z,
        limits: JointLimits::default(),
        damping: 0.0,
        friction: 0.0,
        spring: None,
        armature: 0.0,
        drive: None,
        position: None,
    };
    let Some(element) = joint.child(tag) else {
        notes.warn(joint, Repaired, format!("it has no {tag}: 0 0 1 is used"));
        return Ok(axis);
    };
    if let Some(xyz) = element.child("xyz") {
        if let Some(direction) = xyz.numbers(notes)? {
            axis.direction = DVec3::from_array(direction);
        }
        let in_model = element.says("use_parent_model_frame").unwrap_or(version < (1, 5)) && version < (1, 7);
        let expressed_in = xyz.word("expressed_in").or_else(|| in_model.then_some(MODEL));
        if let Some(frame) = expressed_in {
            let model_from_frame = frames.resolve(frame, xyz)?;
            axis.direction =
                model_from_joint.rotation.inverse() * (model_from_frame.rotation * axis.direction);
        }
    }
    let length = axis.direction.length();
    if length < 1e-9 {
        notes.warn(element, Repaired, "the axis is 0: 0 0 1 is used");
        axis.direction = DVec3::Z;
    } else {
        axis.direction /= length;
    }
    if let Some(limit) = element.child("limit") {
        // SDF treats larger values as no limit.
        let bound = |value: Option<f64>| value.filter(|value| value.abs() < 1e15);
        let positive = |value: Option<f64>| value.filter(|value| *value >= 0.0 && *value < 1e15);
        axis.limits.lower = bound(limit.number_of("lower", notes)?);
        axis.limits.upper = bound(limit.number_of("upper", notes)?);
        axis.limits.effort = positive(limit.number_of("effort", notes)?);
        axis.limits.velocity = positive(limit.number_of("velocity", notes)?);
        for tag in ["stiffness", "dissipation"] {
            if let Some(child) = limit.child(tag) {
                notes.info(child, Ignored, "not read by simd: limits are hard");
            }
        }
    }
    if kind == "revolute" && axis.limits.lower.is_none() && axis.limits.upper.is_none() {
        axis.kind = "continuous";
    }
    if let Some(dynamics) = element.child("dynamics") {
        let least = |value: Option<f64>| value.unwrap_or(0.0).max(0.0);
        axis.damping = least(dynamics.number_of("damping", notes)?);
        axis.friction = least(dynamics.number_of("friction", notes)?);
        let stiffness = least(dynamics.number_of("spring_stiffness", notes)?);
        if stiffness > 0.0 {
            let rest = dynamics.number_of("spring_reference", notes)?.unwrap_or(0.0);
            axis.spring = Some([stiffness, rest]);
        }
    }
    Ok(axis)
}

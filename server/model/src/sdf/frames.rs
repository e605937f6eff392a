//! Frames of a model or a world: where links, joints, frames and models stand, each relative to another one.

use std::collections::BTreeMap;

use glamx::{DPose3, DQuat, DVec3};

use crate::report::Disposition::Ignored;
use crate::translation::element::{Element, parse};
use crate::translation::notes::{Notes, Stop};
use crate::urdf::findings::quoted;

/// The frame of the model or world itself.
pub(super) const MODEL: &str = "__model__";

/// A frame before its pose in the model is known.
pub(super) struct Raw<'a> {
    /// Pose in the frame that it is relative to.
    pub(super) pose: DPose3,
    /// Name of that frame.
    pub(super) relative_to: String,
    /// Element that defines it.
    pub(super) at: Element<'a>,
}

/// Frames by name.
#[derive(Default)]
pub(super) struct Frames<'a> {
    /// Whether they are the frames of a world.
    pub(super) is_world: bool,
    pub(super) raw: BTreeMap<String, Raw<'a>>,
    resolved: BTreeMap<String, DPose3>,
}

impl<'a> Frames<'a> {
    /// All frames, and the elements that give them.
    pub(super) fn names(&self) -> Vec<(String, Element<'a>)> {
        self.raw.iter().map(|(name, raw)| (name.clone(), raw.at)).collect()
    }

    /// Adds a frame, unless its name is taken. Without another frame it is relative to the owner's own.
    pub(super) fn add(&mut self, name: &str, pose: DPose3, relative_to: Option<&str>, at: Element<'a>) {
        let relative_to = relative_to.filter(|frame| *frame != "world").unwrap_or(MODEL).to_owned();
        self.raw.entry(name.to_owned()).or_insert(Raw { pose, relative_to, at });
    }

    /// `model_from_frame` of a frame, or `world_from_frame`.
    pub(super) fn resolve(&mut self, name: &str, asked_by: Element) -> Result<DPose3, Stop> {
        // From the frame up to a known one, without recursion: chains may be long.
        let mut chain: Vec<String> = Vec::new();
        let mut at = name.to_owned();
        let mut pose = loop {
            if at == MODEL || at.is_empty() {
                break DPose3::IDENTITY;
            }
            if let Some(known) = self.resolved.get(&at) {
                break *known;
            }
            let Some(raw) = self.raw.get(&at) else {
                let owner = if self.is_world { "world" } else { "model" };
                return Err(Stop::at(asked_by, format!("there is no frame {} in its {owner}", quoted(&at))));
            };
            if chain.len() > self.raw.len() {
                return Err(Stop::at(
                    raw.at,
                    format!("the frame {} is defined relative to itself", quoted(&at)),
                ));
            }
            let next = raw.relative_to.clone();
            chain.push(std::mem::replace(&mut at, next));
        };
        for name in chain.into_iter().rev() {
            if let Some(raw) = self.raw.get(&name) {
                pose *= raw.pose;
                self.resolved.insert(name, pose);
            }
        }
        Ok(pose)
    }
}

/// Returns the pose of an element's `<pose>`, and the frame that it is relative to, if given.
pub(super) fn pose<'a>(element: Element<'a>, notes: &mut Notes) -> Result<(DPose3, Option<&'a str>), Stop> {
    let Some(pose) = element.child("pose") else { return Ok((DPose3::IDENTITY, None)) };
    let relative_to = pose.word("relative_to").or_else(|| pose.word("frame"));
    if pose.text().is_empty() {
        return Ok((DPose3::IDENTITY, relative_to));
    }
    let format = pose.word("rotation_format");
    if let Some(format) = format.filter(|format| !matches!(*format, "euler_rpy" | "quat_xyzw")) {
        let message =
            format!("rotation_format {} is unknown; the angles are read as euler_rpy", quoted(format));
        notes.warn(pose, Ignored, message);
    }
    if format == Some("quat_xyzw") {
        let [x, y, z, qx, qy, qz, qw] = parse(pose, "", pose.text(), notes)?;
        let rotation = DQuat::from_array([qx, qy, qz, qw]);
        if rotation.length() < 1e-9 {
            return Err(Stop::at(pose, "its quaternion is 0"));
        }
        return Ok((DPose3::from_parts(DVec3::new(x, y, z), rotation.normalize()), relative_to));
    }
    let [x, y, z, roll, pitch, yaw] = parse(pose, "", pose.text(), notes)?;
    let unit =
        if matches!(pose.word("degrees"), Some("true" | "1")) { std::f64::consts::PI / 180.0 } else { 1.0 };
    let rotation = crate::urdf::geometry::rotation([roll, pitch, yaw].map(|angle| angle * unit));
    Ok((DPose3::from_parts(DVec3::new(x, y, z), rotation), relative_to))
}

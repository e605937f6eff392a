//! Frames of a model: where links, joints, frames and nested models stand, each relative to another one.

use std::collections::BTreeMap;

use glamx::{DPose3, DQuat, DVec3};

use crate::translation::element::{Element, parse};
use crate::translation::notes::{Notes, Stop};
use crate::urdf::findings::quoted;

/// The model's own frame.
pub(super) const MODEL: &str = "__model__";

/// A frame before it is known where it is.
pub(super) struct Raw<'a> {
    /// In the frame that it is relative to.
    pub(super) pose: DPose3,
    /// The name of that one.
    pub(super) relative_to: String,
    /// What gives it.
    pub(super) at: Element<'a>,
}

/// Frames by name.
#[derive(Default)]
pub(super) struct Frames<'a> {
    pub(super) raw: BTreeMap<String, Raw<'a>>,
    resolved: BTreeMap<String, DPose3>,
}

impl Frames<'_> {
    /// `model_from_frame` of a frame.
    pub(super) fn resolve(&mut self, name: &str, asked_by: Element) -> Result<DPose3, Stop> {
        // From the frame up to one that is known, without recursion: chains may be long.
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
                return Err(Stop::at(asked_by, format!("there is no frame {} in its model", quoted(&at))));
            };
            if chain.len() > self.raw.len() {
                return Err(Stop::at(raw.at, format!("the frame {} stands relative to itself", quoted(&at))));
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

/// The pose of an element's `<pose>`, and what it is relative to where it says so.
pub(super) fn pose<'a>(element: Element<'a>, notes: &mut Notes) -> Result<(DPose3, Option<&'a str>), Stop> {
    let Some(pose) = element.child("pose") else { return Ok((DPose3::IDENTITY, None)) };
    let relative_to = pose.word("relative_to").or_else(|| pose.word("frame"));
    if pose.text().is_empty() {
        return Ok((DPose3::IDENTITY, relative_to));
    }
    if pose.word("rotation_format") == Some("quat_xyzw") {
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

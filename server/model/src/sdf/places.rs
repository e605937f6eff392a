//! Joints between the models of a world. They become constraints between the robots.

use std::collections::{BTreeMap, BTreeSet};

use glamx::DPose3;

use super::frames::{self, Frames};
use super::joint::{self, WORLD};
use super::model::Model;
use super::split::{Why, constrain};
use super::version;
use crate::report::Disposition::{Ignored, Used};
use crate::translation::draft::Draft;
use crate::translation::element::Element;
use crate::translation::notes::{Notes, Stop};
use crate::urdf::findings::quoted;

/// Links by name in a model or a world.
pub(super) type Places = BTreeMap<String, Place>;

/// A link of a robot.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// Index of the robot.
    pub(super) robot: usize,
    /// Name in the robot.
    pub(super) link: String,
    /// Pose in the model or the world.
    pub(super) pose: DPose3,
}

/// Joints of a world, and what they may be between.
#[derive(Default)]
pub(super) struct Between<'a> {
    joints: Vec<Element<'a>>,
    /// Model or frame that each frame of the world is attached to.
    attached_to: BTreeMap<String, String>,
    /// Links of models and of what is attached to them, with the names of the models in front.
    attached: BTreeMap<String, String>,
    /// Includes that are not there.
    absent: BTreeSet<String>,
    places: Places,
}

/// A link: its name in the world, its own, and its pose in the world.
type Known = (String, String, DPose3);

impl<'a> Between<'a> {
    /// Adds a joint.
    pub(super) fn add(&mut self, joint: Element<'a>) {
        self.joints.push(joint);
    }

    /// Adds a frame of the world.
    pub(super) fn attach(&mut self, frame: &str, to: Option<&str>) {
        if let Some(to) = to {
            self.attached_to.insert(frame.to_owned(), to.to_owned());
        }
    }

    /// Notes an include that is not there.
    pub(super) fn lose(&mut self, include: String) {
        self.absent.insert(include);
    }

    /// Returns the links of a model, if there is a joint.
    pub(super) fn links_of(&mut self, model: &Model, world_from_model: DPose3) -> Vec<Known> {
        if self.joints.is_empty() {
            return Vec::new();
        }
        let name = &model.name;
        let full = |own: &str| format!("{name}::{own}");
        if let Some(canonical) = &model.canonical {
            self.attached.entry(name.clone()).or_insert_with(|| full(canonical));
        }
        for (own, link) in &model.attached {
            self.attached.entry(full(own)).or_insert_with(|| full(link));
        }
        let known = |link: &str, pose: &DPose3| (full(link), link.to_owned(), world_from_model * *pose);
        model.links.iter().map(|(link, pose)| known(&link.name, pose)).collect()
    }

    /// Sets the robots of a model's links; the first of them has an index.
    pub(super) fn place(&mut self, known: Vec<Known>, first: usize, robots: &[Draft]) {
        if known.is_empty() {
            return;
        }
        let mut robot_of: BTreeMap<&str, usize> = BTreeMap::new();
        for (index, robot) in robots.iter().enumerate() {
            robot_of.extend(robot.links.iter().map(|link| (link.name.as_str(), first + index)));
        }
        for (full, link, pose) in known {
            if let Some(robot) = robot_of.get(link.as_str()).copied() {
                self.places.entry(full).or_insert(Place { robot, link, pose });
            }
        }
    }

    /// Makes constraints of the joints.
    pub(super) fn connect(
        mut self,
        frames: &mut Frames<'a>,
        robots: &mut [Draft],
        notes: &mut Notes,
    ) -> Result<(), Stop> {
        for frame in self.attached_to.keys().cloned().collect::<Vec<_>>() {
            let mut at = &frame;
            for _ in 0..self.attached_to.len() {
                at = self.attached_to.get(at).unwrap_or(at);
            }
            if let Some(link) = self.attached.get(at).cloned() {
                self.attached.entry(frame).or_insert(link);
            }
        }
        let Self { joints, attached, absent, places, .. } = self;
        let Some(first) = joints.first() else { return Ok(()) };
        let world = Model {
            name: WORLD.to_owned(),
            at: (first.file, first.line()),
            is_static: false,
            self_collide: false,
            stays_awake: false,
            links: Vec::new(),
            joints: Vec::new(),
            frames: BTreeMap::new(),
            named: Vec::new(),
            canonical: None,
            attached,
            absent,
        };
        for element in joints {
            let Some(name) = element.word("name") else {
                notes.warn(element, Ignored, "it has no name; left out");
                continue;
            };
            if joint::lost_end(element, &world.absent).is_none() && !has_ends(element, &world, frames, notes)
            {
                continue;
            }
            let (pose, relative_to) = frames::pose(element, notes)?;
            let relative_to = relative_to.or(element.text_of("child"));
            frames.add(name, pose, relative_to, element);
            let said = element.node.document().root_element().attribute("version");
            let version = said.and_then(version).unwrap_or((1, 12));
            let joint = match joint::read(element, version, frames, &world, notes) {
                Ok(Some(joint)) => joint,
                Ok(None) => continue,
                // A world is not refused for it.
                Err(stop) => {
                    notes.warn_of(element, &stop);
                    continue;
                }
            };
            if !joint.sensors.is_empty() {
                notes.warn(element, Ignored, "its sensors are left out: it is a constraint");
            }
            notes.info(element, Used, format!("a constraint between models: {}", quoted(name)));
            constrain(&joint, robots, (&places, DPose3::IDENTITY), Why::Models, notes);
        }
        Ok(())
    }
}

/// Returns whether both ends of a joint are there, and nothing else has its name; otherwise reports it.
fn has_ends(joint: Element, world: &Model, frames: &Frames, notes: &mut Notes) -> bool {
    let name = joint.word("name").unwrap_or_default();
    if frames.raw.contains_key(name) {
        notes.warn(
            joint,
            Ignored,
            format!("something else in the world is called {}: left out", quoted(name)),
        );
        return false;
    }
    for tag in ["parent", "child"] {
        let end = joint.text_of(tag).unwrap_or_default();
        let is_there = world.attached.contains_key(end) || (tag == "parent" && end == WORLD);
        if !is_there {
            let message = format!(
                "its {tag} {} is not a model, link or frame of the world: left out; links are named MODEL::LINK",
                quoted(end)
            );
            notes.warn(joint, Ignored, message);
            return false;
        }
    }
    true
}

//! One model: its links and joints with their poses in its frame, including nested models.

use std::collections::{BTreeMap, BTreeSet};

use glamx::DPose3;

use super::frames::{self, Frames, MODEL, Raw};
use super::joint::{self, Joint};
use super::{Reader, files, link, sensor, version};
use crate::report::Disposition::{Ignored, Repaired};
use crate::translation::draft::{At, DraftLink, Names};
use crate::translation::element::{Element, report_unknown};
use crate::translation::notes::Stop;
use crate::urdf::findings::quoted;

/// A flattened model.
#[derive(Clone, Debug)]
pub(super) struct Model {
    pub(super) name: String,
    pub(super) at: At,
    /// Whether none of its links moves.
    pub(super) is_static: bool,
    pub(super) self_collide: bool,
    pub(super) stays_awake: bool,
    /// Each with `model_from_link`.
    pub(super) links: Vec<(DraftLink, DPose3)>,
    pub(super) joints: Vec<Joint>,
    /// Its frames, for including models: `model_from_frame` by name.
    pub(super) frames: BTreeMap<String, DPose3>,
    /// Those that a `<frame>` gives.
    pub(super) named: Vec<(String, At)>,
    /// The link that represents it.
    pub(super) canonical: Option<String>,
    /// Link that a frame or a joint is fixed to, by its name.
    pub(super) attached: BTreeMap<String, String>,
    /// Names of its includes that are not there.
    pub(super) absent: BTreeSet<String>,
}

impl Model {
    /// Refuses a placement by a frame that the model does not have.
    fn check_frame(&self, frame: Option<&str>, at: Element) -> Result<(), Stop> {
        match frame {
            Some(frame) if frame != MODEL && !self.frames.contains_key(frame) => {
                Err(Stop::at(at, format!("placement_frame {} is not a frame of the model", quoted(frame))))
            }
            _ => Ok(()),
        }
    }
}

/// Pose of a model, as its own element gives it.
#[derive(Clone, Debug)]
pub(super) struct Placement {
    pose: DPose3,
    /// The frame that has the pose; `None` is the model's own.
    frame: Option<String>,
    /// The frame of the outer model that the pose is relative to.
    pub(super) relative_to: Option<String>,
}

impl Placement {
    /// Returns the placement of a model that names none.
    pub(super) fn at_origin() -> Self {
        Self { pose: DPose3::IDENTITY, frame: None, relative_to: None }
    }

    /// Returns the model's frame in the frame that the pose is relative to.
    pub(super) fn parent_from_model(&self, model: &Model) -> DPose3 {
        let frame = self.frame.as_ref().and_then(|frame| model.frames.get(frame));
        self.pose * frame.copied().unwrap_or(DPose3::IDENTITY).inverse()
    }
}

/// A model in another one.
struct Nested {
    /// Frame of the inner model in the outer one.
    frame: String,
    model: Model,
    /// Whether its elements become the outer model's own, by `merge`.
    is_merged: bool,
}

impl Nested {
    /// Returns the name of one of its elements in the outer model.
    fn full(&self, own: &str) -> String {
        Self::name(&self.frame, self.is_merged, own)
    }

    fn name(frame: &str, is_merged: bool, own: &str) -> String {
        if is_merged { own.to_owned() } else { format!("{frame}::{own}") }
    }
}

/// Nesting depth of models.
const MAX_DEPTH: usize = 20;

const KNOWN: [&str; 14] = [
    "pose",
    "static",
    "self_collide",
    "link",
    "joint",
    "frame",
    "model",
    "include",
    "plugin",
    "allow_auto_disable",
    "enable_wind",
    "gripper",
    "placement_frame",
    "origin",
];

/// Returns the link that each frame or joint is fixed to, through all attachments; `None` if there is none,
/// or a cycle.
fn fixed_to(
    attached_to: &BTreeMap<String, String>,
    links: &BTreeMap<String, String>,
    canonical: Option<&str>,
) -> BTreeMap<String, String> {
    let mut known: BTreeMap<&str, Option<&str>> = BTreeMap::new();
    for name in attached_to.keys() {
        // Each step is taken once: chains may be long.
        let mut path: Vec<&str> = Vec::new();
        let mut at = name.as_str();
        let link = loop {
            if let Some(link) = links.get(at) {
                break Some(link.as_str());
            }
            if let Some(found) = known.get(at) {
                break *found;
            }
            let Some(next) = attached_to.get(at) else {
                break if at == MODEL { canonical } else { None };
            };
            // Until the link is known, a cycle ends here.
            known.insert(at, None);
            path.push(at);
            at = next;
        };
        known.extend(path.into_iter().map(|name| (name, link)));
    }
    let named = known.into_iter().filter_map(|(name, link)| Some((name.to_owned(), link?.to_owned())));
    named.collect()
}

/// Returns the name that an include gives its model, or the name of its folder or file.
pub(super) fn include_name(include: Element) -> String {
    let last = |uri: &str| {
        let last = uri.trim_end_matches('/').rsplit('/').next().unwrap_or_default();
        last.split('.').next().unwrap_or_default().to_owned()
    };
    let name = include.text_of("name").map(str::to_owned);
    name.unwrap_or_else(|| include.text_of("uri").map(last).unwrap_or_default())
}

impl<'a> Reader<'a> {
    /// Reads a `<model>` at a nesting depth.
    pub(super) fn model(&mut self, element: Element<'a>, depth: usize) -> Result<(Model, Placement), Stop> {
        if depth > MAX_DEPTH {
            let message = format!("models are nested deeper than {MAX_DEPTH} levels");
            return Err(Stop::at(element, message));
        }
        self.spend(element)?;
        let name = element.word("name").unwrap_or("model").to_owned();
        let version = Element::root(self.sources, element.file)
            .and_then(|root| version(root.word("version")?))
            .unwrap_or((1, 12));
        let mut frames = Frames::default();
        let mut nested: Vec<Nested> = Vec::new();
        let mut attached: BTreeMap<String, String> = BTreeMap::new();
        let mut attached_to: BTreeMap<String, String> = BTreeMap::new();
        let mut taken = Names::default();
        let mut own_names: BTreeSet<String> = BTreeSet::new();
        let mut named: Vec<(String, At)> = Vec::new();
        let mut absent: BTreeSet<String> = BTreeSet::new();

        for child in element.elements() {
            self.spend(child)?;
            match child.tag() {
                "model" | "include" => {
                    let read = match child.tag() {
                        "model" => Some(self.model(child, depth + 1)?),
                        _ => self.included_at(child, depth + 1)?,
                    };
                    let Some((mut model, placement)) = read else {
                        absent.insert(include_name(child));
                        continue;
                    };
                    let is_merged = child.tag() == "include"
                        && child
                            .word("merge")
                            .is_some_and(|word| word == "1" || word.eq_ignore_ascii_case("true"));
                    if is_merged {
                        model.name = format!("_merged__{}__model__", model.name);
                    }
                    model.name = taken.unique(&model.name);
                    own_names.insert(model.name.clone());
                    if is_merged {
                        for own in model.frames.keys() {
                            if !taken.take(own) {
                                let message = format!(
                                    "it merges a model in which {} is called as another element of this one",
                                    quoted(own)
                                );
                                return Err(Stop::at(child, message));
                            }
                            own_names.insert(own.clone());
                        }
                    }
                    let pose = placement.parent_from_model(&model);
                    let relative_to = placement.relative_to.unwrap_or_else(|| MODEL.to_owned());
                    frames.raw.insert(model.name.clone(), Raw { pose, relative_to, at: child });
                    let nested_one = Nested { frame: model.name.clone(), model, is_merged };
                    for (own, pose) in &nested_one.model.frames {
                        let raw = Raw { pose: *pose, relative_to: nested_one.frame.clone(), at: child };
                        let full = nested_one.full(own);
                        if !is_merged {
                            own_names.insert(full.clone());
                        }
                        frames.raw.insert(full, raw);
                    }
                    nested.push(nested_one);
                }
                "link" | "frame" | "joint" => {
                    let Some(own) = child.word("name") else {
                        return Err(Stop::at(child, "it has no name"));
                    };
                    if child.tag() == "joint" && joint::lost_end(child, &absent).is_some() {
                        continue;
                    }
                    if !taken.take(own) {
                        // In old files a link and a joint may have the same name; the link is the frame of
                        // that name.
                        if child.tag() == "joint" {
                            self.notes.info(child, Repaired, "a link or frame has this name too");
                            continue;
                        }
                        return Err(Stop::at(
                            child,
                            format!("another element of the model is called {}", quoted(own)),
                        ));
                    }
                    own_names.insert(own.to_owned());
                    let (pose, relative_to) = frames::pose(child, &mut self.notes)?;
                    let default = match child.tag() {
                        "joint" => child.text_of("child").unwrap_or(MODEL),
                        "frame" => child.word("attached_to").unwrap_or(MODEL),
                        _ => MODEL,
                    };
                    let relative_to = relative_to.filter(|_| version >= (1, 7)).unwrap_or(default);
                    let relative_to = relative_to.to_owned();
                    match child.tag() {
                        "link" => drop(attached.insert(own.to_owned(), own.to_owned())),
                        _ => drop(attached_to.insert(own.to_owned(), default.to_owned())),
                    }
                    if child.tag() == "frame" {
                        named.push((own.to_owned(), (child.file, child.line())));
                    }
                    frames.raw.insert(own.to_owned(), Raw { pose, relative_to, at: child });
                }
                _ => {}
            }
        }
        report_unknown(element, &KNOWN, "", &mut self.notes);
        for child in element.elements().filter(|child| ["plugin", "gripper"].contains(&child.tag())) {
            self.notes.info(child, Ignored, "not read by simd: it is for Gazebo");
        }

        let mut model = Model {
            at: (element.file, element.line()),
            is_static: element.says("static") == Some(true),
            self_collide: element.says("self_collide") == Some(true),
            stays_awake: element.says("allow_auto_disable") == Some(false),
            links: Vec::new(),
            joints: Vec::new(),
            frames: BTreeMap::new(),
            named,
            canonical: None,
            attached: BTreeMap::new(),
            absent,
            name,
        };
        self.take_nested(nested, &mut frames, &mut model, element)?;
        attached.extend(std::mem::take(&mut model.attached));
        for child in element.children("link") {
            let Some(own) = child.word("name") else { continue };
            let pose = frames.resolve(own, child)?;
            let mut read = link::read(child, &mut self.notes)?;
            read.sensors = sensor::read(child, &pose, &mut frames, &mut self.notes);
            model.links.push((read, pose));
            self.links += 1;
            if self.links > crate::MAX_LINKS {
                let message = format!("all its models together have more than {} links", crate::MAX_LINKS);
                return Err(Stop::at(element, message));
            }
        }
        let canonical = element.word("canonical_link").filter(|name| {
            let is_link = attached.get(*name).is_some_and(|link| link == name);
            if !is_link {
                let message = format!("canonical_link {} is not a link of the model; left out", quoted(name));
                self.notes.warn(element, Ignored, message);
            }
            is_link
        });
        model.canonical = canonical.map(str::to_owned).or_else(|| {
            let own = element.child("link").and_then(|link| link.word("name")).map(str::to_owned);
            own.or(model.canonical.take())
        });
        let fixed = fixed_to(&attached_to, &attached, model.canonical.as_deref());
        model.attached.extend(fixed);
        model.attached.extend(attached);
        for child in element.children("joint") {
            let read = joint::read(child, version, &mut frames, &model, &mut self.notes)?;
            model.joints.extend(read);
        }
        for name in own_names {
            let pose = frames.resolve(&name, element)?;
            model.frames.insert(name, pose);
        }
        let (pose, relative_to) = frames::pose(element, &mut self.notes)?;
        let frame = element.word("placement_frame").map(str::to_owned);
        model.check_frame(frame.as_deref(), element)?;
        let relative_to = relative_to.filter(|to| version >= (1, 7) && *to != "world").map(str::to_owned);
        Ok((model, Placement { pose, frame, relative_to }))
    }

    /// Moves links and joints of nested models into the model. Their names get the nested model's name as a
    /// prefix, unless it is merged.
    fn take_nested(
        &mut self,
        nested: Vec<Nested>,
        frames: &mut Frames<'a>,
        model: &mut Model,
        element: Element<'a>,
    ) -> Result<(), Stop> {
        for nested in nested {
            let model_from_inner = frames.resolve(&nested.frame, element)?;
            let full = |own: &str| Nested::name(&nested.frame, nested.is_merged, own);
            let (name, inner) = (&nested.frame, nested.model);
            for (mut link, pose) in inner.links {
                link.name = full(&link.name);
                model.links.push((link, model_from_inner * pose));
            }
            for mut joint in inner.joints {
                joint.moved(&full, &model_from_inner);
                model.joints.push(joint);
            }
            model.named.extend(inner.named.into_iter().map(|(own, at)| (full(&own), at)));
            model.attached.extend(inner.attached.into_iter().map(|(own, link)| (full(&own), full(&link))));
            if let Some(canonical) = inner.canonical {
                model.attached.insert(name.clone(), full(&canonical));
                model.canonical.get_or_insert(full(&canonical));
            }
            model.self_collide |= inner.self_collide;
            model.stays_awake |= inner.stays_awake;
            if model.links.len() > crate::MAX_LINKS {
                let message = format!("the model has more than {} links", crate::MAX_LINKS);
                return Err(Stop::at(element, message));
            }
            if inner.is_static && !model.is_static {
                let message =
                    format!("the nested model {} is static: its links move nevertheless", quoted(name));
                self.notes.warn(element, Ignored, message);
            }
        }
        Ok(())
    }

    /// Reads an `<include>` of a world.
    pub(super) fn included(&mut self, include: Element<'a>) -> Result<Option<(Model, Placement)>, Stop> {
        self.included_at(include, 0)
    }

    /// Reports an included file without a model: with only lights it is complete.
    fn holds_no_model(&mut self, include: Element<'a>, root: Element<'a>) {
        let world = root.child("world").unwrap_or(root);
        let mut elements = world.elements().peekable();
        if elements.peek().is_some() && elements.all(|element| ["light", "actor"].contains(&element.tag())) {
            return self.notes.info(include, Ignored, "lights and actors are not read by simd");
        }
        let message = "the file holds no model: left out";
        self.notes.warn(include, Ignored, message);
        self.missing.get_or_insert(message.to_owned());
    }

    fn included_at(
        &mut self,
        include: Element<'a>,
        depth: usize,
    ) -> Result<Option<(Model, Placement)>, Stop> {
        let Some(uri) = include.text_of("uri") else {
            return Err(Stop::at(include, "it has no uri"));
        };
        let root =
            self.file_indices.get(include.folder(), uri).and_then(|index| Element::root(self.sources, index));
        let Some(root) = root else {
            if files::is_sun(uri) {
                self.notes.info(include, Ignored, "a light is not read by simd");
                return Ok(None);
            }
            let joined = files::joined(include.folder(), uri);
            let place = match joined.contains("://")
                && !joined.starts_with("model:")
                && !joined.starts_with("file:")
            {
                true => {
                    "nothing is fetched from the network; save the model beside the file and name its folder"
                }
                false => "`--package NAME=FOLDER` of simctl names the folder of a model or package",
            };
            let message = format!("{} is not found, and left out: {place}", quoted(&joined));
            self.notes.warn(include, Ignored, message.clone());
            self.missing.get_or_insert(message);
            return Ok(None);
        };
        let (mut model, mut placement) = if root.tag() == "robot" {
            self.urdf_model(include, root)?
        } else {
            let of_world = || root.child("world").and_then(|it| it.child("model"));
            let Some(element) = root.child("model").or_else(of_world) else {
                self.holds_no_model(include, root);
                return Ok(None);
            };
            self.model(element, depth + 1)?
        };
        if let Some(name) = include.text_of("name") {
            model.name = name.to_owned();
        }
        if let Some(is_static) = include.says("static") {
            model.is_static = is_static;
        }
        if include.child("pose").is_some() {
            let (pose, relative_to) = frames::pose(include, &mut self.notes)?;
            let frame = include.text_of("placement_frame").map(str::to_owned).or(placement.frame);
            model.check_frame(frame.as_deref(), include)?;
            let relative_to = relative_to.filter(|to| *to != "world").map(str::to_owned);
            placement = Placement { pose, frame, relative_to };
        }
        Ok(Some((model, placement)))
    }
}

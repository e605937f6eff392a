//! Reads SDF, as Gazebo writes it (1.4 to 1.12), to drafts of robots.
//!
//! * `files`: includes.
//! * `model`: one model, with nested ones flattened into it.
//! * `frames`: poses of everything in a model.
//! * `link`, `joint` and `sensor`: parts of a model.
//! * `urdf_model`: an included URDF.
//! * `split`: splits a model into robots, each of which is a tree.
//! * `places`: joints between models.

mod files;
mod frames;
mod joint;
mod link;
mod model;
mod places;
mod sensor;
mod split;
mod urdf_model;

use std::collections::BTreeMap;

use glamx::DPose3;

use crate::assets::Assets;
use crate::limits::LoadLimits;
use crate::report::Disposition::{Ignored, Used};
use crate::report::counted;
use crate::translation::draft::{Draft, Names};
use crate::translation::element::{Element, report_unknown};
use crate::translation::frames::hang;
use crate::translation::notes::{Notes, Stop};
use crate::translation::sources::{Source, Texts};
use crate::translation::{Format, Translation, unread, write};
use crate::urdf::Refused;
use files::FileIndices;
use frames::Frames;
use model::{Model, Placement};
use places::Between;

/// Maximum number of elements of all files; includes count each time.
const BUDGET: usize = 300_000;

/// State of reading an SDF.
struct Reader<'a> {
    sources: &'a [Source<'a>],
    file_indices: &'a FileIndices,
    assets: &'a dyn Assets,
    limits: &'a LoadLimits,
    notes: Notes,
    /// Elements that may still be read.
    left: usize,
    /// Links that were read.
    links: usize,
    /// The first include that is missing.
    missing: Option<String>,
}

/// Translates an SDF to URDF.
///
/// # Errors
/// Returns an error if the file cannot be read, is too large, or has no model.
pub(crate) fn translate(
    bytes: &[u8],
    assets: &dyn Assets,
    limits: &LoadLimits,
) -> Result<Translation, Refused> {
    let empty = || Notes::new(limits.findings);
    let mut texts = Texts::new(bytes, "SDF", limits).map_err(|stop| empty().refused(stop))?;
    let file_indices = files::gather(&mut texts, assets, limits).map_err(|stop| empty().refused(stop))?;
    let sources = texts.parse(limits).map_err(|stop| empty().refused(stop))?;
    let notes = texts.notes(limits.findings);
    let mut reader = Reader {
        sources: &sources,
        file_indices: &file_indices,
        assets,
        limits,
        notes,
        left: BUDGET,
        links: 0,
        missing: None,
    };
    let drafts = match reader.all() {
        Ok(drafts) => drafts,
        Err(stop) => return Err(reader.notes.refused(stop)),
    };
    unread::report(&sources, &mut reader.notes);
    let names: Vec<String> = sources.iter().map(|source| source.uri.clone()).collect();
    Ok(Translation {
        meshes: BTreeMap::new(),
        format: Format::Sdf,
        models: drafts.iter().map(|draft| write::urdf(draft, names.clone())).collect(),
        included: texts.asked.clone(),
        missing: reader.missing,
        report: reader.notes.into_report(),
    })
}

impl<'a> Reader<'a> {
    /// Returns all robots of the file.
    fn all(&mut self) -> Result<Vec<Draft>, Stop> {
        let Some(root) = Element::root(self.sources, 0) else { return Ok(Vec::new()) };
        self.check_version(root);
        let mut top = Top::default();
        top.frames.is_world = true;
        for element in root.elements() {
            match element.tag() {
                "world" => self.world(element, &mut top)?,
                "model" => top.take(self.model(element, 0)?, element),
                "include" => {
                    if let Some(placed) = self.included(element)? {
                        top.take(placed, element);
                    }
                }
                "light" | "actor" => self.notes.info(element, Ignored, "not read by simd"),
                _ => {
                    let message = "not read by simd: it is neither a model nor a world";
                    self.notes.info(element, Ignored, message);
                }
            }
        }
        let mut drafts: Vec<Draft> = Vec::new();
        let mut names = Names::default();
        let (mut links, mut shapes) = (0, 0);
        let mut between = std::mem::take(&mut top.between);
        for (model, pose) in top.placed()? {
            let known = between.links_of(&model, pose);
            let mut of_model = split::robots(model, pose, &mut self.notes);
            let given: BTreeMap<String, String> = of_model
                .iter_mut()
                .map(|draft| {
                    let name = names.unique(&draft.name);
                    (std::mem::replace(&mut draft.name, name.clone()), name)
                })
                .collect();
            for draft in of_model.iter_mut() {
                let ends = draft.constraints.iter_mut().flat_map(|constraint| &mut constraint.ends);
                for other in ends.filter_map(|end| end.robot.as_mut()) {
                    if let Some(name) = given.get(other) {
                        other.clone_from(name);
                    }
                }
            }
            between.place(known, drafts.len(), &of_model);
            for draft in of_model {
                links += draft.links.len();
                shapes +=
                    draft.links.iter().map(|link| link.visuals.len() + link.collisions.len()).sum::<usize>();
                // The reader of URDF checks the limits of each robot; here the text of all robots is bounded.
                if links > crate::MAX_LINKS || shapes > self.limits.shapes.max(crate::MAX_LINKS) {
                    let (most, shapes) = (crate::MAX_LINKS, self.limits.shapes.max(crate::MAX_LINKS));
                    let message =
                        format!("all its models together have more than {most} links or {shapes} shapes");
                    return Err(Stop::of_file(None, None, message));
                }
                drafts.push(draft);
            }
        }
        if drafts.is_empty() {
            let missing = self.missing.as_ref().map_or_else(String::new, |missing| format!("; {missing}"));
            let message = format!("this SDF has no model that simd could have in its world{missing}");
            return Err(Stop::at(root, message));
        }
        between.connect(&mut top.frames, &mut drafts, &mut self.notes)?;
        hang(&mut drafts, (root, "frame"), self.limits, &mut self.notes);
        Ok(drafts)
    }

    fn check_version(&mut self, root: Element<'a>) {
        let known = root.word("version").and_then(version);
        match known {
            Some((1, minor)) if minor <= 12 => {}
            _ => {
                let said = root.word("version").unwrap_or("none");
                let message = format!("its version is {said:.20}: read as far as versions 1.4 to 1.12 go");
                self.notes.info(root, Used, message);
            }
        }
    }

    fn world(&mut self, world: Element<'a>, top: &mut Top<'a>) -> Result<(), Stop> {
        for element in world.elements() {
            self.spend(element)?;
            match element.tag() {
                "model" => top.take(self.model(element, 0)?, element),
                "include" => match self.included(element)? {
                    Some(placed) => top.take(placed, element),
                    None => top.between.lose(model::include_name(element)),
                },
                "physics" => self.physics(element)?,
                "gravity" => {
                    let message =
                        format!("gravity belongs to the world, and does not change: {:.60}", element.text());
                    self.notes.info(element, Ignored, message);
                }
                "joint" => top.between.add(element),
                "frame" => {
                    let (pose, relative_to) = frames::pose(element, &mut self.notes)?;
                    let relative_to = relative_to.or(element.word("attached_to"));
                    match element.word("name") {
                        Some(name) => {
                            top.between.attach(name, element.word("attached_to"));
                            top.frames.add(name, pose, relative_to, element);
                        }
                        None => self.notes.warn(element, Ignored, "it has no name; left out"),
                    }
                }
                _ => {}
            }
        }
        let frames = world.children("frame").count();
        if frames > 0 {
            let message = format!("{} of the world only for poses: not of a link", counted(frames, "frame"));
            self.notes.info(world, Used, message);
        }
        let known = ["model", "include", "physics", "gravity", "joint", "frame"];
        report_unknown(world, &known, ": the world is the daemon's", &mut self.notes);
        Ok(())
    }

    fn physics(&mut self, element: Element<'a>) -> Result<(), Stop> {
        let step = element.number_of("max_step_size", &mut self.notes)?;
        let step = step.map_or_else(String::new, |step| format!(" (a step of {step} s)"));
        let message = format!("settings of the physics belong to the world, and do not change{step}");
        self.notes.info(element, Ignored, message);
        Ok(())
    }

    /// Counts what is read, with all that is in it.
    fn spend(&mut self, at: Element) -> Result<(), Stop> {
        let count = match at.tag() {
            // Its children are counted separately.
            "model" | "include" | "world" => 1,
            _ => at.node.descendants().take(BUDGET).count(),
        };
        self.left = self.left.saturating_sub(count);
        if self.left > 0 {
            return Ok(());
        }
        Err(Stop::at(at, format!("with its included files it has more than {BUDGET} elements")))
    }
}

/// The models of a file, and the frames of its world, which they may be relative to.
#[derive(Default)]
struct Top<'a> {
    models: Vec<(Model, Placement, Element<'a>)>,
    frames: Frames<'a>,
    between: Between<'a>,
}

impl<'a> Top<'a> {
    fn take(&mut self, (model, placement): (Model, Placement), at: Element<'a>) {
        let pose = placement.parent_from_model(&model);
        self.frames.add(&model.name, pose, placement.relative_to.as_deref(), at);
        for (own, pose) in &model.frames {
            self.frames.add(&format!("{}::{own}", model.name), *pose, Some(&model.name), at);
        }
        self.models.push((model, placement, at));
    }

    /// Models with `world_from_model`. The first of several models of one name has the name's frame.
    fn placed(&mut self) -> Result<Vec<(Model, DPose3)>, Stop> {
        for (name, at) in self.frames.names() {
            self.frames.resolve(&name, at)?;
        }
        let mut placed = Vec::new();
        for (model, placement, at) in std::mem::take(&mut self.models) {
            let parent = match &placement.relative_to {
                Some(frame) => self.frames.resolve(frame, at)?,
                None => DPose3::IDENTITY,
            };
            let pose = parent * placement.parent_from_model(&model);
            placed.push((model, pose));
        }
        Ok(placed)
    }
}

/// Parses major and minor version.
fn version(text: &str) -> Option<(u32, u32)> {
    let (major, minor) = text.split_once('.').unwrap_or((text, "0"));
    Some((major.parse().ok()?, minor.parse().ok()?))
}

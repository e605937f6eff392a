//! Reads MJCF, MuJoCo's format, to drafts of robots.
//!
//! * `files`: includes. `compiler`: settings. `defaults`: classes. `value`: numbers and orientations.
//! * `assets`: meshes, height fields, materials. `inline_mesh`: meshes without a file.
//! * `body`, `joint`, `geom`, `mesh_inertia`: the moving bodies. `fit`: primitives fitted to meshes.
//! * `gravity`: bodies without weight.
//! * `replicate`: copies. `attach`: parts of other files.
//! * `actuator`, `equality`, `tendon`, `keyframe`: settings of joints. `coupling`: joints that follow others.
//!   `spring_damper`: springs that depend on inertias.
//! * `sensor`: sensors. `split`: splits bodies into robots.
//!
//! A body without a joint to the world does not move. All such bodies are one robot; each other child of the
//! world is one with its descendants. Ignored elements (spatial tendons, muscles, skins, flexible bodies) are in
//! the report.

mod actuator;
mod assets;
mod attach;
mod body;
mod builtin_texture;
mod compiler;
mod coupling;
mod defaults;
mod equality;
mod files;
mod fit;
mod geom;
mod gravity;
mod inline_mesh;
mod joint;
mod keyframe;
mod mesh_inertia;
mod replicate;
mod sensor;
mod split;
mod spring_damper;
mod tendon;
mod value;

use std::collections::BTreeMap;

use glamx::DPose3;

use crate::assets::Assets;
use crate::limits::LoadLimits;
use crate::report::Disposition::Ignored;
use crate::translation::draft::{Draft, Names};
use crate::translation::element::Element;
use crate::translation::frames::hang;
use crate::translation::notes::{Notes, Stop};
use crate::translation::sources::{Source, Texts};
use crate::translation::{Format, Translation, unread, write};
use crate::urdf::Refused;
use assets::Library;
use attach::Attachable;
use body::Body;
use compiler::Compiler;
use defaults::Classes;
use files::FileIndices;
use inline_mesh::Made;

/// State of reading an MJCF.
struct Reader<'a> {
    sources: &'a [Source<'a>],
    file_indices: &'a FileIndices,
    limits: &'a LoadLimits,
    assets: &'a dyn Assets,
    /// Scope of the file whose elements are read.
    scope: Scope<'a>,
    attachable: Attachable<'a>,
    made: Made,
    notes: Notes,
    /// The world, and all bodies depth first.
    bodies: Vec<Body>,
    /// Names of bodies.
    names: Names,
    geoms: usize,
    /// Elements of copies, and attached elements.
    replicated: usize,
    /// By name: the site's body, and `body_from_site`.
    sites: BTreeMap<String, (usize, DPose3)>,
}

/// Settings of one file for reading its elements.
#[derive(Default)]
struct Scope<'a> {
    compiler: Compiler,
    classes: Classes<'a>,
    library: Library,
    /// Indices of the files that may be attached, by the names of the models.
    models: BTreeMap<&'a str, usize>,
}

/// Translates an MJCF to URDF.
///
/// # Errors
/// Returns an error if the file cannot be read, is too large, or has no body.
pub(crate) fn translate(
    bytes: &[u8],
    assets: &dyn Assets,
    limits: &LoadLimits,
) -> Result<Translation, Refused> {
    let empty = || Notes::new(limits.findings);
    let mut texts = Texts::new(bytes, "MJCF", limits).map_err(|stop| empty().refused(stop))?;
    let file_indices = files::gather(&mut texts, assets, limits).map_err(|stop| empty().refused(stop))?;
    let sources = texts.parse(limits).map_err(|stop| empty().refused(stop))?;
    let mut reader = Reader {
        sources: &sources,
        file_indices: &file_indices,
        limits,
        assets,
        scope: Scope::default(),
        attachable: Attachable::default(),
        made: Made::default(),
        notes: texts.notes(limits.findings),
        bodies: Vec::new(),
        names: Names::default(),
        geoms: 0,
        replicated: 0,
        sites: BTreeMap::new(),
    };
    let drafts = match reader.all() {
        Ok(drafts) => drafts,
        Err(stop) => return Err(reader.notes.refused(stop)),
    };
    unread::report(&sources, &mut reader.notes);
    let names: Vec<String> = sources.iter().map(|source| source.uri.clone()).collect();
    Ok(Translation {
        format: Format::Mjcf,
        models: drafts.iter().map(|draft| write::urdf(draft, names.clone())).collect(),
        included: texts.asked.clone(),
        missing: None,
        meshes: reader.made.files,
        report: reader.notes.into_report(),
    })
}

impl<'a> Reader<'a> {
    /// Returns all robots of the file.
    fn all(&mut self) -> Result<Vec<Draft>, Stop> {
        let Some(root) = Element::root(self.sources, 0) else { return Ok(Vec::new()) };
        let sections = files::expanded(root, self.sources, self.file_indices)?;
        let of = |tag: &'static str| sections.iter().copied().filter(move |section| section.tag() == tag);
        self.scope = self.read_scope(0)?;
        self.report_sections(&sections);
        self.bodies.push(Body::world(root));
        for section in of("worldbody") {
            self.content(section, 0, body::Inside::world())?;
        }
        self.finish_masses();
        spring_damper::set(&mut self.bodies, &mut self.notes);
        let mut joints = joint::Joints::of(&self.bodies);
        let mut tendons = Vec::new();
        for section in of("tendon") {
            tendons.extend(files::expanded(section, self.sources, self.file_indices)?);
        }
        tendon::read(&tendons, &mut joints, &mut self.notes)?;
        let mut held = Vec::new();
        for section in of("equality") {
            let elements = files::expanded(section, self.sources, self.file_indices)?;
            equality::read(&elements, self, &mut joints, &mut held)?;
        }
        let mut actuators = Vec::new();
        for section in of("actuator") {
            actuators.extend(files::expanded(section, self.sources, self.file_indices)?);
        }
        tendon::apply(&tendons, &actuators, self, &mut joints)?;
        actuator::read(&actuators, self, &mut joints)?;
        gravity::settle(&mut self.bodies, &joints, &mut self.notes);
        let mut keys = Vec::new();
        for section in of("keyframe") {
            let elements = files::expanded(section, self.sources, self.file_indices)?;
            keys.extend(keyframe::read(&elements, &self.bodies, &mut self.notes)?);
        }
        let mut excluded = Vec::new();
        for section in of("contact") {
            let elements = files::expanded(section, self.sources, self.file_indices)?;
            excluded.extend(self.excludes(&elements));
        }
        let mut measured = Vec::new();
        for section in of("sensor") {
            let elements = files::expanded(section, self.sources, self.file_indices)?;
            measured.extend(sensor::read(&elements, self));
        }
        let name = root.word("model").unwrap_or_default();
        let said = split::Said { joints: &joints, keys: &keys, excluded: &excluded, held: &held };
        let mut drafts = split::robots(root, name, &self.bodies, &said, &mut self.notes);
        sensor::give(measured, &mut drafts, &mut self.notes);
        hang(&mut drafts, (root, "site"), self.limits, &mut self.notes);
        if drafts.is_empty() {
            return Err(Stop::at(root, "it has no body that simd could have in its world"));
        }
        Ok(drafts)
    }

    /// Reports sections that are not read.
    fn report_sections(&mut self, sections: &[Element<'a>]) {
        for section in sections {
            match section.tag() {
                "compiler" | "default" | "asset" | "worldbody" | "actuator" | "equality" | "keyframe"
                | "tendon" | "contact" | "sensor" | "size" | "visual" | "statistic" | "custom" => {}
                "option" => {
                    let message = "settings of the physics belong to the world, and do not change";
                    self.notes.info(*section, Ignored, message);
                }
                "deformable" | "extension" => {
                    for element in section.elements() {
                        self.notes.warn(element, Ignored, "not read by simd: left out");
                    }
                }
                _ => self.notes.info(*section, Ignored, "not read by simd"),
            }
        }
    }

    /// Returns pairs of bodies that do not collide.
    fn excludes(&mut self, elements: &[Element<'a>]) -> Vec<([String; 2], (usize, u32))> {
        let mut excluded = Vec::new();
        for element in elements {
            match (element.tag(), element.word("body1"), element.word("body2")) {
                ("exclude", Some(one), Some(other)) => {
                    excluded.push(([one.to_owned(), other.to_owned()], (element.file, element.line())));
                }
                ("exclude", _, _) => {
                    self.notes.warn(*element, Ignored, "it does not name two bodies; left out")
                }
                _ => {
                    let message = "not read by simd: contype and conaffinity decide which bodies collide";
                    self.notes.warn(*element, Ignored, message);
                }
            }
        }
        excluded
    }
}

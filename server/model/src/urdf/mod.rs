//! From URDF text to a robot.
//!
//! The way in, each step in its file: `text` (bytes to text), `document` (what
//! is wrong around the root), `prescan` (size, depth and syntax, with line
//! numbers), `repair` (the document as urdf-rs takes it, every number checked),
//! urdf-rs, `tree` (one root, no loops), `link`, `joint` and `inertial` (what the
//! numbers mean), `scale`. `findings` is the report on the way.

mod constraints;
mod control;
mod deadline;
mod document;
pub(crate) mod findings;
mod gazebo;
pub(crate) mod geometry;
mod inertial;
mod joint;
mod link;
mod material;
pub(crate) mod mend;
mod meshes;
mod mimic;
pub(crate) mod numbers;
pub(crate) mod prescan;
mod repair;
mod rewrite;
mod scale;
mod sensors;
mod setup;
mod srdf;
mod states;
mod surface;
#[cfg(test)]
mod tests;
pub(crate) mod text;
mod transmission;
mod tree;
mod unknown;
mod used;
mod vocabulary;

use std::sync::Arc;

use crate::limits::LoadLimits;
use crate::report::LoadReport;
use crate::robot::{MeshAsset, RobotModel, Sha256};
use deadline::Deadline;
use findings::{Findings, Refusal};
use gazebo::Gazebo;

pub use meshes::{first_places, other_case};
pub use rewrite::{readdress, with_states};
pub use srdf::{Srdf, SrdfPair, read_srdf};

/// A file that a description names.
#[derive(Clone, Debug, PartialEq)]
pub struct Asset {
    /// SHA-256 of `bytes`.
    pub sha256: Sha256,
    /// The whole file.
    pub bytes: Arc<[u8]>,
}

/// Where [`read`] gets the files that a description names.
pub trait Assets {
    /// The file for a URI as the description writes it, or the places where it
    /// was looked for.
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>>;

    /// What had to be forgiven to find it, for instance capital letters, as a
    /// fragment of a sentence.
    fn note(&self, uri: &str) -> Option<String> {
        let _ = uri;
        None
    }

    /// The mesh of this look, which is its file's hash where that names no others, read as this format: by `read`, which
    /// says in a fragment of a sentence why not, or from where it was kept. By default nothing is kept.
    fn mesh(
        &self,
        look: Sha256,
        format: &str,
        read: &mut dyn FnMut() -> Result<MeshAsset, String>,
    ) -> Result<Arc<MeshAsset>, String> {
        let _ = (look, format);
        read().map(Arc::new)
    }
}

/// How to read.
#[derive(Clone, Copy, Debug)]
pub struct ReadOptions {
    /// Lengths are multiplied by it, inertias by its square; masses stay.
    /// Above 0 and at most 1000.
    pub scale: f64,
    /// Refuse a robot whose report has a warning, which every repair is: those
    /// are errors then. A visual mesh that is missing or cannot be read is
    /// warned of, but never refused.
    pub strict: bool,
    /// What the description must stay within.
    pub limits: LoadLimits,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { scale: 1.0, strict: false, limits: LoadLimits::default() }
    }
}

/// Why a description is refused, as a sentence, and all that was found before.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct Refused {
    /// Names the element and the line.
    pub message: String,
    /// Ends with the finding that refuses.
    pub report: LoadReport,
}

/// What can be said of a description without its assets.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// `name` of the `<robot>`.
    pub name: String,
    /// URIs of meshes and then of pictures as written, in the order of first use, each once. Of an SDF or MJCF those of the
    /// files that it includes come first. Last are those that meshes name which are there: pictures, and materials of OBJ.
    pub asset_uris: Vec<String>,
    /// Names of the robots of an SDF or MJCF, where all that it includes is there.
    pub models: Vec<String>,
}

/// The robot's name and the files that it needs.
///
/// # Errors
///
/// What is not a URDF, or too large; a robot that [`read`] refuses for its
/// meaning is described all the same.
pub fn describe(urdf: &[u8], limits: &LoadLimits) -> Result<Description, Refused> {
    let mut findings = Findings::new(limits.findings);
    let described = document::open(urdf, limits, &mut findings, |root, _| Ok(prescan::description(root)));
    described.map_err(|refusal| findings.refused(refusal))
}

/// The robot, and what was done to its description on the way.
///
/// # Errors
///
/// What is not a URDF, or too large; elements that cannot be understood or do
/// not form one tree; with `strict`, any warning.
pub fn read(
    urdf: &[u8],
    assets: &dyn Assets,
    options: &ReadOptions,
) -> Result<(RobotModel, LoadReport), Refused> {
    let mut findings = Findings::new(options.limits.findings);
    match model(urdf, assets, options, &mut findings) {
        Ok(model) => Ok((model, findings.into_report())),
        Err(refusal) => Err(findings.refused(refusal)),
    }
}

fn model(
    urdf: &[u8],
    assets: &dyn Assets,
    options: &ReadOptions,
    findings: &mut Findings,
) -> Result<RobotModel, Refusal> {
    scale::check(options.scale)?;
    let deadline = Deadline::new(options.limits.time);
    document::open(urdf, &options.limits, findings, |root, findings| {
        from_element(root, assets, options, &deadline, findings)
    })
}

fn from_element(
    root: roxmltree::Node,
    assets: &dyn Assets,
    options: &ReadOptions,
    deadline: &Deadline,
    findings: &mut Findings,
) -> Result<RobotModel, Refusal> {
    let limits = &options.limits;
    deadline.check()?;
    let mut repaired = repair::repair(root, limits, findings)?;
    tree::rename_twins(&mut repaired, findings);
    let tree = tree::build(&repaired, findings)?;

    let gazebo = Gazebo::of(&repaired, findings);
    let mut links = link::read_all(&repaired, &tree, assets, &gazebo, (limits, deadline), findings)?;
    let mut joints = joint::read_all(&repaired, &tree, findings)?;
    inertial::resolve(&repaired, &tree, &joints, &mut links, findings);
    let setup = setup::read(&repaired, &tree, &gazebo, &mut links, &mut joints, findings);
    let mut model = RobotModel { name: repaired.robot.name.clone(), links, joints, setup };
    scale::apply(&mut model, options.scale);
    used::report(&model, &tree, findings);
    if options.strict {
        findings.refuse_warnings()?
    }
    deadline.check()?;
    Ok(model)
}

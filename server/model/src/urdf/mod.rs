//! Reads URDF text to a robot.
//!
//! The steps are, each in its file:
//!
//! * `text`: bytes to text.
//! * `document`: repairs around the root.
//! * `prescan`: size, depth and syntax, with line numbers.
//! * `repair`: the elements that simd reads, every number checked. `parts`: the robot of urdf-rs of them.
//! * `tree`: one root, no loops.
//! * `link`, `joint`, `inertial`: meaning of the numbers.
//! * `scale`: the scaled robot.
//!
//! `findings` is the report.

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
mod parts;
pub(crate) mod prescan;
mod repair;
mod rewrite;
mod scale;
mod sensors;
mod setup;
mod srdf;
mod states;
mod surface;
mod tendon;
#[cfg(test)]
mod tests;
pub(crate) mod text;
mod transmission;
mod tree;
mod unknown;
mod used;
mod vocabulary;

use crate::assets::Assets;
use crate::limits::LoadLimits;
use crate::report::LoadReport;
use crate::robot::RobotModel;
use deadline::Deadline;
use findings::{Findings, Refusal};
use gazebo::Gazebo;

pub use meshes::other_case;
pub use rewrite::{readdress, with_states};
pub use srdf::{Srdf, SrdfPair, read_srdf};

/// Options of reading.
#[derive(Clone, Copy, Debug)]
pub struct ReadOptions {
    /// Factor on lengths; inertias are multiplied by its square, masses do not change. Above 0 and at most
    /// 1000.
    pub scale: f64,
    /// Refuse a robot whose report has a warning, which includes every repair. A visual mesh that is missing
    /// or unreadable is only a warning.
    pub strict: bool,
    /// Limits of the description.
    pub limits: LoadLimits,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { scale: 1.0, strict: false, limits: LoadLimits::default() }
    }
}

/// Reason why a description is refused, as a sentence, with all findings before.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct Refused {
    /// Names the element and the line.
    pub message: String,
    /// Ends with the finding that refuses it.
    pub report: LoadReport,
}

/// Facts about a description without its assets.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// `name` of the `<robot>`.
    pub name: String,
    /// URIs of meshes and then of pictures as written, in the order of first use, each once. Before these
    /// come the files that an SDF or MJCF includes. Last come the files that present meshes name: pictures,
    /// and materials of OBJ.
    pub asset_uris: Vec<String>,
    /// Names of the robots of an SDF or MJCF, if all of its includes are present.
    pub models: Vec<String>,
}

/// Returns the robot's name and the files that it needs.
///
/// # Errors
///
/// Returns an error if the text is not a URDF, or too large. A robot that [`read`] refuses for its meaning is
/// still described.
pub fn describe(urdf: &[u8], limits: &LoadLimits) -> Result<Description, Refused> {
    let mut findings = Findings::new(limits.findings);
    let described = document::open(urdf, limits, &mut findings, |root, _| Ok(prescan::description(root)));
    described.map_err(|refusal| findings.refused(refusal))
}

/// Returns the robot, and the report on its description.
///
/// # Errors
///
/// Returns an error for text that is not a URDF or too large. Elements that cannot be understood or do not form
/// one tree are errors too, and with `strict` any warning.
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
    let tendons = tendon::read(&repaired, &tree, &joints, &links, findings);
    let setup = setup::read(&repaired, &tree, &gazebo, (&mut links, &mut joints, tendons), findings);
    let mut model = RobotModel { name: repaired.robot.name.clone(), links, joints, setup };
    scale::apply(&mut model, options.scale);
    used::report(&model, &tree, findings);
    if options.strict {
        findings.refuse_warnings()?
    }
    deadline.check()?;
    Ok(model)
}

//! Translates descriptions of other formats to URDF.
//!
//! One reader, of URDF, decides the meaning of a description. SDF and MJCF are read into a [`Draft`], which
//! is written as URDF. Extensions of Gazebo, ROS, MoveIt and MuJoCo replace elements that URDF lacks; the reader
//! knows all of them. Each line of that text knows its source line, so that reports name the file
//! that was sent.
//!
//! * `sources`: the files of a description, parsed within limits. `element`: their elements.
//! * `notes`: the report of the translation. `draft`: its result. `write`: writes the draft as URDF.
//! * `unread`: elements and attributes that no reader looked at.

pub(crate) mod draft;
pub(crate) mod element;
pub(crate) mod notes;
pub(crate) mod sources;
#[cfg(test)]
mod tests;
pub(crate) mod unread;
pub(crate) mod write;

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glamx::DPose3;

use crate::limits::LoadLimits;
use crate::mesh::beside;
use crate::report::LoadReport;
use crate::robot::{MeshAsset, Sha256};
use crate::urdf::{Asset, Assets, Description, Refused};
use crate::{mjcf, sdf, urdf};

/// Format of a file, by its root element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// URDF, and all files of unknown formats.
    Urdf,
    /// Gazebo's format.
    Sdf,
    /// MuJoCo's format.
    Mjcf,
}

/// A file of another format, translated to URDF.
#[derive(Clone, Debug, PartialEq)]
pub struct Translation {
    /// Format of the file.
    pub format: Format,
    /// One for each robot, in the order of the file. Names are unique.
    pub models: Vec<TranslatedModel>,
    /// URIs of the descriptions that it includes, found or not, in the order of their use.
    pub included: Vec<String>,
    /// A sentence about the first missing include: a strict load refuses it.
    pub missing: Option<String>,
    /// Mesh files that were made from numbers in the file itself, by their URIs in the URDF: see
    /// [`Translation::files`].
    pub meshes: BTreeMap<String, Asset>,
    /// Findings of the translation, without those of the URDF reader.
    pub report: LoadReport,
}

/// A robot of a file of another format.
#[derive(Clone, Debug, PartialEq)]
pub struct TranslatedModel {
    /// Name in the file.
    pub name: String,
    /// The robot as URDF.
    pub urdf: String,
    /// Pose of its root link: `world_from_root`.
    pub pose: DPose3,
    /// Whether its root link is fixed.
    pub fixed: bool,
    /// For each line of `urdf`, the index of its file and the line there. 0 is none.
    pub(crate) lines: Vec<(usize, u32)>,
    /// Names of the files: the file that was sent has an empty one.
    pub(crate) files: Vec<String>,
}

impl Format {
    /// Returns the format of a file by its beginning; the cost does not grow with the file.
    pub fn of(bytes: &[u8]) -> Self {
        /// Comments may precede roots, including licences.
        const MOST: usize = 64 << 10;
        let head: Vec<u8> = bytes.iter().take(MOST).copied().filter(|byte| *byte != 0).collect();
        let head = String::from_utf8_lossy(&head);
        let mut rest: &str = &head;
        while let Some(open) = rest.find('<') {
            rest = rest.get(open..).unwrap_or_default();
            let end = match rest {
                comment if comment.starts_with("<!--") => comment.find("-->"),
                other if other.starts_with("<?") || other.starts_with("<!") => other.find('>'),
                root => {
                    let name = root.get(1..).unwrap_or_default();
                    let end =
                        name.find(|c: char| c.is_whitespace() || c == '>' || c == '/').unwrap_or(name.len());
                    return match name.get(..end).unwrap_or_default() {
                        "sdf" | "gazebo" => Self::Sdf,
                        "mujoco" => Self::Mjcf,
                        _ => Self::Urdf,
                    };
                }
            };
            let Some(end) = end else { break };
            rest = rest.get(end + 1..).unwrap_or_default();
        }
        Self::Urdf
    }

    /// Returns its name in reports.
    pub fn word(self) -> &'static str {
        match self {
            Self::Urdf => "URDF",
            Self::Sdf => "SDF",
            Self::Mjcf => "MJCF",
        }
    }
}

/// Translates a file of another format to URDF; `None` if it has none of these formats. Meshes are only
/// requested if masses follow from them.
///
/// # Errors
///
/// Returns an error if the file cannot be read, is too large, or has nothing that simd supports.
pub fn translate(
    bytes: &[u8],
    assets: &dyn Assets,
    limits: &LoadLimits,
) -> Result<Option<Translation>, Refused> {
    match Format::of(bytes) {
        Format::Urdf => Ok(None),
        Format::Sdf => sdf::translate(bytes, assets, limits).map(Some),
        Format::Mjcf => mjcf::translate(bytes, assets, limits).map(Some),
    }
}

/// Describes a description of any format. `assets` are the present files of its includes and meshes.
///
/// # Errors
///
/// Returns an error if it cannot be read at all although all of its includes are present.
pub fn describe_with(bytes: &[u8], assets: &dyn Assets, limits: &LoadLimits) -> Result<Description, Refused> {
    /// Maximum number of URIs of pictures and materials.
    const MOST: usize = 10_000;
    let mut description = describe_alone(bytes, assets, limits)?;
    let mut seen: BTreeSet<String> = description.asset_uris.iter().cloned().collect();
    for uri in description.asset_uris.clone() {
        for named in beside::uris(&uri, assets) {
            if seen.len() < MOST && seen.insert(named.clone()) {
                description.asset_uris.push(named);
            }
        }
    }
    Ok(description)
}

/// Likewise, without the files that meshes name.
fn describe_alone(bytes: &[u8], assets: &dyn Assets, limits: &LoadLimits) -> Result<Description, Refused> {
    if Format::of(bytes) == Format::Urdf {
        return urdf::describe(bytes, limits);
    }
    let asked = Asked { assets, found: RefCell::default(), missing: RefCell::default() };
    let translation = match translate(bytes, &asked, limits) {
        Ok(Some(translation)) => translation,
        Ok(None) => return urdf::describe(bytes, limits),
        // A client that sends the missing files learns the rest.
        Err(_) if !asked.missing.borrow().is_empty() => {
            let found = asked.found.into_inner();
            let asset_uris = found.into_iter().chain(asked.missing.into_inner()).collect();
            return Ok(Description { name: String::new(), asset_uris, models: Vec::new() });
        }
        Err(refused) => return Err(refused),
    };
    let mut asset_uris = translation.included.clone();
    let mut seen: BTreeSet<String> = asset_uris.iter().cloned().collect();
    for model in &translation.models {
        let described = urdf::describe(model.urdf.as_bytes(), limits)?;
        asset_uris.extend(
            described
                .asset_uris
                .into_iter()
                .filter(|uri| !translation.meshes.contains_key(uri) && seen.insert(uri.clone())),
        );
    }
    // Other places at which a file may be found.
    asset_uris.extend(asked.missing.into_inner().into_iter().filter(|uri| seen.insert(uri.clone())));
    let models: Vec<String> = translation.models.iter().map(|model| model.name.clone()).collect();
    Ok(Description { name: models.first().cloned().unwrap_or_default(), asset_uris, models })
}

/// Files, with a record of the requested ones.
struct Asked<'a> {
    assets: &'a dyn Assets,
    found: RefCell<Vec<String>>,
    missing: RefCell<Vec<String>>,
}

impl Assets for Asked<'_> {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        let found = self.assets.find(uri);
        let list = if found.is_ok() { &self.found } else { &self.missing };
        let mut list = list.borrow_mut();
        if list.len() < 10_000 && !list.iter().any(|known| known == uri) {
            list.push(uri.to_owned());
        }
        found
    }
}

/// Files of a translated description: its own, and those that were made from it.
pub struct TranslatedFiles<'a> {
    files: &'a dyn Assets,
    made: &'a BTreeMap<String, Asset>,
}

impl Assets for TranslatedFiles<'_> {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        self.made.get(uri).map_or_else(|| self.files.find(uri), |made| Ok(made.clone()))
    }

    fn note(&self, uri: &str) -> Option<String> {
        if self.made.contains_key(uri) { None } else { self.files.note(uri) }
    }

    fn mesh(
        &self,
        look: Sha256,
        format: &str,
        read: &mut dyn FnMut() -> Result<MeshAsset, String>,
    ) -> Result<Arc<MeshAsset>, String> {
        self.files.mesh(look, format, read)
    }
}

impl Translation {
    /// Returns the files for reading its URDF; `files` are those of the file itself.
    pub fn files<'a>(&'a self, files: &'a dyn Assets) -> TranslatedFiles<'a> {
        TranslatedFiles { files, made: &self.meshes }
    }

    /// Returns the robot of a name, or the only one.
    ///
    /// # Errors
    ///
    /// Returns an error if no robot has the name, or if there are several and no name is given.
    pub fn model(&self, name: &str) -> Result<&TranslatedModel, Refused> {
        let found = match (&self.models[..], name) {
            ([only], "") => Some(only),
            (models, name) => models.iter().find(|model| model.name == name),
        };
        found.ok_or_else(|| {
            let names: Vec<String> =
                self.models.iter().take(20).map(|model| format!("{:?}", model.name)).collect();
            let names = names.join(", ");
            let count = self.models.len();
            let message = match name {
                "" => format!("the {} has {count} robots; choose one of them: {names}", self.format.word()),
                name => format!("the {} has no robot {name:?}; it has {names}", self.format.word()),
            };
            notes::refused(message, self.report.clone())
        })
    }
}

impl TranslatedModel {
    /// Converts a report on its URDF to one on the file that was sent.
    pub fn report(&self, report: LoadReport) -> LoadReport {
        let findings = report.findings.into_iter().map(|mut finding| {
            let (file, line) = finding
                .line
                .and_then(|line| self.lines.get((line as usize).checked_sub(1)?))
                .copied()
                .unwrap_or_default();
            finding.line = Some(line).filter(|line| *line > 0);
            let file = self.files.get(file).filter(|file| !file.is_empty());
            if finding.file.is_none() {
                finding.file = file.cloned();
            }
            finding
        });
        LoadReport { findings: findings.collect() }
    }
}

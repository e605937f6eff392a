//! A description of another format as URDF.
//!
//! One reader, of URDF, decides the meaning of a description. SDF and MJCF are read into a [`Draft`], which
//! is written as URDF. Extensions of Gazebo, ROS, MoveIt and MuJoCo replace elements that URDF lacks; the reader
//! knows all of them. Each line of that text knows its source line, so that reports name the file
//! that was sent.
//!
//! * `sources`: the files of a description, parsed within limits. `element`: their elements.
//! * `ellipsoid`: the shape that replaces one. `notes`: the report of the translation. `draft`: its result.
//!   `frames`: named frames as links. `write`: writes the draft as URDF.
//! * `unread`: elements and attributes that no reader looked at.

pub(crate) mod draft;
pub(crate) mod element;
pub(crate) mod ellipsoid;
pub(crate) mod frames;
pub(crate) mod notes;
pub(crate) mod sources;
#[cfg(test)]
mod tests;
pub(crate) mod unread;
pub(crate) mod write;

use std::collections::BTreeMap;
use std::sync::Arc;

use glamx::DPose3;

use crate::assets::{Asset, Assets};
use crate::report::{LoadReport, Severity};
use crate::robot::{MeshAsset, Sha256};
use crate::urdf::Refused;

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
    /// For each line of `urdf`, the index of its file and the line there. 0 means none.
    pub(crate) lines: Vec<(usize, u32)>,
    /// Names of the files: the file that was sent has an empty one.
    pub(crate) files: Vec<String>,
}

impl Format {
    /// Returns the format of a file by its beginning; the cost does not grow with the file.
    pub fn of(bytes: &[u8]) -> Self {
        /// Comments may precede roots, including licences.
        const MAX: usize = 64 << 10;
        let head: Vec<u8> = bytes.iter().take(MAX).copied().filter(|byte| *byte != 0).collect();
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
        let findings = report.findings.into_iter().filter_map(|mut finding| {
            let (file, line) = finding
                .line
                .and_then(|line| self.lines.get((line as usize).checked_sub(1)?))
                .copied()
                .unwrap_or_default();
            if (file, line) == draft::UNLISTED && finding.severity == Severity::Info {
                return None;
            }
            finding.line = Some(line).filter(|line| *line > 0);
            let file = self.files.get(file).filter(|file| !file.is_empty());
            if finding.file.is_none() {
                finding.file = file.cloned();
            }
            Some(finding)
        });
        LoadReport { findings: findings.collect() }
    }
}

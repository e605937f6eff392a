//! A case of the corpus: a small file, the files that it names, and the report that is expected.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use simd_assets::Locator;
use simd_model::robot::Sha256;
use simd_model::{Asset, Assets, Finding, LoadReport, ReadOptions, RobotModel};
use tempfile::TempDir;

use crate::meshes;

/// A TOML file of cases.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    case: Vec<Case>,
}

/// A file and its report. Exactly one of `urdf`, `robot`, `link`, `bare_link`, `joint` and `chain` gives the
/// content of the file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Case {
    /// The row of the table in `docs/urdf.md` that it is a case of.
    pub(crate) row: String,
    /// Short description.
    pub(crate) name: String,
    /// The whole file.
    urdf: Option<String>,
    /// Content of the `<robot>`, from line 2.
    robot: Option<String>,
    /// Content of a link with mass that hangs on a joint, on line 4.
    link: Option<String>,
    /// Content of such a link without another source of its mass.
    bare_link: Option<String>,
    /// Content of a joint, on line 5.
    joint: Option<String>,
    /// Content of each joint of a chain, on lines 3, 4, ...
    chain: Option<Vec<String>>,
    /// Type of the joint.
    #[serde(default = "revolute")]
    kind: String,
    /// Encoding of the text; UTF-8 if it is left out.
    #[serde(default)]
    encoding: String,
    /// Files beside it: their kinds, by path.
    #[serde(default)]
    files: BTreeMap<String, String>,
    /// Path of the URDF.
    #[serde(default = "beside")]
    at: String,
    /// Findings: severity, disposition, line, element, message. Findings for a link or a joint that is only a
    /// support of the case are left out.
    #[serde(default)]
    pub(crate) report: Vec<String>,
}

fn revolute() -> String {
    "revolute".to_owned()
}

fn beside() -> String {
    "r.urdf".to_owned()
}

/// Result of a case.
pub(crate) struct Outcome {
    pub(crate) model: Option<RobotModel>,
    pub(crate) report: LoadReport,
    /// Elements that are only supports of the case.
    props: &'static [&'static str],
    /// Folder of its files.
    folder: PathBuf,
}

const INERTIAL: &str = r#"<inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>"#;

impl Case {
    /// Returns all of them, in the order of the files.
    pub(crate) fn all() -> Vec<Self> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus/cases");
        let mut files: Vec<_> =
            std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        let read = |path: PathBuf| {
            let text = std::fs::read_to_string(&path).unwrap();
            toml::from_str::<File>(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display())).case
        };
        files.into_iter().flat_map(read).collect()
    }

    /// Returns the file as text, and its elements that are only supports of the case.
    fn text(&self) -> (String, &'static [&'static str]) {
        let link = |inertial: &str, content: &str| {
            format!(
                "<robot name=\"r\"><link name=\"base\"/>\n\
                 <joint name=\"j\" type=\"continuous\"><parent link=\"base\"/><child link=\"arm\"/><axis xyz=\"0 0 1\"/></joint>\n\
                 <link name=\"arm\">{inertial}\n{content}\n</link></robot>"
            )
        };
        let Self { urdf, robot, link: with_mass, bare_link, joint, chain, .. } = self;
        match (urdf, robot, with_mass, bare_link, joint, chain) {
            (Some(text), None, None, None, None, None) => (text.clone(), &[]),
            (None, Some(content), None, None, None, None) => {
                (format!("<robot name=\"r\">\n{content}\n</robot>"), &[])
            }
            (None, None, Some(content), None, None, None) => {
                (link(INERTIAL, content), &["link \"base\"", "joint \"j\""])
            }
            (None, None, None, Some(content), None, None) => {
                (link("", content), &["link \"base\"", "joint \"j\""])
            }
            (None, None, None, None, Some(content), None) => (self.with_joint(content), &["link"]),
            (None, None, None, None, None, Some(contents)) => (chained(contents), &["link"]),
            _ => panic!("{} / {} says not exactly once what is in the file", self.row, self.name),
        }
    }

    fn with_joint(&self, content: &str) -> String {
        let (kind, no_axis) = match self.kind.strip_suffix(" without axis") {
            Some(kind) => (kind, true),
            None => (self.kind.as_str(), content.contains("<axis")),
        };
        let axis = if no_axis { "" } else { "<axis xyz=\"0 0 1\"/>" };
        format!(
            "<robot name=\"r\">\n<link name=\"base\"/>\n<link name=\"arm\">{INERTIAL}</link>\n\
             <joint name=\"j\" type=\"{kind}\"><parent link=\"base\"/><child link=\"arm\"/>{axis}\n\
             {content}\n</joint></robot>"
        )
    }

    /// Returns the file as it is sent.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let (text, _) = self.text();
        let wide = |order: fn(u16) -> [u8; 2], mark: &str| {
            mark.encode_utf16().chain(text.encode_utf16()).flat_map(order).collect()
        };
        match self.encoding.as_str() {
            "" => text.into_bytes(),
            "utf-8 with mark" => format!("\u{feff}{text}").into_bytes(),
            "utf-16le" => wide(u16::to_le_bytes, ""),
            "utf-16be" => wide(u16::to_be_bytes, ""),
            "utf-16le with mark" => wide(u16::to_le_bytes, "\u{feff}"),
            "utf-16be with mark" => wide(u16::to_be_bytes, "\u{feff}"),
            "utf-32le with mark" => {
                format!("\u{feff}{text}").chars().flat_map(|c| u32::from(c).to_le_bytes()).collect()
            }
            "latin1" => text.chars().map(|c| u8::try_from(c).unwrap()).collect(),
            other => panic!("{}: no such encoding: {other}", self.name),
        }
    }

    /// Reads it as a daemon would that has its files.
    pub(crate) fn read(&self) -> Outcome {
        self.read_with(&ReadOptions::default())
    }

    pub(crate) fn read_strictly(&self) -> Outcome {
        self.read_with(&ReadOptions { strict: true, ..ReadOptions::default() })
    }

    fn read_with(&self, options: &ReadOptions) -> Outcome {
        let folder = TempDir::new().unwrap();
        let put = |path: &str, bytes: &[u8]| {
            let path = folder.path().join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, bytes).unwrap();
        };
        for (path, what) in &self.files {
            put(path, &meshes::made(what));
        }
        let bytes = self.bytes();
        put(&self.at, &bytes);
        let files = Disk(Locator::new(&folder.path().join(&self.at)));
        let (model, report) = match simd_model::read(&bytes, &files, options) {
            Ok((model, report)) => (Some(model), report),
            Err(refused) => (None, refused.report),
        };
        Outcome { model, report, props: self.text().1, folder: folder.path().canonicalize().unwrap() }
    }
}

fn chained(contents: &[String]) -> String {
    let link = |name: usize| format!("<link name=\"l{name}\">{INERTIAL}</link>");
    let links: String = (0..=contents.len()).map(link).collect();
    let joint = |(index, content): (usize, &String)| {
        let next = index + 1;
        format!(
            "<joint name=\"j{next}\" type=\"continuous\"><parent link=\"l{index}\"/><child link=\"l{next}\"/>\
             <axis xyz=\"0 0 1\"/>{content}</joint>\n"
        )
    };
    let joints: String = contents.iter().enumerate().map(joint).collect();
    format!("<robot name=\"r\">\n{links}\n{joints}</robot>")
}

/// Files on the disk, where clients look for them.
pub(crate) struct Disk(pub(crate) Locator);

impl Assets for Disk {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        let path = self.0.find(uri).map_err(|not_found| {
            if not_found.places.is_empty() {
                return vec![format!("nowhere, because {}", not_found.reason())];
            }
            not_found.places.iter().map(|place| place.display().to_string()).collect()
        })?;
        let bytes = std::fs::read(path).unwrap();
        Ok(Asset { sha256: Sha256::of(&bytes), bytes: bytes.into() })
    }

    fn note(&self, uri: &str) -> Option<String> {
        let other_case = || simd_model::other_case(uri, self.0.find(uri).ok()?.to_str()?);
        self.0.note(uri).or_else(other_case)
    }
}

impl Outcome {
    /// Returns the report as the cases write it.
    pub(crate) fn lines(&self) -> Vec<String> {
        let is_prop = |finding: &&Finding| {
            let quiet = finding.severity < simd_model::Severity::Error;
            quiet && self.props.iter().any(|prop| finding.element.starts_with(prop))
        };
        let findings = self.report.findings.iter().filter(|finding| !is_prop(finding));
        findings.map(|finding| self.line(finding)).collect()
    }

    fn line(&self, finding: &Finding) -> String {
        let Finding { severity, disposition, element, file, line, message } = finding;
        let line = line.map_or("-".to_owned(), |line| line.to_string());
        let file = file.as_ref().map(|file| format!(" [{file}]")).unwrap_or_default();
        let text = format!("{} {} {line} {element}{file}: {message}", severity.word(), disposition.word());
        // Which folder it was does not matter.
        text.replace(&self.folder.display().to_string(), "DIR")
    }
}

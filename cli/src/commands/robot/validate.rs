//! `simctl robot validate`: checks a description without a daemon.

use std::{fs, path::PathBuf};

use clap::Args;
use serde::Serialize;
use simd_client::{Locator, Package};
use simd_model::{
    Asset, Assets, Disposition, Finding, LoadReport, ReadOptions, RobotModel, Severity, robot::Sha256,
};

use super::package_folder::{PackageFolder, package_folder};
use super::{options, view::FindingView, xacro_argument};
use crate::{
    failure::hint,
    output::{Output, View, table::Page},
};

#[derive(Args, Debug)]
pub(crate) struct Validate {
    /// URDF, xacro, SDF or MJCF file, or the folder of a ROS package that holds one
    path: PathBuf,
    /// Turn each warning, which includes every repair, into an error
    #[arg(long)]
    strict: bool,
    /// Also show findings that need no attention: each link, joint and mesh, defaults, ignored parts
    #[arg(long)]
    all: bool,
    /// Factor on all lengths
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    scale: f64,
    /// Folder of a ROS package that the URDF names; may be repeated
    #[arg(long = "package", value_name = "NAME=FOLDER", value_parser = package_folder)]
    packages: Vec<PackageFolder>,
    /// Argument of a xacro file; may be repeated
    #[arg(long = "xacro-arg", value_name = "NAME=VALUE", value_parser = xacro_argument)]
    xacro_arguments: Vec<(String, String)>,
}

/// Reads the description as the daemon does. A refusal is a failure.
pub(crate) fn run(arguments: &Validate, output: Output) -> anyhow::Result<()> {
    let package =
        Package::open_with(&arguments.path, &options(&arguments.packages, &arguments.xacro_arguments))?;
    package.xacro_messages().iter().for_each(|message| hint(message));
    let options = ReadOptions { scale: arguments.scale, strict: arguments.strict, ..ReadOptions::default() };
    let Read { refusal, models, report } = read(&package, &options);
    output.one(&Validated::new(&package, arguments.all, &models, report))?;
    match refusal {
        None => Ok(()),
        Some(message) => anyhow::bail!("{}: refused: {message}", package.path.display()),
    }
}

/// Result of reading a description.
struct Read {
    refusal: Option<String>,
    /// One, or as many as an SDF or MJCF has; `None` if one of them is refused.
    models: Vec<RobotModel>,
    report: LoadReport,
}

fn read(package: &Package, options: &ReadOptions) -> Read {
    let files = Files(&package.locator);
    let refused = |refused: simd_model::Refused| Read {
        refusal: Some(refused.message),
        models: Vec::new(),
        report: refused.report,
    };
    let translation = match simd_model::translate(&package.urdf, &files, &options.limits) {
        Err(why) => return refused(why),
        Ok(Some(translation)) => translation,
        Ok(None) => {
            return match simd_model::read(&package.urdf, &files, options) {
                Ok((model, report)) => Read { refusal: None, models: vec![model], report },
                Err(why) => refused(why),
            };
        }
    };
    let files = translation.files(&files);
    let mut all = Read { refusal: None, models: Vec::new(), report: translation.report.clone() };
    for model in &translation.models {
        match simd_model::read(model.urdf.as_bytes(), &files, options) {
            Ok((read, report)) => {
                all.models.push(read);
                all.report.findings.extend(model.report(report).findings);
            }
            Err(why) => {
                let report = model.report(why.report);
                let reason = report.findings.last().map(|last| last.message.clone()).unwrap_or(why.message);
                all.refusal.get_or_insert(format!("robot {:?}: {reason}", model.name));
                all.report.findings.extend(report.findings);
            }
        }
    }
    if all.refusal.is_some() {
        all.models.clear();
    }
    all
}

/// The files of a description, at the places where clients look for them.
pub(super) struct Files<'p>(pub(super) &'p Locator);

impl Assets for Files<'_> {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        let path = self.0.find(uri).map_err(|not_found| {
            if not_found.places.is_empty() {
                return vec![format!("nowhere, because {}", not_found.reason())];
            }
            not_found.places.iter().map(|place| place.display().to_string()).collect()
        })?;
        let bytes = fs::read(&path).map_err(|error| vec![format!("{}: {error}", path.display())])?;
        Ok(Asset { sha256: Sha256::of(&bytes), bytes: bytes.into() })
    }

    fn note(&self, uri: &str) -> Option<String> {
        let other_case = || simd_model::other_case(uri, self.0.find(uri).ok()?.to_str()?);
        self.0.note(uri).or_else(other_case)
    }
}

#[derive(Serialize)]
struct Validated {
    path: String,
    loads: bool,
    /// Summary in one line.
    summary: String,
    /// Number of elements by treatment.
    counts: String,
    findings: Vec<FindingView>,
    #[serde(skip)]
    lines: Vec<String>,
    #[serde(skip)]
    left_out: usize,
}

impl Validated {
    fn new(package: &Package, all: bool, models: &[RobotModel], report: LoadReport) -> Self {
        let path = package.path.display().to_string();
        let location = |line: Option<u32>| match line {
            Some(line) => match package.xacro_source(line) {
                Some((file, line)) => format!("{}:{line}", file.display()),
                None => format!("{path}:{line}"),
            },
            None => path.clone(),
        };
        // The reason of a refusal comes last, as the failure.
        let counted = |finding: &&Finding| finding.disposition != Disposition::Refused;
        let shown = |finding: &&Finding| all || finding.severity >= Severity::Warning;
        let line = |finding: &Finding| {
            let Finding { severity, disposition, element, line, message, .. } = finding;
            let element = if element == "file" { String::new() } else { format!("{element}: ") };
            format!("{}: {}: {element}{message} ({})", location(*line), severity.word(), disposition.word())
        };
        let condensed = report.condensed();
        let lines: Vec<String> = condensed.findings.iter().filter(counted).filter(shown).map(line).collect();
        let summaries: Vec<String> = models.iter().map(|model| report.summary(model)).collect();
        let summary = if models.is_empty() { "refused".to_owned() } else { summaries.join(". ") };
        Self {
            loads: !models.is_empty(),
            summary,
            counts: report.counts(),
            left_out: report.findings.iter().filter(counted).filter(|finding| !shown(finding)).count(),
            lines,
            path,
            findings: report.findings.into_iter().map(view).collect(),
        }
    }
}

fn view(finding: Finding) -> FindingView {
    FindingView {
        severity: finding.severity.word().to_owned(),
        disposition: finding.disposition.word().to_owned(),
        element: finding.element,
        file: finding.file,
        line: finding.line,
        message: finding.message,
    }
}

impl View for Validated {
    fn page(&self) -> Page {
        let page = self.lines.iter().fold(Page::new(), |page, line| page.line(line));
        let more = if self.left_out > 0 { "; --all shows all" } else { "" };
        page.line(format!("{}: {}", self.path, self.summary)).line(format!("{}{more}", self.counts))
    }
}

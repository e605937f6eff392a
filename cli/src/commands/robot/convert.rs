//! `simctl robot convert`: a description as URDF.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context as _, bail};
use clap::Args;
use serde::Serialize;
use simd_client::{Package, replace_file};
use simd_model::{Finding, LoadLimits, Severity, TranslatedModel, Translation};

use super::package_folder::{PackageFolder, package_folder};
use super::{options, validate::Files, xacro_argument};
use crate::{
    failure::{hint, warn},
    output::{Output, View, table::Page},
};

#[derive(Args, Debug)]
pub(crate) struct Convert {
    /// SDF, MJCF, xacro or URDF file, or the folder of a ROS package that holds one
    path: PathBuf,
    /// Output file, or for all robots of an SDF or MJCF a folder; printed if left out. Meshes with their
    /// numbers in an MJCF become files in a folder beside it
    #[arg(long, value_name = "PATH")]
    to: Option<PathBuf>,
    /// Robot of an SDF or MJCF
    #[arg(long, value_name = "NAME")]
    model: Option<String>,
    /// Folder of a ROS package that the description names; may be repeated
    #[arg(long = "package", value_name = "NAME=FOLDER", value_parser = package_folder)]
    packages: Vec<PackageFolder>,
    /// Argument of a xacro file; may be repeated
    #[arg(long = "xacro-arg", value_name = "NAME=VALUE", value_parser = xacro_argument)]
    xacro_arguments: Vec<(String, String)>,
}

/// Reads the description as the daemon does.
pub(crate) fn run(arguments: &Convert, output: Output) -> anyhow::Result<()> {
    let package =
        Package::open_with(&arguments.path, &options(&arguments.packages, &arguments.xacro_arguments))?;
    package.xacro_messages().iter().for_each(|message| hint(message));
    let path = package.path.display();
    let translation = simd_model::translate(&package.urdf, &Files(&package.locator), &LoadLimits::default())
        .map_err(|refused| anyhow::anyhow!("{path}: refused: {refused}"))?;
    let Some(translation) = translation else {
        let text = String::from_utf8_lossy(&package.urdf).into_owned();
        let robot = Converted { model: String::new(), path: None, pose: None, fixed: None, urdf: Some(text) };
        return output.one(&Conversion { robots: vec![robot.written(arguments.to.as_ref())?] });
    };
    for finding in translation.report.condensed().at_least(Severity::Warning) {
        warn(&said(finding));
    }
    let models: Vec<&TranslatedModel> = match &arguments.model {
        Some(name) => vec![translation.model(name)?],
        None => translation.models.iter().collect(),
    };
    if let ([_, _, ..], None) = (&models[..], &arguments.to) {
        let names: Vec<&str> = models.iter().map(|model| model.name.as_str()).collect();
        bail!(
            "{path} holds several robots: choose one with --model, or write all into a folder with --to: {}",
            names.join(", ")
        );
    }
    if !translation.meshes.is_empty() && arguments.to.is_none() {
        warn("the meshes whose numbers stand in the file are not written: choose a folder with --to");
    }
    let is_alone = models.len() == 1;
    let mut robots = Vec::new();
    for model in models {
        let to = match &arguments.to {
            Some(folder) if !is_alone || folder.is_dir() => {
                fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
                Some(folder.join(format!("{}.urdf", simd_model::wire_name(&model.name))))
            }
            to => to.clone(),
        };
        if let Some(path) = &to {
            write_meshes(&translation, path.parent().unwrap_or(Path::new("")))?;
        }
        let [x, y, z] = model.pose.translation.to_array();
        let [qx, qy, qz, qw] = model.pose.rotation.to_array();
        let robot = Converted {
            model: model.name.clone(),
            path: None,
            pose: Some([x, y, z, qx, qy, qz, qw]),
            fixed: Some(model.fixed),
            urdf: Some(model.urdf.clone()),
        };
        robots.push(robot.written(to.as_ref())?);
    }
    output.one(&Conversion { robots })
}

/// Writes the meshes where the URDFs of this folder expect them.
fn write_meshes(translation: &Translation, folder: &Path) -> anyhow::Result<()> {
    for (uri, mesh) in &translation.meshes {
        let path = folder.join(uri);
        let place = path.parent().unwrap_or(folder);
        fs::create_dir_all(place).with_context(|| place.display().to_string())?;
        replace_file(&path, &mesh.bytes).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

fn said(finding: &Finding) -> String {
    let line = finding.line.map_or_else(String::new, |line| format!(", line {line}"));
    let file = finding.file.as_ref().map_or_else(String::new, |file| format!(" of {file}"));
    format!("{}{line}{file}: {}", finding.element, finding.message)
}

#[derive(Serialize)]
struct Conversion {
    robots: Vec<Converted>,
}

#[derive(Serialize)]
struct Converted {
    model: String,
    path: Option<String>,
    /// Pose of its root link in the file: x y z, and the quaternion x y z w.
    pose: Option<[f64; 7]>,
    /// Whether its root link is fixed there.
    fixed: Option<bool>,
    /// Present if it was not written to a file.
    urdf: Option<String>,
}

impl Converted {
    /// Writes it to the given file, if any.
    fn written(mut self, to: Option<&PathBuf>) -> anyhow::Result<Self> {
        if let Some(path) = to {
            let text = self.urdf.take().unwrap_or_default();
            replace_file(path, text.as_bytes()).with_context(|| path.display().to_string())?;
            self.path = Some(path.display().to_string());
        }
        Ok(self)
    }
}

impl View for Conversion {
    fn page(&self) -> Page {
        self.robots.iter().fold(Page::new(), |page, robot| match (&robot.urdf, &robot.path) {
            (Some(urdf), _) => page.line(urdf.trim_end().to_owned()),
            (None, path) => page.line(format!("{}: {}", robot.model, path.as_deref().unwrap_or_default())),
        })
    }
}

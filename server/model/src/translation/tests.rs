//! Translation of SDF and MJCF: each element, on small files.

mod attach;
mod foreign_mjcf;
mod foreign_sdf;
mod frames;
mod inline_mesh;
mod mjcf;
mod replicate;
mod sdf;
mod tendons;
mod textures;
mod urdf_model;

use std::collections::HashMap;

use super::{Format, Translation};
use crate::assets::{Asset, Assets};
use crate::limits::LoadLimits;
use crate::report::{Finding, LoadReport, Severity};
use crate::robot::{Joint, Link, RobotModel, Sha256};
use crate::translate::{describe_with, translate};
use crate::urdf::{ReadOptions, read};

/// Files by URI.
#[derive(Default)]
struct Files(HashMap<&'static str, Vec<u8>>);

impl Files {
    fn with(mut self, uri: &'static str, bytes: impl Into<Vec<u8>>) -> Self {
        self.0.insert(uri, bytes.into());
        self
    }
}

impl Assets for Files {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        let bytes = self.0.get(uri).ok_or_else(Vec::new)?;
        Ok(Asset { sha256: Sha256::of(bytes), bytes: bytes.as_slice().into() })
    }
}

/// Translates a file.
fn translated_with(text: &str, files: &Files) -> Translation {
    match translate(text.as_bytes(), files, &LoadLimits::default()) {
        Ok(Some(translation)) => translation,
        other => panic!("not translated: {other:?}"),
    }
}

fn translated(text: &str) -> Translation {
    translated_with(text, &Files::default())
}

/// Reads its only robot; returns the whole report.
fn robot_with(text: &str, files: &Files) -> (RobotModel, LoadReport) {
    let translation = translated_with(text, files);
    let translated = translation.model("").unwrap_or_else(|refused| panic!("{refused}"));
    let files = translation.files(files);
    let (model, report) = read(translated.urdf.as_bytes(), &files, &ReadOptions::default())
        .unwrap_or_else(|refused| panic!("{refused}\n{}", translated.urdf));
    let mut whole = translation.report.clone();
    whole.findings.extend(translated.report(report).findings);
    (model, whole)
}

fn robot(text: &str) -> (RobotModel, LoadReport) {
    robot_with(text, &Files::default())
}

fn refusal(text: &str) -> String {
    match translate(text.as_bytes(), &Files::default(), &LoadLimits::default()) {
        Err(refused) => refused.message,
        other => panic!("it should be refused: {other:?}"),
    }
}

fn link<'m>(model: &'m RobotModel, name: &str) -> &'m Link {
    let found = model.links.iter().find(|link| link.name == name);
    found.unwrap_or_else(|| {
        panic!("no link {name}: {:?}", model.links.iter().map(|link| &link.name).collect::<Vec<_>>())
    })
}

fn joint<'m>(model: &'m RobotModel, name: &str) -> &'m Joint {
    let found = model.joints.iter().find(|joint| joint.name == name);
    found.unwrap_or_else(|| {
        panic!("no joint {name}: {:?}", model.joints.iter().map(|joint| &joint.name).collect::<Vec<_>>())
    })
}

/// Returns the pose of a link in its root's frame with all joints at zero.
fn root_from_link(model: &RobotModel, name: &str) -> glamx::DPose3 {
    let mut at = model.links.iter().position(|link| link.name == name).unwrap();
    let mut pose = glamx::DPose3::IDENTITY;
    while at > 0 {
        let joint = &model.joints[at - 1];
        pose = joint.parent_from_joint * pose;
        at = joint.parent;
    }
    pose
}

fn warnings(report: &LoadReport) -> Vec<(Option<u32>, &str)> {
    report.at_least(Severity::Warning).map(|finding| (finding.line, finding.message.as_str())).collect()
}

fn find<'r>(report: &'r LoadReport, words: &str) -> &'r Finding {
    let found = report.findings.iter().find(|finding| finding.message.contains(words));
    found.unwrap_or_else(|| panic!("no finding says {words:?}: {:#?}", report.findings))
}

fn near(a: glamx::DVec3, b: [f64; 3]) -> bool {
    (a - glamx::DVec3::from_array(b)).length() < 1e-12
}

#[test]
fn a_format_is_known_by_the_root_element() {
    for (text, format) in [
        ("<robot/>", Format::Urdf),
        ("\u{feff}<?xml version='1.0'?>\n<!-- <mujoco> -->\n<sdf version='1.7'>", Format::Sdf),
        ("<mujoco model='a'>", Format::Mjcf),
        ("<mujoco/>", Format::Mjcf),
        ("<mujocoinclude>", Format::Urdf),
        ("", Format::Urdf),
        ("<!--", Format::Urdf),
        ("<", Format::Urdf),
        ("solid <sdf>", Format::Sdf),
    ] {
        assert_eq!(Format::of(text.as_bytes()), format, "{text}");
    }
    let wide: Vec<u8> = "<sdf/>".encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert_eq!(Format::of(&wide), Format::Sdf);
}

#[test]
fn missing_files_are_named_before_the_rest_can_be_described() {
    let main = "<mujoco><include file='body.xml'/></mujoco>";
    let described = describe_with(main.as_bytes(), &Files::default(), &LoadLimits::default()).unwrap();
    assert_eq!(described.asset_uris, ["body.xml"]);
    assert_eq!(described.models, [""; 0]);
    let body = "<mujoco><asset><mesh name='m' file='m.stl'/></asset><worldbody><body name='b'><freejoint/>\
                <geom type='mesh' mesh='m'/><geom size='1'/></body></worldbody></mujoco>";
    let files = Files::default().with("body.xml", body);
    let described = describe_with(main.as_bytes(), &files, &LoadLimits::default()).unwrap();
    assert_eq!(described.asset_uris, ["body.xml", "m.stl"]);
    assert_eq!(described.models, ["b"]);
}

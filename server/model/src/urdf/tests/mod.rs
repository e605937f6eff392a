//! The rules of reading, each as a sentence.

mod constraints;
mod documents;
mod foreign;
mod hostile;
mod inertials;
mod joints;
mod mimics;
mod rewriting;
mod robots;
mod sensors;
mod shapes;
mod srdf;
mod tendons;

use std::collections::HashMap;

use super::{Description, ReadOptions, Refused, read};
use crate::assets::{Asset, Assets};
use crate::limits::LoadLimits;
use crate::report::{Disposition, Finding, LoadReport, Severity};
use crate::robot::{Joint, RobotModel, Sha256};

/// Files by URI.
#[derive(Default)]
struct Files(HashMap<String, Vec<u8>>);

impl Files {
    fn with(mut self, uri: &str, bytes: impl Into<Vec<u8>>) -> Self {
        self.0.insert(uri.to_owned(), bytes.into());
        self
    }
}

impl Assets for Files {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        let bytes = self.0.get(uri).ok_or(vec!["here".to_owned(), "there".to_owned()])?;
        Ok(Asset { sha256: Sha256::of(bytes), bytes: bytes.as_slice().into() })
    }
}

fn describe(urdf: &[u8]) -> Result<Description, Refused> {
    super::describe(urdf, &LoadLimits::default())
}

fn read_text(urdf: &str) -> Result<(RobotModel, LoadReport), Refused> {
    read(urdf.as_bytes(), &Files::default(), &ReadOptions::default())
}

fn robot(urdf: &str) -> (RobotModel, LoadReport) {
    read_text(urdf).unwrap_or_else(|refused| panic!("refused: {refused}"))
}

fn refusal(urdf: &str) -> String {
    let refused = read_text(urdf).expect_err("it should be refused");
    let last = refused.report.findings.last().expect("a refusal is a finding");
    assert_eq!((last.severity, last.disposition), (Severity::Error, Disposition::Refused));
    refused.message
}

const BODY: &str = r#"<inertial><origin xyz="0.1 0 0"/><mass value="1"/>
  <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>"#;

/// Returns a base and an arm on one joint, which is at line 4.
fn one_joint(kind: &str, content: &str) -> String {
    format!(
        "<robot name=\"r\"><link name=\"base\"/><link name=\"arm\">\n{BODY}</link>\n\
         <joint name=\"j\" type=\"{kind}\"><parent link=\"base\"/><child link=\"arm\"/>{content}</joint></robot>"
    )
}

/// Returns the joint of [`one_joint`], and its report.
fn joint(kind: &str, content: &str) -> (Joint, LoadReport) {
    let (mut model, report) = robot(&one_joint(kind, content));
    (model.joints.remove(0), report)
}

/// Returns a link on a moving joint.
fn moving_link(content: &str) -> String {
    format!(
        "<robot name=\"r\"><link name=\"base\"/>\n<link name=\"arm\">{content}</link>\
         <joint name=\"j\" type=\"continuous\"><parent link=\"base\"/><child link=\"arm\"/><axis xyz=\"0 0 1\"/>\
         </joint></robot>"
    )
}

fn find<'r>(report: &'r LoadReport, words: &str) -> &'r Finding {
    let found = report.findings.iter().find(|finding| finding.message.contains(words));
    found.unwrap_or_else(|| panic!("no finding says {words:?}: {:#?}", report.findings))
}

fn warnings(report: &LoadReport) -> Vec<&str> {
    report.at_least(Severity::Warning).map(|finding| finding.message.as_str()).collect()
}

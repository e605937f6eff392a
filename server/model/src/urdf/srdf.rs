//! What an SRDF says of which links of a robot touch each other: the part of it that is about physics.
//!
//! MoveIt's format: `disable_collisions link1 link2 reason` switches a pair off, `disable_default_collisions link`
//! switches a link off with every other one, and `enable_collisions link1 link2` switches a pair on again.

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::Node;

use super::Refused;
use super::findings::{Findings, Refusal, quoted};
use super::prescan::{check_counts, check_depth, parse_xml, syntax};
use super::text;
use crate::limits::LoadLimits;
use crate::report::Disposition::Ignored;
use crate::report::{LoadReport, counted};
use crate::robot::RobotModel;

/// Pairs that one file may switch.
const MOST_PAIRS: usize = 65_536;

/// What an SRDF says of a robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Srdf {
    /// In the order of the robot's links.
    pub pairs: Vec<SrdfPair>,
    /// What was done to it.
    pub report: LoadReport,
}

/// Two links that are switched off or on.
#[derive(Clone, Debug, PartialEq)]
pub struct SrdfPair {
    /// Their names.
    pub links: [String; 2],
    /// They touch.
    pub enabled: bool,
}

/// Reads an SRDF of a robot. Links that the robot does not have are warned of and left out.
///
/// # Errors
/// What is not an SRDF, or too large; with `strict`, any warning.
pub fn read_srdf(
    srdf: &[u8],
    model: &RobotModel,
    strict: bool,
    limits: &LoadLimits,
) -> Result<Srdf, Refused> {
    let mut findings = Findings::new(limits.findings);
    let read = pairs(srdf, model, limits, &mut findings).and_then(|pairs| {
        if strict {
            findings.refuse_warnings()?;
        }
        Ok(pairs)
    });
    match read {
        Ok(pairs) => Ok(Srdf { pairs, report: named(findings.into_report()) }),
        Err(refusal) => {
            let Refused { message, report } = findings.refused(refusal);
            Err(Refused { message: format!("SRDF: {}", of_srdf(&message)), report: named(report) })
        }
    }
}

/// What reads XML says URDF, which is what it mostly reads.
fn of_srdf(message: &str) -> String {
    message.replace("a URDF", "an SRDF").replace("URDF", "SRDF")
}

/// Findings whose elements and lines are those of the SRDF, beside those of the URDF.
fn named(mut report: LoadReport) -> LoadReport {
    for finding in &mut report.findings {
        finding.element = format!("SRDF {}", finding.element);
        finding.message = of_srdf(&finding.message);
    }
    report
}

fn pairs(
    srdf: &[u8],
    model: &RobotModel,
    limits: &LoadLimits,
    findings: &mut Findings,
) -> Result<Vec<SrdfPair>, Refusal> {
    let text = text::decode(srdf, limits, findings)?;
    check_counts(&text, limits)?;
    let document = parse_xml(&text, limits).map_err(|error| syntax(error, limits))?;
    check_depth(&document, limits.xml_depth)?;
    findings.set_text(document.input_text());
    let root = document.root_element();
    if root.tag_name().name() != "robot" {
        return Err(findings.refuse(root, "this is not an SRDF: its root element is not <robot>"));
    }
    let indices: BTreeMap<&str, usize> =
        model.links.iter().enumerate().map(|(index, link)| (link.name.as_str(), index)).collect();
    let mut switched: BTreeMap<[usize; 2], bool> = BTreeMap::new();
    let elements = |name: &'static str| root.children().filter(move |node| node.tag_name().name() == name);
    let mut off_by_default = BTreeSet::new();
    for node in elements("disable_default_collisions") {
        let Some(link) = link(node, "link", &indices, findings).filter(|link| off_by_default.insert(*link))
        else {
            continue;
        };
        for other in (0..model.links.len()).filter(|other| *other != link) {
            switch(&mut switched, [link, other], false, node, findings)?;
        }
    }
    for (name, enabled) in [("disable_collisions", false), ("enable_collisions", true)] {
        for node in elements(name) {
            let both = [link(node, "link1", &indices, findings), link(node, "link2", &indices, findings)];
            let [Some(a), Some(b)] = both else { continue };
            if a == b {
                findings.warn(node, Ignored, "it names one link twice; left out");
                continue;
            }
            switch(&mut switched, [a, b], enabled, node, findings)?;
        }
    }
    let off = switched.values().filter(|enabled| !**enabled).count();
    findings.used(root, || format!("{} of links switched off", counted(off, "pair")));
    let name = |link: usize| model.links[link].name.clone();
    Ok(switched.into_iter().map(|(links, enabled)| SrdfPair { links: links.map(name), enabled }).collect())
}

/// The link that an attribute names; warns where the robot has none.
fn link(
    node: Node,
    attribute: &str,
    indices: &BTreeMap<&str, usize>,
    findings: &mut Findings,
) -> Option<usize> {
    let Some(name) = node.attribute(attribute) else {
        findings.warn(node, Ignored, format!("it has no {attribute}; left out"));
        return None;
    };
    let index = indices.get(name.trim()).copied();
    if index.is_none() {
        findings.warn(node, Ignored, format!("the robot has no link {}; left out", quoted(name)));
    }
    index
}

fn switch(
    switched: &mut BTreeMap<[usize; 2], bool>,
    mut links: [usize; 2],
    enabled: bool,
    node: Node,
    findings: &Findings,
) -> Result<(), Refusal> {
    links.sort_unstable();
    switched.insert(links, enabled);
    if switched.len() <= MOST_PAIRS {
        return Ok(());
    }
    Err(findings.refuse(node, format!("it switches more than {MOST_PAIRS} pairs of links")))
}

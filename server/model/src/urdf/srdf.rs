//! SRDF: collision filters of a robot's links, and its named states; the parts that concern physics.
//!
//! MoveIt's format: `disable_collisions link1 link2 reason` switches a pair off, `disable_default_collisions
//! link` switches a link off with all others, and `enable_collisions link1 link2` switches a pair on again.

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::Node;

use super::Refused;
use super::findings::{Findings, Refusal, quoted};
use super::prescan::{check_counts, check_depth, parse_xml, syntax};
use super::{states, text};
use crate::limits::LoadLimits;
use crate::report::Disposition::Ignored;
use crate::report::{LoadReport, counted};
use crate::robot::{Link, RobotModel};
use crate::setup::{LinkPair, NamedState};

/// Maximum number of pairs in a file.
pub(super) const MAX_PAIRS: usize = 65_536;

/// Content of an SRDF for a robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Srdf {
    /// In the order of the robot's links.
    pub pairs: Vec<SrdfPair>,
    /// In the order of the file.
    pub states: Vec<NamedState>,
    /// Report on the SRDF.
    pub report: LoadReport,
}

/// Two links whose collision is switched off or on.
#[derive(Clone, Debug, PartialEq)]
pub struct SrdfPair {
    /// Their names.
    pub links: [String; 2],
    /// Whether they collide.
    pub enabled: bool,
}

/// Reads an SRDF of a robot. Unknown links cause a warning and are left out.
///
/// # Errors
/// Returns an error if the text is not an SRDF, or too large; with `strict`, also for any warning.
pub fn read_srdf(
    srdf: &[u8],
    model: &RobotModel,
    strict: bool,
    limits: &LoadLimits,
) -> Result<Srdf, Refused> {
    let mut findings = Findings::new(limits.findings);
    let read = contents(srdf, model, limits, &mut findings).and_then(|contents| {
        if strict {
            findings.refuse_warnings()?;
        }
        Ok(contents)
    });
    match read {
        Ok((pairs, states)) => Ok(Srdf { pairs, states, report: named(findings.into_report()) }),
        Err(refusal) => {
            let Refused { message, report } = findings.refused(refusal);
            Err(Refused { message: format!("SRDF: {}", of_srdf(&message)), report: named(report) })
        }
    }
}

/// Replaces "URDF" in a message of the XML reader.
fn of_srdf(message: &str) -> String {
    message.replace("a URDF", "an SRDF").replace("URDF", "SRDF")
}

/// Marks findings as the SRDF's, to distinguish them from the URDF's.
fn named(mut report: LoadReport) -> LoadReport {
    for finding in &mut report.findings {
        finding.element = format!("SRDF {}", finding.element);
        finding.message = of_srdf(&finding.message);
    }
    report
}

fn contents(
    srdf: &[u8],
    model: &RobotModel,
    limits: &LoadLimits,
    findings: &mut Findings,
) -> Result<(Vec<SrdfPair>, Vec<NamedState>), Refusal> {
    let text = text::decode(srdf, limits, findings)?;
    check_counts(&text, limits)?;
    let document = parse_xml(&text, limits).map_err(|error| syntax(error, limits))?;
    check_depth(&document, limits.xml_depth)?;
    findings.set_text(document.input_text());
    let root = document.root_element();
    if root.tag_name().name() != "robot" {
        return Err(findings.refuse(root, "this is not an SRDF: its root element is not <robot>"));
    }
    let switched = switched(root, &model.links, findings)?;
    let off = switched.values().filter(|enabled| !**enabled).count();
    findings.used(root, || format!("{} of links switched off", counted(off, "pair")));
    let name = |link: usize| model.links[link].name.clone();
    let pairs =
        switched.into_iter().map(|(links, enabled)| SrdfPair { links: links.map(name), enabled }).collect();
    Ok((pairs, states::read(root, &model.joints, findings)))
}

/// Returns the pairs that a `<robot>` switches itself, without an SRDF.
pub(super) fn of_robot(robot: Node, links: &[Link], findings: &mut Findings) -> Vec<LinkPair> {
    match switched(robot, links, findings) {
        Ok(switched) => switched.into_iter().map(|(links, enabled)| LinkPair { links, enabled }).collect(),
        Err(_too_many) => {
            let message = format!("it switches more than {MAX_PAIRS} pairs of links: all are left out");
            findings.warn(robot, Ignored, message);
            Vec::new()
        }
    }
}

/// Returns pairs of links by their indices, with their collision switched on or off.
fn switched(
    root: Node,
    links: &[Link],
    findings: &mut Findings,
) -> Result<BTreeMap<[usize; 2], bool>, Refusal> {
    let indices: BTreeMap<&str, usize> =
        links.iter().enumerate().map(|(index, link)| (link.name.as_str(), index)).collect();
    let mut switched: BTreeMap<[usize; 2], bool> = BTreeMap::new();
    let elements = |name: &'static str| root.children().filter(move |node| node.tag_name().name() == name);
    let mut off_by_default = BTreeSet::new();
    for node in elements("disable_default_collisions") {
        let Some(link) = link(node, "link", &indices, findings).filter(|link| off_by_default.insert(*link))
        else {
            continue;
        };
        for other in (0..links.len()).filter(|other| *other != link) {
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
    Ok(switched)
}

/// Returns the link that an attribute names; warns if the robot has none.
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
    if switched.len() <= MAX_PAIRS {
        return Ok(());
    }
    Err(findings.refuse(node, format!("it switches more than {MAX_PAIRS} pairs of links")))
}

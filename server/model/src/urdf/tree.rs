//! Orders links and joints: one root, no loops, depth first.

use std::collections::{HashMap, HashSet};

use roxmltree::Node;

use super::findings::{Findings, Refusal, quoted};
use super::repair::RepairedUrdf;
use super::unknown::nearest;
use crate::report::Disposition::Repaired;

/// The robot as a tree. Indices "in the file" refer to urdf-rs's links or joints.
pub(super) struct Tree<'a, 'i> {
    /// Depth first, the root first; each is an index in the file.
    pub(super) links: Vec<usize>,
    /// Joint `i` ends at link `i + 1`.
    pub(super) joints: Vec<TreeJoint>,
    /// The nodes of `links`.
    pub(super) link_nodes: Vec<Node<'a, 'i>>,
    /// The nodes of `joints`.
    pub(super) joint_nodes: Vec<Node<'a, 'i>>,
}

/// A joint in the tree.
pub(super) struct TreeJoint {
    /// Index in the file.
    pub(super) in_file: usize,
    /// Parent link, in the tree's order.
    pub(super) parent: usize,
}

/// Orders the links, or returns the reason why they form no tree.
pub(super) fn build<'a, 'i>(
    repaired: &RepairedUrdf<'a, 'i>,
    findings: &Findings,
) -> Result<Tree<'a, 'i>, Refusal> {
    let file = File { repaired, findings, links: link_indices(repaired, findings)? };
    let parents = file.parents()?;
    let root = file.root(&parents)?;

    // Joints of each parent link, in the order of the file.
    let mut hanging: Vec<Vec<(usize, usize)>> = vec![Vec::new(); repaired.robot.links.len()];
    for (child, parent) in parents.iter().enumerate() {
        if let Some(slot) = parent.as_ref().and_then(|up| hanging.get_mut(up.link)) {
            slot.extend(parent.as_ref().map(|up| (up.joint, child)));
        }
    }
    hanging.iter_mut().for_each(|joints| joints.sort_unstable());

    let mut links = vec![root];
    let mut joints = Vec::new();
    let mut open: Vec<(usize, usize, usize)> = Vec::new();
    let hang = |open: &mut Vec<_>, link: usize, parent: usize| {
        let below = hanging.get(link).into_iter().flatten().rev();
        open.extend(below.map(|(joint, child)| (*joint, *child, parent)));
    };
    hang(&mut open, root, 0);
    while let Some((in_file, child, parent)) = open.pop() {
        joints.push(TreeJoint { in_file, parent });
        hang(&mut open, child, links.len());
        links.push(child);
    }
    if links.len() < parents.len() {
        let reached: std::collections::HashSet<usize> = links.iter().copied().collect();
        let lost = (0..parents.len()).find(|link| !reached.contains(link)).unwrap_or(0);
        return Err(file.describe_loop(&parents, lost));
    }
    let nodes: Vec<_> = repaired.children(repaired.root, "link").collect();
    let link_nodes = links.iter().filter_map(|link| nodes.get(*link).copied()).collect();
    let nodes: Vec<_> = repaired.children(repaired.root, "joint").collect();
    let joint_nodes = joints.iter().filter_map(|joint| nodes.get(joint.in_file).copied()).collect();
    Ok(Tree { links, joints, link_nodes, joint_nodes })
}

/// Parent of a link; indices in the file.
struct Up {
    joint: usize,
    link: usize,
}

/// Remedy for a file with a loop.
const CLOSE: &str =
    "a robot is a tree: leave one joint out, and close the loop by a <constraint> between its two links";

struct File<'m, 'a, 'i> {
    repaired: &'m RepairedUrdf<'a, 'i>,
    findings: &'m Findings,
    links: HashMap<&'m str, usize>,
}

fn link_indices<'m>(
    repaired: &'m RepairedUrdf,
    findings: &Findings,
) -> Result<HashMap<&'m str, usize>, Refusal> {
    let mut lines = HashMap::new();
    let mut indices = HashMap::new();
    for (index, (link, node)) in repaired.links().enumerate() {
        indices.insert(link.name.as_str(), index);
        if let Some(line) = lines.insert(link.name.as_str(), findings.line(node)) {
            return Err(findings.refuse(node, format!("another link has this name, at line {line}")));
        }
    }
    Ok(indices)
}

/// Renames joints with duplicate names. Only mimics name joints, and they mean the first one.
pub(super) fn rename_twins(repaired: &mut RepairedUrdf, findings: &mut Findings) {
    let nodes: Vec<_> = repaired.children(repaired.root, "joint").collect();
    let all: HashSet<String> = repaired.robot.joints.iter().map(|joint| joint.name.clone()).collect();
    let mut seen: HashMap<String, (u32, usize)> = HashMap::new();
    for (joint, node) in repaired.robot.joints.iter_mut().zip(nodes) {
        let Some((line, count)) = seen.get_mut(&joint.name) else {
            seen.insert(joint.name.clone(), (findings.line(node), 1));
            continue;
        };
        let name = loop {
            *count += 1;
            let name = format!("{}_{count}", joint.name);
            if !all.contains(&name) {
                break name;
            }
        };
        let message =
            format!("another joint has this name, at line {line}: this one is called {}", quoted(&name));
        findings.warn(node, Repaired, message);
        joint.name = name;
    }
}

impl File<'_, '_, '_> {
    /// Returns the parent of each link.
    fn parents(&self) -> Result<Vec<Option<Up>>, Refusal> {
        let mut parents: Vec<Option<Up>> = self.repaired.robot.links.iter().map(|_| None).collect();
        for (index, (joint, node)) in self.repaired.joints().enumerate() {
            let find = |end: &str, name: &str| {
                let unknown = || {
                    let meant =
                        nearest(name, self.repaired.robot.links.iter().map(|link| link.name.as_str()));
                    let meant =
                        meant.map_or_else(String::new, |meant| format!("; did you mean {}?", quoted(meant)));
                    format!("its {end} link {} is not defined{meant}", quoted(name))
                };
                self.links.get(name).copied().ok_or_else(|| self.findings.refuse(node, unknown()))
            };
            let link = find("parent", &joint.parent.link)?;
            let child = find("child", &joint.child.link)?;
            let name = quoted(&joint.child.link);
            if link == child {
                let message = format!("its parent and its child are the same link {name}");
                return Err(self.findings.refuse(node, message));
            }
            let Some(slot) = parents.get_mut(child) else { continue };
            if let Some(other) = slot {
                let other = self.joint_name(other.joint);
                let message = format!("its child link {name} already hangs on joint {other}; {CLOSE}");
                return Err(self.findings.refuse(node, message));
            }
            *slot = Some(Up { joint: index, link });
        }
        Ok(parents)
    }

    fn root(&self, parents: &[Option<Up>]) -> Result<usize, Refusal> {
        let roots: Vec<usize> =
            (0..parents.len()).filter(|link| matches!(parents.get(*link), Some(None))).collect();
        match roots.as_slice() {
            [] => Err(self.describe_loop(parents, 0)),
            [root] => Ok(*root),
            many => {
                let named: Vec<String> = many.iter().take(5).map(|link| self.link_name(*link)).collect();
                let more = if many.len() > named.len() { ", ..." } else { "" };
                let count = many.len();
                let names = named.join(", ");
                let message = format!(
                    "{count} root links; a robot has one (the link that is not the child of a joint): {names}{more}"
                );
                Err(self.findings.refuse(self.repaired.root, message))
            }
        }
    }

    /// Returns the loop above this link.
    fn describe_loop(&self, parents: &[Option<Up>], from: usize) -> Refusal {
        let up = |link: usize| parents.get(link).and_then(Option::as_ref);
        let mut link = from;
        // After as many steps as there are links, the walk is on the loop.
        for _ in 0..parents.len() {
            link = up(link).map_or(link, |up| up.link);
        }
        let first = link;
        let mut joints = Vec::new();
        while let Some(step) = up(link) {
            joints.push(self.joint_name(step.joint));
            link = step.link;
            if link == first || joints.len() > 8 {
                break;
            }
        }
        joints.reverse();
        let message = format!(
            "joints form a loop through link {}: {}; {CLOSE}",
            self.link_name(first),
            joints.join(", ")
        );
        self.findings.refuse(self.repaired.root, message)
    }

    fn link_name(&self, index: usize) -> String {
        let link = self.repaired.links().nth(index);
        link.map_or_else(String::new, |(link, node)| {
            format!("{} (line {})", quoted(&link.name), self.findings.line(node))
        })
    }

    fn joint_name(&self, index: usize) -> String {
        let joint = self.repaired.joints().nth(index);
        joint.map_or_else(String::new, |(joint, node)| {
            format!("{} (line {})", quoted(&joint.name), self.findings.line(node))
        })
    }
}

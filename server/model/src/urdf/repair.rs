//! Reads a robot of urdf-rs from the document. Missing parts are filled in, parts that simd does not read are
//! left out and reported, and every number is checked.
//!
//! The parser of urdf-rs drops a word that is not a number from `"1 x 2 3"`, and accepts NaN. It refuses files
//! for elements that simd does not need. So simd reads the elements by the
//! [`vocabulary`](super::vocabulary), from a tree with line numbers, and fills the types of urdf-rs. The tree
//! remains available for distinctions that these do not make, such as an effort of 0 from none.

use std::collections::HashSet;

use roxmltree::{Node, NodeId};

use super::findings::{Findings, Refusal, quoted};
use super::numbers::{self, Shape};
use super::parts::{self, Part};
use super::prescan::is;
use super::unknown;
use super::vocabulary::{Attribute, Element, Kind, Missing, ROBOT};
use crate::limits::LoadLimits;
use crate::report::Disposition::{Defaulted, Ignored, Repaired, Used};

/// A robot of urdf-rs, with the nodes that it came from.
pub(super) struct RepairedUrdf<'a, 'i> {
    /// Links, joints and materials, each in the order of the file.
    pub(super) robot: urdf_rs::Robot,
    /// The `<robot>` element.
    pub(super) root: Node<'a, 'i>,
    kept: HashSet<NodeId>,
}

impl<'a, 'i> RepairedUrdf<'a, 'i> {
    /// Returns the children of this name that the robot has, in its order.
    pub(super) fn children(
        &self,
        node: Node<'a, 'i>,
        tag: &'static str,
    ) -> impl Iterator<Item = Node<'a, 'i>> {
        node.children().filter(move |node| self.kept.contains(&node.id()) && is(*node, tag))
    }

    /// Returns the one child of this name.
    pub(super) fn child(&self, node: Node<'a, 'i>, tag: &'static str) -> Option<Node<'a, 'i>> {
        self.children(node, tag).next()
    }

    /// Returns the robot's links with the nodes that they were read from.
    pub(super) fn links(&self) -> impl Iterator<Item = (&urdf_rs::Link, Node<'a, 'i>)> {
        self.robot.links.iter().zip(self.children(self.root, "link"))
    }

    /// Returns the robot's joints with the nodes that they were read from.
    pub(super) fn joints(&self) -> impl Iterator<Item = (&urdf_rs::Joint, Node<'a, 'i>)> {
        self.robot.joints.iter().zip(self.children(self.root, "joint"))
    }
}

/// Returns whether an element has a non-blank value for an attribute.
pub(super) fn given(node: Option<Node>, name: &str) -> bool {
    node.and_then(|node| node.attribute(name)).is_some_and(|value| !value.trim().is_empty())
}

/// Repairs the document.
pub(super) fn repair<'a, 'i>(
    root: Node<'a, 'i>,
    limits: &LoadLimits,
    findings: &mut Findings,
) -> Result<RepairedUrdf<'a, 'i>, Refusal> {
    let mut mender = Mender { kept: HashSet::new(), limits, findings };
    let part = mender.robot(root)?;
    Ok(RepairedUrdf { robot: parts::robot(&part), root, kept: mender.kept })
}

/// Returns the repaired elements of the document.
#[cfg(test)]
pub(super) fn parts(root: Node, limits: &LoadLimits, findings: &mut Findings) -> Result<Part, Refusal> {
    Mender { kept: HashSet::new(), limits, findings }.robot(root)
}

/// Refuses a robot with too many elements.
fn check_counts(root: Node, limits: &LoadLimits, findings: &Findings) -> Result<(), Refusal> {
    for tag in ["link", "joint"] {
        let count = root.children().filter(|node| is(*node, tag)).count();
        if count > limits.links {
            let cap = limits.links;
            return Err(findings.refuse(root, format!("the robot has {count} {tag}s; the limit is {cap}")));
        }
    }
    let shape = |node: &Node| is(*node, "visual") || is(*node, "collision");
    let shapes = root.descendants().filter(shape).count();
    let materials = root.children().filter(|node| is(*node, "material")).count();
    for (what, count) in [("shapes", shapes), ("materials", materials)] {
        if count > limits.shapes {
            let cap = limits.shapes;
            return Err(findings.refuse(root, format!("the robot has {count} {what}; the limit is {cap}")));
        }
    }
    Ok(())
}

struct Mender<'f> {
    kept: HashSet<NodeId>,
    limits: &'f LoadLimits,
    findings: &'f mut Findings,
}

impl Mender<'_> {
    fn robot(&mut self, root: Node) -> Result<Part, Refusal> {
        check_counts(root, self.limits, self.findings)?;
        // The root is never left out: what it lacks has a default.
        Ok(self.element(root, &ROBOT)?.unwrap_or_default())
    }

    /// Reads an element; `None` leaves it out. Recurses no deeper than the vocabulary. Faults of the look
    /// never refuse a robot.
    fn element(&mut self, node: Node, element: &Element) -> Result<Option<Part>, Refusal> {
        const LOOKS: [&str; 4] = ["visual", "material", "color", "texture"];
        match self.checked(node, element) {
            Err(refusal) if LOOKS.contains(&element.tag) => {
                self.findings.pass_over(node, &refusal);
                Ok(None)
            }
            result => result,
        }
    }

    fn checked(&mut self, node: Node, element: &Element) -> Result<Option<Part>, Refusal> {
        let mut part = Part { tag: element.tag, ..Part::default() };
        let has_attributes = self.attributes(node, element, &mut part)?;
        unknown::text(node, self.findings);
        if !has_attributes || !self.children(node, element, &mut part)? {
            return Ok(None);
        }
        self.kept.insert(node.id());
        Ok(Some(part))
    }

    fn attributes(&mut self, node: Node, element: &Element, part: &mut Part) -> Result<bool, Refusal> {
        for attribute in node.attributes() {
            let known = element.attributes.iter().any(|known| known.name == attribute.name());
            let is_foreign = attribute.namespace().is_some();
            if is_foreign || !known {
                unknown::attribute(node, attribute.name(), is_foreign, element, self.findings);
            }
        }
        for attribute in element.attributes {
            let value = node.attribute(attribute.name);
            // A material may be called "", a link may not.
            let blank = |value: &str| value.trim().is_empty() && !matches!(attribute.kind, Kind::Text);
            let Some(value) = value.filter(|value| !blank(value)) else {
                if !self.missing_attribute(node, attribute, value.is_some(), part)? {
                    return Ok(false);
                }
                continue;
            };
            self.attribute(node, attribute, value, part)?;
        }
        Ok(true)
    }

    /// Returns whether the element is valid without the attribute.
    fn missing_attribute(
        &mut self,
        node: Node,
        attribute: &Attribute,
        blank: bool,
        part: &mut Part,
    ) -> Result<bool, Refusal> {
        let name = attribute.name;
        match attribute.missing {
            Missing::Leave if blank && !matches!(attribute.kind, Kind::Unused) => {
                self.findings.info(node, Defaulted, format!("{name} is empty: read as not given"));
            }
            Missing::Leave | Missing::Zero => {}
            Missing::Text(default) => {
                if matches!(attribute.kind, Kind::Name) {
                    let message = format!("it has no {name}; {} is used", quoted(default));
                    self.findings.info(node, Defaulted, message);
                }
                part.texts.push((name, default.to_owned()));
            }
            Missing::Drop => {
                self.findings.warn(node, Ignored, format!("it has no {name}, and is ignored"));
                return Ok(false);
            }
            Missing::Refuse => return Err(self.findings.refuse(node, format!("it has no {name}"))),
        }
        Ok(true)
    }

    fn children(&mut self, node: Node, element: &Element, part: &mut Part) -> Result<bool, Refusal> {
        let known = |child: &Node| element.children.iter().any(|known| is(*child, known.tag));
        for child in node.children().filter(|child| child.is_element() && !known(child)) {
            if !is_of_setup(&child, element) {
                unknown::element(child, element, self.findings);
            }
        }
        if element.one_of {
            return self.one_child(node, element, part);
        }
        for wanted in element.children {
            let mut found = false;
            for child in node.children().filter(|child| is(*child, wanted.tag)) {
                if found && !wanted.many {
                    self.findings.warn(child, Ignored, ONE_TOO_MANY);
                    continue;
                }
                let read = self.element(child, wanted)?;
                found |= read.is_some();
                part.parts.extend(read);
            }
            if found {
                continue;
            }
            match wanted.missing {
                Missing::Leave | Missing::Text(_) | Missing::Zero => {}
                Missing::Drop => {
                    let message = format!("it has no usable {}, and is ignored", wanted.tag);
                    self.findings.warn(node, Ignored, message);
                    return Ok(false);
                }
                Missing::Refuse => {
                    return Err(self.findings.refuse(node, format!("it has no {}", wanted.tag)));
                }
            }
        }
        Ok(true)
    }

    /// Reads the first usable child, in the order of the file.
    fn one_child(&mut self, node: Node, element: &Element, part: &mut Part) -> Result<bool, Refusal> {
        let (mut any, mut tried) = (false, false);
        for child in node.children() {
            let Some(wanted) = element.children.iter().find(|wanted| is(child, wanted.tag)) else { continue };
            tried = true;
            if any {
                self.findings.warn(child, Ignored, ONE_TOO_MANY);
            } else {
                let read = self.element(child, wanted)?;
                any = read.is_some();
                part.parts.extend(read);
            }
        }
        if !tried {
            self.findings.warn(node, Ignored, "it has no shape that simd knows");
        }
        Ok(any)
    }

    /// Checks a value and keeps it.
    fn attribute(
        &mut self,
        node: Node,
        attribute: &Attribute,
        value: &str,
        part: &mut Part,
    ) -> Result<(), Refusal> {
        let name = attribute.name;
        match attribute.kind {
            Kind::Unused => {}
            Kind::Text | Kind::Name | Kind::Uri => {
                self.check_text(node, name, value)?;
                let trimmed = if matches!(attribute.kind, Kind::Name) { value.trim() } else { value };
                if trimmed != value {
                    let message = format!("{name}={} has spaces around it: read without", quoted(value));
                    self.findings.warn(node, Repaired, message);
                }
                if !matches!(attribute.kind, Kind::Uri) && (value.contains("${") || value.contains("$(")) {
                    let message =
                        format!("{name}={} looks like an unexpanded xacro expression", quoted(value));
                    self.findings.warn(node, Used, message);
                }
                part.texts.push((name, trimmed.to_owned()));
            }
            Kind::Word(words) => {
                let plain = value.trim().to_ascii_lowercase();
                if !words.contains(&plain.as_str()) {
                    return Err(self.findings.refuse(node, no_such_word(name, value, words)));
                }
                if plain != value {
                    let message = format!("{name}={} is read as {plain}", quoted(value));
                    self.findings.warn(node, Repaired, message);
                }
                part.texts.push((name, plain));
            }
            Kind::Numbers(shape) => {
                let values = self.numbers(node, name, value, shape)?;
                // No limit is the same as no value.
                if values.iter().all(|value| value.is_finite()) {
                    part.numbers.push((name, values));
                }
            }
            Kind::OursNumbers(count) => drop(self.numbers(node, name, value, Shape::Exactly(count))?),
        }
        Ok(())
    }

    fn numbers(&mut self, node: Node, name: &str, value: &str, shape: Shape) -> Result<Vec<f64>, Refusal> {
        let of = |what: &str| format!("{name}={} {what}", quoted(value));
        let read = numbers::read(value, shape).map_err(|why| self.findings.refuse(node, of(&why)))?;
        if let Some(repair) = read.repair {
            self.findings.warn(node, Repaired, of(&repair));
        }
        Ok(read.values)
    }

    fn check_text(&self, node: Node, name: &str, value: &str) -> Result<(), Refusal> {
        let (size, cap) = (value.len(), self.limits.name_bytes);
        if size > cap {
            return Err(self.findings.refuse(node, format!("{name} has {size} bytes; the limit is {cap}")));
        }
        if value.chars().any(char::is_control) {
            let message = format!("{name}={} holds a control character", quoted(value));
            return Err(self.findings.refuse(node, message));
        }
        Ok(())
    }
}

const ONE_TOO_MANY: &str = "one too many: the one before it is used";

/// Returns whether [`setup`](super::setup) reads an element, from the robot's own node.
fn is_of_setup(child: &Node, parent: &Element) -> bool {
    const TAGS: [&str; 9] = [
        "gazebo",
        "constraint",
        "sensor",
        "transmission",
        "ros2_control",
        "group_state",
        "disable_collisions",
        "enable_collisions",
        "disable_default_collisions",
    ];
    parent.tag == ROBOT.tag && TAGS.iter().any(|tag| is(*child, tag))
}

fn no_such_word(name: &str, value: &str, words: &[&str]) -> String {
    let meant = match value.trim().to_ascii_lowercase().as_str() {
        "hinge" => Some("revolute"),
        "slider" => Some("prismatic"),
        "free" => Some("floating"),
        "ball" => Some("spherical"),
        _ => unknown::nearest(value.trim(), words.iter().copied()),
    };
    let meant = meant.map(|meant| format!("; did you mean {meant}?")).unwrap_or_default();
    format!("{name}={} is not one of: {}{meant}", quoted(value), words.join(", "))
}

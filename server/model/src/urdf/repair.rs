//! Rewrites the document as urdf-rs accepts it. Missing parts are filled in, parts that simd does not read
//! are left out and reported, and every number is checked.
//!
//! urdf-rs drops a word that is not a number from `"1 x 2 3"`, accepts NaN, and refuses files for elements
//! that simd does not need. So the document is rewritten by the [`vocabulary`](super::vocabulary), from a
//! tree with line numbers. That tree remains available for distinctions that urdf-rs does not make, such as
//! an effort of 0 from none.

use std::collections::HashSet;

use roxmltree::{Node, NodeId};

use super::findings::{Findings, Refusal, quoted};
use super::numbers::{self, Shape};
use super::prescan::is;
use super::unknown;
use super::vocabulary::{Attribute, Element, Kind, Missing, ROBOT};
use crate::limits::LoadLimits;
use crate::report::Disposition::{Defaulted, Ignored, Repaired, Used};

/// Result of urdf-rs, with the nodes that it came from.
pub(super) struct RepairedUrdf<'a, 'i> {
    /// Links, joints and materials, each in the order of the file.
    pub(super) robot: urdf_rs::Robot,
    /// The `<robot>` element.
    pub(super) root: Node<'a, 'i>,
    kept: HashSet<NodeId>,
}

impl<'a, 'i> RepairedUrdf<'a, 'i> {
    /// Returns the children of this name that were passed to urdf-rs, in its order.
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

/// Repairs the document and parses it with urdf-rs.
pub(super) fn repair<'a, 'i>(
    root: Node<'a, 'i>,
    limits: &LoadLimits,
    findings: &mut Findings,
) -> Result<RepairedUrdf<'a, 'i>, Refusal> {
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
    let mut mender = Mender { xml: String::new(), kept: HashSet::new(), limits, findings };
    mender.element(root, &ROBOT)?;
    let Mender { xml, kept, findings, .. } = mender;
    let robot = urdf_rs::read_from_string(&xml)
        .map_err(|error| findings.refuse(root, format!("urdf-rs refuses it: {error}")))?;
    let repaired = RepairedUrdf { robot, root, kept };
    // These hold by construction; a robot built from the wrong lines would be worse than none.
    let links = repaired.children(root, "link").count() == repaired.robot.links.len();
    let joints = repaired.children(root, "joint").count() == repaired.robot.joints.len();
    if links && joints {
        Ok(repaired)
    } else {
        Err(findings.refuse(root, "urdf-rs does not see all elements"))
    }
}

struct Mender<'f> {
    xml: String,
    kept: HashSet<NodeId>,
    limits: &'f LoadLimits,
    findings: &'f mut Findings,
}

impl Mender<'_> {
    /// Writes an element, or leaves it out and returns `false`. Recurses no deeper than the vocabulary.
    /// Faults of the look never refuse a robot.
    fn element(&mut self, node: Node, element: &Element) -> Result<bool, Refusal> {
        const LOOKS: [&str; 4] = ["visual", "material", "color", "texture"];
        let start = self.xml.len();
        match self.checked(node, element) {
            Err(refusal) if LOOKS.contains(&element.tag) => {
                self.xml.truncate(start);
                self.findings.pass_over(node, &refusal);
                Ok(false)
            }
            result => result,
        }
    }

    fn checked(&mut self, node: Node, element: &Element) -> Result<bool, Refusal> {
        let start = self.xml.len();
        self.xml.push('<');
        self.xml.push_str(element.tag);
        let mut complete = self.attributes(node, element)?;
        self.xml.push('>');
        unknown::text(node, self.findings);
        complete = complete && self.children(node, element)?;
        match (complete, element.stand_in) {
            (true, None) => {
                self.xml.push_str("</");
                self.xml.push_str(element.tag);
                self.xml.push('>');
            }
            (_, stand_in) => {
                self.xml.truncate(start);
                self.xml.push_str(stand_in.filter(|_| complete).unwrap_or_default());
            }
        }
        if complete {
            self.kept.insert(node.id());
        }
        Ok(complete)
    }

    fn attributes(&mut self, node: Node, element: &Element) -> Result<bool, Refusal> {
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
                if !self.missing_attribute(node, attribute, value.is_some())? {
                    return Ok(false);
                }
                continue;
            };
            self.attribute(node, attribute, value)?;
        }
        Ok(true)
    }

    /// Returns whether the element is valid without the attribute.
    fn missing_attribute(&mut self, node: Node, attribute: &Attribute, blank: bool) -> Result<bool, Refusal> {
        let name = attribute.name;
        match attribute.missing {
            Missing::Leave if blank && !matches!(attribute.kind, Kind::Unused) => {
                self.findings.info(node, Defaulted, format!("{name} is empty: read as not given"));
            }
            Missing::Leave => {}
            Missing::Write(default) => {
                if matches!(attribute.kind, Kind::Name) {
                    let message = format!("it has no {name}; {} is used", quoted(default));
                    self.findings.info(node, Defaulted, message);
                }
                self.write(name, default);
            }
            Missing::Drop => {
                self.findings.warn(node, Ignored, format!("it has no {name}, and is ignored"));
                return Ok(false);
            }
            Missing::Refuse => return Err(self.findings.refuse(node, format!("it has no {name}"))),
        }
        Ok(true)
    }

    fn children(&mut self, node: Node, element: &Element) -> Result<bool, Refusal> {
        let known = |child: &Node| element.children.iter().any(|known| is(*child, known.tag));
        for child in node.children().filter(|child| child.is_element() && !known(child)) {
            if !is_of_setup(&child, element) {
                unknown::element(child, element, self.findings);
            }
        }
        if element.one_of {
            return self.one_child(node, element);
        }
        for wanted in element.children {
            let mut found = false;
            for child in node.children().filter(|child| is(*child, wanted.tag)) {
                if found && !wanted.many {
                    self.findings.warn(child, Ignored, ONE_TOO_MANY);
                    continue;
                }
                found |= self.element(child, wanted)?;
            }
            if found {
                continue;
            }
            match wanted.missing {
                Missing::Leave => {}
                Missing::Write(default) => self.xml.push_str(default),
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

    /// Writes the first usable child, in the order of the file.
    fn one_child(&mut self, node: Node, element: &Element) -> Result<bool, Refusal> {
        let (mut any, mut tried) = (false, false);
        for child in node.children() {
            let Some(wanted) = element.children.iter().find(|wanted| is(child, wanted.tag)) else { continue };
            tried = true;
            if any {
                self.findings.warn(child, Ignored, ONE_TOO_MANY);
            } else {
                any = self.element(child, wanted)?;
            }
        }
        if !tried {
            self.findings.warn(node, Ignored, "it has no shape that simd knows");
        }
        Ok(any)
    }

    /// Checks a value and writes it.
    fn attribute(&mut self, node: Node, attribute: &Attribute, value: &str) -> Result<(), Refusal> {
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
                self.write(name, trimmed);
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
                self.write(name, &plain);
            }
            Kind::Numbers(shape) => {
                let values = self.numbers(node, name, value, shape)?;
                let is_bounded = values.iter().all(|value| value.is_finite());
                match attribute.missing {
                    _ if is_bounded => {
                        let words: Vec<String> = values.iter().map(|value| format!("{value:e}")).collect();
                        self.write(name, &words.join(" "));
                    }
                    Missing::Write(default) => self.write(name, default),
                    _ => {}
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

    fn write(&mut self, name: &str, value: &str) {
        self.xml.push(' ');
        self.xml.push_str(name);
        self.xml.push_str("=\"");
        for c in value.chars() {
            match c {
                '&' => self.xml.push_str("&amp;"),
                '<' => self.xml.push_str("&lt;"),
                '>' => self.xml.push_str("&gt;"),
                '"' => self.xml.push_str("&quot;"),
                '\'' => self.xml.push_str("&apos;"),
                c if c.is_whitespace() && c.is_control() => self.xml.push(' '),
                c => self.xml.push(c),
            }
        }
        self.xml.push('"');
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

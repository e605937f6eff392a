//! The document as urdf-rs takes it: what real files leave out is filled in,
//! what simd does not read is left out and reported, every number is checked.
//!
//! urdf-rs drops the word that is no number from `"1 x 2 3"`, takes NaN, and
//! refuses files over elements that simd has no use for. So the document is
//! written anew by the [`vocabulary`](super::vocabulary), from a tree that
//! knows its line numbers; and that tree stays at hand for what urdf-rs cannot
//! tell apart, such as an effort of 0 from none.

use std::collections::HashSet;

use roxmltree::{Node, NodeId};

use super::findings::{Findings, Refusal, quoted};
use super::prescan::is;
use super::vocabulary::{Attribute, Element, Kind, Missing, ROBOT};
use crate::limits;
use crate::report::Disposition::{Defaulted, Ignored};

/// What urdf-rs read, beside the nodes that it read it from.
pub(super) struct Mended<'a, 'i> {
    /// Links, joints and materials, each in the order of the file.
    pub(super) robot: urdf_rs::Robot,
    /// The `<robot>`.
    pub(super) root: Node<'a, 'i>,
    kept: HashSet<NodeId>,
}

impl<'a, 'i> Mended<'a, 'i> {
    /// The children of this name that urdf-rs was given, in its order.
    pub(super) fn children(
        &self,
        node: Node<'a, 'i>,
        tag: &'static str,
    ) -> impl Iterator<Item = Node<'a, 'i>> {
        node.children().filter(move |node| self.kept.contains(&node.id()) && is(*node, tag))
    }

    /// The one child of this name.
    pub(super) fn child(&self, node: Node<'a, 'i>, tag: &'static str) -> Option<Node<'a, 'i>> {
        self.children(node, tag).next()
    }

    /// The robot's links with the nodes that they were read from.
    pub(super) fn links(&self) -> impl Iterator<Item = (&urdf_rs::Link, Node<'a, 'i>)> {
        self.robot.links.iter().zip(self.children(self.root, "link"))
    }

    /// The robot's joints with the nodes that they were read from.
    pub(super) fn joints(&self) -> impl Iterator<Item = (&urdf_rs::Joint, Node<'a, 'i>)> {
        self.robot.joints.iter().zip(self.children(self.root, "joint"))
    }
}

/// Whether an element gives an attribute a value; a blank one is none.
pub(super) fn given(node: Option<Node>, name: &str) -> bool {
    node.and_then(|node| node.attribute(name)).is_some_and(|value| !value.trim().is_empty())
}

/// The numbers of an attribute that the mending has checked.
pub(super) fn numbers<const N: usize>(node: Node, name: &str) -> Option<[f64; N]> {
    let words = node.attribute(name)?.split_whitespace();
    let numbers: Vec<f64> = words.filter_map(|word| word.parse().ok()).collect();
    numbers.try_into().ok()
}

/// Mends the document and has urdf-rs read it.
pub(super) fn mend<'a, 'i>(root: Node<'a, 'i>, findings: &mut Findings) -> Result<Mended<'a, 'i>, Refusal> {
    for tag in ["link", "joint"] {
        let count = root.children().filter(|node| is(*node, tag)).count();
        if count > limits::LINKS {
            let cap = limits::LINKS;
            return Err(findings.refuse(root, format!("the robot has {count} {tag}s; the most is {cap}")));
        }
    }
    let shape = |node: &Node| is(*node, "visual") || is(*node, "collision");
    let shapes = root.descendants().filter(shape).count();
    if shapes > limits::SHAPES {
        let cap = limits::SHAPES;
        return Err(findings.refuse(root, format!("the robot has {shapes} shapes; the most is {cap}")));
    }
    let mut mender = Mender { xml: String::new(), kept: HashSet::new(), findings };
    mender.element(root, &ROBOT)?;
    let Mender { xml, kept, findings } = mender;
    let robot = urdf_rs::read_from_string(&xml)
        .map_err(|error| findings.refuse(root, format!("urdf-rs refuses it: {error}")))?;
    let mended = Mended { robot, root, kept };
    // They hold by construction; a robot put together from the wrong lines would be worse than none.
    let links = mended.children(root, "link").count() == mended.robot.links.len();
    let joints = mended.children(root, "joint").count() == mended.robot.joints.len();
    if links && joints { Ok(mended) } else { Err(findings.refuse(root, "urdf-rs does not see all elements")) }
}

struct Mender<'f> {
    xml: String,
    kept: HashSet<NodeId>,
    findings: &'f mut Findings,
}

impl Mender<'_> {
    /// Writes an element, or leaves it out and says `false`. Recurses no
    /// deeper than the vocabulary does.
    fn element(&mut self, node: Node, element: &Element) -> Result<bool, Refusal> {
        let start = self.xml.len();
        self.xml.push('<');
        self.xml.push_str(element.tag);
        let mut complete = self.attributes(node, element)?;
        self.xml.push('>');
        complete = complete && self.children(node, element)?;
        if complete {
            self.xml.push_str("</");
            self.xml.push_str(element.tag);
            self.xml.push('>');
            self.kept.insert(node.id());
        } else {
            self.xml.truncate(start);
        }
        Ok(complete)
    }

    fn attributes(&mut self, node: Node, element: &Element) -> Result<bool, Refusal> {
        for attribute in node.attributes() {
            let known = element.attributes.iter().any(|known| known.name == attribute.name());
            if attribute.namespace().is_some() || !known {
                let message = format!("attribute {} is not read by simd", quoted(attribute.name()));
                self.findings.info(node, Ignored, message);
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
            self.check(node, attribute, value)?;
            if !matches!(attribute.kind, Kind::OursNumbers(_) | Kind::Unused) {
                self.write(attribute.name, value);
            }
        }
        Ok(true)
    }

    /// Whether the element can do without.
    fn missing_attribute(&mut self, node: Node, attribute: &Attribute, blank: bool) -> Result<bool, Refusal> {
        let name = attribute.name;
        match attribute.missing {
            Missing::Leave if blank && !matches!(attribute.kind, Kind::Unused) => {
                self.findings.info(node, Defaulted, format!("{name} is empty: read as not given"));
            }
            Missing::Leave => {}
            Missing::Write(default) => {
                if matches!(attribute.kind, Kind::Name) {
                    let message = format!("it has no {name}; {} is taken", quoted(default));
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
            self.findings.info(child, Ignored, "not read by simd");
        }
        let mut any = false;
        for wanted in element.children {
            let mut found = false;
            for child in node.children().filter(|child| is(*child, wanted.tag)) {
                if (found && !wanted.many) || (any && element.one_of) {
                    self.findings.warn(child, Ignored, "one too many: the one before it is used");
                    continue;
                }
                found |= self.element(child, wanted)?;
                any |= found;
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
        if element.one_of && !any {
            self.findings.warn(node, Ignored, "it has no shape that simd knows");
        }
        Ok(any || !element.one_of)
    }

    fn check(&self, node: Node, attribute: &Attribute, value: &str) -> Result<(), Refusal> {
        let name = attribute.name;
        match attribute.kind {
            Kind::Unused => Ok(()),
            Kind::Text | Kind::Name => {
                let (size, cap) = (value.len(), limits::NAME_BYTES);
                if size > cap {
                    return Err(self
                        .findings
                        .refuse(node, format!("{name} has {size} bytes; the most is {cap}")));
                }
                if value.chars().any(char::is_control) {
                    let message = format!("{name}={} holds a control character", quoted(value));
                    return Err(self.findings.refuse(node, message));
                }
                Ok(())
            }
            Kind::Word(words) if words.contains(&value) => Ok(()),
            Kind::Word(words) => {
                let message = format!("{name}={} is none of: {}", quoted(value), words.join(", "));
                Err(self.findings.refuse(node, message))
            }
            Kind::Numbers(count) | Kind::OursNumbers(count) => check_numbers(value, count).map_err(|why| {
                let message = format!("{name}={} {why}", quoted(value));
                self.findings.refuse(node, message)
            }),
        }
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

fn check_numbers(value: &str, count: usize) -> Result<(), String> {
    let mut found = 0;
    for word in value.split_whitespace() {
        let number: f64 =
            word.parse().map_err(|_| format!("has a word that is not a number: {}", quoted(word)))?;
        if !number.is_finite() {
            return Err("is not finite".to_owned());
        }
        if number.abs() > limits::MAGNITUDE {
            return Err(format!("is larger than simd computes with; the most is {:e}", limits::MAGNITUDE));
        }
        found += 1;
    }
    match (count, found) {
        _ if found == count => Ok(()),
        (1, _) => Err(format!("is {found} numbers where there must be one")),
        _ => {
            Err(format!("is {found} number{} where there must be {count}", if found == 1 { "" } else { "s" }))
        }
    }
}

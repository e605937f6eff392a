//! `<gazebo>`: settings of links and joints. Plugins are not run.
//!
//! For a link: friction, self-collision, bits of groups, a colour. For a joint: damping, friction, a spring.
//! For the robot: self-collision. Sensors are read elsewhere. Gazebo's named colours are from its script
//! `gazebo.material`.

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::Node;

use super::findings::{Findings, quoted};
use super::numbers::{self, Shape};
use super::prescan::is;
use super::repair::RepairedUrdf;
use super::unknown::nearest;
use crate::report::Disposition::Ignored;
use crate::report::{counted, short};

/// Settings of all `<gazebo>` elements.
#[derive(Default)]
pub(super) struct Gazebo {
    /// Frictions of links, by name.
    pub(super) frictions: BTreeMap<String, f64>,
    /// Colours of links without one, by name.
    pub(super) colors: BTreeMap<String, [f64; 4]>,
    /// Links that collide with others of this set in the robot.
    pub(super) self_collide: BTreeSet<String>,
    /// Whether all links are in this set.
    pub(super) all_collide: bool,
    /// The robot does not sleep.
    pub(super) stays_awake: bool,
    /// Elements of joints, by their names.
    pub(super) joints: BTreeMap<String, OfJoint>,
}

/// Settings of a joint.
#[derive(Clone, Copy, Default)]
pub(super) struct OfJoint {
    pub(super) damping: Option<f64>,
    pub(super) friction: Option<f64>,
    pub(super) stiffness: Option<f64>,
    pub(super) reference: Option<f64>,
}

/// Elements that belong to joints, and not to links.
const OF_JOINTS: [&str; 5] = ["damping", "dampingFactor", "friction", "springStiffness", "springReference"];

impl Gazebo {
    /// Reads every `<gazebo>` of the robot, and reports the ignored parts.
    pub(super) fn of(repaired: &RepairedUrdf, findings: &mut Findings) -> Self {
        let links: BTreeSet<&str> = repaired.robot.links.iter().map(|link| link.name.as_str()).collect();
        let joints: BTreeSet<&str> = repaired.robot.joints.iter().map(|joint| joint.name.as_str()).collect();
        let mut gazebo = Self::default();
        for node in repaired.root.children().filter(|node| is(*node, "gazebo")) {
            let Some(name) = node.attribute("reference") else {
                gazebo.read_robot(node, findings);
                continue;
            };
            // A link and a joint may have the same name, as is common in MJCF.
            let (is_link, is_joint) = (links.contains(name), joints.contains(name));
            if is_link {
                gazebo.read_link(node, name, is_joint, findings);
            }
            if is_joint {
                gazebo.read_joint(node, name, is_link, findings);
            }
            if !is_link && !is_joint {
                unknown_reference(node, name, &links, findings);
            }
        }
        gazebo
    }

    fn read_robot(&mut self, node: Node, findings: &mut Findings) {
        let mut children = node.children().filter(Node::is_element);
        let own = children.find(|child| is_self_collide(*child) && says_yes(*child));
        if let Some(own) = own {
            self.all_collide = true;
            findings.used(own, || "links of the robot touch each other".to_owned());
        }
        // Bodies may sleep unless it says no.
        let switch = node.children().find(|child| is(*child, "allow_auto_disable"));
        if let Some(switch) = switch
            && says_no(switch)
        {
            self.stays_awake = true;
            findings.used(switch, || "the robot does not sleep".to_owned());
        }
        // Joints that close loops are constraints.
        let is_elsewhere = |child: Node| is(child, "joint") || is(child, "ros2_control");
        let is_read = |child: &Node| {
            is_self_collide(*child) || is_elsewhere(*child) || is(*child, "allow_auto_disable")
        };
        if !node.children().any(|child| child.is_element()) {
            findings.info(node, Ignored, "it is empty");
        }
        let mut others = Others::default();
        for child in node.children().filter(Node::is_element).filter(|child| !is_read(child)) {
            others.add(child.tag_name().name());
            if is(child, "static") && says_yes(child) {
                let message = "not read by simd, so the robot moves: load it with a fixed base";
                findings.warn(child, Ignored, message);
            }
        }
        others.report(node, findings);
    }

    /// Reads the settings of a link; a joint may have the same name.
    fn read_link(&mut self, node: Node, link: &str, is_joint: bool, findings: &mut Findings) {
        let mut others = Others::default();
        // Only `mu1`, along the first direction, is used.
        let friction = ["mu1", "mu"].iter().find_map(|tag| node.children().find(|child| is(*child, tag)));
        for child in node.children().filter(Node::is_element) {
            let tag = child.tag_name().name();
            if Some(child) == friction {
                if let Some(friction) =
                    number(child, findings).and_then(|it| checked_friction(child, it, findings))
                {
                    self.frictions.insert(link.to_owned(), friction);
                    findings.used(child, || format!("friction {friction} of link {}", quoted(link)));
                }
            } else if is_self_collide(child) {
                if says_yes(child) {
                    self.self_collide.insert(link.to_owned());
                    findings.used(child, || {
                        format!("link {} touches others of the robot that do so", quoted(link))
                    });
                }
            } else if tag == "material" {
                match color(child) {
                    Some(color) => {
                        self.colors.insert(link.to_owned(), color);
                        findings.used(child, || {
                            format!("the colour of visuals of link {} without one", quoted(link))
                        });
                    }
                    None => others.add(tag),
                }
            } else if tag != "sensor" && !(is_joint && OF_JOINTS.contains(&tag)) {
                others.add(tag);
            }
        }
        others.report(node, findings);
    }

    /// Reads the settings of a joint; a link may have the same name.
    fn read_joint(&mut self, node: Node, joint: &str, is_link: bool, findings: &mut Findings) {
        let mut others = Others::default();
        let of = self.joints.entry(joint.to_owned()).or_default();
        for child in node.children().filter(Node::is_element) {
            let tag = child.tag_name().name();
            let slot = match tag {
                "damping" | "dampingFactor" => &mut of.damping,
                "friction" => &mut of.friction,
                "springStiffness" => &mut of.stiffness,
                "springReference" => &mut of.reference,
                "sensor" => continue,
                // Elements of the link were already reported.
                _ if is_link => continue,
                _ => {
                    others.add(tag);
                    continue;
                }
            };
            *slot = number(child, findings).filter(|value| tag == "springReference" || *value >= 0.0);
            if let Some(value) = *slot {
                findings.used(child, || format!("{tag} {} of joint {}", short(value), quoted(joint)));
            }
        }
        others.report(node, findings);
    }
}

/// Ignored elements: the first of them by name.
#[derive(Default)]
struct Others {
    named: Vec<String>,
}

impl Others {
    fn add(&mut self, tag: &str) {
        if self.named.len() < 8 && !self.named.iter().any(|known| known == tag) {
            self.named.push(tag.to_owned());
        }
    }

    fn report(&self, node: Node, findings: &mut Findings) {
        if !self.named.is_empty() {
            findings.info(node, Ignored, format!("not read by simd: {}", self.named.join(", ")));
        }
    }
}

fn is_self_collide(node: Node) -> bool {
    is(node, "selfCollide") || is(node, "self_collide")
}

fn says_yes(node: Node) -> bool {
    let text = node.attribute("value").or_else(|| node.text()).unwrap_or_default().trim();
    text == "1" || text.eq_ignore_ascii_case("true")
}

fn says_no(node: Node) -> bool {
    let text = node.attribute("value").or_else(|| node.text()).unwrap_or_default().trim();
    text == "0" || text.eq_ignore_ascii_case("false")
}

fn number(node: Node, findings: &mut Findings) -> Option<f64> {
    let text = node.attribute("value").or_else(|| node.text()).unwrap_or_default();
    match numbers::read(text, Shape::Exactly(1)) {
        Ok(read) => read.values.first().copied(),
        Err(_not_a_number) => {
            findings.warn(node, Ignored, format!("{} is not a number", quoted(text.trim())));
            None
        }
    }
}

/// Returns a friction, if it is valid.
pub(super) fn checked_friction(node: Node, value: f64, findings: &mut Findings) -> Option<f64> {
    if value < 0.0 {
        findings.warn(node, Ignored, format!("a friction of {value} is negative: the world's is used"));
        return None;
    }
    Some(value)
}

fn unknown_reference(node: Node, reference: &str, links: &BTreeSet<&str>, findings: &mut Findings) {
    let meant = match nearest(reference, links.iter().copied()) {
        Some(meant) => format!("; did you mean {}?", quoted(meant)),
        None => String::new(),
    };
    let message = format!("{} is not a link or joint of this robot{meant}", quoted(reference));
    findings.warn(node, Ignored, message);
}

/// Returns the colour of `Gazebo/Red`, or of `<material><diffuse>1 0 0 1</diffuse></material>`.
fn color(node: Node) -> Option<[f64; 4]> {
    if let Some(diffuse) = node.descendants().find(|child| is(*child, "diffuse")) {
        let read = numbers::read(diffuse.text().unwrap_or_default(), Shape::Color).ok()?;
        let color: [f64; 4] = read.values.try_into().ok()?;
        return Some(color.map(|part| part.clamp(0.0, 1.0)));
    }
    let name = node.text().unwrap_or_default().trim().strip_prefix("Gazebo/")?;
    let (_, [red, green, blue]) = COLORS.iter().find(|(known, _)| *known == name)?;
    Some([*red, *green, *blue, 1.0])
}

/// Diffuse colours of Gazebo's materials.
const COLORS: [(&str, [f64; 3]); 22] = [
    ("Black", [0.0, 0.0, 0.0]),
    ("Blue", [0.0, 0.0, 1.0]),
    ("BlueTransparent", [0.0, 0.0, 1.0]),
    ("DarkGray", [0.175, 0.175, 0.175]),
    ("DarkGrey", [0.175, 0.175, 0.175]),
    ("DarkYellow", [0.7, 0.7, 0.0]),
    ("FlatBlack", [0.1, 0.1, 0.1]),
    ("Gold", [0.8, 0.648_936_17, 0.120_759_3]),
    ("Gray", [0.7, 0.7, 0.7]),
    ("Grey", [0.7, 0.7, 0.7]),
    ("Green", [0.0, 1.0, 0.0]),
    ("Indigo", [0.33, 0.0, 0.5]),
    ("Orange", [1.0, 0.508_823_5, 0.043_137_2]),
    ("Purple", [1.0, 0.0, 1.0]),
    ("Red", [1.0, 0.0, 0.0]),
    ("RedBright", [0.87, 0.26, 0.07]),
    ("SkyBlue", [0.13, 0.44, 0.70]),
    ("Turquoise", [0.0, 1.0, 1.0]),
    ("White", [1.0, 1.0, 1.0]),
    ("Yellow", [1.0, 1.0, 0.0]),
    ("ZincYellow", [0.972_5, 0.952_9, 0.207_8]),
    ("WoodPallet", [0.6, 0.4, 0.2]),
];

/// Returns the report's phrase on the number of links that collide with one another.
pub(super) fn colliding(count: usize) -> String {
    format!("{} of the robot touch each other", counted(count, "link"))
}

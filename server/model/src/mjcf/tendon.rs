//! `<tendon>`: fixed tendons, whose length is a sum of joint positions.
//!
//! If all joints of a tendon follow one joint, this leader gets its spring, damping, friction, armature and limits.
//! For a length of `factor * position + offset`, stiffness, damping and armature are multiplied by `factor^2`.
//! Another tendon, of joints that move independently, becomes a joint whose position is the length.

use std::collections::{BTreeMap, BTreeSet};

use glamx::DVec3;

use super::body::Body;
use super::compiler::Compiler;
use super::coupling::{LeaderSum, Linear};
use super::defaults::Classed;
use super::equality::{body_of, top_of};
use super::joint::{BodyJoint, Joints, Kind, is_limited};
use super::{Reader, value};
use crate::report::Disposition::{Ignored, Repaired, Used};
use crate::report::short;
use crate::robot::JointLimits;
use crate::translation::element::Element;
use crate::translation::notes::{Notes, Stop};
use crate::urdf::findings::quoted;

/// Maximum number of joints of a tendon.
const MAX_JOINTS: usize = 100;
/// Maximum number of tendons in a file.
const MAX: usize = 1024;

/// Fixed tendons by name.
#[derive(Clone, Debug, Default)]
pub(super) struct Tendons(BTreeMap<String, Tendon>);

/// A sum of joint positions.
#[derive(Clone, Debug, Default)]
pub(super) struct Tendon {
    /// Joints and their factors.
    pub(super) terms: Vec<(String, f64)>,
    /// Length at the positions of the file's pose.
    pub(super) reference: f64,
    /// Length at the rest positions of the joints' springs.
    relaxed: f64,
    /// The length by its only leader; set by [`apply`].
    pub(super) length: Option<Linear>,
}

/// A tendon of joints of one robot that move independently: a joint of it.
#[derive(Clone, Debug)]
pub(super) struct Independent {
    pub(super) joint: BodyJoint,
    /// Child of the world that has its joints.
    pub(super) top: usize,
    pub(super) terms: Vec<(String, f64)>,
    pub(super) offset: f64,
}

impl Tendons {
    pub(super) fn get(&self, name: &str) -> Option<&Tendon> {
        self.0.get(name)
    }
}

/// Reads the joints of fixed tendons.
pub(super) fn read(elements: &[Element], joints: &mut Joints, notes: &mut Notes) -> Result<(), Stop> {
    for element in elements.iter().copied().filter(|element| element.tag() == "fixed") {
        if joints.tendons.0.len() >= MAX {
            notes.warn(element, Ignored, format!("there are more than {MAX} tendons: left out"));
            break;
        }
        let mut tendon = Tendon::default();
        for child in element.children("joint") {
            let [factor] = value::numbers(child, "coef", notes)?.unwrap_or([0.0]);
            let name = child.word("joint").unwrap_or_default();
            let Some(joint) = joints.known.get(name).copied() else {
                let message = format!("there is no joint {}: the tendon is without it", quoted(name));
                notes.warn(child, Ignored, message);
                continue;
            };
            if joint.kind == Kind::Ball {
                notes.warn(child, Ignored, "ball joints have no tendons: the tendon is without it");
                continue;
            }
            if tendon.terms.len() >= MAX_JOINTS {
                let message = format!("a tendon has at most {MAX_JOINTS} joints: the tendon is without it");
                notes.warn(child, Ignored, message);
                break;
            }
            tendon.reference += factor * joint.reference;
            tendon.relaxed += factor * joint.rest;
            tendon.terms.push((name.to_owned(), factor));
        }
        let name = element.word("name").unwrap_or_default().to_owned();
        if tendon.terms.is_empty() {
            notes.warn(element, Ignored, "it has no joint: left out");
        } else if !name.is_empty() {
            joints.tendons.0.insert(name, tendon);
        }
    }
    Ok(())
}

/// Gives the properties of fixed tendons to the joints that lead them, and reports what is lost of all others.
pub(super) fn apply<'a>(
    elements: &[Element<'a>],
    actuators: &[Element<'a>],
    reader: &mut Reader<'a>,
    joints: &mut Joints,
) -> Result<(), Stop> {
    let Reader { scope, bodies, notes, .. } = reader;
    let Joints { tendons, couplings, efforts, known, independent, .. } = joints;
    let driven: BTreeSet<&str> = actuators.iter().filter_map(|actuator| actuator.word("tendon")).collect();
    for element in elements.iter().copied() {
        let tendon = scope.classes.of(element, None, ["tendon", "tendon"]);
        let properties = Properties::read(&tendon, &scope.compiler, notes)?;
        if element.tag() != "fixed" {
            if properties.is_none() {
                notes.info(element, Ignored, "not read by simd: it only shows a length");
            } else {
                let lost = properties.words().join(", ");
                let message =
                    format!("only tendons of joints are read by simd: the robot is without its {lost}");
                notes.warn(element, Ignored, message);
            }
            continue;
        }
        let name = element.word("name").unwrap_or_default();
        let Some(found) = tendons.0.get_mut(name) else {
            if !properties.is_none() {
                notes.warn(element, Ignored, "it has no name or no joint: left out");
            }
            continue;
        };
        let sum = couplings.sum(&found.terms);
        found.length = sum.of_one();
        let is_needed = !properties.is_none() || driven.contains(name);
        if let Some(top) = of_one_robot(bodies, &sum).filter(|_| found.length.is_none() && is_needed) {
            let mut own = name.to_owned();
            while known.contains_key(&own) || independent.iter().any(|tendon| tendon.joint.name == own) {
                own += "_tendon";
            }
            let message = format!(
                "the joint {} of the robot is its length, a sum of the joints {}",
                quoted(&own),
                names(&found.terms)
            );
            notes.info(element, Used, message);
            let mut joint = joint_of(own.clone(), element);
            let length = Linear { joint: own, factor: 1.0, offset: 0.0 };
            joint.limits.effort = properties.effort;
            properties.give(&length, found.relaxed, &mut joint, element, notes);
            found.length = Some(length);
            independent.push(Independent {
                joint,
                top,
                terms: sum.factors.into_iter().collect(),
                offset: sum.offset,
            });
            continue;
        }
        if properties.is_none() {
            continue;
        }
        let Some(length) = &found.length else {
            let message = format!(
                "its joints ({}) are not of one robot: it is without its {}",
                names(&found.terms),
                properties.words().join(", ")
            );
            notes.warn(element, Ignored, message);
            continue;
        };
        if let Some(effort) = properties.effort.map(|effort| effort * length.factor.abs()) {
            let most = efforts.get(&length.joint).map_or(effort, |known| known.min(effort));
            efforts.insert(length.joint.clone(), most);
        }
        let mut all = bodies.iter_mut().flat_map(|body| &mut body.joints);
        let Some(leader) = all.find(|joint| joint.name == length.joint) else { continue };
        properties.give(length, found.relaxed, leader, element, notes);
        let message = format!(
            "joint {} has its {}, {} times",
            quoted(&length.joint),
            properties.words().join(", "),
            short(length.factor)
        );
        notes.info(element, Used, message);
    }
    Ok(())
}

/// Returns the child of the world that all joints of a sum of several belong to.
fn of_one_robot(bodies: &[Body], sum: &LeaderSum) -> Option<usize> {
    let mut tops = sum.factors.keys().map(|joint| body_of(bodies, joint).map(|body| top_of(bodies, body)));
    let first = tops.next()??;
    tops.all(|top| top == Some(first)).then_some(first)
}

/// Makes the joint of a tendon, without properties.
fn joint_of(name: String, element: Element) -> BodyJoint {
    BodyJoint {
        name,
        at: (element.file, element.line()),
        kind: Kind::Slide,
        anchor: DVec3::ZERO,
        axis: DVec3::Z,
        limits: JointLimits::default(),
        damping: 0.0,
        friction: 0.0,
        armature: 0.0,
        reference: 0.0,
        spring: None,
        rest: 0.0,
        spring_damper: None,
    }
}

/// Passive properties of a tendon.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Properties {
    stiffness: f64,
    /// Length at which its spring exerts no force; `None` is the length of relaxed joints.
    rest: Option<f64>,
    damping: f64,
    friction: f64,
    armature: f64,
    range: Option<[f64; 2]>,
    effort: Option<f64>,
}

impl Properties {
    fn read(tendon: &Classed, compiler: &Compiler, notes: &mut Notes) -> Result<Self, Stop> {
        let least = |name: &str| Ok(tendon.number(name)?.unwrap_or(0.0).max(0.0));
        let mut read = Self {
            stiffness: least("stiffness")?,
            damping: least("damping")?,
            friction: least("frictionloss")?,
            armature: least("armature")?,
            ..Self::default()
        };
        read.rest = match tendon.list("springlength", 2)?.as_deref() {
            Some([lower, upper]) if lower != upper && read.stiffness > 0.0 => {
                let message = format!(
                    "its spring exerts no force between two lengths; in simd it has one, {}",
                    short((lower + upper) / 2.0)
                );
                notes.warn(tendon.element, Repaired, message);
                Some((lower + upper) / 2.0)
            }
            // MuJoCo's -1 is the length of relaxed joints.
            Some([length, ..]) if *length != -1.0 => Some(*length),
            _ => None,
        };
        let range = |name: &str, limited: &str, notes: &mut Notes| -> Result<Option<[f64; 2]>, Stop> {
            let range = tendon.numbers::<2>(name, notes)?;
            Ok(range.filter(|[lower, upper]| lower < upper && is_limited(tendon, limited, true, compiler)))
        };
        read.range = range("range", "limited", notes)?;
        let effort = range("actuatorfrcrange", "actuatorfrclimited", notes)?;
        read.effort = effort.map(|[lower, upper]| lower.abs().max(upper.abs()));
        Ok(read)
    }

    fn is_none(&self) -> bool {
        self.words().is_empty()
    }

    /// Returns the names of the properties that it has.
    fn words(&self) -> Vec<&'static str> {
        [
            ("spring", self.stiffness > 0.0),
            ("damping", self.damping > 0.0),
            ("friction", self.friction > 0.0),
            ("armature", self.armature > 0.0),
            ("limits", self.range.is_some()),
            ("limit of effort", self.effort.is_some()),
        ]
        .into_iter()
        .filter_map(|(word, has)| has.then_some(word))
        .collect()
    }

    /// Adds the properties to the leader of a tendon. `relaxed` is its length at the rest positions of its joints.
    fn give(&self, length: &Linear, relaxed: f64, leader: &mut BodyJoint, at: Element, notes: &mut Notes) {
        let Linear { factor, offset, .. } = *length;
        leader.damping += factor * factor * self.damping;
        leader.friction += factor.abs() * self.friction;
        leader.armature += factor * factor * self.armature;
        let stiffness = factor * factor * self.stiffness;
        if stiffness > 0.0 {
            let rest = (self.rest.unwrap_or(relaxed) - offset) / factor;
            let [known, at] = leader.spring.unwrap_or_default();
            leader.spring = Some([known + stiffness, (known * at + stiffness * rest) / (known + stiffness)]);
        }
        let Some(range) = self.range else { return };
        let [one, other] = range.map(|length| (length - offset) / factor);
        let limits = &mut leader.limits;
        let lower = limits.lower.map_or(one.min(other), |lower| lower.max(one.min(other)));
        let upper = limits.upper.map_or(one.max(other), |upper| upper.min(one.max(other)));
        if lower < upper {
            (limits.lower, limits.upper) = (Some(lower), Some(upper));
        } else {
            notes.warn(
                at,
                Repaired,
                "its range and the limits of its joint have nothing in common: left out",
            );
        }
    }
}

/// Returns the names of the joints of a sum, for a report.
pub(super) fn names(terms: &[(String, f64)]) -> String {
    const MAX: usize = 8;
    let named: Vec<String> = terms.iter().take(MAX).map(|(name, _)| quoted(name)).collect();
    let more = if terms.len() > MAX { ", ..." } else { "" };
    format!("{}{more}", named.join(", "))
}

//! Reports unknown parts of a description, with the reason, and with a suggestion.

use roxmltree::Node;

use super::findings::{Findings, quoted};
use super::prescan::{is, is_of_xacro};
use super::vocabulary::{Element, ROBOT};
use crate::report::Disposition::Ignored;

/// Elements of real files that simd does not use.
const REASONS: &[(&str, &str)] = &[
    ("safety_controller", "soft limits are for controllers; <limit> is read"),
    ("calibration", "simulated joints need no calibration"),
    ("sensor", "it stands in the robot with a <parent>, or in the <gazebo> of its link or joint"),
    ("collision_checking", "simd does not check meshes"),
    ("self_collision_checking", "contacts within a robot are off"),
    ("joint_properties", "<dynamics> gives damping and friction"),
    ("contact_coefficients", "<contact> of the link gives friction"),
];

/// Reports an element that is unknown in its parent.
pub(super) fn element(child: Node, parent: &Element, findings: &mut Findings) {
    let tag = child.tag_name().name();
    let known = parent.children.iter().map(|known| known.tag);
    if is_of_xacro(child) {
        let message = "not read by simd: a call of a macro that xacro has not expanded";
        return findings.warn(child, Ignored, message);
    }
    if !is(child, tag) {
        return findings.info(child, Ignored, "not read by simd: it is of another namespace");
    }
    // Many of them are not typing errors.
    if findings.is_full() {
        return findings.info(child, Ignored, "not read by simd");
    }
    if let Some(meant) = nearest(tag, known) {
        let message = format!("not read by simd; did you mean <{meant}>?");
        return findings.warn(child, Ignored, message);
    }
    if parent.tag == "contact" {
        let message =
            "not read by simd: a surface has friction, also against rolling and spinning, and restitution";
        return findings.info(child, Ignored, message);
    }
    if (parent.tag, tag) == ("collision", "material") {
        return findings.info(child, Ignored, "not read by simd: a shape that touches is not drawn");
    }
    if let Some(reason) = REASONS.iter().find(|(known, _)| *known == tag).map(|(_, reason)| reason) {
        return findings.info(child, Ignored, format!("not read by simd: {reason}"));
    }
    let homes = homes(&|element| element.children.iter().any(|child| child.tag == tag));
    if homes.is_empty() {
        findings.info(child, Ignored, "not read by simd");
    } else {
        let message = format!("not read by simd here: it belongs in {}", homes.join(" or "));
        findings.warn(child, Ignored, message);
    }
}

/// Reports an attribute that is unknown in its element.
pub(super) fn attribute(
    node: Node,
    name: &str,
    is_foreign: bool,
    element: &Element,
    findings: &mut Findings,
) {
    let message = format!("attribute {} is not read by simd", quoted(name));
    let known = element.attributes.iter().map(|known| known.name);
    if is_foreign || findings.is_full() {
        return findings.info(node, Ignored, message);
    }
    if let Some(meant) = nearest(name, known) {
        return findings.warn(node, Ignored, format!("{message}; did you mean {meant}?"));
    }
    // A name, type or value may be untrusted.
    let is_common = ["name", "type", "value", "link", "joint"].contains(&name);
    let homes =
        if is_common { Vec::new() } else { homes(&|other| other.attributes.iter().any(|a| a.name == name)) };
    if homes.is_empty() {
        findings.info(node, Ignored, message);
    } else {
        findings.warn(node, Ignored, format!("{message} here: it belongs in {}", homes.join(" or ")));
    }
}

/// Reports unexpected text.
pub(super) fn text(node: Node, findings: &mut Findings) {
    let texts = node.children().filter(|child| child.is_text());
    if let Some(text) = texts.filter_map(|child| child.text()).map(str::trim).find(|text| !text.is_empty()) {
        findings.info(node, Ignored, format!("the text {} in it is not read by simd", quoted(text)));
    }
}

/// Returns the known word that this one misspells: in another case, or with one or two wrong letters.
pub(super) fn nearest<'w>(word: &str, known: impl Iterator<Item = &'w str>) -> Option<&'w str> {
    const LONGEST: usize = 64;
    let letters = word.chars().count();
    if letters > LONGEST {
        return None;
    }
    let most = match letters {
        0..=2 => 0,
        3..=4 => 1,
        _ => 2,
    };
    known
        .filter(|known| known.len() <= LONGEST)
        .map(|known| match known.eq_ignore_ascii_case(word) {
            true => (0, known),
            false => (strsim::osa_distance(word, known), known),
        })
        .filter(|(distance, _)| *distance <= most)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, known)| known)
}

/// Returns the tags of the elements with a property, each once.
fn homes(holds: &dyn Fn(&Element) -> bool) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    let mut open = vec![&ROBOT];
    while let Some(element) = open.pop() {
        let tag = format!("<{}>", element.tag);
        if holds(element) && !found.contains(&tag) {
            found.push(tag);
        }
        open.extend(element.children.iter().rev());
    }
    found
}

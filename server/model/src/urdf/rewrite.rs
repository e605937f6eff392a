//! Rewrites a description with other addresses of its meshes, or with more named states, and no other
//! changes.

use std::ops::Range;

use super::findings::Findings;
use super::{Refused, document, prescan};
use crate::limits::LoadLimits;
use crate::robot::RobotModel;
use crate::setup::NamedState;

/// Returns the description's text with each mesh's file name replaced if `address` returns another one. The
/// rest does not change, byte for byte, except for the repairs of [`describe`](super::describe). For example,
/// an XML declaration becomes blank, since the text is now UTF-8.
///
/// # Errors
///
/// As [`describe`](super::describe).
pub fn readdress(
    urdf: &[u8],
    limits: &LoadLimits,
    address: &dyn Fn(&str) -> Option<String>,
) -> Result<String, Refused> {
    let mut findings = Findings::new(limits.findings);
    let text = document::open(urdf, limits, &mut findings, |root, _| {
        let names = prescan::meshes(root).filter_map(|mesh| mesh.attribute_node("filename"));
        let replacements = names.filter_map(|name| Some((name.range(), address(name.value())?)));
        let replacements: Vec<(Range<usize>, String)> = replacements.collect();
        Ok(replaced(root.document().input_text(), &replacements))
    });
    text.map_err(|refusal| findings.refused(refusal))
}

/// Returns the description's text with further named states of the robot, after the repairs of [`readdress`].
/// `None` if it would have nothing new, or could no longer be read within the limits.
pub fn with_states(
    urdf: &[u8],
    limits: &LoadLimits,
    model: &RobotModel,
    states: &[NamedState],
) -> Option<String> {
    if states.is_empty() {
        return None;
    }
    let mut written = String::new();
    for NamedState { name, group, positions } in states {
        written += &format!("<group_state name=\"{}\" group=\"{}\">", escaped(name), escaped(group));
        for (joint, position) in positions {
            let joint = escaped(&model.joints.get(*joint)?.name);
            written += &format!("<joint name=\"{joint}\" value=\"{position}\"/>");
        }
        written += "</group_state>";
    }
    let mut findings = Findings::new(limits.findings);
    let text = document::open(urdf, limits, &mut findings, |root, _| {
        let text = root.document().input_text();
        let end = text.get(..root.range().end).and_then(|text| text.rfind("</"));
        let parts = end.and_then(|end| Some((text.get(..end)?, text.get(end..)?)));
        Ok(parts.map(|(before, after)| format!("{before}{written}{after}")))
    });
    let text = text.ok().flatten().filter(|text| text.len() <= limits.urdf_bytes)?;
    // Elements and depth have limits too.
    super::describe(text.as_bytes(), limits).is_ok().then_some(text)
}

/// Replaces whole attributes by file names, given in the order of the text.
fn replaced(text: &str, replacements: &[(Range<usize>, String)]) -> String {
    let mut written = String::with_capacity(text.len());
    let mut from = 0;
    for (range, address) in replacements {
        written += text.get(from..range.start).unwrap_or_default();
        written += &format!("filename=\"{}\"", escaped(address));
        from = range.end;
    }
    written + text.get(from..).unwrap_or_default()
}

/// Escapes text for an attribute.
fn escaped(text: &str) -> String {
    let mut written = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => written += "&amp;",
            '<' => written += "&lt;",
            '>' => written += "&gt;",
            '"' => written += "&quot;",
            '\'' => written += "&apos;",
            // A parser would turn these into spaces unless they are escaped.
            '\t' | '\n' | '\r' => written += &format!("&#{};", u32::from(character)),
            _ => written.push(character),
        }
    }
    written
}

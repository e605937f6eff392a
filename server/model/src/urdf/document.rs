//! Repairs a document's text before it is parsed: the place of its declaration, the text after its root, and
//! the repairs of [`mend`]. Line numbers do not change.

use std::borrow::Cow;

use roxmltree::{Document, Node};

use super::findings::{Findings, Refusal};
use super::mend::{self, bind_prefixes};
use super::prescan::{check_counts, check_depth, is, parse_xml, robot_element, syntax};
use super::text;
use crate::limits::LoadLimits;
use crate::report::{Disposition, Severity, counted};

/// Parses the bytes as a document and passes its `<robot>` to `then`.
pub(super) fn open<T>(
    urdf: &[u8],
    limits: &LoadLimits,
    findings: &mut Findings,
    then: impl FnOnce(Node, &mut Findings) -> Result<T, Refusal>,
) -> Result<T, Refusal> {
    let text = text::decode(urdf, limits, findings)?;
    let text = without_declarations(text, findings);
    let text = without_tail(text, findings);
    check_counts(&text, limits)?;
    let mut mended = Vec::new();
    let text = bind_prefixes(mend::mended(text, &mut mended), limits, &mut mended);
    for (line, message) in mended {
        repaired(findings, Some(line), message);
    }
    let document = parse_xml(&text, limits).map_err(|error| syntax(error, limits))?;
    check_depth(&document, limits.xml_depth)?;
    let with_world;
    let document = match declare_world(&document, findings) {
        Some(text) => {
            with_world = text;
            parse_xml(&with_world, limits).map_err(|error| syntax(error, limits))?
        }
        None => document,
    };
    findings.set_text(document.input_text());
    then(robot_element(&document, findings)?, findings)
}

fn repaired(findings: &mut Findings, line: Option<u32>, message: String) {
    findings.of_text(Severity::Warning, Disposition::Repaired, line, message);
}

fn line_of(text: &str, at: usize) -> u32 {
    let before = text.bytes().take(at).filter(|byte| *byte == b'\n').count();
    u32::try_from(before + 1).unwrap_or(u32::MAX)
}

/// Returns the ranges of `<?xml ...?>` before the root.
fn declarations(text: &str) -> Vec<(usize, usize)> {
    // One is correct, two have been seen; more are not a mistake.
    const MAX: usize = 8;
    let mut found = Vec::new();
    let mut at = 0;
    while found.len() < MAX
        && let Some(open) = text.get(at..).and_then(|rest| rest.find('<')).map(|open| at + open)
    {
        let tag = text.get(open..).unwrap_or_default();
        let length = if tag.starts_with("<!--") {
            tag.find("-->").map(|end| end + 3)
        } else if tag.starts_with("<?") {
            let end = tag.find("?>").map(|end| end + 2);
            let is_declaration = tag.get(5..6).is_none_or(|next| next.trim().is_empty() || next == "?");
            if tag.starts_with("<?xml") && is_declaration {
                found.extend(end.map(|length| (open, open + length)));
            }
            end
        } else {
            None
        };
        let Some(length) = length else { break };
        at = open + length;
    }
    found
}

/// Removes declarations. The text is already decoded, so they are not needed. XML requires them at the very
/// start, where exporters and authors of comments do not put them.
fn without_declarations<'a>(text: Cow<'a, str>, findings: &mut Findings) -> Cow<'a, str> {
    let declarations = declarations(&text);
    if declarations.is_empty() {
        return text;
    }
    let mut text = text.into_owned();
    for (start, end) in declarations {
        if start > 0 {
            let message =
                "the XML declaration is not at the start of the file; read as if it were".to_owned();
            repaired(findings, Some(line_of(&text, start)), message);
        }
        let declaration = text.get(start..end).unwrap_or_default();
        // Byte for byte, so that columns do not change either.
        let blank: String = declaration.bytes().map(|byte| if byte == b'\n' { '\n' } else { ' ' }).collect();
        text.replace_range(start..end, &blank);
    }
    Cow::Owned(text)
}

/// Adds a missing link `world`, on which some files put their robot: Gazebo and PyBullet know it implicitly.
/// Returns the text with it, on the robot's last line, if a joint names it.
fn declare_world(document: &Document, findings: &mut Findings) -> Option<String> {
    let robot = document.descendants().find(|node| is(*node, "robot"))?;
    let is_world =
        |node: &Node, attribute| node.attribute(attribute).is_some_and(|name| name.trim() == WORLD);
    if robot.children().any(|node| is(node, "link") && is_world(&node, "name")) {
        return None;
    }
    let parents = robot.children().filter(|node| is(*node, "joint")).flat_map(|joint| joint.children());
    let named = parents.into_iter().find(|node| is(*node, "parent") && is_world(node, "link"))?;
    let text = document.input_text();
    let end = text.get(..robot.range().end)?.rfind("</")?;
    let line = document.text_pos_at(named.range().start).row;
    let message = "its parent link \"world\" is not defined: a massless link of this name is added";
    findings.of_text(Severity::Info, Disposition::Defaulted, Some(line), message.to_owned());
    let (before, after) = (text.get(..end)?, text.get(end..)?);
    Some(format!("{before}<link name=\"{WORLD}\"/>{after}"))
}

/// Name of the fixed root.
const WORLD: &str = "world";

/// Removes the text after the last end tag, which cannot belong to a document: some files end in a NUL byte.
fn without_tail<'a>(text: Cow<'a, str>, findings: &mut Findings) -> Cow<'a, str> {
    let Some(end) = text.rfind('>').map(|last| last + 1) else { return text };
    let tail = text.get(end..).unwrap_or_default();
    let rest = tail.trim();
    let begin = text.get(..end).and_then(|text| text.rfind('<')).unwrap_or(0);
    let is_end_tag = text.get(begin..).is_some_and(|tag| tag.starts_with("</"));
    if rest.is_empty() || !is_end_tag {
        return text;
    }
    let line = line_of(&text, end + tail.find(rest).unwrap_or(0));
    let bytes = counted(rest.len(), "byte");
    let message = format!("there is more after the end of the document: {bytes}, left out");
    repaired(findings, Some(line), message);
    match text {
        Cow::Borrowed(text) => Cow::Borrowed(text.get(..end).unwrap_or(text)),
        Cow::Owned(mut text) => {
            text.truncate(end);
            Cow::Owned(text)
        }
    }
}

//! Named frames: MJCF's sites and SDF's frames. Each becomes a link without mass or shapes on a fixed joint, as
//! `tool0` is in a URDF.

use super::draft::{Draft, DraftFrame, DraftJoint, DraftLink, Names, UNLISTED};
use super::element::Element;
use super::notes::Notes;
use crate::first_bytes;
use crate::limits::{LoadLimits, MAX_LINKS};
use crate::report::Disposition::{Ignored, Used};
use crate::report::counted;
use crate::urdf::findings::quoted;

/// Bytes that a name may get for being unique.
const ROOM: usize = 40;
/// Frames with other names that the report lists.
const LISTED: usize = 20;

/// Makes links of the frames of all robots. They follow the file's own links and joints, which keep their
/// order. `word` is what the format calls a frame.
pub(crate) fn hang(
    drafts: &mut [Draft],
    (root, word): (Element, &str),
    limits: &LoadLimits,
    notes: &mut Notes,
) {
    let mut links: usize = drafts.iter().map(|draft| draft.links.len()).sum();
    let (mut hung, mut left_out, mut renamed) = (0, 0, Vec::new());
    for draft in drafts {
        let frames = std::mem::take(&mut draft.frames);
        if frames.is_empty() {
            continue;
        }
        let (mut link_names, mut joint_names) = (Names::default(), Names::default());
        for link in &draft.links {
            link_names.take(&link.name);
        }
        for joint in &draft.joints {
            joint_names.take(&joint.name);
        }
        for DraftFrame { name, link, link_from_frame } in frames {
            if draft.links.len() >= limits.links || links >= MAX_LINKS {
                left_out += 1;
                continue;
            }
            let wanted: String = name.chars().filter(|c| !c.is_control()).collect();
            let wanted = first_bytes(wanted.trim(), limits.name_bytes.saturating_sub(ROOM)).trim_end();
            if wanted.is_empty() {
                continue;
            }
            let given = match link_names.take(wanted) {
                true => wanted.to_owned(),
                false => link_names.unique(&format!("{wanted}_{word}")),
            };
            let joint = joint_names.unique(&format!("{given}_fixed"));
            draft.joints.push(DraftJoint::fixed(joint, UNLISTED, [link, given.clone()], link_from_frame));
            if given != name {
                renamed.push(format!("{} is {}", quoted(&name), quoted(&given)));
            }
            draft.links.push(DraftLink { inertial: None, ..DraftLink::bare(given, UNLISTED) });
            links += 1;
            hung += 1;
        }
    }
    if hung > 0 {
        let are = if hung == 1 { "is a link" } else { "are links" };
        notes.info(root, Used, format!("{} {are} without mass", counted(hung, word)));
    }
    if !renamed.is_empty() {
        let more = if renamed.len() > LISTED { ", ..." } else { "" };
        let count = counted(renamed.len(), word);
        renamed.truncate(LISTED);
        let message = format!("other links have the names of {count}: {}{more}", renamed.join(", "));
        notes.info(root, Used, message);
    }
    if left_out > 0 {
        let (count, most) = (counted(left_out, word), limits.links);
        let message = format!("{count} left out: a robot has at most {most} links, and a file {MAX_LINKS}");
        notes.warn(root, Ignored, message);
    }
}

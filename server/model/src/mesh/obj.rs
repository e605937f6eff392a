//! Wavefront OBJ: its triangles. Side files that it names are never opened.
//!
//! Only `v` and `f` matter here. Libraries keep each corner of each face, with its normal
//! and texture, before a limit can be checked: a face of 60 million corners took gigabytes.

use glamx::DVec3;

use super::Triangles;
use super::builder::{Builder, Fan};

/// Reads the text. Faces of more than three corners become fans.
pub(super) fn parse(bytes: &[u8]) -> Result<Triangles, String> {
    let mut mesh = Builder::default();
    let mut number = 0_usize;
    // The furthest corner that a face names before it is there, and the face's line.
    let mut ahead: Option<(u32, usize)> = None;
    let mut lines = bytes.split(|byte| *byte == b'\n');
    while let Some(line) = lines.next() {
        number += 1;
        let at = number;
        let mut line = line.trim_ascii();
        let element = [b"v ".as_slice(), b"v\t", b"f ", b"f\t"].iter().any(|start| line.starts_with(start));
        if !element {
            continue;
        }
        let is_face = line.starts_with(b"f");
        line = line.get(1..).unwrap_or_default();
        let mut fan = Fan::default();
        let mut corner = [0.0; 3];
        let mut given = 0;
        loop {
            // A backslash at the end goes on with the next line.
            let (tokens, goes_on) = match line.strip_suffix(b"\\") {
                Some(tokens) => (tokens, true),
                None => (line, false),
            };
            for token in tokens.split(u8::is_ascii_whitespace).filter(|token| !token.is_empty()) {
                if token.starts_with(b"#") {
                    break;
                }
                if is_face {
                    let index = index(token, mesh.corners()).ok_or_else(|| corner_unknown(at, token))?;
                    if index as usize >= mesh.corners() && ahead.is_none_or(|(most, _)| index > most) {
                        ahead = Some((index, at));
                    }
                    fan.corner(index, &mut mesh).map_err(|why| format!("line {at}: {why}"))?;
                } else if let Some(slot) = corner.get_mut(given) {
                    *slot = coordinate(token).ok_or_else(|| not_a_number(at, token))?;
                }
                given += 1;
            }
            if !goes_on {
                break;
            }
            let Some(next) = lines.next() else { break };
            line = next.trim_ascii();
            number += 1;
        }
        if is_face {
            // Points and edges are written as faces by some; they have no area.
            continue;
        }
        if given < 3 {
            return Err(format!("line {at}: a corner has {given} coordinates instead of three"));
        }
        mesh.corner(DVec3::from_array(corner)).map_err(|why| format!("line {at}: {why}"))?;
    }
    match ahead {
        Some((index, at)) if index as usize >= mesh.corners() => {
            Err(corner_unknown(at, (u64::from(index) + 1).to_string().as_bytes()))
        }
        _ => mesh.finish(),
    }
}

/// The corner that `7`, `7/1`, `7//3` or `-2` means, of `corners` so far.
fn index(token: &[u8], corners: usize) -> Option<u32> {
    let digits = token.split(|byte| *byte == b'/').next()?;
    let number: i64 = std::str::from_utf8(digits).ok()?.parse().ok()?;
    let before = if number < 0 { i64::try_from(corners).ok()? } else { -1 };
    u32::try_from(number.checked_add(before)?).ok()
}

fn coordinate(token: &[u8]) -> Option<f64> {
    std::str::from_utf8(token).ok()?.parse().ok()
}

fn corner_unknown(line: usize, token: &[u8]) -> String {
    format!("line {line}: a face names the corner {}, which is not there", shown(token))
}

fn not_a_number(line: usize, token: &[u8]) -> String {
    format!("line {line}: {} is not a number", shown(token))
}

fn shown(token: &[u8]) -> String {
    super::shown(&String::from_utf8_lossy(token.get(..100).unwrap_or(token)))
}

//! Wavefront OBJ: its triangles, and the beginnings of materials.
//!
//! Only `v`, `vt`, `f` and `usemtl` are read here; [`mtl`](super::mtl) reads the materials. Libraries keep
//! each corner of each face, with its normal and texture, before a limit can be checked. A face of 60 million
//! corners took gigabytes.

use glamx::DVec3;

use super::beside::Beside;
use super::builder::{Builder, FaceCorner, Fan, texture_coordinate};
use super::{Triangles, mtl};
use crate::limits;
use crate::robot::Paint;

/// Kind of a line.
#[derive(Clone, Copy, PartialEq)]
enum Element {
    Corner,
    /// Texture coordinates.
    Uv,
    Face,
}

impl Element {
    fn of(line: &[u8]) -> Option<Self> {
        let end = line.iter().position(u8::is_ascii_whitespace)?;
        match line.get(..end)? {
            b"v" => Some(Self::Corner),
            b"vt" => Some(Self::Uv),
            b"f" => Some(Self::Face),
            _ => None,
        }
    }
}

/// Reads the text. Faces of more than three corners become fans. Vertices without any face become their
/// convex hull, as in MuJoCo.
pub(super) fn parse(bytes: &[u8], beside: &Beside) -> Result<(Triangles, Vec<Paint>), String> {
    let mut mesh = Builder::default().covered_by(beside.cover());
    let looks = mtl::read(bytes, beside);
    // Only needed with a picture.
    let mut uvs: Option<Vec<[f32; 2]>> = beside.has_images().then(Vec::new);
    let mut number = 0_usize;
    // Highest vertex that a face names before its definition, and the face's line.
    let mut ahead: Option<(u32, usize)> = None;
    let mut lines = bytes.split(|byte| *byte == b'\n');
    while let Some(line) = lines.next() {
        number += 1;
        let at = number;
        let mut line = line.trim_ascii();
        let Some(element) = Element::of(line) else {
            if let Some(name) = line.strip_prefix(b"usemtl").filter(|_| !looks.is_empty()) {
                let name = String::from_utf8_lossy(name.trim_ascii());
                mesh.paint(looks.get(&*name).cloned().unwrap_or_default());
            }
            continue;
        };
        if element == Element::Uv && uvs.is_none() {
            continue;
        }
        let is_face = element == Element::Face;
        line = line.get(if element == Element::Uv { 2.. } else { 1.. }).unwrap_or_default();
        let mut fan = Fan::default();
        let mut corner = [0.0; 3];
        let mut given = 0;
        loop {
            // A backslash at the end continues on the next line.
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
                    let uv = uvs.as_deref().and_then(|uvs| texture_coordinates(token, uvs));
                    let corner = FaceCorner { index, uv: uv.unwrap_or_default() };
                    fan.corner(corner, &mut mesh).map_err(|why| format!("line {at}: {why}"))?;
                } else if element == Element::Uv {
                    // An invalid number is not a reason to refuse a mesh.
                    corner
                        .get_mut(given)
                        .into_iter()
                        .for_each(|slot| *slot = coordinate(token).unwrap_or(0.0));
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
            // Some exporters write points and edges as faces; they have no area.
            continue;
        }
        if element == Element::Uv {
            let [across, up, _] = corner;
            if let Some(uvs) = uvs.as_mut().filter(|uvs| uvs.len() < limits::MESH_VERTICES) {
                uvs.push([texture_coordinate(across), texture_coordinate(1.0 - up)]);
            }
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
        _ => {
            if mesh.triangles() == 0 && mesh.corners() >= 4 {
                mesh = mesh.hull()?;
            }
            let paints = mesh.take_paints();
            Ok((mesh.finish()?, paints))
        }
    }
}

/// Returns the texture coordinates of `7/1`, `7/1/3` or `-2/-1`, of those so far.
fn texture_coordinates(token: &[u8], uvs: &[[f32; 2]]) -> Option<[f32; 2]> {
    let digits = token.split(|byte| *byte == b'/').nth(1)?;
    uvs.get(index(digits, uvs.len())? as usize).copied()
}

/// Returns the vertex of `7`, `7/1`, `7//3` or `-2`, of `corners` so far.
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
    format!("line {line}: a face names the corner {}, which does not exist", shown(token))
}

fn not_a_number(line: usize, token: &[u8]) -> String {
    format!("line {line}: {} is not a number", shown(token))
}

fn shown(token: &[u8]) -> String {
    super::shown(&String::from_utf8_lossy(token.get(..100).unwrap_or(token)))
}

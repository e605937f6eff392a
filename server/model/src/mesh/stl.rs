//! STL, binary and ASCII.

use std::borrow::Cow;
use std::io::Cursor;

use glamx::DVec3;

use super::Triangles;
use super::builder::Builder;
use crate::limits;

const HEADER: usize = 80;
const START: usize = HEADER + 4;
const TRIANGLE: usize = 50;

/// Reads either kind.
pub(super) fn parse(bytes: &[u8]) -> Result<Triangles, String> {
    let bytes = if is_binary(bytes) { as_binary(bytes)? } else { as_ascii(bytes)? };
    let not_stl = |error: std::io::Error| format!("not an STL: {error}");
    let mut file = Cursor::new(bytes.as_ref());
    let mut corners: Vec<[f32; 3]> = Vec::new();
    for triangle in stl_io::create_stl_reader(&mut file).map_err(not_stl)? {
        corners.extend(triangle.map_err(not_stl)?.vertices.map(|vertex| vertex.0));
        check_count(corners.len() / 3)?;
    }
    let mut mesh = Builder::default();
    let mut triangle = [0; 3];
    let mut shared = vec![0; corners.len()];
    for (place, (corner, first)) in corners.iter().zip(first_alike(&corners)).enumerate() {
        // A corner that stood before has its index already.
        let index = match shared.get(first as usize) {
            Some(index) if (first as usize) < place => *index,
            _ => mesh.corner(DVec3::from_array(corner.map(f64::from)))?,
        };
        shared.get_mut(place).into_iter().for_each(|shared| *shared = index);
        triangle.get_mut(place % 3).into_iter().for_each(|slot| *slot = index);
        if place % 3 == 2 {
            mesh.triangle(triangle)?;
        }
    }
    mesh.finish()
}

/// For each corner the first one with the same coordinates: STL repeats a corner in each of
/// its triangles. By sorting, which needs a third of the memory that a map of corners does.
fn first_alike(corners: &[[f32; 3]]) -> Vec<u32> {
    // 0.0 and -0.0 are one place.
    let key = |place: u32| corners.get(place as usize).map(|corner| corner.map(|x| (x + 0.0).to_bits()));
    let mut order: Vec<u32> = (0..u32::try_from(corners.len()).unwrap_or(u32::MAX)).collect();
    order.sort_unstable_by_key(|place| (key(*place), *place));
    let mut firsts = vec![0; order.len()];
    for alike in order.chunk_by(|a, b| key(*a) == key(*b)) {
        for place in alike {
            if let (Some(slot), Some(first)) = (firsts.get_mut(*place as usize), alike.first()) {
                *slot = *first;
            }
        }
    }
    firsts
}

/// One in ten binary files begins with the word `solid`, so the size decides:
/// it must be what the count of triangles says. Else the word does.
fn is_binary(bytes: &[u8]) -> bool {
    let exact = declared(bytes).is_some_and(|count| bytes.len() == START + TRIANGLE * count);
    exact || !bytes.trim_ascii_start().starts_with(b"solid")
}

/// How many triangles a binary file says it has.
fn declared(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER..START)?;
    usize::try_from(u32::from_le_bytes(count.try_into().ok()?)).ok()
}

fn check_count(count: usize) -> Result<(), String> {
    let cap = limits::MESH_TRIANGLES;
    if count > cap { Err(format!("it has {count} triangles; the most is {cap}")) } else { Ok(()) }
}

/// The file with a header that stl_io takes for binary.
fn as_binary(bytes: &[u8]) -> Result<Cow<'_, [u8]>, String> {
    let Some(count) = declared(bytes) else {
        return Err(format!("not an STL: it has only {} bytes", bytes.len()));
    };
    let held = bytes.len().saturating_sub(START) / TRIANGLE;
    if count > held {
        return Err(format!("it says it has {count} triangles, but holds {held}"));
    }
    check_count(count)?;
    if !bytes.starts_with(b"solid") {
        return Ok(Cow::Borrowed(bytes));
    }
    let mut bytes = bytes.to_vec();
    bytes.iter_mut().take(HEADER).for_each(|byte| *byte = 0);
    Ok(Cow::Owned(bytes))
}

/// The file with a first line that stl_io takes for ASCII: it wants a space
/// after `solid`, which nameless solids lack.
fn as_ascii(bytes: &[u8]) -> Result<Cow<'_, [u8]>, String> {
    let bytes = bytes.trim_ascii_start();
    if bytes.starts_with(b"solid ") {
        return Ok(Cow::Borrowed(bytes));
    }
    let rest = bytes.iter().position(|byte| *byte == b'\n').and_then(|end| bytes.get(end..));
    let rest = rest.ok_or("not an STL: it has only one line")?;
    Ok(Cow::Owned([b"solid mesh".as_slice(), rest].concat()))
}

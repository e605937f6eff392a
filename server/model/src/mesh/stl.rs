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
    // The count of a binary file was checked.
    corners.reserve_exact(bytes.len() / TRIANGLE * 3);
    for triangle in stl_io::create_stl_reader(&mut file).map_err(not_stl)? {
        corners.extend(triangle.map_err(not_stl)?.vertices.map(|vertex| vertex.0));
        check_count(corners.len() / 3)?;
    }
    // First the index of the first equal vertex, then the vertex's final index.
    let mut indices = first_alike(&corners);
    let distinct = (0_u32..).zip(&indices).filter(|(number, first)| number == *first).count();
    let mut mesh = Builder::with_capacity(distinct, corners.len() / 3);
    for (number, corner) in corners.iter().enumerate() {
        let first = indices.get(number).map_or(number, |first| *first as usize);
        let index = match indices.get(first) {
            Some(index) if first < number => *index,
            _ => mesh.corner(DVec3::from_array(corner.map(f64::from)))?,
        };
        indices.get_mut(number).into_iter().for_each(|slot| *slot = index);
    }
    drop(corners);
    let (triangles, _) = indices.as_chunks::<3>();
    triangles.iter().try_for_each(|triangle| mesh.triangle(*triangle))?;
    mesh.finish()
}

/// Returns for each vertex the first one with the same coordinates: STL repeats a vertex in each of its
/// triangles. Sorting needs a third of the memory of a map.
fn first_alike(corners: &[[f32; 3]]) -> Vec<u32> {
    // 0.0 and -0.0 are equal.
    let key = |number: u32| corners.get(number as usize).map(|corner| corner.map(|x| (x + 0.0).to_bits()));
    let mut order: Vec<u32> = (0..u32::try_from(corners.len()).unwrap_or(u32::MAX)).collect();
    order.sort_unstable_by_key(|number| (key(*number), *number));
    let mut firsts = vec![0; order.len()];
    for alike in order.chunk_by(|a, b| key(*a) == key(*b)) {
        for number in alike {
            if let (Some(slot), Some(first)) = (firsts.get_mut(*number as usize), alike.first()) {
                *slot = *first;
            }
        }
    }
    firsts
}

/// Returns whether a file is binary. One in ten binary files begins with the word `solid`, so the size
/// decides first: it must match the count of triangles. Otherwise the word decides.
fn is_binary(bytes: &[u8]) -> bool {
    let exact = declared(bytes).is_some_and(|count| bytes.len() == START + TRIANGLE * count);
    exact || !bytes.trim_ascii_start().starts_with(b"solid")
}

/// Notes that a binary file has more bytes than its count, which are left out.
pub(super) fn note(bytes: &[u8]) -> Option<String> {
    let count = declared(bytes).filter(|_| is_binary(bytes))?;
    let rest = bytes.len().checked_sub(START + TRIANGLE.checked_mul(count)?)?;
    (rest >= TRIANGLE).then(|| {
        let held = (bytes.len() - START) / TRIANGLE;
        format!("its header declares {count} triangles, and it has {held}: {count} are read")
    })
}

/// Returns the number of triangles in the header of a binary file.
fn declared(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER..START)?;
    usize::try_from(u32::from_le_bytes(count.try_into().ok()?)).ok()
}

fn check_count(count: usize) -> Result<(), String> {
    let cap = limits::MESH_TRIANGLES;
    if count > cap { Err(format!("it has {count} triangles; the limit is {cap}")) } else { Ok(()) }
}

/// Returns the file with a header that stl_io takes for binary.
fn as_binary(bytes: &[u8]) -> Result<Cow<'_, [u8]>, String> {
    let Some(count) = declared(bytes) else {
        return Err(format!("not an STL: it has only {} bytes", bytes.len()));
    };
    let held = bytes.len().saturating_sub(START) / TRIANGLE;
    if count > held {
        return Err(format!("its header declares {count} triangles, but it has {held}"));
    }
    check_count(count)?;
    if !bytes.starts_with(b"solid") {
        return Ok(Cow::Borrowed(bytes));
    }
    let mut bytes = bytes.to_vec();
    bytes.iter_mut().take(HEADER).for_each(|byte| *byte = 0);
    Ok(Cow::Owned(bytes))
}

/// Returns the file with a first line that stl_io takes for ASCII: it requires a space after `solid`, which
/// nameless solids lack.
fn as_ascii(bytes: &[u8]) -> Result<Cow<'_, [u8]>, String> {
    let bytes = bytes.trim_ascii_start();
    if bytes.starts_with(b"solid ") {
        return Ok(Cow::Borrowed(bytes));
    }
    let rest = bytes.iter().position(|byte| *byte == b'\n').and_then(|end| bytes.get(end..));
    let rest = rest.ok_or("not an STL: it has only one line")?;
    Ok(Cow::Owned([b"solid mesh".as_slice(), rest].concat()))
}

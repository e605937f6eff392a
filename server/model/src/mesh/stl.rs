//! STL, binary and ASCII.

use std::borrow::Cow;
use std::io::Cursor;

use glamx::DVec3;

use super::Triangles;
use crate::limits;

const HEADER: usize = 80;
const START: usize = HEADER + 4;
const TRIANGLE: usize = 50;

/// Reads either kind.
pub(super) fn parse(bytes: &[u8]) -> Result<Triangles, String> {
    let bytes = if is_binary(bytes) { as_binary(bytes)? } else { as_ascii(bytes)? };
    let mesh =
        stl_io::read_stl(&mut Cursor::new(bytes.as_ref())).map_err(|error| format!("not an STL: {error}"))?;
    if mesh.faces.is_empty() {
        return Err("it has no triangles".to_owned());
    }
    check_count(mesh.faces.len())?;
    let vertices: Vec<DVec3> =
        mesh.vertices.iter().map(|vertex| DVec3::from_array(vertex.0.map(f64::from))).collect();
    if vertices.iter().any(|vertex| !vertex.is_finite()) {
        return Err("a corner is not finite".to_owned());
    }
    if vertices.iter().any(|vertex| vertex.abs().max_element() > limits::MAGNITUDE) {
        return Err(format!("a corner is further than {:e} away", limits::MAGNITUDE));
    }
    let index = |index: usize| u32::try_from(index).ok().filter(|_| index < vertices.len());
    let corner = |[a, b, c]: [usize; 3]| Some([index(a)?, index(b)?, index(c)?]);
    let triangles: Option<Vec<_>> = mesh.faces.iter().map(|face| corner(face.vertices)).collect();
    let triangles = triangles.ok_or("a triangle has no corner")?;
    Ok((vertices, triangles))
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

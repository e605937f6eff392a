//! Mesh files to triangles, by the format that their name says.

mod builder;
mod collada;
mod obj;
mod stl;
#[cfg(test)]
pub(crate) mod tests;

use glamx::DVec3;

use crate::limits;

/// Corners, and triangles as indices into them.
pub(crate) type Triangles = (Vec<DVec3>, Vec<[u32; 3]>);

/// Reads a mesh file, or says in a fragment of a sentence why not.
pub(crate) fn parse(uri: &str, bytes: &[u8]) -> Result<Triangles, String> {
    if bytes.len() > limits::MESH_BYTES {
        return Err(format!("it has {} bytes; the most is {}", bytes.len(), limits::MESH_BYTES));
    }
    let file = uri.rsplit(['/', '\\']).next().unwrap_or(uri);
    match file.rsplit_once('.').map(|(_, extension)| extension.to_ascii_lowercase()) {
        Some(extension) if extension == "stl" => stl::parse(bytes),
        Some(extension) if extension == "obj" => obj::parse(bytes),
        Some(extension) if extension == "dae" => collada::parse(bytes),
        Some(extension) if extension.len() < 10 => {
            Err(format!(".{extension} files are not read; convert it to STL, OBJ or COLLADA"))
        }
        _ => Err("only .stl, .obj and .dae files are read".to_owned()),
    }
}

/// A word of the file as an error shows it: quoted, and not long.
fn shown(word: &str) -> String {
    const MOST: usize = 40;
    match word.char_indices().nth(MOST) {
        Some((end, _)) => format!("{:?}...", word.get(..end).unwrap_or_default()),
        None => format!("{word:?}"),
    }
}

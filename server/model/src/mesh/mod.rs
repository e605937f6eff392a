//! Mesh files to triangles, by the format that their name says.

pub(crate) mod beside;
mod builder;
mod collada;
mod gltf;
mod heights;
pub(crate) mod hull;
pub(crate) mod image;
mod msh;
mod mtl;
mod obj;
mod stl;
#[cfg(test)]
pub(crate) mod tests;

use glamx::DVec3;

use crate::limits;
use crate::robot::{Grid, MeshAsset, Paint, Sha256};
pub(crate) use beside::Beside;

/// Corners, and triangles as indices into them.
pub(crate) type Triangles = (Vec<DVec3>, Vec<[u32; 3]>);

/// What is in a mesh file.
pub(crate) struct Content {
    pub(crate) triangles: Triangles,
    pub(crate) paints: Vec<Paint>,
    /// Of a height field.
    pub(crate) grid: Option<Grid>,
}

impl From<(Triangles, Vec<Paint>)> for Content {
    fn from((triangles, paints): (Triangles, Vec<Paint>)) -> Self {
        Self { triangles, paints, grid: None }
    }
}

/// Reads a mesh file, its colours and its textures, or says in a fragment of a sentence why not.
pub(crate) fn read(uri: &str, bytes: &[u8], beside: &Beside) -> Result<Content, String> {
    if bytes.len() > limits::MESH_BYTES {
        return Err(format!("it has {} bytes; the most is {}", bytes.len(), limits::MESH_BYTES));
    }
    match format(uri).as_str() {
        "stl" => Ok((stl::parse(bytes)?, Vec::new()).into()),
        "obj" => Ok(obj::parse(bytes, beside)?.into()),
        "msh" => Ok((msh::parse(bytes)?, Vec::new()).into()),
        "dae" => Ok(collada::parse(bytes, beside)?.into()),
        "gltf" | "glb" => Ok(gltf::parse(bytes, beside)?.into()),
        "png" => heights::png(bytes),
        "csv" => heights::text(bytes),
        "" => Err(
            "only .stl, .obj, .dae, .gltf, .glb and .msh files are read, and height fields in .png and .csv"
                .to_owned(),
        ),
        other => Err(format!(".{other} files are not read; convert it to STL, OBJ, COLLADA or glTF")),
    }
}

/// The same as a robot has it.
pub(crate) fn asset(uri: &str, sha256: Sha256, bytes: &[u8], beside: &Beside) -> Result<MeshAsset, String> {
    let Content { triangles: (vertices, triangles), paints, grid } = read(uri, bytes, beside)?;
    Ok(MeshAsset { sha256, vertices, triangles, paints, files: beside.files.clone(), grid })
}

/// What a mesh file says of itself that is not so, as a fragment of a sentence, where it can be read all the same.
pub(crate) fn note(uri: &str, bytes: &[u8]) -> Option<String> {
    if format(uri) == "stl" { stl::note(bytes) } else { None }
}

/// A mesh file without its colours.
#[cfg(test)]
pub(crate) fn parse(uri: &str, bytes: &[u8]) -> Result<Triangles, String> {
    read(uri, bytes, &Beside::default()).map(|content| content.triangles)
}

/// What a file is read as: the extension of its name, small; empty where it has none.
pub(crate) fn format(uri: &str) -> String {
    const MOST: usize = 10;
    let file = uri.rsplit(['/', '\\']).next().unwrap_or(uri);
    let extension = file.rsplit_once('.').map(|(_, extension)| extension.trim_end());
    extension.filter(|extension| extension.len() < MOST).unwrap_or_default().to_ascii_lowercase()
}

/// A word of the file as an error shows it: quoted, and not long.
fn shown(word: &str) -> String {
    const MOST: usize = 40;
    match word.char_indices().nth(MOST) {
        Some((end, _)) => format!("{:?}...", word.get(..end).unwrap_or_default()),
        None => format!("{word:?}"),
    }
}

//! Reads mesh files to triangles, by their extension.

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

/// Vertices, and triangles as indices into them.
pub(crate) type Triangles = (Vec<DVec3>, Vec<[u32; 3]>);

/// Content of a mesh file.
pub(crate) struct Content {
    pub(crate) triangles: Triangles,
    pub(crate) paints: Vec<Paint>,
    /// Present for a height field.
    pub(crate) grid: Option<Grid>,
}

impl From<(Triangles, Vec<Paint>)> for Content {
    fn from((triangles, paints): (Triangles, Vec<Paint>)) -> Self {
        Self { triangles, paints, grid: None }
    }
}

/// Reads a mesh file, its colours and its textures. The error is a fragment of a sentence.
pub(crate) fn read(uri: &str, bytes: &[u8], beside: &Beside) -> Result<Content, String> {
    if bytes.len() > limits::MESH_BYTES {
        return Err(format!("it has {} bytes; the limit is {}", bytes.len(), limits::MESH_BYTES));
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

/// Reads a mesh like [`read`], as an asset of a robot.
pub(crate) fn asset(uri: &str, sha256: Sha256, bytes: &[u8], beside: &Beside) -> Result<MeshAsset, String> {
    let Content { triangles: (vertices, triangles), paints, grid } = read(uri, bytes, beside)?;
    Ok(MeshAsset { sha256, vertices, triangles, paints, files: beside.files.clone(), grid })
}

/// Returns, as a fragment of a sentence, a wrong statement of a mesh file that can be read nevertheless.
pub(crate) fn note(uri: &str, bytes: &[u8]) -> Option<String> {
    if format(uri) == "stl" { stl::note(bytes) } else { None }
}

/// Reads a mesh file without its colours.
#[cfg(test)]
pub(crate) fn parse(uri: &str, bytes: &[u8]) -> Result<Triangles, String> {
    read(uri, bytes, &Beside::default()).map(|content| content.triangles)
}

/// Returns the format of a file: the extension of its name in lower case; empty if it has none.
pub(crate) fn format(uri: &str) -> String {
    const MAX: usize = 10;
    let file = uri.rsplit(['/', '\\']).next().unwrap_or(uri);
    let extension = file.rsplit_once('.').map(|(_, extension)| extension.trim_end());
    extension.filter(|extension| extension.len() < MAX).unwrap_or_default().to_ascii_lowercase()
}

/// Quotes a word of the file for an error, and shortens it.
fn shown(word: &str) -> String {
    const MAX: usize = 40;
    match word.char_indices().nth(MAX) {
        Some((end, _)) => format!("{:?}...", word.get(..end).unwrap_or_default()),
        None => format!("{word:?}"),
    }
}

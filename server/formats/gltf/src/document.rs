//! JSON of a glTF, as far as it is read, and the binary part of a GLB (glTF 2.0, chapters 4 and 5).

use serde::Deserialize;

use crate::{MAX_JSON_BYTES, MAX_OBJECTS, shown};

/// The JSON of a file, as far as it is read.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct Document {
    /// Facts about the file.
    pub asset: Asset,
    /// Names of extensions that a reader must know.
    pub extensions_required: Vec<String>,
    /// Index of its scene.
    pub scene: Option<usize>,
    /// Its scenes.
    pub scenes: Vec<Scene>,
    /// Its nodes.
    pub nodes: Vec<Node>,
    /// Its meshes.
    pub meshes: Vec<Mesh>,
    /// Its materials.
    pub materials: Vec<Material>,
    /// Its textures.
    pub textures: Vec<Texture>,
    /// Its pictures.
    pub images: Vec<Image>,
    /// Its accessors.
    pub accessors: Vec<Accessor>,
    /// Its views of buffers.
    pub buffer_views: Vec<BufferView>,
    /// Its buffers.
    pub buffers: Vec<Buffer>,
}

/// Facts about the file.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Asset {
    /// Version of glTF.
    pub version: String,
}

/// A scene.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Scene {
    /// Its nodes without a parent.
    pub nodes: Vec<usize>,
}

/// A node of a scene.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Node {
    /// Its child nodes.
    pub children: Vec<usize>,
    /// Its mesh.
    pub mesh: Option<usize>,
    /// Its skin.
    pub skin: Option<usize>,
    /// Column by column.
    pub matrix: Option<[f64; 16]>,
    /// Translation, metres.
    pub translation: Option<[f64; 3]>,
    /// Quaternion: x, y, z, w.
    pub rotation: Option<[f64; 4]>,
    /// Scale along each axis.
    pub scale: Option<[f64; 3]>,
}

/// A mesh.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Mesh {
    /// Its parts.
    pub primitives: Vec<Primitive>,
}

/// A part of a mesh with one material. Its numbers are indices in the lists of the document.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Primitive {
    /// Accessors of its vertices.
    pub attributes: Attributes,
    /// Accessor of its vertex indices.
    pub indices: Option<usize>,
    /// Its material.
    pub material: Option<usize>,
    /// Kind of its elements; triangles if absent.
    pub mode: Option<u32>,
}

/// Indices of accessors.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Attributes {
    /// Positions.
    #[serde(rename = "POSITION")]
    pub position: Option<usize>,
    /// Normals.
    #[serde(rename = "NORMAL")]
    pub normal: Option<usize>,
    /// First set of texture coordinates.
    #[serde(rename = "TEXCOORD_0")]
    pub texcoord_0: Option<usize>,
    /// Second set of texture coordinates.
    #[serde(rename = "TEXCOORD_1")]
    pub texcoord_1: Option<usize>,
}

impl Attributes {
    /// Returns the texture coordinates of one of the first two sets, which all readers support.
    pub fn uvs(&self, set: usize) -> Option<usize> {
        match set {
            0 => self.texcoord_0,
            1 => self.texcoord_1,
            _ => None,
        }
    }
}

/// A material.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct Material {
    /// Its name.
    pub name: String,
    /// Its colour.
    pub pbr_metallic_roughness: Option<Pbr>,
    /// Use of its alpha.
    pub alpha_mode: Option<String>,
}

/// The colour of a material.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct Pbr {
    /// Linear, not sRGB.
    pub base_color_factor: Option<[f64; 4]>,
    /// Its picture.
    pub base_color_texture: Option<TextureInfo>,
}

/// Use of a texture.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct TextureInfo {
    /// Index of the texture.
    pub index: usize,
    /// Set of texture coordinates.
    pub tex_coord: usize,
}

/// A texture.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Texture {
    /// Index of its picture.
    pub source: Option<usize>,
}

/// A picture: in a file beside this one, or in a buffer.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct Image {
    /// Name of the file, or its bytes.
    pub uri: Option<String>,
    /// Index of its view.
    pub buffer_view: Option<usize>,
}

/// Numbers in a buffer.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct Accessor {
    /// Index of its view.
    pub buffer_view: Option<usize>,
    /// First byte.
    pub byte_offset: usize,
    /// Type of a number.
    pub component_type: u32,
    /// Whether integers are fractions of the largest one.
    pub normalized: bool,
    /// Number of elements.
    pub count: usize,
    /// Numbers of an element, by name.
    #[serde(rename = "type")]
    pub kind: String,
    /// Present if the accessor is sparse.
    pub sparse: Option<Sparse>,
}

/// Only its presence is read.
#[derive(Debug, Deserialize)]
pub struct Sparse {}

/// Part of a buffer.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct BufferView {
    /// Index of its buffer.
    pub buffer: usize,
    /// First byte.
    pub byte_offset: usize,
    /// Number of bytes.
    pub byte_length: usize,
    /// Bytes from one element to the next.
    pub byte_stride: Option<usize>,
}

/// A buffer: in a file beside this one, or in the binary part.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Buffer {
    /// Name of the file, or its bytes.
    pub uri: Option<String>,
}

/// Extensions that do not affect the parts that are read, or only their appearance.
const HARMLESS: &[&str] =
    &["KHR_materials_", "KHR_texture_transform", "KHR_lights_punctual", "KHR_mesh_quantization"];

/// Returns the document, and the binary part if there is one.
///
/// # Errors
/// Returns an error for a file that is cut, too large or of another version.
pub fn read(bytes: &[u8]) -> Result<(Document, Option<&[u8]>), String> {
    let (json, binary) = if bytes.starts_with(b"glTF") { parts(bytes)? } else { (bytes, None) };
    let json = json.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(json);
    let (most, size) = (MAX_JSON_BYTES, json.len());
    if size > most {
        return Err(format!("its JSON has {size} bytes; the limit is {most}"));
    }
    // Each object takes a hundred times its text.
    let objects = json.iter().filter(|byte| **byte == b'{').count();
    if objects > MAX_OBJECTS {
        return Err(format!("its JSON has {objects} objects; the limit is {}", MAX_OBJECTS));
    }
    let document: Document =
        serde_json::from_slice(json).map_err(|error| format!("its JSON is not valid: {error}"))?;
    if !document.asset.version.starts_with("2.") {
        let version = shown(&document.asset.version);
        return Err(format!("it is glTF {version}; only 2.0 is supported"));
    }
    let is_unknown = |extension: &&String| !HARMLESS.iter().any(|harmless| extension.starts_with(harmless));
    if let Some(extension) = document.extensions_required.iter().find(is_unknown) {
        return Err(format!("it requires the extension {}, which is not read", shown(extension)));
    }
    Ok((document, binary))
}

/// Splits a GLB into its chunks.
fn parts(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    const CUT: &str = "it is a GLB that ends too early";
    let word = |at: usize| -> Result<usize, String> {
        let word = bytes.get(at..at + 4).and_then(|word| word.try_into().ok()).ok_or(CUT)?;
        Ok(u32::from_le_bytes(word) as usize)
    };
    if word(4)? != 2 {
        return Err(format!("it is a GLB of version {}; only 2 is supported", word(4)?));
    }
    let chunk = |at: usize| -> Result<(usize, &[u8]), String> {
        let (length, kind) = (word(at)?, word(at + 4)?);
        Ok((kind, bytes.get(at + 8..).and_then(|rest| rest.get(..length)).ok_or(CUT)?))
    };
    let (kind, json) = chunk(12)?;
    if kind != u32::from_le_bytes(*b"JSON") as usize {
        return Err("it is a GLB that does not begin with its JSON".to_owned());
    }
    let at = 20 + json.len().next_multiple_of(4);
    let binary = if at < bytes.len() {
        let (kind, binary) = chunk(at)?;
        (kind == u32::from_le_bytes(*b"BIN\0") as usize).then_some(binary)
    } else {
        None
    };
    Ok((json, binary))
}

/// Returns the contents of a `data:` address; `None` if it is none, or is not in base 64.
pub fn data(uri: &str) -> Option<Vec<u8>> {
    let (head, text) = uri.strip_prefix("data:")?.split_once(',')?;
    if !head.ends_with(";base64") {
        return None;
    }
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut held) = (0_u32, 0);
    for digit in text.bytes().filter(|digit| !matches!(digit, b'=' | b'\n' | b'\r' | b' ')) {
        let value = match digit {
            b'A'..=b'Z' => digit - b'A',
            b'a'..=b'z' => digit - b'a' + 26,
            b'0'..=b'9' => digit - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return None,
        };
        bits = bits << 6 & 0xFF_FFFF | u32::from(value);
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held & 0xFF) as u8);
        }
    }
    Some(bytes)
}

//! JSON of a glTF, as far as it is read, and the binary part of a GLB (glTF 2.0, chapters 4 and 5).

use serde::Deserialize;

use crate::limits;
use crate::mesh::shown;

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Document {
    pub(super) asset: Asset,
    pub(super) extensions_required: Vec<String>,
    pub(super) scene: Option<usize>,
    pub(super) scenes: Vec<Scene>,
    pub(super) nodes: Vec<Node>,
    pub(super) meshes: Vec<Mesh>,
    pub(super) materials: Vec<Material>,
    pub(super) textures: Vec<Texture>,
    pub(super) images: Vec<Image>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) buffer_views: Vec<BufferView>,
    pub(super) buffers: Vec<Buffer>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Asset {
    pub(super) version: String,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Scene {
    pub(super) nodes: Vec<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Node {
    pub(super) children: Vec<usize>,
    pub(super) mesh: Option<usize>,
    pub(super) skin: Option<usize>,
    /// Column by column.
    pub(super) matrix: Option<[f64; 16]>,
    pub(super) translation: Option<[f64; 3]>,
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Mesh {
    pub(super) primitives: Vec<Primitive>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Primitive {
    pub(super) attributes: Attributes,
    pub(super) indices: Option<usize>,
    pub(super) material: Option<usize>,
    pub(super) mode: Option<u32>,
}

/// Indices of accessors.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Attributes {
    #[serde(rename = "POSITION")]
    pub(super) position: Option<usize>,
    #[serde(rename = "TEXCOORD_0")]
    texcoord_0: Option<usize>,
    #[serde(rename = "TEXCOORD_1")]
    texcoord_1: Option<usize>,
}

impl Attributes {
    /// Returns the texture coordinates of one of the first two sets, which all readers support.
    pub(super) fn uvs(&self, set: usize) -> Option<usize> {
        match set {
            0 => self.texcoord_0,
            1 => self.texcoord_1,
            _ => None,
        }
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Material {
    pub(super) pbr_metallic_roughness: Option<Pbr>,
    pub(super) alpha_mode: Option<String>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Pbr {
    /// Linear, not sRGB.
    pub(super) base_color_factor: Option<[f64; 4]>,
    pub(super) base_color_texture: Option<TextureInfo>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct TextureInfo {
    pub(super) index: usize,
    pub(super) tex_coord: usize,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Texture {
    pub(super) source: Option<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Image {
    pub(super) uri: Option<String>,
    pub(super) buffer_view: Option<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
    pub(super) normalized: bool,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) kind: String,
    /// Present if the accessor is sparse.
    pub(super) sparse: Option<Sparse>,
}

/// Only its presence is read.
#[derive(Debug, Deserialize)]
pub(super) struct Sparse {}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct BufferView {
    pub(super) buffer: usize,
    pub(super) byte_offset: usize,
    pub(super) byte_length: usize,
    pub(super) byte_stride: Option<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Buffer {
    pub(super) uri: Option<String>,
}

/// Extensions that do not affect the parts that are read, or only their appearance.
const HARMLESS: &[&str] =
    &["KHR_materials_", "KHR_texture_transform", "KHR_lights_punctual", "KHR_mesh_quantization"];

/// Returns the document, and the binary part if there is one.
pub(super) fn read(bytes: &[u8]) -> Result<(Document, Option<&[u8]>), String> {
    let (json, binary) = if bytes.starts_with(b"glTF") { parts(bytes)? } else { (bytes, None) };
    let json = json.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(json);
    let (most, size) = (limits::GLTF_JSON_BYTES, json.len());
    if size > most {
        return Err(format!("its JSON has {size} bytes; the limit is {most}"));
    }
    // Each object takes a hundred times its text.
    let objects = json.iter().filter(|byte| **byte == b'{').count();
    if objects > limits::GLTF_OBJECTS {
        return Err(format!("its JSON has {objects} objects; the limit is {}", limits::GLTF_OBJECTS));
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
pub(super) fn data(uri: &str) -> Option<Vec<u8>> {
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

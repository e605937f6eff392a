//! Reads binary glTF 2.0 from the daemon (`GetMesh`): triangles in the mesh's own frame, without moving
//! nodes. Its contents are not trusted: each index is checked.

use std::collections::HashMap;

use serde_json::Value;

use crate::images;
use crate::scene::{Image, Mesh, Part, Vertex};

const MAGIC: &[u8] = b"glTF";
const JSON: &[u8] = b"JSON";
const BIN: &[u8] = b"BIN\0";
const FLOAT: u64 = 5126;
const BYTE: u64 = 5121;
const SHORT: u64 = 5123;
const INT: u64 = 5125;
const TRIANGLES: u64 = 4;

/// Reads a file. The error is a fragment of a sentence.
pub(crate) fn read(file: &[u8]) -> Result<Mesh, String> {
    let (json, binary) = chunks(file).ok_or("it is not binary glTF 2.0")?;
    let json = serde_json::from_slice(json).map_err(|error| format!("its JSON cannot be read: {error}"))?;
    let document = Document { json, binary };
    let mut reading = Reading {
        document: &document,
        mesh: Mesh::default(),
        vertices: HashMap::new(),
        images: HashMap::new(),
    };
    for mesh in document.list("meshes") {
        for primitive in
            mesh.get("primitives").and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default()
        {
            reading.primitive(primitive)?;
        }
    }
    Ok(reading.mesh)
}

/// Returns the two chunks after the header.
fn chunks(file: &[u8]) -> Option<(&[u8], &[u8])> {
    let word = |at: usize| Some(u32::from_le_bytes(file.get(at..at + 4)?.try_into().ok()?));
    if file.get(..4)? != MAGIC || word(4)? != 2 {
        return None;
    }
    let length = word(12)? as usize;
    let json = file.get(20..20_usize.checked_add(length)?)?;
    if file.get(16..20)? != JSON {
        return None;
    }
    let next = 20 + length;
    // An empty file has no second chunk.
    let Some(length) = word(next) else { return Some((json, &[])) };
    let begin = next + 8;
    let binary = file.get(begin..begin.checked_add(length as usize)?)?;
    (file.get(next + 4..begin)? == BIN).then_some((json, binary))
}

struct Document<'a> {
    json: Value,
    binary: &'a [u8],
}

/// Numbers of an accessor.
struct Numbers<'a> {
    bytes: &'a [u8],
    /// Bytes from the beginning of one element to the next.
    stride: usize,
    count: usize,
    component: u64,
}

impl<'a> Document<'a> {
    fn list(&self, name: &str) -> &[Value] {
        self.json.get(name).and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default()
    }

    fn entry(&self, list: &str, index: &Value) -> Option<&Value> {
        self.list(list).get(usize::try_from(index.as_u64()?).ok()?)
    }

    fn view(&self, index: &Value) -> Option<(&'a [u8], Option<usize>)> {
        let view = self.entry("bufferViews", index)?;
        let number = |name: &str| {
            view.get(name).and_then(Value::as_u64).and_then(|number| usize::try_from(number).ok())
        };
        let begin = number("byteOffset").unwrap_or(0);
        let bytes = self.binary.get(begin..begin.checked_add(number("byteLength")?)?)?;
        Some((bytes, number("byteStride")))
    }

    /// Returns an accessor with `components` components each, after checking that all are present.
    fn numbers(&self, index: &Value, components: usize) -> Option<Numbers<'a>> {
        let accessor = self.entry("accessors", index)?;
        let number = |name: &str| accessor.get(name).and_then(Value::as_u64);
        let kind = match components {
            1 => "SCALAR",
            2 => "VEC2",
            _ => "VEC3",
        };
        if accessor.get("type").and_then(Value::as_str) != Some(kind) {
            return None;
        }
        let component = number("componentType")?;
        let bytes_each = match component {
            BYTE => 1,
            SHORT => 2,
            INT | FLOAT => 4,
            _ => return None,
        };
        let (bytes, stride) = self.view(accessor.get("bufferView")?)?;
        let stride = stride.unwrap_or(bytes_each * components).max(bytes_each * components);
        let begin = usize::try_from(number("byteOffset").unwrap_or(0)).ok()?;
        let bytes = bytes.get(begin..)?;
        let count = usize::try_from(number("count")?).ok()?;
        let needed = count
            .checked_sub(1)
            .map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(bytes_each * components))?;
        (needed <= bytes.len()).then_some(Numbers { bytes, stride, count, component })
    }
}

impl Numbers<'_> {
    /// Returns element `index`, of floats.
    fn floats<const N: usize>(&self, index: usize) -> [f32; N] {
        let mut floats = [0.0; N];
        if self.component == FLOAT {
            for (part, float) in floats.iter_mut().enumerate() {
                let at = index * self.stride + 4 * part;
                let bytes = self.bytes.get(at..at + 4).and_then(|bytes| bytes.try_into().ok());
                *float = bytes.map_or(0.0, f32::from_le_bytes);
            }
        }
        floats
    }

    /// Returns element `index`, of integers.
    fn whole(&self, index: usize) -> Option<u32> {
        let at = index * self.stride;
        match self.component {
            BYTE => self.bytes.get(at).map(|byte| u32::from(*byte)),
            SHORT => Some(u32::from(u16::from_le_bytes(self.bytes.get(at..at + 2)?.try_into().ok()?))),
            INT => Some(u32::from_le_bytes(self.bytes.get(at..at + 4)?.try_into().ok()?)),
            _ => None,
        }
    }
}

/// A mesh while it is read.
struct Reading<'a> {
    document: &'a Document<'a>,
    mesh: Mesh,
    /// First index and number of vertices that were read, by their three accessors: primitives share them.
    vertices: HashMap<[Option<u64>; 3], (u32, usize)>,
    /// Images that were read, by their index; `None` if that failed.
    images: HashMap<u64, Option<usize>>,
}

impl Reading<'_> {
    fn primitive(&mut self, primitive: &Value) -> Result<(), String> {
        if primitive.get("mode").and_then(Value::as_u64).is_some_and(|mode| mode != TRIANGLES) {
            return Ok(());
        }
        let broken = || "its triangles are not at the declared place".to_owned();
        let attributes = primitive.get("attributes").ok_or_else(broken)?;
        let (begin, count) = self.corners(attributes).ok_or_else(broken)?;
        let first = u32::try_from(self.mesh.indices.len()).map_err(|_| broken())?;
        match primitive.get("indices") {
            Some(accessor) => {
                let indices = self.document.numbers(accessor, 1).ok_or_else(broken)?;
                for at in 0..indices.count / 3 * 3 {
                    let index =
                        indices.whole(at).filter(|index| (*index as usize) < count).ok_or_else(broken)?;
                    self.mesh.indices.push(begin + index);
                }
            }
            None => self.mesh.indices.extend((begin..).take(count / 3 * 3)),
        }
        let end = u32::try_from(self.mesh.indices.len()).map_err(|_| broken())?;
        let material = primitive.get("material").and_then(|index| self.document.entry("materials", index));
        let (color, image) = material.map_or((None, None), |material| self.material(material));
        self.mesh.parts.push(Part { first, count: end - first, color, image });
        Ok(())
    }

    /// Returns the first index and the number of a primitive's vertices.
    fn corners(&mut self, attributes: &Value) -> Option<(u32, usize)> {
        let accessor = |name: &str| attributes.get(name).filter(|index| index.is_u64());
        let [position, normal, uv] = ["POSITION", "NORMAL", "TEXCOORD_0"].map(accessor);
        let key = [position, normal, uv].map(|index| index.and_then(Value::as_u64));
        if let Some(known) = self.vertices.get(&key) {
            return Some(*known);
        }
        let positions = self.document.numbers(position?, 3)?;
        let normals = normal.and_then(|index| self.document.numbers(index, 3));
        let uvs = uv.and_then(|index| self.document.numbers(index, 2));
        let begin = u32::try_from(self.mesh.vertices.len()).ok()?;
        u32::try_from(self.mesh.vertices.len().checked_add(positions.count)?).ok()?;
        self.mesh.vertices.extend((0..positions.count).map(|index| Vertex {
            position: positions.floats(index),
            normal: normals.as_ref().map_or([0.0, 0.0, 1.0], |normals| normals.floats(index)),
            uv: uvs.as_ref().map_or([0.0; 2], |uvs| uvs.floats(index)),
        }));
        self.vertices.insert(key, (begin, positions.count));
        Some((begin, positions.count))
    }

    /// Returns colour and image. A material without a name has no colour.
    fn material(&mut self, material: &Value) -> (Option<[f32; 4]>, Option<usize>) {
        let surface = material.get("pbrMetallicRoughness");
        let factor = surface.and_then(|surface| surface.get("baseColorFactor")).and_then(Value::as_array);
        let part =
            |index: usize| factor.and_then(|factor| factor.get(index)).and_then(Value::as_f64).unwrap_or(1.0);
        let color = [screen(part(0)), screen(part(1)), screen(part(2)), part(3).clamp(0.0, 1.0) as f32];
        let is_named = material.get("name").and_then(Value::as_str).is_some_and(|name| !name.is_empty());
        let texture = surface
            .and_then(|surface| surface.get("baseColorTexture"))
            .and_then(|texture| texture.get("index"));
        let texture = texture.and_then(|index| self.document.entry("textures", index));
        let image = texture.and_then(|texture| texture.get("source")).and_then(|index| self.image(index));
        (is_named.then_some(color), image)
    }

    /// Returns an image's index in the mesh. An unreadable image is left out, so that only the colour is
    /// drawn.
    fn image(&mut self, index: &Value) -> Option<usize> {
        let number = index.as_u64()?;
        if let Some(known) = self.images.get(&number) {
            return *known;
        }
        let read = self.decoded(index).map(|image| {
            self.mesh.images.push(image);
            self.mesh.images.len() - 1
        });
        self.images.insert(number, read);
        read
    }

    fn decoded(&self, index: &Value) -> Option<Image> {
        let image = self.document.entry("images", index)?;
        let (bytes, _) = self.document.view(image.get("bufferView")?)?;
        match images::read(bytes) {
            Ok(image) => Some(image),
            Err(reason) => {
                tracing::warn!("a texture is not drawn: {reason}");
                None
            }
        }
    }
}

/// Converts a linear colour component, as in glTF, to sRGB (IEC 61966-2-1).
fn screen(part: f64) -> f32 {
    let part = part.clamp(0.0, 1.0);
    let part = if part <= 0.003_130_8 { 12.92 * part } else { 1.055 * part.powf(1.0 / 2.4) - 0.055 };
    part as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a file of two triangles over four vertices: the first is red, the other one has no colour.
    fn file() -> Vec<u8> {
        let mut binary = Vec::new();
        for corner in [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]] {
            binary.extend(corner.iter().flat_map(|value| value.to_le_bytes()));
        }
        binary.extend([0.0_f32, 0.0, 1.0].repeat(4).iter().flat_map(|value| value.to_le_bytes()));
        binary.extend([0_u32, 1, 2, 0, 2, 3].iter().flat_map(|value| value.to_le_bytes()));
        let json = serde_json::json!({
            "asset": { "version": "2.0" },
            "meshes": [{ "primitives": [
                { "attributes": { "POSITION": 0, "NORMAL": 1 }, "indices": 2, "material": 0 },
                { "attributes": { "POSITION": 0, "NORMAL": 1 }, "indices": 3, "material": 1 },
            ] }],
            "materials": [
                { "name": "of the file", "pbrMetallicRoughness": { "baseColorFactor": [1.0, 0.214_041, 0.0, 0.5] } },
                { "name": "", "pbrMetallicRoughness": { "baseColorFactor": [1.0, 1.0, 1.0, 1.0] } },
            ],
            "accessors": [
                { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
                { "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3" },
                { "bufferView": 2, "componentType": 5125, "count": 3, "type": "SCALAR" },
                { "bufferView": 2, "componentType": 5125, "count": 3, "type": "SCALAR", "byteOffset": 12 },
            ],
            "bufferViews": [
                { "buffer": 0, "byteOffset": 0, "byteLength": 48 },
                { "buffer": 0, "byteOffset": 48, "byteLength": 48 },
                { "buffer": 0, "byteOffset": 96, "byteLength": 24 },
            ],
        });
        whole(&json, &binary)
    }

    fn whole(json: &Value, binary: &[u8]) -> Vec<u8> {
        let mut json = json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let word = |value: usize| u32::try_from(value).unwrap().to_le_bytes();
        let total = word(28 + json.len() + binary.len());
        [MAGIC, &word(2), &total, &word(json.len()), JSON, &json, &word(binary.len()), BIN, binary].concat()
    }

    #[test]
    fn corners_are_shared_and_only_a_named_material_has_a_colour() {
        let mesh = read(&file()).unwrap();
        assert_eq!(mesh.vertices.len(), 4);
        assert_eq!(mesh.vertices[2].position, [1.0, 1.0, 0.0]);
        assert_eq!(mesh.vertices[2].normal, [0.0, 0.0, 1.0]);
        assert_eq!(mesh.indices, [0, 1, 2, 0, 2, 3]);
        let [red, plain] = mesh.parts.as_slice() else { panic!("{:?}", mesh.parts) };
        assert_eq!((red.first, red.count, plain.first, plain.count), (0, 3, 3, 3));
        let [r, g, b, a] = red.color.unwrap();
        assert!((r - 1.0).abs() < 1e-6 && (g - 0.5).abs() < 1e-3 && b == 0.0 && a == 0.5, "{g}");
        assert_eq!(plain.color, None);
    }

    #[test]
    fn a_file_that_is_cut_or_changed_anywhere_is_refused_or_read_and_never_ends_the_program() {
        let whole = file();
        for length in 0..whole.len() {
            // A truncated file may still be readable, but must have no index above its vertices.
            if let Ok(mesh) = read(&whole[..length]) {
                assert!(mesh.indices.iter().all(|index| (*index as usize) < mesh.vertices.len()));
            }
        }
        for at in 0..whole.len() {
            for change in [0x01, 0x80, 0xff] {
                let mut changed = whole.clone();
                changed[at] ^= change;
                if let Ok(mesh) = read(&changed) {
                    assert!(mesh.indices.iter().all(|index| (*index as usize) < mesh.vertices.len()));
                }
            }
        }
        assert_eq!(read(b"solid").unwrap_err(), "it is not binary glTF 2.0");
    }
}

//! Reads binary glTF 2.0 from the daemon (`GetMesh`): triangles in the mesh's own frame, without moving
//! nodes. Its contents are not trusted: each index is checked.

use std::collections::HashMap;

use simd_gltf::{Attributes, Buffers, Document, Primitive, TRIANGLES, srgb};

use crate::images;
use crate::scene::{Image, Mesh, Part, Vertex};

/// Reads a file. The error is a fragment of a sentence.
pub(crate) fn read(file: &[u8]) -> Result<Mesh, String> {
    if !file.starts_with(b"glTF") {
        return Err("it is not binary glTF 2.0".to_owned());
    }
    let (document, binary) = simd_gltf::read(file)?;
    // The daemon writes no files beside it.
    let buffers = Buffers::new(&document, binary, |_name| None)?;
    let mut reading = Reading {
        document: &document,
        buffers: &buffers,
        mesh: Mesh::default(),
        vertices: HashMap::new(),
        images: HashMap::new(),
    };
    for primitive in document.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        reading.primitive(primitive)?;
    }
    Ok(reading.mesh)
}

/// A mesh while it is read.
struct Reading<'d> {
    document: &'d Document,
    buffers: &'d Buffers<'d>,
    mesh: Mesh,
    /// First index and number of vertices that were read, by their three accessors: primitives share them.
    vertices: HashMap<[Option<usize>; 3], (u32, usize)>,
    /// Images that were read, by their index; `None` if that failed.
    images: HashMap<usize, Option<usize>>,
}

impl Reading<'_> {
    fn primitive(&mut self, primitive: &Primitive) -> Result<(), String> {
        if primitive.mode.is_some_and(|mode| mode != TRIANGLES) {
            return Ok(());
        }
        let (begin, count) = self.corners(&primitive.attributes)?;
        let many = || "it has too many corners".to_owned();
        let first = u32::try_from(self.mesh.indices.len()).map_err(|_| many())?;
        match primitive.indices {
            Some(accessor) => {
                let indices = self.buffers.indices(accessor)?;
                for index in indices.get(..indices.len() / 3 * 3).unwrap_or_default() {
                    if *index as usize >= count {
                        return Err(format!(
                            "a triangle names a corner that does not exist; the mesh has {count}"
                        ));
                    }
                    self.mesh.indices.push(begin + index);
                }
            }
            None => self.mesh.indices.extend((begin..).take(count / 3 * 3)),
        }
        let end = u32::try_from(self.mesh.indices.len()).map_err(|_| many())?;
        let (color, image) = primitive.material.map_or((None, None), |material| self.material(material));
        self.mesh.parts.push(Part { first, count: end - first, color, image });
        Ok(())
    }

    /// Returns the first index and the number of a primitive's vertices.
    fn corners(&mut self, attributes: &Attributes) -> Result<(u32, usize), String> {
        let Attributes { position, normal, texcoord_0: uv, .. } = *attributes;
        let key = [position, normal, uv];
        if let Some(known) = self.vertices.get(&key) {
            return Ok(*known);
        }
        let positions = self.buffers.vectors(position.ok_or("it has triangles without positions")?)?;
        let normals = normal.and_then(|index| self.buffers.vectors(index).ok());
        let uvs = uv.and_then(|index| self.buffers.pairs(index).ok());
        let begin = self.mesh.vertices.len();
        let end = begin.checked_add(positions.len()).and_then(|end| u32::try_from(end).ok());
        end.ok_or("it has too many corners")?;
        let count = positions.len();
        self.mesh.vertices.extend(positions.into_iter().enumerate().map(|(index, position)| Vertex {
            position,
            normal: normals.as_ref().map_or([0.0, 0.0, 1.0], |of| of.get(index).copied().unwrap_or_default()),
            uv: uvs.as_ref().and_then(|of| of.get(index).copied()).unwrap_or_default(),
        }));
        // No truncation: it is at most the end.
        let known = (begin as u32, count);
        self.vertices.insert(key, known);
        Ok(known)
    }

    /// Returns colour and image. A material without a name has no colour.
    fn material(&mut self, index: usize) -> (Option<[f32; 4]>, Option<usize>) {
        let document = self.document;
        let Some(material) = document.materials.get(index) else { return (None, None) };
        let surface = material.pbr_metallic_roughness.as_ref();
        let [r, g, b, a] = surface.and_then(|surface| surface.base_color_factor).unwrap_or([1.0; 4]);
        let color = [srgb(r), srgb(g), srgb(b), a.clamp(0.0, 1.0)].map(|part| part as f32);
        let texture = surface.and_then(|surface| surface.base_color_texture.as_ref());
        let texture = texture.and_then(|texture| document.textures.get(texture.index));
        let image = texture.and_then(|texture| texture.source).and_then(|index| self.image(index));
        ((!material.name.is_empty()).then_some(color), image)
    }

    /// Returns an image's index in the mesh. An unreadable image is left out, so that only the colour is
    /// drawn.
    fn image(&mut self, index: usize) -> Option<usize> {
        if let Some(known) = self.images.get(&index) {
            return *known;
        }
        let read = self.decoded(index).map(|image| {
            self.mesh.images.push(image);
            self.mesh.images.len() - 1
        });
        self.images.insert(index, read);
        read
    }

    fn decoded(&self, index: usize) -> Option<Image> {
        let view = self.document.images.get(index)?.buffer_view?;
        match images::read(self.buffers.view(view).ok()?) {
            Ok(image) => Some(image),
            Err(reason) => {
                tracing::warn!("a texture is not drawn: {reason}");
                None
            }
        }
    }
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
            "buffers": [{ "byteLength": 120 }],
            "bufferViews": [
                { "buffer": 0, "byteOffset": 0, "byteLength": 48 },
                { "buffer": 0, "byteOffset": 48, "byteLength": 48 },
                { "buffer": 0, "byteOffset": 96, "byteLength": 24 },
            ],
        });
        whole(&json, &binary)
    }

    fn whole(json: &serde_json::Value, binary: &[u8]) -> Vec<u8> {
        let mut json = json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let word = |value: usize| u32::try_from(value).unwrap().to_le_bytes();
        let total = word(28 + json.len() + binary.len());
        [
            b"glTF".as_slice(),
            &word(2),
            &total,
            &word(json.len()),
            b"JSON",
            &json,
            &word(binary.len()),
            b"BIN\0",
            binary,
        ]
        .concat()
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

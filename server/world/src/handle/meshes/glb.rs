//! Writes a mesh as binary glTF 2.0 (the Khronos specification, chapters 3.6 and 4), for viewers.
//!
//! Coordinates are the mesh's: metres, in the axes of its file, as the physics uses them. Most formats that
//! simd reads have no reliable normals, so they are computed here: edges that are bent by more than
//! [`CREASE`] stay sharp. Each material is a separate part, and the file contains its pictures, unchanged.

use std::sync::Arc;

use glamx::DVec3;
use simd_model::robot::{Image, MeshAsset, Paint};

mod materials;
use materials::{Group, Materials};

/// Cosine of the bend between two triangles up to which their edge is smoothed: 35 degrees.
const CREASE: f64 = 0.82;
/// Maximum number of triangles at a corner for pairwise smoothing. With more, as at the tip of a fine cone,
/// each triangle is flat.
const PAIRED: usize = 64;

const MAGIC: u32 = u32::from_le_bytes(*b"glTF");
const VERSION: u32 = 2;
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BIN: u32 = u32::from_le_bytes(*b"BIN\0");
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Corners with their normals, and triangles between them.
#[derive(Default)]
struct Surface {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    /// Texture coordinates; empty without a texture.
    uvs: Vec<[f32; 2]>,
    indices: Vec<u32>,
}

/// Returns the file's bytes.
pub(super) fn write(mesh: &MeshAsset) -> Vec<u8> {
    let surface = surface(mesh);
    let (least, most) = bounds(&surface.positions);
    let (groups, ordered) = by_look(mesh, &surface.indices);
    let surface = Surface { indices: ordered, ..surface };
    let vectors = size_of_val(surface.positions.as_slice());
    let indices = size_of_val(surface.indices.as_slice());
    let uvs = size_of_val(surface.uvs.as_slice());
    let view = |offset: usize, length: usize| serde_json::json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    let target = |mut view: serde_json::Value, target: u32| {
        view["target"] = serde_json::json!(target);
        view
    };
    let mut views = vec![
        target(view(0, vectors), ARRAY_BUFFER),
        target(view(vectors, vectors), ARRAY_BUFFER),
        target(view(2 * vectors, indices), ELEMENT_ARRAY_BUFFER),
    ];
    let mut bytes = 2 * vectors + indices;
    if uvs > 0 {
        views.push(target(view(bytes, uvs), ARRAY_BUFFER));
        bytes += uvs;
    }
    let mut materials = Materials::default();
    let accessor = |view: usize, component: u32, count: usize, kind: &str| serde_json::json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
    let mut positions = accessor(0, FLOAT, surface.positions.len(), "VEC3");
    positions["min"] = serde_json::json!(least);
    positions["max"] = serde_json::json!(most);
    let mut accessors = vec![positions, accessor(1, FLOAT, surface.normals.len(), "VEC3")];
    let mut attributes = serde_json::json!({ "POSITION": 0, "NORMAL": 1 });
    if uvs > 0 {
        // Their accessor follows those of all groups.
        attributes["TEXCOORD_0"] = serde_json::json!(2 + groups.len());
    }
    let (mut primitives, mut first) = (Vec::new(), 0);
    for Group { paint, count } in groups {
        primitives.push(serde_json::json!({
            "attributes": attributes,
            "indices": accessors.len(),
            "material": materials.add(paint),
        }));
        let mut indices = accessor(2, UNSIGNED_INT, count, "SCALAR");
        indices["byteOffset"] = serde_json::json!(size_of::<u32>() * first);
        accessors.push(indices);
        first += count;
    }
    if uvs > 0 {
        accessors.push(accessor(3, FLOAT, surface.uvs.len(), "VEC2"));
    }
    let first_image = views.len();
    for image in &materials.images {
        views.push(view(bytes, image.bytes.len()));
        bytes += image.bytes.len().next_multiple_of(4);
    }
    let mut json = serde_json::json!({
        "asset": { "version": "2.0", "generator": "simd" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": primitives }],
        "materials": materials.written,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "byteLength": bytes }],
    });
    materials.write_images(&mut json, first_image);
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    assemble(&json, &surface, &materials.images, bytes)
}

/// Maximum number of different looks of a mesh; further ones are dropped.
const MAX_MATERIALS: usize = 64;

/// Returns the looks in the order of their first use, and the triangles' indices in the order of looks.
fn by_look<'m>(mesh: &'m MeshAsset, indices: &[u32]) -> (Vec<Group<'m>>, Vec<u32>) {
    let mut parts: Vec<(Vec<u32>, Option<&Paint>)> = Vec::new();
    let mut add = |from: usize, to: usize, mut paint: Option<&'m Paint>| {
        let Some(own) = indices.get(3 * from..3 * to).filter(|own| !own.is_empty()) else { return };
        paint = paint.filter(|paint| materials::has_look(paint));
        let is_alike = |known: &Option<&Paint>| materials::is_alike(*known, paint);
        if parts.len() >= MAX_MATERIALS && !parts.iter().any(|(_, known)| is_alike(known)) {
            paint = None;
        }
        let is_alike = |known: &Option<&Paint>| materials::is_alike(*known, paint);
        match parts.iter_mut().find(|(_, known)| is_alike(known)) {
            Some((all, _)) => all.extend_from_slice(own),
            None => parts.push((own.to_vec(), paint)),
        }
    };
    let mut from = (0, None);
    for paint in &mesh.paints {
        add(from.0, paint.first, from.1);
        from = (paint.first, Some(paint));
    }
    add(from.0, mesh.triangles.len(), from.1);
    let groups = parts.iter().map(|(own, paint)| Group { paint: *paint, count: own.len() }).collect();
    (groups, parts.into_iter().flat_map(|(own, _)| own).collect())
}

/// Returns the header and the chunks. All lengths are already multiples of four.
fn assemble(json: &[u8], surface: &Surface, images: &[Arc<Image>], bytes: usize) -> Vec<u8> {
    let length = |bytes: usize| u32::try_from(bytes).unwrap_or(u32::MAX);
    let total = 12 + 8 + json.len() + 8 + bytes;
    let mut file = Vec::with_capacity(total);
    let word = |file: &mut Vec<u8>, word: u32| file.extend_from_slice(&word.to_le_bytes());
    for value in [MAGIC, VERSION, length(total), length(json.len()), JSON] {
        word(&mut file, value);
    }
    file.extend_from_slice(json);
    word(&mut file, length(bytes));
    word(&mut file, BIN);
    for value in surface.positions.iter().chain(&surface.normals).flatten() {
        file.extend_from_slice(&value.to_le_bytes());
    }
    for index in &surface.indices {
        file.extend_from_slice(&index.to_le_bytes());
    }
    for value in surface.uvs.iter().flatten() {
        file.extend_from_slice(&value.to_le_bytes());
    }
    for image in images {
        file.extend_from_slice(&image.bytes);
        // The preceding bytes are a multiple of four.
        file.resize(file.len().next_multiple_of(4), 0);
    }
    file
}

/// Returns the smallest and largest values of each coordinate.
fn bounds(positions: &[[f32; 3]]) -> ([f32; 3], [f32; 3]) {
    let mut bounds = ([f32::MAX; 3], [f32::MIN; 3]);
    for position in positions {
        for (axis, value) in position.iter().enumerate() {
            bounds.0[axis] = bounds.0[axis].min(*value);
            bounds.1[axis] = bounds.1[axis].max(*value);
        }
    }
    if positions.is_empty() { ([0.0; 3], [0.0; 3]) } else { bounds }
}

/// Gives each corner a normal: the mean of the triangles at it that are not bent away from the corner's own,
/// weighted by area. A corner with several normals or texture coordinates becomes several.
fn surface(mesh: &MeshAsset) -> Surface {
    let corner = |index: u32| mesh.vertices.get(index as usize).copied().unwrap_or_default();
    // Vectors with twice the area as their length.
    let faces: Vec<DVec3> = mesh
        .triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(corner);
            (b - a).cross(c - a)
        })
        .collect();
    let about = About::new(mesh);
    let mut surface = Surface { indices: vec![0; 3 * mesh.triangles.len()], ..Surface::default() };
    let uvs = uvs(mesh);
    let mut known: Vec<(DVec3, [f32; 2], u32)> = Vec::new();
    for (number, vertex) in mesh.vertices.iter().enumerate() {
        let corners = about.corners(number);
        known.clear();
        for &at in corners {
            let own = faces.get(at as usize / 3).and_then(|area| area.try_normalize());
            let normal = match own {
                Some(own) if corners.len() > PAIRED => own,
                _ => smooth(own, corners, &faces),
            };
            let uv = uvs.get(at as usize).copied().unwrap_or_default();
            let is_alike =
                |(other, there, _): &&(DVec3, [f32; 2], u32)| *there == uv && other.dot(normal) > 0.9999;
            let alike = known.iter().find(is_alike).map(|(_, _, index)| *index);
            let index = alike.unwrap_or_else(|| {
                let index = u32::try_from(surface.positions.len()).unwrap_or(u32::MAX);
                surface.positions.push(single(*vertex));
                surface.normals.push(single(normal));
                if !uvs.is_empty() {
                    surface.uvs.push(uv);
                }
                if known.len() < PAIRED {
                    known.push((normal, uv, index));
                }
                index
            });
            if let Some(slot) = surface.indices.get_mut(at as usize) {
                *slot = index;
            }
        }
    }
    surface
}

/// Returns the texture coordinates of each corner of each triangle; empty without a texture.
fn uvs(mesh: &MeshAsset) -> Vec<[f32; 2]> {
    let mut uvs = Vec::new();
    for paint in &mesh.paints {
        let Some(texture) = &paint.texture else { continue };
        if uvs.is_empty() {
            uvs.resize(3 * mesh.triangles.len(), [0.0; 2]);
        }
        let own = uvs.get_mut(3 * paint.first..).unwrap_or_default();
        for (slot, uv) in own.iter_mut().zip(texture.uvs.iter().flatten()) {
            *slot = *uv;
        }
    }
    uvs
}

/// Returns the mean of the first triangles at a corner that are not bent away from `own`; of all if `own` has
/// no area.
fn smooth(own: Option<DVec3>, corners: &[u32], faces: &[DVec3]) -> DVec3 {
    let areas = corners.iter().take(PAIRED).filter_map(|at| faces.get(*at as usize / 3));
    let near = areas.filter(|area| own.is_none_or(|own| area.dot(own) > CREASE * area.length()));
    near.sum::<DVec3>().try_normalize().or(own).unwrap_or(DVec3::Z)
}

fn single(vector: DVec3) -> [f32; 3] {
    vector.to_array().map(|value| value as f32)
}

/// Corners of triangles at each vertex, in one array. Triangle `t` has the corners from `3t` to `3t + 2`.
struct About {
    /// End of each vertex's corners.
    ends: Vec<usize>,
    corners: Vec<u32>,
}

impl About {
    fn new(mesh: &MeshAsset) -> Self {
        let mut ends = vec![0; mesh.vertices.len()];
        for index in mesh.triangles.iter().flatten() {
            if let Some(count) = ends.get_mut(*index as usize) {
                *count += 1;
            }
        }
        let mut end = 0;
        for slot in &mut ends {
            end += *slot;
            // Begin of the vertex's corners, which moves to their end while they are inserted.
            *slot = end - *slot;
        }
        let mut corners = vec![0; end];
        for (at, index) in (0_u32..).zip(mesh.triangles.iter().flatten()) {
            if let Some(next) = ends.get_mut(*index as usize) {
                if let Some(slot) = corners.get_mut(*next) {
                    *slot = at;
                }
                *next += 1;
            }
        }
        Self { ends, corners }
    }

    fn corners(&self, vertex: usize) -> &[u32] {
        let begin = vertex.checked_sub(1).and_then(|before| self.ends.get(before)).copied().unwrap_or(0);
        let end = self.ends.get(vertex).copied().unwrap_or(begin);
        self.corners.get(begin..end).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests;

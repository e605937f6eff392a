//! glTF 2.0, as text and binary: triangles of a file's scene, in metres, in the file's own axes. The crate
//! `simd-gltf` reads the parts of the file; `material` has colours and textures.
//!
//! The axes are the link's, as with [COLLADA](super::collada): glTF's convention that y is up is not applied.

mod material;
#[cfg(test)]
mod tests;

use glamx::{DMat4, DQuat, DVec3};
use simd_gltf::{Buffers, Document, Node, Primitive, TRIANGLES};

use super::beside::{Named, Role, relative};
use super::builder::{Builder, FaceCorner, texture_coordinate};
use super::{Beside, Triangles};
use crate::limits;
use crate::robot::Paint;
use material::Materials;

/// Reads the scene of a file, its colours and its textures.
pub(super) fn parse(bytes: &[u8], beside: &Beside) -> Result<(Triangles, Vec<Paint>), String> {
    let (document, binary) = simd_gltf::read(bytes)?;
    let buffers = Buffers::new(&document, binary, |uri| beside.bytes(uri).map(|bytes| &**bytes))?;
    let mut reader = Reader {
        document: &document,
        buffers: &buffers,
        materials: Materials::new(&document, &buffers, beside),
        mesh: Builder::default().covered_by(beside.cover()),
        is_covered: beside.cover().is_some(),
        visits: 0,
    };
    reader.scene()?;
    let mut mesh = reader.mesh;
    let paints = mesh.take_paints();
    Ok((mesh.finish()?, paints))
}

/// Returns the files that it names.
pub(super) fn named(bytes: &[u8]) -> Vec<Named> {
    let Ok((document, _)) = simd_gltf::read(bytes) else { return Vec::new() };
    let buffers = document.buffers.iter().map(|buffer| (&buffer.uri, Role::Buffer));
    let files = buffers.chain(document.images.iter().map(|image| (&image.uri, Role::Image)));
    let named = files.filter_map(|(uri, role)| Some(Named { name: relative(uri.as_deref()?)?, role }));
    named.take(limits::FILES_BESIDE).collect()
}

struct Reader<'d> {
    document: &'d Document,
    buffers: &'d Buffers<'d>,
    materials: Materials<'d>,
    mesh: Builder,
    /// Whether the description puts a picture on triangles without one.
    is_covered: bool,
    /// Parts of meshes that were visited.
    visits: usize,
}

/// Modes of strips and fans, after the one of triangles; points and lines have no area.
const STRIP: u32 = 5;
const FAN: u32 = 6;

impl Reader<'_> {
    /// Reads the nodes of the file's scene, or of the first scene, or all meshes without transforms.
    fn scene(&mut self) -> Result<(), String> {
        let document = self.document;
        let Some(scene) = document.scenes.get(document.scene.unwrap_or(0)) else {
            for mesh in 0..document.meshes.len() {
                self.add(mesh, DMat4::IDENTITY)?;
            }
            return Ok(());
        };
        // A node has one parent: a repeated node contains itself, or is in two places.
        let mut met = vec![false; document.nodes.len()];
        let mut ahead: Vec<(usize, DMat4)> =
            scene.nodes.iter().rev().map(|node| (*node, DMat4::IDENTITY)).collect();
        while let Some((index, file_from_parent)) = ahead.pop() {
            let (Some(node), Some(was_met)) = (document.nodes.get(index), met.get_mut(index)) else {
                return Err(format!("it names node {index}, which does not exist"));
            };
            if std::mem::replace(was_met, true) {
                return Err(format!("node {index} is in two places, or contains itself"));
            }
            let file_from_node = file_from_parent * transform(node);
            if let Some(mesh) = node.mesh {
                // The pose of a skin's node does not count: its bones are in their bind pose.
                let at = if node.skin.is_some() { DMat4::IDENTITY } else { file_from_node };
                self.add(mesh, at)?;
            }
            ahead.extend(node.children.iter().rev().map(|child| (*child, file_from_node)));
        }
        Ok(())
    }

    fn add(&mut self, mesh: usize, file_from_mesh: DMat4) -> Result<(), String> {
        let Some(mesh) = self.document.meshes.get(mesh) else {
            return Err(format!("it names mesh {mesh}, which does not exist"));
        };
        for primitive in &mesh.primitives {
            self.visits += 1;
            if self.visits > limits::GLTF_VISITS {
                return Err(format!("its meshes are used more than {} times", limits::GLTF_VISITS));
            }
            self.primitive(primitive, file_from_mesh)?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, file_from_mesh: DMat4) -> Result<(), String> {
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        let Some(position) = primitive.attributes.position.filter(|_| (TRIANGLES..=FAN).contains(&mode))
        else {
            return Ok(());
        };
        let positions = self.buffers.vectors(position)?;
        let count = positions.len();
        let look = self.materials.look(primitive.material);
        // Only needed with a picture.
        let set = self.materials.texture_set(primitive.material).unwrap_or(0);
        let has_picture = look.image.is_some() || self.is_covered;
        let uvs = match primitive.attributes.uvs(set).filter(|_| has_picture) {
            Some(accessor) => uvs(self.buffers, accessor),
            None => Vec::new(),
        };
        let first = self.mesh.corners();
        for at in positions {
            self.mesh.corner(file_from_mesh.transform_point3(DVec3::from_array(at.map(f64::from))))?;
        }
        self.mesh.paint(look);
        let corner = |index: usize| {
            let uv = uvs.get(index).copied().unwrap_or_default();
            let index = u32::try_from(first + index).ok().filter(|_| index < count);
            index.map(|index| FaceCorner { index, uv })
        };
        let indices = primitive.indices.map(|indices| self.buffers.indices(indices)).transpose()?;
        let length = indices.as_ref().map_or(count, Vec::len);
        let at = |n: usize| match &indices {
            Some(indices) => corner(indices.get(n).copied()? as usize),
            None => corner(n),
        };
        let triangles = if mode == TRIANGLES { length / 3 } else { length.saturating_sub(2) };
        for n in 0..triangles {
            let corners = match mode {
                TRIANGLES => [3 * n, 3 * n + 1, 3 * n + 2],
                STRIP if n % 2 == 1 => [n + 1, n, n + 2],
                STRIP => [n, n + 1, n + 2],
                _ => [0, n + 1, n + 2],
            };
            let [Some(a), Some(b), Some(c)] = corners.map(at) else {
                return Err(format!("a triangle names a corner that does not exist; the mesh has {count}"));
            };
            self.mesh.face([a, b, c])?;
        }
        Ok(())
    }
}

/// Returns texture coordinates; none if they cannot be read, which does not refuse the mesh.
fn uvs(buffers: &Buffers, accessor: usize) -> Vec<[f32; 2]> {
    let uvs = buffers.pairs(accessor).unwrap_or_default();
    uvs.into_iter().map(|uv| uv.map(|value| texture_coordinate(f64::from(value)))).collect()
}

/// Returns `parent_from_node`.
fn transform(node: &Node) -> DMat4 {
    if let Some(matrix) = &node.matrix {
        return DMat4::from_cols_array(matrix);
    }
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |xyzw| {
        let rotation = DQuat::from_array(xyzw);
        if rotation.length() > 1e-9 { rotation.normalize() } else { DQuat::IDENTITY }
    });
    let [scale, translation] =
        [node.scale.unwrap_or([1.0; 3]), node.translation.unwrap_or([0.0; 3])].map(DVec3::from_array);
    DMat4::from_scale_rotation_translation(scale, rotation, translation)
}

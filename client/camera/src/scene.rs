//! What a picture is made of: surfaces, where they are, light, and a point of view. Plain types, which know neither a daemon nor
//! a GPU.

use std::sync::Arc;

use glamx::{DAffine3, DMat4, DVec3};

use crate::draw::Surface;

/// A corner of a triangle, as the GPU reads it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Vertex {
    /// Metres, in the mesh's frame.
    pub(crate) position: [f32; 3],
    /// Of unit length. Its sign does not matter: both sides of a surface are lit.
    pub(crate) normal: [f32; 3],
    /// Of the image; 0, 0 is its upper left corner.
    pub(crate) uv: [f32; 2],
}

/// A picture on a surface: 4 bytes a pixel (red, green, blue, alpha; sRGB), row by row from the upper left pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Image {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) rgba: Vec<u8>,
}

/// Triangles of one material.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Part {
    /// Where in the mesh's indices.
    pub(crate) first: u32,
    pub(crate) count: u32,
    /// Red, green, blue, alpha, 0 to 1, as screens have them (sRGB). `None`: as the item says.
    pub(crate) color: Option<[f32; 4]>,
    /// Of the mesh's images; it is multiplied by the colour.
    pub(crate) image: Option<usize>,
}

/// Triangles, as they come to the GPU.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Mesh {
    pub(crate) vertices: Vec<Vertex>,
    /// Three for each triangle, each below the number of vertices.
    pub(crate) indices: Vec<u32>,
    pub(crate) parts: Vec<Part>,
    pub(crate) images: Vec<Image>,
}

impl Mesh {
    /// All of it in one material, whose colour the item says.
    pub(crate) fn plain(vertices: Vec<Vertex>, indices: Vec<u32>) -> Self {
        let count = u32::try_from(indices.len()).unwrap_or(0);
        let parts = vec![Part { first: 0, count, color: None, image: None }];
        Self { vertices, indices, parts, images: Vec::new() }
    }
}

/// A surface at its place.
#[derive(Clone, Debug)]
pub(crate) struct Item {
    pub(crate) surface: Arc<Surface>,
    /// Where the mesh's frame is in the world, with the scale of the mesh.
    pub(crate) world_from_mesh: DAffine3,
    /// Of parts that have no colour of their own.
    pub(crate) color: [f32; 4],
    /// What the segmentation shows there; 0 is nothing.
    pub(crate) id: u32,
}

/// A directional light, and what surfaces make of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Light {
    /// Towards the light, world axes; not zero.
    pub(crate) direction: DVec3,
    pub(crate) color: [f32; 3],
    pub(crate) ambient: f32,
    pub(crate) diffuse: f32,
    pub(crate) specular: f32,
    /// What is in the shadow of another has the ambient light alone.
    pub(crate) shadow: bool,
}

/// What a picture is to have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Planes {
    pub(crate) color: bool,
    pub(crate) depth: bool,
    pub(crate) segmentation: bool,
}

/// A picture that is to be drawn.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// camera_from_world, with axes as OpenGL has them: x to the right, y up, the camera looks along -z.
    pub(crate) view: DMat4,
    /// clip_from_camera as OpenGL has it: what is seen has x, y and z within -w and w.
    pub(crate) projection: DMat4,
    pub(crate) planes: Planes,
    pub(crate) light: Light,
    /// Where nothing is seen.
    pub(crate) background: [f32; 3],
    pub(crate) items: Vec<Item>,
}

/// A picture that was drawn: planes row by row from the upper left pixel, little-endian. Absent where not asked for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Picture {
    /// Red, green and blue, a byte each (sRGB).
    pub(crate) color: Option<Vec<u8>>,
    /// float32: metres along the optical axis; infinite where nothing is seen.
    pub(crate) depth: Option<Vec<u8>>,
    /// uint32: the `id` of what is seen; 0 where nothing is.
    pub(crate) segmentation: Option<Vec<u8>>,
}

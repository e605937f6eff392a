//! Contents of a picture: surfaces, their positions, light, and a point of view. Plain types, independent of
//! the daemon and the GPU.

use std::sync::Arc;

use glamx::{DAffine3, DMat4, DVec3};

use crate::draw::Surface;

/// A vertex of a triangle, as the GPU reads it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Vertex {
    /// Metres, in the mesh's frame.
    pub(crate) position: [f32; 3],
    /// Unit vector. Its sign does not matter: both sides of a surface are lit.
    pub(crate) normal: [f32; 3],
    /// Texture coordinates; 0, 0 is the image's upper left corner.
    pub(crate) uv: [f32; 2],
}

/// A picture on a surface: 4 bytes per pixel (red, green, blue, alpha; sRGB), row by row from the upper left
/// pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Image {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) rgba: Vec<u8>,
}

/// Triangles of one material.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Part {
    /// Its range in the mesh's indices.
    pub(crate) first: u32,
    pub(crate) count: u32,
    /// Red, green, blue, alpha, 0 to 1 (sRGB). `None`: the item's colour.
    pub(crate) color: Option<[f32; 4]>,
    /// Index of the mesh's image, which is multiplied by the colour.
    pub(crate) image: Option<usize>,
}

/// Triangles for the GPU.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Mesh {
    pub(crate) vertices: Vec<Vertex>,
    /// Three for each triangle, each below the number of vertices.
    pub(crate) indices: Vec<u32>,
    pub(crate) parts: Vec<Part>,
    pub(crate) images: Vec<Image>,
}

impl Mesh {
    /// Makes a mesh with one material, which takes the item's colour.
    pub(crate) fn plain(vertices: Vec<Vertex>, indices: Vec<u32>) -> Self {
        let count = u32::try_from(indices.len()).unwrap_or(0);
        let parts = vec![Part { first: 0, count, color: None, image: None }];
        Self { vertices, indices, parts, images: Vec::new() }
    }
}

/// A surface at its pose.
#[derive(Clone, Debug)]
pub(crate) struct Item {
    pub(crate) surface: Arc<Surface>,
    /// Pose of the mesh's frame in the world, with the scale of the mesh.
    pub(crate) world_from_mesh: DAffine3,
    /// Colour of parts that have no colour.
    pub(crate) color: [f32; 4],
    /// Number in the segmentation; 0 means no surface.
    pub(crate) id: u32,
}

/// A directional light and its effect on surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Light {
    /// Towards the light, world axes; not zero.
    pub(crate) direction: DVec3,
    pub(crate) color: [f32; 3],
    pub(crate) ambient: f32,
    pub(crate) diffuse: f32,
    pub(crate) specular: f32,
    /// Surfaces in the shadow of others get only ambient light.
    pub(crate) shadow: bool,
}

/// Planes of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Planes {
    pub(crate) color: bool,
    pub(crate) depth: bool,
    pub(crate) segmentation: bool,
}

/// A picture to draw.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// camera_from_world, with OpenGL's axes: x to the right, y up, the camera looks along -z.
    pub(crate) view: DMat4,
    /// clip_from_camera as in OpenGL: visible points have x, y and z between -w and w.
    pub(crate) projection: DMat4,
    pub(crate) planes: Planes,
    pub(crate) light: Light,
    /// Colour where no surface is seen.
    pub(crate) background: [f32; 3],
    pub(crate) items: Vec<Item>,
}

/// A drawn picture: planes row by row from the upper left pixel, little-endian. Absent if not requested.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Picture {
    /// Red, green and blue, a byte each (sRGB).
    pub(crate) color: Option<Vec<u8>>,
    /// float32: metres along the optical axis; infinite where no surface is seen.
    pub(crate) depth: Option<Vec<u8>>,
    /// uint32: the `id` of the visible item; 0 if none.
    pub(crate) segmentation: Option<Vec<u8>>,
}

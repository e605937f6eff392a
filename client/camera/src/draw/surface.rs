//! A mesh on the GPU, with its images.

use crate::gpu::Gpu;
use crate::scene::{Image, Mesh, Vertex};

use super::DrawError;
use super::pipelines::{CORNER_BYTES, Pipelines};

/// A mesh on the GPU. It is released with the last item that uses it.
#[derive(Debug)]
pub(crate) struct Surface {
    pub(super) vertices: wgpu::Buffer,
    pub(super) indices: wgpu::Buffer,
    pub(super) parts: Vec<SurfacePart>,
    /// Centre of the ball about all vertices, in the mesh's frame.
    pub(super) center: [f64; 3],
    pub(super) radius: f64,
    bytes: u64,
}

/// Triangles of one material.
#[derive(Debug)]
pub(super) struct SurfacePart {
    pub(super) first: u32,
    pub(super) count: u32,
    /// `None`: the item's colour.
    pub(super) color: Option<[f32; 4]>,
    /// `None`: plain white.
    pub(super) image: Option<wgpu::BindGroup>,
    /// Whether its image is transparent anywhere.
    pub(super) is_translucent: bool,
}

impl Surface {
    /// Uploads a mesh to the GPU.
    pub(super) fn new(gpu: &Gpu, pipelines: &Pipelines, mesh: &Mesh) -> Result<Self, DrawError> {
        let wanted = CORNER_BYTES * mesh.vertices.len() as u64;
        let most = gpu.limits.max_buffer_size;
        if wanted > most || 4 * mesh.indices.len() as u64 > most {
            return Err(DrawError::TooManyTriangles { triangles: mesh.indices.len() / 3, most });
        }
        let mut corners = Vec::with_capacity(usize::try_from(wanted).unwrap_or(0));
        for Vertex { position, normal, uv } in &mesh.vertices {
            for value in position.iter().chain(normal).chain(uv) {
                corners.extend_from_slice(&value.to_ne_bytes());
            }
        }
        let indices: Vec<u8> = mesh.indices.iter().flat_map(|index| index.to_ne_bytes()).collect();
        let images: Vec<(wgpu::BindGroup, bool)> =
            mesh.images.iter().map(|image| (texture(gpu, pipelines, image), has_holes(image))).collect();
        let image_bytes: u64 = mesh.images.iter().map(|image| image.rgba.len() as u64 * 4 / 3).sum();
        let last = u32::try_from(mesh.indices.len()).unwrap_or(0);
        let parts =
            mesh.parts.iter().filter(|part| part.count > 0 && part.first.saturating_add(part.count) <= last);
        let parts = parts.map(|part| {
            let image = part.image.and_then(|index| images.get(index));
            SurfacePart {
                first: part.first,
                count: part.count,
                color: part.color,
                image: image.map(|(group, _)| group.clone()),
                is_translucent: image.is_some_and(|(_, has_holes)| *has_holes),
            }
        });
        let (center, radius) = ball(&mesh.vertices);
        Ok(Self {
            parts: parts.collect(),
            vertices: buffer(gpu, "corners", wgpu::BufferUsages::VERTEX, &corners),
            indices: buffer(gpu, "triangles", wgpu::BufferUsages::INDEX, &indices),
            center,
            radius,
            bytes: (corners.len() + indices.len()) as u64 + image_bytes,
        })
    }

    /// Returns the bytes that it takes on the GPU.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// Returns a bind group of an image with the sampler.
pub(super) fn texture(gpu: &Gpu, pipelines: &Pipelines, image: &Image) -> wgpu::BindGroup {
    let most = gpu.limits.max_texture_dimension_2d;
    let mut level = Level { width: image.width, height: image.height, rgba: image.rgba.clone() };
    while level.width > most || level.height > most {
        level = level.half();
    }
    let levels = u32::BITS - level.width.max(level.height).leading_zeros();
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("image"),
        size: wgpu::Extent3d { width: level.width, height: level.height, depth_or_array_layers: 1 },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for mip_level in 0..levels {
        let to = wgpu::TexelCopyTextureInfo { mip_level, ..texture.as_image_copy() };
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * level.width),
            rows_per_image: Some(level.height),
        };
        let size = wgpu::Extent3d { width: level.width, height: level.height, depth_or_array_layers: 1 };
        gpu.queue.write_texture(to, &level.rgba, layout, size);
        level = level.half();
    }
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("image"),
        layout: &pipelines.image,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&pipelines.sampler) },
        ],
    })
}

/// A mipmap level of an image, so that far surfaces do not flicker.
struct Level {
    width: u32,
    height: u32,
    rgba: Vec<u8>,
}

impl Level {
    /// Averages two by two pixels. The last pixel of an odd row or column is left out, unless it is the only
    /// one.
    fn half(&self) -> Self {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let at = |x: u32, y: u32, part: usize| {
            let (x, y) = (x.min(self.width.saturating_sub(1)), y.min(self.height.saturating_sub(1)));
            let offset = 4 * (y as usize * self.width as usize + x as usize) + part;
            u32::from(self.rgba.get(offset).copied().unwrap_or(0))
        };
        let mut rgba = Vec::with_capacity(4 * width as usize * height as usize);
        for y in 0..height {
            for x in 0..width {
                for part in 0..4 {
                    let (left, top) = (2 * x, 2 * y);
                    let sum = at(left, top, part)
                        + at(left + 1, top, part)
                        + at(left, top + 1, part)
                        + at(left + 1, top + 1, part);
                    rgba.push(u8::try_from((sum + 2) / 4).unwrap_or(u8::MAX));
                }
            }
        }
        Self { width, height, rgba }
    }
}

/// Returns whether any pixel is transparent.
fn has_holes(image: &Image) -> bool {
    image.rgba.iter().skip(3).step_by(4).any(|alpha| *alpha < u8::MAX)
}

fn buffer(gpu: &Gpu, label: &str, usage: wgpu::BufferUsages, bytes: &[u8]) -> wgpu::Buffer {
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        // Empty buffers are refused.
        size: (bytes.len() as u64).max(4),
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    if !bytes.is_empty() {
        gpu.queue.write_buffer(&buffer, 0, bytes);
    }
    buffer
}

/// Returns a ball about the middle of the bounds.
fn ball(vertices: &[Vertex]) -> ([f64; 3], f64) {
    let (mut least, mut most) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for vertex in vertices {
        for ((low, high), value) in least.iter_mut().zip(&mut most).zip(vertex.position) {
            *low = low.min(f64::from(value));
            *high = high.max(f64::from(value));
        }
    }
    if vertices.is_empty() {
        return ([0.0; 3], 0.0);
    }
    let [x, y, z] = [0, 1, 2].map(|axis: usize| {
        let (low, high) = (least.get(axis).copied().unwrap_or(0.0), most.get(axis).copied().unwrap_or(0.0));
        ((low + high) / 2.0, (high - low) / 2.0)
    });
    ([x.0, y.0, z.0], (x.1 * x.1 + y.1 * y.1 + z.1 * z.1).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smaller_level_has_means_of_four_pixels() {
        let grey = |value: u8| [value, value, value, 255];
        let rgba = [grey(0), grey(10), grey(99), grey(20), grey(30), grey(99)].concat();
        let half = Level { width: 3, height: 2, rgba }.half();
        assert_eq!((half.width, half.height, half.rgba), (1, 1, grey(15).to_vec()));
        let row = [grey(0), grey(8)].concat();
        assert_eq!(Level { width: 2, height: 1, rgba: row }.half().rgba, grey(4));
    }

    #[test]
    fn a_ball_holds_all_corners() {
        let at = |x: f32, y: f32| Vertex { position: [x, y, 0.0], ..Vertex::default() };
        assert_eq!(ball(&[at(1.0, 0.0), at(-3.0, 0.0)]), ([-1.0, 0.0, 0.0], 2.0));
        assert_eq!(ball(&[at(0.0, 0.0), at(6.0, 8.0)]), ([3.0, 4.0, 0.0], 5.0));
        assert_eq!(ball(&[]), ([0.0; 3], 0.0));
    }
}

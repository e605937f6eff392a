//! Draws scenes. A picture has up to two passes over the same triangles: one for colours, and one for
//! distances and segmentation. Each pixel of the second belongs to one surface. If colours are neither
//! smoothed nor blended, one pass draws all.
//!
//! * `surface`: meshes on the GPU.
//! * `rows`: positions of items for the GPU. They are `f64` up to the camera's frame, so that a picture far
//!   from the origin is exact.
//! * `pipelines`, `targets`: the pipelines of triangles, and their targets.
//! * `shadow`: the shadow map, drawn in an earlier pass.

mod pipelines;
mod rows;
mod shadow;
mod surface;
mod targets;
#[cfg(test)]
mod tests;

use std::time::Duration;

use glamx::{DMat4, DVec3, DVec4};

use crate::gpu::Gpu;
use crate::scene::{Image, Mesh, Picture, Planes, Scene};

use pipelines::{CAMERA_BYTES, ITEM_BYTES, Pipelines};
use rows::{Drawn, Rows};
use shadow::{LightView, Shadows};
pub(crate) use surface::Surface;
use targets::{KeptTargets, Readback, Targets};

/// Maximum number of pixels of a side.
pub(crate) const MAX_PIXELS: u32 = 4096;
/// Maximum wall time of a picture. A driver that takes longer hangs.
const LONGEST: Duration = Duration::from_secs(60);

/// Reason why a picture was not drawn, as a fragment of a sentence.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
pub(crate) enum DrawError {
    /// The size of the picture is invalid.
    #[error("a picture of {width} x {height} pixels is not drawn: sides have 1 to {most} pixels")]
    Size { width: u32, height: u32, most: u32 },
    /// A mesh is too large.
    #[error("a mesh of {triangles} triangles is not drawn: the GPU takes {most} bytes at one time")]
    TooManyTriangles { triangles: usize, most: u64 },
    /// The scene has too many items.
    #[error("{items} things are not drawn: the GPU takes {most} bytes at one time")]
    TooManyItems { items: usize, most: u64 },
    /// The driver failed.
    #[error("{0}")]
    Driver(String),
}

/// Draws on one GPU, one picture after the other.
#[derive(Debug)]
pub(crate) struct Renderer {
    gpu: Gpu,
    pipelines: Pipelines,
    targets: KeptTargets,
    /// Data that all triangles of a picture share.
    camera: wgpu::Buffer,
    camera_group: wgpu::BindGroup,
    /// Grows with the largest scene.
    items: wgpu::Buffer,
    /// Image of surfaces without one.
    white: wgpu::BindGroup,
    rows: Rows,
    shadows: Shadows,
}

impl Renderer {
    pub(crate) fn new(gpu: Gpu) -> Result<Self, DrawError> {
        let samples = if gpu.smooths { crate::gpu::SAMPLES } else { 1 };
        let pipelines = Pipelines::new(&gpu, samples);
        let camera = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("camera"),
            size: CAMERA_BYTES,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let camera_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("camera"),
            layout: &pipelines.camera,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: camera.as_entire_binding() }],
        });
        let items = items_buffer(&gpu, 64 * ITEM_BYTES);
        let white =
            surface::texture(&gpu, &pipelines, &Image { width: 1, height: 1, rgba: vec![u8::MAX; 4] });
        let shadows = Shadows::new(&gpu, &pipelines);
        if let Some(fault) = gpu.fault() {
            return Err(DrawError::Driver(fault));
        }
        let (targets, rows) = (KeptTargets::default(), Rows::default());
        Ok(Self { gpu, pipelines, targets, camera, camera_group, items, white, rows, shadows })
    }

    /// Uploads a mesh to the GPU.
    ///
    /// # Errors
    /// Returns an error if the GPU has no room for it.
    pub(crate) fn upload(&self, mesh: &Mesh) -> Result<Surface, DrawError> {
        let surface = Surface::new(&self.gpu, &self.pipelines, mesh)?;
        self.gpu.fault().map_or(Ok(surface), |fault| Err(DrawError::Driver(fault)))
    }

    /// Draws a picture, and waits for it.
    ///
    /// # Errors
    /// Returns an error if the picture is too large, or the driver fails.
    pub(crate) fn draw(&mut self, scene: &Scene) -> Result<Picture, DrawError> {
        let (width, height) = (scene.width, scene.height);
        let most = MAX_PIXELS.min(self.gpu.limits.max_texture_dimension_2d);
        if width == 0 || height == 0 || width > most || height > most {
            return Err(DrawError::Size { width, height, most });
        }
        self.rows.fill(scene);
        let light = self.shadows.prepare(&self.gpu, &self.pipelines, scene)?;
        bring_rows(&self.gpu, &mut self.items, &self.rows, scene)?;
        self.gpu.queue.write_buffer(&self.camera, 0, &camera_bytes(scene, light.as_ref()));
        let is_exact = scene.planes.depth || scene.planes.segmentation;
        let targets = self.targets.of_size(&self.gpu, width, height, scene.planes.color, is_exact);
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let passes = Passes {
            pipelines: &self.pipelines,
            camera: &self.camera_group,
            items: &self.items,
            white: &self.white,
            shade: self.shadows.group(light.is_some()),
            rows: &self.rows,
            scene,
        };
        if light.is_some() {
            self.shadows.cast(&mut encoder, &self.pipelines, &self.camera_group, scene);
        }
        if !(scene.planes.color && is_exact && passes.whole(&mut encoder, targets)) {
            if scene.planes.color {
                passes.color(&mut encoder, targets);
            }
            if is_exact {
                passes.exact(&mut encoder, targets);
            }
        }
        let backs = backs(targets, scene.planes);
        for back in backs.iter().flatten() {
            back.copy(&mut encoder);
        }
        self.gpu.queue.submit([encoder.finish()]);
        for back in backs.iter().flatten() {
            back.ask();
        }
        let waited =
            self.gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: Some(LONGEST) });
        let picture = taken(backs, width, height);
        let failed = match (self.gpu.fault(), waited, picture) {
            (None, Ok(_), Some(picture)) => return Ok(picture),
            (Some(fault), ..) => fault,
            (None, Err(error), _) => format!("the GPU did not end the picture: {error}"),
            (None, Ok(_), None) => "the GPU did not give the picture back".to_owned(),
        };
        // Memory may have been short: release the targets of other sizes.
        self.targets.clear();
        self.shadows.clear();
        Err(DrawError::Driver(failed))
    }
}

/// Writes the rows of a scene's items into GPU memory, which grows with them.
fn bring_rows(gpu: &Gpu, items: &mut wgpu::Buffer, rows: &Rows, scene: &Scene) -> Result<(), DrawError> {
    let bytes = rows.bytes();
    let wanted = bytes.len() as u64;
    let most = gpu.limits.max_buffer_size;
    if wanted > most {
        return Err(DrawError::TooManyItems { items: scene.items.len(), most });
    }
    if wanted > items.size() {
        *items = items_buffer(gpu, wanted.next_power_of_two().min(most));
    }
    if !bytes.is_empty() {
        gpu.queue.write_buffer(items, 0, bytes);
    }
    Ok(())
}

fn items_buffer(gpu: &Gpu, size: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("items"),
        size,
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// Returns the readbacks of the requested planes: colour, distance, segmentation.
fn backs(targets: &Targets, planes: Planes) -> [Option<&Readback>; 3] {
    let exact = targets.exact.as_ref();
    [
        targets.color.as_ref().filter(|_| planes.color).map(|color| &color.back),
        exact.filter(|_| planes.depth).map(|exact| &exact.distance),
        exact.filter(|_| planes.segmentation).map(|exact| &exact.number),
    ]
}

/// Reads the planes; `None` if one of them is missing.
fn taken(backs: [Option<&Readback>; 3], width: u32, height: u32) -> Option<Picture> {
    let pixels = width as usize * height as usize;
    let [color, distance, number] = backs;
    let mut is_whole = true;
    let mut read = |back: Option<&Readback>, bytes: usize, take: fn(&mut Vec<u8>, &[u8])| {
        back.map(|back| {
            let mut plane = Vec::with_capacity(bytes * pixels);
            is_whole &= back.read(|row| take(&mut plane, row));
            plane
        })
    };
    let color = read(color, 3, |plane, row| {
        let begin = plane.len();
        plane.resize(begin + row.len() / 4 * 3, 0);
        for (to, from) in plane[begin..].chunks_exact_mut(3).zip(row.chunks_exact(4)) {
            to.copy_from_slice(&from[..3]);
        }
    });
    // Floats and integers of a GPU with Vulkan are little-endian.
    let depth = read(distance, 4, |plane, row| plane.extend_from_slice(row));
    let segmentation = read(number, 4, |plane, row| plane.extend_from_slice(row));
    is_whole.then_some(Picture { color, depth, segmentation })
}

/// Returns the bytes of the shader's `Camera`.
fn camera_bytes(scene: &Scene, shadows: Option<&LightView>) -> Vec<u8> {
    let clip = reversed(scene.projection);
    let is_perspective = scene.projection.w_axis.w.abs() < 0.5;
    let light = &scene.light;
    let direction = scene.view.transform_vector3(light.direction).normalize_or(DVec3::Z).as_vec3();
    let mut bytes = Vec::with_capacity(usize::try_from(CAMERA_BYTES).unwrap_or(0));
    let mut put = |values: &[f32]| bytes.extend(values.iter().flat_map(|value| value.to_ne_bytes()));
    put(&clip.as_mat4().to_cols_array());
    put(&[direction.x, direction.y, direction.z, shadows.map_or(0.0, |light| light.shift as f32)]);
    let [red, green, blue] = light.color;
    put(&[red, green, blue, 1.0]);
    put(&[light.ambient, light.diffuse, light.specular, if is_perspective { 1.0 } else { 0.0 }]);
    put(&shadows.map_or(DMat4::IDENTITY, |light| light.map_from_camera).as_mat4().to_cols_array());
    bytes
}

/// Maps OpenGL's depth, -1 at the near plane and 1 at the far one, to 1 and 0. Floats are dense near 0, where
/// the depths of a perspective projection are.
fn reversed(projection: DMat4) -> DMat4 {
    let rows = projection.transpose();
    let depth: DVec4 = (rows.w_axis - rows.z_axis) / 2.0;
    DMat4::from_cols(rows.x_axis, rows.y_axis, depth, rows.w_axis).transpose()
}

/// Data for the passes of one picture.
struct Passes<'a> {
    pipelines: &'a Pipelines,
    camera: &'a wgpu::BindGroup,
    items: &'a wgpu::Buffer,
    white: &'a wgpu::BindGroup,
    shade: &'a wgpu::BindGroup,
    rows: &'a Rows,
    scene: &'a Scene,
}

impl Passes<'_> {
    fn color(&self, encoder: &mut wgpu::CommandEncoder, targets: &Targets) {
        let Some(color) = &targets.color else { return };
        let [r, g, b] = self.scene.background.map(f64::from);
        let clear = wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 });
        let (view, resolve_target, store) = match &color.smooth {
            // Only the mean of the samples is needed.
            Some(smooth) => (smooth, Some(&color.view), wgpu::StoreOp::Discard),
            None => (&color.view, None, wgpu::StoreOp::Store),
        };
        let ops = wgpu::Operations { load: clear, store };
        let attachment = wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target, ops };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("color"),
            color_attachments: &[Some(attachment)],
            depth_stencil_attachment: Some(far(&color.depth)),
            ..wgpu::RenderPassDescriptor::default()
        });
        let smooth = self.pipelines.smooth.as_ref().filter(|_| color.smooth.is_some());
        let pipelines = smooth.unwrap_or(&self.pipelines.plain);
        pass.set_pipeline(&pipelines.opaque);
        self.draw(&mut pass, self.rows.opaque(), true);
        pass.set_pipeline(&pipelines.translucent);
        self.draw(&mut pass, self.rows.translucent(), true);
    }

    /// Draws all in one pass, if colours are neither smoothed nor blended; otherwise returns false.
    fn whole(&self, encoder: &mut wgpu::CommandEncoder, targets: &Targets) -> bool {
        let (Some(color), Some(exact)) = (&targets.color, &targets.exact) else { return false };
        if color.smooth.is_some() || !self.rows.translucent().is_empty() {
            return false;
        }
        let [r, g, b] = self.scene.background.map(f64::from);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("whole"),
            color_attachments: &[
                Some(cleared(&color.view, wgpu::Color { r, g, b, a: 1.0 })),
                Some(cleared(&exact.distance_view, NOTHING)),
                Some(cleared(&exact.number_view, wgpu::Color::TRANSPARENT)),
            ],
            depth_stencil_attachment: Some(far(&color.depth)),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipelines.whole);
        self.draw(&mut pass, self.rows.opaque(), true);
        true
    }

    fn exact(&self, encoder: &mut wgpu::CommandEncoder, targets: &Targets) {
        let Some(exact) = &targets.exact else { return };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("exact"),
            color_attachments: &[
                Some(cleared(&exact.distance_view, NOTHING)),
                Some(cleared(&exact.number_view, wgpu::Color::TRANSPARENT)),
            ],
            depth_stencil_attachment: Some(far(&exact.depth)),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipelines.exact);
        self.draw(&mut pass, self.rows.opaque(), false);
        // The measured planes include translucent items.
        self.draw(&mut pass, self.rows.translucent(), false);
    }

    fn draw(&self, pass: &mut wgpu::RenderPass<'_>, all: &[Drawn], with_images: bool) {
        pass.set_bind_group(0, self.camera, &[]);
        if with_images {
            pass.set_bind_group(2, self.shade, &[]);
        }
        draw_rows(pass, self.items, self.scene, all, with_images.then_some(self.white));
    }
}

/// Draws rows of items, with the images of their parts or with the given one.
fn draw_rows(
    pass: &mut wgpu::RenderPass<'_>,
    items: &wgpu::Buffer,
    scene: &Scene,
    all: &[Drawn],
    without_image: Option<&wgpu::BindGroup>,
) {
    pass.set_vertex_buffer(1, items.slice(..));
    for drawn in all {
        let Some(item) = scene.items.get(drawn.item) else { continue };
        let Some(part) = item.surface.parts.get(drawn.part) else { continue };
        if let Some(white) = without_image {
            pass.set_bind_group(1, part.image.as_ref().unwrap_or(white), &[]);
        }
        pass.set_vertex_buffer(0, item.surface.vertices.slice(..));
        pass.set_index_buffer(item.surface.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(part.first..part.first + part.count, 0, drawn.rows.clone());
    }
}

/// Distance where no surface is seen. WebGPU's clear colours are f64, even for integers.
const NOTHING: wgpu::Color = wgpu::Color { r: f64::INFINITY, g: 0.0, b: 0.0, a: 0.0 };

/// Returns an attachment of a plane that is cleared and kept.
fn cleared(view: &wgpu::TextureView, color: wgpu::Color) -> wgpu::RenderPassColorAttachment<'_> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(color), store: wgpu::StoreOp::Store };
    wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops }
}

/// Returns an attachment of a depth buffer, cleared to the far end and discarded after the pass.
fn far(view: &wgpu::TextureView) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard };
    wgpu::RenderPassDepthStencilAttachment { view, depth_ops: Some(ops), stencil_ops: None }
}

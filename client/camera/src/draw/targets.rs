//! Render targets, and their readback. Both are kept for the next picture of the same size.

use crate::gpu::{Gpu, SAMPLES};

use super::pipelines::{BUFFERED_DEPTH, COLOR, DISTANCE, NUMBER};

/// Pixels of the largest picture with smoothed edges: more would fill a small GPU with four samples each.
const MAX_SMOOTHED_PIXELS: u64 = 2048 * 2048;
/// Maximum bytes that are kept for earlier sizes.
const MAX_KEPT_BYTES: u64 = 128 << 20;

/// Targets of pictures of one size.
#[derive(Debug)]
pub(super) struct Targets {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) color: Option<ColorTargets>,
    pub(super) exact: Option<ExactTargets>,
}

/// Targets of colours.
#[derive(Debug)]
pub(super) struct ColorTargets {
    /// Texture with several samples per pixel, if edges are smoothed.
    pub(super) smooth: Option<wgpu::TextureView>,
    pub(super) view: wgpu::TextureView,
    pub(super) depth: wgpu::TextureView,
    pub(super) back: Readback,
}

/// Targets of distances and segmentation.
#[derive(Debug)]
pub(super) struct ExactTargets {
    pub(super) distance_view: wgpu::TextureView,
    pub(super) number_view: wgpu::TextureView,
    pub(super) depth: wgpu::TextureView,
    pub(super) distance: Readback,
    pub(super) number: Readback,
}

/// A texture of 4 bytes per pixel, and the buffer that it is copied to.
#[derive(Debug)]
pub(super) struct Readback {
    texture: wgpu::Texture,
    buffer: wgpu::Buffer,
    /// Bytes of a row in the buffer; a multiple of 256.
    row_bytes: u32,
}

/// Targets by their last use, the newest first.
#[derive(Debug, Default)]
pub(super) struct KeptTargets(Vec<Targets>);

impl KeptTargets {
    /// Returns the targets of a size; makes missing ones.
    pub(super) fn of_size(
        &mut self,
        gpu: &Gpu,
        width: u32,
        height: u32,
        color: bool,
        exact: bool,
    ) -> &Targets {
        let known = self.0.iter().position(|kept| (kept.width, kept.height) == (width, height));
        let mut targets = match known {
            Some(index) => self.0.remove(index),
            None => Targets { width, height, color: None, exact: None },
        };
        if color && targets.color.is_none() {
            targets.color = Some(ColorTargets::new(gpu, width, height));
        }
        if exact && targets.exact.is_none() {
            targets.exact = Some(ExactTargets::new(gpu, width, height));
        }
        let mut bytes = targets.bytes();
        self.0.retain(|kept| {
            bytes += kept.bytes();
            bytes <= MAX_KEPT_BYTES
        });
        self.0.insert(0, targets);
        // Never empty: the targets were inserted above.
        &self.0[0]
    }

    /// Releases all targets.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }
}

impl Targets {
    fn bytes(&self) -> u64 {
        let pixels = u64::from(self.width) * u64::from(self.height);
        let color = self.color.as_ref().map_or(0, |color| match color.smooth {
            Some(_) => 8 * u64::from(SAMPLES) + 8,
            None => 12,
        });
        let exact = if self.exact.is_some() { 20 } else { 0 };
        pixels * (color + exact)
    }
}

impl ColorTargets {
    fn new(gpu: &Gpu, width: u32, height: u32) -> Self {
        let is_smoothed = gpu.smooths && u64::from(width) * u64::from(height) <= MAX_SMOOTHED_PIXELS;
        let samples = if is_smoothed { SAMPLES } else { 1 };
        let drawn = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let smooth = is_smoothed.then(|| view(&texture(gpu, COLOR, width, height, samples, drawn)));
        let back = Readback::new(gpu, COLOR, width, height);
        let depth = view(&texture(gpu, BUFFERED_DEPTH, width, height, samples, drawn));
        Self { smooth, view: view(&back.texture), depth, back }
    }
}

impl ExactTargets {
    fn new(gpu: &Gpu, width: u32, height: u32) -> Self {
        let distance = Readback::new(gpu, DISTANCE, width, height);
        let number = Readback::new(gpu, NUMBER, width, height);
        let drawn = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let depth = view(&texture(gpu, BUFFERED_DEPTH, width, height, 1, drawn));
        Self {
            distance_view: view(&distance.texture),
            number_view: view(&number.texture),
            depth,
            distance,
            number,
        }
    }
}

impl Readback {
    fn new(gpu: &Gpu, format: wgpu::TextureFormat, width: u32, height: u32) -> Self {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let row_bytes = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: u64::from(row_bytes) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        Self { texture: texture(gpu, format, width, height, 1, usage), buffer, row_bytes }
    }

    /// Copies the drawn picture to the buffer.
    pub(super) fn copy(&self, encoder: &mut wgpu::CommandEncoder) {
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(self.row_bytes),
            rows_per_image: None,
        };
        let to = wgpu::TexelCopyBufferInfo { buffer: &self.buffer, layout };
        encoder.copy_texture_to_buffer(self.texture.as_image_copy(), to, self.texture.size());
    }

    /// Requests the mapping of the buffer; the device must be polled before it is read.
    pub(super) fn ask(&self) {
        // The reader detects failures.
        self.buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    }

    /// Passes each row of the picture to `take`, without padding. Returns false if the mapping failed.
    pub(super) fn read(&self, mut take: impl FnMut(&[u8])) -> bool {
        let Ok(mapped) = self.buffer.get_mapped_range(..) else {
            self.buffer.unmap();
            return false;
        };
        let size = self.texture.size();
        for row in mapped.chunks_exact(self.row_bytes as usize).take(size.height as usize) {
            take(row.get(..4 * size.width as usize).unwrap_or_default());
        }
        drop(mapped);
        self.buffer.unmap();
        true
    }
}

fn texture(
    gpu: &Gpu,
    format: wgpu::TextureFormat,
    width: u32,
    height: u32,
    sample_count: u32,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

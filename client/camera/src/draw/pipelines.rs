//! Render pipelines.
//!
//! There is one each for opaque colours, translucent colours, measured planes, all of these together, and the
//! shadow map.

use crate::gpu::Gpu;

pub(super) const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
pub(super) const BUFFERED_DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
pub(super) const DISTANCE: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;
pub(super) const NUMBER: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

/// Bytes of a vertex: position, normal, texture coordinates.
pub(super) const CORNER_BYTES: u64 = 32;
/// Bytes of an item: rows of a position, rows of a rotation, colour, segmentation number.
pub(super) const ITEM_BYTES: u64 = 104;
/// Bytes of the data that all triangles of a picture share.
pub(super) const CAMERA_BYTES: u64 = 176;

/// Pipelines for one number of samples.
#[derive(Debug)]
pub(super) struct ColorPipelines {
    pub(super) opaque: wgpu::RenderPipeline,
    pub(super) translucent: wgpu::RenderPipeline,
}

/// All pipelines, with their layouts.
#[derive(Debug)]
pub(super) struct Pipelines {
    pub(super) plain: ColorPipelines,
    /// Present if the GPU smooths edges.
    pub(super) smooth: Option<ColorPipelines>,
    pub(super) exact: wgpu::RenderPipeline,
    /// Colours and measured planes in one pass.
    pub(super) whole: wgpu::RenderPipeline,
    /// Shadow map.
    pub(super) shadow: wgpu::RenderPipeline,
    /// Layout of the data that all triangles of a picture share.
    pub(super) camera: wgpu::BindGroupLayout,
    /// Layout of an image.
    pub(super) image: wgpu::BindGroupLayout,
    pub(super) sampler: wgpu::Sampler,
    /// Layout of the shadow map.
    pub(super) shade: wgpu::BindGroupLayout,
    pub(super) shade_sampler: wgpu::Sampler,
}

/// Differences between pipelines.
struct Kind {
    label: &'static str,
    corner: &'static str,
    /// `None` if only the depth buffer is drawn.
    pixel: Option<&'static str>,
    samples: u32,
    /// Whether it hides the surfaces behind.
    hides: bool,
}

impl Pipelines {
    pub(super) fn new(gpu: &Gpu, samples: u32) -> Self {
        let device = &gpu.device;
        let source = wgpu::ShaderSource::Wgsl(include_str!("shader.wgsl").into());
        let module =
            device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("surfaces"), source });
        let camera = camera_layout(device);
        let image = image_layout(device);
        let shade = shade_layout(device);
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("surfaces"),
            bind_group_layouts: &[Some(&camera), Some(&image), Some(&shade)],
            immediate_size: 0,
        });
        // Distances and segmentation need no image.
        let bare = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("exact"),
            bind_group_layouts: &[Some(&camera)],
            immediate_size: 0,
        });
        let color = |samples: u32| {
            let opaque = Kind {
                label: "opaque",
                corner: "lit_corner",
                pixel: Some("lit_pixel"),
                samples,
                hides: true,
            };
            let translucent = Kind { label: "translucent", hides: false, ..opaque };
            let blended = wgpu::ColorTargetState {
                format: COLOR,
                blend: Some(wgpu::BlendState::ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::ALL,
            };
            ColorPipelines {
                opaque: pipeline(device, &layout, &module, &opaque, &[Some(COLOR.into())]),
                translucent: pipeline(device, &layout, &module, &translucent, &[Some(blended)]),
            }
        };
        let exact = Kind {
            label: "exact",
            corner: "exact_corner",
            pixel: Some("exact_pixel"),
            samples: 1,
            hides: true,
        };
        let exact = pipeline(device, &bare, &module, &exact, &[Some(DISTANCE.into()), Some(NUMBER.into())]);
        let whole = Kind {
            label: "whole",
            corner: "lit_corner",
            pixel: Some("whole_pixel"),
            samples: 1,
            hides: true,
        };
        let targets = [Some(COLOR.into()), Some(DISTANCE.into()), Some(NUMBER.into())];
        let whole = pipeline(device, &layout, &module, &whole, &targets);
        let shadow = Kind { label: "shadow", corner: "shadow_corner", pixel: None, samples: 1, hides: true };
        let shadow = pipeline(device, &bare, &module, &shadow, &[]);
        let plain = color(1);
        let smooth = (samples > 1).then(|| color(samples));
        let (sampler, shade_sampler) = (sampler(device), shade_sampler(device));
        Self { plain, smooth, exact, whole, shadow, camera, image, sampler, shade, shade_sampler }
    }
}

fn camera_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("camera"),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: wgpu::BufferSize::new(CAMERA_BYTES),
            },
            count: None,
        }],
    })
}

fn image_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding: u32, ty: wgpu::BindingType| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("image"),
        entries: &[entry(0, texture), entry(1, sampler)],
    })
}

fn shade_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding: u32, ty: wgpu::BindingType| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    let map = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Depth,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("shadow"),
        entries: &[entry(0, map), entry(1, sampler)],
    })
}

/// Returns a sampler that compares before it filters.
fn shade_sampler(device: &wgpu::Device) -> wgpu::Sampler {
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("shadow"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        // A surface is lit if it is at least as near to the light as the map's depth.
        compare: Some(wgpu::CompareFunction::GreaterEqual),
        ..wgpu::SamplerDescriptor::default()
    })
}

fn sampler(device: &wgpu::Device) -> wgpu::Sampler {
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("image"),
        address_mode_u: wgpu::AddressMode::Repeat,
        address_mode_v: wgpu::AddressMode::Repeat,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..wgpu::SamplerDescriptor::default()
    })
}

/// Draws both sides of triangles: single-layer shells are common, and files wind them either way.
fn pipeline(
    device: &wgpu::Device,
    layout: &wgpu::PipelineLayout,
    module: &wgpu::ShaderModule,
    kind: &Kind,
    targets: &[Option<wgpu::ColorTargetState>],
) -> wgpu::RenderPipeline {
    let corner = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2];
    let item = wgpu::vertex_attr_array![
        3 => Float32x4, 4 => Float32x4, 5 => Float32x4,
        6 => Float32x3, 7 => Float32x3, 8 => Float32x3,
        9 => Float32x4, 10 => Uint32
    ];
    let buffers = [
        Some(wgpu::VertexBufferLayout {
            array_stride: CORNER_BYTES,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &corner,
        }),
        Some(wgpu::VertexBufferLayout {
            array_stride: ITEM_BYTES,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &item,
        }),
    ];
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(kind.label),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(kind.corner),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &buffers,
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: BUFFERED_DEPTH,
            depth_write_enabled: Some(kind.hides),
            // Reversed depth, which is as precise for far surfaces as for near ones.
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState { count: kind.samples, ..wgpu::MultisampleState::default() },
        fragment: kind.pixel.map(|pixel| wgpu::FragmentState {
            module,
            entry_point: Some(pixel),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

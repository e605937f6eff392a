//! Shadows of the directional light: which part of a scene is looked at from there, and the map of what is nearest to the light
//! (Williams, *Casting curved shadows on curved surfaces*, 1978).

use glamx::{DAffine3, DMat4, DQuat, DVec3, DVec4};

use crate::gpu::Gpu;
use crate::scene::{Item, Scene};

use super::pipelines::{BUFFERED_DEPTH, Pipelines};
use super::rows::{Rows, ball_of, hides};
use super::{DrawError, bring_rows, draw_rows, far, items_buffer};

/// Pixels of a side of the map.
const SIDE: u32 = 2048;
/// What is larger casts no shadow: planes, which would make the map too coarse for all else. Metres.
const LARGEST: f64 = 500.0;
/// The map is wider than what casts shadows by this part.
const MARGIN: f64 = 0.01;
/// Pixels of the map that its filter reaches, rounded up: surfaces are looked for so far above themselves, or they would shade
/// themselves.
const REACH: f64 = 2.5;
/// Metres beside that, against rounding.
const LEAST_SHIFT: f64 = 1e-4;

/// What the light sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LightView {
    /// From the camera's axes to x and y of -1 to 1, and a depth of 1 next to the light and 0 away from it.
    pub(super) map_from_camera: DMat4,
    /// Metres above a surface at which it is looked for.
    pub(super) shift: f64,
}

/// The map, and what is drawn into it. Its memory is taken with the first shadow that is asked for.
#[derive(Debug)]
pub(super) struct Shadows {
    map: Option<(wgpu::TextureView, wgpu::BindGroup)>,
    /// Instead of the map where there is no shadow.
    none: wgpu::BindGroup,
    rows: Rows,
    items: wgpu::Buffer,
}

impl Shadows {
    pub(super) fn new(gpu: &Gpu, pipelines: &Pipelines) -> Self {
        let (_, none) = map(gpu, pipelines, 1);
        Self { map: None, none, rows: Rows::default(), items: items_buffer(gpu, 4) }
    }

    /// Makes ready what casts shadows in a scene; `None` where none is asked for, or none falls on what is seen.
    ///
    /// # Errors
    /// Returns an error if the GPU has no room for it.
    pub(super) fn prepare(
        &mut self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        scene: &Scene,
    ) -> Result<Option<LightView>, DrawError> {
        if !(scene.light.shadow && scene.planes.color) {
            return Ok(None);
        }
        let Some(view) = light_view(scene) else { return Ok(None) };
        self.rows.fill_casters(scene, casts);
        bring_rows(gpu, &mut self.items, &self.rows, scene)?;
        self.map.get_or_insert_with(|| map(gpu, pipelines, SIDE));
        Ok(Some(view))
    }

    /// What colours are drawn with.
    pub(super) fn group(&self, is_shaded: bool) -> &wgpu::BindGroup {
        self.map.as_ref().filter(|_| is_shaded).map_or(&self.none, |(_, group)| group)
    }

    /// Draws the map.
    pub(super) fn cast(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pipelines: &Pipelines,
        camera: &wgpu::BindGroup,
        scene: &Scene,
    ) {
        let Some((view, _)) = &self.map else { return };
        let mut attachment = far(view);
        attachment.depth_ops =
            attachment.depth_ops.map(|ops| wgpu::Operations { store: wgpu::StoreOp::Store, ..ops });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow"),
            depth_stencil_attachment: Some(attachment),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&pipelines.shadow);
        pass.set_bind_group(0, camera, &[]);
        draw_rows(&mut pass, &self.items, scene, self.rows.opaque(), None);
    }

    /// Gives the map's memory back.
    pub(super) fn clear(&mut self) {
        self.map = None;
    }
}

/// A map of so many pixels a side, and the group that colours are drawn with.
fn map(gpu: &Gpu, pipelines: &Pipelines, side: u32) -> (wgpu::TextureView, wgpu::BindGroup) {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("shadow"),
        size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: BUFFERED_DEPTH,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("shadow"),
        layout: &pipelines.shade,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) },
            wgpu::BindGroupEntry {
                binding: 1,
                resource: wgpu::BindingResource::Sampler(&pipelines.shade_sampler),
            },
        ],
    });
    (view, group)
}

/// Whether it can keep light from others.
fn casts(item: &Item) -> bool {
    let (_, radius) = ball_of(item, &DAffine3::IDENTITY);
    hides(item) && radius > 0.0 && radius <= LARGEST
}

/// From the light to all that casts shadows, as far as what is seen may lie in them; `None` where nothing does.
fn light_view(scene: &Scene) -> Option<LightView> {
    let towards = scene.light.direction.normalize_or(DVec3::Z);
    // With z towards the light.
    let light_from_world = DAffine3::from_quat(DQuat::from_rotation_arc(towards, DVec3::Z));
    let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for item in scene.items.iter().filter(|item| casts(item)) {
        let (center, radius) = ball_of(item, &light_from_world);
        (least, most) = (least.min(center - radius), most.max(center + radius));
    }
    // Light falls along z: beside what is seen no shadow is of interest, but nothing is too high or too low.
    if let Some((seen_least, seen_most)) = seen(scene, &light_from_world) {
        least = seen_least.with_z(least.z).max(least);
        most = seen_most.with_z(most.z).min(most);
    }
    let size = most - least;
    if !(size.is_finite() && size.min_element() > 0.0) {
        return None;
    }
    let (center, half) = ((least + most) / 2.0, size * (0.5 + MARGIN));
    let low = center.z - half.z;
    let map_from_light = DMat4::from_cols(
        DVec4::X / half.x,
        DVec4::Y / half.y,
        DVec4::Z / (2.0 * half.z),
        DVec4::new(-center.x / half.x, -center.y / half.y, -low / (2.0 * half.z), 1.0),
    );
    let camera_from_world = DAffine3::from_mat4(scene.view);
    let map_from_camera = map_from_light * DMat4::from(light_from_world * camera_from_world.inverse());
    let pixel = 2.0 * half.x.max(half.y) / f64::from(SIDE);
    map_from_camera.is_finite().then_some(LightView { map_from_camera, shift: REACH * pixel + LEAST_SHIFT })
}

/// The bounds of what the camera sees, in the light's axes; `None` where it sees endlessly far.
fn seen(scene: &Scene, light_from_world: &DAffine3) -> Option<(DVec3, DVec3)> {
    let world_from_clip = (scene.projection * scene.view).inverse();
    let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for corner in 0..8_u32 {
        let sign = |bit: u32| if corner & bit == 0 { -1.0 } else { 1.0 };
        let at = world_from_clip * DVec4::new(sign(1), sign(2), sign(4), 1.0);
        let at = light_from_world.transform_point3(at.truncate() / at.w);
        if !at.is_finite() {
            return None;
        }
        (least, most) = (least.min(at), most.max(at));
    }
    Some((least, most))
}

//! Shadows of the directional light: the part of a scene that the light sees, and the shadow map of its
//! nearest surfaces. Source: Williams, *Casting curved shadows on curved surfaces*, 1978.

use glamx::{DAffine3, DMat4, DQuat, DVec3, DVec4};

use crate::gpu::Gpu;
use crate::scene::{Item, Scene};

use super::pipelines::{BUFFERED_DEPTH, Pipelines};
use super::rows::{Rows, ball_of, hides};
use super::{DrawError, bring_rows, draw_rows, far, items_buffer};

/// Pixels of a side of the map.
const SIDE: u32 = 2048;
/// Largest radius of items that cast shadows, metres. Planes would make the map too coarse for all others.
const LARGEST: f64 = 500.0;
/// Relative margin of the map around the items that cast shadows.
const MARGIN: f64 = 0.01;
/// Reach of the map's filter in pixels, rounded up. Surfaces are looked up this far above themselves, or they
/// would shade themselves.
const REACH: f64 = 2.5;
/// Additional distance against rounding, metres.
const LEAST_SHIFT: f64 = 1e-4;

/// View of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LightView {
    /// Maps the camera's axes to x and y of -1 to 1. The depth is 1 next to the light and 0 away from it.
    pub(super) map_from_camera: DMat4,
    /// Metres above a surface at which the map is looked up.
    pub(super) shift: f64,
}

/// The shadow map, with its rows. Its memory is allocated with the first shadow.
#[derive(Debug)]
pub(super) struct Shadows {
    map: Option<(wgpu::TextureView, wgpu::BindGroup)>,
    /// Replaces the map if there is no shadow.
    none: wgpu::BindGroup,
    rows: Rows,
    items: wgpu::Buffer,
}

impl Shadows {
    pub(super) fn new(gpu: &Gpu, pipelines: &Pipelines) -> Self {
        let (_, none) = map(gpu, pipelines, 1);
        Self { map: None, none, rows: Rows::default(), items: items_buffer(gpu, 4) }
    }

    /// Prepares the items that cast shadows; `None` if no shadows are requested, or none is visible.
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

    /// Returns the bind group for drawing colours.
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

    /// Releases the map's memory.
    pub(super) fn clear(&mut self) {
        self.map = None;
    }
}

/// Returns a map with `side` pixels a side, and its bind group for drawing colours.
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

/// Returns whether it can cast shadows.
fn casts(item: &Item) -> bool {
    let (_, radius) = ball_of(item, &DAffine3::IDENTITY);
    hides(item) && radius > 0.0 && radius <= LARGEST
}

/// Returns the light's view of all items that cast shadows, limited to the visible region; `None` if there
/// are none.
fn light_view(scene: &Scene) -> Option<LightView> {
    let towards = scene.light.direction.normalize_or(DVec3::Z);
    // Its z axis points towards the light.
    let light_from_world = DAffine3::from_quat(DQuat::from_rotation_arc(towards, DVec3::Z));
    let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for item in scene.items.iter().filter(|item| casts(item)) {
        let (center, radius) = ball_of(item, &light_from_world);
        (least, most) = (least.min(center - radius), most.max(center + radius));
    }
    // Light falls along z: shadows outside of the visible region do not matter, but casters may be at any
    // height.
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

/// Returns the bounds of the camera's view, in the light's axes; `None` if the view is endless.
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

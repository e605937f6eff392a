//! Pictures for recordings: for each camera at its own rate, as renderers draw them.

use std::sync::{Arc, Weak};

use tokio::time::Instant;

use super::FOLLOWED;
use super::picture::{Picture, Plane};
use crate::handle::{Inner, SimHandle};
use crate::recording::camera_message::ImageKind;
use crate::recording::images::{CameraImage, ImagePlane, ImageSource, NoRenderer};

/// Source of a recording's pictures. It does not keep the world alive: a recording ends with it.
#[derive(Clone, Debug)]
pub(in crate::handle) struct CameraImages(Weak<Inner>);

impl SimHandle {
    /// Returns the pictures of all cameras, for a recording.
    pub(in crate::handle) fn camera_images(&self) -> CameraImages {
        CameraImages(Arc::downgrade(&self.inner))
    }
}

impl ImageSource for CameraImages {
    fn next_image(&self, camera: u64, after: u64) -> Result<Option<CameraImage>, NoRenderer> {
        // The world ends, and the recording next.
        let Some(handle) = self.0.upgrade().map(SimHandle::of_daemon) else { return Ok(None) };
        let now = Instant::now();
        handle.follow_camera(camera, now + FOLLOWED).map_err(|_no_renderer| NoRenderer)?;
        let queue = handle.inner.cameras.queue();
        let picture = queue.of_rate(camera, after, None);
        let drawn = queue.camera(camera, now).drawn;
        drop(queue);
        Ok(picture.map(|picture| image(&picture, drawn)))
    }
}

fn image(picture: &Picture, drawn: u64) -> CameraImage {
    let (width, height) = (picture.view.width, picture.view.height);
    let planes = [
        (ImageKind::COLOR, &picture.drawn.color),
        (ImageKind::DEPTH, &picture.drawn.depth),
        (ImageKind::SEGMENTATION, &picture.drawn.segmentation),
    ];
    let plane = |kind: ImageKind, plane: &Plane| {
        let (plane, size) = (plane.clone(), kind.size(width, height));
        ImagePlane { kind, unpack: Box::new(move || plane.unpacked(size)) }
    };
    CameraImage {
        sequence: picture.sequence,
        state_sequence: picture.state_sequence,
        sim_time: picture.at.sim_time,
        wall_time: picture.wall_time,
        width,
        height,
        pinhole: picture.view.lens.pinhole(),
        drawn,
        planes: planes.into_iter().filter_map(|(kind, of)| Some(plane(kind, of.as_ref()?))).collect(),
    }
}

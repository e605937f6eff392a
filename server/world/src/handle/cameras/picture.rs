//! Orders for pictures, and drawn pictures.

use std::io::Read as _;
use std::sync::Arc;
use std::time::SystemTime;

use bytes::Bytes;
use flate2::bufread::ZlibDecoder;
use simd_core::Moment;

use super::lens::Lens;
use crate::handle::{CallError, Published};

/// Maximum width and height of a picture, pixels.
pub const MAX_PIXELS: u32 = 4_096;

/// Planes of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Planes {
    /// Red, green and blue, a byte each.
    pub color: bool,
    /// Distance along the optical axis, metres, float32.
    pub depth: bool,
    /// Number of the visible link, uint32.
    pub segmentation: bool,
}

impl Planes {
    /// Returns the bytes of a pixel.
    pub(crate) fn bytes(self) -> u64 {
        let Self { color, depth, segmentation } = self;
        [(color, COLOR), (depth, DEPTH), (segmentation, SEGMENTATION)]
            .iter()
            .map(|(has, bytes)| if *has { *bytes } else { 0 })
            .sum()
    }
}

/// Bytes of a pixel of each plane.
const COLOR: u64 = 3;
const DEPTH: u64 = 4;
const SEGMENTATION: u64 = 4;

/// Direction of light, and reflection by surfaces: see `PictureLight` of the schema.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Direction towards the light, world axes; of any length but 0.
    pub direction: [f64; 3],
    /// Red, green and blue from 0 to 1.
    pub color: [f64; 3],
    /// Ambient reflection, 0 to 1.
    pub ambient: f64,
    /// Diffuse reflection, by the cosine of the light's angle, 0 to 1.
    pub diffuse: f64,
    /// Specular reflection, 0 to 1.
    pub specular: f64,
    /// Whether objects in a shadow get no diffuse light.
    pub shadow: bool,
}

impl Default for Light {
    /// Returns the default light of PyBullet's pictures, from above and aside.
    fn default() -> Self {
        Self {
            direction: [-0.5, 0.3, 1.0],
            color: [1.0; 3],
            ambient: 0.6,
            diffuse: 0.35,
            specular: 0.05,
            shadow: false,
        }
    }
}

/// A point of view, and the wanted picture.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Width, pixels, at most [`MAX_PIXELS`].
    pub width: u32,
    /// Height, pixels, at most [`MAX_PIXELS`].
    pub height: u32,
    /// Point of view and projection.
    pub lens: Lens,
    /// Wanted planes.
    pub planes: Planes,
    /// Light.
    pub light: Light,
    /// Background: red, green and blue from 0 to 1.
    pub background: [f64; 3],
}

impl View {
    /// Returns the bytes of the picture's planes, uncompressed.
    pub(crate) fn bytes(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height) * self.planes.bytes()
    }
}

/// Name of a robot's camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CameraName {
    /// Name of the robot.
    pub robot: String,
    /// Name of the sensor.
    pub sensor: String,
}

/// Order for a picture.
#[derive(Clone, Debug)]
pub struct PictureOrder {
    /// Camera, with the sensor's id; `None` for a client's own point of view.
    pub camera: Option<(u64, CameraName)>,
    /// View to draw.
    pub view: View,
    /// State to draw.
    pub state: Arc<Published>,
}

/// Numbers of a robot's links in a segmentation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureRobot {
    /// Name of the robot.
    pub robot: String,
    /// Number of its link 0.
    pub first_link: u32,
    /// Number of its links.
    pub links: u32,
}

/// Values of each pixel, row by row from the upper left one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plane {
    /// Whether `data` is compressed by zlib.
    pub is_zlib: bool,
    /// Values, little-endian.
    pub data: Bytes,
}

/// Planes that a renderer sends.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Drawn {
    /// Plane of [`Planes::color`].
    pub color: Option<Plane>,
    /// Plane of [`Planes::depth`].
    pub depth: Option<Plane>,
    /// Plane of [`Planes::segmentation`].
    pub segmentation: Option<Plane>,
}

/// A picture of the world.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Number, larger than in every earlier picture.
    pub sequence: u64,
    /// Moment of the drawn state.
    pub at: Moment,
    /// Wall time at which that state was published.
    pub wall_time: SystemTime,
    /// Sequence of that state.
    pub state_sequence: u64,
    /// Drawn view.
    pub view: View,
    /// Planes.
    pub drawn: Drawn,
    /// Robots in spawn order.
    pub robots: Vec<PictureRobot>,
    /// Name of the renderer.
    pub renderer: Arc<str>,
}

impl PictureOrder {
    /// Makes the picture of this order.
    pub(super) fn picture(&self, sequence: u64, drawn: Drawn, renderer: Arc<str>) -> Picture {
        let Published { sequence: state_sequence, wall_time, state, .. } = &*self.state;
        let mut first_link = 1_u32;
        let robots = state.world.entities.iter().map(|entity| {
            let links = u32::try_from(entity.model.links.len()).unwrap_or(u32::MAX);
            let first = first_link;
            first_link = first_link.saturating_add(links);
            PictureRobot { robot: entity.name.clone(), first_link: first, links }
        });
        Picture {
            sequence,
            at: state.at,
            wall_time: *wall_time,
            state_sequence: *state_sequence,
            robots: robots.collect(),
            view: self.view.clone(),
            drawn,
            renderer,
        }
    }
}

impl Drawn {
    /// Returns the bytes of its planes as sent.
    pub(crate) fn bytes(&self) -> u64 {
        let Self { color, depth, segmentation } = self;
        [color, depth, segmentation].into_iter().flatten().map(|plane| plane.data.len() as u64).sum()
    }

    /// Checks that the planes match a view. It may take milliseconds for compressed planes.
    ///
    /// # Errors
    /// Returns an error if a plane is missing, was not requested, or has another size.
    pub(super) fn check(&self, view: &View) -> Result<(), CallError> {
        let pixels = u64::from(view.width) * u64::from(view.height);
        let Self { color, depth, segmentation } = self;
        let Planes { color: colored, depth: deep, segmentation: segmented } = view.planes;
        for (element, plane, is_wanted, bytes) in [
            ("color", color, colored, COLOR),
            ("depth", depth, deep, DEPTH),
            ("segmentation", segmentation, segmented, SEGMENTATION),
        ] {
            let refuse = |value: String, expected: String| {
                Err(CallError::InvalidValue { element: element.to_owned(), value, expected })
            };
            let expected = pixels * bytes;
            match plane {
                None if is_wanted => return refuse("missing".into(), "the task asks for it".into()),
                Some(_) if !is_wanted => {
                    return refuse("given".into(), "the task does not ask for it".into());
                }
                Some(plane) => match plane.unpacked_bytes(expected) {
                    Ok(bytes) if bytes == expected => {}
                    Ok(bytes) => {
                        let value = if bytes > expected {
                            format!("more than {expected} bytes long")
                        } else {
                            format!("{bytes} bytes long")
                        };
                        let size = format!("{} x {} pixels are {expected} bytes", view.width, view.height);
                        return refuse(value, size);
                    }
                    Err(error) => return refuse(format!("broken ({error})"), "it must be of zlib".into()),
                },
                None => {}
            }
        }
        Ok(())
    }
}

impl Plane {
    /// Returns the uncompressed size, bytes; reads at most one byte beyond `most`.
    fn unpacked_bytes(&self, most: u64) -> std::io::Result<u64> {
        if !self.is_zlib {
            return Ok(self.data.len() as u64);
        }
        std::io::copy(&mut ZlibDecoder::new(&*self.data).take(most.saturating_add(1)), &mut std::io::sink())
    }

    /// Returns the uncompressed values, of at most `most` bytes.
    ///
    /// # Errors
    /// Returns an error if zlib's data are broken or larger.
    pub fn unpacked(&self, most: u64) -> std::io::Result<Bytes> {
        if !self.is_zlib {
            return Ok(self.data.clone());
        }
        let mut bytes = Vec::new();
        ZlibDecoder::new(&*self.data).take(most.saturating_add(1)).read_to_end(&mut bytes)?;
        match bytes.len() as u64 <= most {
            true => Ok(bytes.into()),
            false => Err(std::io::Error::other("there is more than a picture has")),
        }
    }
}

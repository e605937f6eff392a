//! What is to be drawn, and what was.

use std::io::Read as _;
use std::sync::Arc;
use std::time::SystemTime;

use bytes::Bytes;
use flate2::bufread::ZlibDecoder;
use simd_core::Moment;

use super::lens::Lens;
use crate::handle::{CallError, Published};

/// Pixels of a side of a picture at the most.
pub const MOST_PIXELS: u32 = 4_096;

/// What a picture has for each pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Planes {
    /// Red, green and blue, a byte each.
    pub color: bool,
    /// Metres along the optical axis, float32.
    pub depth: bool,
    /// The number of the link that is seen, uint32.
    pub segmentation: bool,
}

impl Planes {
    /// Bytes of a pixel.
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

/// Where light comes from, and what surfaces make of it: see `PictureLight` of the schema.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Towards the light, world axes; of any length but 0.
    pub direction: [f64; 3],
    /// Red, green and blue from 0 to 1.
    pub color: [f64; 3],
    /// From any side, 0 to 1.
    pub ambient: f64,
    /// By the cosine of its angle, 0 to 1.
    pub diffuse: f64,
    /// Mirrored, 0 to 1.
    pub specular: f64,
    /// What is in another's shadow gets no diffuse light.
    pub shadow: bool,
}

impl Default for Light {
    /// That of PyBullet's pictures where nothing is said, from above and aside.
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

/// A point of view, and what is wanted of it.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Pixels, at most [`MOST_PIXELS`].
    pub width: u32,
    /// Pixels, at most [`MOST_PIXELS`].
    pub height: u32,
    /// From where, and how wide.
    pub lens: Lens,
    /// Of each pixel.
    pub planes: Planes,
    /// What shines.
    pub light: Light,
    /// Red, green and blue from 0 to 1 where nothing is seen.
    pub background: [f64; 3],
}

impl View {
    /// Of the planes of a picture, nothing packed.
    pub(crate) fn bytes(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height) * self.planes.bytes()
    }
}

/// The camera of a robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CameraName {
    /// Its robot.
    pub robot: String,
    /// The sensor.
    pub sensor: String,
}

/// A picture that is to be drawn.
#[derive(Clone, Debug)]
pub struct PictureOrder {
    /// Whose camera it is, with the sensor's id; `None` where it is a client's own point of view.
    pub camera: Option<(u64, CameraName)>,
    /// From where.
    pub view: View,
    /// What.
    pub state: Arc<Published>,
}

/// The links of a robot within the numbers of a segmentation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureRobot {
    /// Its name.
    pub robot: String,
    /// The number of its link 0.
    pub first_link: u32,
    /// How many it has.
    pub links: u32,
}

/// Numbers for each pixel, row by row from the upper left one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plane {
    /// `data` is as zlib has it.
    pub is_zlib: bool,
    /// Little-endian.
    pub data: Bytes,
}

/// What a renderer sends.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Drawn {
    /// As [`Planes::color`].
    pub color: Option<Plane>,
    /// As [`Planes::depth`].
    pub depth: Option<Plane>,
    /// As [`Planes::segmentation`].
    pub segmentation: Option<Plane>,
}

/// What a camera saw.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Larger than that of every picture before.
    pub sequence: u64,
    /// Of the state that was drawn.
    pub at: Moment,
    /// When that state was published.
    pub wall_time: SystemTime,
    /// Of that state.
    pub state_sequence: u64,
    /// From where.
    pub view: View,
    /// What was seen.
    pub drawn: Drawn,
    /// In the order in which they were spawned.
    pub robots: Vec<PictureRobot>,
    /// Who drew it.
    pub renderer: Arc<str>,
}

impl PictureOrder {
    /// The picture that was drawn for it.
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
    /// Of its planes as sent.
    pub(crate) fn bytes(&self) -> u64 {
        let Self { color, depth, segmentation } = self;
        [color, depth, segmentation].into_iter().flatten().map(|plane| plane.data.len() as u64).sum()
    }

    /// Whether it is what a view asks for. It may take milliseconds where planes are packed.
    ///
    /// # Errors
    /// Returns an error if a plane is missing, is too much, or is of another size.
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
    /// How many bytes it has, unpacked; nothing beyond one more than `most` is read.
    fn unpacked_bytes(&self, most: u64) -> std::io::Result<u64> {
        if !self.is_zlib {
            return Ok(self.data.len() as u64);
        }
        std::io::copy(&mut ZlibDecoder::new(&*self.data).take(most.saturating_add(1)), &mut std::io::sink())
    }

    /// Its numbers, where they are at most so many bytes.
    ///
    /// # Errors
    /// Returns an error if zlib's data are broken, or are more.
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

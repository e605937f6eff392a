//! Options of cameras.

use clap::{Args, ValueEnum};
use serde::Serialize;
use simd_client::proto::{CameraSensor, Picture};

use super::definition::limits;
use crate::quantity::{self, Motion};

/// Defaults of a camera: pixels, rad and metres.
const SIZE: [u32; 2] = [640, 480];
const FIELD_OF_VIEW: f64 = std::f64::consts::FRAC_PI_3;
const CLIP: [f64; 2] = [0.05, 100.0];

#[derive(Args, Clone, Debug, Default)]
pub(crate) struct Lens {
    /// For a camera: pixels; 640x480 if left out
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size)]
    size: Option<[u32; 2]>,
    /// For a camera: horizontal field of view; 60deg if left out
    #[arg(long, value_name = "ANGLE", value_parser = angle)]
    field_of_view: Option<f64>,
    /// For a camera: nearest and farthest visible distance; 0.05,100 if left out
    #[arg(long, value_name = "NEAR,FAR", value_parser = limits)]
    clip: Option<[f64; 2]>,
    /// For a camera: planes of its pictures; color if left out
    #[arg(long, value_enum)]
    picture: Option<Pictures>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Pictures {
    /// Colours
    Color,
    /// Distances along the optical axis
    Depth,
    /// Both
    ColorAndDepth,
    /// Visible link
    Segmentation,
}

impl Lens {
    /// Returns the first of its options that was given.
    pub(super) fn given(&self) -> Option<&'static str> {
        let Self { size, field_of_view, clip, picture } = self;
        [
            ("--size", size.is_some()),
            ("--field-of-view", field_of_view.is_some()),
            ("--clip", clip.is_some()),
            ("--picture", picture.is_some()),
        ]
        .into_iter()
        .find_map(|(option, is_given)| is_given.then_some(option))
    }

    /// Makes the camera.
    pub(super) fn camera(&self) -> CameraSensor {
        let [width, height] = self.size.unwrap_or(SIZE);
        let [near, far] = self.clip.unwrap_or(CLIP);
        let picture = match self.picture.unwrap_or(Pictures::Color) {
            Pictures::Color => Picture::Color,
            Pictures::Depth => Picture::Depth,
            Pictures::ColorAndDepth => Picture::ColorAndDepth,
            Pictures::Segmentation => Picture::Segmentation,
        };
        let horizontal_field_of_view = self.field_of_view.unwrap_or(FIELD_OF_VIEW);
        CameraSensor { picture: picture.into(), width, height, horizontal_field_of_view, near, far }
    }
}

/// A camera in the list.
#[derive(Serialize)]
pub(super) struct LensView {
    /// As in `sensor add`.
    picture: &'static str,
    /// Pixels.
    width: u32,
    height: u32,
    /// Horizontal, rad.
    field_of_view: f64,
    /// Metres.
    clip: [f64; 2],
}

impl LensView {
    pub(super) fn new(of: &CameraSensor) -> Self {
        let picture = match of.picture() {
            Picture::Unspecified | Picture::Color => "color",
            Picture::Depth => "depth",
            Picture::ColorAndDepth => "color-and-depth",
            Picture::Segmentation => "segmentation",
        };
        let CameraSensor { picture: _, width, height, horizontal_field_of_view, near, far } = *of;
        Self { picture, width, height, field_of_view: horizontal_field_of_view, clip: [near, far] }
    }
}

/// Reads `WIDTHxHEIGHT`.
fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').map(|(width, height)| (width.parse().ok(), height.parse().ok()));
    match sides {
        Some((Some(width), Some(height))) => Ok([width, height]),
        _ => Err("must be WIDTHxHEIGHT".to_owned()),
    }
}

fn angle(text: &str) -> Result<f64, String> {
    match quantity::parse(text, quantity::Kind::Position)? {
        of if of.motion == Some(Motion::Slides) => Err(format!("`{text}` has the wrong unit")),
        of => Ok(of.value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_is_what_was_typed_and_else_the_usual_one() {
        let usual = Lens::default();
        assert_eq!(usual.given(), None);
        let CameraSensor { width, height, near, far, .. } = usual.camera();
        assert_eq!((width, height, near, far), (640, 480, 0.05, 100.0));
        let lens = Lens {
            size: Some(size("320x200").unwrap()),
            field_of_view: Some(angle("90deg").unwrap()),
            picture: Some(Pictures::Depth),
            ..usual
        };
        assert_eq!(lens.given(), Some("--size"));
        let camera = lens.camera();
        assert_eq!((camera.width, camera.height, camera.picture), (320, 200, Picture::Depth.into()));
        assert!((camera.horizontal_field_of_view - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert!(size("320").is_err() && size("x200").is_err() && angle("1m").is_err());
    }
}

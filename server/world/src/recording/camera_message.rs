//! Pictures of cameras as messages of ROS 2, for its graph and for recordings.

use bytes::Bytes;
use simd_ros2::messages::sensor_msgs::{CameraInfo, Image};
use simd_ros2::messages::std_msgs::Header;

/// From the axes of a camera's pictures, z forwards and x to the right, to those of its sensor, which has x forwards and z up: x, y,
/// z, w.
pub const SENSOR_FROM_OPTICAL: [f64; 4] = [-0.5, 0.5, -0.5, 0.5];

/// What the numbers of a picture's pixels are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageKind {
    /// Its topic, below that of the camera.
    pub topic: &'static str,
    /// As `sensor_msgs/image_encodings.hpp` calls it.
    pub(crate) encoding: &'static str,
    /// Of a pixel.
    pub(crate) bytes: u32,
}

impl ImageKind {
    /// Red, green and blue.
    pub const COLOR: Self = Self { topic: "image_raw", encoding: "rgb8", bytes: 3 };
    /// Metres along the optical axis.
    pub const DEPTH: Self = Self { topic: "depth/image_raw", encoding: "32FC1", bytes: 4 };
    /// Numbers of links.
    pub const SEGMENTATION: Self = Self { topic: "segmentation/image_raw", encoding: "32SC1", bytes: 4 };
    /// The topic of what maps points to pixels.
    pub const INFO_TOPIC: &'static str = "camera_info";

    /// Of a picture of so many pixels.
    pub fn size(self, width: u32, height: u32) -> u64 {
        u64::from(width) * u64::from(height) * u64::from(self.bytes)
    }

    /// The message of a plane, row by row from the upper left pixel.
    pub fn image(self, header: Header, width: u32, height: u32, data: &Bytes) -> Image {
        Image {
            header,
            height,
            width,
            encoding: self.encoding.to_owned(),
            is_bigendian: 0,
            step: width.saturating_mul(self.bytes),
            data: data.to_vec(),
        }
    }
}

/// Of a pinhole camera, by its focal lengths and where its axis is, pixels: nothing is distorted, and nothing turned.
pub fn camera_info(header: Header, width: u32, height: u32, [fx, fy, cx, cy]: [f64; 4]) -> CameraInfo {
    CameraInfo {
        header,
        height,
        width,
        distortion_model: "plumb_bob".to_owned(),
        d: vec![0.0; 5],
        k: [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        ..CameraInfo::default()
    }
}

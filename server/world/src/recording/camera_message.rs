//! Pictures of cameras as ROS 2 messages, for its graph and for recordings.

use bytes::Bytes;
use simd_ros2::messages::sensor_msgs::{CameraInfo, Image};
use simd_ros2::messages::std_msgs::Header;

/// Rotation from the optical axes (z forwards, x to the right) to the axes of the sensor (x forwards, z up):
/// x, y, z, w.
pub const SENSOR_FROM_OPTICAL: [f64; 4] = [-0.5, 0.5, -0.5, 0.5];

/// Meaning of a picture's pixel values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageKind {
    /// Topic, below the camera's.
    pub topic: &'static str,
    /// Name in `sensor_msgs/image_encodings.hpp`.
    pub(crate) encoding: &'static str,
    /// Bytes of a pixel.
    pub(crate) bytes: u32,
}

impl ImageKind {
    /// Red, green and blue.
    pub const COLOR: Self = Self { topic: "image_raw", encoding: "rgb8", bytes: 3 };
    /// Distance along the optical axis, metres.
    pub const DEPTH: Self = Self { topic: "depth/image_raw", encoding: "32FC1", bytes: 4 };
    /// Numbers of links.
    pub const SEGMENTATION: Self = Self { topic: "segmentation/image_raw", encoding: "32SC1", bytes: 4 };
    /// Topic of the parameters that map points to pixels.
    pub const INFO_TOPIC: &'static str = "camera_info";

    /// Returns the bytes of a picture with this size in pixels.
    pub fn size(self, width: u32, height: u32) -> u64 {
        u64::from(width) * u64::from(height) * u64::from(self.bytes)
    }

    /// Returns the message of a plane, row by row from the upper left pixel.
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

/// Returns the parameters of a pinhole camera from its focal lengths and optical centre, pixels: without
/// distortion and rectification.
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

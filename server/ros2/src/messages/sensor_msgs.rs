//! Readings of sensors.

use super::geometry_msgs::{Quaternion, Vector3};
use super::std_msgs::Header;
use crate::message::messages;

messages! {
    /// Joints by name. `position`, `velocity` and `effort` have a number for each joint, or are empty.
    JointState = "sensor_msgs/msg/JointState" {
        header: Header,
        name: Vec<String>,
        position: Vec<f64>,
        velocity: Vec<f64>,
        effort: Vec<f64>,
    }

    /// Reading of an inertial unit. A covariance of zeros is unknown.
    Imu = "sensor_msgs/msg/Imu" {
        header: Header,
        orientation: Quaternion,
        orientation_covariance: [f64; 9],
        angular_velocity: Vector3,
        angular_velocity_covariance: [f64; 9],
        linear_acceleration: Vector3,
        linear_acceleration_covariance: [f64; 9],
    }

    /// One range, metres (REP 117).
    Range = "sensor_msgs/msg/Range" consts {
        ULTRASOUND: u8 = 0;
        INFRARED: u8 = 1;
    } {
        header: Header,
        radiation_type: u8,
        field_of_view: f32,
        min_range: f32,
        max_range: f32,
        range: f32,
        variance: f32,
    }

    /// Ranges in a plane, about z from x, metres (REP 117).
    LaserScan = "sensor_msgs/msg/LaserScan" {
        header: Header,
        angle_min: f32,
        angle_max: f32,
        angle_increment: f32,
        time_increment: f32,
        scan_time: f32,
        range_min: f32,
        range_max: f32,
        ranges: Vec<f32>,
        intensities: Vec<f32>,
    }

    /// A picture, row by row from the upper left pixel.
    Image = "sensor_msgs/msg/Image" {
        header: Header,
        height: u32,
        width: u32,
        encoding: String,
        is_bigendian: u8,
        step: u32,
        data: Vec<u8>,
    }

    /// A part of a picture. All zeros mean the whole picture.
    RegionOfInterest = "sensor_msgs/msg/RegionOfInterest" {
        x_offset: u32,
        y_offset: u32,
        height: u32,
        width: u32,
        do_rectify: bool,
    }

    /// Calibration that maps points to pixels.
    CameraInfo = "sensor_msgs/msg/CameraInfo" {
        header: Header,
        height: u32,
        width: u32,
        distortion_model: String,
        d: Vec<f64>,
        k: [f64; 9],
        r: [f64; 9],
        p: [f64; 12],
        binning_x: u32,
        binning_y: u32,
        roi: RegionOfInterest,
    }

    /// A field in the bytes of a point.
    PointField = "sensor_msgs/msg/PointField" consts {
        INT8: u8 = 1;
        UINT8: u8 = 2;
        INT16: u8 = 3;
        UINT16: u8 = 4;
        INT32: u8 = 5;
        UINT32: u8 = 6;
        FLOAT32: u8 = 7;
        FLOAT64: u8 = 8;
    } {
        name: String,
        offset: u32,
        datatype: u8,
        count: u32,
    }

    /// Points, row by row.
    PointCloud2 = "sensor_msgs/msg/PointCloud2" {
        header: Header,
        height: u32,
        width: u32,
        fields: Vec<PointField>,
        is_bigendian: bool,
        point_step: u32,
        row_step: u32,
        data: Vec<u8>,
        is_dense: bool,
    }
}

//! Checks the numbers of sensors, from descriptions and from clients.

use std::ops::RangeInclusive;

use super::{
    Camera, ChannelNoise, Channels, MAX_CHANNEL_NOISE, MAX_SCAN_RAYS, Noise, RangeLimits, Scan, SensorKind,
    Sweep,
};

/// An invalid number of a sensor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BadSensor {
    /// Its path, such as `lidar.horizontal.samples`.
    pub field: String,
    /// The value.
    pub value: String,
    /// The valid range, as "it must be ...".
    pub expected: String,
}

impl BadSensor {
    fn new(field: impl Into<String>, value: impl ToString, expected: impl Into<String>) -> Self {
        Self { field: field.into(), value: value.to_string(), expected: expected.into() }
    }
}

/// Valid numbers of samples per second of sim time.
const RATE: RangeInclusive<f64> = 1e-6..=1e6;

/// Largest number of noise. Sums of such numbers and a growing walk stay finite; a saved state with infinite
/// ones could not be read again.
const MAX_NOISE: f64 = 1e12;

/// Maximum range of a ray or a camera, metres: squares of such numbers are computed.
const MAX_REACH: f64 = 1e12;

/// Minimum distance of a camera's near plane, metres. Pictures are drawn in single precision, which cannot
/// represent much smaller ones.
const MIN_NEAR: f64 = 1e-6;

/// Minimum field of view of a camera, rad, for the same reason.
const MIN_FIELD_OF_VIEW: f64 = 1e-6;

/// Maximum pixels along a side of a picture.
const MAX_PIXELS: u32 = 16_384;

/// Checks kind, rate and noise of a sensor.
///
/// # Errors
/// Returns the first invalid number.
pub fn check(kind: &SensorKind, rate: Option<f64>, noise: &[ChannelNoise]) -> Result<(), BadSensor> {
    if let Some(rate) = rate.filter(|rate| !RATE.contains(rate)) {
        let expected = format!("it must be between {} and {} samples a second", RATE.start(), RATE.end());
        return Err(BadSensor::new("rate", rate, expected));
    }
    match kind {
        SensorKind::Imu | SensorKind::ForceTorque { .. } | SensorKind::LinkState | SensorKind::Odometry => {}
        SensorKind::Contact { threshold } => size("contact.threshold", *threshold)?,
        SensorKind::Encoder { backlash } => size("encoder.backlash", *backlash)?,
        SensorKind::Range(range) => check_range("range", range)?,
        SensorKind::Lidar(scan) => check_scan(scan)?,
        SensorKind::Camera(camera) => check_camera(camera)?,
    }
    if noise.len() > MAX_CHANNEL_NOISE {
        let expected = format!("there may be at most {MAX_CHANNEL_NOISE} entries");
        return Err(BadSensor::new("noise", format!("{} entries long", noise.len()), expected));
    }
    noise.iter().enumerate().try_for_each(|(index, noise)| {
        check_noise(kind, noise)
            .map_err(|bad| BadSensor { field: format!("noise[{index}].{}", bad.field), ..bad })
    })
}

fn check_range(field: &str, RangeLimits { least, most }: &RangeLimits) -> Result<(), BadSensor> {
    size(&format!("{field}.min"), *least)?;
    reach(&format!("{field}.max"), *most, *least)
}

/// Checks the maximum range against the minimum.
fn reach(field: &str, most: f64, least: f64) -> Result<(), BadSensor> {
    if most > least && most <= MAX_REACH {
        return Ok(());
    }
    Err(BadSensor::new(field, most, format!("it must be more than {least} and at most {MAX_REACH:e}")))
}

fn check_scan(scan: &Scan) -> Result<(), BadSensor> {
    let turn = std::f64::consts::TAU;
    for (field, sweep, span) in
        [("lidar.horizontal", &scan.horizontal, turn), ("lidar.vertical", &scan.vertical, turn / 2.0)]
    {
        let Sweep { samples, least, most } = *sweep;
        if samples == 0 {
            return Err(BadSensor::new(format!("{field}.samples"), samples, "it must be at least 1"));
        }
        // Angles in files have few digits.
        let allowed = span * (1.0 + 1e-3);
        for (end, angle) in [("min", least), ("max", most)] {
            if angle.is_nan() || angle.abs() > allowed {
                let expected = format!("it must be an angle between {} and {span} rad", -span);
                return Err(BadSensor::new(format!("{field}.{end}"), angle, expected));
            }
        }
        if most < least || most - least > allowed {
            let expected = format!("it must be at least {least} rad, and at most {span} rad more");
            return Err(BadSensor::new(format!("{field}.max"), most, expected));
        }
    }
    if scan.rays() > MAX_SCAN_RAYS {
        let expected = format!("there may be at most {MAX_SCAN_RAYS} rays in a scan");
        return Err(BadSensor::new(
            "lidar.horizontal.samples",
            format!("{} rays with the vertical ones", scan.rays()),
            expected,
        ));
    }
    check_range("lidar.range", &scan.range)
}

fn check_camera(camera: &Camera) -> Result<(), BadSensor> {
    let Camera { picture: _, width, height, horizontal_field_of_view, near, far } = *camera;
    for (field, pixels) in [("camera.width", width), ("camera.height", height)] {
        if !(1..=MAX_PIXELS).contains(&pixels) {
            let expected = format!("it must be between 1 and {MAX_PIXELS} pixels");
            return Err(BadSensor::new(field, pixels, expected));
        }
    }
    if !(MIN_FIELD_OF_VIEW..std::f64::consts::PI).contains(&horizontal_field_of_view) {
        let expected = format!("it must be an angle between {MIN_FIELD_OF_VIEW:e} and 3.14 rad");
        return Err(BadSensor::new("camera.horizontal_field_of_view", horizontal_field_of_view, expected));
    }
    if !(MIN_NEAR..=MAX_REACH).contains(&near) {
        let expected = format!("it must be between {MIN_NEAR:e} and {MAX_REACH:e}");
        return Err(BadSensor::new("camera.near", near, expected));
    }
    reach("camera.far", far, near)
}

fn check_noise(
    kind: &SensorKind,
    ChannelNoise { channels, axis, noise }: &ChannelNoise,
) -> Result<(), BadSensor> {
    let Some((_, count)) = kind.channels().iter().find(|(of, _)| of == channels) else {
        let expected = format!("it must be a quantity that a sensor of the kind {} measures", kind.word());
        return Err(BadSensor::new("channel", channels.word(), expected));
    };
    if let Some(axis) = axis.filter(|axis| usize::from(*axis) >= *count) {
        return Err(BadSensor::new("axis", axis, format!("it must be below {count}")));
    }
    let Noise {
        standard_deviation,
        bias_mean,
        bias_standard_deviation,
        random_walk,
        correlation_time,
        quantum,
        dropout,
    } = *noise;
    noise_within("standard_deviation", standard_deviation, 0.0)?;
    noise_within("bias_mean", bias_mean, -MAX_NOISE)?;
    noise_within("bias_standard_deviation", bias_standard_deviation, 0.0)?;
    noise_within("random_walk", random_walk, 0.0)?;
    if let Some(seconds) = correlation_time.filter(|seconds| !(*seconds > 0.0 && seconds.is_finite())) {
        return Err(BadSensor::new("correlation_time", seconds, "it must be finite and above 0"));
    }
    noise_within("quantum", quantum, 0.0)?;
    if quantum > 0.0 && *channels == Channels::Orientation {
        return Err(BadSensor::new("quantum", quantum, "an orientation has none, so it must be 0"));
    }
    if !(0.0..=1.0).contains(&dropout) {
        return Err(BadSensor::new("dropout", dropout, "it must be between 0 and 1"));
    }
    Ok(())
}

fn noise_within(field: &str, value: f64, least: f64) -> Result<(), BadSensor> {
    if (least..=MAX_NOISE).contains(&value) {
        return Ok(());
    }
    let least = if least == 0.0 { "0".to_owned() } else { format!("{least:e}") };
    Err(BadSensor::new(field, value, format!("it must be between {least} and {MAX_NOISE:e}")))
}

fn size(field: &str, value: f64) -> Result<(), BadSensor> {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    Err(BadSensor::new(field, value, "it must be finite and at least 0"))
}

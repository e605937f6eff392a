//! Noise of a `<sensor>`, as in SDFormat: for each axis, and in old files for all of them.

use roxmltree::Node;

use super::{at, number};
use crate::report::Disposition::Ignored;
use crate::sensor::{ChannelNoise, Channels, Noise, SensorKind};
use crate::urdf::findings::{Findings, quoted};

const AXES: [&str; 3] = ["x", "y", "z"];

/// Reads the noise of all channels. Channels without noise are left out.
pub(super) fn read(
    node: Node,
    kind: &SensorKind,
    findings: &mut Findings,
) -> Result<Vec<ChannelNoise>, String> {
    let mut read = Vec::new();
    let mut add = |holder: Option<Node>, channels: Channels, axis: Option<u8>| -> Result<(), String> {
        let Some(noise) = holder.map(|holder| noise(holder, findings)).transpose()? else { return Ok(()) };
        if noise != Noise::default() {
            read.push(ChannelNoise { channels, axis, noise });
        }
        Ok(())
    };
    // Applies to all three axes if it is in the quantity itself.
    let mut axes = |quantity: Option<Node>, channels: Channels| -> Result<(), String> {
        add(quantity.and_then(|node| at(node, &["noise"])), channels, None)?;
        for (axis, tag) in (0..).zip(AXES) {
            add(quantity.and_then(|node| at(node, &[tag, "noise"])), channels, Some(axis))?;
        }
        Ok(())
    };
    match kind {
        SensorKind::Imu => {
            axes(at(node, &["imu", "angular_velocity"]), Channels::AngularVelocity)?;
            axes(at(node, &["imu", "linear_acceleration"]), Channels::LinearAcceleration)?;
            // Before SDFormat 1.5.
            add(at(node, &["imu", "noise", "rate"]), Channels::AngularVelocity, None)?;
            add(at(node, &["imu", "noise", "accel"]), Channels::LinearAcceleration, None)?;
        }
        SensorKind::ForceTorque { .. } => {
            axes(at(node, &["force_torque", "force"]), Channels::Force)?;
            axes(at(node, &["force_torque", "torque"]), Channels::Torque)?;
        }
        SensorKind::Range(_) | SensorKind::Lidar(_) => {
            let ray = at(node, &["ray"]).or_else(|| at(node, &["lidar"]));
            let holder = ray.and_then(|ray| at(ray, &["noise"])).or_else(|| at(node, &["noise"]));
            add(holder, Channels::Range, None)?;
        }
        SensorKind::Contact { .. } => add(at(node, &["noise"]), Channels::Force, None)?,
        SensorKind::Encoder { .. } => {
            add(at(node, &["position", "noise"]), Channels::JointPosition, None)?;
            add(at(node, &["velocity", "noise"]), Channels::JointVelocity, None)?;
            if let Some(resolution) = number(node, "resolution")?.filter(|resolution| *resolution != 0.0) {
                resolve(&mut read, resolution);
            }
        }
        SensorKind::LinkState | SensorKind::Odometry => {
            for (tag, channels) in [
                ("position", Channels::Position),
                ("orientation", Channels::Orientation),
                ("linear_velocity", Channels::LinearVelocity),
                ("angular_velocity", Channels::AngularVelocity),
            ] {
                axes(at(node, &[tag]), channels)?;
            }
        }
        SensorKind::Camera(_) => {}
    }
    Ok(read)
}

/// Sets the resolution: an encoder counts in whole steps.
fn resolve(read: &mut Vec<ChannelNoise>, resolution: f64) {
    let channels = Channels::JointPosition;
    match read.iter_mut().find(|noise| noise.channels == channels) {
        Some(known) => known.noise.quantum = resolution,
        None => {
            let noise = Noise { quantum: resolution, ..Noise::default() };
            read.push(ChannelNoise { channels, axis: None, noise });
        }
    }
}

/// Reads a `<noise>`. Its mean is a part of the bias.
fn noise(node: Node, findings: &mut Findings) -> Result<Noise, String> {
    let text = |node: Node| node.text().map(str::trim).filter(|text| !text.is_empty()).map(str::to_owned);
    let own = node.attribute("type").map(|word| word.trim().to_owned());
    // In old files, `<rate>` and `<accel>` have it beside them.
    let beside = node.parent().and_then(|parent| at(parent, &["type"])).and_then(text);
    let word =
        own.or_else(|| at(node, &["type"]).and_then(text)).or(beside).unwrap_or_else(|| "none".to_owned());
    let of = |tag: &str| Ok::<f64, String>(number(node, tag)?.unwrap_or(0.0));
    match word.as_str() {
        "none" => return Ok(Noise { dropout: of("dropout")?, ..Noise::default() }),
        "gaussian" | "gaussian_quantized" => {}
        other => {
            let message = format!("{} is not one of: none, gaussian, gaussian_quantized", quoted(other));
            findings.warn(node, Ignored, message);
            return Ok(Noise::default());
        }
    }
    let (walk, time) = (of("dynamic_bias_stddev")?, number(node, "dynamic_bias_correlation_time")?);
    // As in Gazebo, both must be above 0; without a time it is an unbounded walk.
    let correlation_time = time.filter(|time| *time > 0.0);
    Ok(Noise {
        standard_deviation: of("stddev")?,
        bias_mean: of("mean")? + of("bias_mean")?,
        bias_standard_deviation: of("bias_stddev")?,
        random_walk: if time.is_none() || correlation_time.is_some() { walk } else { 0.0 },
        correlation_time,
        quantum: of("precision")?,
        dropout: of("dropout")?,
    })
}

//! Kind of a `<sensor>`, by its type.

use roxmltree::Node;

use super::{at, note, number};
use crate::report::Disposition::Ignored;
use crate::sensor::{Camera, Picture, RangeLimits, Scan, SensorKind, Sweep, WrenchAxes, WrenchDirection};
use crate::urdf::findings::{Findings, quoted};
use crate::urdf::prescan::is;
use crate::urdf::unknown::nearest;

/// Supported types.
const TYPES: [&str; 24] = [
    "imu",
    "accelerometer",
    "gyroscope",
    "force_torque",
    "contact",
    "ray",
    "gpu_ray",
    "lidar",
    "gpu_lidar",
    "sonar",
    "link_state",
    "encoder",
    "odometry",
    "camera",
    "multicamera",
    "wideanglecamera",
    "wide_angle_camera",
    "depth",
    "depth_camera",
    "rgbd",
    "rgbd_camera",
    "segmentation",
    "segmentation_camera",
    "range",
];

/// Returns whether a sensor's type is supported, or a misspelling of a supported one.
pub(super) fn is_known(node: Node) -> bool {
    let word = node.attribute("type").unwrap_or_default().trim();
    nearest(word, TYPES.into_iter()).is_some()
}

/// Range of a laser without a limit, m: larger than rooms and halls.
const FAR: f64 = 1e4;

/// Returns whether it is a stereo camera or similar, as in Gazebo: each of its cameras becomes a sensor.
pub(super) fn has_several_cameras(node: Node) -> bool {
    node.attribute("type").map(str::trim) == Some("multicamera")
}

/// Returns the cameras of a sensor, each of which becomes one; a single `None` if none is described, and for
/// other types.
pub(super) fn cameras<'a, 'i>(node: Node<'a, 'i>) -> Vec<Option<Node<'a, 'i>>> {
    let most = if has_several_cameras(node) { usize::MAX } else { 1 };
    let mut found: Vec<_> =
        node.children().filter(|child| is(*child, "camera")).take(most).map(Some).collect();
    if found.is_empty() {
        found.push(None);
    }
    found
}

/// Reads the kind of a sensor; for a sensor with cameras, of this one.
pub(super) fn read(
    node: Node,
    its_camera: Option<Node>,
    findings: &mut Findings,
) -> Result<SensorKind, String> {
    // In URDF's proposal, the content of a sensor is its type.
    let held = ["camera", "ray"].into_iter().find(|tag| at(node, &[*tag]).is_some());
    let word = node.attribute("type").or(held).unwrap_or_default().trim();
    Ok(match word {
        "imu" | "accelerometer" | "gyroscope" => {
            if let Some(frame) = at(node, &["imu", "orientation_reference_frame"]) {
                findings.info(frame, Ignored, "not read by simd: orientations are relative to the world");
            }
            SensorKind::Imu
        }
        "force_torque" => force_torque(node)?,
        "contact" => {
            if at(node, &["contact", "collision"]).is_some() {
                note(node, findings, "all collision shapes of its link count, not only those that it names");
            }
            SensorKind::Contact { threshold: number(node, "threshold")?.unwrap_or(0.0) }
        }
        "ray" | "gpu_ray" | "lidar" | "gpu_lidar" | "range" => scan(node, findings)?,
        "sonar" => {
            note(node, findings, "one ray along x replaces its cone");
            let said = at(node, &["sonar"]);
            let of = |tag, default| -> Result<f64, String> {
                Ok(said.map(|node| number(node, tag)).transpose()?.flatten().unwrap_or(default))
            };
            SensorKind::Range(limits(of("min", 0.0)?, of("max", FAR)?))
        }
        "link_state" => SensorKind::LinkState,
        "encoder" => SensorKind::Encoder { backlash: number(node, "backlash")?.unwrap_or(0.0) },
        "odometry" => SensorKind::Odometry,
        "camera" | "multicamera" | "wideanglecamera" | "wide_angle_camera" => {
            camera(its_camera, Picture::Color)?
        }
        "depth" | "depth_camera" => camera(its_camera, Picture::Depth)?,
        "rgbd" | "rgbd_camera" => camera(its_camera, Picture::ColorAndDepth)?,
        "segmentation" | "segmentation_camera" => camera(its_camera, Picture::Segmentation)?,
        other => {
            let meant = nearest(other, TYPES.into_iter());
            let meant = meant.map(|meant| format!("; did you mean {meant}?")).unwrap_or_default();
            return Err(format!("simd has no sensor of the type {}{meant}", quoted(other)));
        }
    })
}

fn force_torque(node: Node) -> Result<SensorKind, String> {
    let said = |tag: &str| {
        let text = at(node, &["force_torque", tag]).and_then(|child| child.text()).map(str::trim);
        text.filter(|text| !text.is_empty())
    };
    let axes = match said("frame") {
        None | Some("child") => WrenchAxes::Child,
        Some("parent") => WrenchAxes::Parent,
        Some("sensor") => WrenchAxes::Sensor,
        Some(other) => {
            return Err(format!("its frame {} is not one of child, parent, sensor", quoted(other)));
        }
    };
    let direction = match said("measure_direction") {
        None | Some("child_to_parent") => WrenchDirection::ChildOnParent,
        Some("parent_to_child") => WrenchDirection::ParentOnChild,
        Some(other) => {
            let known = "child_to_parent, parent_to_child";
            return Err(format!("its measure_direction {} is not one of {known}", quoted(other)));
        }
    };
    Ok(SensorKind::ForceTorque { axes, direction })
}

/// Reads a lidar, or a range finder if it has one ray, along x.
fn scan(node: Node, findings: &mut Findings) -> Result<SensorKind, String> {
    // Without either, the sensor is one ray.
    let said = at(node, &["ray"]).or_else(|| at(node, &["lidar"])).unwrap_or(node);
    let mut sweep = |tag: &str| -> Result<Sweep, String> {
        let found = at(said, &["scan", tag]).or_else(|| at(said, &[tag]));
        let Some(found) = found else { return Ok(Sweep::one(0.0)) };
        if number(found, "resolution")?.is_some_and(|resolution| resolution != 1.0) {
            findings.info(found, Ignored, "its resolution is not read: there are as many ranges as samples");
        }
        let samples = number(found, "samples")?.unwrap_or(1.0);
        if !(samples.fract() == 0.0 && (1.0..=1e9).contains(&samples)) {
            return Err(format!("its {tag} scan has {samples} samples"));
        }
        let (least, most) =
            (number(found, "min_angle")?.unwrap_or(0.0), number(found, "max_angle")?.unwrap_or(0.0));
        Ok(Sweep { samples: samples as u32, least, most })
    };
    let (horizontal, vertical) = (sweep("horizontal")?, sweep("vertical")?);
    let range = at(said, &["range"]);
    let of = |tag, default| -> Result<f64, String> {
        Ok(range.map(|node| number(node, tag)).transpose()?.flatten().unwrap_or(default))
    };
    let range = limits(of("min", 0.0)?, of("max", FAR)?);
    let is_one_ahead = |sweep: &Sweep| sweep.samples == 1 && sweep.least == 0.0;
    if is_one_ahead(&horizontal) && is_one_ahead(&vertical) {
        return Ok(SensorKind::Range(range));
    }
    let rolling = at(said, &["rolling"]).and_then(|child| child.text()).map(str::trim);
    let rolling = match rolling {
        None | Some("" | "false" | "0") => false,
        Some("true" | "1") => true,
        Some(other) => return Err(format!("its rolling is {}, and neither true nor false", quoted(other))),
    };
    Ok(SensorKind::Lidar(Scan { horizontal, vertical, range, rolling }))
}

/// Returns the limits, with infinity replaced by a large range.
fn limits(least: f64, most: f64) -> RangeLimits {
    RangeLimits { least, most: if most == f64::INFINITY { FAR } else { most } }
}

fn camera(said: Option<Node>, picture: Picture) -> Result<SensorKind, String> {
    let of = |path: &[&str], default: f64| -> Result<f64, String> {
        let Some((tag, path)) = path.split_last() else { return Ok(default) };
        let holder = said.and_then(|camera| at(camera, path));
        Ok(holder.map(|node| number(node, tag)).transpose()?.flatten().unwrap_or(default))
    };
    let pixels = |value: f64| if value.fract() == 0.0 && value > 0.0 { value as u32 } else { 0 };
    // In URDF's proposal, its picture has them as attributes.
    let either = |of_sdf: &[&str], of_urdf: &str, default| of(of_sdf, of(&["image", of_urdf], default)?);
    // SDFormat's defaults.
    Ok(SensorKind::Camera(Camera {
        picture,
        width: pixels(of(&["image", "width"], 320.0)?),
        height: pixels(of(&["image", "height"], 240.0)?),
        horizontal_field_of_view: either(&["horizontal_fov"], "hfov", 1.047)?,
        near: either(&["clip", "near"], "near", 0.1)?,
        far: either(&["clip", "far"], "far", 100.0)?,
    }))
}

//! Reports the parts of a `<sensor>` that are not read.

use std::collections::BTreeSet;

use roxmltree::Node;

use crate::report::Disposition::Ignored;
use crate::sensor::SensorKind;
use crate::urdf::findings::Findings;
use crate::urdf::prescan::is;

/// Elements of any sensor that are read, or that do not affect its readings.
const OF_ANY: [&str; 17] = [
    "always_on",
    "update_rate",
    "visualize",
    "topic",
    "pose",
    "enable_metrics",
    "frame_id",
    "gz_frame_id",
    "ignition_frame_id",
    "optical_frame_id",
    "parent",
    "origin",
    // An extension of simd.
    "seed",
    // Reported separately.
    "plugin",
    "engine_name",
    "update",
    "gazebo",
];

/// Maximum number of names for one sensor.
const MAX_NAMES: usize = 8;

/// An element of a kind, with its known children; empty if another module checks all of it.
type Part = (&'static str, &'static [&'static str]);

const RAY: &[&str] = &["scan", "horizontal", "vertical", "range", "noise", "rolling"];

fn parts(kind: &SensorKind) -> &'static [Part] {
    match kind {
        SensorKind::Imu => &[(
            "imu",
            &["angular_velocity", "linear_acceleration", "noise", "orientation_reference_frame", "topic"],
        )],
        SensorKind::ForceTorque { .. } => {
            &[("force_torque", &["frame", "measure_direction", "force", "torque"])]
        }
        SensorKind::Contact { .. } => {
            &[("contact", &["collision", "topic"]), ("threshold", &[]), ("noise", &[])]
        }
        // A sensor of the type `range` may contain them itself.
        SensorKind::Range(_) | SensorKind::Lidar(_) => &[
            ("ray", RAY),
            ("lidar", RAY),
            ("sonar", &["min", "max", "radius", "geometry"]),
            ("scan", &[]),
            ("horizontal", &[]),
            ("vertical", &[]),
            ("range", &[]),
            ("rolling", &[]),
            ("noise", &[]),
        ],
        SensorKind::LinkState | SensorKind::Odometry => {
            &[("position", &[]), ("orientation", &[]), ("linear_velocity", &[]), ("angular_velocity", &[])]
        }
        SensorKind::Encoder { .. } => {
            &[("position", &[]), ("velocity", &[]), ("resolution", &[]), ("backlash", &[])]
        }
        SensorKind::Camera(_) => &[("camera", &["horizontal_fov", "image", "clip", "pose"])],
    }
}

/// Reports the unread parts of a sensor of a kind.
pub(super) fn report(node: Node, kind: &SensorKind, findings: &mut Findings) {
    let parts = parts(kind);
    let mut names: BTreeSet<String> = BTreeSet::new();
    for child in node.children().filter(Node::is_element) {
        let tag = child.tag_name().name();
        match parts.iter().find(|(part, _)| *part == tag) {
            None if OF_ANY.contains(&tag) => {}
            None => drop(names.insert(tag.to_owned())),
            Some((_, [])) => {}
            Some((_, known)) => {
                let inner = child.children().filter(Node::is_element).map(|inner| inner.tag_name().name());
                names.extend(
                    inner.filter(|inner| !known.contains(inner)).map(|inner| format!("{tag}/{inner}")),
                );
            }
        }
    }
    if !names.is_empty() {
        let names: Vec<String> = names.into_iter().take(MAX_NAMES).collect();
        findings.info(node, Ignored, format!("not read by simd: {}", names.join(", ")));
    }
    if let Some(plugin) = node.children().find(|child| is(*child, "plugin")) {
        findings.info(plugin, Ignored, "not read by simd: it is for Gazebo");
    }
}

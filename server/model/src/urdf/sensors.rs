//! `<sensor>`: sensors of the robot, as in SDFormat.
//!
//! It is in the `<gazebo reference>` of a link or of a joint, as in files for Gazebo. Or it is in the robot
//! with a `<parent link>` or `<parent joint>` and an `<origin>`, as in URDF's proposal for sensors. Beside
//! SDFormat's types, simd has `link_state`, `encoder` and `odometry`.

mod kinds;
mod noise;
mod unread;

use std::collections::{BTreeMap, BTreeSet};

use glamx::{DPose3, DQuat, DVec3};
use roxmltree::Node;

use super::findings::{Findings, quoted};
use super::geometry::rotation;
use super::numbers::{self, Shape};
use super::prescan::is;
use super::unknown::nearest;
use crate::report::Disposition::{Ignored, Used};
use crate::report::short;
use crate::robot::{Joint, JointKind, Link};
use crate::sensor::{self, MAX_SENSOR_NAME, MAX_SENSORS_PER_ROBOT, Sensor, SensorKind, SensorMount};
use crate::{first_bytes, wire_name};

/// Links and joints by name.
struct Names<'m> {
    links: BTreeMap<&'m str, usize>,
    joints: BTreeMap<&'m str, usize>,
}

/// Reads all sensors, in the order of the file.
pub(super) fn read(root: Node, (links, joints): (&[Link], &[Joint]), findings: &mut Findings) -> Vec<Sensor> {
    let holds_some = |node: &Node| is(*node, "sensor") || is(*node, "gazebo");
    let elements = root.children().filter(holds_some).flat_map(|node| {
        let own = is(node, "sensor").then_some((node, None));
        let reference = node.attribute("reference").map(str::trim);
        let inner = node.children().filter(move |child| own.is_none() && is(*child, "sensor"));
        own.into_iter().chain(inner.map(move |child| (child, reference)))
    });
    let mut elements = elements.peekable();
    if elements.peek().is_none() {
        return Vec::new();
    }
    let names = Names {
        links: links.iter().enumerate().map(|(index, link)| (link.name.as_str(), index)).collect(),
        joints: joints.iter().enumerate().map(|(index, joint)| (joint.name.as_str(), index)).collect(),
    };
    let mut read: Vec<Sensor> = Vec::new();
    let mut taken: BTreeSet<String> = BTreeSet::new();
    for (node, reference) in elements {
        for camera in kinds::cameras(node) {
            if read.len() >= MAX_SENSORS_PER_ROBOT {
                let message = format!("there are more than {MAX_SENSORS_PER_ROBOT} sensors: left out");
                findings.warn(node, Ignored, message);
                return read;
            }
            match sensor(node, camera, reference, &names, joints, findings) {
                Ok(sensor) => {
                    let name = free_name(&asked_name(node, camera, &sensor.kind), &mut taken);
                    findings.used(node, || said(&name, &sensor, (links, joints)));
                    if matches!(sensor.kind, SensorKind::Camera(_)) {
                        note(node, findings, "a renderer draws its pictures, such as `simd-camera`");
                    }
                    read.push(Sensor { name, ..sensor });
                }
                Err(why) if kinds::is_known(node) => findings.warn(node, Ignored, format!("{why}: left out")),
                Err(why) => findings.info(node, Ignored, format!("not read by simd: {why}")),
            }
        }
    }
    read
}

/// Reads a sensor without its name, or returns its fault. For a sensor with cameras, reads this one.
fn sensor(
    node: Node,
    camera: Option<Node>,
    reference: Option<&str>,
    names: &Names,
    joints: &[Joint],
    findings: &mut Findings,
) -> Result<Sensor, String> {
    let kind = kinds::read(node, camera, findings)?;
    let on = match merged_link(node, &kind, names, findings) {
        Some(link) => SensorMount::Link(link),
        None => mount(node, reference, &kind, names, joints)?,
    };
    let rate = number(node, "update_rate")?.filter(|rate| *rate > 0.0);
    let sensor_from_camera = camera.map(|camera| pose(camera, findings)).transpose()?;
    let pose = pose(node, findings)? * sensor_from_camera.unwrap_or(DPose3::IDENTITY);
    let noise = noise::read(node, &kind, findings)?;
    sensor::check(&kind, rate, &noise)
        .map_err(|bad| format!("its {} is {}; {}", bad.field, bad.value, bad.expected))?;
    unread::report(node, &kind, findings);
    Ok(Sensor { name: String::new(), on, pose, rate, kind, noise, seed: seed(node)? })
}

/// Returns the number of a `<seed>`, which is simd's own.
fn seed(node: Node) -> Result<u64, String> {
    let text = at(node, &["seed"]).and_then(|child| child.text()).or_else(|| node.attribute("seed"));
    match text.map(str::trim) {
        None | Some("") => Ok(0),
        Some(text) => {
            text.parse().map_err(|_| format!("its seed {} is not a whole number of at least 0", quoted(text)))
        }
    }
}

/// Returns the place of a sensor: the object that its `<gazebo>` or its `<parent>` names.
fn mount(
    node: Node,
    reference: Option<&str>,
    kind: &SensorKind,
    names: &Names,
    joints: &[Joint],
) -> Result<SensorMount, String> {
    let parent = node.children().find(|child| is(*child, "parent"));
    let of = |name| parent.and_then(|parent| parent.attribute(name)).map(str::trim);
    let (link, joint) = match reference {
        // If a link and a joint have the same name, a sensor of joints means the joint.
        Some(name) => {
            let (link, joint) = (names.links.get(name), names.joints.get(name));
            match (link.copied(), joint.copied()) {
                (None, None) => return Err(not_there(name, names)),
                found => found,
            }
        }
        None => match (of("link"), of("joint")) {
            (Some(name), _) => (Some(*names.links.get(name).ok_or_else(|| not_there(name, names))?), None),
            (None, Some(name)) => {
                (None, Some(*names.joints.get(name).ok_or_else(|| not_there(name, names))?))
            }
            (None, None) => return Err("it has no parent, which names its link or its joint".to_owned()),
        },
    };
    // Each joint is followed by its link.
    let on_joint = joint.or_else(|| link.and_then(|link| link.checked_sub(1)));
    match (kind, kind.is_of_joint()) {
        (_, false) => {
            let link = link.or(joint.map(|joint| joint + 1));
            link.map(SensorMount::Link).ok_or_else(|| "it is on nothing".to_owned())
        }
        (SensorKind::Encoder { .. }, true) => {
            let joint = on_joint.ok_or("its link hangs on no joint")?;
            let one_axis = [JointKind::Revolute, JointKind::Continuous, JointKind::Prismatic];
            if joints.get(joint).is_some_and(|joint| one_axis.contains(&joint.kind)) {
                return Ok(SensorMount::Joint(joint));
            }
            Err("an encoder is of a joint that turns or slides about one axis".to_owned())
        }
        (_, true) => on_joint.map(SensorMount::Joint).ok_or_else(|| "its link hangs on no joint".to_owned()),
    }
}

/// Returns the link whose shape a contact sensor names, if Gazebo would have merged that shape into the
/// sensor's link. Gazebo merges links that fixed joints connect. It names the shapes of a link `foot` on a
/// `shin` `shin_fixed_joint_lump__foot_collision`, and further ones with a number.
fn merged_link(node: Node, kind: &SensorKind, names: &Names, findings: &mut Findings) -> Option<usize> {
    let SensorKind::Contact { .. } = kind else { return None };
    let shape = at(node, &["contact", "collision"])?.text()?.trim();
    let (_, own) = shape.rsplit_once("_fixed_joint_lump__")?;
    let unnumbered = own.trim_end_matches(|digit: char| digit.is_ascii_digit()).trim_end_matches('_');
    let name = unnumbered.strip_suffix("_collision").or(own.strip_suffix("_collision"))?;
    let link = *names.links.get(name)?;
    let message =
        format!("Gazebo would merge link {} into another: the sensor is of that link", quoted(name));
    note(node, findings, &message);
    Some(link)
}

fn not_there(name: &str, names: &Names) -> String {
    let known = names.links.keys().chain(names.joints.keys()).copied();
    let meant = nearest(name, known).map(|meant| format!("; did you mean {}?", quoted(meant)));
    format!("{} is not a link or joint of this robot{}", quoted(name), meant.unwrap_or_default())
}

/// Returns the pose of a `<pose>`, or of an `<origin>`.
fn pose(node: Node, findings: &mut Findings) -> Result<DPose3, String> {
    if let Some(said) = node.children().find(|child| is(*child, "pose")) {
        let frame = said.attribute("relative_to").or_else(|| said.attribute("frame")).map(str::trim);
        if let Some(frame) = frame.filter(|frame| !frame.is_empty()) {
            let message = format!(
                "a pose is in the frame of the sensor's link or joint: {} is not read",
                quoted(frame)
            );
            findings.warn(said, Ignored, message);
        }
        let text = said.text().unwrap_or_default();
        if text.trim().is_empty() {
            return Ok(DPose3::IDENTITY);
        }
        if said.attribute("rotation_format").map(str::trim) == Some("quat_xyzw") {
            let [x, y, z, i, j, k, w] = values(text, "its pose")?;
            return turned(DVec3::new(x, y, z), DQuat::from_xyzw(i, j, k, w), "its pose");
        }
        let [x, y, z, roll, pitch, yaw] = values(text, "its pose")?;
        let is_degrees = matches!(said.attribute("degrees").map(str::trim), Some("true" | "1"));
        let angles = [roll, pitch, yaw].map(|angle: f64| if is_degrees { angle.to_radians() } else { angle });
        return Ok(DPose3::from_parts(DVec3::new(x, y, z), rotation(angles)));
    }
    let Some(origin) = node.children().find(|child| is(*child, "origin")) else {
        return Ok(DPose3::IDENTITY);
    };
    let of = |name: &str| origin.attribute(name).filter(|text| !text.trim().is_empty());
    let translation =
        of("xyz").map(|text| values(text, "xyz")).transpose()?.map_or(DVec3::ZERO, DVec3::from_array);
    match (of("quat_xyzw"), of("rpy")) {
        (Some(text), _) => {
            turned(translation, DQuat::from_array(values(text, "quat_xyzw")?), "its quat_xyzw")
        }
        (None, Some(text)) => Ok(DPose3::from_parts(translation, rotation(values(text, "rpy")?))),
        (None, None) => Ok(DPose3::from_translation(translation)),
    }
}

fn turned(translation: DVec3, quaternion: DQuat, what: &str) -> Result<DPose3, String> {
    if !(quaternion.length() > 1e-6 && quaternion.length().is_finite()) {
        return Err(format!("{what} has a quaternion that is 0"));
    }
    Ok(DPose3::from_parts(translation, quaternion.normalize()))
}

/// Returns the name in the file, with the camera's name if the sensor has several.
fn asked_name(node: Node, camera: Option<Node>, kind: &SensorKind) -> String {
    let said =
        |node: Node| node.attribute("name").map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned);
    let name = said(node).unwrap_or_else(|| kind.word().to_owned());
    match camera.filter(|_| kinds::has_several_cameras(node)) {
        Some(camera) => format!("{name}_{}", said(camera).unwrap_or_else(|| "camera".to_owned())),
        None => name,
    }
}

/// Returns the name as the wire allows it, unique within the robot.
fn free_name(asked: &str, taken: &mut BTreeSet<String>) -> String {
    /// Leaves room for a number.
    const LONGEST: usize = MAX_SENSOR_NAME - 8;
    let name = wire_name(asked);
    let name = first_bytes(&name, LONGEST).to_owned();
    if taken.insert(name.clone()) {
        return name;
    }
    let mut number = 2;
    loop {
        let candidate = format!("{name}_{number}");
        if taken.insert(candidate.clone()) {
            return candidate;
        }
        number += 1;
    }
}

/// Returns the report's sentence about a used sensor.
fn said(name: &str, sensor: &Sensor, (links, joints): (&[Link], &[Joint])) -> String {
    let rate = sensor.rate.map_or_else(|| "each step".to_owned(), |rate| format!("at {} Hz", short(rate)));
    let on = match sensor.on {
        SensorMount::Link(link) => links.get(link).map(|link| format!("link {}", quoted(&link.name))),
        SensorMount::Joint(joint) => joints.get(joint).map(|joint| format!("joint {}", quoted(&joint.name))),
    };
    let noise = if sensor.noise.is_empty() { "" } else { ", with noise" };
    format!("sensor {}: {} of {}, {rate}{noise}", quoted(name), sensor.kind.word(), on.unwrap_or_default())
}

/// Returns the element at the end of a path.
fn at<'a, 'i>(node: Node<'a, 'i>, path: &[&str]) -> Option<Node<'a, 'i>> {
    path.iter().try_fold(node, |node, tag| node.children().find(|child| is(*child, tag)))
}

/// Returns the number in a child, or in an attribute as in URDF's proposal.
fn number(node: Node, tag: &str) -> Result<Option<f64>, String> {
    let text = at(node, &[tag]).and_then(|child| child.text()).or_else(|| node.attribute(tag));
    let text = text.unwrap_or_default();
    if text.trim().is_empty() {
        return Ok(None);
    }
    // Files write "inf" for no limit.
    let read = numbers::read(text, Shape::Bound).map_err(|why| format!("its {tag} {why}"))?;
    Ok(read.values.first().copied())
}

fn values<const N: usize>(text: &str, what: &str) -> Result<[f64; N], String> {
    let read = numbers::read(text, Shape::Exactly(N)).map_err(|why| format!("{what} {why}"))?;
    read.values.try_into().map_err(|_count| format!("{what} has a wrong number of values"))
}

/// Adds a finding for a meaning that the author may not expect.
fn note(node: Node, findings: &mut Findings, message: &str) {
    findings.info(node, Used, message);
}

//! `<sensor>`: converts MuJoCo's sensors to SDFormat's. Elements that measure at one pose become one sensor.

use std::collections::BTreeMap;

use glamx::{DPose3, DQuat, DVec3};

use super::Reader;
use crate::report::Disposition::{Ignored, Used};
use crate::translation::draft::{Draft, DraftSensor};
use crate::translation::element::Element;
use crate::translation::notes::Notes;
use crate::urdf::findings::quoted;

/// Maximum number of sensors in a file.
const MAX_SENSORS: usize = 4096;

/// Place of a sensor.
enum Mount {
    /// A body, by its name.
    Body(String),
    /// The joint above a body, by the body's name.
    Above(String),
    /// A joint, by its name.
    Joint(String),
}

/// A sensor before its robot is known.
pub(super) struct Measured {
    mount: Mount,
    sensor: DraftSensor,
}

/// Reads all sensors.
pub(super) fn read<'a>(elements: &[Element<'a>], reader: &mut Reader<'a>) -> Vec<Measured> {
    let mut measured: Vec<Measured> = Vec::new();
    // Index in the list, by kind and place.
    let mut known: BTreeMap<(&'static str, &str, &str), usize> = BTreeMap::new();
    for element in elements.iter().copied() {
        if measured.len() >= MAX_SENSORS {
            reader.notes.warn(
                element,
                Ignored,
                format!("there are more than {MAX_SENSORS} sensors: left out"),
            );
            break;
        }
        let Some(Target { kind, object, name: target }) = target(element, &mut reader.notes) else {
            continue;
        };
        if let Some(first) = known.get(&(kind, object, target)).and_then(|index| measured.get(*index)) {
            let message = format!("it is a part of sensor {}", quoted(&first.sensor.name));
            reader.notes.info(element, Used, message);
            continue;
        }
        let Some((mount, pose)) = placed(kind, object, target, reader) else {
            let message = format!("{} does not exist: left out", quoted(target));
            reader.notes.warn(element, Ignored, message);
            continue;
        };
        let at = (element.file, element.line());
        let mut lines = Vec::new();
        // Period, and a phase that is ignored.
        let interval = element.word("interval").and_then(|word| word.split_whitespace().next());
        let period = interval.and_then(|word| word.parse::<f64>().ok());
        if let Some(period) = period.filter(|period| (1e-6..1e6).contains(period)) {
            lines.push((at, 0, format!("<update_rate>{}</update_rate>", 1.0 / period)));
        }
        if element.word("delay").is_some_and(|word| word.parse() != Ok(0.0)) {
            reader.notes.info(element, Ignored, "delay is not read: readings have the stamp of their state");
        }
        match kind {
            "force_torque" => lines.push((at, 0, FORCE_TORQUE.to_owned())),
            "range" => {
                let cutoff = element.word("cutoff").and_then(|word| word.parse::<f64>().ok()).unwrap_or(0.0);
                if cutoff > 0.0 && cutoff.is_finite() {
                    lines.push((at, 0, format!("<ray><range><max>{cutoff}</max></range></ray>")));
                }
            }
            "contact" if object == "site" => {
                let message = "it measures all contacts of the body, not only those within the site";
                reader.notes.info(element, Used, message);
            }
            _ => {}
        }
        let name = element.word("name").map_or_else(|| format!("{}_{target}", element.tag()), str::to_owned);
        known.insert((kind, object, target), measured.len());
        let sensor = DraftSensor { name, at, kind: kind.to_owned(), pose, lines };
        measured.push(Measured { mount, sensor });
    }
    measured
}

/// MuJoCo's convention, in the axes of the site: the force of the parent on the child (`cfrc_int`). Its
/// reference claims that the force points from the child to the parent.
const FORCE_TORQUE: &str = "<force_torque><frame>sensor</frame><measure_direction>parent_to_child</measure_direction></force_torque>";

/// The quantity and the object of a sensor.
struct Target<'a> {
    /// In SDFormat's words, or simd's.
    kind: &'static str,
    /// `site`, `joint`, `xbody`, or `body` for its centre of mass.
    object: &'a str,
    name: &'a str,
}

/// Returns the target of a sensor; `None`, with a note, for sensors that are not supported.
fn target<'a>(element: Element<'a>, notes: &mut Notes) -> Option<Target<'a>> {
    let of_object = || element.word("objtype").unwrap_or("body");
    let (kind, object, attribute) = match element.tag() {
        "accelerometer" | "gyro" => ("imu", "site", "site"),
        "force" | "torque" => ("force_torque", "site", "site"),
        "touch" => ("contact", "site", "site"),
        "rangefinder" => ("range", "site", "site"),
        "jointpos" | "jointvel" => ("encoder", "joint", "joint"),
        // In the axes of the site.
        "velocimeter" => ("odometry", "site", "site"),
        "framepos" | "framequat" | "framexaxis" | "frameyaxis" | "framezaxis" | "framelinvel"
        | "frameangvel" => {
            if element.word("refname").is_some() {
                notes.info(element, Used, "simd measures the state of a link relative to the world");
            }
            ("link_state", of_object(), "objname")
        }
        "framelinacc" => {
            notes.info(element, Used, "the specific force of an imu is in its own axes");
            ("imu", of_object(), "objname")
        }
        "contact" if element.word("body1").is_some() => {
            let others = ["geom2", "body2", "subtree2", "site"];
            if others.iter().any(|name| element.word(name).is_some()) {
                notes.info(
                    element,
                    Used,
                    "it measures all contacts of the body; readings name the other body",
                );
            }
            ("contact", "xbody", "body1")
        }
        _ => {
            notes.info(element, Ignored, "not read by simd");
            return None;
        }
    };
    let name = element.word(attribute);
    if name.is_none() {
        notes.warn(element, Ignored, format!("it names no {attribute}: left out"));
    }
    Some(Target { kind, object, name: name? })
}

/// Returns the place and the pose of a sensor. `None` if the object does not exist.
fn placed(kind: &str, object: &str, target: &str, reader: &Reader) -> Option<(Mount, DPose3)> {
    let (body, pose) = match object {
        "joint" => {
            let mut joints = reader.bodies.iter().flat_map(|body| &body.joints);
            return joints
                .any(|joint| joint.name == target)
                .then(|| (Mount::Joint(target.to_owned()), DPose3::IDENTITY));
        }
        "site" => *reader.sites.get(target)?,
        "xbody" | "body" => {
            let index = reader.bodies.iter().position(|body| body.name == target)?;
            // MuJoCo's frame `body`, unlike `xbody`, is at the centre of mass. Its axes are the body's.
            let center = reader.bodies.get(index)?.inertial.center_of_mass;
            let at_center = object == "body" && index > 0;
            (index, if at_center { DPose3::from_translation(center) } else { DPose3::IDENTITY })
        }
        _ => return None,
    };
    let name = reader.bodies.get(body)?.name.clone();
    Some(match kind {
        "force_torque" => (Mount::Above(name), pose),
        // MuJoCo's ray points along z, SDFormat's along x.
        "range" => {
            (Mount::Body(name), pose * DPose3::from_rotation(DQuat::from_rotation_arc(DVec3::X, DVec3::Z)))
        }
        _ => (Mount::Body(name), pose),
    })
}

/// Gives each sensor to its link or joint.
pub(super) fn give(measured: Vec<Measured>, drafts: &mut [Draft], notes: &mut Notes) {
    // Names of bodies and of joints are unique in a file.
    let mut links: BTreeMap<String, (usize, usize)> = BTreeMap::new();
    let mut joints: BTreeMap<String, (usize, usize)> = BTreeMap::new();
    let mut above: BTreeMap<String, (usize, usize)> = BTreeMap::new();
    for (robot, draft) in drafts.iter().enumerate() {
        for (index, link) in draft.links.iter().enumerate() {
            links.insert(link.name.clone(), (robot, index));
        }
        for (index, joint) in draft.joints.iter().enumerate() {
            joints.insert(joint.name.clone(), (robot, index));
            above.insert(joint.child.clone(), (robot, index));
        }
    }
    for Measured { mount, sensor } in measured {
        let (found, is_link) = match &mount {
            Mount::Body(name) => (links.get(name), true),
            Mount::Above(name) => (above.get(name), false),
            Mount::Joint(name) => (joints.get(name), false),
        };
        let slot = found.and_then(|(robot, index)| {
            let draft = drafts.get_mut(*robot)?;
            if is_link {
                draft.links.get_mut(*index).map(|link| &mut link.sensors)
            } else {
                draft.joints.get_mut(*index).map(|joint| &mut joint.sensors)
            }
        });
        match slot {
            Some(sensors) => sensors.push(sensor),
            None => {
                let message =
                    format!("the sensor {} is on nothing that a robot has: left out", quoted(&sensor.name));
                notes.warn_at_line(Ignored, sensor.at, message);
            }
        }
    }
}

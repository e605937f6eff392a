//! `<sensor>`: MuJoCo's sensors as SDFormat's. What several elements measure at one place is one sensor.

use std::collections::BTreeMap;

use glamx::{DPose3, DQuat, DVec3};

use super::Reader;
use crate::report::Disposition::{Ignored, Used};
use crate::translation::draft::{Draft, DraftSensor};
use crate::translation::element::Element;
use crate::translation::notes::Notes;
use crate::urdf::findings::quoted;

/// Sensors that one file may have.
const MOST: usize = 4096;

/// What a sensor is on.
enum Place {
    /// A body, by its name.
    Body(String),
    /// What holds a body, by its name.
    Above(String),
    /// A joint, by its name.
    Joint(String),
}

/// A sensor, before it is known of which robot.
pub(super) struct Measured {
    place: Place,
    sensor: DraftSensor,
}

/// All of them.
pub(super) fn read<'a>(elements: &[Element<'a>], reader: &mut Reader<'a>) -> Vec<Measured> {
    let mut measured: Vec<Measured> = Vec::new();
    // By kind and what it is on, which of the list.
    let mut known: BTreeMap<(&'static str, String), usize> = BTreeMap::new();
    for element in elements.iter().copied() {
        if measured.len() >= MOST {
            reader.notes.warn(element, Ignored, format!("there are more than {MOST} sensors: left out"));
            break;
        }
        let Some((kind, target)) = target(element, &mut reader.notes) else { continue };
        if let Some(first) = known.get(&(kind, target.to_owned())).and_then(|index| measured.get(*index)) {
            let message = format!("it is a part of sensor {}", quoted(&first.sensor.name));
            reader.notes.info(element, Used, message);
            continue;
        }
        let Some((place, pose)) = placed(element, kind, target, reader) else {
            let message = format!("{} is not there: left out", quoted(target));
            reader.notes.warn(element, Ignored, message);
            continue;
        };
        let at = (element.file, element.line());
        let mut lines = Vec::new();
        match kind {
            "force_torque" => lines.push((at, 0, FORCE_TORQUE.to_owned())),
            "range" => {
                let cutoff = element.word("cutoff").and_then(|word| word.parse::<f64>().ok()).unwrap_or(0.0);
                if cutoff > 0.0 && cutoff.is_finite() {
                    lines.push((at, 0, format!("<ray><range><max>{cutoff}</max></range></ray>")));
                }
            }
            "contact" => {
                let message = "all that touches the body counts, not only what touches it within the site";
                reader.notes.info(element, Used, message);
            }
            _ => {}
        }
        let name = element.word("name").map_or_else(|| format!("{}_{target}", element.tag()), str::to_owned);
        known.insert((kind, target.to_owned()), measured.len());
        let sensor = DraftSensor { name, at, kind: kind.to_owned(), pose, lines };
        measured.push(Measured { place, sensor });
    }
    measured
}

/// As MuJoCo measures them: of the child on the parent, in the axes of the site.
const FORCE_TORQUE: &str = "<force_torque><frame>sensor</frame><measure_direction>child_to_parent</measure_direction></force_torque>";

/// The kind of a sensor, and the name of what it is on. `None` for those that are not read, which is said.
fn target<'a>(element: Element<'a>, notes: &mut Notes) -> Option<(&'static str, &'a str)> {
    let (kind, attribute) = match element.tag() {
        "accelerometer" | "gyro" => ("imu", "site"),
        "force" | "torque" => ("force_torque", "site"),
        "touch" => ("contact", "site"),
        "rangefinder" => ("range", "site"),
        "jointpos" | "jointvel" => ("encoder", "joint"),
        "velocimeter" => {
            notes.info(element, Used, "the velocity of a link is in the axes of the world in simd");
            ("link_state", "site")
        }
        "framepos" | "framequat" | "framelinvel" | "frameangvel" => {
            if element.word("refname").is_some() {
                notes.info(element, Used, "the state of a link is against the world in simd");
            }
            ("link_state", "objname")
        }
        _ => {
            notes.info(element, Ignored, "not read by simd");
            return None;
        }
    };
    let target = element.word(attribute);
    if target.is_none() {
        notes.warn(element, Ignored, format!("it names no {attribute}: left out"));
    }
    Some((kind, target?))
}

/// What a sensor is on, and where it is there. `None` where there is no such thing.
fn placed(element: Element, kind: &str, target: &str, reader: &Reader) -> Option<(Place, DPose3)> {
    if kind == "encoder" {
        let mut joints = reader.bodies.iter().flat_map(|body| &body.joints);
        return joints
            .any(|joint| joint.name == target)
            .then(|| (Place::Joint(target.to_owned()), DPose3::IDENTITY));
    }
    let of_object = kind == "link_state" && element.tag() != "velocimeter";
    let is_site = !of_object || element.word("objtype") == Some("site");
    let (body, pose) = if is_site {
        *reader.sites.get(target)?
    } else {
        let body = reader.bodies.iter().position(|body| body.name == target)?;
        (body, DPose3::IDENTITY)
    };
    let name = reader.bodies.get(body)?.name.clone();
    Some(match kind {
        "force_torque" => (Place::Above(name), pose),
        // MuJoCo's ray goes along z, and that of SDFormat along x.
        "range" => {
            (Place::Body(name), pose * DPose3::from_rotation(DQuat::from_rotation_arc(DVec3::X, DVec3::Z)))
        }
        _ => (Place::Body(name), pose),
    })
}

/// Gives each sensor to its link or joint.
pub(super) fn give(measured: Vec<Measured>, drafts: &mut [Draft], notes: &mut Notes) {
    // Names of bodies and of joints differ in a file.
    let mut links: BTreeMap<String, (usize, usize)> = BTreeMap::new();
    let mut joints: BTreeMap<String, (usize, usize)> = BTreeMap::new();
    let mut above: BTreeMap<String, (usize, usize)> = BTreeMap::new();
    for (place, draft) in drafts.iter().enumerate() {
        for (index, link) in draft.links.iter().enumerate() {
            links.insert(link.name.clone(), (place, index));
        }
        for (index, joint) in draft.joints.iter().enumerate() {
            joints.insert(joint.name.clone(), (place, index));
            above.insert(joint.child.clone(), (place, index));
        }
    }
    for Measured { place, sensor } in measured {
        let (found, is_link) = match &place {
            Place::Body(name) => (links.get(name), true),
            Place::Above(name) => (above.get(name), false),
            Place::Joint(name) => (joints.get(name), false),
        };
        let slot = found.and_then(|(place, index)| {
            let draft = drafts.get_mut(*place)?;
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
                notes.of_place(Ignored, sensor.at, message);
            }
        }
    }
}

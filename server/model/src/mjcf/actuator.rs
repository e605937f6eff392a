//! `<actuator>`: motors, and position and velocity servos of joints and fixed tendons, including those written as
//! `general`.
//!
//! An actuator acts on a length that is linear in the position of one joint. This is the named joint, the joint that
//! it follows, or the leader of a tendon's joints.

use std::collections::BTreeMap;

use super::Reader;
use super::coupling::Linear;
use super::defaults::Classed;
use super::joint::{Joints, Kind, is_limited};
use super::{spring_damper, tendon};
use crate::report::Disposition::{Ignored, Repaired, Used};
use crate::report::short;
use crate::translation::draft::DraftDrive;
use crate::translation::element::Element;
use crate::translation::notes::{Notes, Stop};
use crate::urdf::findings::quoted;

/// Control law of a length, before the gear.
enum Law {
    /// Gain from control to force.
    Motor(f64),
    Position(Servo),
    /// Damping, and gain from control to force.
    Velocity(f64, f64),
}

/// force = gain * control + bias - stiffness * length - damping * velocity.
struct Servo {
    stiffness: f64,
    damping: Damping,
    gain: f64,
    bias: f64,
}

/// Damping of a position servo.
enum Damping {
    Of(f64),
    /// Ratio to the critical damping for the inertia of its joints in the file's pose.
    Ratio(f64),
}

/// Length that an actuator acts on.
struct Transmission {
    /// By its leader, without the gear.
    length: Linear,
    /// Joints of the length, and their factors.
    terms: Vec<(String, f64)>,
    /// Words for a report, if it is not simply the joint's.
    through: Option<String>,
}

/// Drive of a joint, and its limit of effort.
#[derive(Default)]
struct Driven {
    drive: DraftDrive,
    effort: Option<f64>,
}

/// Reads the actuators of joints and fixed tendons.
pub(super) fn read<'a>(
    elements: &[Element<'a>],
    reader: &mut Reader<'a>,
    joints: &mut Joints,
) -> Result<(), Stop> {
    let mut inertias = None;
    let mut all: BTreeMap<String, Driven> = BTreeMap::new();
    for element in elements.iter().copied() {
        let tags = match element.tag() {
            "motor" => ["motor", "general"],
            "position" => ["position", "general"],
            "velocity" => ["velocity", "general"],
            "intvelocity" => ["intvelocity", "general"],
            "general" => ["general", "general"],
            other => {
                let message = format!("simd has no actuator {other:.40}: left out");
                reader.notes.warn(element, Ignored, message);
                continue;
            }
        };
        let Some(Transmission { length, terms, through }) = transmission(element, joints, &mut reader.notes)
        else {
            continue;
        };
        let actuator = reader.scope.classes.of(element, None, tags);
        let Some(law) = law(&actuator, &mut reader.notes)? else {
            let message = "it is neither a motor nor a servo of position or velocity: left out";
            reader.notes.warn(element, Ignored, message);
            continue;
        };
        let own_gear = actuator.list("gear", 6)?.and_then(|gear| gear.first().copied()).unwrap_or(1.0);
        let gear = own_gear * length.factor;
        let most = |name: &str, limited: &str| -> Result<Option<f64>, Stop> {
            let Some(range) = actuator.list(name, 2)? else { return Ok(None) };
            let holds = is_limited(&actuator, limited, true, &reader.scope.compiler);
            let most = range.iter().fold(0.0_f64, |most, end| most.max(end.abs()));
            Ok(Some(most).filter(|most| holds && *most > 0.0))
        };
        let force = most("forcerange", "forcelimited")?.map(|force| force * gear.abs());
        if !matches!(law, Law::Motor(_)) && actuator.list("ctrlrange", 2)?.is_some() {
            let message = "ctrlrange is not read: targets have the limits of their joint";
            reader.notes.info(element, Ignored, message);
        }
        let driven = match law {
            Law::Motor(gain) => {
                let control = most("ctrlrange", "ctrllimited")?.map(|control| (control * gain * gear).abs());
                let effort = match (force, control) {
                    (Some(force), Some(control)) => Some(force.min(control)),
                    (force, control) => force.or(control),
                };
                let drive = DraftDrive { command: Some("effort"), ..DraftDrive::default() };
                Driven { drive, effort }
            }
            Law::Position(servo) => {
                let damping = match servo.damping {
                    Damping::Of(damping) => damping * gear * gear,
                    Damping::Ratio(ratio) => {
                        let inertias =
                            inertias.get_or_insert_with(|| spring_damper::joint_inertias(&reader.bodies));
                        let inertia = inertia(&terms, own_gear, inertias);
                        let damping = 2.0 * ratio * (servo.stiffness.max(0.0) * inertia).sqrt() * gear * gear;
                        let message = format!("damping {}, from its ratio of damping", short(damping));
                        reader.notes.info(element, Used, message);
                        damping
                    }
                };
                if servo.gain != servo.stiffness || servo.bias != 0.0 {
                    // gear length = (gain control + bias) / stiffness.
                    let scale = servo.stiffness * own_gear * length.factor;
                    let start = (servo.bias / servo.stiffness / own_gear - length.offset) / length.factor;
                    let message = format!(
                        "a control of u is the position target {} u + {}",
                        short(servo.gain / scale),
                        short(start)
                    );
                    reader.notes.info(
                        element,
                        Ignored,
                        format!("the unit of its control is not read: {message}"),
                    );
                }
                let (stiffness, damping) = (Some(servo.stiffness * gear * gear), Some(damping));
                let command = Some("position");
                Driven {
                    drive: DraftDrive { command, stiffness, damping, ..DraftDrive::default() },
                    effort: force,
                }
            }
            Law::Velocity(damping, gain) => {
                if gain != damping {
                    let message =
                        format!("a control of u is the velocity target {} u", short(gain / (damping * gear)));
                    reader.notes.info(
                        element,
                        Ignored,
                        format!("the unit of its control is not read: {message}"),
                    );
                }
                let damping = Some(damping * gear * gear);
                let drive = DraftDrive { command: Some("velocity"), damping, ..DraftDrive::default() };
                Driven { drive, effort: force }
            }
        };
        let effort_said = driven.effort.map_or_else(String::new, |most| format!(", at most {}", short(most)));
        let command = driven.drive.command.unwrap_or_default();
        let through = through.map_or_else(String::new, |through| format!(" {through}"));
        let message = format!("joint {}: driven by {command}{through}{effort_said}", quoted(&length.joint));
        match all.remove(&length.joint) {
            None => {
                reader.notes.info(element, Used, message);
                all.insert(length.joint, driven);
            }
            Some(known) => {
                let (kept, is_added) = together(known, &driven);
                if is_added {
                    reader.notes.info(element, Used, format!("{message}, in addition to its other actuator"));
                } else {
                    let joint = quoted(&length.joint);
                    let message = format!("the joint {joint} has an actuator already, which is used");
                    reader.notes.warn(element, Ignored, message);
                }
                all.insert(length.joint, kept);
            }
        }
    }
    for (joint, Driven { drive, effort }) in all {
        if let Some(effort) = effort {
            let most = joints.efforts.get(&joint).map_or(effort, |known| known.min(effort));
            joints.efforts.insert(joint.clone(), most);
        }
        joints.drives.insert(joint, drive);
    }
    Ok(())
}

/// Returns the length that an actuator acts on, or reports why there is none.
fn transmission(element: Element, joints: &Joints, notes: &mut Notes) -> Option<Transmission> {
    if let Some(name) = element.word("tendon") {
        let Some(tendon) = joints.tendons.get(name) else {
            let message = format!("there is no fixed tendon {} that could have it: left out", quoted(name));
            notes.warn(element, Ignored, message);
            return None;
        };
        let Some(length) = tendon.length.clone() else {
            let message = format!(
                "the joints of tendon {} ({}) are not of one robot: they are without this actuator",
                quoted(name),
                tendon::names(&tendon.terms)
            );
            notes.warn(element, Ignored, message);
            return None;
        };
        let through = format!("through the tendon {}, {} times", quoted(name), short(length.factor));
        return Some(Transmission { length, terms: tendon.terms.clone(), through: Some(through) });
    }
    let Some(name) = element.word("joint").or_else(|| element.word("jointinparent")) else {
        notes.warn(element, Ignored, "only joints and fixed tendons have actuators in simd: left out");
        return None;
    };
    let Some(known) = joints.known.get(name) else {
        let message = format!("there is no joint {} that could have it: left out", quoted(name));
        notes.warn(element, Ignored, message);
        return None;
    };
    if known.kind == Kind::Ball {
        notes.warn(element, Ignored, "ball joints have no actuators in simd: left out");
        return None;
    }
    let length = joints.couplings.leader(name);
    if length.factor == 0.0 {
        notes.warn(element, Ignored, format!("the joint {} is kept in place: left out", quoted(name)));
        return None;
    }
    let through = (length.joint != name)
        .then(|| format!("through its follower {}, {} times", quoted(name), short(length.factor)));
    Some(Transmission { length, terms: vec![(name.to_owned(), 1.0)], through })
}

/// Returns the inertia behind the gear, as MuJoCo's `mj_setConst` does for a ratio of damping: one over the sum of
/// gear^2 / M of all joints.
fn inertia(terms: &[(String, f64)], gear: f64, inertias: &BTreeMap<String, f64>) -> f64 {
    let mobility = |(joint, factor): &(String, f64)| {
        let inertia = inertias.get(joint).copied().unwrap_or(0.0);
        (factor * gear).powi(2) / inertia
    };
    let inertia = 1.0 / terms.iter().map(mobility).sum::<f64>();
    if inertia.is_finite() { inertia.max(0.0) } else { 0.0 }
}

/// Returns the sum of two actuators of a joint, if it is an actuator, and whether it is; otherwise the first. Limits
/// of both add up.
fn together(one: Driven, other: &Driven) -> (Driven, bool) {
    let commands = [&one, other].map(|driven| driven.drive.command.unwrap_or_default());
    let command = match commands {
        ["position", "velocity"] | ["velocity", "position"] => "position",
        ["effort", "effort"] => "effort",
        ["velocity", "velocity"] => "velocity",
        _ => return (one, false),
    };
    let damping = match (one.drive.damping, other.drive.damping) {
        (Some(one), Some(other)) => Some(one + other),
        (one, other) => one.or(other),
    };
    let stiffness = one.drive.stiffness.or(other.drive.stiffness);
    let effort = one.effort.zip(other.effort).map(|(one, other)| one + other);
    let drive = DraftDrive { command: Some(command), stiffness, damping, ..DraftDrive::default() };
    (Driven { drive, effort }, true)
}

fn law(actuator: &Classed, notes: &mut Notes) -> Result<Option<Law>, Stop> {
    let number = |name: &str| actuator.number(name);
    Ok(Some(match actuator.element.tag() {
        "motor" => Law::Motor(1.0),
        tag @ ("position" | "intvelocity") => {
            let stiffness = number("kp")?.unwrap_or(1.0);
            if tag == "intvelocity" {
                let message = "its control is the velocity of its target: in simd targets are positions";
                notes.warn(actuator.element, Repaired, message);
            }
            let damping = match (number("kv")?, number("dampratio")?) {
                (Some(damping), _) => Damping::Of(damping),
                (None, Some(ratio)) if ratio > 0.0 => Damping::Ratio(ratio),
                (None, _) => Damping::Of(0.0),
            };
            if number("timeconst")?.is_some_and(|time| time > 0.0) {
                let message = "timeconst is not read: targets act at once, without the filter";
                notes.warn(actuator.element, Ignored, message);
            }
            Law::Position(Servo { stiffness, damping, gain: stiffness, bias: 0.0 })
        }
        "velocity" => {
            let damping = number("kv")?.unwrap_or(1.0);
            Law::Velocity(damping, damping)
        }
        _ => return general(actuator, notes),
    }))
}

/// force = gain * control + bias, where the gain is fixed and the bias none or b0 + b1 q + b2 qd.
fn general(actuator: &Classed, notes: &mut Notes) -> Result<Option<Law>, Stop> {
    if actuator.word("gaintype").is_some_and(|word| word != "fixed") {
        return Ok(None);
    }
    match actuator.word("dyntype") {
        None | Some("none") => {}
        Some("filter" | "filterexact") => {
            let message = "dyntype is not read: targets act at once, without the filter";
            notes.warn(actuator.element, Ignored, message);
        }
        Some(_) => return Ok(None),
    }
    let gain = actuator.list("gainprm", 10)?.and_then(|gain| gain.first().copied()).unwrap_or(1.0);
    let bias = actuator.list("biasprm", 10)?.unwrap_or_default();
    let bias = |index: usize| bias.get(index).copied().unwrap_or(0.0);
    Ok(match actuator.word("biastype").unwrap_or("none") {
        "none" => Some(Law::Motor(gain)),
        "affine" if bias(1) < 0.0 && gain != 0.0 => {
            // A positive value is a damping ratio of a servo whose control is a length.
            let damping = match bias(2) {
                ratio if ratio > 0.0 && gain == -bias(1) => Damping::Ratio(ratio),
                damping if damping > 0.0 => return Ok(None),
                damping => Damping::Of(-damping),
            };
            Some(Law::Position(Servo { stiffness: -bias(1), damping, gain, bias: bias(0) }))
        }
        "affine" if bias(0) == 0.0 && bias(1) == 0.0 && bias(2) < 0.0 && gain != 0.0 => {
            Some(Law::Velocity(-bias(2), gain))
        }
        _ => None,
    })
}

//! `<actuator>`: motors, and position and velocity servos of joints, including those written as `general`.

use super::Reader;
use super::defaults::Classed;
use super::joint::{Joints, Kind, is_limited};
use super::spring_damper;
use crate::report::Disposition::{Ignored, Used};
use crate::report::short;
use crate::translation::draft::DraftDrive;
use crate::translation::element::Element;
use crate::translation::notes::Stop;
use crate::urdf::findings::quoted;

/// Control law of a joint, before the gear.
enum Law {
    /// Gain from control to force.
    Motor(f64),
    /// Stiffness.
    Position(f64, Damping),
    /// Damping.
    Velocity(f64),
}

/// Damping of a position servo.
enum Damping {
    Of(f64),
    /// Ratio to the critical damping for the joint's inertia in the file's pose.
    Ratio(f64),
}

/// Reads the actuators of joints.
pub(super) fn read<'a>(
    elements: &[Element<'a>],
    reader: &mut Reader<'a>,
    joints: &mut Joints,
) -> Result<(), Stop> {
    let mut inertias = None;
    for element in elements.iter().copied() {
        let tags = match element.tag() {
            "motor" => ["motor", "general"],
            "position" => ["position", "general"],
            "velocity" => ["velocity", "general"],
            "general" => ["general", "general"],
            other => {
                let message = format!("simd has no actuator {other:.40}: left out");
                reader.notes.warn(element, Ignored, message);
                continue;
            }
        };
        let Some(joint) = element.word("joint").or_else(|| element.word("jointinparent")) else {
            reader.notes.warn(element, Ignored, "only joints have actuators in simd: left out");
            continue;
        };
        let Some((kind, _)) = joints.known.get(joint).copied() else {
            let message = format!("its joint {} does not exist: left out", quoted(joint));
            reader.notes.warn(element, Ignored, message);
            continue;
        };
        if kind == Kind::Ball {
            reader.notes.warn(element, Ignored, "ball joints have no actuators in simd: left out");
            continue;
        }
        let actuator = reader.scope.classes.of(element, None, tags);
        let Some(law) = law(&actuator)? else {
            let message = "it is neither a motor nor a servo of position or velocity: left out";
            reader.notes.warn(element, Ignored, message);
            continue;
        };
        if joints.drives.contains_key(joint) {
            let message = format!("the joint {} has an actuator already, which is used", quoted(joint));
            reader.notes.warn(element, Ignored, message);
            continue;
        }
        let gear = actuator.list("gear", 6)?.and_then(|gear| gear.first().copied()).unwrap_or(1.0);
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
        let (drive, effort) = match law {
            Law::Motor(gain) => {
                let control = most("ctrlrange", "ctrllimited")?.map(|control| (control * gain * gear).abs());
                let effort = match (force, control) {
                    (Some(force), Some(control)) => Some(force.min(control)),
                    (force, control) => force.or(control),
                };
                (DraftDrive { command: Some("effort"), ..DraftDrive::default() }, effort)
            }
            Law::Position(stiffness, damping) => {
                let damping = match damping {
                    Damping::Of(damping) => damping * gear * gear,
                    Damping::Ratio(ratio) => {
                        let inertias =
                            inertias.get_or_insert_with(|| spring_damper::joint_inertias(&reader.bodies));
                        let inertia = inertias.get(joint).copied().filter(|inertia| inertia.is_finite());
                        let inertia = inertia.unwrap_or(0.0).max(0.0);
                        // As in MuJoCo's `mj_setConst`: for the mass behind the gear, M / gear^2.
                        let damping = 2.0 * ratio * (stiffness.max(0.0) * inertia).sqrt() * gear.abs();
                        let message = format!("damping {}, from its ratio of damping", short(damping));
                        reader.notes.info(element, Used, message);
                        damping
                    }
                };
                let (stiffness, damping) = (Some(stiffness * gear * gear), Some(damping));
                (DraftDrive { command: Some("position"), stiffness, damping }, force)
            }
            Law::Velocity(damping) => {
                let damping = Some(damping * gear * gear);
                (DraftDrive { command: Some("velocity"), stiffness: None, damping }, force)
            }
        };
        let effort_said = effort.map_or_else(String::new, |most| format!(", at most {}", short(most)));
        let command = drive.command.unwrap_or_default();
        let message = format!("joint {}: driven by {command}{effort_said}", quoted(joint));
        reader.notes.info(element, Used, message);
        joints.drives.insert(joint.to_owned(), drive);
        if let Some(effort) = effort {
            joints.efforts.insert(joint.to_owned(), effort);
        }
    }
    Ok(())
}

fn law(actuator: &Classed) -> Result<Option<Law>, Stop> {
    let number = |name: &str| actuator.number(name);
    Ok(Some(match actuator.element.tag() {
        "motor" => Law::Motor(1.0),
        "position" => {
            let stiffness = number("kp")?.unwrap_or(1.0);
            let damping = match (number("kv")?, number("dampratio")?) {
                (Some(damping), _) => Damping::Of(damping),
                (None, Some(ratio)) if ratio > 0.0 => Damping::Ratio(ratio),
                (None, _) => Damping::Of(0.0),
            };
            Law::Position(stiffness, damping)
        }
        "velocity" => Law::Velocity(number("kv")?.unwrap_or(1.0)),
        _ => return general(actuator),
    }))
}

/// force = gain * control + bias, where the gain is fixed and the bias none or b0 + b1 q + b2 qd.
fn general(actuator: &Classed) -> Result<Option<Law>, Stop> {
    if actuator.word("dyntype").is_some_and(|word| word != "none")
        || actuator.word("gaintype").is_some_and(|word| word != "fixed")
    {
        return Ok(None);
    }
    let gain = actuator.list("gainprm", 10)?.and_then(|gain| gain.first().copied()).unwrap_or(1.0);
    let bias = actuator.list("biasprm", 10)?.unwrap_or_default();
    let bias = |index: usize| bias.get(index).copied().unwrap_or(0.0);
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * a.abs().max(b.abs());
    Ok(match actuator.word("biastype").unwrap_or("none") {
        "none" => Some(Law::Motor(gain)),
        "affine" if bias(0) == 0.0 && near(bias(1), -gain) && gain > 0.0 => {
            // A positive value is a damping ratio.
            let damping = if bias(2) > 0.0 { Damping::Ratio(bias(2)) } else { Damping::Of(-bias(2)) };
            Some(Law::Position(gain, damping))
        }
        "affine" if bias(0) == 0.0 && bias(1) == 0.0 && near(bias(2), -gain) && gain > 0.0 => {
            Some(Law::Velocity(gain))
        }
        _ => None,
    })
}

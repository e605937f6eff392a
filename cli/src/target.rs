//! Joint targets as arguments: `elbow=0.5`, `wrist=vel:1rad/s`, `x=pos:0.5,kp=100,kd=5`.

use simd_client::Target;

use crate::quantity::{self, Kind, Motion};

/// A target for a joint, and the motion that its units imply.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Assignment {
    pub(crate) joint: String,
    pub(crate) target: Target,
    pub(crate) motion: Option<Motion>,
}

/// A position for a joint, and a velocity if one was given.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Placement {
    pub(crate) joint: String,
    pub(crate) position: f64,
    pub(crate) velocity: f64,
    /// For a spherical joint instead: a quaternion x y z w.
    pub(crate) orientation: Option<[f64; 4]>,
    pub(crate) motion: Option<Motion>,
}

/// Parses `JOINT=TARGET`.
pub(crate) fn assignment(text: &str) -> Result<Assignment, String> {
    let (joint, (target, motion)) = split(text, target)?;
    Ok(Assignment { joint, target, motion })
}

/// Parses `JOINT=POSITION`, `JOINT=POSITION,VELOCITY` or `JOINT=quat:X,Y,Z,W`.
pub(crate) fn placement(text: &str) -> Result<Placement, String> {
    let (joint, (position, velocity, orientation, motion)) = split(text, |value| {
        let mut motion = None;
        if let Some(("quat", quaternion)) = value.trim().split_once(':') {
            let orientation = numbers(quaternion.split(','), Kind::Plain, "quat:X,Y,Z,W")?;
            return Ok((0.0, 0.0, Some(orientation), Some(Motion::Turns)));
        }
        let (position, velocity) = match value.split_once(',') {
            Some((position, velocity)) => (position, Some(velocity)),
            None => (value, None),
        };
        let position = number(position, Kind::Position, &mut motion)?;
        let velocity = velocity.map(|velocity| number(velocity, Kind::Velocity, &mut motion)).transpose()?;
        Ok((position, velocity.unwrap_or(0.0), None, motion))
    })?;
    Ok(Placement { joint, position, velocity, orientation, motion })
}

/// Splits at the first `=` after which the rest can be parsed, since a joint's name and a target may both
/// contain `=`. A comma only occurs in targets, so a `=` after one is not part of the name.
fn split<T>(text: &str, read: impl Fn(&str) -> Result<T, String>) -> Result<(String, T), String> {
    let mut first_reason = None;
    for (at, _) in text.match_indices('=') {
        let (joint, value) = (&text[..at], &text[at + 1..]);
        if joint.contains(',') {
            break;
        }
        match read(value) {
            Ok(value) if !joint.trim().is_empty() => return Ok((joint.trim().to_owned(), value)),
            Ok(_) => {}
            Err(reason) => {
                first_reason.get_or_insert(reason);
            }
        }
    }
    Err(first_reason.unwrap_or_else(|| "must be JOINT=VALUE".to_owned()))
}

/// Parses `passive`, `hold`, `VALUE` or `MODE:VALUE[,KEY=VALUE...]`.
fn target(text: &str) -> Result<(Target, Option<Motion>), String> {
    match text.trim() {
        "passive" => return Ok((Target::Passive, None)),
        "hold" => return Ok((Target::Hold, None)),
        "" => return Err("has no target".to_owned()),
        _ => {}
    }
    let (mode, rest) = text.split_once(':').unwrap_or(("pos", text));
    let mut parts = rest.split(',');
    let value = parts.next().unwrap_or_default();
    let mut motion = None;
    let target = match mode.trim() {
        "pos" | "position" => {
            let position = number(value, Kind::Position, &mut motion)?;
            let keys = ["kp", "kd", "vel", "ff", "max_effort", "max_velocity"];
            let extras = Extras::read(parts, &keys, &mut motion)?;
            Target::Position {
                position,
                velocity: extras.velocity.unwrap_or(0.0),
                stiffness: extras.stiffness,
                damping: extras.damping,
                feed_forward: extras.feed_forward.unwrap_or(0.0),
                max_effort: extras.max_effort,
                max_velocity: extras.max_velocity,
            }
        }
        "vel" | "velocity" => {
            let velocity = number(value, Kind::Velocity, &mut motion)?;
            let extras = Extras::read(parts, &["kd", "ff", "max_effort"], &mut motion)?;
            let feed_forward = extras.feed_forward.unwrap_or(0.0);
            let Extras { damping, max_effort, .. } = extras;
            Target::Velocity { velocity, damping, feed_forward, max_effort }
        }
        "eff" | "effort" => {
            let effort = number(value, Kind::Effort, &mut motion)?;
            Extras::read(parts, &[], &mut motion)?;
            Target::Effort(effort)
        }
        "quat" => {
            let orientation = numbers(spherical(rest), Kind::Plain, "quat:X,Y,Z,W")?;
            let keys = ["kp", "kd", "max_effort", "max_velocity"];
            let extras = Extras::read(options(rest), &keys, &mut motion)?;
            let Extras { stiffness, damping, max_effort, max_velocity, .. } = extras;
            Target::Orientation { orientation, stiffness, damping, max_effort, max_velocity }
        }
        "angvel" => {
            let velocity = numbers(spherical(rest), Kind::Velocity, "angvel:X,Y,Z")?;
            let extras = Extras::read(options(rest), &["kd", "max_effort"], &mut motion)?;
            let Extras { damping, max_effort, .. } = extras;
            Target::AngularVelocity { velocity, damping, max_effort }
        }
        "torque" => Target::Torque(numbers(rest.split(','), Kind::Effort, "torque:X,Y,Z")?),
        other => {
            return Err(format!(
                "`{other}` is not a mode: a target is a position, pos:X, vel:X, eff:X, passive or hold; of a spherical \
                 joint quat:X,Y,Z,W, angvel:X,Y,Z or torque:X,Y,Z"
            ));
        }
    };
    Ok((target, motion))
}

/// Returns the numbers of a spherical joint's target, which come before parts with a key.
fn spherical(text: &str) -> impl Iterator<Item = &str> {
    text.split(',').take_while(|part| !part.contains('='))
}

/// Returns the parts with a key.
fn options(text: &str) -> impl Iterator<Item = &str> {
    text.split(',').skip_while(|part| !part.contains('='))
}

/// Parses exactly `N` numbers, for a joint that turns.
fn numbers<'a, const N: usize>(
    parts: impl Iterator<Item = &'a str>,
    kind: Kind,
    form: &str,
) -> Result<[f64; N], String> {
    let mut motion = Some(Motion::Turns);
    let values = parts.map(|part| number(part, kind, &mut motion)).collect::<Result<Vec<f64>, _>>()?;
    let count = values.len();
    values.try_into().map_err(|_| format!("{form} takes {N} numbers, and got {count}"))
}

/// Options after a target's value.
#[derive(Default)]
struct Extras {
    stiffness: Option<f64>,
    damping: Option<f64>,
    velocity: Option<f64>,
    feed_forward: Option<f64>,
    max_effort: Option<f64>,
    max_velocity: Option<f64>,
}

impl Extras {
    fn read<'a>(
        parts: impl Iterator<Item = &'a str>,
        allowed: &[&str],
        motion: &mut Option<Motion>,
    ) -> Result<Self, String> {
        let mut extras = Self::default();
        for part in parts {
            let (key, value) = part
                .split_once('=')
                .ok_or_else(|| format!("`{part}` must be KEY=VALUE, for instance kp=100"))?;
            let key = key.trim();
            if !allowed.contains(&key) {
                return Err(match allowed {
                    [] => format!("`{key}` does not fit this mode, which takes only a value"),
                    _ => format!("`{key}` does not fit this mode, which takes {}", allowed.join(", ")),
                });
            }
            let (slot, kind) = match key {
                "kp" => (&mut extras.stiffness, Kind::Plain),
                "kd" => (&mut extras.damping, Kind::Plain),
                "vel" => (&mut extras.velocity, Kind::Velocity),
                "max_effort" => (&mut extras.max_effort, Kind::Effort),
                "max_velocity" => (&mut extras.max_velocity, Kind::Velocity),
                _ => (&mut extras.feed_forward, Kind::Effort),
            };
            if slot.replace(number(value, kind, motion)?).is_some() {
                return Err(format!("`{key}` is given twice"));
            }
        }
        Ok(extras)
    }
}

/// Parses a number whose unit must agree with earlier ones.
fn number(text: &str, kind: Kind, motion: &mut Option<Motion>) -> Result<f64, String> {
    let quantity = quantity::parse(text, kind)?;
    match (*motion, quantity.motion) {
        (Some(before), Some(now)) if before != now => {
            Err(format!("`{text}` mixes units of joints that turn and of joints that slide"))
        }
        (before, now) => {
            *motion = before.or(now);
            Ok(quantity.value)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn read(text: &str) -> (String, Target) {
        let read = assignment(text).unwrap();
        (read.joint, read.target)
    }

    fn joint(name: &str, target: Target) -> (String, Target) {
        (name.to_owned(), target)
    }

    #[test]
    fn a_bare_number_is_a_position_and_other_modes_have_a_prefix() {
        assert_eq!(read("shoulder=0.5"), joint("shoulder", Target::position(0.5)));
        assert_eq!(read("shoulder=pos:-0.5"), joint("shoulder", Target::position(-0.5)));
        assert_eq!(read("elbow=vel:1"), joint("elbow", Target::velocity(1.0)));
        assert_eq!(read("wrist=eff:0.2"), joint("wrist", Target::Effort(0.2)));
        assert_eq!(read("x=passive"), joint("x", Target::Passive));
        assert_eq!(read("y=hold"), joint("y", Target::Hold));
    }

    #[test]
    fn a_spherical_joint_takes_four_numbers_or_three() {
        let orientation = Target::Orientation {
            orientation: [0.0, 0.0, 0.6, 0.8],
            stiffness: Some(100.0),
            damping: None,
            max_effort: Some(2.0),
            max_velocity: None,
        };
        assert_eq!(read("hip=quat:0,0,0.6,0.8,kp=100,max_effort=2"), joint("hip", orientation));
        let velocity = [0.0, PI, 1.0];
        let turning = Target::AngularVelocity { velocity, damping: Some(3.0), max_effort: None };
        assert_eq!(read("hip=angvel:0,180deg/s,1,kd=3"), joint("hip", turning));
        assert_eq!(read("hip=torque:1,-2,3Nm"), joint("hip", Target::Torque([1.0, -2.0, 3.0])));
        for text in ["hip=quat:0,0,1", "hip=quat:0,0,0,1,2", "hip=torque:1", "hip=quat:0,0,0,1,ff=2"] {
            assert!(assignment(text).is_err(), "{text}");
        }
        let placed = placement("hip=quat:0,0,0.6,0.8").unwrap();
        assert_eq!((placed.joint.as_str(), placed.orientation), ("hip", Some([0.0, 0.0, 0.6, 0.8])));
        assert!(placement("hip=quat:0,0,0.6").is_err());
    }

    #[test]
    fn gains_velocity_and_feed_forward_follow_commas() {
        let target = Target::Position {
            position: 0.5,
            velocity: 0.1,
            stiffness: Some(100.0),
            damping: Some(5.0),
            feed_forward: 2.0,
            max_effort: Some(3.0),
            max_velocity: Some(0.4),
        };
        let text = "elbow=pos:0.5,kp=100,kd=5,vel=0.1,ff=2Nm,max_effort=3,max_velocity=0.4";
        assert_eq!(read(text), joint("elbow", target));
        let target =
            Target::Velocity { velocity: 1.0, damping: Some(3.0), feed_forward: 0.0, max_effort: Some(2.0) };
        assert_eq!(read("elbow=vel:1rad/s,kd=3,max_effort=2"), joint("elbow", target));
        assert_eq!(
            read("elbow=0.5,kp=9").1,
            Target::Position {
                position: 0.5,
                velocity: 0.0,
                stiffness: Some(9.0),
                damping: None,
                feed_forward: 0.0,
                max_effort: None,
                max_velocity: None
            }
        );
    }

    #[test]
    fn a_joints_name_may_hold_spaces_equals_signs_and_colons() {
        assert_eq!(read("left elbow=0.5").0, "left elbow");
        assert_eq!(read("a=b=0.5"), joint("a=b", Target::position(0.5)));
        assert_eq!(read("ns:joint=vel:1"), joint("ns:joint", Target::velocity(1.0)));
    }

    #[test]
    fn units_say_how_the_joint_moves_and_must_agree() {
        assert_eq!(assignment("a=90deg").unwrap().motion, Some(Motion::Turns));
        assert_eq!(assignment("a=pos:5mm,vel=1m/s").unwrap().motion, Some(Motion::Slides));
        assert_eq!(assignment("a=1").unwrap().motion, None);
        assert!(assignment("a=pos:5mm,vel=1rad/s").unwrap_err().contains("mixes units"));
    }

    #[test]
    fn unreadable_targets_are_named() {
        for (text, phrase) in [
            ("elbow", "JOINT=VALUE"),
            ("=0.5", "JOINT=VALUE"),
            ("elbow=", "no target"),
            ("elbow=up", "`up` is not a number"),
            ("elbow=torque:1", "torque:X,Y,Z takes 3 numbers"),
            ("elbow=turn:1", "`turn` is not a mode"),
            ("elbow=vel:90deg", "deg/s"),
            ("elbow=eff:1,kp=5", "`kp` does not fit this mode"),
            ("elbow=vel:1,kp=5", "takes kd, ff, max_effort"),
            ("elbow=pos:1,kp", "KEY=VALUE"),
            ("elbow=pos:1,kp=1,kp=2", "given twice"),
        ] {
            let refused = assignment(text).unwrap_err();
            assert!(refused.contains(phrase), "{text}: {refused}");
        }
    }

    #[test]
    fn a_placement_is_a_position_and_perhaps_a_velocity() {
        let read = placement("left elbow=0.5,-1").unwrap();
        assert_eq!((read.joint.as_str(), read.position, read.velocity), ("left elbow", 0.5, -1.0));
        let read = placement("elbow=180deg").unwrap();
        assert_eq!((read.position, read.velocity), (std::f64::consts::PI, 0.0));
        assert!(placement("elbow=1,2,3").is_err());
    }
}

//! Poses as arguments and output: x, y, z and roll, pitch, yaw as in URDF.

use simd_client::proto::{Pose, Quaternion, Vector3};

use crate::quantity::{self, Kind, Motion};

/// Parses `x,y,z` or `x,y,z,roll,pitch,yaw`, in metres and radians or with units.
pub(crate) fn parse(text: &str) -> Result<Pose, String> {
    let parts: Vec<&str> = text.split(',').collect();
    let (lengths, angles) = match parts.len() {
        3 | 6 => parts.split_at(3),
        _ => return Err("must be x,y,z or x,y,z,roll,pitch,yaw".to_owned()),
    };
    let read = |parts: &[&str], wanted| {
        parts
            .iter()
            .map(|part| match quantity::parse(part, Kind::Position)? {
                quantity if quantity.motion.is_some_and(|motion| motion != wanted) => {
                    Err(format!("`{part}` has the wrong unit: lengths come first, then angles"))
                }
                quantity => Ok(quantity.value),
            })
            .collect::<Result<Vec<f64>, String>>()
    };
    let lengths = read(lengths, Motion::Slides)?;
    let angles = read(angles, Motion::Turns)?;
    Ok(Pose {
        position: vector(&lengths),
        orientation: match angles.as_slice() {
            &[roll, pitch, yaw] => Some(from_roll_pitch_yaw([roll, pitch, yaw])),
            _ => None,
        },
    })
}

/// Splits off an optional `@` with a pose.
pub(crate) fn split(text: &str) -> Result<(&str, Option<Pose>), String> {
    match text.split_once('@') {
        Some((before, pose)) => {
            let pose = parse(pose).map_err(|why| format!("the pose after @ is wrong: {why}"))?;
            Ok((before, Some(pose)))
        }
        None => Ok((text, None)),
    }
}

/// Parses `x,y,z`.
pub(crate) fn parse_vector(text: &str) -> Result<Vector3, String> {
    vector(&quantity::parse_list(text)?).ok_or_else(|| "must be x,y,z".to_owned())
}

fn vector(values: &[f64]) -> Option<Vector3> {
    match values {
        &[x, y, z] => Some(Vector3 { x, y, z }),
        _ => None,
    }
}

/// Rotates about the fixed axes x, then y, then z.
fn from_roll_pitch_yaw(angles: [f64; 3]) -> Quaternion {
    let [(sr, cr), (sp, cp), (sy, cy)] = angles.map(|angle| (angle / 2.0).sin_cos());
    Quaternion {
        x: sr * cp * cy - cr * sp * sy,
        y: cr * sp * cy + sr * cp * sy,
        z: cr * cp * sy - sr * sp * cy,
        w: cr * cp * cy + sr * sp * sy,
    }
}

/// Returns the inverse, for a unit quaternion. If the pitch is a right angle, roll is zero.
pub(crate) fn roll_pitch_yaw(q: &Quaternion) -> [f64; 3] {
    let sine = (2.0 * (q.w * q.y - q.z * q.x)).clamp(-1.0, 1.0);
    if sine.abs() > 1.0 - 1e-12 {
        return [0.0, sine.asin(), 2.0 * q.z.atan2(q.w)];
    }
    [
        (2.0 * (q.w * q.x + q.y * q.z)).atan2(1.0 - 2.0 * (q.x * q.x + q.y * q.y)),
        sine.asin(),
        (2.0 * (q.w * q.z + q.x * q.y)).atan2(1.0 - 2.0 * (q.y * q.y + q.z * q.z)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_come_back_from_the_quaternion_they_made() {
        // Rounding of a few trigonometric functions: 1e-12 is a thousand times larger.
        for angles in [[0.1, -0.4, 2.5], [3.0, 1.5, -3.0], [0.0, 0.0, 0.0], [-1.0, 0.7, 0.2]] {
            let back = roll_pitch_yaw(&from_roll_pitch_yaw(angles));
            for (angle, back) in angles.iter().zip(back) {
                assert!((angle - back).abs() < 1e-12, "{angles:?} {back:?}");
            }
        }
    }

    #[test]
    fn a_pose_is_three_lengths_and_perhaps_three_angles() {
        let pose = parse("1,-2,300mm,0,0,90deg").unwrap();
        assert_eq!(pose.position, Some(Vector3 { x: 1.0, y: -2.0, z: 0.3 }));
        let orientation = pose.orientation.unwrap();
        assert!((orientation.z - 0.5_f64.sqrt()).abs() < 1e-15 && orientation.x == 0.0);
        assert_eq!(parse("1,2,3").unwrap().orientation, None);
        for wrong in ["", "1,2", "1,2,3,4", "90deg,0,0", "0,0,0,1m,0,0", "a,b,c"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_pose_stands_after_an_at_sign_or_is_left_out() {
        assert_eq!(split("sphere:0.2").unwrap(), ("sphere:0.2", None));
        assert_eq!(split("sphere:0.2@1,0,2").unwrap(), ("sphere:0.2", Some(parse("1,0,2").unwrap())));
        for (wrong, part) in [("box:1,1,1@", "x,y,z"), ("box:1,1,1@1,0", "x,y,z"), ("a@b,0,0", "`b`")] {
            let refused = split(wrong).unwrap_err();
            assert!(refused.starts_with("the pose after @ is wrong: "), "{wrong}: {refused}");
            assert!(refused.contains(part), "{wrong}: {refused}");
        }
    }
}

//! States of joints, as in `joint get` and `joint watch`.

use serde::Serialize;
use serde_json::Value;
use simd_client::{
    JointReading, RobotReading,
    proto::{JointFlag, JointType},
};

use super::blocked::BlockedBy;
use crate::output::{
    View,
    json::{self, Stamp},
    number::{ABSENT, fixed, several},
    table::{Column, Page, Table},
};

/// Units of a joint's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unit {
    Angle,
    Length,
    /// Several joints, or one with several values.
    Both,
}

impl Unit {
    /// Returns the unit of a joint; `None` if it has no values.
    pub(super) fn of(kind: JointType) -> Option<Self> {
        match kind {
            JointType::Revolute | JointType::Continuous => Some(Self::Angle),
            JointType::Prismatic => Some(Self::Length),
            // A quaternion has no unit.
            JointType::Planar | JointType::Floating | JointType::Spherical => Some(Self::Both),
            JointType::Fixed | JointType::Unspecified => None,
        }
    }

    /// Returns the unit of a column.
    pub(super) fn common(mut units: impl Iterator<Item = Self>) -> Self {
        let first = units.next().unwrap_or(Self::Angle);
        if units.all(|unit| unit == first) { first } else { Self::Both }
    }

    pub(super) fn heading(self, name: &str, unit: impl Fn(Self) -> &'static str) -> String {
        format!("{name} [{}]", unit(self))
    }

    pub(super) fn position(self) -> &'static str {
        ["rad", "m", "rad, m"][self as usize]
    }

    pub(super) fn velocity(self) -> &'static str {
        ["rad/s", "m/s", "rad/s, m/s"][self as usize]
    }

    pub(super) fn effort(self) -> &'static str {
        ["N m", "N", "N m, N"][self as usize]
    }
}

/// `joint get`, and a line of `joint watch`.
#[derive(Serialize)]
pub(super) struct ReadingView {
    robot: String,
    stamp: Stamp,
    joints: Vec<JointView>,
}

/// Values are numbers; arrays of them for planar, floating and spherical joints.
#[derive(Serialize)]
struct JointView {
    name: String,
    r#type: String,
    mode: String,
    /// Position, velocity or effort, as `mode` says; null if passive.
    target: Value,
    /// rad or m.
    position: Value,
    /// rad/s or m/s.
    velocity: Value,
    /// N m or N.
    effort: Value,
    saturated: bool,
    at_lower_limit: bool,
    at_upper_limit: bool,
    /// Link whose contact keeps it from its target; null if none.
    blocked_by: Option<BlockedBy>,
    #[serde(skip)]
    reading: JointReading,
}

impl From<RobotReading> for ReadingView {
    fn from(reading: RobotReading) -> Self {
        Self {
            robot: reading.robot,
            stamp: reading.stamp.into(),
            // A fixed joint has no values.
            joints: reading
                .joints
                .into_iter()
                .filter(|joint| !joint.position.is_empty())
                .map(JointView::from)
                .collect(),
        }
    }
}

impl From<JointReading> for JointView {
    fn from(joint: JointReading) -> Self {
        let mode = joint.mode.first().copied().unwrap_or_default();
        let mode = json::name("JOINT_MODE_", mode.as_str_name());
        let has_target = !matches!(mode.as_str(), "passive" | "none" | "unspecified");
        Self {
            name: joint.name.clone(),
            r#type: json::name("JOINT_TYPE_", joint.kind.as_str_name()),
            target: if has_target { value(&joint.target) } else { Value::Null },
            mode,
            position: value(&joint.position),
            velocity: value(&joint.velocity),
            effort: value(&joint.effort),
            saturated: joint.has(JointFlag::Saturated),
            at_lower_limit: joint.has(JointFlag::AtLowerLimit),
            at_upper_limit: joint.has(JointFlag::AtUpperLimit),
            blocked_by: joint.obstruction.clone().map(BlockedBy::from),
            reading: joint,
        }
    }
}

/// Returns a single number without a list.
fn value(values: &[f64]) -> Value {
    match values {
        [only] => Value::from(*only),
        several => Value::from(several.to_vec()),
    }
}

impl JointView {
    /// Returns flags such as `saturated, at upper limit, blocked by crate`.
    fn flags(&self) -> String {
        let flags = [
            (self.saturated, "saturated"),
            (self.at_lower_limit, "at lower limit"),
            (self.at_upper_limit, "at upper limit"),
        ];
        let mut set: Vec<String> =
            flags.iter().filter(|(is_set, _)| *is_set).map(|(_, name)| (*name).to_owned()).collect();
        set.extend(self.blocked_by.iter().map(|blocked_by| format!("blocked by {}", blocked_by.name())));
        if set.is_empty() { ABSENT.to_owned() } else { set.join(", ") }
    }

    fn row(&self) -> Vec<String> {
        vec![
            self.name.clone(),
            self.mode.clone(),
            if self.target.is_null() { ABSENT.to_owned() } else { several(&self.reading.target, 4) },
            several(&self.reading.position, 4),
            several(&self.reading.velocity, 4),
            several(&self.reading.effort, 4),
            self.flags(),
        ]
    }
}

impl View for ReadingView {
    fn page(&self) -> Page {
        let unit = Unit::common(self.joints.iter().filter_map(|joint| Unit::of(joint.reading.kind)));
        let columns = vec![
            Column::left("JOINT"),
            Column::left("MODE"),
            Column::right("TARGET"),
            Column::right(unit.heading("POSITION", Unit::position)),
            Column::right(unit.heading("VELOCITY", Unit::velocity)),
            Column::right(unit.heading("EFFORT", Unit::effort)),
            Column::left("FLAGS"),
        ];
        Page::new().table(Table::new(columns, self.joints.iter().map(JointView::row).collect()))
    }
}

/// A line of `joint watch`: the time, then the position of each joint.
#[derive(Serialize)]
#[serde(transparent)]
pub(super) struct Sample(pub(super) ReadingView);

impl View for Sample {
    fn page(&self) -> Page {
        let mut line = format!("{:>10} s", fixed(self.0.stamp.sim_time, 3));
        for joint in &self.0.joints {
            // As wide as any angle, so that columns do not move with a sign.
            line.push_str(&format!("  {}={:>8}", joint.name, several(&joint.reading.position, 4)));
        }
        Page::of_line(line)
    }
}

#[cfg(test)]
mod tests {
    use simd_client::proto::{JointMode, JointObstruction};

    use super::*;

    fn reading() -> RobotReading {
        let joint = |name: &str, position: &[f64], mode, flags| JointReading {
            name: name.into(),
            kind: if position.is_empty() { JointType::Fixed } else { JointType::Revolute },
            position: position.into(),
            velocity: position.iter().map(|_| 0.0).collect(),
            effort: position.iter().map(|_| -1.5).collect(),
            target: position.iter().map(|_| 0.5).collect(),
            mode: position.iter().map(|_| mode).collect(),
            flags: position.iter().map(|_| flags).collect(),
            obstruction: None,
        };
        RobotReading {
            robot: "arm".into(),
            stamp: simd_client::proto::Stamp { sim_time: 1.25, step: 1250, ..Default::default() },
            joints: vec![
                joint("left elbow", &[0.499_99], JointMode::Position, JointFlag::Saturated as u32),
                joint("flange", &[], JointMode::None, 0),
                joint("wrist", &[-0.25], JointMode::Passive, 0),
            ],
        }
    }

    #[test]
    fn a_table_has_a_row_for_each_joint_that_moves() {
        let expected = "\
JOINT       MODE      TARGET  POSITION [rad]  VELOCITY [rad/s]  EFFORT [N m]  FLAGS
left elbow  position  0.5000          0.5000            0.0000       -1.5000  saturated
wrist       passive        -         -0.2500            0.0000       -1.5000  -
";
        assert_eq!(ReadingView::from(reading()).page().render(false), expected);
    }

    #[test]
    fn a_joint_that_is_blocked_says_by_what() {
        let mut reading = reading();
        reading.joints[0].obstruction = Some(JointObstruction {
            joint: "left elbow".into(),
            link: "forearm".into(),
            by_robot: "crate".into(),
            by_link: String::new(),
            effort: -1.4,
        });
        let view = ReadingView::from(reading.clone());
        assert!(view.page().render(false).contains("  saturated, blocked by crate\n"));
        let json = serde_json::to_value(&view).unwrap();
        assert_eq!(json["joints"][0]["blocked_by"]["own_link"], "forearm");
        assert_eq!(json["joints"][1]["blocked_by"], Value::Null);
        reading.joints[0].obstruction.as_mut().unwrap().by_link = "lid".into();
        assert!(ReadingView::from(reading).page().render(false).contains("blocked by crate/lid\n"));
    }

    #[test]
    fn a_sample_is_the_time_and_then_a_column_for_each_joint() {
        let expected = "     1.250 s  left elbow=  0.5000  wrist= -0.2500\n";
        assert_eq!(Sample(reading().into()).page().render(false), expected);
    }

    #[test]
    fn json_keeps_its_field_names_and_all_digits() {
        let json = serde_json::to_value(ReadingView::from(reading())).unwrap();
        assert_eq!(json["robot"], "arm");
        assert_eq!(json["stamp"]["step"], 1250);
        assert_eq!(json["joints"][0]["position"], 0.499_99);
        assert_eq!(json["joints"][0]["saturated"], true);
        assert_eq!(json["joints"][1]["target"], Value::Null);
        assert_eq!(json["joints"].as_array().unwrap().len(), 2);
    }
}

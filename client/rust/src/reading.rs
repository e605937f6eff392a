//! Joint states with the names of the joints: packed arrays, unpacked by the layout.

use simd_proto::v1::{
    JointFlag, JointInfo, JointLayout, JointMode, JointObstruction, JointSelection, JointStates, JointType,
    RobotJointStates, Stamp,
};

use crate::{Error, client::present};

/// State of one robot's joints, or of the selected ones.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotReading {
    /// Name of the robot.
    pub robot: String,
    /// Moment of the state.
    pub stamp: Stamp,
    /// In the order of the layout, or of the selection if it names joints.
    pub joints: Vec<JointReading>,
}

/// State of one joint. The arrays hold one value for revolute, continuous and prismatic joints and none for
/// fixed ones; see `JointInfo` for the others.
#[derive(Clone, Debug, PartialEq)]
pub struct JointReading {
    /// Name of the joint.
    pub name: String,
    /// Type of the joint.
    pub kind: JointType,
    /// rad or m.
    pub position: Vec<f64>,
    /// rad/s or m/s.
    pub velocity: Vec<f64>,
    /// Effort that the actuator applied over the last step, N m or N.
    pub effort: Vec<f64>,
    /// A position, a velocity or an effort, as `mode` says.
    pub target: Vec<f64>,
    /// Mode of the actuator.
    pub mode: Vec<JointMode>,
    /// Bit sets of `JointFlag`.
    pub flags: Vec<u32>,
    /// Link whose contact keeps the joint from its target.
    pub obstruction: Option<JointObstruction>,
}

impl JointReading {
    /// Returns whether the flag is set, on any axis.
    pub fn has(&self, flag: JointFlag) -> bool {
        self.flags.iter().any(|flags| flags & (flag as u32) != 0)
    }
}

impl RobotReading {
    /// Returns whether the states have the layout. If not, the robot was reloaded or respawned, and its
    /// layout must be fetched again.
    pub fn fits(layout: &JointLayout, states: &JointStates) -> bool {
        states
            .robots
            .iter()
            .filter(|robot| robot.robot == layout.robot)
            .all(|robot| robot.layout_version == layout.layout_version)
    }

    /// Splits states, requested by `selection`, by joint.
    ///
    /// # Errors
    /// [`Error::LayoutChanged`] if they have another layout, [`Error::Answer`] if they lack the robot or have
    /// arrays of other lengths than the layout.
    pub fn new(
        layout: &JointLayout,
        selection: &JointSelection,
        states: &JointStates,
    ) -> Result<Self, Error> {
        let robot = states.robots.iter().find(|robot| robot.robot == layout.robot);
        let robot = present(robot, "robots")?;
        if robot.layout_version != layout.layout_version {
            return Err(Error::LayoutChanged { robot: layout.robot.clone() });
        }
        let joints = if selection.joints.is_empty() {
            layout.joints.iter().map(|info| read(info, robot, indices_in_layout(info))).collect()
        } else {
            selected(layout, &selection.joints, robot)
        };
        Ok(Self {
            robot: robot.robot.clone(),
            stamp: present(states.stamp, "stamp")?,
            joints: joints.map_err(|()| Error::Answer {
                reason: format!("the joint states of `{}` do not have the length of its layout", robot.robot),
            })?,
        })
    }
}

/// Index of a joint's first position, number of its positions, and the same for velocities.
type Indices = (usize, usize, usize, usize);

fn indices_in_layout(info: &JointInfo) -> Indices {
    let (position_count, velocity_count) = (info.position_count as usize, info.velocity_count as usize);
    (info.position_index as usize, position_count, info.velocity_index as usize, velocity_count)
}

/// Splits the states of a selection, which are packed in its order.
fn selected(
    layout: &JointLayout,
    names: &[String],
    robot: &RobotJointStates,
) -> Result<Vec<JointReading>, ()> {
    let (mut position, mut velocity) = (0, 0);
    names
        .iter()
        .map(|name| {
            let info = layout.joints.iter().find(|info| info.name == *name).ok_or(())?;
            let (_, position_count, _, velocity_count) = indices_in_layout(info);
            let reading = read(info, robot, (position, position_count, velocity, velocity_count));
            position += position_count;
            velocity += velocity_count;
            reading
        })
        .collect()
}

fn read(info: &JointInfo, robot: &RobotJointStates, indices: Indices) -> Result<JointReading, ()> {
    let (position, position_count, velocity, velocity_count) = indices;
    let per_velocity = |values: &[f64]| slice(values, velocity, velocity_count).map(<[f64]>::to_vec);
    let modes = slice(&robot.mode, velocity, velocity_count)?;
    Ok(JointReading {
        name: info.name.clone(),
        kind: info.r#type(),
        position: slice(&robot.position, position, position_count)?.to_vec(),
        velocity: per_velocity(&robot.velocity)?,
        effort: per_velocity(&robot.effort)?,
        target: per_velocity(&robot.target)?,
        mode: modes.iter().map(|mode| JointMode::try_from(*mode).unwrap_or_default()).collect(),
        flags: slice(&robot.flags, velocity, velocity_count)?.to_vec(),
        obstruction: robot.obstructions.iter().find(|found| found.joint == info.name).cloned(),
    })
}

fn slice<T>(values: &[T], begin: usize, count: usize) -> Result<&[T], ()> {
    values.get(begin..begin.saturating_add(count)).ok_or(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{every_joint, some_joints};

    fn joint(name: &str, kind: JointType, first: u32, count: u32) -> JointInfo {
        JointInfo {
            name: name.into(),
            r#type: kind.into(),
            position_index: first,
            position_count: count,
            velocity_index: first,
            velocity_count: count,
            ..Default::default()
        }
    }

    fn layout() -> JointLayout {
        JointLayout {
            robot: "arm".into(),
            layout_version: 7,
            joints: vec![
                joint("shoulder", JointType::Revolute, 0, 1),
                joint("flange", JointType::Fixed, 1, 0),
                joint("elbow", JointType::Continuous, 1, 1),
            ],
            position_count: 2,
            velocity_count: 2,
        }
    }

    fn states(values: &[f64], flags: &[u32]) -> JointStates {
        let robot = RobotJointStates {
            robot: "arm".into(),
            layout_version: 7,
            position: values.to_vec(),
            velocity: values.to_vec(),
            effort: values.to_vec(),
            target: values.to_vec(),
            mode: vec![JointMode::Effort.into(); values.len()],
            flags: flags.to_vec(),
            unchanged: false,
            obstructions: Vec::new(),
        };
        JointStates { stamp: Some(Stamp::default()), robots: vec![robot] }
    }

    #[test]
    fn a_whole_robot_is_read_by_its_layout() {
        let reading =
            RobotReading::new(&layout(), &every_joint("arm"), &states(&[1.0, 2.0], &[0, 3])).unwrap();
        let positions: Vec<_> =
            reading.joints.iter().map(|j| (j.name.as_str(), j.position.as_slice())).collect();
        assert_eq!(positions, [("shoulder", [1.0].as_slice()), ("flange", &[]), ("elbow", &[2.0])]);
        let elbow = &reading.joints[2];
        assert_eq!(elbow.mode, [JointMode::Effort]);
        assert!(elbow.has(JointFlag::Saturated) && elbow.has(JointFlag::AtLowerLimit));
        assert!(!elbow.has(JointFlag::AtUpperLimit) && !reading.joints[0].has(JointFlag::Saturated));
    }

    #[test]
    fn a_selection_is_read_in_its_own_order() {
        let selection = some_joints("arm", ["elbow", "shoulder"]);
        let reading = RobotReading::new(&layout(), &selection, &states(&[2.0, 1.0], &[0, 0])).unwrap();
        let positions: Vec<_> = reading.joints.iter().map(|j| (j.name.as_str(), j.position[0])).collect();
        assert_eq!(positions, [("elbow", 2.0), ("shoulder", 1.0)]);
    }

    #[test]
    fn states_of_another_layout_or_length_are_refused() {
        let mut other = layout();
        other.layout_version = 8;
        let states_now = states(&[1.0, 2.0], &[0, 0]);
        assert!(!RobotReading::fits(&other, &states_now));
        let changed = RobotReading::new(&other, &every_joint("arm"), &states_now);
        assert!(matches!(changed, Err(Error::LayoutChanged { .. })));
        let short = RobotReading::new(&layout(), &every_joint("arm"), &states(&[1.0], &[0]));
        assert!(matches!(short, Err(Error::Answer { .. })));
    }
}

//! How a robot begins, as far as its description says: drives and first positions of its joints, named
//! states, what of it touches what, and what holds links together beside the joints. A spawn may ask for something else.

use std::collections::BTreeSet;

use glamx::{DPose3, DVec3};

use crate::sensor::Sensor;

/// What a description says beside the links and joints themselves. Indices are those of the model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Setup {
    /// Joints of which something is said, in the order of their indices, each once.
    pub joints: Vec<JointSetup>,
    /// In the order of the file; no two of a group have one name.
    pub states: Vec<NamedState>,
    /// Its links touch each other.
    pub self_collision: bool,
    /// Pairs of links that do not touch, or do whatever joints connect them.
    pub pairs: Vec<LinkPair>,
    /// Links of which groups are given.
    pub groups: Vec<LinkGroups>,
    /// In the order of the file.
    pub constraints: Vec<LinkConstraint>,
    /// In the order of the file; no two have one name.
    pub sensors: Vec<Sensor>,
}

/// What holds two links together, or a link and the world, beside the tree of joints.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkConstraint {
    /// As in the file; empty where it gives none.
    pub name: String,
    /// What it asks for.
    pub kind: LinkConstraintKind,
    /// Parent and child. At least one of them is of the robot itself.
    pub ends: [ConstraintEnd; 2],
    /// N, at least 0; of a gear the effort on the child's joint, N m or N. `None`: no limit.
    pub max_force: Option<f64>,
    /// N m, at least 0. `None`: no limit.
    pub max_torque: Option<f64>,
    /// The two links touch each other all the same.
    pub collisions: bool,
}

/// What a constraint asks for. Axes are in the frames of both ends, of length 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LinkConstraintKind {
    /// The frames are one.
    Weld,
    /// Their origins are one.
    PointToPoint,
    /// What is left is a turn about the axis.
    Hinge(DVec3),
    /// What is left is a shift along the axis.
    Slide(DVec3),
    /// Position of the child's joint = ratio * position of the parent's + offset.
    Gear {
        /// Of the units of the two joints.
        ratio: f64,
        /// rad or m. `None`: as the robot begins.
        offset: Option<f64>,
    },
    /// The origins are so far from each other.
    Distance {
        /// Metres. `None`: as the robot begins.
        length: Option<f64>,
        /// They may be nearer.
        is_rope: bool,
    },
}

/// An end of a constraint.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstraintEnd {
    /// What it is on.
    pub on: ConstraintOn,
    /// `link_from_frame`; of the world in the frame that the root link begins at. `None`: of the parent the link's own,
    /// of the child where the parent's is as the robot begins.
    pub pose: Option<DPose3>,
}

/// What an end of a constraint is on. Of a gear it is a joint, by its index or its name, and of all others a link.
#[derive(Clone, Debug, PartialEq)]
pub enum ConstraintOn {
    /// The world.
    World,
    /// Of the robot, by index.
    Own(usize),
    /// Of another robot that comes at the same moment.
    Other {
        /// The other one's name in its description.
        robot: String,
        /// The name of the link or joint.
        name: String,
    },
}

/// How a joint of one axis or a ball joint begins. What it says is for each axis of a ball joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointSetup {
    /// Index of the joint.
    pub joint: usize,
    /// Rotor inertia seen at the joint, kg m^2 or kg, at least 0.
    pub armature: f64,
    /// Acts beside whatever drives the joint.
    pub spring: Option<Spring>,
    /// rad or m; none of a ball joint.
    pub position: Option<f64>,
    /// What its actuator does first; `None`: it holds its position.
    pub mode: Option<DriveMode>,
    /// Stiffness of position targets that give none, N m/rad or N/m, at least 0.
    pub stiffness: Option<f64>,
    /// Damping of targets that give none, N m s/rad or N s/m, at least 0.
    pub damping: Option<f64>,
}

/// What an actuator does first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveMode {
    /// Nothing.
    Passive,
    /// Keeps the velocity 0.
    Velocity,
    /// Applies the effort 0.
    Effort,
}

/// A spring at a joint: effort = stiffness (rest - position). Of a ball joint the position is its rotation vector, in the child's axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spring {
    /// N m/rad or N/m, above 0.
    pub stiffness: f64,
    /// The position at which it pulls nowhere, rad or m; 0 of a ball joint.
    pub rest: f64,
}

/// Positions of joints under a name.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedState {
    /// Its name.
    pub name: String,
    /// The group of joints that it is of; empty where there is none.
    pub group: String,
    /// Index of the joint, and rad or m.
    pub positions: Vec<(usize, f64)>,
}

/// Two links that are switched off or on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkPair {
    /// Their indices.
    pub links: [usize; 2],
    /// They touch.
    pub enabled: bool,
}

/// The groups of a link, a bit each. Two links may touch where one is in a group that the other touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkGroups {
    /// Index of the link.
    pub link: usize,
    /// The groups that it is in.
    pub group: u32,
    /// The groups that it touches.
    pub mask: u32,
}

impl Setup {
    /// What is said of a joint, to be added to.
    pub(crate) fn joint(&mut self, joint: usize) -> &mut JointSetup {
        let at = match self.joints.binary_search_by_key(&joint, |setup| setup.joint) {
            Ok(at) => at,
            Err(at) => {
                self.joints.insert(at, JointSetup { joint, ..JointSetup::default() });
                at
            }
        };
        &mut self.joints[at]
    }

    /// Names of the other robots that constraints are on, each once.
    pub fn partners(&self) -> BTreeSet<&str> {
        let ends = self.constraints.iter().flat_map(|constraint| &constraint.ends);
        ends.filter_map(|end| match &end.on {
            ConstraintOn::Other { robot, .. } => Some(robot.as_str()),
            ConstraintOn::World | ConstraintOn::Own(_) => None,
        })
        .collect()
    }

    /// Adds states; of those of one name the first is kept. Gives the names of those that are left out.
    pub fn add_states(&mut self, states: Vec<NamedState>) -> Vec<String> {
        let mut left_out = Vec::new();
        for state in states {
            if self.states.iter().any(|known| known.name == state.name && known.group == state.group) {
                left_out.push(state.name);
            } else {
                self.states.push(state);
            }
        }
        left_out
    }
}

impl JointSetup {
    /// Whether nothing is said.
    pub fn is_silent(&self) -> bool {
        *self == Self { joint: self.joint, ..Self::default() }
    }
}

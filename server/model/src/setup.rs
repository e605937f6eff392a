//! Initial state of a robot from its description: drives and positions of its joints, named states, collision
//! filters, and constraints in addition to the joints. A spawn may override it.

use std::collections::BTreeSet;

use glamx::{DPose3, DVec3};

use crate::sensor::Sensor;

/// Settings of a description in addition to its links and joints. Indices refer to the model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Setup {
    /// Joints with settings, in the order of their indices, each once.
    pub joints: Vec<JointSetup>,
    /// In the order of the file; names are unique within a group.
    pub states: Vec<NamedState>,
    /// Whether its links collide with each other.
    pub self_collision: bool,
    /// It does not sleep, also where a world lets bodies sleep.
    pub stays_awake: bool,
    /// Pairs of links that do not touch, or do whatever joints connect them.
    pub pairs: Vec<LinkPair>,
    /// Links with collision groups.
    pub groups: Vec<LinkGroups>,
    /// In the order of the file.
    pub constraints: Vec<LinkConstraint>,
    /// In the order of the file; names are unique.
    pub sensors: Vec<Sensor>,
    /// Joints whose positions are sums of others.
    pub tendons: Vec<Tendon>,
}

/// A joint whose position is a sum of the positions of others. Its link has no mass and carries nothing: its
/// drive, spring, damping, friction, armature and limits act on the others, multiplied by their factors.
#[derive(Clone, Debug, PartialEq)]
pub struct Tendon {
    /// Index of the joint, which has one axis.
    pub joint: usize,
    /// Indices of the others, each once and of one axis, and their factors, none 0.
    pub terms: Vec<(usize, f64)>,
    /// Added to the sum, rad or m.
    pub offset: f64,
}

/// A constraint of two links, or of a link and the world, in addition to the tree of joints.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkConstraint {
    /// Name in the file; empty if it has none.
    pub name: String,
    /// Kind of the constraint.
    pub kind: LinkConstraintKind,
    /// Parent and child. At least one of them belongs to the robot itself.
    pub ends: [ConstraintEnd; 2],
    /// N, at least 0; for a gear, the effort on the child's joint, N m or N. `None`: no limit.
    pub max_force: Option<f64>,
    /// N m, at least 0. `None`: no limit.
    pub max_torque: Option<f64>,
    /// Whether the two links collide nevertheless.
    pub collisions: bool,
}

/// Kind of a constraint. Axes are unit vectors in the frames of both ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LinkConstraintKind {
    /// The frames coincide.
    Weld,
    /// Their origins coincide.
    PointToPoint,
    /// The ends turn about the axis.
    Hinge(DVec3),
    /// The ends slide along the axis.
    Slide(DVec3),
    /// Position of the child's joint = ratio * position of the parent's + offset.
    Gear {
        /// In the units of the two joints.
        ratio: f64,
        /// rad or m. `None`: its initial value.
        offset: Option<f64>,
    },
    /// The origins have a distance.
    Distance {
        /// Metres. `None`: the initial distance.
        length: Option<f64>,
        /// Whether they may be nearer.
        is_rope: bool,
    },
}

/// An end of a constraint.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstraintEnd {
    /// Object of the end.
    pub on: ConstraintOn,
    /// `link_from_frame`; for the world, in the initial frame of the root link. `None` for the parent: the
    /// link's own frame. `None` for the child: the parent's frame at the start.
    pub pose: Option<DPose3>,
}

/// Object of a constraint's end. For a gear it is a joint, by its index or its name; for all others a link.
#[derive(Clone, Debug, PartialEq)]
pub enum ConstraintOn {
    /// The world.
    World,
    /// A link or joint of the robot, by index.
    Own(usize),
    /// A link or joint of another robot that is spawned at the same moment.
    Other {
        /// Name of the other robot in its description.
        robot: String,
        /// Name of the link or joint.
        name: String,
    },
}

/// Initial state of a joint with one axis or of a ball joint. For a ball joint, values apply to each axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointSetup {
    /// Index of the joint.
    pub joint: usize,
    /// Rotor inertia seen at the joint, kg m^2 or kg, at least 0.
    pub armature: f64,
    /// Acts in addition to the drive of the joint.
    pub spring: Option<Spring>,
    /// rad or m; `None` for a ball joint.
    pub position: Option<f64>,
    /// First mode of its actuator; `None`: it holds its position.
    pub mode: Option<DriveMode>,
    /// Default stiffness of position targets, N m/rad or N/m, at least 0.
    pub stiffness: Option<f64>,
    /// Default damping of targets, N m s/rad or N s/m, at least 0.
    pub damping: Option<f64>,
    /// Whether the actuator holds the weight of the links beyond the joint, in addition to its targets.
    pub gravity_compensation: bool,
}

/// First mode of an actuator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveMode {
    /// No effort.
    Passive,
    /// Velocity target 0.
    Velocity,
    /// Effort target 0.
    Effort,
}

/// A spring at a joint: effort = stiffness (rest - position). The position of a ball joint is its rotation
/// vector, in the child's axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spring {
    /// N m/rad or N/m, above 0.
    pub stiffness: f64,
    /// Rest position, rad or m; 0 for a ball joint.
    pub rest: f64,
}

/// Joint positions with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedState {
    /// Its name.
    pub name: String,
    /// Its group of joints; empty if none.
    pub group: String,
    /// Index of the joint, and rad or m.
    pub positions: Vec<(usize, f64)>,
}

/// Two links whose collision is switched off or on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkPair {
    /// Their indices.
    pub links: [usize; 2],
    /// Whether they collide.
    pub enabled: bool,
}

/// Collision groups of a link, a bit each. Two links may collide if one is in a group of the other's mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkGroups {
    /// Index of the link.
    pub link: usize,
    /// Groups that it is in.
    pub group: u32,
    /// Groups that it collides with.
    pub mask: u32,
}

impl Setup {
    /// Returns the settings of a joint, for changes.
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

    /// Returns the tendon of a joint, if it has one.
    pub fn tendon(&self, joint: usize) -> Option<&Tendon> {
        self.tendons.iter().find(|tendon| tendon.joint == joint)
    }

    /// Returns the names of the other robots in constraints, each once.
    pub fn partners(&self) -> BTreeSet<&str> {
        let ends = self.constraints.iter().flat_map(|constraint| &constraint.ends);
        ends.filter_map(|end| match &end.on {
            ConstraintOn::Other { robot, .. } => Some(robot.as_str()),
            ConstraintOn::World | ConstraintOn::Own(_) => None,
        })
        .collect()
    }

    /// Adds states; keeps the first of each name. Returns the names of those that are left out.
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
    /// Returns whether it has no settings.
    pub fn is_silent(&self) -> bool {
        *self == Self { joint: self.joint, ..Self::default() }
    }
}

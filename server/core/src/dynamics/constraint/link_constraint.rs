//! A constraint between two links, or a link and the world: what it asks for, and what it remembers from step to step.

use glamx::{DPose3, DVec3};
use serde::{Deserialize, Serialize};

use super::link_rows::{Aim, Motion};
use crate::plain::{pose3, vector3};

/// Constraints of a world at the most.
pub const MAX_CONSTRAINTS: usize = 4_096;

/// Bytes of a constraint's name at the most.
pub const MAX_CONSTRAINT_NAME: usize = 256;

/// What two links may not do against each other. Axes are of unit length, in the frames of both ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum ConstraintKind {
    /// The two frames are one.
    Weld,
    /// The origins of the two frames are one.
    PointToPoint,
    /// The origins are one, and so are the axes: what is left is a turn about the axis.
    Hinge {
        /// About which the second turns.
        #[serde(with = "vector3")]
        axis: DVec3,
    },
    /// The orientations are one, and so are the axes: what is left is a shift along the axis.
    Slide {
        /// Along which the second slides.
        #[serde(with = "vector3")]
        axis: DVec3,
    },
    /// Position of the joint above the second link = ratio * position of that above the first + offset.
    Gear {
        /// Of the units of the two joints.
        ratio: f64,
        /// rad or m.
        offset: f64,
    },
    /// The origins of the two frames are so far from each other.
    Distance {
        /// Metres.
        length: f64,
        /// They may be nearer: a rope, and not a rod.
        is_rope: bool,
    },
}

/// One end of a constraint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConstraintEnd {
    /// Indices of the robot, and of the link in its model; `None`: the world.
    pub link: Option<(usize, usize)>,
    /// `link_from_frame`, or `world_from_frame`.
    #[serde(with = "pose3")]
    pub frame: DPose3,
}

/// What a constraint is, until a command changes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConstraintDefinition {
    /// Unique in the world.
    pub name: String,
    /// Parent and child.
    pub ends: [ConstraintEnd; 2],
    /// What it asks for.
    pub kind: ConstraintKind,
    /// Its force is at most this, N; of a gear the effort on the second joint, N m or N. May be infinite.
    pub max_force: f64,
    /// Its torque is at most this, N m. May be infinite.
    pub max_torque: f64,
    /// It goes where it needs more.
    pub breaks: bool,
    /// The two links do not touch each other.
    pub disable_collisions: bool,
}

/// A constraint: what a save copies and a fingerprint reads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinkConstraint {
    /// What it is.
    pub definition: ConstraintDefinition,
    /// Of the last part of the last step, N s and N m s, along the axes of its rows: force, then torque.
    pub impulses: [[f64; 3]; 2],
    /// They are those of a solution with the least impulses, and not of sweeps.
    pub is_least: bool,
    /// What foresees how far it leaves a tangent; `None` where something else than a step has moved it.
    pub motion: Option<[Motion; 2]>,
    /// Something else than a step has moved what it asks for, or what it is on: it is to take along what it holds.
    pub is_dragged: bool,
    /// What it does and how well it holds.
    pub reading: Reading,
}

/// What a constraint did over the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// The sum of the impulses on the second link over the parts of the step, world, N s.
    #[serde(with = "vector3")]
    pub force: DVec3,
    /// About `point`, N m s.
    #[serde(with = "vector3")]
    pub torque: DVec3,
    /// Force of the last part, world, N s.
    #[serde(with = "vector3")]
    pub last_force: DVec3,
    /// Torque of the last part, N m s.
    #[serde(with = "vector3")]
    pub last_torque: DVec3,
    /// Where the force acts on both, world.
    #[serde(with = "vector3")]
    pub point: DVec3,
    /// How far the last step found it from what it asks for: metres, and rad; of a gear the unit of the second joint.
    pub errors: [f64; 2],
    /// By how much slower than [`ERROR_REDUCTION`](super::ERROR_REDUCTION) of it a step the last step put that right: what other
    /// constraints did not let it reach. m/s, and rad/s.
    pub residuals: [f64; 2],
    /// It did what it may do at the most.
    pub is_saturated: bool,
}

impl ConstraintDefinition {
    /// Indices of the robots that it is on.
    pub fn robots(&self) -> impl Iterator<Item = usize> + use<> {
        self.ends.map(|end| end.link.map(|(robot, _)| robot)).into_iter().flatten()
    }
}

impl LinkConstraint {
    /// One that has not acted yet.
    pub fn new(definition: ConstraintDefinition) -> Self {
        Self {
            definition,
            impulses: [[0.0; 3]; 2],
            is_least: false,
            motion: None,
            is_dragged: false,
            reading: Reading::default(),
        }
    }

    /// Something else than a step has moved what it is on.
    pub fn forget_motion(&mut self) {
        (self.motion, self.is_dragged) = (None, true);
    }

    /// Forgets the last step.
    pub fn forget_step(&mut self) {
        (self.impulses, self.is_least, self.motion) = ([[0.0; 3]; 2], false, None);
        (self.is_dragged, self.reading) = (false, Reading::default());
    }

    /// It has not acted in a part of a step.
    pub fn skip_part(&mut self) {
        (self.impulses, self.is_least, self.motion) = ([[0.0; 3]; 2], false, None);
        (self.reading.last_force, self.reading.last_torque) = (DVec3::ZERO, DVec3::ZERO);
    }

    /// Before a step.
    pub fn begin_step(&mut self) {
        (self.reading.force, self.reading.torque) = (DVec3::ZERO, DVec3::ZERO);
        self.reading.is_saturated = false;
    }

    /// Keeps forces as they are where steps and their parts become longer by these factors.
    pub fn stretch(&mut self, step: f64, part: f64) {
        self.reading.force *= step;
        self.reading.torque *= step;
        self.reading.last_force *= part;
        self.reading.last_torque *= part;
        self.impulses.iter_mut().flatten().for_each(|impulse| *impulse *= part);
        self.motion = None;
    }

    /// The axes of its rows and its errors along them, with the two frames where they are, world. A gear has others.
    pub(in crate::dynamics) fn aims(&self, [a, b]: [DPose3; 2]) -> [Aim; 2] {
        let own = [DVec3::X, DVec3::Y, DVec3::Z];
        let across = b.translation - a.translation;
        let along = |axes: [DVec3; 3]| {
            let axes = axes.map(|axis| a.rotation * axis);
            Aim { axes, errors: axes.map(|axis| axis.dot(across)) }
        };
        match self.definition.kind {
            ConstraintKind::Weld => [along(own), turned(a, b)],
            ConstraintKind::PointToPoint => [along(own), Aim::default()],
            ConstraintKind::Hinge { axis } => {
                let (t, u) = axis.any_orthonormal_pair();
                let [t, u] = [t, u].map(|axis| a.rotation * axis);
                let [from, to] = [a, b].map(|frame| frame.rotation * axis);
                let cross = from.cross(to);
                let (sine, cosine) = (cross.length(), from.dot(to));
                // Where the axes are opposite, any way round will do.
                let way = if sine > 0.0 { cross / sine } else { t };
                let error = way * sine.atan2(cosine);
                let errors = [error.dot(t), error.dot(u), 0.0];
                [along(own), Aim { axes: [t, u, DVec3::ZERO], errors }]
            }
            ConstraintKind::Slide { axis } => {
                let (t, u) = axis.any_orthonormal_pair();
                [along([t, u, DVec3::ZERO]), turned(a, b)]
            }
            ConstraintKind::Distance { length, .. } => {
                let present = across.length();
                // What is at one place may leave it in any direction.
                let way = if present > 0.0 { across / present } else { a.rotation * DVec3::X };
                // The impulse pulls where it is positive.
                let axes = [-way, DVec3::ZERO, DVec3::ZERO];
                [Aim { axes, errors: [length - present, 0.0, 0.0] }, Aim::default()]
            }
            ConstraintKind::Gear { .. } => [Aim::default(); 2],
        }
    }
}

/// How the second frame is turned against the first: the rotation vector, in the axes of the first.
fn turned(a: DPose3, b: DPose3) -> Aim {
    let rotation = a.rotation.inverse() * b.rotation;
    let rotation = if rotation.w < 0.0 { -rotation } else { rotation };
    let part = DVec3::new(rotation.x, rotation.y, rotation.z);
    let sine = part.length();
    // Of tiny angles all digits count: links at rest are that far off.
    let factor = if sine > f64::MIN_POSITIVE { 2.0 * sine.atan2(rotation.w) / sine } else { 2.0 };
    let errors = (part * factor).to_array();
    Aim { axes: [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| a.rotation * axis), errors }
}

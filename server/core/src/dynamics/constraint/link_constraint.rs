//! Constraint between two links, or between a link and the world: its definition, and its state between
//! steps.

use glamx::{DPose3, DVec3};
use serde::{Deserialize, Serialize};

use super::link_rows::{Aim, Motion};
use crate::plain::{pose3, vector3};

/// Maximum number of constraints of a world.
pub const MAX_CONSTRAINTS: usize = 4_096;

/// Maximum length of a constraint's name, bytes.
pub const MAX_CONSTRAINT_NAME: usize = 256;

/// Type of a constraint. Axes are of unit length, in the frames of both ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum ConstraintKind {
    /// The two frames coincide.
    Weld,
    /// The origins of the two frames coincide.
    PointToPoint,
    /// The origins coincide, and so do the axes: only a turn about the axis remains.
    Hinge {
        /// Axis of rotation of the second link.
        #[serde(with = "vector3")]
        axis: DVec3,
    },
    /// The orientations coincide, and so do the axes: only a shift along the axis remains.
    Slide {
        /// Direction in which the second link slides.
        #[serde(with = "vector3")]
        axis: DVec3,
    },
    /// Position of the joint above the second link = ratio * position of the joint above the first + offset.
    Gear {
        /// Ratio, in the units of the two joints.
        ratio: f64,
        /// Offset, rad or m.
        offset: f64,
    },
    /// The origins of the two frames have a fixed distance.
    Distance {
        /// Distance, metres.
        length: f64,
        /// Whether they may be nearer: a rope, and not a rod.
        is_rope: bool,
    },
}

/// One end of a constraint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConstraintEnd {
    /// Robot and link in its model, by index; `None`: the world.
    pub link: Option<(usize, usize)>,
    /// `link_from_frame`, or `world_from_frame`.
    #[serde(with = "pose3")]
    pub frame: DPose3,
}

/// Definition of a constraint, which only commands change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConstraintDefinition {
    /// Name, unique in the world.
    pub name: String,
    /// Parent and child.
    pub ends: [ConstraintEnd; 2],
    /// Type of the constraint.
    pub kind: ConstraintKind,
    /// Maximum force, N; for a gear the maximum effort on the second joint, N m or N. May be infinite.
    pub max_force: f64,
    /// Maximum torque, N m. May be infinite.
    pub max_torque: f64,
    /// Whether it is removed once it needs more than the maximum.
    pub breaks: bool,
    /// Whether collisions between the two links are disabled.
    pub disable_collisions: bool,
}

/// A constraint with its state, which saves copy and fingerprints read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinkConstraint {
    /// Definition, which only commands change.
    pub definition: ConstraintDefinition,
    /// Impulses of the last part of the last step, N s and N m s, along the axes of its rows: force, then
    /// torque.
    pub impulses: [[f64; 3]; 2],
    /// Whether the impulses come from a solution with the least impulses, and not from sweeps.
    pub is_least: bool,
    /// Prediction of how far it leaves a tangent; `None` if it was moved other than by a step.
    pub motion: Option<[Motion; 2]>,
    /// Whether its target or a link of it was moved other than by a step: it then drags the links that it
    /// holds.
    pub is_dragged: bool,
    /// Loads and errors.
    pub reading: Reading,
}

/// Loads and errors of a constraint over the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Sum of the impulses on the second link over the parts of the step, world, N s.
    #[serde(with = "vector3")]
    pub force: DVec3,
    /// Sum of the angular impulses about `point`, N m s.
    #[serde(with = "vector3")]
    pub torque: DVec3,
    /// Impulse of the last part, world, N s.
    #[serde(with = "vector3")]
    pub last_force: DVec3,
    /// Angular impulse of the last part, N m s.
    #[serde(with = "vector3")]
    pub last_torque: DVec3,
    /// Point at which the force acts on both links, world.
    #[serde(with = "vector3")]
    pub point: DVec3,
    /// Errors at the start of the last step: metres, and rad; for a gear the unit of the second joint.
    pub errors: [f64; 2],
    /// Shortfall of the correction velocity in the last step against
    /// [`ERROR_REDUCTION`](super::ERROR_REDUCTION) of the error a step, because of other constraints. m/s,
    /// and rad/s.
    pub residuals: [f64; 2],
    /// Whether it reached its maximum force or torque.
    pub is_saturated: bool,
}

impl ConstraintDefinition {
    /// Returns the indices of its robots.
    pub fn robots(&self) -> impl Iterator<Item = usize> + use<> {
        self.ends.map(|end| end.link.map(|(robot, _)| robot)).into_iter().flatten()
    }
}

impl LinkConstraint {
    /// Creates a constraint that has not acted yet.
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

    /// Records that one of its robots was moved other than by a step.
    pub fn forget_motion(&mut self) {
        (self.motion, self.is_dragged) = (None, true);
    }

    /// Clears the data of the last step.
    pub fn forget_step(&mut self) {
        (self.impulses, self.is_least, self.motion) = ([[0.0; 3]; 2], false, None);
        (self.is_dragged, self.reading) = (false, Reading::default());
    }

    /// Records that it did not act in a part of a step.
    pub fn skip_part(&mut self) {
        (self.impulses, self.is_least, self.motion) = ([[0.0; 3]; 2], false, None);
        (self.reading.last_force, self.reading.last_torque) = (DVec3::ZERO, DVec3::ZERO);
    }

    /// Clears the sums before a step.
    pub fn begin_step(&mut self) {
        (self.reading.force, self.reading.torque) = (DVec3::ZERO, DVec3::ZERO);
        self.reading.is_saturated = false;
    }

    /// Keeps forces constant if steps and their parts become longer by these factors.
    pub fn stretch(&mut self, step: f64, part: f64) {
        self.reading.force *= step;
        self.reading.torque *= step;
        self.reading.last_force *= part;
        self.reading.last_torque *= part;
        self.impulses.iter_mut().flatten().for_each(|impulse| *impulse *= part);
        self.motion = None;
    }

    /// Returns the axes of its rows and its errors along them, for two frames in the world. Not for gears.
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
                // If the axes are opposite, any direction will do.
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
                // Coincident points may separate in any direction.
                let way = if present > 0.0 { across / present } else { a.rotation * DVec3::X };
                // A positive impulse pulls.
                let axes = [-way, DVec3::ZERO, DVec3::ZERO];
                [Aim { axes, errors: [length - present, 0.0, 0.0] }, Aim::default()]
            }
            ConstraintKind::Gear { .. } => [Aim::default(); 2],
        }
    }
}

/// Returns the rotation of the second frame relative to the first: the rotation vector, in the axes of the
/// first.
fn turned(a: DPose3, b: DPose3) -> Aim {
    let rotation = a.rotation.inverse() * b.rotation;
    let rotation = if rotation.w < 0.0 { -rotation } else { rotation };
    let part = DVec3::new(rotation.x, rotation.y, rotation.z);
    let sine = part.length();
    // All digits of tiny angles count: links at rest have such errors.
    let factor = if sine > f64::MIN_POSITIVE { 2.0 * sine.atan2(rotation.w) / sine } else { 2.0 };
    let errors = (part * factor).to_array();
    Aim { axes: [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| a.rotation * axis), errors }
}

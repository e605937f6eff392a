//! Trajectories of joints: what is asked, what is under way, and where a joint is to be between two points.
//!
//! Interpolation is that of `joint_trajectory_controller` of ROS 2: linear between positions, cubic where velocities
//! are given, quintic where accelerations are too.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use simd_model::{LARGEST_GIVEN, shown};

use crate::plain::{bounded_list, shared, shared_list};
use crate::valid::{finite, sizes};

/// Points of one trajectory.
pub const MAX_POINTS: usize = 10_000;
/// Trajectories of one robot that are carried out or wait.
pub const MAX_TRAJECTORIES: usize = 16;
/// Joints of one trajectory.
pub const MAX_TRAJECTORY_JOINTS: usize = 1_000;
/// Numbers of one trajectory.
pub const MAX_NUMBERS: usize = 1_000_000;
/// Numbers of trajectories that a saved state may have, so that counting on from there does not end.
const MOST_IDS: u64 = 1 << 53;
/// The longest time that a trajectory has, seconds.
pub const MAX_TIME: f64 = 1e6;

/// Where joints are to be at a time. A list has a number for each joint; all but `positions` may be empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrajectoryPoint {
    /// Seconds from the beginning of the trajectory.
    pub time: f64,
    /// rad or m.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_TRAJECTORY_JOINTS, _, _>")]
    pub positions: Vec<f64>,
    /// rad/s or m/s.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_TRAJECTORY_JOINTS, _, _>")]
    pub velocities: Vec<f64>,
    /// rad/s^2 or m/s^2.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_TRAJECTORY_JOINTS, _, _>")]
    pub accelerations: Vec<f64>,
    /// Added to the effort of the actuators, N m or N.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_TRAJECTORY_JOINTS, _, _>")]
    pub efforts: Vec<f64>,
}

/// How far a joint may be from where it is to be; `None` is any distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tolerance {
    /// rad or m.
    pub position: Option<f64>,
    /// rad/s or m/s.
    pub velocity: Option<f64>,
}

/// When a trajectory begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Begin {
    /// With the next step. What the joints are carrying out ends, and the new trajectory goes on from where that has got to.
    #[default]
    Now,
    /// The same after so many simulated seconds.
    After(f64),
    /// When those of its joints that were there before it have succeeded; where one of them ends otherwise, it is cancelled.
    Queued,
}

/// A trajectory that is carried out, or waits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActiveTrajectory {
    /// Unlike that of any other of this daemon.
    pub id: u64,
    /// In the order of the points' numbers.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_TRAJECTORY_JOINTS, _, _>")]
    pub joints: Vec<TrajectoryJoint>,
    /// In the order of their times. Shared, since copies of the state are made while the world plays.
    #[serde(
        serialize_with = "shared::serialize",
        deserialize_with = "shared_list::deserialize::<MAX_POINTS, _, _>"
    )]
    pub points: Arc<Vec<TrajectoryPoint>>,
    /// What it waits for; `Now` where it is carried out.
    pub begin: Begin,
    /// Simulated seconds since it began.
    pub elapsed: f64,
    /// The first point that is not over.
    pub next: usize,
    /// How long after its end the joints may take to come within the tolerances of the goal; `None` is for ever.
    pub goal_time_tolerance: Option<f64>,
    /// Set while the end is about to be made known.
    #[serde(skip)]
    pub(super) ended: Option<TrajectoryEnd>,
}

/// A joint that carries out a trajectory.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrajectoryJoint {
    /// Index in the model.
    pub joint: usize,
    /// Position and velocity at the beginning.
    pub start: (f64, f64),
    /// While it is carried out.
    pub path: Tolerance,
    /// At its end.
    pub goal: Tolerance,
}

/// How a trajectory ended.
#[derive(Clone, Debug, PartialEq)]
pub enum TrajectoryEnd {
    /// The joints are where they were to be.
    Succeeded,
    /// A joint left the path.
    PathToleranceViolated(Violation),
    /// A joint did not come to the goal in time.
    GoalToleranceViolated(Violation),
    /// It was asked to, or what drives the joints was changed.
    Cancelled {
        /// What did it, as in "by a reset".
        by: String,
    },
    /// Another trajectory, or another target, took a joint.
    Superseded,
}

/// By how much a tolerance is exceeded.
#[derive(Clone, Debug, PartialEq)]
pub struct Violation {
    /// Its name.
    pub joint: String,
    /// `position` or `velocity`.
    pub quantity: &'static str,
    /// What it is less what it is to be.
    pub error: f64,
    /// What it may differ by.
    pub tolerance: f64,
}

impl std::fmt::Display for TrajectoryEnd {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut violated = |what: &str, Violation { joint, quantity, error, tolerance }: &Violation| {
            write!(
                f,
                "the {quantity} of joint {joint:?} is {error:.6} from {what}, and {tolerance} is its tolerance"
            )
        };
        match self {
            Self::Succeeded => f.write_str("the goal is reached"),
            Self::PathToleranceViolated(violation) => violated("its path", violation),
            Self::GoalToleranceViolated(violation) => violated("its goal", violation),
            Self::Cancelled { by } => write!(f, "cancelled by {by}"),
            Self::Superseded => f.write_str("superseded by another target of a joint"),
        }
    }
}

/// What a joint is to do at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// rad or m.
    pub position: f64,
    /// rad/s or m/s.
    pub velocity: f64,
    /// rad/s^2 or m/s^2.
    pub acceleration: f64,
    /// N m or N.
    pub effort: f64,
}

/// A joint's numbers at one end of a segment.
#[derive(Clone, Copy, Debug)]
struct Knot {
    position: f64,
    velocity: Option<f64>,
    acceleration: Option<f64>,
    effort: Option<f64>,
}

/// `t` of `whole` seconds after `from`, on the way to `to`.
fn between(from: Knot, to: Knot, t: f64, whole: f64) -> Sample {
    let effort = match (from.effort, to.effort) {
        (Some(a), Some(b)) => a + (b - a) * t / whole,
        _ => 0.0,
    };
    let (p0, p1) = (from.position, to.position);
    // Coefficients of powers of t, from the positions, velocities and accelerations at both ends.
    let c = match (from.velocity.zip(to.velocity), from.acceleration.zip(to.acceleration)) {
        (None, _) => [p0, (p1 - p0) / whole, 0.0, 0.0, 0.0, 0.0],
        (Some((v0, v1)), None) => {
            let c2 = (3.0 * (p1 - p0) - (2.0 * v0 + v1) * whole) / whole.powi(2);
            let c3 = (2.0 * (p0 - p1) + (v0 + v1) * whole) / whole.powi(3);
            [p0, v0, c2, c3, 0.0, 0.0]
        }
        (Some((v0, v1)), Some((a0, a1))) => {
            let (d, h) = (p1 - p0, whole);
            let c3 = (20.0 * d - (8.0 * v1 + 12.0 * v0) * h - (3.0 * a0 - a1) * h * h) / (2.0 * h.powi(3));
            let c4 =
                (-30.0 * d + (14.0 * v1 + 16.0 * v0) * h + (3.0 * a0 - 2.0 * a1) * h * h) / (2.0 * h.powi(4));
            let c5 = (12.0 * d - 6.0 * (v1 + v0) * h - (a0 - a1) * h * h) / (2.0 * h.powi(5));
            [p0, v0, a0 / 2.0, c3, c4, c5]
        }
    };
    let value = |c: &[f64]| c.iter().rev().fold(0.0, |sum, c| sum * t + c);
    let velocity = [c[1], 2.0 * c[2], 3.0 * c[3], 4.0 * c[4], 5.0 * c[5]];
    let acceleration = [2.0 * c[2], 6.0 * c[3], 12.0 * c[4], 20.0 * c[5]];
    Sample { position: value(&c), velocity: value(&velocity), acceleration: value(&acceleration), effort }
}

impl ActiveTrajectory {
    /// Seconds from the beginning to the last point.
    pub fn duration(&self) -> f64 {
        self.points.last().map_or(0.0, |last| last.time)
    }

    /// Whether it is carried out.
    pub fn is_under_way(&self) -> bool {
        self.begin == Begin::Now
    }

    /// Whether two have a joint in common.
    pub(super) fn shares_joints(&self, other: &Self) -> bool {
        self.joints.iter().any(|own| other.has_joint(own.joint))
    }

    pub(super) fn has_joint(&self, joint: usize) -> bool {
        self.joints.iter().any(|own| own.joint == joint)
    }

    /// Time goes on.
    pub(super) fn advance(&mut self, seconds: f64) {
        self.elapsed += seconds;
        while self.points.get(self.next).is_some_and(|point| point.time < self.elapsed) {
            self.next += 1;
        }
    }

    /// Where one of its joints is to be now, by its index among them. At rest at the last point after the end.
    pub fn sample(&self, joint: usize) -> Sample {
        let Some(to) = self.points.get(self.next) else {
            let last = self.knot(self.points.len().saturating_sub(1), joint);
            return Sample {
                position: last.position,
                effort: last.effort.unwrap_or_default(),
                ..Sample::default()
            };
        };
        let goal = self.knot(self.next, joint);
        let (from, since) = match self.next.checked_sub(1) {
            Some(before) => (self.knot(before, joint), self.points[before].time),
            None => {
                let (position, velocity) = self.joints[joint].start;
                // Of the degree of the segments that follow.
                let start = Knot {
                    position,
                    velocity: goal.velocity.map(|_| velocity),
                    acceleration: goal.acceleration.map(|_| 0.0),
                    effort: goal.effort,
                };
                (start, 0.0)
            }
        };
        if to.time <= since {
            let effort = goal.effort.unwrap_or_default();
            return Sample { position: goal.position, effort, ..Sample::default() };
        }
        between(from, goal, self.elapsed - since, to.time - since)
    }

    fn knot(&self, point: usize, joint: usize) -> Knot {
        let point = &self.points[point];
        let value = |values: &[f64]| values.get(joint).copied();
        Knot {
            position: value(&point.positions).unwrap_or_default(),
            velocity: value(&point.velocities),
            acceleration: value(&point.accelerations),
            effort: value(&point.efforts),
        }
    }

    /// That it can be carried out by a robot with so many joints: for one that comes from elsewhere.
    pub(super) fn check(&self, joints: usize) -> Result<(), String> {
        let Self { id, joints: own, points, begin, elapsed, next, goal_time_tolerance, ended: _ } = self;
        check_points(points, own.len()).map_err(|(what, _)| format!("a trajectory in which {what}"))?;
        if *id > MOST_IDS {
            return Err(format!("a trajectory of the number {id}"));
        }
        let mut known: Vec<usize> = own.iter().map(|joint| joint.joint).collect();
        known.sort_unstable();
        known.dedup();
        if known.len() != own.len() || known.last().is_none_or(|last| *last >= joints) {
            return Err("a trajectory of joints that it has not, or has twice".to_owned());
        }
        let wait = if let Begin::After(seconds) = begin { *seconds } else { 0.0 };
        sizes("times of a trajectory", [*elapsed, wait, goal_time_tolerance.unwrap_or_default()])?;
        if *elapsed > 2.0 * MAX_TIME + goal_time_tolerance.unwrap_or_default() || wait > MAX_TIME {
            return Err("a trajectory that has taken too long".to_owned());
        }
        let expected = points.iter().take_while(|point| point.time < *elapsed).count();
        if *next != expected {
            return Err(format!("a trajectory at its point {next}, where its time is at {expected}"));
        }
        finite("a trajectory", own.iter().flat_map(|joint| [joint.start.0, joint.start.1]))?;
        let tolerances = own.iter().flat_map(|joint| [joint.path, joint.goal]);
        sizes("tolerances", tolerances.flat_map(|one| [one.position, one.velocity]).flatten())
    }
}

/// That points of so many joints are some, and in order. The error is a sentence, and which point it is about.
pub(super) fn check_points(points: &[TrajectoryPoint], joints: usize) -> Result<(), (String, usize)> {
    if points.is_empty() || points.len() > MAX_POINTS {
        return Err((format!("there are {} points; 1 to {MAX_POINTS} can be", points.len()), 0));
    }
    if points.len().saturating_mul(joints) > MAX_NUMBERS {
        return Err((format!("{} points of {joints} joints are too many", points.len()), 0));
    }
    let mut before = -1.0;
    for (index, point) in points.iter().enumerate() {
        let fault = |what: String| Err((what, index));
        if !(point.time >= 0.0 && point.time <= MAX_TIME && point.time > before) {
            let time = point.time;
            return fault(format!(
                "the time of point {index} is {time}; times must grow, from 0 to {MAX_TIME} s"
            ));
        }
        before = point.time;
        for (name, values, may_be_empty) in [
            ("positions", &point.positions, false),
            ("velocities", &point.velocities, true),
            ("accelerations", &point.accelerations, true),
            ("efforts", &point.efforts, true),
        ] {
            if values.len() != joints && !(may_be_empty && values.is_empty()) {
                return fault(format!(
                    "point {index} has {} {name}; there are {joints} joints",
                    values.len()
                ));
            }
            if let Some(value) = values.iter().find(|value| value.is_nan() || value.abs() > LARGEST_GIVEN) {
                let value = shown(value);
                return fault(format!(
                    "point {index} has {value} among its {name}, which is not between -{LARGEST_GIVEN:e} and {LARGEST_GIVEN:e}"
                ));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;

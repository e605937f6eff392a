//! Trajectories of joints: requests, running trajectories, and the interpolation between points.
//!
//! Interpolation is as in `joint_trajectory_controller` of ROS 2: linear between positions, cubic if
//! velocities are given, quintic if accelerations are given too.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use simd_model::{LARGEST_GIVEN, shown};

use crate::plain::{bounded_list, shared, shared_list};
use crate::valid::{finite, sizes};

/// Maximum number of points of one trajectory.
pub const MAX_POINTS: usize = 10_000;
/// Maximum number of running and waiting trajectories of one robot.
pub const MAX_TRAJECTORIES: usize = 16;
/// Maximum number of joints of one trajectory.
pub const MAX_TRAJECTORY_JOINTS: usize = 1_000;
/// Maximum number of values of one trajectory.
pub const MAX_NUMBERS: usize = 1_000_000;
/// Maximum identifier of trajectories in a saved state, so that counting from there does not overflow.
const MAX_ID: u64 = 1 << 53;
/// Maximum time of a trajectory, seconds.
pub const MAX_TIME: f64 = 1e6;

/// Desired state of joints at a time. A list has a number for each joint; all except `positions` may be
/// empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrajectoryPoint {
    /// Time from the start of the trajectory, seconds.
    pub time: f64,
    /// Positions, rad or m.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_TRAJECTORY_JOINTS, _, _>")]
    pub positions: Vec<f64>,
    /// Velocities, rad/s or m/s.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_TRAJECTORY_JOINTS, _, _>")]
    pub velocities: Vec<f64>,
    /// Accelerations, rad/s^2 or m/s^2.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_TRAJECTORY_JOINTS, _, _>")]
    pub accelerations: Vec<f64>,
    /// Efforts that are added to the actuators', N m or N.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_TRAJECTORY_JOINTS, _, _>")]
    pub efforts: Vec<f64>,
}

/// Tolerance of a joint; `None` means any difference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tolerance {
    /// Tolerance of the position, rad or m.
    pub position: Option<f64>,
    /// Tolerance of the velocity, rad/s or m/s.
    pub velocity: Option<f64>,
}

/// Start of a trajectory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Begin {
    /// With the next step. It ends the joints' present trajectories, and continues from their present
    /// setpoints.
    #[default]
    Now,
    /// After some simulated seconds, like `Now`.
    After(f64),
    /// After earlier trajectories of its joints have succeeded; if one of them ends otherwise, it is
    /// cancelled.
    Queued,
}

/// A running or waiting trajectory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActiveTrajectory {
    /// Identifier, unique in this daemon.
    pub id: u64,
    /// Joints in the order of the points' numbers.
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_TRAJECTORY_JOINTS, _, _>")]
    pub joints: Vec<TrajectoryJoint>,
    /// Points in the order of their times. Shared, since copies of the state are made while the world plays.
    #[serde(
        serialize_with = "shared::serialize",
        deserialize_with = "shared_list::deserialize::<MAX_POINTS, _, _>"
    )]
    pub points: Arc<Vec<TrajectoryPoint>>,
    /// Condition that it waits for; `Now` if it is running.
    pub begin: Begin,
    /// Simulated seconds since it began.
    pub elapsed: f64,
    /// First point that is not over.
    pub next: usize,
    /// Time after its end within which the joints must reach the tolerances of the goal, seconds; `None`
    /// means no limit.
    pub goal_time_tolerance: Option<f64>,
    /// Set while the end is still to be reported.
    #[serde(skip)]
    pub(super) ended: Option<TrajectoryEnd>,
}

/// A joint of a trajectory.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrajectoryJoint {
    /// Joint in the model, by index.
    pub joint: usize,
    /// Position and velocity at the start.
    pub start: (f64, f64),
    /// Tolerance on the path.
    pub path: Tolerance,
    /// Tolerance at the end.
    pub goal: Tolerance,
}

/// Kind of end of a trajectory.
#[derive(Clone, Debug, PartialEq)]
pub enum TrajectoryEnd {
    /// The joints have reached the goal.
    Succeeded,
    /// A joint left the path.
    PathToleranceViolated(Violation),
    /// A joint did not reach the goal in time.
    GoalToleranceViolated(Violation),
    /// A client cancelled it, or the joints' driver changed.
    Cancelled {
        /// Cause, as in "by a reset".
        by: String,
    },
    /// Another trajectory, or another target, took over a joint.
    Superseded,
}

/// Excess over a tolerance.
#[derive(Clone, Debug, PartialEq)]
pub struct Violation {
    /// Name of the joint.
    pub joint: String,
    /// Quantity: `position` or `velocity`.
    pub quantity: &'static str,
    /// Actual less desired value.
    pub error: f64,
    /// Tolerance.
    pub tolerance: f64,
}

impl std::fmt::Display for TrajectoryEnd {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut violated = |what: &str, Violation { joint, quantity, error, tolerance }: &Violation| {
            write!(
                f,
                "the {quantity} of joint {joint:?} is {error:.6} from {what}; its tolerance is {tolerance}"
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

/// Desired state of a joint at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Position, rad or m.
    pub position: f64,
    /// Velocity, rad/s or m/s.
    pub velocity: f64,
    /// Acceleration, rad/s^2 or m/s^2.
    pub acceleration: f64,
    /// Effort, N m or N.
    pub effort: f64,
}

/// A joint's values at one end of a segment.
#[derive(Clone, Copy, Debug)]
struct Knot {
    position: f64,
    velocity: Option<f64>,
    acceleration: Option<f64>,
    effort: Option<f64>,
}

/// Interpolates a segment of `whole` seconds `t` seconds after `from`, on the way to `to`.
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
    /// Returns the time from the start to the last point, seconds.
    pub fn duration(&self) -> f64 {
        self.points.last().map_or(0.0, |last| last.time)
    }

    /// Returns whether it is running.
    pub fn is_under_way(&self) -> bool {
        self.begin == Begin::Now
    }

    /// Returns whether two share a joint.
    pub(super) fn shares_joints(&self, other: &Self) -> bool {
        self.joints.iter().any(|own| other.has_joint(own.joint))
    }

    pub(super) fn has_joint(&self, joint: usize) -> bool {
        self.joints.iter().any(|own| own.joint == joint)
    }

    /// Advances its time.
    pub(super) fn advance(&mut self, seconds: f64) {
        self.elapsed += seconds;
        while self.points.get(self.next).is_some_and(|point| point.time < self.elapsed) {
            self.next += 1;
        }
    }

    /// Returns the present desired state of one of its joints, by its index among them. After the end it is
    /// at rest at the last point.
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
                // With the degree of the segments that follow.
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

    /// Checks that a robot with this number of joints can execute it, for a trajectory from elsewhere.
    pub(super) fn check(&self, joints: usize) -> Result<(), String> {
        let Self { id, joints: own, points, begin, elapsed, next, goal_time_tolerance, ended: _ } = self;
        check_points(points, own.len()).map_err(|(what, _)| format!("a trajectory in which {what}"))?;
        if *id > MAX_ID {
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

/// Checks that points for this number of joints are not empty, and in order. The error is a sentence, and the
/// index of the point.
pub(super) fn check_points(points: &[TrajectoryPoint], joints: usize) -> Result<(), (String, usize)> {
    if points.is_empty() || points.len() > MAX_POINTS {
        return Err((format!("there are {} points; there must be 1 to {MAX_POINTS}", points.len()), 0));
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

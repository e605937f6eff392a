//! State of one robot, and its validation when it comes from a file.

use glamx::DPose3;
use serde::{Deserialize, Serialize};
use simd_model::robot::JointLimits;

use crate::dynamics::actuator::{Actuator, Axis, AxisSettings, Drive, Mode};
use crate::dynamics::constraint::Impulses;
use crate::dynamics::gains::set_default_gains;
use crate::dynamics::integrate::write_free_pose;
use crate::dynamics::integrator::History;
use crate::dynamics::kinematics::free_pose;
use crate::dynamics::spatial::Spatial;
use crate::dynamics::tree::{JointType, Tree};
use crate::plain::pose3;
use crate::valid::{finite, pose, sizes, unit};

/// State of a robot between two steps, without its [`Tree`]: saves copy it and fingerprints read it. Vectors
/// have the lengths of the tree: positions, and velocities with everything aligned to them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyState {
    /// World from base: the root link if it is fixed, else the world itself.
    #[serde(with = "pose3")]
    pub base: DPose3,
    /// Positions q.
    pub positions: Vec<f64>,
    /// Velocities qd.
    pub velocities: Vec<f64>,
    /// Velocities that moved it in the last step; with leapfrog, those in the middle of it.
    pub half_velocities: Vec<f64>,
    /// Changes of `half_velocities` in the last step; zero if velocities were set since.
    pub changes: Vec<f64>,
    /// Changes of `half_velocities` in the step before.
    pub changes_before: Vec<f64>,
    /// Data that leapfrog can continue from.
    pub history: History,
    /// Settings and targets, one for each degree of freedom; those of free bodies have no actuator.
    pub axes: Vec<Axis>,
    /// Laws of the last step, one for each degree of freedom.
    pub drives: Vec<Drive>,
    /// Efforts that the actuators applied over the last step, one for each degree of freedom.
    pub efforts: Vec<f64>,
    /// External forces on each body, in its own frame. Held until changed.
    pub external: Vec<Spatial>,
    /// External forces in the last step, if commands or time have changed them since; else zero.
    pub external_before: Vec<Spatial>,
    /// Whether commands or time have changed external forces since the last step.
    pub has_external_changed: bool,
    /// Impulses of the rows of joints, for the next step's warm start.
    pub impulses: Impulses,
}

impl BodyState {
    /// Creates a passive state at rest with the root at `world_from_root` and the joints at `positions`,
    /// which exclude a free root's.
    pub fn new(tree: &Tree, world_from_root: DPose3, mut axes: Vec<Axis>, positions: &[f64]) -> Self {
        let mut q = vec![0.0; tree.root_positions()];
        if !tree.fixed_base {
            write_free_pose(&mut q, world_from_root.translation, world_from_root.rotation);
        }
        q.extend_from_slice(positions);
        q.resize(tree.position_count, 0.0);
        let n = tree.velocity_count;
        axes.resize(n, Axis::default());
        set_default_gains(tree, &q, &mut axes);
        Self {
            base: if tree.fixed_base { world_from_root } else { DPose3::IDENTITY },
            positions: q,
            velocities: vec![0.0; n],
            half_velocities: vec![0.0; n],
            changes: vec![0.0; n],
            changes_before: vec![0.0; n],
            history: History::Given,
            axes,
            drives: vec![Drive::default(); n],
            efforts: vec![0.0; n],
            external: vec![Spatial::ZERO; tree.bodies.len()],
            external_before: vec![Spatial::ZERO; tree.bodies.len()],
            has_external_changed: false,
            impulses: Impulses::new(tree),
        }
    }

    /// Returns `world_from_root`.
    pub fn root_pose(&self, tree: &Tree) -> DPose3 {
        if tree.fixed_base {
            return self.base;
        }
        let (origin, rotation) = free_pose(&self.positions);
        DPose3::from_parts(origin, rotation)
    }

    /// Moves the root to a pose.
    pub fn set_root_pose(&mut self, tree: &Tree, world_from_root: DPose3) {
        if tree.fixed_base {
            self.base = world_from_root;
        } else {
            write_free_pose(&mut self.positions, world_from_root.translation, world_from_root.rotation);
        }
    }

    /// Records that velocities were set other than by a step.
    pub(super) fn forget_last_step(&mut self) {
        self.history = History::Given;
        self.half_velocities.fill(0.0);
        self.changes.fill(0.0);
        self.changes_before.fill(0.0);
    }

    /// Copies another state, reusing memory.
    pub(super) fn copy_from(&mut self, other: &Self) {
        let Self {
            base,
            positions,
            velocities,
            half_velocities,
            changes,
            changes_before,
            history,
            axes,
            drives,
            efforts,
            external,
            external_before,
            has_external_changed,
            impulses: Impulses { friction, mimic, lower, upper },
        } = self;
        (*base, *history, *has_external_changed) = (other.base, other.history, other.has_external_changed);
        axes.clone_from(&other.axes);
        drives.clone_from(&other.drives);
        external.clone_from(&other.external);
        external_before.clone_from(&other.external_before);
        for (numbers, of_other) in [
            (positions, &other.positions),
            (velocities, &other.velocities),
            (half_velocities, &other.half_velocities),
            (changes, &other.changes),
            (changes_before, &other.changes_before),
            (efforts, &other.efforts),
            (friction, &other.impulses.friction),
            (mimic, &other.impulses.mimic),
            (lower, &other.impulses.lower),
            (upper, &other.impulses.upper),
        ] {
            numbers.clone_from(of_other);
        }
    }

    /// Checks that this is a state of such a tree, with numbers that a step can use.
    ///
    /// # Errors
    /// Returns the fault as a fragment of a sentence.
    pub fn check(&self, tree: &Tree) -> Result<(), String> {
        let Self {
            base,
            positions,
            velocities,
            half_velocities,
            changes,
            changes_before,
            history: _,
            axes,
            drives,
            efforts,
            external,
            external_before,
            has_external_changed: _,
            impulses,
        } = self;
        let n = tree.velocity_count;
        for (what, there, needed) in [
            ("positions", positions.len(), tree.position_count),
            ("velocities", velocities.len(), n),
            ("velocities in the middle of the last step", half_velocities.len(), n),
            ("changes of velocities in the last step", changes.len(), n),
            ("changes of velocities in the step before", changes_before.len(), n),
            ("settings of axes", axes.len(), n),
            ("laws of actuators", drives.len(), n),
            ("efforts", efforts.len(), n),
            ("forces from outside", external.len(), tree.bodies.len()),
            ("forces from outside in the last step", external_before.len(), tree.bodies.len()),
        ]
        .into_iter()
        .chain(impulses.lengths(tree))
        {
            if there != needed {
                return Err(format!("{there} {what}; its model has {needed}"));
            }
        }
        for (what, values) in [
            ("positions", positions),
            ("velocities", velocities),
            ("velocities in the middle of the last step", half_velocities),
            ("changes of velocities in the last step", changes),
            ("changes of velocities in the step before", changes_before),
            ("efforts", efforts),
        ] {
            finite(what, values.iter().copied())?;
        }
        for body in &tree.bodies {
            let at = body.position;
            match body.joint_type {
                JointType::Free { .. } => unit("the rotation of a free body", &positions[at + 3..at + 7])?,
                JointType::Spherical { axis: 0 } => {
                    unit("the orientation of a ball joint", &positions[at..at + 4])?;
                    // A rotation vector has a length.
                    let is_long = |axis: &Axis| {
                        let Actuator { mode, target, setpoint, .. } = axis.actuator;
                        matches!(mode, Mode::Position | Mode::Hold)
                            && target.abs().max(setpoint.abs()) > LONGEST
                    };
                    if axes[body.velocity..body.velocity + 3].iter().any(is_long) {
                        return Err(format!("targets of a ball joint beyond {LONGEST:e}"));
                    }
                }
                JointType::Revolute | JointType::Prismatic | JointType::Spherical { .. } => {}
            }
        }
        pose("the pose of its base", base)?;
        if !tree.fixed_base && *base != DPose3::IDENTITY {
            return Err("a base that is not the world's, though its root is free".into());
        }
        let wrenches =
            external.iter().chain(external_before).flat_map(|wrench| [wrench.angular, wrench.linear]);
        finite("forces from outside", wrenches.flat_map(|vector| vector.to_array()))?;
        finite("impulses", impulses.values())?;
        axes.iter().try_for_each(check_axis)?;
        drives.iter().try_for_each(check_drive)
    }
}

/// Largest number of a target orientation, rad; no request comes near it.
const LONGEST: f64 = 1e100;

/// Accepts only numbers that a request could have set, or that follow from such numbers.
fn check_axis(axis: &Axis) -> Result<(), String> {
    let AxisSettings {
        damping,
        friction,
        armature,
        spring_stiffness,
        spring_rest,
        limits: JointLimits { lower, upper, effort, velocity },
        default_stiffness,
        default_damping,
        velocity_damping,
        is_direct: _,
        gravity_compensation: _,
        composite_inertia,
    } = axis.settings;
    let Actuator {
        mode: _,
        target,
        velocity: target_velocity,
        stiffness,
        damping: target_damping,
        feed_forward,
        max_effort,
        max_velocity,
        setpoint,
        setpoint_velocity,
        servo,
    } = axis.actuator;
    let sizes_of_axis = [damping, friction, armature, spring_stiffness, default_stiffness, default_damping];
    sizes("settings of axes", sizes_of_axis)?;
    let gain = servo.map(|servo| servo.gain);
    let given =
        [effort, velocity, velocity_damping, stiffness, target_damping, max_effort, max_velocity, gain];
    sizes("limits and gains of axes", given.into_iter().flatten())?;
    finite("limits of axes", [lower, upper].into_iter().flatten())?;
    if lower > upper && upper.is_some() {
        return Err("limits of axes of which the lower is above the upper".into());
    }
    finite("springs of axes", [spring_rest])?;
    finite("servos of axes", servo.map(|servo| servo.slip))?;
    finite(
        "targets of axes",
        [composite_inertia, target, target_velocity, feed_forward, setpoint, setpoint_velocity],
    )
}

fn check_drive(drive: &Drive) -> Result<(), String> {
    let Drive { stiffness, damping, position, velocity, feed_forward, limit, saturated } = *drive;
    let values = [stiffness, damping, position, velocity, feed_forward];
    finite("laws of actuators", values.into_iter().chain(saturated))?;
    // Without a limit it is infinite.
    if limit >= 0.0 { Ok(()) } else { Err(format!("laws of actuators with {limit} in them")) }
}

//! Controls of joints in each step of a copy.

use pulp::Simd;
use simd_model::LARGEST_GIVEN;

use super::knots::{Knots, Timing};
use super::names::{Axis, axes, moderate, refuse, robot, sized};
use super::request::{Control, ControlMode, Feedback, Interpolation};
use crate::dynamics::Mode;
use crate::dynamics::lanes::LaneRobot;
use crate::simulation::command::{JointTarget, RobotTargets, SetTargets, Target};
use crate::simulation::published_state::WorldLayout;
use crate::simulation::{Command, Error, Simulation};

/// A control with resolved names.
#[derive(Debug)]
pub(super) struct ControlPlan {
    robot: usize,
    name: String,
    joints: Vec<String>,
    axes: Vec<Axis>,
    mode: ControlMode,
    /// Values; `None` means zero.
    values: Option<Knots>,
    /// Stiffness and damping of each joint; NaN means the joint's own. This is not an `Option`: the processor
    /// would compute speculatively with the number in an absent one, which is slow if it is subnormal.
    gains: Vec<[f64; 2]>,
    feedback: Option<FeedbackPlan>,
}

#[derive(Debug)]
struct FeedbackPlan {
    axes: Vec<Axis>,
    gains: Knots,
    references: Option<Knots>,
}

/// A step of a copy.
#[derive(Clone, Copy, Debug)]
pub(super) struct CopyStep {
    /// Index of the copy.
    pub(super) copy: usize,
    /// Number of steps before it.
    pub(super) step: u64,
}

/// Memory of a step.
#[derive(Debug, Default)]
pub(super) struct ControlMemory {
    values: Vec<f64>,
    deviations: Vec<f64>,
    velocities: Vec<f64>,
}

impl ControlPlan {
    /// Resolves names and checks lengths; `index` is the control's index in the request.
    pub(super) fn new(
        layout: &WorldLayout,
        index: usize,
        control: Control,
        copies: usize,
    ) -> Result<Self, Error> {
        let field = |name: &str| format!("controls[{index}].{name}");
        let Control {
            robot: name,
            joints,
            mode,
            values,
            knots,
            knot_steps,
            interpolation,
            stiffness,
            damping,
            feedback,
        } = control;
        let (robot, entity) = robot(layout, &field("robot"), &name)?;
        let axes = axes(entity, &field("joints"), &joints)?;
        let joints: Vec<String> =
            axes.iter().map(|axis| entity.model.joints[axis.joint].name.clone()).collect();
        if axes.is_empty() {
            return Err(refuse(field("joints"), "empty", format!("robot {name:?} has no joint of one axis")));
        }
        if knots == 0 || knot_steps == 0 {
            let field = field(if knots == 0 { "knots" } else { "knot_steps" });
            return Err(refuse(field, 0, "it must be at least 1"));
        }
        let timing = Timing { copies, knots, every: knot_steps, interpolation };
        if values.is_empty() && feedback.is_none() {
            return Err(refuse(field("values"), "empty", "it must have numbers if there is no feedback"));
        }
        let values = match values.is_empty() {
            true => None,
            false => Some(Knots::new(&field("values"), values, axes.len(), timing)?),
        };
        for (name, given) in [("stiffness", &stiffness), ("damping", &damping)] {
            let field = field(name);
            sized(&field, given.len(), &[(0, "the joints' own"), (axes.len(), "one a joint")])?;
            moderate(&field, given)?;
            if let Some(value) = given.iter().find(|value| **value < 0.0) {
                return Err(refuse(field, value, "it must be finite and at least 0"));
            }
        }
        let gain = |given: &[f64], joint: usize| given.get(joint).copied().unwrap_or(f64::NAN);
        let gains = (0..axes.len()).map(|i| [gain(&stiffness, i), gain(&damping, i)]).collect();
        let plan = |feedback: Feedback| {
            let Feedback { joints, gains, references } = feedback;
            let observed = super::names::axes(entity, &field("feedback.joints"), &joints)?;
            let width = 2 * observed.len();
            let timing = Timing { interpolation: Interpolation::Hold, ..timing };
            let gains = Knots::constant_or(&field("feedback.gains"), gains, width * axes.len(), timing)?;
            let references = match references.is_empty() {
                true => None,
                false => Some(Knots::constant_or(&field("feedback.references"), references, width, timing)?),
            };
            Ok(FeedbackPlan { axes: observed, gains, references })
        };
        let feedback = feedback.map(plan).transpose()?;
        Ok(Self { robot, name, joints, axes, mode, values, gains, feedback })
    }

    /// Returns the index of its robot.
    pub(super) fn robot(&self) -> usize {
        self.robot
    }

    /// Returns the bodies of its joints.
    pub(super) fn bodies(&self) -> impl Iterator<Item = usize> + '_ {
        self.axes.iter().map(|axis| axis.body)
    }

    /// Returns whether it sets new targets at a step.
    pub(super) fn drives_at(&self, step: u64) -> bool {
        self.feedback.is_some() || self.values.as_ref().is_some_and(|values| values.change_at(step))
    }

    /// Sets the joints' targets in a step of a copy, if they are new. `factor` returns the factor of a
    /// joint's gains, by its index in the robot's model.
    ///
    /// # Errors
    /// Returns an error if a number is not finite, and in the first step if the world refuses the targets.
    pub(super) fn drive(
        &self,
        world: &mut Simulation,
        at: CopyStep,
        factor: impl Fn(usize) -> f64,
        memory: &mut ControlMemory,
    ) -> Result<(), Error> {
        if !self.drives_at(at.step) {
            return Ok(());
        }
        self.find_numbers(at, |body| world.axis_state(self.robot, body), memory)?;
        let gains = self.axes.iter().zip(&self.gains);
        let gains = gains.map(|(axis, gains)| gains.map(|gain| gain * factor(axis.joint)));
        // A command ends the trajectories of the joints, and validates targets. If neither is needed, the
        // targets are set directly: a command takes as long as a step.
        let by_command = at.step == 0
            && (at.copy == 0
                || world.has_trajectories(self.robot)
                || gains.clone().flatten().any(f64::is_infinite));
        let targets = memory.values.iter().zip(gains).map(|(value, gains)| self.target(*value, gains));
        if by_command {
            let joint =
                |(target, name): (Target, &String)| JointTarget { joint: name.clone(), axis: 0, target };
            let joints = targets.zip(&self.joints).map(joint).collect();
            let robot = RobotTargets { robot: self.name.clone(), joints, ..RobotTargets::default() };
            let command = SetTargets { robots: vec![robot], ..SetTargets::default() };
            return world.apply(&Command::SetTargets(command)).map(drop);
        }
        for (target, axis) in targets.zip(&self.axes) {
            world.set_axis_target(self.robot, axis.body, &target);
        }
        Ok(())
    }

    /// Like [`drive`](Self::drive) for a copy in a lane, after its first step, if no other control has one of
    /// the joints. A target then differs from the previous one only in its value.
    pub(super) fn drive_lane<S: Simd>(
        &self,
        lanes: &mut LaneRobot<S>,
        lane: usize,
        at: CopyStep,
        memory: &mut ControlMemory,
    ) -> Result<(), Error> {
        if !self.drives_at(at.step) {
            return Ok(());
        }
        self.find_numbers(at, |body| lanes.axis_state(lane, body), memory)?;
        let mode = match self.mode {
            ControlMode::Position => Mode::Position,
            ControlMode::Velocity => Mode::Velocity,
            ControlMode::Effort => Mode::Effort,
        };
        for (value, axis) in memory.values.iter().zip(&self.axes) {
            lanes.set_target(lane, axis.body, mode, *value);
        }
        Ok(())
    }

    /// Computes the target value of each joint in a step of a copy. `axis_state` returns position and
    /// velocity of the joint of a body.
    fn find_numbers(
        &self,
        at: CopyStep,
        axis_state: impl Fn(usize) -> (f64, f64),
        memory: &mut ControlMemory,
    ) -> Result<(), Error> {
        match &self.values {
            Some(values) => values.write(at.copy, at.step, &mut memory.values),
            None => {
                memory.values.clear();
                memory.values.resize(self.axes.len(), 0.0);
            }
        }
        if let Some(feedback) = &self.feedback {
            feedback.add(at, axis_state, memory);
        }
        let is_beyond = |value: &f64| value.is_nan() || value.abs() > LARGEST_GIVEN;
        let Some(index) = memory.values.iter().position(is_beyond) else { return Ok(()) };
        let what = format!("the target of joint {:?} in step {}", self.joints[index], at.step);
        let expected = format!(
            "it must be a number between -{LARGEST_GIVEN:e} and {LARGEST_GIVEN:e}: check the gains of the \
             feedback"
        );
        Err(refuse(what, memory.values[index], expected))
    }

    fn target(&self, value: f64, gains: [f64; 2]) -> Target {
        let [stiffness, damping] = gains.map(|gain| (!gain.is_nan()).then_some(gain));
        match self.mode {
            ControlMode::Position => Target::Position {
                position: value,
                velocity: 0.0,
                stiffness,
                damping,
                feed_forward: 0.0,
                max_effort: None,
                max_velocity: None,
            },
            ControlMode::Velocity => {
                Target::Velocity { velocity: value, damping, feed_forward: 0.0, max_effort: None }
            }
            ControlMode::Effort => Target::Effort(value),
        }
    }
}

impl FeedbackPlan {
    /// Subtracts K (x - x0).
    fn add(
        &self,
        at: CopyStep,
        axis_state: impl Fn(usize) -> (f64, f64),
        ControlMemory { values, deviations, velocities }: &mut ControlMemory,
    ) {
        deviations.clear();
        velocities.clear();
        for axis in &self.axes {
            let (position, velocity) = axis_state(axis.body);
            deviations.push(position);
            velocities.push(velocity);
        }
        deviations.append(velocities);
        if let Some(references) = &self.references {
            let references = references.held(at.copy, at.step);
            deviations.iter_mut().zip(references).for_each(|(at, reference)| *at -= reference);
        }
        let rows = self.gains.held(at.copy, at.step).chunks_exact(deviations.len());
        for (value, row) in values.iter_mut().zip(rows) {
            *value -= row.iter().zip(&*deviations).map(|(gain, deviation)| gain * deviation).sum::<f64>();
        }
    }
}

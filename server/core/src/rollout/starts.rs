//! Starts of copies that differ from the state.

use glamx::{DPose3, DQuat, DVec3};

use super::knots::Knots;
use super::names::{Axis, axes, refuse, robot};
use super::request::Start;
use crate::simulation::command::{JointReset, RobotReset};
use crate::simulation::published_state::WorldLayout;
use crate::simulation::{Command, Error, Simulation};

/// Tolerance of the square of a quaternion's length.
const UNIT: f64 = 1e-6;

/// A start with resolved names.
#[derive(Debug)]
pub(super) struct StartPlan {
    robot: usize,
    name: String,
    joints: Vec<String>,
    axes: Vec<Axis>,
    positions: Option<Knots>,
    velocities: Option<Knots>,
    roots: Option<Knots>,
    root_twists: Option<Knots>,
}

/// Resets joints, given by their names and bodies.
pub(super) fn reset(
    world: &mut Simulation,
    (robot, name): (usize, &str),
    (joints, axes): (&[String], &[Axis]),
    mut start: impl FnMut(usize, (f64, f64)) -> (f64, f64),
) -> Result<(), Error> {
    if joints.is_empty() {
        return Ok(());
    }
    let resets = joints.iter().zip(axes).enumerate().map(|(index, (joint, axis))| {
        let (position, velocity) = start(index, world.axis_state(robot, axis.body));
        JointReset { joint: joint.clone(), position, velocity, ..JointReset::default() }
    });
    let joints = resets.collect();
    let robots = vec![RobotReset { robot: name.to_owned(), joints }];
    world.apply(&Command::ResetJoints { robots }).map(drop)
}

impl StartPlan {
    /// Resolves names and checks lengths; `index` is the start's index in the request.
    pub(super) fn new(
        layout: &WorldLayout,
        index: usize,
        start: Start,
        copies: usize,
    ) -> Result<Self, Error> {
        let field = |name: &str| format!("starts[{index}].{name}");
        let Start { robot: name, joints, positions, velocities, roots, root_twists } = start;
        let (robot, entity) = robot(layout, &field("robot"), &name)?;
        let axes = axes(entity, &field("joints"), &joints)?;
        let joints: Vec<String> =
            axes.iter().map(|axis| entity.model.joints[axis.joint].name.clone()).collect();
        let rows =
            |name: &str, values: Vec<f64>, width: usize| Knots::of_start(&field(name), values, width, copies);
        let roots = rows("roots", roots, 7)?;
        let bad = |row: &[f64]| (row[3..].iter().map(|q| q * q).sum::<f64>() - 1.0).abs() >= UNIT;
        if let Some(row) = roots.as_ref().and_then(|roots| roots.numbers().chunks_exact(7).position(bad)) {
            let value = format!("a row {row} without a rotation");
            return Err(refuse(
                field("roots"),
                value,
                "its last four numbers must be a quaternion of unit length",
            ));
        }
        let root_twists = rows("root_twists", root_twists, 6)?;
        if root_twists.is_some() && entity.fixed_base {
            return Err(refuse(
                field("root_twists"),
                "given",
                format!("the base of robot {name:?} is fixed"),
            ));
        }
        Ok(Self {
            positions: rows("positions", positions, axes.len())?,
            velocities: rows("velocities", velocities, axes.len())?,
            roots,
            root_twists,
            robot,
            name,
            joints,
            axes,
        })
    }

    /// Moves a copy to its start.
    pub(super) fn apply(&self, world: &mut Simulation, copy: usize) -> Result<(), Error> {
        let row = |rows: &Option<Knots>| rows.as_ref().map(|rows| rows.held(copy, 0).to_vec());
        if self.roots.is_some() || self.root_twists.is_some() {
            let vector = |row: &[f64], at: usize| DVec3::new(row[at], row[at + 1], row[at + 2]);
            let pose = row(&self.roots).map(|row| {
                // The given quaternion, as a command would use it: otherwise the copy would have other bits
                // than the world.
                DPose3::from_parts(vector(&row, 0), DQuat::from_xyzw(row[3], row[4], row[5], row[6]))
            });
            let twist = row(&self.root_twists).map(|row| (vector(&row, 0), vector(&row, 3)));
            world.apply(&Command::SetEntityState { robot: self.name.clone(), pose, twist })?;
        }
        let (positions, velocities) = (row(&self.positions), row(&self.velocities));
        if positions.is_none() && velocities.is_none() {
            return Ok(());
        }
        let start = |index: usize, (position, velocity): (f64, f64)| {
            let at_rest = if positions.is_some() { 0.0 } else { velocity };
            (
                positions.as_ref().map_or(position, |row| row[index]),
                velocities.as_ref().map_or(at_rest, |row| row[index]),
            )
        };
        reset(world, (self.robot, &self.name), (&self.joints, &self.axes), start)
    }
}

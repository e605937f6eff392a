//! A second run of a recording, with changes, beside the recorded run.

use std::collections::BTreeMap;
use std::io::{self, Write};

use simd_core::simulation::command::ClaimId;
use simd_core::simulation::published_state::EntityLayout;
use simd_core::{Command, Moment, PublishedState, Simulation};

use super::changes::Changes;

/// Minimum simulated seconds between two comparisons.
const SAMPLE: f64 = 0.01;
/// Maximum number of rows.
const MAX_ROWS: usize = 100_000;
/// Maximum number of claims that are tried; earlier ones have ended.
const MAX_CLAIMS: usize = 1_000;

/// Changes of the second run, and the output of both runs as comma-separated values.
#[derive(Default)]
pub struct Variation {
    /// Changes; without any, there is no second run.
    pub changes: Changes,
    /// Table with a row each hundredth of a second, or each step if that is longer.
    pub table: Option<Box<dyn Write>>,
}

/// Comparison of the second run with the first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Changes, as they were given.
    pub changes: Vec<String>,
    /// Differences by robot, in the order of its joints; a free root comes first.
    pub rows: Vec<Difference>,
    /// First command that the second run refused, with the reason.
    pub refused: Option<String>,
}

/// Difference of a joint or a free root between the runs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Difference {
    /// Name of the robot.
    pub robot: String,
    /// Name of the joint; empty for the root.
    pub joint: String,
    /// Largest difference of positions, rad or m; for a root, the distance, m.
    pub largest: f64,
    /// Simulated time of the largest difference, seconds.
    pub at: f64,
    /// Difference at the end.
    pub last: f64,
    square_sum: f64,
    count: u32,
}

impl Difference {
    /// Returns the root mean square.
    pub fn rms(&self) -> f64 {
        (self.square_sum / f64::from(self.count.max(1))).sqrt()
    }
}

/// The second run.
pub(super) struct SecondRun {
    world: Simulation,
    state: PublishedState,
    changes: Changes,
    table: Option<Box<dyn Write>>,
    /// Claims that commands may use.
    claims: Vec<ClaimId>,
    /// Differences by robot and joint index; the root is 0.
    rows: BTreeMap<(String, usize), Difference>,
    refused: Option<String>,
    /// Simulated time of the next comparison.
    due: f64,
}

impl SecondRun {
    /// Begins with the same world.
    pub(super) fn begin(
        world: Simulation,
        variation: Variation,
        claims: Vec<ClaimId>,
    ) -> Result<Self, String> {
        let Variation { changes, mut table } = variation;
        if let Some(table) = &mut table {
            let titles = "time,robot,joint,recorded_position,position,recorded_velocity,velocity,recorded_effort,effort\n";
            table.write_all(titles.as_bytes()).map_err(|error| cannot_write(&error))?;
        }
        let state = PublishedState::default();
        let rows = BTreeMap::new();
        let mut run =
            Self { world, state, changes, table, claims, rows, refused: None, due: f64::NEG_INFINITY };
        run.change()?;
        Ok(run)
    }

    fn know(&mut self, claim: ClaimId) {
        if self.claims.len() >= MAX_CLAIMS {
            self.claims.remove(0);
        }
        self.claims.push(claim);
    }

    /// Applies the changes to the world: at first, and when robots are spawned or restored.
    fn change(&mut self) -> Result<(), String> {
        self.world.observe(&mut self.state);
        for command in self.changes.commands(&self.state) {
            let mut answer = self.world.apply_for(&command, None).map(drop);
            for claim in self.claims.iter().rev() {
                if answer.is_ok() {
                    break;
                }
                answer = self.world.apply_for(&command, Some(*claim)).map(drop);
            }
            answer.map_err(|error| format!("it cannot be changed: {error}"))?;
        }
        Ok(())
    }

    /// Applies a command of the first run.
    pub(super) fn apply(&mut self, mut command: Command, claim: Option<ClaimId>) -> Result<(), String> {
        if let Command::Claim(request) = &command {
            self.know(request.claim);
        }
        self.changes.keep_in(&mut command);
        if let Err(error) = self.world.apply_for(&command, claim) {
            self.refused.get_or_insert_with(|| error.to_string());
        }
        let goes_back = matches!(
            command,
            Command::Spawn(_)
                | Command::SpawnAll(_)
                | Command::Reload(_)
                | Command::Reset(_)
                | Command::RestoreState { .. }
        );
        if goes_back { self.change() } else { Ok(()) }
    }

    /// Steps to the first run's time, to the nearest step, and compares if a comparison is due.
    pub(super) fn follow(&mut self, first: &PublishedState) -> Result<(), String> {
        let Moment { sim_time, .. } = first.at;
        while self.world.now().sim_time + self.world.settings().time_step / 2.0 <= sim_time {
            self.world.step();
        }
        // Time may have been reset.
        let is_due = sim_time >= self.due - 1e-9 || sim_time < self.due - 2.0 * SAMPLE;
        if !is_due {
            return Ok(());
        }
        self.due = sim_time + SAMPLE;
        self.world.observe(&mut self.state);
        self.compare(first).map_err(|error| cannot_write(&error))
    }

    fn compare(&mut self, first: &PublishedState) -> io::Result<()> {
        let time = first.at.sim_time;
        for (index, layout) in first.world.entities.iter().enumerate() {
            let Some((other_index, other)) = self.state.entity(&layout.name) else { continue };
            if other.model.joints.len() != layout.model.joints.len() {
                continue;
            }
            let robot = &layout.name;
            if let (false, Some(one), Some(two)) =
                (layout.fixed_base, first.roots.get(index), self.state.roots.get(other_index))
            {
                let distance = one.pose.translation.distance(two.pose.translation);
                note(&mut self.rows, (robot, 0, ""), distance, time);
            }
            for (joint, model) in layout.model.joints.iter().enumerate() {
                let [Some(axis), Some(other_axis)] =
                    [layout, other].map(|of| of.joint_velocities.get(joint).filter(|axes| axes.len() == 1))
                else {
                    continue;
                };
                let read = |of: &PublishedState, layout: &EntityLayout, axis: usize| {
                    let at = layout.positions.start + layout.joint_positions.get(joint)?.start;
                    let axis = layout.velocities.start + axis;
                    Some([*of.positions.get(at)?, *of.velocities.get(axis)?, *of.efforts.get(axis)?])
                };
                let (Some([q, qd, effort]), Some([other_q, other_qd, other_effort])) =
                    (read(first, layout, axis.start), read(&self.state, other, other_axis.start))
                else {
                    continue;
                };
                note(&mut self.rows, (robot, joint + 1, &model.name), (q - other_q).abs(), time);
                if let Some(table) = &mut self.table {
                    let (robot, joint) = (field(robot), field(&model.name));
                    writeln!(
                        table,
                        "{time:.6},{robot},{joint},{q:?},{other_q:?},{qd:?},{other_qd:?},{effort:?},{other_effort:?}"
                    )?;
                }
            }
        }
        Ok(())
    }

    /// Returns the comparison.
    pub(super) fn end(mut self) -> Result<Comparison, String> {
        if let Some(sentence) = self.changes.not_found() {
            return Err(sentence);
        }
        if let Some(table) = &mut self.table {
            table.flush().map_err(|error| cannot_write(&error))?;
        }
        Ok(Comparison {
            changes: self.changes.texts().to_vec(),
            rows: self.rows.into_values().collect(),
            refused: self.refused,
        })
    }
}

fn note(
    rows: &mut BTreeMap<(String, usize), Difference>,
    (robot, index, joint): (&str, usize, &str),
    difference: f64,
    time: f64,
) {
    let key = (robot.to_owned(), index);
    if rows.len() >= MAX_ROWS && !rows.contains_key(&key) {
        return;
    }
    let row = rows.entry(key).or_insert_with(|| Difference {
        robot: robot.to_owned(),
        joint: joint.to_owned(),
        ..Difference::default()
    });
    if difference > row.largest {
        (row.largest, row.at) = (difference, time);
    }
    row.last = difference;
    row.square_sum += difference * difference;
    row.count = row.count.saturating_add(1);
}

/// Quotes a name for comma-separated values.
fn field(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}

fn cannot_write(error: &io::Error) -> String {
    format!("the table cannot be written: {error}")
}

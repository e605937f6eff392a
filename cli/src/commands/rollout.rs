//! `simctl rollout`: runs copies of the world with the targets of a file.

mod costs;
mod sources;
mod targets;
mod variations;

use std::path::{Path, PathBuf};

use anyhow::{Context as _, ensure};
use clap::{Args, ValueEnum};
use serde::Serialize;
use simd_client::{
    Client, Rollout as Found, packed,
    proto::{
        RolloutControl, RolloutControlMode, RolloutCost, RolloutInterpolation, RolloutJointTerm,
        RolloutQuantity, RolloutQuantityKind, RolloutRequest, rollout_cost::Term,
    },
};

use self::{sources::Sources, variations::Variation};
use super::present;
use crate::{
    complete,
    output::{
        Output, View,
        json::Stamp,
        number::fixed,
        table::{Column, Page, Table},
    },
    text_file,
};

/// Maximum size of a file for a rollout that the daemon accepts.
const MAX_BYTES: u64 = 64 * 1024 * 1024;

const FORMAT: &str = "\
A table has a line of names and a line for each knot, with commas. The lines of a copy are consecutive:
  copy,shoulder,elbow                  0, 1, ...; may be left out for a single copy
A JSON document has the same as nested lists of copies, knots and joints:
  {\"joints\": [\"shoulder\", \"elbow\"], \"targets\": [[[0.1, 0.2], [0.3, 0.4]]]}

--vary adds to joint-positions or joint-velocities, or multiplies link-masses, joint-friction,
joint-damping, gains or surface-friction:
  --copies 100 --vary link-masses=0.8..1.2 --vary joint-positions:elbow=0+-0.05
Documents of --costs and --variations are lists of the schema's RolloutCost and RolloutVariation:
  [{\"link_position\": {\"link\": \"hand\", \"position\": [0.4, 0, 0.6]}}, {\"weight\": 1e-4, \"joint_efforts\": {}}]
  [{\"of\": \"wrench\", \"names\": [\"hand\"], \"uniform\": {\"low\": -5, \"high\": 5}, \"wrench_steps\": 20}]
By default, a term has the weight 1, and both apply to ROBOT.";

#[derive(Args, Debug)]
#[command(after_help = FORMAT)]
pub(crate) struct Rollout {
    /// Name of the robot
    #[arg(add = complete::robots())]
    robot: String,
    /// Targets of joints, for each copy
    #[arg(value_name = "FILE.csv|FILE.json")]
    file: PathBuf,
    /// Meaning of the numbers
    #[arg(long, value_enum, default_value_t = Mode::Position)]
    mode: Mode,
    /// Steps from knot to knot
    #[arg(long, value_name = "STEPS", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    knot_steps: u32,
    /// Values between knots
    #[arg(long, value_enum, default_value_t = Between::Hold)]
    interpolation: Between,
    /// Steps of each copy; up to the last knot if left out
    #[arg(long)]
    steps: Option<u32>,
    /// Goal of a joint, rad or m: each step costs the square of its distance
    #[arg(long, value_name = "JOINT=POSITION", value_parser = goal, allow_hyphen_values = true)]
    goal: Vec<(String, f64)>,
    /// Cost of the square of each effort in each step
    #[arg(long, value_name = "WEIGHT", default_value_t = 0.0, allow_negative_numbers = true)]
    effort_weight: f64,
    /// Further terms of the cost of a step
    #[arg(long, value_name = "FILE.json")]
    costs: Option<PathBuf>,
    /// Number of copies, if the file has the targets of one: all follow them
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    copies: Option<u32>,
    /// Differences between copies, drawn uniformly or from a normal distribution
    #[arg(long, value_name = "OF[:NAME,...]=LOW..HIGH|MEAN+-DEVIATION", value_parser = variations::parse)]
    vary: Vec<Variation>,
    /// Further differences between copies, drawn or given
    #[arg(long, value_name = "FILE.json")]
    variations: Option<PathBuf>,
    /// Seed of random numbers
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Start from a saved state instead of the present world
    #[arg(long, value_name = "NAME")]
    from: Option<String>,
}

/// Meaning of targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Mode {
    /// rad or m
    Position,
    /// rad/s or m/s
    Velocity,
    /// N m or N
    Effort,
}

/// Values between knots.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Between {
    /// The knot before
    Hold,
    /// A straight line
    Linear,
    /// A smooth curve through the knots
    Cubic,
}

/// Reads `JOINT=POSITION`.
fn goal(text: &str) -> Result<(String, f64), String> {
    let pair = text.rsplit_once('=').and_then(|(joint, at)| Some((joint.to_owned(), at.parse().ok()?)));
    pair.filter(|(joint, _)| !joint.is_empty()).ok_or_else(|| "must be JOINT=POSITION, rad or m".to_owned())
}

pub(crate) async fn run(arguments: Rollout, client: &Client, output: Output) -> anyhow::Result<()> {
    let Rollout { robot, file, mode, knot_steps, interpolation, steps, goal, effort_weight, .. } = &arguments;
    let tried = document(file, |text| targets::read(file, text))?;
    let copies = copies(&arguments, tried.targets.len())?;
    let knots = u32::try_from(tried.targets.first().map_or(0, Vec::len)).unwrap_or(u32::MAX);
    let of_joint = |kind: RolloutQuantityKind| RolloutQuantity {
        kind: kind.into(),
        robot: robot.clone(),
        names: tried.joints.clone(),
    };
    let term = |joints: Vec<String>, targets: Vec<f64>| RolloutJointTerm {
        robot: robot.clone(),
        joints,
        targets,
        wrapped: false,
    };
    let mut costs = Vec::new();
    if !goal.is_empty() {
        let (joints, targets) = goal.iter().cloned().unzip();
        let term = Some(Term::JointPositions(term(joints, targets)));
        costs.push(RolloutCost { weight: 1.0, term, ..Default::default() });
    }
    if *effort_weight != 0.0 {
        let term = Some(Term::JointEfforts(term(tried.joints.clone(), Vec::new())));
        costs.push(RolloutCost { weight: *effort_weight, term, ..Default::default() });
    }
    if let Some(file) = &arguments.costs {
        costs.extend(document(file, |text| costs::read(text, robot))?);
    }
    let variations = match &arguments.variations {
        Some(file) => document(file, |text| variations::requests(variations::read(text)?, robot))?,
        None => Vec::new(),
    };
    let typed = variations::requests(arguments.vary.clone(), robot)?;
    let request = RolloutRequest {
        saved_state: arguments.from.clone().unwrap_or_default(),
        copies,
        steps: steps.unwrap_or_else(|| knots.saturating_mul(*knot_steps)),
        variations: typed.into_iter().chain(variations).collect(),
        seed: arguments.seed,
        controls: vec![RolloutControl {
            robot: robot.clone(),
            joints: tried.joints.clone(),
            mode: match mode {
                Mode::Position => RolloutControlMode::Position,
                Mode::Velocity => RolloutControlMode::Velocity,
                Mode::Effort => RolloutControlMode::Effort,
            }
            .into(),
            values: packed(&tried.numbers()),
            knots,
            knot_steps: *knot_steps,
            interpolation: match interpolation {
                Between::Hold => RolloutInterpolation::Hold,
                Between::Linear => RolloutInterpolation::Linear,
                Between::Cubic => RolloutInterpolation::Cubic,
            }
            .into(),
            ..Default::default()
        }],
        quantities: vec![of_joint(RolloutQuantityKind::JointPositions)],
        costs,
        ..Default::default()
    };
    let sources = Sources::of(&arguments, &request);
    let found = client.rollout(request, |_| ()).await.map_err(|error| sources.explain(error))?;
    output.one(&RolloutView::new(&found, tried.joints)?)
}

/// Returns the number of copies, given the number in the file.
fn copies(arguments: &Rollout, in_file: usize) -> anyhow::Result<u32> {
    let found = u32::try_from(in_file).unwrap_or(u32::MAX);
    let asked = arguments.copies.unwrap_or(found);
    ensure!(
        in_file == 1 || asked == found,
        "{} has targets of {found} copies, and --copies says {asked}",
        arguments.file.display()
    );
    Ok(asked)
}

/// Reads a file.
fn document<T>(file: &Path, reads: impl FnOnce(&str) -> anyhow::Result<T>) -> anyhow::Result<T> {
    reads(&text_file::read(file, MAX_BYTES)?).with_context(|| file.display().to_string())
}

/// `rollout`.
#[derive(Serialize)]
struct RolloutView {
    /// Stamp of the state from which the copies started.
    start: Stamp,
    joints: Vec<String>,
    copies: Vec<CopyView>,
    processor_seconds: f64,
}

#[derive(Serialize)]
struct CopyView {
    copy: usize,
    /// Number of steps that it did.
    steps: u32,
    /// Null if it ended early, or without terms of the cost.
    cost: Option<f64>,
    /// Final positions, in the order of the joints; null if it ended early.
    positions: Vec<Option<f64>>,
    /// Reason why it ended early.
    #[serde(skip_serializing_if = "Option::is_none")]
    ended: Option<String>,
}

impl RolloutView {
    fn new(found: &Found, joints: Vec<String>) -> anyhow::Result<Self> {
        let costs = found.total_costs();
        let rows = found.states.chunks_exact(joints.len().max(1));
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        let copies = found.result.steps_done.iter().zip(rows).enumerate();
        let view = |(copy, (steps, row)): (usize, (&u32, &[f64]))| CopyView {
            copy,
            steps: *steps,
            cost: costs.get(copy).copied().and_then(finite),
            positions: row.iter().map(|value| finite(*value)).collect(),
            ended: (found.result.ended.iter())
                .find(|end| end.copy as usize == copy)
                .map(|end| end.reason.clone()),
        };
        Ok(Self {
            start: present(found.result.start, "start")?.into(),
            joints,
            copies: copies.map(view).collect(),
            processor_seconds: found.result.processor_seconds,
        })
    }
}

impl View for RolloutView {
    fn page(&self) -> Page {
        let mut columns = vec![Column::right("COPY"), Column::right("STEPS"), Column::right("COST")];
        columns.extend(self.joints.iter().map(|joint| Column::right(joint.to_uppercase())));
        let number = |value: &Option<f64>| value.map_or_else(|| "-".to_owned(), |value| fixed(value, 4));
        let row = |copy: &CopyView| {
            let mut row = vec![copy.copy.to_string(), copy.steps.to_string(), number(&copy.cost)];
            row.extend(copy.positions.iter().map(number));
            row
        };
        let rows = self.copies.iter().map(row).collect();
        let mut page = Page::of_line(format!("from {}", self.start)).table(Table::new(columns, rows));
        for copy in &self.copies {
            if let Some(reason) = &copy.ended {
                page = page.line(format!("copy {} ended: {reason}", copy.copy));
            }
        }
        page
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_goal_is_what_stands_behind_the_last_equals_sign() {
        assert_eq!(goal("a=b=-0.5").unwrap(), ("a=b".to_owned(), -0.5));
        assert!(goal("elbow").is_err() && goal("=1").is_err());
    }
}

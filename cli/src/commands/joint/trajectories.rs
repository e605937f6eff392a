//! `simctl joint trajectories`: active and waiting trajectories, with their progress.

use clap::Args;
use serde::Serialize;
use simd_client::{Client, proto};

use crate::{
    complete,
    output::{
        Output, json,
        number::fixed,
        table::{Column, Page, Table},
    },
};

#[derive(Args, Debug)]
pub(crate) struct Trajectories {
    /// Name of the robot; all robots if left out
    #[arg(add = complete::robots())]
    robot: Option<String>,
}

pub(super) async fn list(arguments: Trajectories, client: &Client, output: Output) -> anyhow::Result<()> {
    let trajectories = client.trajectories(arguments.robot.as_deref()).await?;
    let views: Vec<TrajectoryView> = trajectories.into_iter().map(TrajectoryView::from).collect();
    output.list(&views, table)
}

/// Times are simulated seconds, positions rad or m.
#[derive(Serialize)]
struct TrajectoryView {
    robot: String,
    id: u64,
    joints: Vec<String>,
    /// `active`, `queued` or `delayed`.
    status: String,
    elapsed: f64,
    duration: f64,
    delay: f64,
    /// Empty unless active.
    desired: Vec<f64>,
    actual: Vec<f64>,
}

impl TrajectoryView {
    /// Returns the largest error of a joint from its desired position, with its name.
    fn largest_error(&self) -> Option<(f64, &str)> {
        let errors = self.desired.iter().zip(&self.actual).map(|(desired, actual)| (desired - actual).abs());
        errors.zip(self.joints.iter().map(String::as_str)).max_by(|one, other| one.0.total_cmp(&other.0))
    }
}

impl From<proto::Trajectory> for TrajectoryView {
    fn from(trajectory: proto::Trajectory) -> Self {
        let status = json::name("TRAJECTORY_STATUS_", trajectory.status().as_str_name());
        let proto::Trajectory { robot, id, joints, elapsed, duration, delay, desired, actual, .. } =
            trajectory;
        Self { robot, id, joints, status, elapsed, duration, delay, desired, actual }
    }
}

fn table(trajectories: &[TrajectoryView]) -> Page {
    let columns = vec![
        Column::left("ROBOT"),
        Column::right("ID"),
        Column::left("STATUS"),
        Column::right("ELAPSED s"),
        Column::right("DURATION s"),
        Column::left("LARGEST ERROR"),
        Column::left("JOINTS"),
    ];
    let rows = trajectories.iter().map(|trajectory| {
        let error = trajectory.largest_error();
        vec![
            trajectory.robot.clone(),
            trajectory.id.to_string(),
            trajectory.status.clone(),
            fixed(trajectory.elapsed, 3),
            fixed(trajectory.duration, 3),
            error.map_or_else(|| "-".to_owned(), |(error, joint)| format!("{} {joint}", fixed(error, 5))),
            trajectory.joints.join(" "),
        ]
    });
    Page::new().table(Table::new(columns, rows.collect()))
}

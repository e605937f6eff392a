//! `simctl joint play`: a trajectory from a table, which the daemon follows.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow, bail};
use clap::Args;
use serde::Serialize;
use simd_client::{
    Client,
    proto::{FollowTrajectoryRequest, TrajectoryOutcome, TrajectoryPoint, TrajectoryTolerance, event::Kind},
};

use crate::{
    commands::{ended, present},
    output::{Output, View, json::Stamp, number::count, table::Page},
    text_file,
};

/// Maximum size of a trajectory file that the daemon accepts.
const MAX_BYTES: u64 = 64 * 1024 * 1024;

pub(super) const FORMAT: &str = "\
The file has a line of names and a line for each point, with commas:
  time,shoulder,elbow                  positions, in rad or m; seconds that grow
  time,elbow,elbow.velocity            also .acceleration and .effort, for all joints or for none
Between two points, positions are linear in time, cubic with velocities, and quintic with accelerations
too. The motion to the first point begins at the joints' present positions.";

#[derive(Args, Debug)]
pub(crate) struct Play {
    /// Name of the robot
    robot: String,
    /// Table of points
    #[arg(value_name = "FILE.csv")]
    file: PathBuf,
    /// Begin after the present trajectories of the joints have succeeded, instead of ending them
    #[arg(long)]
    queue: bool,
    /// Largest deviation of a joint from the path, rad or m
    #[arg(long, value_name = "DISTANCE")]
    path_tolerance: Option<f64>,
    /// Largest deviation of a joint from the last point, rad or m
    #[arg(long, value_name = "DISTANCE")]
    goal_tolerance: Option<f64>,
    /// Seconds after the last point in which joints may still reach that tolerance
    #[arg(long, value_name = "SECONDS")]
    goal_time_tolerance: Option<f64>,
    /// Do not wait for the end
    #[arg(long)]
    no_wait: bool,
}

pub(crate) async fn play(arguments: Play, client: &Client, output: Output) -> anyhow::Result<()> {
    let Play { robot, file, queue, path_tolerance, goal_tolerance, goal_time_tolerance, no_wait } = arguments;
    let (joints, points) = read(&file)?;
    let tolerances = |tolerance: Option<f64>| {
        let of = |joint: &String| TrajectoryTolerance {
            joint: joint.clone(),
            position: tolerance,
            velocity: None,
        };
        if tolerance.is_some() { joints.iter().map(of).collect() } else { Vec::new() }
    };
    let number = points.len();
    let request = FollowTrajectoryRequest {
        robot: robot.clone(),
        path_tolerances: tolerances(path_tolerance),
        goal_tolerances: tolerances(goal_tolerance),
        joints,
        points,
        queued: queue,
        goal_time_tolerance,
        ..Default::default()
    };
    // Subscribed before it begins, so that its end is included.
    let mut events = client.watch_events(0).await?;
    let answer = client.follow_trajectory(request).await?;
    let (id, stamp) = (answer.id, present(answer.stamp, "stamp")?.into());
    if no_wait {
        return output.one(&Played { robot, id, stamp, points: number, end: None });
    }
    loop {
        let event = events.next().await?.ok_or_else(|| ended(client))?.event;
        let Some(Kind::TrajectoryEnded(end)) = event.kind else { continue };
        if (end.id, &end.robot) != (id, &robot) {
            continue;
        }
        if end.outcome() != TrajectoryOutcome::Succeeded {
            bail!("the trajectory of {robot} ended: {}", end.message);
        }
        let stamp = present(event.stamp, "stamp")?.into();
        return output.one(&Played { robot, id, stamp, points: number, end: Some(end.message) });
    }
}

fn read(file: &Path) -> anyhow::Result<(Vec<String>, Vec<TrajectoryPoint>)> {
    parse(&text_file::read(file, MAX_BYTES)?).with_context(|| file.display().to_string())
}

/// Parses joints, and the points of all of them.
fn parse(text: &str) -> anyhow::Result<(Vec<String>, Vec<TrajectoryPoint>)> {
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let Some((_, head)) = lines.next() else { bail!("it is empty; its first line names time and joints") };
    let names: Vec<&str> = head.split(',').map(str::trim).collect();
    let Some((&"time", columns)) = names.split_first() else {
        bail!(
            "its first column is {:?}; it must be time",
            text_file::shown(names.first().copied().unwrap_or_default())
        )
    };
    if let Some(twice) = columns.iter().enumerate().find(|(at, name)| columns[..*at].contains(name)) {
        bail!("column {} is given twice", twice.1);
    }
    let has_kind = |name: &&&str| KINDS.iter().any(|kind| name.ends_with(kind));
    let joints: Vec<String> =
        columns.iter().filter(|name| !has_kind(name)).map(|&name| name.to_owned()).collect();
    let Some(first) = joints.first() else { bail!("it names no joint after time") };
    // Columns of each quantity, in the order of the joints; none if the first joint has none.
    let column = |wanted: &str| columns.iter().position(|name| *name == wanted).map(|at| at + 1);
    let mut indices = Vec::new();
    for kind in std::iter::once("").chain(KINDS) {
        if column(&format!("{first}{kind}")).is_none() {
            indices.push(Vec::new());
            continue;
        }
        let all = joints.iter().map(|joint| {
            column(&format!("{joint}{kind}")).with_context(|| format!("column {joint}{kind} is missing"))
        });
        indices.push(all.collect::<anyhow::Result<Vec<usize>>>()?);
    }
    let used: usize = indices.iter().map(Vec::len).sum();
    if used != columns.len() {
        bail!(
            "{} columns follow time, and {used} belong to the joints: one of the names is not a joint",
            columns.len()
        );
    }
    let mut points = Vec::new();
    for (number, line) in lines {
        let values = line.split(',').map(|value| {
            value
                .trim()
                .parse::<f64>()
                .map_err(|_| anyhow!("line {}: {:?} is not a number", number + 1, text_file::shown(value)))
        });
        let values: Vec<f64> = values.collect::<anyhow::Result<_>>()?;
        if values.len() != names.len() {
            bail!(
                "line {} has {}, and there are {}",
                number + 1,
                count(values.len(), "value"),
                count(names.len(), "column")
            );
        }
        let of = |indices: &[usize]| indices.iter().map(|&at| values[at]).collect();
        points.push(TrajectoryPoint {
            time: values[0],
            positions: of(&indices[0]),
            velocities: of(&indices[1]),
            accelerations: of(&indices[2]),
            efforts: of(&indices[3]),
        });
    }
    Ok((joints, points))
}

/// Suffixes of a joint's name, in the order of a point's lists after positions.
const KINDS: [&str; 3] = [".velocity", ".acceleration", ".effort"];

/// `joint play`.
#[derive(Serialize)]
struct Played {
    robot: String,
    id: u64,
    stamp: Stamp,
    points: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    end: Option<String>,
}

impl View for Played {
    fn page(&self) -> Page {
        let Self { robot, id, stamp, points, end } = self;
        let what = format!("trajectory {} of {}", id, count(*points, "point"));
        Page::of_line(match end {
            Some(end) => format!("{robot}: {what}: {end} at {stamp}"),
            None => format!("{robot}: {what} from {stamp}"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_becomes_points_in_the_order_of_its_joints() {
        let (joints, points) =
            parse("time, shoulder,elbow,elbow.velocity,shoulder.velocity\n0.5,1,2,3,4\n\n1,-1,-2e0,0,0\n")
                .unwrap();
        assert_eq!(joints, ["shoulder", "elbow"]);
        assert_eq!((points[0].time, points.len()), (0.5, 2));
        assert_eq!((&points[0].positions, &points[0].velocities), (&vec![1.0, 2.0], &vec![4.0, 3.0]));
        assert!(points[1].accelerations.is_empty() && points[1].efforts.is_empty());
    }

    #[test]
    fn a_mistake_names_its_line_or_column() {
        for (text, part) in [
            ("", "empty"),
            ("shoulder\n1", "its first column is \"shoulder\""),
            ("time\n1", "names no joint"),
            ("time,a\n1,x", "line 2: \"x\" is not a number"),
            ("time,a\n1", "line 2 has 1 value"),
            ("time,a,b,a.velocity\n", "column b.velocity is missing"),
            ("time,a,b.effort\n", "is not a joint"),
            ("time,a,a\n", "twice"),
        ] {
            let sentence = parse(text).unwrap_err().to_string();
            assert!(sentence.contains(part), "{text:?}: {sentence}");
        }
    }
}

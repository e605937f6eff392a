//! `simctl claim`: robots, joints and the world, taken for one client.

use std::time::Duration;

use clap::{Args, Subcommand};
use serde::Serialize;
use simd_client::{
    Client,
    proto::{ClaimJointsRequest, JointSelection},
};

use crate::{
    complete,
    output::{
        Output, View,
        table::{Column, Page, Table},
    },
};

const ABOUT: &str = "\
What is claimed is changed by those alone who come with the claim: its joints' targets, resets and
settings, the robot's pose, surfaces, wrenches, its reload and its end. While another client holds a claim,
others pause, play, reset and restore the world, and change its physics, with a claim on the world
alone. simctl comes with the claim of --claim or $SIMD_CLAIM.";

#[derive(Debug, Subcommand)]
pub(crate) enum Claim {
    /// Takes robots, joints or the world, and prints the secret of the claim
    #[command(after_help = ABOUT)]
    Take(Take),
    /// Gives the claim of --claim or $SIMD_CLAIM back; joints hold their position
    Release,
    /// Shows who holds what
    List,
}

#[derive(Args, Debug)]
pub(crate) struct Take {
    /// Robots, and joints of robots
    #[arg(value_name = "ROBOT[/JOINT]", required_unless_present = "world", add = complete::robots_or_joints())]
    what: Vec<String>,
    /// The world: what concerns all robots
    #[arg(long)]
    world: bool,
    /// Seconds after which an unused claim ends: 0.1 to 3600. Each call that comes with it begins them anew
    #[arg(long, default_value_t = 10.0, value_name = "SECONDS")]
    lease: f64,
    /// Who claims, for others to read
    #[arg(long, default_value = "simctl", value_name = "NAME")]
    holder: String,
    /// Claims with a lower one that are in the way end
    #[arg(long, default_value_t = 0)]
    priority: u32,
    /// Claims that are in the way end, whatever their priority: for admins
    #[arg(long)]
    take_over: bool,
}

pub(crate) async fn run(command: Claim, client: &Client, output: Output) -> anyhow::Result<()> {
    match command {
        Claim::Take(take) => {
            let request = ClaimJointsRequest {
                selections: selections(&take.what),
                holder: take.holder,
                lease: take.lease,
                world: take.world,
                priority: take.priority,
                take_over: take.take_over,
                ..Default::default()
            };
            let claim = client.claim(request).await?;
            output.one(&Taken { claim, lease: take.lease })
        }
        Claim::Release => {
            anyhow::ensure!(!client.held_claim().is_empty(), "say which, with --claim or $SIMD_CLAIM");
            client.release_joints(client.held_claim()).await?;
            output.one(&Released { released: true })
        }
        Claim::List => output.list(&held(client).await?, list),
    }
}

/// `arm` is a whole robot, `arm/elbow` a joint of it. Joints of one robot are in one selection.
fn selections(what: &[String]) -> Vec<JointSelection> {
    let mut selections: Vec<JointSelection> = Vec::new();
    for text in what {
        let (robot, joint) =
            text.split_once('/').map_or((text.as_str(), None), |(of, joint)| (of, Some(joint)));
        let known =
            selections.iter_mut().find(|of| of.robot == robot && joint.is_some() != of.joints.is_empty());
        match (known, joint) {
            (Some(known), Some(joint)) => known.joints.push(joint.to_owned()),
            (Some(_), None) => {}
            (None, joint) => selections.push(JointSelection {
                robot: robot.to_owned(),
                joints: joint.map(str::to_owned).into_iter().collect(),
            }),
        }
    }
    selections
}

/// Joints of robots that are held whole are not listed one by one.
async fn held(client: &Client) -> anyhow::Result<Vec<Held>> {
    let mut all = Vec::new();
    let world = client.world_statistics().await?.claimed_by;
    if !world.is_empty() {
        all.push(Held { what: "(world)".to_owned(), holder: world });
    }
    for robot in client.robots().await? {
        if !robot.claimed_by.is_empty() {
            all.push(Held { what: robot.name, holder: robot.claimed_by });
            continue;
        }
        let layout = client.joint_layout(&robot.name).await?;
        let claimed = layout.joints.into_iter().filter(|joint| !joint.claimed_by.is_empty());
        all.extend(
            claimed.map(|joint| Held {
                what: format!("{}/{}", robot.name, joint.name),
                holder: joint.claimed_by,
            }),
        );
    }
    Ok(all)
}

#[derive(Serialize)]
struct Taken {
    /// The secret.
    claim: String,
    /// Seconds.
    lease: f64,
}

impl View for Taken {
    fn page(&self) -> Page {
        let lease = Duration::try_from_secs_f64(self.lease).unwrap_or_default();
        Page::of_line(format!("export SIMD_CLAIM={}  # ends when it is not used for {lease:?}", self.claim))
    }
}

#[derive(Serialize)]
struct Released {
    released: bool,
}

impl View for Released {
    fn page(&self) -> Page {
        Page::of_line("released; joints hold their position".to_owned())
    }
}

#[derive(Serialize)]
struct Held {
    /// `ROBOT`, `ROBOT/JOINT` or `(world)`.
    what: String,
    holder: String,
}

fn list(all: &[Held]) -> Page {
    let columns = vec![Column::left("WHAT"), Column::left("HOLDER")];
    let rows = all.iter().map(|held| vec![held.what.clone(), held.holder.clone()]).collect();
    Page::new().table(Table::new(columns, rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_is_one_selection_with_all_of_its_named_joints() {
        let what = ["arm/a", "leg", "arm/b", "leg"].map(str::to_owned);
        let read = selections(&what);
        let read: Vec<_> = read.iter().map(|of| (of.robot.as_str(), of.joints.join(" "))).collect();
        assert_eq!(read, [("arm", "a b".to_owned()), ("leg", String::new())]);
        // Both is more than either.
        assert_eq!(selections(&["arm".to_owned(), "arm/a".to_owned()]).len(), 2);
    }
}

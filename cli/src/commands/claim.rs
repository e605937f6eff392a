//! `simctl claim`: exclusive rights of a client to robots, joints or the world.

use std::time::Duration;

use clap::{Args, Subcommand};
use serde::Serialize;
use simd_client::{
    Client,
    proto::{ClaimJointsRequest, JointSelection},
};

use crate::{
    complete,
    failure::Usage,
    output::{
        Output, View,
        table::{Column, Page, Table},
    },
};

const ABOUT: &str = "\
Only calls with the claim can change what it covers: targets, resets and settings of joints, and the
robot's pose, surfaces, wrenches, reload and deletion. While another client holds a claim, only a claim
on the world allows to pause, play, reset and restore it, and to change its physics. simctl uses the
claim of --claim or $SIMD_CLAIM.";

#[derive(Debug, Subcommand)]
pub(crate) enum Claim {
    /// Claims robots, joints or the world, and prints the secret of the claim
    #[command(after_help = ABOUT)]
    Take(Take),
    /// Releases the claim of --claim or $SIMD_CLAIM; joints hold their position
    Release,
    /// Shows the holders of claims
    List,
}

#[derive(Args, Debug)]
pub(crate) struct Take {
    /// Robots, and joints of robots
    #[arg(value_name = "ROBOT[/JOINT]", required_unless_present = "world", add = complete::robots_or_joints())]
    what: Vec<String>,
    /// Also claim the world
    #[arg(long)]
    world: bool,
    /// Seconds after which an unused claim ends: 0.1 to 3600. Each call with the claim renews it
    #[arg(long, default_value_t = 10.0, value_name = "SECONDS")]
    lease: f64,
    /// Name of the holder, for others to read
    #[arg(long, default_value = "simctl", value_name = "NAME")]
    holder: String,
    /// Priority: conflicting claims with a lower one end
    #[arg(long, default_value_t = 0)]
    priority: u32,
    /// End conflicting claims regardless of their priority: for admins
    #[arg(long)]
    take_over: bool,
}

pub(crate) async fn run(command: Claim, client: &Client, output: Output) -> anyhow::Result<()> {
    match command {
        Claim::Take(take) => {
            // The schema's 0 is its default.
            if take.lease == 0.0 {
                return Err(Usage("--lease is 0; it must be between 0.1 s and 3600 s".to_owned()).into());
            }
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
            anyhow::ensure!(!client.held_claim().is_empty(), "name the claim with --claim or $SIMD_CLAIM");
            client.release_joints(client.held_claim()).await?;
            output.one(&Released { released: true })
        }
        Claim::List => output.list(&held(client).await?, list),
    }
}

/// Parses `arm` as a whole robot, and `arm/elbow` as one of its joints. Joints of one robot share a
/// selection.
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

/// Returns all claims; joints of robots that are held as a whole are not listed.
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
    /// Secret of the claim.
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
        // The whole robot includes its joint.
        assert_eq!(selections(&["arm".to_owned(), "arm/a".to_owned()]).len(), 2);
    }
}

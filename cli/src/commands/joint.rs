//! `simctl joint`: joints, their states, targets and properties.

mod blocked;
mod hz;
mod info;
mod play;
mod properties;
mod reading;
mod states;
mod trajectories;
mod wait;

use anyhow::bail;
use clap::{Args, Subcommand};
use serde::Serialize;
use simd_client::{
    Client, RobotReading, every_joint, joint_target,
    proto::{
        ClampedTarget, JointReset, JointSelection, JointType, LimitPolicy, Quaternion, RobotTargets,
        SetJointTargetsRequest, SphericalReset,
    },
    some_joints,
};

use super::{ended, present};
use crate::{
    complete,
    failure::warn,
    output::{
        Output, View,
        json::Stamp,
        number::{count, exact},
        table::Page,
    },
    quantity::Motion,
    target::{Placement, placement},
};
use info::InfoView;
use play::Play;
use reading::{ReadingView, Sample};
use states::{Wanted, wanted};

const TARGETS: &str = "\
@home sets the positions of a named state, from the robot's SRDF or its description; @arm/home is the
state of the group arm. A target of a single joint after it overrides the state.

A target is one of
  0.5              a position, in rad or m; also pos:0.5
  90deg  12mm      a position with a unit: rad, deg, m, cm, mm
  vel:1            a velocity, in rad/s or m/s; also deg/s, rpm, mm/s, cm/s
  eff:0.2          an effort, in N m or N; also 0.2Nm, 0.2N
  passive          no actuator
  hold             stay where it is
  quat:0,0,0.6,0.8 for a spherical joint: an orientation, x y z w in the joint's frame
  angvel:0,0,1     for a spherical joint: an angular velocity in the child's axes, rad/s
  torque:0,0,0.2   for a spherical joint: a torque in the child's axes, N m
and may be followed by
  ,kp=100          stiffness of a position (N m/rad or N/m)
  ,kd=5            damping of a position or velocity (N m s/rad or N s/m)
  ,vel=0.1         velocity that a position's damper pulls towards
  ,ff=2            effort added to a position's or velocity's effort
  ,max_effort=3    maximum effort for this position or velocity
  ,max_velocity=1  maximum velocity on the way to a position";

#[derive(Debug, Subcommand)]
pub(crate) enum Joint {
    /// Shows the joints of a robot: type, axis, limits, mode, holder
    List {
        /// Name of the robot
        #[arg(add = complete::robots())]
        robot: String,
        /// Also show damping, friction, gains, parent and child links
        #[arg(short, long)]
        wide: bool,
    },
    /// Shows positions, velocities and efforts of joints
    Get {
        /// Name of the robot
        #[arg(add = complete::robots())]
        robot: String,
        /// Names of the joints; all joints that can move if left out
        #[arg(add = complete::joints())]
        joints: Vec<String>,
    },
    /// Sets targets of joints, all at one step
    #[command(after_help = TARGETS)]
    Set(Set),
    /// Makes joints follow a trajectory from a table, and waits for its end
    #[command(after_help = play::FORMAT)]
    Play(Play),
    /// Shows active and waiting trajectories
    Trajectories(trajectories::Trajectories),
    /// Changes properties of joints: damping, friction, gains, gravity compensation
    Properties(properties::Properties),
    /// Sets positions of joints; without joints, all of them return to their spawned positions
    Reset {
        /// Name of the robot
        #[arg(add = complete::robots())]
        robot: String,
        /// rad and rad/s or m and m/s, or with units, or quat:X,Y,Z,W for a spherical joint
        #[arg(value_name = "JOINT=POSITION[,VELOCITY]", value_parser = placement, add = complete::assignments())]
        placements: Vec<Placement>,
    },
    /// Shows positions of joints repeatedly, until Ctrl-C
    Watch(Watch),
    /// Measures the rate of states, and its jitter, until Ctrl-C
    Hz(hz::Hz),
}

#[derive(Args, Debug)]
pub(crate) struct Set {
    /// Name of the robot
    #[arg(add = complete::robots())]
    robot: String,
    /// Target of each joint
    #[arg(value_name = "JOINT=TARGET|@STATE", value_parser = wanted, required = true, add = complete::assignments())]
    targets: Vec<Wanted>,
    /// Refuse a target beyond a limit; otherwise the limit is used
    #[arg(long)]
    refuse_beyond_limits: bool,
    /// Wait until the joints are at their position targets (0.01 rad, 1 mm) and nearly still, and show them. The
    /// longest wait is in simulated time
    #[arg(long, value_name = "SECONDS")]
    wait: Option<f64>,
}

#[derive(Args, Debug)]
pub(crate) struct Watch {
    /// Name of the robot
    #[arg(add = complete::robots())]
    robot: String,
    /// Names of the joints; all joints that can move if left out
    #[arg(add = complete::joints())]
    joints: Vec<String>,
    /// States per second: 0.1 to 1000
    #[arg(short, long, default_value_t = 10.0, value_name = "HZ")]
    rate: f64,
    /// End after this number of states
    #[arg(short, long, value_name = "N")]
    count: Option<u64>,
}

pub(crate) async fn run(command: Joint, client: &Client, output: Output) -> anyhow::Result<()> {
    match command {
        Joint::List { robot, wide } => {
            let layout = client.joint_layout(&robot).await?;
            let joints: Vec<InfoView> = layout.joints.iter().map(InfoView::from).collect();
            output.list(&joints, |joints| info::list(joints, wide))
        }
        Joint::Get { robot, joints } => {
            let reading = client.read_joints(&selection(&robot, joints)).await?;
            output.one(&ReadingView::from(reading))
        }
        Joint::Set(arguments) => set(arguments, client, output).await,
        Joint::Play(arguments) => play::play(arguments, client, output).await,
        Joint::Trajectories(arguments) => trajectories::list(arguments, client, output).await,
        Joint::Properties(arguments) => properties::set(arguments, client, output).await,
        Joint::Reset { robot, placements } => reset(robot, placements, client, output).await,
        Joint::Watch(arguments) => {
            tokio::select! {
                done = watch(arguments, client, output) => done,
                _ = tokio::signal::ctrl_c() => Ok(()),
            }
        }
        Joint::Hz(arguments) => hz::run(&arguments, client, output).await,
    }
}

fn selection(robot: &str, joints: Vec<String>) -> JointSelection {
    if joints.is_empty() { every_joint(robot) } else { some_joints(robot, joints) }
}

async fn set(arguments: Set, client: &Client, output: Output) -> anyhow::Result<()> {
    let Set { robot, targets, refuse_beyond_limits, wait } = arguments;
    let targets = states::resolved(targets, &robot, client).await?;
    let units = targets.iter().filter_map(|target| Some((target.joint.as_str(), target.motion?)));
    check_units(client, &robot, units.collect()).await?;
    let number = targets.len();
    let names = targets.iter().map(|target| target.joint.clone()).collect();
    let limit_policy = if refuse_beyond_limits { LimitPolicy::Refuse } else { LimitPolicy::Clamp };
    let joints = targets.into_iter().map(|target| joint_target(target.joint, target.target)).collect();
    let request = SetJointTargetsRequest {
        robots: vec![RobotTargets { robot: robot.clone(), joints, ..Default::default() }],
        limit_policy: limit_policy.into(),
        ..Default::default()
    };
    let answer = client.set_targets(request).await?;
    for clamped in &answer.clamped {
        warn(&format!(
            "{} is beyond the limit of joint {}, which is used instead: {}",
            exact(clamped.requested),
            clamped.joint,
            exact(clamped.applied)
        ));
    }
    let stamp = present(answer.stamp, "stamp")?;
    if let Some(seconds) = wait {
        let there = wait::until_there(client, &selection(&robot, names), seconds, stamp.sequence).await?;
        return output.one(&ReadingView::from(there));
    }
    let stamp = stamp.into();
    let clamped = answer.clamped.into_iter().map(ClampedView::from).collect();
    output.one(&WasSet { robot, stamp, clamped, number })
}

async fn reset(
    robot: String,
    placements: Vec<Placement>,
    client: &Client,
    output: Output,
) -> anyhow::Result<()> {
    let units = placements.iter().filter_map(|placement| Some((placement.joint.as_str(), placement.motion?)));
    check_units(client, &robot, units.collect()).await?;
    let reset = |placement: Placement| JointReset {
        joint: placement.joint,
        position: placement.position,
        velocity: placement.velocity,
        axis: 0,
        spherical: placement.orientation.map(|[x, y, z, w]| SphericalReset {
            orientation: Some(Quaternion { x, y, z, w }),
            angular_velocity: None,
        }),
    };
    let joints: Vec<JointReset> = placements.into_iter().map(reset).collect();
    let number = joints.len();
    let stamp = client.reset_joints(&robot, joints).await?.into();
    output.one(&WasReset { robot, stamp, number })
}

/// Checks the units: degrees do not fit a sliding joint, nor millimetres a turning one. Without units, the
/// daemon is not asked.
async fn check_units(client: &Client, robot: &str, units: Vec<(&str, Motion)>) -> anyhow::Result<()> {
    if units.is_empty() {
        return Ok(());
    }
    let layout = client.joint_layout(robot).await?;
    for (name, motion) in units {
        let kind = layout.joints.iter().find(|joint| joint.name == name).map(|joint| joint.r#type());
        match (kind, motion) {
            (Some(JointType::Prismatic), Motion::Turns) => {
                bail!("joint {name} slides: its units are those of lengths, not of angles")
            }
            (Some(JointType::Revolute | JointType::Continuous), Motion::Slides) => {
                bail!("joint {name} turns: its units are those of angles, not of lengths")
            }
            // The daemon refuses an unknown joint, as without units.
            _ => {}
        }
    }
    Ok(())
}

async fn watch(arguments: Watch, client: &Client, output: Output) -> anyhow::Result<()> {
    let selection = selection(&arguments.robot, arguments.joints);
    let mut layout = client.joint_layout(&selection.robot).await?;
    let mut watch = client.watch(vec![selection.clone()], arguments.rate).await?;
    let mut shown = 0;
    while arguments.count.is_none_or(|count| shown < count) {
        let states = watch.next().await?.ok_or_else(|| ended(client))?;
        if !RobotReading::fits(&layout, &states) {
            // Reloaded. States from before the reload are not shown.
            layout = client.joint_layout(&selection.robot).await?;
            if !RobotReading::fits(&layout, &states) {
                continue;
            }
        }
        let reading = RobotReading::new(&layout, &selection, &states)?;
        output.item(&Sample(reading.into()))?;
        shown += 1;
    }
    Ok(())
}

/// `joint set`.
#[derive(Serialize)]
struct WasSet {
    robot: String,
    stamp: Stamp,
    clamped: Vec<ClampedView>,
    #[serde(skip)]
    number: usize,
}

#[derive(Serialize)]
struct ClampedView {
    joint: String,
    requested: f64,
    applied: f64,
}

impl From<ClampedTarget> for ClampedView {
    fn from(clamped: ClampedTarget) -> Self {
        Self { joint: clamped.joint, requested: clamped.requested, applied: clamped.applied }
    }
}

impl View for WasSet {
    fn page(&self) -> Page {
        Page::of_line(format!("{}: {} from {}", self.robot, count(self.number, "new target"), self.stamp))
    }
}

/// `joint reset`.
#[derive(Serialize)]
struct WasReset {
    robot: String,
    stamp: Stamp,
    #[serde(skip)]
    number: usize,
}

impl View for WasReset {
    fn page(&self) -> Page {
        let what = match self.number {
            0 => "all joints".to_owned(),
            number => count(number, "joint"),
        };
        Page::of_line(format!("{}: reset {what} at {}", self.robot, self.stamp))
    }
}

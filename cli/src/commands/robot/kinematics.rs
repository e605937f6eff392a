//! `simctl robot links` and `simctl robot ik`: poses of links, and inverse kinematics.

use anyhow::bail;
use clap::Args;
use serde::Serialize;
use simd_client::{
    Client, Target,
    proto::{
        ComputeInverseKinematicsRequest, ComputeInverseKinematicsResponse, JointInfo, JointLayout, JointMode,
        JointTarget, JointType, LinkInfo, Pose, Quaternion, RobotLinkStates, RobotTargets,
        SetJointTargetsRequest, Vector3,
    },
};

use crate::{
    commands::present,
    complete,
    output::{
        Output, View,
        json::{PoseView, Stamp},
        number::{fixed, several},
        table::{Column, Page, Table},
    },
    pose,
};

#[derive(Args, Debug)]
pub(crate) struct Ik {
    /// Name of the robot
    #[arg(add = complete::robots())]
    robot: String,
    /// Name of the link
    link: String,
    /// Target of its frame in the world: metres, and radians about the fixed axes; without angles only the
    /// position counts
    #[arg(value_name = "X,Y,Z[,ROLL,PITCH,YAW]", value_parser = pose::parse, allow_hyphen_values = true)]
    pose: Pose,
    /// Joint that may move; may be repeated. All actuated ones if left out
    #[arg(long = "joint", value_name = "JOINT", add = complete::joints())]
    joints: Vec<String>,
    /// Tolerance, metres and radians
    #[arg(long, value_name = "ERROR", default_value_t = 1e-4)]
    tolerance: f64,
    /// Set the positions as targets, if the link can reach the pose
    #[arg(long)]
    set: bool,
}

/// Shows poses of a robot's links.
pub(super) async fn links(robot: &str, client: &Client, output: Output) -> anyhow::Result<()> {
    let entity = client.robot_info(robot).await?;
    let answer = client.link_states(vec![robot.to_owned()]).await?;
    let states = present(answer.robots.into_iter().next(), "robots")?;
    if states.layout_version != entity.layout_version {
        return Err(simd_client::Error::LayoutChanged { robot: robot.to_owned() }.into());
    }
    let stamp = present(answer.stamp, "stamp")?.into();
    output.one(&LinksView { robot: robot.to_owned(), stamp, links: link_views(&entity.links, &states) })
}

/// Solves for joint positions, from the present ones.
pub(super) async fn ik(arguments: Ik, client: &Client, output: Output) -> anyhow::Result<()> {
    let Ik { robot, link, pose, joints, tolerance, set } = arguments;
    let layout = client.joint_layout(&robot).await?;
    let request = ComputeInverseKinematicsRequest {
        robot: robot.clone(),
        link: link.clone(),
        target: Some(pose),
        joints: joints.clone(),
        max_iterations: 1_000,
        tolerance,
        ..Default::default()
    };
    let found = client.inverse_kinematics(request).await?;
    let set = set && found.converged;
    if set {
        let joints = targets(&layout, &joints, &found.positions);
        let layout_version = layout.layout_version;
        let robots =
            vec![RobotTargets { robot: robot.clone(), layout_version, joints, ..Default::default() }];
        client.set_targets(SetJointTargetsRequest { robots, ..Default::default() }).await?;
    }
    let converged = found.converged;
    output.one(&IkView::new(robot, link, &layout, found, set)?)?;
    if !converged {
        bail!("no joint positions were found that put the link there; the nearest are shown");
    }
    Ok(())
}

/// Returns position targets for the joints that were moved.
fn targets(layout: &JointLayout, named: &[String], positions: &[f64]) -> Vec<JointTarget> {
    let moved = |joint: &&JointInfo| {
        let takes_targets = joint.mode() != JointMode::None && joint.r#type() != JointType::Floating;
        takes_targets && (named.is_empty() || named.contains(&joint.name))
    };
    let joints = layout.joints.iter().filter(moved);
    let targets = joints.flat_map(|joint| {
        let own = values(joint, positions);
        // The orientation of a spherical joint is one target.
        let targets: Vec<Target> = match (joint.r#type(), own) {
            (JointType::Spherical, &[x, y, z, w]) => vec![Target::orientation([x, y, z, w])],
            _ => own.iter().map(|&position| Target::position(position)).collect(),
        };
        (0..).zip(targets).map(|(axis, target)| JointTarget {
            joint: joint.name.clone(),
            axis,
            target: Some(target.into()),
        })
    });
    targets.collect()
}

/// Returns the positions of one joint.
fn values<'a>(joint: &JointInfo, positions: &'a [f64]) -> &'a [f64] {
    let first = joint.position_index as usize;
    positions.get(first..first + joint.position_count as usize).unwrap_or_default()
}

/// `robot links`.
#[derive(Serialize)]
struct LinksView {
    robot: String,
    stamp: Stamp,
    links: Vec<LinkView>,
}

#[derive(Serialize)]
struct LinkView {
    name: String,
    /// world_from_link.
    #[serde(flatten)]
    pose: PoseView,
    /// Velocity of its frame's origin, world axes, m/s.
    linear: [f64; 3],
    /// World axes, rad/s.
    angular: [f64; 3],
    #[serde(skip)]
    roll_pitch_yaw: [f64; 3],
}

fn link_views(links: &[LinkInfo], states: &RobotLinkStates) -> Vec<LinkView> {
    let (poses, _) = states.poses.as_chunks::<7>();
    let (twists, _) = states.twists.as_chunks::<6>();
    let view = |((link, &[x, y, z, qx, qy, qz, qw]), &[vx, vy, vz, wx, wy, wz]): (
        (&LinkInfo, &[f64; 7]),
        &[f64; 6],
    )| {
        let orientation = Quaternion { x: qx, y: qy, z: qz, w: qw };
        let roll_pitch_yaw = pose::roll_pitch_yaw(&orientation);
        let pose = Pose { position: Some(Vector3 { x, y, z }), orientation: Some(orientation) };
        let (linear, angular) = ([vx, vy, vz], [wx, wy, wz]);
        LinkView { name: link.name.clone(), pose: (&pose).into(), linear, angular, roll_pitch_yaw }
    };
    links.iter().zip(poses).zip(twists).map(view).collect()
}

impl View for LinksView {
    fn page(&self) -> Page {
        let columns = vec![
            Column::left("LINK"),
            Column::right("POSITION [m]"),
            Column::right("ROLL PITCH YAW [rad]"),
            Column::right("LINEAR [m/s]"),
            Column::right("ANGULAR [rad/s]"),
        ];
        let row = |link: &LinkView| {
            vec![
                link.name.clone(),
                several(&link.pose.position, 4),
                several(&link.roll_pitch_yaw, 4),
                several(&link.linear, 4),
                several(&link.angular, 4),
            ]
        };
        Page::new().table(Table::new(columns, self.links.iter().map(row).collect()))
    }
}

/// `robot ik`.
#[derive(Serialize)]
struct IkView {
    robot: String,
    link: String,
    stamp: Stamp,
    converged: bool,
    /// Metres.
    position_error: f64,
    /// Radians.
    orientation_error: f64,
    iterations: u32,
    /// Whether the positions are now the joints' targets.
    set: bool,
    /// All joints that can move.
    joints: Vec<JointView>,
}

#[derive(Serialize)]
struct JointView {
    name: String,
    /// rad or m; several for planar, floating and spherical joints.
    position: Vec<f64>,
}

impl IkView {
    fn new(
        robot: String,
        link: String,
        layout: &JointLayout,
        found: ComputeInverseKinematicsResponse,
        set: bool,
    ) -> anyhow::Result<Self> {
        let joints = layout.joints.iter().filter(|joint| joint.position_count > 0);
        let joint = |joint: &JointInfo| JointView {
            name: joint.name.clone(),
            position: values(joint, &found.positions).to_vec(),
        };
        Ok(Self {
            joints: joints.map(joint).collect(),
            robot,
            link,
            stamp: present(found.stamp, "stamp")?.into(),
            converged: found.converged,
            position_error: found.position_error,
            orientation_error: found.orientation_error,
            iterations: found.iterations,
            set,
        })
    }
}

impl View for IkView {
    fn page(&self) -> Page {
        let columns = vec![Column::left("JOINT"), Column::right("POSITION [rad or m]")];
        let row = |joint: &JointView| vec![joint.name.clone(), several(&joint.position, 6)];
        let table = Table::new(columns, self.joints.iter().map(row).collect());
        let line = format!(
            "{} mm and {} mrad off",
            fixed(self.position_error * 1e3, 3),
            fixed(self.orientation_error * 1e3, 3)
        );
        let page = Page::new().table(table).line(line);
        if self.set { page.line("these are the joints' targets now") } else { page }
    }
}

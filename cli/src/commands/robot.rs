//! `simctl robot`: robots in the world, in and out.

pub(crate) mod convert;
mod filter;
mod kinematics;
mod progress;
pub(crate) mod shape;
pub(crate) mod validate;
mod view;

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::{Args, Subcommand, ValueEnum};
use simd_client::{
    Client, Error, OpenOptions, Package,
    proto::{
        Base, DescriptionSource, ErrorReason, InitialMode, LoadReport, MeshShapes, Pose, Quaternion,
        ReloadEntityRequest, Severity, SpawnEntityRequest, description_source::Source,
    },
};

use crate::{
    args::{PackageFolder, package_folder},
    commands::contact::Surface,
    complete,
    failure::{hint, warn},
    output::Output,
    pose,
    target::{Placement, placement},
};
use progress::Progress;
use view::{Deleted, InfoView, Loaded, ReloadedView, RobotView};

#[derive(Debug, Subcommand)]
pub(crate) enum Robot {
    /// Sends a robot to the daemon and spawns it
    Load(Load),
    /// Spawns a single shape: the ground, a box to push
    Shape(shape::Shape),
    /// Reads a robot's description again, and keeps its pose, joints and targets
    Reload(Reload),
    /// Says what the daemon would make of a description, without a daemon
    Validate(validate::Validate),
    /// Writes a description of any format as URDF, without a daemon
    Convert(convert::Convert),
    /// Shows the robots in the world
    List,
    /// Shows one robot: base, mass, pose, links
    Info {
        /// The robot's name
        #[arg(add = complete::robots())]
        robot: String,
    },
    /// Changes what a robot touches: itself, groups of links, pairs of links
    Filter(filter::Filter),
    /// Shows where a robot's links are and how they move
    Links {
        /// The robot's name
        #[arg(add = complete::robots())]
        robot: String,
    },
    /// Finds joint positions that put a link somewhere (inverse kinematics)
    Ik(kinematics::Ik),
    /// Takes a robot out of the world
    Delete {
        /// The robot's name
        #[arg(add = complete::robots())]
        robot: String,
    },
}

#[derive(Args, Debug)]
pub(crate) struct Load {
    /// A URDF, xacro, SDF or MJCF file, or the folder of a ROS package that holds one
    path: PathBuf,
    /// Which robot of an SDF or MJCF; all of them where it is left out
    #[arg(long, value_name = "NAME")]
    model: Option<String>,
    /// The robot's name; the one in the URDF where it is left out
    #[arg(long)]
    name: Option<String>,
    /// Where the root link is: metres, and radians about the fixed axes
    #[arg(long, value_name = "X,Y,Z[,ROLL,PITCH,YAW]", value_parser = pose::parse, allow_hyphen_values = true)]
    pose: Option<Pose>,
    /// The root link does not move
    #[arg(long, conflicts_with = "free")]
    fixed: bool,
    /// The root link moves freely
    #[arg(long)]
    free: bool,
    /// A joint's first position, of a spherical joint quat:X,Y,Z,W; may be given again
    #[arg(long = "position", value_name = "JOINT=POSITION", value_parser = position)]
    positions: Vec<Placement>,
    /// Multiplies all lengths
    #[arg(long, value_name = "FACTOR")]
    scale: Option<f64>,
    /// No joint is actuated; else each holds its position
    #[arg(long)]
    passive: bool,
    /// Refuses a robot whose report has a warning
    #[arg(long)]
    strict: bool,
    /// Adds _1, _2, ... to a name that is taken
    #[arg(long)]
    rename: bool,
    #[command(flatten)]
    surface: Surface,
    /// Links of the robot touch each other, except those that a joint connects
    #[arg(long)]
    self_collision: bool,
    /// An SRDF file, whose `disable_collisions` switch pairs of links off
    #[arg(long, value_name = "FILE")]
    srdf: Option<PathBuf>,
    /// What collision meshes become: mesh, the triangles that they are where a link cannot move and elsewhere their convex hull; hull, their convex hull; parts, several convex parts
    #[arg(long, value_enum, default_value_t)]
    collision: Collision,
    /// The same as --collision parts
    #[arg(long, conflicts_with = "collision")]
    convex_parts: bool,
    /// PATH is on the daemon's own disk
    #[arg(long, conflicts_with_all = ["packages", "xacro_arguments"])]
    on_daemon: bool,
    /// Where a ROS package is that the URDF names; may be given again
    #[arg(long = "package", value_name = "NAME=FOLDER", value_parser = package_folder)]
    packages: Vec<PackageFolder>,
    /// An argument of a xacro file; may be given again
    #[arg(long = "xacro-arg", value_name = "NAME=VALUE", value_parser = xacro_argument)]
    xacro_arguments: Vec<(String, String)>,
}

/// What collision meshes become.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub(crate) enum Collision {
    #[default]
    Mesh,
    Hull,
    Parts,
}

#[derive(Args, Debug)]
pub(crate) struct Reload {
    /// The robot's name
    #[arg(add = complete::robots())]
    robot: String,
    /// A URDF or xacro file or package folder; where it is left out, the daemon reads again what it has on its own disk
    path: Option<PathBuf>,
    /// Refuses a robot whose report has a warning
    #[arg(long)]
    strict: bool,
    /// PATH is on the daemon's own disk
    #[arg(long, conflicts_with_all = ["packages", "xacro_arguments"], requires = "path")]
    on_daemon: bool,
    /// Where a ROS package is that the URDF names; may be given again
    #[arg(long = "package", value_name = "NAME=FOLDER", value_parser = package_folder, requires = "path")]
    packages: Vec<PackageFolder>,
    /// An argument of a xacro file; may be given again
    #[arg(long = "xacro-arg", value_name = "NAME=VALUE", value_parser = xacro_argument, requires = "path")]
    xacro_arguments: Vec<(String, String)>,
}

pub(crate) async fn run(command: Robot, client: &Client, output: Output) -> anyhow::Result<()> {
    match command {
        Robot::Load(arguments) => load(arguments, client, output).await,
        Robot::Shape(arguments) => shape::run(arguments, client, output).await,
        Robot::Reload(arguments) => reload(arguments, client, output).await,
        Robot::Validate(arguments) => validate::run(&arguments, output),
        Robot::Convert(arguments) => convert::run(&arguments, output),
        Robot::List => {
            let robots: Vec<RobotView> = client.robots().await?.into_iter().map(RobotView::from).collect();
            output.list(&robots, view::list)
        }
        Robot::Info { robot } => {
            let entity = client.robot_info(&robot).await?;
            let state = client.robot_state(&robot).await?;
            let filter = filter::FilterView::of(client, &robot).await?;
            output.one(&InfoView::new(entity, state, filter)?)
        }
        Robot::Filter(arguments) => filter::run(arguments, client, output).await,
        Robot::Links { robot } => kinematics::links(&robot, client, output).await,
        Robot::Ik(arguments) => kinematics::ik(arguments, client, output).await,
        Robot::Delete { robot } => {
            let stamp = client.delete_robot(&robot).await?.into();
            output.one(&Deleted { deleted: robot, stamp })
        }
    }
}

async fn load(arguments: Load, client: &Client, output: Output) -> anyhow::Result<()> {
    let path = &arguments.path;
    let options = options(&arguments.packages, &arguments.xacro_arguments);
    let (source, package) = source(client, path, arguments.on_daemon, &options).await?;
    let srdf = match &arguments.srdf {
        Some(file) => std::fs::read(file).with_context(|| file.display().to_string())?,
        None => Vec::new(),
    };
    if !srdf.is_empty() && !arguments.self_collision {
        hint("its links do not touch each other, whatever the SRDF says; --self-collision makes them");
    }
    let is_base_given = arguments.fixed || arguments.free;
    let turned: (Vec<_>, Vec<_>) = arguments.positions.into_iter().partition(|at| at.orientation.is_some());
    let orientation = |at: Placement| {
        let [x, y, z, w] = at.orientation?;
        Some((at.joint, Quaternion { x, y, z, w }))
    };
    let request = SpawnEntityRequest {
        source: Some(source),
        name: arguments.name.unwrap_or_default(),
        model: arguments.model.unwrap_or_default(),
        allow_renaming: arguments.rename,
        pose: arguments.pose,
        base: match (arguments.fixed, arguments.free) {
            (true, _) => Base::Fixed,
            (_, true) => Base::Free,
            _ => Base::Unspecified,
        }
        .into(),
        initial_mode: if arguments.passive { InitialMode::Passive } else { InitialMode::Holding }.into(),
        joint_positions: turned.1.into_iter().map(|at| (at.joint, at.position)).collect(),
        joint_orientations: turned.0.into_iter().filter_map(orientation).collect(),
        scale: arguments.scale,
        strict: arguments.strict,
        link_properties: arguments.surface.of(None).into_iter().collect(),
        self_collision: arguments.self_collision,
        srdf,
        mesh_shapes: match arguments.collision {
            _ if arguments.convex_parts => MeshShapes::Decomposition,
            Collision::Mesh => MeshShapes::Mesh,
            Collision::Hull => MeshShapes::Hull,
            Collision::Parts => MeshShapes::Decomposition,
        }
        .into(),
        ..Default::default()
    };
    let mut line = Progress::default();
    let spawned = client.spawn_with_progress(request, |progress| line.show(progress)).await;
    line.clear();
    let spawned = spawned.map_err(|error| naming(path, error))?;
    warn_of(&spawned.report, package.as_ref());
    // Of several some mostly stand still: the file says which.
    if spawned.entity.base() == Base::Free && !is_base_given && spawned.others.is_empty() {
        hint("its base is free, so it falls; --fixed holds it in place");
    }
    output.one(&Loaded::from(spawned))
}

async fn reload(arguments: Reload, client: &Client, output: Output) -> anyhow::Result<()> {
    let options = options(&arguments.packages, &arguments.xacro_arguments);
    let (source, package) = match &arguments.path {
        Some(path) => {
            let (source, package) = source(client, path, arguments.on_daemon, &options).await?;
            (Some(source), package)
        }
        None => (None, None),
    };
    let request = ReloadEntityRequest {
        robot: arguments.robot,
        source,
        strict: arguments.strict,
        ..Default::default()
    };
    let reloaded = match &arguments.path {
        Some(path) => client.reload(request).await.map_err(|error| naming(path, error))?,
        None => client.reload(request).await?,
    };
    warn_of(&reloaded.report, package.as_ref());
    output.one(&ReloadedView::from(reloaded))
}

/// Sends what the daemon lacks, or names what it has.
async fn source(
    client: &Client,
    path: &Path,
    on_daemon: bool,
    options: &OpenOptions,
) -> anyhow::Result<(DescriptionSource, Option<Package>)> {
    if on_daemon {
        let path = path.to_string_lossy().into_owned();
        return Ok((DescriptionSource { source: Some(Source::Path(path)), ..Default::default() }, None));
    }
    let package = Package::open_with(path, options)?;
    for message in package.xacro_messages() {
        hint(message);
    }
    let source = client.upload(&package).await.map_err(|error| naming(&package.path, error))?;
    Ok((source, Some(package)))
}

fn options(packages: &[PackageFolder], xacro_arguments: &[(String, String)]) -> OpenOptions {
    OpenOptions {
        packages: packages.iter().map(|known| (known.name.clone(), known.folder.clone())).collect(),
        xacro_arguments: xacro_arguments.iter().cloned().collect(),
    }
}

/// The daemon knows the line of a mistake, but not of which file.
fn naming(path: &Path, error: Error) -> anyhow::Error {
    let is_about_file = match &error {
        Error::Refused(refusal) => {
            refusal.reason == ErrorReason::InvalidDescription
                || refusal.fields.iter().any(|(field, _)| field == "urdf")
        }
        _ => false,
    };
    let error = anyhow::Error::from(error);
    if is_about_file { error.context(path.display().to_string()) } else { error }
}

/// Where warnings are seen even if stdout is read by a program. Lines are those of the
/// xacro's own files.
fn warn_of(report: &LoadReport, package: Option<&Package>) {
    let source = |line| package.and_then(|package| package.xacro_source(line));
    let findings =
        report.findings.iter().filter(|finding| finding.severity() >= Severity::Warning).map(|finding| {
            simd_model::Finding {
                severity: simd_model::Severity::Warning,
                // It only keeps apart what is counted together, and what was taken is listed one by one.
                disposition: simd_model::Disposition::Repaired,
                element: finding.element.clone(),
                file: None,
                line: Some(finding.line).filter(|line| *line > 0),
                message: finding.message.clone(),
            }
        });
    let findings = simd_model::LoadReport { findings: findings.collect() }.condensed().findings;
    for finding in &findings {
        let at = finding.line.unwrap_or(0);
        let line = match source(at) {
            Some((file, line)) => format!("{}:{line}", file.display()),
            None => format!("line {at}"),
        };
        let location = match (finding.element.as_str(), at) {
            ("", 0) => String::new(),
            ("", _) => format!("{line}: "),
            (element, 0) => format!("{element}: "),
            (element, _) => format!("{element}, {line}: "),
        };
        warn(&format!("{location}{}", finding.message));
    }
}

/// Reads `NAME=VALUE`; `NAME:=VALUE`, as ROS writes it, means the same.
fn xacro_argument(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("must be NAME=VALUE")?;
    let name = name.strip_suffix(':').unwrap_or(name);
    if name.is_empty() {
        Err("must be NAME=VALUE".to_owned())
    } else {
        Ok((name.to_owned(), value.to_owned()))
    }
}

/// Reads `JOINT=POSITION` or `JOINT=quat:X,Y,Z,W`.
fn position(text: &str) -> Result<Placement, String> {
    match placement(text)? {
        placement if placement.velocity != 0.0 => {
            Err("a robot is spawned at rest: give no velocity".to_owned())
        }
        placement => Ok(placement),
    }
}

//! `simctl robot`: robots in the world.

pub(crate) mod convert;
mod filter;
mod kinematics;
mod package_folder;
mod progress;
pub(crate) mod shape;
mod sleep;
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
    commands::contact::Surface,
    complete,
    failure::{hint, warn},
    output::Output,
    pose,
    target::{Placement, placement},
};
use package_folder::{PackageFolder, package_folder};
use progress::Progress;
use view::{Deleted, InfoView, Loaded, ReloadedView, RobotView};

#[derive(Debug, Subcommand)]
pub(crate) enum Robot {
    /// Uploads a robot and spawns it
    Load(Load),
    /// Spawns a single shape: the ground, a box to push
    Shape(shape::Shape),
    /// Reads a robot's description again, and keeps its pose, joints and targets
    Reload(Reload),
    /// Checks a description without a daemon
    Validate(validate::Validate),
    /// Writes a description of any format as URDF, without a daemon
    Convert(convert::Convert),
    /// Shows the robots in the world
    List,
    /// Shows one robot: base, mass, pose, links
    Info {
        /// Name of the robot
        #[arg(add = complete::robots())]
        robot: String,
    },
    /// Changes the collision filter of a robot: self-collision, groups, pairs of links
    Filter(filter::Filter),
    /// Shows whether a robot stays awake, or sets it
    Sleep(sleep::Sleep),
    /// Shows where a robot's links are and how they move
    Links {
        /// Name of the robot
        #[arg(add = complete::robots())]
        robot: String,
    },
    /// Finds joint positions at which a link reaches a pose (inverse kinematics)
    Ik(kinematics::Ik),
    /// Deletes a robot
    Delete {
        /// Name of the robot
        #[arg(add = complete::robots())]
        robot: String,
    },
}

#[derive(Args, Debug)]
pub(crate) struct Load {
    /// URDF, xacro, SDF or MJCF file, or the folder of a ROS package that holds one
    path: PathBuf,
    /// Robot of an SDF or MJCF; all of them if left out
    #[arg(long, value_name = "NAME")]
    model: Option<String>,
    /// Name of the robot; the one in the URDF if left out
    #[arg(long)]
    name: Option<String>,
    /// Pose of the root link: metres, and radians about the fixed axes
    #[arg(long, value_name = "X,Y,Z[,ROLL,PITCH,YAW]", value_parser = pose::parse, allow_hyphen_values = true)]
    pose: Option<Pose>,
    /// Stand beside all other robots, and on the ground
    ///
    /// Moves the robot along y until it is 0.2 m from the others, and raises it until its shapes are above z = 0.
    /// Visuals of a link count if it has no collision shapes. A robot that has room already stays at its pose.
    #[arg(long)]
    beside: bool,
    /// The root link does not move
    #[arg(long, conflicts_with = "free")]
    fixed: bool,
    /// The root link moves freely
    #[arg(long)]
    free: bool,
    /// Initial position of a joint, for a spherical joint quat:X,Y,Z,W; may be repeated
    #[arg(long = "position", value_name = "JOINT=POSITION", value_parser = position)]
    positions: Vec<Placement>,
    /// Factor on all lengths
    #[arg(long, value_name = "FACTOR")]
    scale: Option<f64>,
    /// No joint is actuated; otherwise each holds its position
    #[arg(long)]
    passive: bool,
    /// Refuse a robot whose report has a warning
    #[arg(long)]
    strict: bool,
    /// Add _1, _2, ... to a name that is taken
    #[arg(long)]
    rename: bool,
    #[command(flatten)]
    surface: Surface,
    /// Let links of the robot collide with each other, except those that a joint connects
    #[arg(long)]
    self_collision: bool,
    /// The robot does not sleep, even if the world lets bodies sleep
    #[arg(long)]
    stays_awake: bool,
    /// SRDF file, whose `disable_collisions` disable pairs of links
    #[arg(long, value_name = "FILE")]
    srdf: Option<PathBuf>,
    /// Colliders of collision meshes. mesh: triangles for links that cannot move, convex hulls for others;
    /// hull: convex hulls; parts: several convex parts
    #[arg(long, value_enum, default_value_t)]
    collision: Collision,
    /// Short for --collision parts
    #[arg(long, conflicts_with = "collision")]
    convex_parts: bool,
    /// PATH is on the daemon's own disk
    #[arg(long, conflicts_with_all = ["packages", "xacro_arguments"])]
    on_daemon: bool,
    /// Folder of a ROS package that the URDF names; may be repeated
    #[arg(long = "package", value_name = "NAME=FOLDER", value_parser = package_folder)]
    packages: Vec<PackageFolder>,
    /// Argument of a xacro file; may be repeated
    #[arg(long = "xacro-arg", value_name = "NAME=VALUE", value_parser = xacro_argument)]
    xacro_arguments: Vec<(String, String)>,
}

/// Colliders of collision meshes.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub(crate) enum Collision {
    #[default]
    Mesh,
    Hull,
    Parts,
}

#[derive(Args, Debug)]
pub(crate) struct Reload {
    /// Name of the robot
    #[arg(add = complete::robots())]
    robot: String,
    /// URDF or xacro file or package folder; if left out, the daemon reads its own file again
    path: Option<PathBuf>,
    /// Refuse a robot whose report has a warning
    #[arg(long)]
    strict: bool,
    /// PATH is on the daemon's own disk
    #[arg(long, conflicts_with_all = ["packages", "xacro_arguments"], requires = "path")]
    on_daemon: bool,
    /// Folder of a ROS package that the URDF names; may be repeated
    #[arg(long = "package", value_name = "NAME=FOLDER", value_parser = package_folder, requires = "path")]
    packages: Vec<PackageFolder>,
    /// Argument of a xacro file; may be repeated
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
        Robot::Sleep(arguments) => sleep::run(arguments, client, output).await,
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
        beside_others: arguments.beside,
        on_ground: arguments.beside,
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
        stays_awake: arguments.stays_awake,
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
    // Some of several robots are mostly fixed: the file decides.
    if spawned.entity.base() == Base::Free && !is_base_given && spawned.others.is_empty() {
        hint("its base is free; --fixed holds it in place");
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

/// Uploads the files that the daemon lacks, or names its own file.
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

/// Adds the file to an error: the daemon only knows the line.
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

/// Prints warnings to stderr, even if a program reads stdout. Lines refer to the xacro's own files.
fn warn_of(report: &LoadReport, package: Option<&Package>) {
    let source = |line| package.and_then(|package| package.xacro_source(line));
    let findings =
        report.findings.iter().filter(|finding| finding.severity() >= Severity::Warning).map(|finding| {
            simd_model::Finding {
                severity: simd_model::Severity::Warning,
                // Only separates findings that are counted together; used elements are listed one by one.
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

/// Parses `NAME=VALUE`, or `NAME:=VALUE` as in ROS.
fn xacro_argument(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("must be NAME=VALUE")?;
    let name = name.strip_suffix(':').unwrap_or(name);
    if name.is_empty() {
        Err("must be NAME=VALUE".to_owned())
    } else {
        Ok((name.to_owned(), value.to_owned()))
    }
}

/// Parses `JOINT=POSITION` or `JOINT=quat:X,Y,Z,W`.
fn position(text: &str) -> Result<Placement, String> {
    match placement(text)? {
        placement if placement.velocity != 0.0 => {
            Err("a robot is spawned at rest: give no velocity".to_owned())
        }
        placement => Ok(placement),
    }
}

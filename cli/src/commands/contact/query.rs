//! `simctl contact distance`, `overlaps`, `cast` and `bounds`: distances and shape queries.

use anyhow::Context as _;
use clap::Args;
use serde::Serialize;
use simd_client::{
    Client, every_joint,
    proto::{
        CastShapeRequest, ClosestPoints, Configuration, FindOverlapsRequest, GetClosestPointsRequest,
        LinkBounds, LinkName, Pose, QueryBody, QueryShape, Vector3, primitive, query_shape,
    },
};

use super::view::{HitView, array};
use crate::{
    commands::robot::shape::geometry,
    failure::Usage,
    output::{
        Output,
        number::{fixed, several},
        table::{Column, Page, Table},
    },
    pose::{self, parse_vector},
    target::{Placement, placement},
};

#[derive(Args, Debug)]
pub(crate) struct Distance {
    /// Robot, one of its links, or a shape of no robot: box:X,Y,Z, sphere:RADIUS, cylinder:RADIUS,LENGTH,
    /// capsule:RADIUS,LENGTH or cone:RADIUS,LENGTH, metres, at the pose @X,Y,Z[,ROLL,PITCH,YAW] after it
    #[arg(value_name = "ROBOT[/LINK]|SHAPE[@POSE]", value_parser = body)]
    a: QueryBody,
    /// The other one, or the same; every other robot if left out
    #[arg(value_name = "ROBOT[/LINK]|SHAPE[@POSE]", value_parser = body)]
    b: Option<QueryBody>,
    /// Leave out links that are farther apart, metres
    #[arg(long, value_name = "METRES", allow_hyphen_values = true)]
    within: Option<f64>,
    /// Only the nearest pair of links
    #[arg(long)]
    nearest: bool,
    /// Leave out links that may not collide with each other
    #[arg(long)]
    filtered: bool,
    /// Position of a joint of the first robot; other joints keep theirs. May be repeated
    #[arg(long = "position", value_name = "JOINT=POSITION", value_parser = placement)]
    positions: Vec<Placement>,
    /// Pose of the first robot's root link, or of the first shape
    #[arg(long, value_name = "X,Y,Z[,ROLL,PITCH,YAW]", value_parser = pose::parse, allow_hyphen_values = true)]
    pose: Option<Pose>,
}

#[derive(Args, Debug)]
pub(crate) struct Overlaps {
    /// Shape: box:X,Y,Z, sphere:RADIUS, cylinder:RADIUS,LENGTH, capsule:RADIUS,LENGTH or cone:RADIUS,LENGTH,
    /// metres, at the pose @X,Y,Z[,ROLL,PITCH,YAW] after it
    #[arg(value_name = "SHAPE[@POSE]", value_parser = placed)]
    shape: Placed,
    /// Pose: metres, and radians about the fixed axes
    #[arg(long, value_name = "X,Y,Z[,ROLL,PITCH,YAW]", value_parser = pose::parse, allow_hyphen_values = true)]
    pose: Option<Pose>,
    /// Compare boxes along the world's axes instead of their contents
    #[arg(long)]
    bounds: bool,
}

#[derive(Args, Debug)]
pub(crate) struct Cast {
    /// Shape: box:X,Y,Z, sphere:RADIUS, cylinder:RADIUS,LENGTH, capsule:RADIUS,LENGTH or cone:RADIUS,LENGTH,
    /// metres, at the pose @X,Y,Z[,ROLL,PITCH,YAW] after it
    #[arg(value_name = "SHAPE[@POSE]", value_parser = placed)]
    shape: Placed,
    /// Motion, metres
    #[arg(value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    way: Vector3,
    /// Pose at the start: metres, and radians about the fixed axes
    #[arg(long, value_name = "X,Y,Z[,ROLL,PITCH,YAW]", value_parser = pose::parse, allow_hyphen_values = true)]
    pose: Option<Pose>,
}

pub(super) async fn distance(arguments: Distance, client: &Client, output: Output) -> anyhow::Result<()> {
    let Distance { mut a, b, within, nearest, filtered, positions, pose } = arguments;
    if a.shape.is_some() {
        a.pose = place(a.pose, &positions, pose)?;
    } else if !positions.is_empty() || pose.is_some() {
        a.configuration = Some(configuration(client, &a.robot, positions, pose).await?);
    }
    let request =
        GetClosestPointsRequest { a: Some(a), b, max_distance: within, nearest_only: nearest, filtered };
    let pairs = client.closest_points(request).await?;
    let pairs: Vec<_> = pairs.into_iter().map(DistanceView::from).collect();
    output.list(&pairs, distances)
}

/// Returns the pose of a shape: after its @, or from an option.
fn place(after: Option<Pose>, positions: &[Placement], option: Option<Pose>) -> Result<Option<Pose>, Usage> {
    if !positions.is_empty() {
        return Err(Usage("--position is for the joints of a robot, and a shape has none".to_owned()));
    }
    if after.is_some() && option.is_some() {
        return Err(Usage("say where the shape is once: after @, or with --pose".to_owned()));
    }
    Ok(after.or(option))
}

/// Returns the positions of all joints, with some replaced.
async fn configuration(
    client: &Client,
    robot: &str,
    given: Vec<Placement>,
    root: Option<Pose>,
) -> anyhow::Result<Configuration> {
    let layout = client.joint_layout(robot).await?;
    let states = client.joint_states(vec![every_joint(robot)]).await?;
    let mut positions =
        states.robots.into_iter().next().map(|robot| robot.position).context("the robot is gone")?;
    for Placement { joint, position, orientation, .. } in given {
        let given = orientation.map_or_else(|| vec![position], Vec::from);
        let mut at = 0;
        let found = layout.joints.iter().find(|known| {
            let here = known.name == joint;
            at += if here { 0 } else { known.position_count as usize };
            here
        });
        match found {
            Some(known) if known.position_count as usize == given.len() => {
                let own = positions.get_mut(at..at + given.len()).context("the robot has changed")?;
                own.copy_from_slice(&given);
            }
            Some(known) => {
                anyhow::bail!(
                    "joint {joint:?} has a position of {} numbers, not {}",
                    known.position_count,
                    given.len()
                )
            }
            None => anyhow::bail!("robot {robot:?} has no joint {joint:?}"),
        }
    }
    Ok(Configuration { positions, root, ..Configuration::default() })
}

pub(super) async fn overlaps(arguments: Overlaps, client: &Client, output: Output) -> anyhow::Result<()> {
    let Overlaps { shape: Placed { shape, at }, pose, bounds } = arguments;
    let pose = place(at, &[], pose)?;
    let shape = Some(QueryShape { geometry: Some(shape) });
    let links = client.overlaps(FindOverlapsRequest { shape, pose, bounds_only: bounds }).await?;
    let links: Vec<_> = links.into_iter().map(LinkView::from).collect();
    output.list(&links, link_table)
}

pub(super) async fn cast(arguments: Cast, client: &Client, output: Output) -> anyhow::Result<()> {
    let Cast { shape: Placed { shape, at }, way, pose } = arguments;
    let pose = place(at, &[], pose)?;
    let shape = Some(QueryShape { geometry: Some(shape) });
    let hit = client.cast_shape(CastShapeRequest { shape, pose, translation: Some(way) }).await?;
    output.one(&HitView::from(hit))
}

pub(super) async fn bounds(robot: Option<&str>, client: &Client, output: Output) -> anyhow::Result<()> {
    let links = client.link_bounds(robot.as_slice()).await?;
    let links: Vec<_> = links.into_iter().map(BoundsView::from).collect();
    output.list(&links, bounds_table)
}

/// Parses `ROBOT`, `ROBOT/LINK`, or a shape, optionally with `@` and a pose. Names of robots have neither
/// slash nor colon; names of links may have both.
fn body(text: &str) -> Result<QueryBody, String> {
    let (robot, link) = text.split_once('/').unwrap_or((text, ""));
    if !robot.contains(':') {
        return Ok(QueryBody { robot: robot.to_owned(), link: link.to_owned(), ..QueryBody::default() });
    }
    let Placed { shape, at } = placed(text)?;
    let shape = Some(QueryShape { geometry: Some(shape) });
    Ok(QueryBody { shape, pose: at, ..QueryBody::default() })
}

/// A shape of no robot, and its pose.
#[derive(Clone, Debug, PartialEq)]
struct Placed {
    shape: query_shape::Geometry,
    at: Option<Pose>,
}

/// Parses a shape, optionally with `@` and a pose.
fn placed(text: &str) -> Result<Placed, String> {
    let (written, at) = pose::split(text)?;
    Ok(Placed { shape: shape(written)?, at })
}

/// Error for a text that is not a shape.
const SHAPES: &str = "must be box:X,Y,Z, sphere:RADIUS, cylinder:RADIUS,LENGTH, capsule:RADIUS,LENGTH or \
                      cone:RADIUS,LENGTH";

/// Parses a finite shape.
fn shape(text: &str) -> Result<query_shape::Geometry, String> {
    // Other shapes, such as files, have separate words.
    if !["box", "sphere", "cylinder", "capsule", "cone"].contains(&text.split(':').next().unwrap_or_default())
    {
        return Err(SHAPES.to_owned());
    }
    match geometry(text)? {
        primitive::Geometry::Box(shape) => Ok(query_shape::Geometry::Box(shape)),
        primitive::Geometry::Sphere(shape) => Ok(query_shape::Geometry::Sphere(shape)),
        primitive::Geometry::Cylinder(shape) => Ok(query_shape::Geometry::Cylinder(shape)),
        primitive::Geometry::Capsule(shape) => Ok(query_shape::Geometry::Capsule(shape)),
        primitive::Geometry::Cone(shape) => Ok(query_shape::Geometry::Cone(shape)),
        primitive::Geometry::Plane(_) | primitive::Geometry::Mesh(_) | primitive::Geometry::Compound(_) => {
            Err(SHAPES.to_owned())
        }
    }
}

/// An item of `contact distance`. A shape of no robot has no names.
#[derive(Serialize)]
struct DistanceView {
    robot_a: Option<String>,
    link_a: Option<String>,
    robot_b: Option<String>,
    link_b: Option<String>,
    /// Metres; negative if the two overlap.
    distance: f64,
    /// World, metres.
    point_a: [f64; 3],
    point_b: [f64; 3],
    /// Unit vector from a to b.
    normal: [f64; 3],
}

impl From<ClosestPoints> for DistanceView {
    fn from(closest: ClosestPoints) -> Self {
        let named = |name: String| Some(name).filter(|name| !name.is_empty());
        Self {
            robot_a: named(closest.robot_a),
            link_a: named(closest.link_a),
            robot_b: named(closest.robot_b),
            link_b: named(closest.link_b),
            distance: closest.distance,
            point_a: array(closest.point_a),
            point_b: array(closest.point_b),
            normal: array(closest.normal),
        }
    }
}

fn distances(pairs: &[DistanceView]) -> Page {
    if pairs.is_empty() {
        return Page::of_line("nothing is within that distance");
    }
    let columns = vec![
        Column::left("A"),
        Column::left("B"),
        Column::right("DISTANCE m"),
        Column::left("POINT ON A m"),
        Column::left("POINT ON B m"),
    ];
    let name = |robot: &Option<String>, link: &Option<String>| match (robot, link) {
        (Some(robot), Some(link)) => format!("{robot}/{link}"),
        _ => "the shape".to_owned(),
    };
    let row = |pair: &DistanceView| {
        vec![
            name(&pair.robot_a, &pair.link_a),
            name(&pair.robot_b, &pair.link_b),
            fixed(pair.distance, 6),
            several(&pair.point_a, 4),
            several(&pair.point_b, 4),
        ]
    };
    Page::new().table(Table::new(columns, pairs.iter().map(row).collect()))
}

/// An item of `contact overlaps`.
#[derive(Serialize)]
struct LinkView {
    robot: String,
    link: String,
}

impl From<LinkName> for LinkView {
    fn from(LinkName { robot, link }: LinkName) -> Self {
        Self { robot, link }
    }
}

fn link_table(links: &[LinkView]) -> Page {
    if links.is_empty() {
        return Page::of_line("the shape overlaps nothing");
    }
    let row = |link: &LinkView| vec![link.robot.clone(), link.link.clone()];
    let columns = vec![Column::left("ROBOT"), Column::left("LINK")];
    Page::new().table(Table::new(columns, links.iter().map(row).collect()))
}

/// An item of `contact bounds`.
#[derive(Serialize)]
struct BoundsView {
    robot: String,
    link: String,
    /// World, metres.
    lower: [f64; 3],
    upper: [f64; 3],
}

impl From<LinkBounds> for BoundsView {
    fn from(LinkBounds { robot, link, lower, upper }: LinkBounds) -> Self {
        Self { robot, link, lower: array(lower), upper: array(upper) }
    }
}

fn bounds_table(links: &[BoundsView]) -> Page {
    if links.is_empty() {
        return Page::of_line("there are no shapes with bounds");
    }
    let columns =
        vec![Column::left("ROBOT"), Column::left("LINK"), Column::left("LOWER m"), Column::left("UPPER m")];
    let row = |of: &BoundsView| {
        vec![of.robot.clone(), of.link.clone(), several(&of.lower, 4), several(&of.upper, 4)]
    };
    Page::new().table(Table::new(columns, links.iter().map(row).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_and_shapes_are_read_as_people_write_them() {
        let named = |text| {
            let QueryBody { robot, link, shape, pose, .. } = body(text).unwrap();
            assert!(shape.is_none() && pose.is_none(), "{text}");
            (robot, link)
        };
        assert_eq!(named("arm"), ("arm".to_owned(), String::new()));
        assert_eq!(named("arm/tool 0/tip"), ("arm".to_owned(), "tool 0/tip".to_owned()));
        assert_eq!(named("arm/sphere:1@0"), ("arm".to_owned(), "sphere:1@0".to_owned()));
        assert!(shape("sphere:5cm").is_ok());
        for wrong in ["plane", "mesh:a.stl", "heightfield:a.png,1,1,1", "prism:1"] {
            assert!(shape(wrong).unwrap_err().contains("must be box"), "{wrong}");
        }
    }

    #[test]
    fn a_shape_of_no_robot_is_where_its_pose_says() {
        let ball = |position: Option<Vector3>| {
            let geometry = Some(shape("sphere:20cm").unwrap());
            let pose = position.map(|position| Pose { position: Some(position), orientation: None });
            QueryBody { shape: Some(QueryShape { geometry }), pose, ..QueryBody::default() }
        };
        let there = Vector3 { x: 1.0, y: 0.0, z: -2.0 };
        assert_eq!(body("sphere:20cm").unwrap(), ball(None));
        assert_eq!(body("sphere:20cm@1,0,-2").unwrap(), ball(Some(there)));
        for (wrong, part) in [
            ("sphere:big", "big"),
            ("sphere:1@1,0", "x,y,z"),
            ("cone:1", "cone:RADIUS,LENGTH"),
            ("mesh:folder/a.stl", "must be box"),
        ] {
            let refused = body(wrong).unwrap_err();
            assert!(refused.contains(part), "{wrong}: {refused}");
        }
        let at = |x| Pose { position: Some(Vector3 { x, y: 0.0, z: 0.0 }), orientation: None };
        assert_eq!(placed("sphere:20cm@1,0,0").unwrap().at, Some(at(1.0)));
        assert!(placed("sphere:20cm@1").unwrap_err().contains("the pose after @"));
        assert_eq!(place(None, &[], Some(at(1.0))).unwrap(), Some(at(1.0)));
        assert_eq!(place(Some(at(2.0)), &[], None).unwrap(), Some(at(2.0)));
        assert!(place(Some(at(2.0)), &[], Some(at(1.0))).unwrap_err().0.contains("once"));
        let bent = placement("elbow=1").unwrap();
        assert!(place(None, &[bent], None).unwrap_err().0.contains("--position"));
    }
}

//! Requests of the entity service: descriptions, robots, poses of robots, wrenches on links.

use std::collections::BTreeMap;

use bytes::Bytes;
use glamx::DPose3;
use simd_core::Command;
use simd_core::collision::MeshShapes;
use simd_core::simulation::command::{
    CollisionFilterChange, CollisionPair, ContactSettings, JointOrientation, LinkPull, LinkWrench,
    WrenchDuration,
};
use simd_core::simulation::free_place::FreePlace;
use simd_model::robot::Sha256;
use simd_proto::v1;

use super::contact::link_properties;
use super::{geometry, primitive};
use crate::convert::field::{BadField, Path};
use simd_world::handle::{FilePart, Source, SpawnRequest};

/// Parses a digest from its text.
pub fn sha256(at: &Path<'_>, text: &str) -> Result<Sha256, BadField> {
    Sha256::parse(text).ok_or_else(|| {
        at.refuse(
            format_args!("{:?}", text.chars().take(80).collect::<String>()),
            "it must be a SHA-256 as 64 hexadecimal digits",
        )
    })
}

/// Parses digests by URI.
pub fn assets(at: &Path<'_>, given: BTreeMap<String, String>) -> Result<BTreeMap<String, Sha256>, BadField> {
    given
        .into_iter()
        .map(|(uri, text)| {
            let digest = sha256(&at.entry("assets", &uri), &text)?;
            Ok((uri, digest))
        })
        .collect()
}

/// Parses a URDF with the files found for its URIs.
pub fn prepare(
    request: v1::PrepareDescriptionRequest,
) -> Result<(Bytes, BTreeMap<String, Sha256>), BadField> {
    Ok((urdf(&Path::ROOT.field("urdf"), request.urdf)?, assets(&Path::ROOT, request.assets)?))
}

fn urdf(at: &Path<'_>, bytes: Vec<u8>) -> Result<Bytes, BadField> {
    if bytes.is_empty() {
        return Err(at.refuse("empty", "it must be the text of a URDF file"));
    }
    Ok(bytes.into())
}

/// Parses a part of an uploaded file: digest and size of the whole file, offset of the part, bytes of the
/// part.
pub fn upload(request: v1::UploadAssetRequest) -> Result<FilePart, BadField> {
    let sha256 = sha256(&Path::ROOT.field("sha256"), &request.sha256)?;
    let v1::UploadAssetRequest { total_bytes: total, offset, data, .. } = request;
    Ok(FilePart { sha256, total, offset, data: data.into() })
}

/// Maximum size of all searched paths of a description, bytes. People read them, and they stay with the
/// robot.
const MISSING_BYTES: usize = 32 << 10;

/// Returns where the client looked for files: the first paths of each file, for as many files as fit.
fn missing(given: BTreeMap<String, v1::AssetSearch>) -> BTreeMap<String, Vec<String>> {
    let mut left = MISSING_BYTES;
    let mut kept = BTreeMap::new();
    for (uri, search) in given {
        let places = simd_model::first_places(search.places);
        let bytes = uri.len() + places.iter().map(String::len).sum::<usize>();
        if let Some(rest) = left.checked_sub(bytes) {
            left = rest;
            kept.insert(uri, places);
        }
    }
    kept
}

/// Parses the source of a description.
pub fn source(at: &Path<'_>, given: Option<v1::DescriptionSource>) -> Result<Source, BadField> {
    let given = at.given(given)?;
    let assets = assets(at, given.assets)?;
    let missing = missing(given.missing);
    Ok(match at.field("source").given(given.source)? {
        v1::description_source::Source::Description(text) => {
            Source::Uploaded { description: sha256(&at.field("description"), &text)?, assets, missing }
        }
        v1::description_source::Source::Urdf(bytes) => {
            Source::Inline { urdf: urdf(&at.field("urdf"), bytes)?, assets, missing }
        }
        v1::description_source::Source::Path(path) => {
            if path.is_empty() {
                return Err(at.field("path").refuse("empty", "it must be a path on the daemon's disk"));
            }
            Source::Path(path)
        }
        v1::description_source::Source::Primitive(given) => {
            let primitive = primitive::primitive(&at.field("primitive"), given)?;
            Source::Inline { urdf: primitive.urdf().into(), assets, missing }
        }
    })
}

/// Parses a robot to spawn.
pub fn spawn(request: v1::SpawnEntityRequest) -> Result<SpawnRequest, BadField> {
    let fixed_base = match Path::ROOT.field("base").known(request.base)? {
        v1::Base::Unspecified => None,
        v1::Base::Fixed => Some(true),
        v1::Base::Free => Some(false),
    };
    let passive = match Path::ROOT.field("initial_mode").known(request.initial_mode)? {
        v1::InitialMode::Unspecified | v1::InitialMode::Holding => false,
        v1::InitialMode::Passive => true,
    };
    Ok(SpawnRequest {
        source: source(&Path::ROOT.field("source"), request.source)?,
        name: Path::ROOT.field("name").short(request.name)?,
        allow_renaming: request.allow_renaming,
        pose: match request.pose {
            Some(given) => geometry::pose(&Path::ROOT.field("pose"), given)?,
            None => DPose3::IDENTITY,
        },
        free_place: FreePlace { beside_others: request.beside_others, on_ground: request.on_ground },
        fixed_base,
        passive,
        joint_positions: request.joint_positions.into_iter().collect(),
        joint_orientations: orientations(request.joint_orientations)?,
        scale: request.scale.unwrap_or(1.0),
        strict: request.strict,
        mesh_shapes: match Path::ROOT.field("mesh_shapes").known(request.mesh_shapes)? {
            v1::MeshShapes::Unspecified | v1::MeshShapes::Mesh => MeshShapes::Mesh,
            v1::MeshShapes::Hull => MeshShapes::Hull,
            v1::MeshShapes::Decomposition => MeshShapes::Decomposition,
        },
        srdf: request.srdf.into(),
        collision_pairs: own_pairs(request.collision_pairs)?,
        model: Path::ROOT.field("model").short(request.model)?,
        contact_settings: ContactSettings {
            self_collision: request.self_collision,
            stays_awake: request.stays_awake,
            links: link_properties(&Path::ROOT, "link_properties", request.link_properties)?,
        },
    })
}

/// Parses initial orientations of spherical joints.
fn orientations(given: BTreeMap<String, v1::Quaternion>) -> Result<Vec<JointOrientation>, BadField> {
    let orientations = given.into_iter().map(|(joint, quaternion)| {
        let orientation = geometry::rotation(&Path::ROOT.entry("joint_orientations", &joint), quaternion)?;
        Ok(JointOrientation { joint, orientation })
    });
    orientations.collect()
}

/// Parses the robot's name and the source of its new description.
pub fn reload(
    robot: String,
    source: Option<v1::DescriptionSource>,
) -> Result<(String, Option<Source>), BadField> {
    let robot = Path::ROOT.field("robot").name(robot)?;
    let source = source.map(|given| self::source(&Path::ROOT.field("source"), Some(given))).transpose()?;
    Ok((robot, source))
}

/// Accepts the name of a robot.
pub fn robot(robot: String) -> Result<String, BadField> {
    Path::ROOT.field("robot").name(robot)
}

/// Parses names of robots, each at most once; an empty list means all.
pub fn robots(given: Vec<String>) -> Result<Vec<String>, BadField> {
    let robots = given
        .into_iter()
        .enumerate()
        .map(|(index, robot)| Path::ROOT.item("robots", index).name(robot))
        .collect::<Result<Vec<_>, _>>()?;
    Path::ROOT.each_once("robots", &robots)?;
    Ok(robots)
}

/// Parses a new pose and velocity of a robot.
pub fn set_entity_state(request: v1::SetEntityStateRequest) -> Result<Command, BadField> {
    Ok(Command::SetEntityState {
        robot: robot(request.robot)?,
        pose: request.pose.map(|given| geometry::pose(&Path::ROOT.field("pose"), given)).transpose()?,
        twist: request.twist.map(geometry::twist),
    })
}

/// Parses a wrench on a link.
pub fn link_wrench(request: v1::ApplyLinkWrenchRequest) -> Result<Command, BadField> {
    let at = Path::ROOT.field("wrench");
    let (force, torque) = geometry::wrench(at.given(request.wrench)?);
    let in_link_axes = match Path::ROOT.field("frame").known(request.frame)? {
        v1::WrenchFrame::Unspecified | v1::WrenchFrame::World => false,
        v1::WrenchFrame::Link => true,
    };
    let at = Path::ROOT.field("duration");
    let duration = match (request.duration, request.persistent) {
        (0.0, false) => WrenchDuration::NextStep,
        (0.0, true) => WrenchDuration::UntilCleared,
        (seconds, false) => WrenchDuration::For(seconds),
        (seconds, true) => return Err(at.refuse(seconds, "it must be 0 if the wrench is persistent")),
    };
    Ok(Command::ApplyWrench(LinkWrench {
        robot: robot(request.robot)?,
        link: Path::ROOT.field("link").name(request.link)?,
        force,
        torque,
        in_link_axes,
        point: geometry::vector_or_zero(request.point),
        duration,
    }))
}

/// Parses a pull on a link.
pub fn link_pull(request: v1::PullLinkRequest) -> Result<Command, BadField> {
    Ok(Command::PullLink(LinkPull {
        robot: robot(request.robot)?,
        link: Path::ROOT.field("link").name(request.link)?,
        point: geometry::vector_or_zero(request.point),
        target: request.target.map(geometry::vector),
        stiffness: request.stiffness,
        max_force: request.max_force,
        duration: request.duration,
    }))
}

/// Parses new surfaces of a robot's links.
pub fn set_link_properties(request: v1::SetLinkPropertiesRequest) -> Result<Command, BadField> {
    let robot = robot(request.robot)?;
    if request.links.is_empty() && request.stays_awake.is_none() {
        return Err(Path::ROOT.field("links").refuse("empty", "it must name at least one link"));
    }
    let links = link_properties(&Path::ROOT, "links", request.links)?;
    Path::ROOT.each_once("links", links.iter().map(|properties| &properties.link))?;
    Ok(Command::SetLinkProperties { robot, links, stays_awake: request.stays_awake })
}

/// Parses a robot's collision filter.
pub fn set_collision_filter(request: v1::SetCollisionFilterRequest) -> Result<Command, BadField> {
    let v1::SetCollisionFilterRequest { robot, self_collision, pairs, request_id: _, claim: _ } = request;
    Ok(Command::SetCollisionFilter(CollisionFilterChange {
        robot: self::robot(robot)?,
        self_collision,
        pairs: collision_pairs("pairs", pairs)?,
    }))
}

/// Parses pairs of links whose collisions are switched off or on.
fn collision_pairs(list: &str, given: Vec<v1::CollisionPair>) -> Result<Vec<CollisionPair>, BadField> {
    let read = |(index, given): (usize, v1::CollisionPair)| {
        let at = Path::ROOT.item(list, index);
        let v1::CollisionPair { link, other_robot, other_link, collision } = given;
        let field = at.field("collision");
        Ok(CollisionPair {
            link: at.field("link").name(link)?,
            other_robot: at.field("other_robot").short(other_robot)?,
            other_link: at.field("other_link").name(other_link)?,
            enabled: match field.known(collision)? {
                v1::PairCollision::Unspecified => return Err(field.refuse("not given", "it must be given")),
                v1::PairCollision::Default => None,
                v1::PairCollision::Disabled => Some(false),
                v1::PairCollision::Enabled => Some(true),
            },
        })
    };
    given.into_iter().enumerate().map(read).collect()
}

/// Parses such pairs of a robot that is not in the world yet.
fn own_pairs(given: Vec<v1::CollisionPair>) -> Result<Vec<CollisionPair>, BadField> {
    let pairs = collision_pairs("collision_pairs", given)?;
    if let Some((index, pair)) = pairs.iter().enumerate().find(|(_, pair)| !pair.other_robot.is_empty()) {
        let at = Path::ROOT.item("collision_pairs", index);
        let expected = "it must be empty: pairs with other robots are set once the robot is there";
        return Err(at.field("other_robot").refuse(format_args!("{:?}", pair.other_robot), expected));
    }
    Ok(pairs)
}

/// Returns the digest of the requested file.
pub fn asset(request: &v1::GetAssetRequest) -> Result<Sha256, BadField> {
    sha256(&Path::ROOT.field("sha256"), &request.sha256)
}

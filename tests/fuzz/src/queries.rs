//! Questions about where things are, as they come over the network, to a world with a shape of each kind.

use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};

use glamx::{DPose3, DVec3};
use prost::Message;
use simd_api::convert::field::Path;
use simd_api::convert::from_proto::{contact, kinematics, query};
use simd_core::collision::{MeshShapes, Shapes};
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::Spawn;
use simd_core::simulation::queries::{DistanceQuery, DistanceReport, QueryBody, QuerySide};
use simd_core::{Command, PhysicsSettings, PublishedState, Simulation};
use simd_proto::v1;

use super::commands::{ARM, BALL, MESH, PYRAMID, check, read_with};

/// Questions of one sequence.
const MAX: usize = 50;

/// A sequence is queries one after the other: a byte for the kind, two for the length, and the message. Each
/// is refused, or every number of its answer is finite, and each link and pair comes once. Returns the number
/// of answered queries.
pub fn queries(bytes: &[u8]) -> usize {
    // Queries change nothing.
    static SEEN: OnceLock<PublishedState> = OnceLock::new();
    let seen = SEEN.get_or_init(seen);
    let mut rest = bytes;
    let mut answered = 0;
    for _ in 0..MAX {
        let Some((kind, message)) = super::message(&mut rest) else { break };
        answered += usize::from(answer(seen, kind, message).is_some());
    }
    answered
}

/// Returns a state with each shape that a robot can have: planes, triangles, height fields, hulls and round
/// shapes.
fn seen() -> PublishedState {
    let plane = "<robot name='r'><link name='a'><collision><geometry><plane normal='0 0 1'/></geometry></collision>\
        </link></robot>";
    let field = MESH.replace("a.obj'", "a.csv' scale='4 4 1'");
    let round = "<robot name='r'><link name='a'><collision><geometry><cylinder radius='.1' length='.4'/></geometry>\
        </collision><collision><origin xyz='.5 0 0' rpy='.3 0 0'/><geometry><cone radius='.1' length='.4'/></geometry>\
        </collision><collision><origin xyz='0 .5 0'/><geometry><capsule radius='.1' length='.4'/></geometry>\
        </collision></link></robot>";
    let robots: [(&str, &str, &[u8], bool); 7] = [
        ("arm", ARM, b"", true),
        ("ball", BALL, b"", false),
        ("plane", plane, b"", true),
        ("mesh", MESH, PYRAMID, true),
        ("field", &field, b"0 0 0 0\n0 0.5 0.2 0\n0 0.3 0.1 0\n0 0 0 0\n", true),
        ("hull", MESH, PYRAMID, false),
        ("round", round, b"", false),
    ];
    let limits = WorldLimits { robots: robots.len(), saved_states: 0 };
    let mut world = Simulation::new(PhysicsSettings::default(), limits);
    for (index, (name, urdf, file, fixed)) in robots.into_iter().enumerate() {
        let at = index as f64;
        let place = DVec3::new(0.7 * at - 2.0, 0.3 * (at % 3.0), 0.4 * (at % 2.0));
        let spawned =
            spawn(name, urdf, file, place, fixed).map(|spawn| world.apply(&Command::Spawn(Box::new(spawn))));
        assert!(matches!(spawned, Some(Ok(_))), "{name}: {spawned:?}");
    }
    let mut seen = PublishedState::default();
    world.observe(&mut seen);
    let shapes = |name: &str| seen.entity(name).map(|(_, entity)| &entity.shapes);
    for (name, ..) in robots {
        let is_terrain = ["mesh", "field"].contains(&name);
        let is_meant = |shapes: &Arc<Shapes>| !shapes.is_empty() && shapes.has_terrain() == is_terrain;
        assert!(shapes(name).is_some_and(is_meant), "{name}");
    }
    seen
}

fn spawn(name: &str, urdf: &str, file: &[u8], place: DVec3, fixed: bool) -> Option<Spawn> {
    let spawn = read_with(urdf.as_bytes(), name, 0.0, &super::only(file), MeshShapes::Mesh)?;
    let shapes = Arc::new(Shapes::reusing(&spawn.model, fixed, MeshShapes::Mesh, &[]));
    Some(Spawn { shapes, fixed_base: Some(fixed), pose: DPose3::from_translation(place), ..spawn })
}

/// Returns `None` if the bytes are not a message, or it is refused.
fn answer(seen: &PublishedState, kind: u8, bytes: &[u8]) -> Option<()> {
    let to_the_end = || false;
    match kind % 5 {
        0 => {
            let v1::GetClosestPointsRequest { a, b, max_distance, nearest_only, filtered } =
                v1::GetClosestPointsRequest::decode(bytes).ok()?;
            let (a, b) = query::sides(a, b).ok()?;
            let a = side(seen, a)?;
            let b = match b {
                Some(b) => Some(side(seen, b)?),
                None => None,
            };
            let within = max_distance.unwrap_or(f64::INFINITY);
            let asked = DistanceQuery { a, b, within, nearest_only, filtered };
            let found = seen.distances(&asked, &to_the_end).ok()?;
            assert!(!nearest_only || found.len() <= 1, "the nearest is one: {found:?}");
            let pairs: BTreeSet<_> = found.iter().map(|pair| (&pair.robots, &pair.links)).collect();
            assert_eq!(pairs.len(), found.len(), "each pair comes once: {found:?}");
            found.iter().for_each(|pair| check_distance(pair, within));
        }
        1 => {
            let v1::FindOverlapsRequest { shape, pose, bounds_only } =
                v1::FindOverlapsRequest::decode(bytes).ok()?;
            let (shape, pose) = query::shape(&Path::ROOT, shape, pose).ok()?;
            let found = seen.overlaps(&shape, pose, bounds_only, &to_the_end).ok()?;
            let links: BTreeSet<_> = found.iter().collect();
            assert_eq!(links.len(), found.len(), "each link comes once: {found:?}");
        }
        2 => {
            let v1::CastShapeRequest { shape, pose, translation } =
                v1::CastShapeRequest::decode(bytes).ok()?;
            let (shape, pose) = query::shape(&Path::ROOT, shape, pose).ok()?;
            let way = query::translation(translation).ok()?;
            seen.cast_shape(&shape, pose, way, &to_the_end).ok()?.iter().for_each(check);
        }
        3 => {
            let v1::CastRaysRequest { rays, collision_mask } = v1::CastRaysRequest::decode(bytes).ok()?;
            let rays = contact::rays(rays).ok()?;
            let hits = seen.cast_rays(&rays, collision_mask, &to_the_end).ok()?;
            assert_eq!(hits.len(), rays.len(), "each ray has an answer");
            hits.iter().flatten().for_each(check);
        }
        _ => {
            let v1::GetLinkBoundsRequest { robots } = v1::GetLinkBoundsRequest::decode(bytes).ok()?;
            let indices: Option<Vec<usize>> =
                robots.iter().map(|robot| Some(seen.entity(robot)?.0)).collect();
            let found = seen.bounds_of(&indices?, &to_the_end).ok()?;
            for (robot, (link, [least, most])) in &found {
                let is_box = least.is_finite() && most.is_finite() && least.cmple(*most).all();
                assert!(is_box, "{robot}/{link}: {least} {most}");
            }
        }
    }
    Some(())
}

/// Returns a side of a distance, with existing robots.
fn side(seen: &PublishedState, side: query::Side) -> Option<QuerySide> {
    let v1::QueryBody { robot, link, configuration, .. } = match side {
        query::Side::Body(body) => body,
        query::Side::Shape(geometry, pose) => return Some(QuerySide::Shape(geometry, pose)),
    };
    let (index, entity) = seen.entity(&robot)?;
    let link = match link.as_str() {
        "" => None,
        name => Some(entity.model.links.iter().position(|known| known.name == name)?),
    };
    let at = Path::ROOT.field("configuration");
    let configuration = match configuration {
        None => None,
        given => Some(kinematics::configuration_at(&at, given, seen, index, entity).ok()?),
    };
    Some(QueryBody { robot: index, link, configuration }.into())
}

fn check_distance(found: &DistanceReport, within: f64) {
    let DistanceReport { points, normal, distance, .. } = found;
    assert!(distance.is_finite() && points.iter().all(|point| point.is_finite()), "{found:?}");
    assert!(*distance <= within, "{found:?} is farther than {within}");
    assert!((normal.length() - 1.0).abs() < 1e-6, "{found:?}");
}

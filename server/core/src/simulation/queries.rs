//! Distances, overlaps, bounds and casts of shapes, from only a published state.

use std::borrow::Cow;

use glamx::{DPose3, DVec3};
use simd_model::robot::Geometry;

use super::check;
use super::error::Error;
use super::published_state::PublishedState;
use super::rays::{RayReport, weigh};
use crate::collision::distance::{Closest, DistanceFilter, MAX_DISTANCES, TooMany, closest_points};
use crate::collision::filter::{Filter, is_joined};
use crate::collision::scene::{NO_ROBOT, PlacedShape, QueryShape, Scene, link_bounds, posed_shapes};
use crate::dynamics::Configuration;

/// Size of a distance in a message without its names, bytes: ten numbers, and their encoding.
const DISTANCE_BYTES: usize = 120;

/// Size of a link's box in a message without its names, bytes: six numbers, and their encoding.
const BOUNDS_BYTES: usize = 80;

/// Size of a link's name in a message without its letters, bytes.
const NAME_BYTES: usize = 12;

/// A robot or one of its links in a distance query, at its present or another pose.
#[derive(Clone, Debug)]
pub struct QueryBody {
    /// Robot, by index.
    pub robot: usize,
    /// Link, by index; `None` means all of them.
    pub link: Option<usize>,
    /// Configuration; `None` means the present one.
    pub configuration: Option<Configuration>,
}

/// One side of a distance query.
#[derive(Clone, Debug)]
pub enum QuerySide {
    /// A robot or one of its links.
    Body(QueryBody),
    /// A shape that belongs to no robot, and `world_from_shape`.
    Shape(Geometry, DPose3),
}

impl From<QueryBody> for QuerySide {
    fn from(body: QueryBody) -> Self {
        Self::Body(body)
    }
}

/// Distance query.
#[derive(Clone, Debug)]
pub struct DistanceQuery {
    /// First side.
    pub a: QuerySide,
    /// Second side; `None` means every robot except the first's, at its present pose.
    pub b: Option<QuerySide>,
    /// Maximum distance of pairs of links, metres.
    pub within: f64,
    /// Whether only the nearest pair is wanted.
    pub nearest_only: bool,
    /// Whether pairs that the collision filter disables are left out.
    pub filtered: bool,
}

/// Nearest points of two links.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceReport {
    /// Names of the robots; empty for a shape that belongs to none.
    pub robots: [String; 2],
    /// Names of the links; empty for a shape that belongs to no robot.
    pub links: [String; 2],
    /// Point on the surface of each, world, metres.
    pub points: [DVec3; 2],
    /// Unit normal from the first to the second, world.
    pub normal: DVec3,
    /// Distance between the surfaces, metres; negative if they overlap.
    pub distance: f64,
}

/// A link and the corners of the box around its shapes, along the world's axes, metres.
pub type LinkBounds = (String, [DVec3; 2]);

/// Returns the poses of the links of a robot by its index.
type LinkPoses<'a> = &'a dyn Fn(usize) -> Cow<'a, [DPose3]>;

impl PublishedState {
    /// Returns the shapes of a robot at its present pose.
    pub(super) fn placed(&self, robot: usize, link: Option<usize>) -> Vec<PlacedShape> {
        self.placed_at(robot, link, &|robot| self.link_poses(robot).unwrap_or_default().into())
    }

    /// Returns the shapes of a robot with known poses of its links.
    fn placed_at(&self, robot: usize, link: Option<usize>, poses: LinkPoses<'_>) -> Vec<PlacedShape> {
        let Some(entity) = self.world.entities.get(robot).filter(|entity| !entity.shapes.is_empty()) else {
            return Vec::new();
        };
        posed_shapes(robot, &entity.tree, &entity.shapes, &poses(robot), link)
    }

    /// Returns the shapes of a robot in the requested configuration.
    fn placed_as(&self, body: &QueryBody, poses: LinkPoses<'_>) -> Vec<PlacedShape> {
        let QueryBody { robot, link, configuration } = body;
        let (Some(entity), Some(at)) = (self.world.entities.get(*robot), configuration) else {
            return self.placed_at(*robot, *link, poses);
        };
        let poses = entity.tree.link_poses(at.root, &at.positions);
        posed_shapes(*robot, &entity.tree, &entity.shapes, &poses, *link)
    }

    /// Returns the shapes of a side of a distance query; `field` is the side's field in the request.
    fn side(&self, field: &str, side: &QuerySide, poses: LinkPoses<'_>) -> Result<Vec<PlacedShape>, Error> {
        match side {
            QuerySide::Body(body) => Ok(self.placed_as(body, poses)),
            QuerySide::Shape(geometry, pose) => {
                let within = |error: Error| error.within(|| field.to_owned());
                let shape = shape(geometry).map_err(within)?;
                check::moderate_pose("pose", pose).map_err(within)?;
                Ok(vec![PlacedShape::of_no_robot(&shape, *pose)])
            }
        }
    }

    /// Returns all shapes of the world; empty once `is_cancelled`.
    pub(super) fn scene(&self, is_cancelled: &dyn Fn() -> bool) -> Scene {
        let robots = (0..self.world.entities.len()).take_while(|_| !is_cancelled());
        Scene::new(robots.flat_map(|robot| self.placed(robot, None)).collect())
    }

    /// Returns the nearest points of each pair of links, in the order of robots and links. Shapes of one body
    /// are never a pair, nor is a link with itself.
    ///
    /// # Errors
    /// Returns an error in these cases:
    ///
    /// * the distance is NaN, a shape is invalid, or its pose is farther away than
    ///   [`simd_model::LARGEST_GIVEN`];
    /// * both sides are triangle meshes or height fields;
    /// * there are too many pairs, or their names take too many bytes.
    pub fn distances(
        &self,
        query: &DistanceQuery,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Result<Vec<DistanceReport>, Error> {
        let poses = |robot: usize| self.link_poses(robot).unwrap_or_default().into();
        let found = self.closest_points(query, &poses, is_cancelled)?;
        let mut bytes = 0;
        let reports = found.into_iter().filter_map(|closest| self.distance_report(closest));
        let weighed = reports.map(|report| {
            let names = report.robots.iter().chain(&report.links).map(String::len).sum::<usize>();
            weigh(&mut bytes, DISTANCE_BYTES + names)?;
            Ok(report)
        });
        weighed.collect()
    }

    /// Returns the nearest points by indices, with known poses of links.
    ///
    /// # Errors
    /// See [`distances`](Self::distances), except for names.
    pub(crate) fn closest_points(
        &self,
        query: &DistanceQuery,
        poses: LinkPoses<'_>,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Result<Vec<Closest>, Error> {
        let DistanceQuery { a, b, within, nearest_only, filtered } = query;
        if within.is_nan() {
            return Err(check::refuse("max_distance", within, "it must be a number"));
        }
        let body = |side: &QuerySide| match side {
            QuerySide::Body(body) => Some(body.clone()),
            QuerySide::Shape(..) => None,
        };
        let first = self.side("a", a, poses)?;
        let second = match b {
            Some(b) => self.side("b", b, poses)?,
            None => {
                let own = body(a).map(|a| a.robot);
                let others = (0..self.world.entities.len()).filter(|robot| Some(*robot) != own);
                let others = others.take_while(|_| !is_cancelled());
                others.flat_map(|robot| self.placed_at(robot, None, poses)).collect()
            }
        };
        let are_surfaces =
            |side: &[PlacedShape]| !side.is_empty() && side.iter().all(PlacedShape::is_surface);
        if b.is_some() && are_surfaces(&first) && are_surfaces(&second) {
            let expected = "distances between two meshes of triangles are not computed: load one of the robots with \
                            convex hulls (`collision` hull)";
            return Err(check::refuse("b", "a mesh of triangles", expected));
        }
        // Two configurations of one robot count as two robots; with one configuration each pair comes once.
        let bodies = body(a).zip(b.as_ref().and_then(body)).filter(|(a, b)| a.robot == b.robot);
        let same_pose = bodies
            .as_ref()
            .is_some_and(|(a, b)| a.configuration.is_none() && b.configuration.is_none() && a.link == b.link);
        let one_state =
            bodies.as_ref().is_none_or(|(a, b)| a.configuration.is_none() && b.configuration.is_none());
        let is_wanted = |x: &PlacedShape, y: &PlacedShape| {
            let apart = x.robot != y.robot
                || !one_state
                || x.is_of_no_robot()
                || (x.body != y.body && x.link != y.link);
            apart && (!same_pose || x.link < y.link) && (!filtered || self.may_touch(x, y))
        };
        let wanted = DistanceFilter { within: *within, nearest_only: *nearest_only };
        let found = closest_points([&first, &second], wanted, is_wanted, is_cancelled);
        found.map_err(|TooMany(value, limit)| Error::LimitExceeded {
            what: if limit == MAX_DISTANCES {
                "the number of pairs of shapes of one query that are near each other (a smaller `max_distance` leaves some out, and \
                 so do links instead of robots)"
                    .into()
            } else {
                "the number of pairs of shapes of one query (ask for links instead of robots)".into()
            },
            value: value as u64,
            limit: limit as u64,
        })
    }

    /// Returns whether the collision filter allows two shapes to touch, regardless of self-collision.
    fn may_touch(&self, a: &PlacedShape, b: &PlacedShape) -> bool {
        let mut sides = [a, b];
        sides.sort_unstable_by_key(|side| (side.robot, side.link));
        let [robots, links] = [sides.map(|side| side.robot), sides.map(|side| side.link)];
        let of = |side: usize| self.settings.get(robots[side]);
        let (Some(first), Some(second)) = (of(0), of(1)) else { return true };
        let groups = || {
            let of_link = |settings: &super::robot_settings::RobotSettings, link: usize| {
                settings.groups.get(link).copied().unwrap_or_default()
            };
            of_link(first, links[0]).allow(of_link(second, links[1]))
        };
        if robots[0] != robots[1] {
            return Filter::between(robots, &self.collision_pairs).switched(links).unwrap_or_else(groups);
        }
        match first.collision_pairs.binary_search_by_key(&links, |pair| pair.links) {
            Ok(index) => first.collision_pairs[index].enabled,
            Err(_) => {
                let tree = self.world.entities.get(robots[0]).map(|entity| &entity.tree);
                groups() && !tree.is_some_and(|tree| is_joined(tree, a.body, b.body))
            }
        }
    }

    fn distance_report(&self, closest: Closest) -> Option<DistanceReport> {
        let Closest { robots, links, points, normal, distance } = closest;
        let name = |side: usize| match robots[side] {
            NO_ROBOT => Some(Default::default()),
            robot => self.link_name(robot, links[side]),
        };
        let [(robot_a, link_a), (robot_b, link_b)] = [name(0)?, name(1)?];
        Some(DistanceReport { robots: [robot_a, robot_b], links: [link_a, link_b], points, normal, distance })
    }

    /// Returns the names of a robot and one of its links.
    pub(super) fn link_name(&self, robot: usize, link: usize) -> Option<(String, String)> {
        let entity = self.world.entities.get(robot)?;
        Some((entity.name.clone(), entity.model.links.get(link)?.name.clone()))
    }

    /// Returns robots and links that overlap a shape at a pose, in order. With `bounds_only`, returns those
    /// whose boxes along the world's axes meet the shape's.
    ///
    /// # Errors
    /// Returns an error if the shape or its pose has numbers larger than [`simd_model::LARGEST_GIVEN`], or if
    /// the shape is a mesh without a hull. Also returns one if the names take too many bytes.
    pub fn overlaps(
        &self,
        geometry: &Geometry,
        pose: DPose3,
        bounds_only: bool,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Result<Vec<(String, String)>, Error> {
        let shape = shape(geometry)?;
        check::moderate_pose("pose", &pose)?;
        let found = self.scene(is_cancelled).overlaps(&shape, pose, bounds_only, is_cancelled);
        let mut bytes = 0;
        let named = found.into_iter().filter_map(|(robot, link)| self.link_name(robot, link));
        let weighed = named.map(|(robot, link)| {
            weigh(&mut bytes, NAME_BYTES + robot.len() + link.len())?;
            Ok((robot, link))
        });
        weighed.collect()
    }

    /// Returns the box around the shapes of each link of the robot at this index, along the world's axes.
    /// Links without shapes and planes have none.
    pub fn link_bounds(&self, robot: usize) -> Vec<LinkBounds> {
        let Some(entity) = self.world.entities.get(robot) else { return Vec::new() };
        let bounds = link_bounds(&self.placed(robot, None), entity.model.links.len());
        let named = entity.model.links.iter().zip(bounds);
        named.filter_map(|(link, bounds)| Some((link.name.clone(), bounds?))).collect()
    }

    /// Returns the boxes of the links of robots at these indices, with the name of each. Stops as soon as
    /// `is_cancelled`.
    ///
    /// # Errors
    /// Returns an error if the names take too many bytes.
    pub fn bounds_of(
        &self,
        robots: &[usize],
        is_cancelled: &dyn Fn() -> bool,
    ) -> Result<Vec<(String, LinkBounds)>, Error> {
        let mut bytes = 0;
        let mut found = Vec::new();
        for &robot in robots.iter().take_while(|_| !is_cancelled()) {
            let Some(entity) = self.world.entities.get(robot) else { continue };
            for (link, corners) in self.link_bounds(robot) {
                weigh(&mut bytes, BOUNDS_BYTES + entity.name.len() + link.len())?;
                found.push((entity.name.clone(), (link, corners)));
            }
        }
        Ok(found)
    }

    /// Returns the first contact of a shape that moves from a pose along a straight path, without turning.
    ///
    /// # Errors
    /// Returns an error if the shape, its pose or the path has numbers larger than
    /// [`simd_model::LARGEST_GIVEN`]. Also returns one if the shape is a mesh without a hull.
    pub fn cast_shape(
        &self,
        geometry: &Geometry,
        pose: DPose3,
        way: DVec3,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Result<Option<RayReport>, Error> {
        let shape = shape(geometry)?;
        check::moderate_pose("pose", &pose)?;
        check::moderate_point("translation", way)?;
        let hit = self.scene(is_cancelled).cast_shape(&shape, pose, way, is_cancelled);
        Ok(hit.and_then(|hit| self.ray_report(hit)))
    }

    /// Returns a hit, with names.
    pub(super) fn ray_report(&self, hit: crate::collision::rays::RayHit) -> Option<RayReport> {
        let (robot, link) = self.link_name(hit.robot, hit.link)?;
        Some(RayReport { robot, link, point: hit.point, normal: hit.normal, fraction: hit.fraction })
    }
}

fn shape(geometry: &Geometry) -> Result<QueryShape, Error> {
    check::shape("shape", geometry)?;
    QueryShape::new(geometry).ok_or_else(|| {
        check::refuse("shape", "a mesh", "it must be a box, a sphere, a cylinder, a capsule or a cone")
    })
}

//! Overlaps of a robot's links with other robots, and a free place beside them, from a published state alone.

use glamx::DVec3;

use super::error::Error;
use super::published_state::PublishedState;
use super::queries::{DistanceQuery, QueryBody};
use crate::collision::scene::link_bounds;

/// Depth below which overlaps count as contact, metres.
const TOUCHES: f64 = 1e-3;

/// Distance of a free place from others, metres.
const FREE_PLACE_GAP: f64 = 0.1;

/// Two overlapping links of different robots, of which one can move.
#[derive(Clone, Debug, PartialEq)]
pub struct SpawnOverlap {
    /// Link of the robot.
    pub link: String,
    /// Name of the other robot.
    pub robot: String,
    /// Link of the other robot.
    pub other_link: String,
    /// Depth of the overlap, metres.
    pub depth: f64,
}

impl PublishedState {
    /// Returns the overlaps of the robot at this index with others that the collision filter lets it touch,
    /// the deepest first.
    ///
    /// # Errors
    /// Returns an error if there are too many pairs of shapes for one query.
    pub fn spawn_overlaps(
        &self,
        robot: usize,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Result<Vec<SpawnOverlap>, Error> {
        let body = QueryBody { robot, link: None, configuration: None };
        let query =
            DistanceQuery { a: body.into(), b: None, within: 0.0, nearest_only: false, filtered: true };
        let poses = |robot: usize| self.link_poses(robot).unwrap_or_default().into();
        let moves = |robot: usize, link: usize| {
            let tree = self.world.entities.get(robot).map(|entity| &entity.tree);
            tree.and_then(|tree| tree.links.get(link)).is_some_and(|link| link.body.is_some())
        };
        let mut overlaps = Vec::new();
        for pair in self.closest_points(&query, &poses, is_cancelled)? {
            let ([own, other], [link, other_link]) = (pair.robots, pair.links);
            if pair.distance > -TOUCHES || !(moves(own, link) || moves(other, other_link)) {
                continue;
            }
            if let (Some((_, link)), Some((robot, other_link))) =
                (self.link_name(own, link), self.link_name(other, other_link))
            {
                overlaps.push(SpawnOverlap { link, robot, other_link, depth: -pair.distance });
            }
        }
        overlaps.sort_by(|a, b| b.depth.total_cmp(&a.depth));
        Ok(overlaps)
    }

    /// Returns the displacement along x of the robot at this index that brings its bounds beside those of all
    /// others, metres. Returns `None` if it has no shapes.
    pub fn way_to_free_place(&self, robot: usize) -> Option<f64> {
        let entity = self.world.entities.get(robot)?;
        let own = self.bounds(robot, entity.model.links.len())?;
        let others = (0..self.world.entities.len()).filter(|other| *other != robot);
        let ends = others.filter_map(|other| {
            let links = self.world.entities.get(other)?.model.links.len();
            let [least, most] = self.bounds(other, links)?;
            // Floors are below everything.
            let is_floor = (most - least).x > 10.0 * (own[1] - own[0]).x.max(1.0);
            (!is_floor).then_some(most.x)
        });
        let end = ends.fold(f64::NEG_INFINITY, f64::max);
        end.is_finite().then(|| end + FREE_PLACE_GAP - own[0].x)
    }

    /// Returns the box around all shapes of a robot except planes, along the world's axes.
    fn bounds(&self, robot: usize, links: usize) -> Option<[DVec3; 2]> {
        let boxes = link_bounds(&self.placed(robot, None), links).into_iter().flatten();
        boxes.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }
}

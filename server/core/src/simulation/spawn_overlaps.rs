//! Overlaps of a robot's links with other robots, and a free place beside them, from only a published state.

use super::error::Error;
use super::free_place::Extent;
use super::published_state::PublishedState;
use super::queries::{DistanceQuery, QueryBody};

/// Depth below which overlaps count as contact, metres.
const TOUCHES: f64 = 1e-3;

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

    /// Returns the displacement along y of the robot at this index to a place beside all others, metres;
    /// `None` if there is no such robot.
    pub fn way_to_free_place(&self, robot: usize) -> Option<f64> {
        let others = (0..self.world.entities.len()).filter(|other| *other != robot);
        Some(self.extent(robot)?.way_beside(others.filter_map(|other| self.extent(other))))
    }

    fn extent(&self, robot: usize) -> Option<Extent> {
        let entity = self.world.entities.get(robot)?;
        Some(Extent::new(&entity.tree, &entity.shapes, &self.link_poses(robot)?))
    }
}

//! Links below the surface of terrain, from only a published state.

use glamx::DVec3;

use super::published_state::PublishedState;

/// A link below the surface of terrain.
#[derive(Clone, Debug, PartialEq)]
pub struct TerrainPenetration {
    /// Names of the robot and of its link.
    pub link: (String, String),
    /// Names of the terrain's robot, and of its link.
    pub terrain: (String, String),
    /// Depth of the centre of the link's deepest shape below the surface, metres.
    pub depth: f64,
}

impl PublishedState {
    /// Returns movable links below the surface of terrain, with the robot at this index on one side: at most
    /// `most`. Returns those found so far as soon as `is_cancelled`, which is called before each pair of
    /// shapes.
    pub fn terrain_penetrations(
        &self,
        robot: usize,
        gravity: DVec3,
        most: usize,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Vec<TerrainPenetration> {
        let up = (-gravity).normalize_or(DVec3::Z);
        let is_terrain =
            |robot: usize| self.world.entities.get(robot).is_some_and(|entity| entity.shapes.has_terrain());
        let count = self.world.entities.len();
        // If this robot is not terrain, only terrain matters to it.
        let others = (0..count).filter(|other| *other != robot && (is_terrain(robot) || is_terrain(*other)));
        let own = self.placed(robot, None);
        let mut found: Vec<TerrainPenetration> = Vec::new();
        for other in others.take_while(|_| !is_cancelled()) {
            let theirs = self.placed(other, None);
            for [bodies, grounds] in [[&own, &theirs], [&theirs, &own]] {
                let grounds: Vec<_> = grounds.iter().filter(|shape| shape.is_terrain()).collect();
                let bodies = bodies.iter().filter(|shape| shape.body.is_some());
                for (body, ground) in
                    bodies.flat_map(|body| grounds.iter().map(move |ground| (body, *ground)))
                {
                    if is_cancelled() {
                        return found;
                    }
                    let Some(depth) = body.depth_below(ground, up) else { continue };
                    let names =
                        (self.link_name(body.robot, body.link), self.link_name(ground.robot, ground.link));
                    let (Some(link), Some(terrain)) = names else { continue };
                    let known = found.iter().position(|known| known.link == link && known.terrain == terrain);
                    match known.and_then(|index| found.get_mut(index)) {
                        Some(known) => known.depth = known.depth.max(depth),
                        None => found.push(TerrainPenetration { link, terrain, depth }),
                    }
                    if found.len() >= most {
                        return found;
                    }
                }
            }
        }
        found
    }
}

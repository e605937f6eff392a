//! What rays hit, found from a published state alone.

use glamx::DVec3;

use super::check;
use super::error::Error;
use super::published_state::PublishedState;
use crate::collision::rays::Scene;

/// Rays that one request may cast.
pub const MOST_RAYS: usize = 1_000;

/// Where a ray meets a link.
#[derive(Clone, Debug, PartialEq)]
pub struct RayReport {
    /// The robot's name.
    pub robot: String,
    /// The link's name.
    pub link: String,
    /// World, metres.
    pub point: DVec3,
    /// Out of the surface, of unit length, world.
    pub normal: DVec3,
    /// The part of the way from start to end, 0 to 1.
    pub fraction: f64,
}

/// Whether these rays can be cast: there are at most [`MOST_RAYS`], and each has finite ends.
///
/// # Errors
/// Where one of the two does not hold.
pub fn check_rays(rays: &[[DVec3; 2]]) -> Result<(), Error> {
    if rays.len() > MOST_RAYS {
        return Err(Error::LimitExceeded {
            what: "the number of rays of one query".into(),
            value: rays.len() as u64,
            limit: MOST_RAYS as u64,
        });
    }
    for (index, ray) in rays.iter().enumerate() {
        for (field, point) in ["from", "to"].into_iter().zip(ray) {
            check::point(field, *point).map_err(|error| error.within(|| format!("rays[{index}]")))?;
        }
    }
    Ok(())
}

impl PublishedState {
    /// What each ray, from its start to its end (world, metres), hits first; `None` where it hits
    /// nothing. Gives up, with nothing, as soon as `is_cancelled`, which is asked before each ray
    /// and each robot.
    ///
    /// # Errors
    /// Those of [`check_rays`].
    pub fn cast_rays(
        &self,
        rays: &[[DVec3; 2]],
        is_cancelled: impl Fn() -> bool,
    ) -> Result<Vec<Option<RayReport>>, Error> {
        check_rays(rays)?;
        let robots = self.world.entities.iter().enumerate().take_while(|_| !is_cancelled());
        let placed = robots.filter(|(_, entity)| !entity.shapes.is_empty()).filter_map(|(robot, entity)| {
            Some((robot, &*entity.tree, &*entity.shapes, self.link_poses(robot)?))
        });
        let scene = Scene::new(placed);
        let cast = |&[from, to]: &[DVec3; 2]| {
            let hit = scene.cast(from, to)?;
            let entity = self.world.entities.get(hit.robot)?;
            Some(RayReport {
                robot: entity.name.clone(),
                link: entity.model.links.get(hit.link)?.name.clone(),
                point: hit.point,
                normal: hit.normal,
                fraction: hit.fraction,
            })
        };
        Ok(rays.iter().take_while(|_| !is_cancelled()).map(cast).collect())
    }
}

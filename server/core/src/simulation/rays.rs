//! What rays hit, found from a published state alone.

use glamx::DVec3;

use super::check;
use super::error::Error;
use super::published_state::PublishedState;
use crate::collision::scene::PlacedShape;

/// Rays that one request may cast.
pub const MOST_RAYS: usize = 20_000;

/// Bytes that the answer to one request may have: what is around it fits a message of 4 MiB too.
const MOST_BYTES: usize = 4_000_000;

/// Bytes of a hit without its names: eight numbers, and what is around them.
const HIT_BYTES: usize = 90;

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

/// Whether these rays can be cast: there are at most [`MOST_RAYS`], and the ends of each are no farther away than
/// [`simd_model::LARGEST_GIVEN`].
///
/// # Errors
/// Returns an error if one of the two does not hold.
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
            check::moderate_point(field, *point)
                .map_err(|error| error.within(|| format!("rays[{index}]")))?;
        }
    }
    Ok(())
}

/// Adds an entry of an answer to its bytes.
///
/// # Errors
/// Returns an error if the answer is larger than a message may be.
pub(super) fn weigh(bytes: &mut usize, entry: usize) -> Result<(), Error> {
    *bytes += entry;
    if *bytes <= MOST_BYTES {
        return Ok(());
    }
    Err(Error::LimitExceeded {
        what: "the size of the answer in bytes, with the names of all its links,".into(),
        value: *bytes as u64,
        limit: MOST_BYTES as u64,
    })
}

impl PublishedState {
    /// What each ray, from its start to its end (world, metres), hits first; `None` where it hits
    /// nothing. Only links in one of the groups of `mask` are hit, where there is one. Gives up, with nothing, as soon
    /// as `is_cancelled`, which is asked before each ray and each robot.
    ///
    /// # Errors
    /// Those of [`check_rays`], and where the names of what is hit make too many bytes.
    pub fn cast_rays(
        &self,
        rays: &[[DVec3; 2]],
        mask: Option<u32>,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Result<Vec<Option<RayReport>>, Error> {
        check_rays(rays)?;
        let scene = self.scene(is_cancelled);
        let is_wanted = |placed: &PlacedShape| {
            let Some(mask) = mask else { return true };
            let settings = self.settings.get(placed.robot);
            let groups = settings.and_then(|settings| settings.groups.get(placed.link)).copied();
            groups.unwrap_or_default().group & mask != 0
        };
        let mut bytes = 0;
        let mut cast = |&[from, to]: &[DVec3; 2]| {
            let Some(hit) = scene.cast(from, to, is_wanted).and_then(|hit| self.ray_report(hit)) else {
                return Ok(None);
            };
            weigh(&mut bytes, HIT_BYTES + hit.robot.len() + hit.link.len())?;
            Ok(Some(hit))
        };
        rays.iter().take_while(|_| !is_cancelled()).map(&mut cast).collect()
    }
}

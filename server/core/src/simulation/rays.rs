//! Ray casts, from only a published state.

use glamx::DVec3;

use super::check;
use super::error::Error;
use super::published_state::PublishedState;
use crate::collision::scene::PlacedShape;

/// Maximum number of rays in one request.
pub const MAX_RAYS: usize = 20_000;

/// Maximum size of an answer, bytes: with its envelope it fits a message of 4 MiB.
const MAX_BYTES: usize = 4_000_000;

/// Size of a hit in a message without its names, bytes: eight numbers, and their encoding.
const HIT_BYTES: usize = 90;

/// Hit of a ray on a link.
#[derive(Clone, Debug, PartialEq)]
pub struct RayReport {
    /// Name of the robot.
    pub robot: String,
    /// Name of the link.
    pub link: String,
    /// Point, world, metres.
    pub point: DVec3,
    /// Outward unit normal of the surface, world.
    pub normal: DVec3,
    /// Part of the path from start to end, 0 to 1.
    pub fraction: f64,
}

/// Checks that there are at most [`MAX_RAYS`], and that the ends of each are within
/// [`simd_model::LARGEST_GIVEN`].
///
/// # Errors
/// Returns an error if one of the two fails.
pub fn check_rays(rays: &[[DVec3; 2]]) -> Result<(), Error> {
    if rays.len() > MAX_RAYS {
        return Err(Error::LimitExceeded {
            what: "the number of rays of one query".into(),
            value: rays.len() as u64,
            limit: MAX_RAYS as u64,
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
/// Returns an error if the answer exceeds the maximum size of a message.
pub(super) fn weigh(bytes: &mut usize, entry: usize) -> Result<(), Error> {
    *bytes += entry;
    if *bytes <= MAX_BYTES {
        return Ok(());
    }
    Err(Error::LimitExceeded {
        what: "the size of the answer in bytes, with the names of all its links,".into(),
        value: *bytes as u64,
        limit: MAX_BYTES as u64,
    })
}

impl PublishedState {
    /// Returns the first hit of each ray, from its start to its end (world, metres); `None` if it hits
    /// nothing. With a `mask`, only links in one of its groups are hit. Returns an empty list as soon as
    /// `is_cancelled`, which is called before each ray and each robot.
    ///
    /// # Errors
    /// As [`check_rays`], and if the names of the hits take too many bytes.
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

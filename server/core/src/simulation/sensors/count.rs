//! Number of sensors and its limits.

use simd_model::sensor::SensorKind;

use super::state::MAX_SENSORS;
use crate::simulation::error::Error;

/// Maximum number of rays of all sensors of a world. The newest reading of each is stored: these are 32 MiB
/// of ranges.
pub const MAX_RAYS: u64 = 8 << 20;

/// Number of sensors, and of all their rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::simulation) struct SensorCount {
    sensors: usize,
    rays: u64,
}

impl SensorCount {
    /// Counts sensors by their types.
    pub(in crate::simulation) fn of<'k>(kinds: impl IntoIterator<Item = &'k SensorKind>) -> Self {
        kinds.into_iter().fold(Self::default(), |Self { sensors, rays }, kind| Self {
            sensors: sensors + 1,
            rays: rays.saturating_add(kind.rays()),
        })
    }

    /// Refuses additional sensors if there would be too many.
    pub(in crate::simulation) fn check(self, more: Self) -> Result<(), Error> {
        let (sensors, rays) = (self.sensors + more.sensors, self.rays.saturating_add(more.rays));
        for (what, more, value, limit) in [
            ("the number of sensors", more.sensors as u64, sensors as u64, MAX_SENSORS as u64),
            ("the number of rays of all sensors", more.rays, rays, MAX_RAYS),
        ] {
            if more > 0 && value > limit {
                return Err(Error::LimitExceeded { what: what.into(), value, limit });
            }
        }
        Ok(())
    }
}

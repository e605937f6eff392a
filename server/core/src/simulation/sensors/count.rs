//! How many sensors there are, and how many may be.

use simd_model::sensor::SensorKind;

use super::state::MAX_SENSORS;
use crate::simulation::error::Error;

/// Rays of all sensors of a world at the most. The newest reading of each is kept: these are 32 MiB of ranges.
pub const MAX_RAYS: u64 = 8 << 20;

/// Sensors, and the rays of all of them together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::simulation) struct SensorCount {
    sensors: usize,
    rays: u64,
}

impl SensorCount {
    /// Counts sensors by what they measure.
    pub(in crate::simulation) fn of<'k>(kinds: impl IntoIterator<Item = &'k SensorKind>) -> Self {
        kinds.into_iter().fold(Self::default(), |Self { sensors, rays }, kind| Self {
            sensors: sensors + 1,
            rays: rays.saturating_add(kind.rays()),
        })
    }

    /// Refuses so many more where there would be too many.
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

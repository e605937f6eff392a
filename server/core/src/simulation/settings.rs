//! Gravity, time step, substeps, integrator, how surfaces combine, and sleep.

use glamx::DVec3;
use serde::{Deserialize, Serialize};

pub use crate::collision::SurfaceCombination;
pub use crate::dynamics::Integrator;
use crate::plain::vector3;

/// Seconds that a step may advance.
pub(super) const TIME_STEP: std::ops::RangeInclusive<f64> = 1e-6..=0.1;

/// Parts that a step may be done in.
pub(super) const SUBSTEPS: std::ops::RangeInclusive<u32> = 1..=1000;

/// How a world is stepped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhysicsSettings {
    /// m/s^2, world axes.
    #[serde(with = "vector3")]
    pub gravity: DVec3,
    /// Seconds that a step advances.
    pub time_step: f64,
    /// Equal parts that a step is done in.
    pub substeps: u32,
    /// The method of a step.
    pub integrator: Integrator,
    /// How coefficients of surfaces that touch become those of the contact.
    pub surface_combination: SurfaceCombination,
    /// Free bodies at rest sleep: steps leave them where they are until something acts on them.
    pub sleeping: bool,
}

impl Default for PhysicsSettings {
    /// Earth, 1 ms, one part, leapfrog, the smaller friction, bodies sleep.
    fn default() -> Self {
        Self {
            gravity: DVec3::new(0.0, 0.0, -9.81),
            time_step: 1e-3,
            substeps: 1,
            integrator: Integrator::Leapfrog,
            surface_combination: SurfaceCombination::Min,
            sleeping: true,
        }
    }
}

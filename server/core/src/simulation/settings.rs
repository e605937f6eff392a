//! Gravity, time step, substeps, integrator, combination of surfaces, sleep, and profiles of setpoints.

use glamx::DVec3;
use serde::{Deserialize, Serialize};

pub use crate::collision::SurfaceCombination;
pub use crate::dynamics::Integrator;
pub use crate::dynamics::bullet::BulletContacts;
use crate::plain::vector3;

/// Range of the time step, seconds.
pub(super) const TIME_STEP: std::ops::RangeInclusive<f64> = 1e-6..=0.1;

/// Range of the number of parts of a step.
pub(super) const SUBSTEPS: std::ops::RangeInclusive<u32> = 1..=1000;

/// Physics settings of a world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhysicsSettings {
    /// Gravity, m/s^2, world axes.
    #[serde(with = "vector3")]
    pub gravity: DVec3,
    /// Time step, seconds.
    pub time_step: f64,
    /// Number of equal parts of a step.
    pub substeps: u32,
    /// Integration method.
    pub integrator: Integrator,
    /// Combination of the coefficients of touching surfaces.
    pub surface_combination: SurfaceCombination,
    /// Whether free bodies at rest sleep: steps skip them until something acts on them.
    pub sleeping: bool,
    /// Joints of new robots whose setpoints follow a profile.
    pub setpoint_profiles: SetpointProfiles,
}

/// Joints of new robots whose setpoints follow a velocity profile on their way to a position target.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum SetpointProfiles {
    /// Those without gains in their description. Others act as its format defines: a spring and a damper, whose
    /// effort is clamped.
    #[default]
    Undescribed,
    /// All of them.
    All,
    /// None of them.
    None,
}

impl Default for PhysicsSettings {
    /// Returns earth's gravity, 1 ms, one part, leapfrog, the smaller friction, and sleep.
    fn default() -> Self {
        Self {
            gravity: DVec3::new(0.0, 0.0, -9.81),
            time_step: 1e-3,
            substeps: 1,
            integrator: Integrator::Leapfrog,
            surface_combination: SurfaceCombination::Min,
            sleeping: true,
            setpoint_profiles: SetpointProfiles::Undescribed,
        }
    }
}

//! Sensors of robots: their definitions, the times of their samples, and the noise of their readings.
//!
//! A step only counts: which samples are due, the state of each random walk, and the positions of encoders
//! with backlash. The measurement of a sample follows from the state that is published after that step, on
//! any thread: see [`measure`](super::measure).

mod backlash;
mod count;
mod definition;
mod generator;
mod noise;
mod state;
mod world;

pub use self::backlash::EncoderShaft;
pub use self::count::MAX_RAYS;
pub(in crate::simulation) use self::count::SensorCount;
pub use self::definition::{SensorDefinition, WorldSensor};
pub use self::noise::{RayNoise, SampleNoise};
pub(in crate::simulation) use self::state::SensorOrigin;
pub use self::state::{DueSample, MAX_SENSORS, SensorState};
pub(in crate::simulation) use self::world::WorldSensors;

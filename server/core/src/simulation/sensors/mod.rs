//! Sensors of robots: what they are, when their samples fall due, and what noise their readings have.
//!
//! A step only counts: which samples fell due, how far each random walk has gone, and where encoders with backlash are. What a sample measures follows from the state that
//! is published after that step, on any thread: see [`measure`](super::measure).

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

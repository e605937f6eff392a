//! The Rust client of simd: robots, joints and time of a running daemon, over gRPC or Zenoh.
//!
//! ```no_run
//! use simd_client::{Client, Target, every_joint, joint_target};
//!
//! # async fn example() -> Result<(), simd_client::Error> {
//! let client = Client::connect("127.0.0.1:7400").await?;
//! let arm = client.load("arm/urdf/arm.urdf", Default::default()).await?;
//! let name = arm.entity.name;
//! client.set_robot_targets(&name, [joint_target("elbow", Target::position(0.5))]).await?;
//! for joint in client.read_joints(&every_joint(&name)).await?.joints {
//!     println!("{} is at {:?}", joint.name, joint.position);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! * [`Client`]: a connection; its methods are the calls of `simd.v1`, one file per service. `saved_state`
//!   has the calls that write and read files.
//! * [`Network`]: the daemons behind a Zenoh locator.
//! * [`Package`]: a robot on this disk, and the two steps that spawn it.
//! * [`Control`]: the stream of controllers, one answer for each request.
//! * [`Target`]: a target of a joint.
//! * [`RobotReading`]: joint states with the names of the joints.
//! * [`Error`]: the daemon's refusal, or the reason why it did not answer.
//! * [`testing`]: for tests of robots, waiting in simulated time.
//! * [`proto`]: the messages themselves.

mod camera;
mod channel;
mod client;
mod clients;
mod constraint;
mod contact;
mod control;
mod endpoint;
mod entity;
mod error;
mod event;
mod joint;
mod kinematics;
mod package;
mod parameter;
mod reading;
mod recording;
mod rollout;
mod saved_state;
mod sensor;
mod silence;
mod simulation;
mod target;
pub mod testing;
#[cfg_attr(not(feature = "zenoh"), allow(dead_code))]
mod tls;
mod token;
mod upload;
mod view;
#[cfg(feature = "zenoh")]
mod zenoh;
#[cfg(not(feature = "zenoh"))]
#[path = "zenoh_absent.rs"]
mod zenoh;

pub use self::zenoh::{Network, Presence};
pub use camera::plane_bytes;
pub use client::{Client, ConnectOptions};
pub use contact::ray;
pub use control::{Control, ControlOptions, ControlReply};
pub use endpoint::is_zenoh;
pub use entity::{Reloaded, Spawned};
pub use error::{Error, Refusal};
pub use event::{EventWatch, Observed};
pub use joint::{JointWatch, every_joint, some_joints};
pub use package::{OpenOptions, Package};
pub use parameter::{ParameterWatch, press, slide};
pub use reading::{JointReading, RobotReading};
pub use rollout::{Rollout, packed};
pub use sensor::{SensorWatch, every_sensor, some_sensors};
pub use simd_assets::{Locator, NoUrdf, NotFound, Replacement, replace_file};
pub use simd_proto::access;
pub use simd_proto::text::{is_printable, printable, printable_lines, without_error_numbers};
pub use simd_proto::{API_VERSION, DEFAULT_PORT, PROGRAM_VERSION, keys::DEFAULT_LOCATOR, v1 as proto};
pub use target::{Target, joint_target, robot_targets};
pub use token::{Token, TokenFileError};
pub use tonic::Code;
pub use view::{lines, points, text};

//! Converts URDF text and asset bytes to an immutable [`RobotModel`] and its [`LoadReport`]. Does no IO: the
//! caller provides the bytes.
//!
//! * [`robot`]: the model of a robot; [`setup`]: its initial state; [`sensor`]: its sensors.
//! * [`limits`]: limits of descriptions.
//! * [`report`]: findings about a description. `assets`: the files that it names.
//! * [`urdf`]: reads text to a robot.
//! * `translate`: translates SDF and MJCF to URDF; [`translation`]: the result.
//! * [`primitive`]: writes single shapes as text. `number`: checks given numbers.

mod assets;
mod inertia;
pub mod limits;
mod mesh;
mod mjcf;
mod name;
mod number;
pub mod primitive;
pub mod report;
pub mod robot;
mod sdf;
pub mod sensor;
pub mod setup;
mod translate;
pub mod translation;
pub mod urdf;

pub use assets::{Asset, Assets, first_places};
pub use limits::{LoadLimits, MAX_LINKS};
pub use mesh::beside::address as beside_mesh;
pub use mesh::hull::extremes;
pub use name::{first_bytes, is_wire_name, wire_name};
pub use number::{LARGEST_GIVEN, shown};
pub use primitive::Primitive;
pub use report::{Disposition, Finding, LoadReport, Severity};
pub use robot::RobotModel;
pub use translate::{describe_with, translate};
pub use translation::{Format, TranslatedFiles, TranslatedModel, Translation};
pub use urdf::{
    Description, ReadOptions, Refused, Srdf, SrdfPair, describe, other_case, read, read_srdf, readdress,
    with_states,
};

//! Conversion of requests to the daemon's own types. A bad value is refused with the path of its field; the
//! world checks whether names exist.

pub mod camera;
pub mod constraint;
pub mod contact;
pub mod entity;
pub mod event;
pub mod geometry;
pub mod joint;
pub mod kinematics;
pub mod parameter;
pub mod primitive;
pub mod query;
pub mod recording;
pub mod rollout;
pub mod sensor;
pub mod simulation;
pub mod state;
pub mod view;
pub mod xacro;

#[cfg(test)]
mod tests;

//! Conversion of the daemon's own types to answers.

pub mod camera;
pub mod constraint;
pub mod contact;
pub mod entity;
pub mod event;
pub mod geometry;
pub mod joint;
pub mod kinematics;
pub mod parameter;
pub mod query;
pub mod recording;
pub mod rollout;
pub mod scene;
pub mod sensor;
pub mod simulation;
pub mod stamp;
pub mod view;

#[cfg(test)]
mod tests;

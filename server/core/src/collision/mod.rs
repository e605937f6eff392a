//! What robots touch with: shapes of links as rapier's colliders. rapier's types do
//! not leave this module.
//!
//! * [`Shapes`]: the shapes of a robot, made once, away from the physics thread.
//! * [`Colliders`]: those of all robots in a world, and where they are.

mod colliders;
mod shapes;
#[cfg(test)]
mod tests;

pub use colliders::{ColliderPose, Colliders, RobotColliders};
pub use shapes::Shapes;

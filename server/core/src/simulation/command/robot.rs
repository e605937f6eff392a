//! Robots that come, and that get a new model.

use std::sync::Arc;

use glamx::DPose3;
use serde::{Deserialize, Serialize};
use simd_model::RobotModel;
use simd_model::robot::{Collision, Geometry, Link};

use super::{CollisionPair, ContactSettings, JointOrientation};
use crate::collision::Shapes;
use crate::plain::pose3;

/// A robot to bring into the world.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Spawn {
    /// Unique in the world; `[A-Za-z0-9_-]+`.
    pub name: String,
    /// Where the name is taken, add `_1`, `_2`, ... instead of refusing.
    pub allow_renaming: bool,
    /// What it is.
    #[serde(skip, default = "no_model")]
    pub model: Arc<RobotModel>,
    /// What it touches with; made from the model where there is time for it.
    #[serde(skip)]
    pub shapes: Arc<Shapes>,
    /// `world_from_root`.
    #[serde(with = "pose3")]
    pub pose: DPose3,
    /// Whether its root link can move; `None` fixes a root link called `world`.
    pub fixed_base: Option<bool>,
    /// Whether its joints hold their position or are not actuated.
    pub passive: bool,
    /// Positions to start from, rad or m, by joint name. Others start at zero, or
    /// at the nearest limit where zero lies outside.
    pub joint_positions: Vec<(String, f64)>,
    /// Orientations of spherical joints to start from. Others start at 0 0 0 1.
    pub joint_orientations: Vec<JointOrientation>,
    /// How its contacts are configured.
    pub contact_settings: ContactSettings,
    /// Pairs of its own links that are switched off or on.
    pub collision_pairs: Vec<CollisionPair>,
    /// Stays at a reset of scope `spawned`.
    pub loaded_at_start: bool,
}

/// Instead of a model that a recording has as files.
fn no_model() -> Arc<RobotModel> {
    Arc::new(RobotModel::default())
}

impl Spawn {
    /// Whether the root link of a robot cannot move, where `fixed_base` was asked for. Where nothing was asked for a link called
    /// `world` is fixed, and one with a plane, which cannot move and touch.
    pub fn is_base_fixed(model: &RobotModel, fixed_base: Option<bool>) -> bool {
        let is_plane = |collision: &Collision| matches!(collision.geometry, Geometry::Plane { .. });
        let is_fixed = |root: &Link| root.name == "world" || root.collisions.iter().any(is_plane);
        fixed_base.unwrap_or_else(|| model.links.first().is_some_and(is_fixed))
    }
}

/// A new model for a robot that is in the world. Keeps its name, pose and base,
/// and position, velocity and target of every joint that both models have by name.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Reload {
    /// Its name.
    pub robot: String,
    /// What it is now.
    #[serde(skip, default = "no_model")]
    pub model: Arc<RobotModel>,
    /// What it touches with now.
    #[serde(skip)]
    pub shapes: Arc<Shapes>,
}

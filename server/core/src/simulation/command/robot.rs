//! Commands that add robots, and that replace their models.

use std::sync::Arc;

use glamx::DPose3;
use serde::{Deserialize, Serialize};
use simd_model::RobotModel;
use simd_model::robot::{Collision, Geometry, Link};

use super::{CollisionPair, ContactSettings, JointOrientation};
use crate::collision::Shapes;
use crate::plain::pose3;
use crate::simulation::free_place::FreePlace;

/// Robot to add to the world.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Spawn {
    /// Name, unique in the world; `[A-Za-z0-9_-]+`.
    pub name: String,
    /// Whether to add `_1`, `_2`, ... if the name is taken, and not to refuse.
    pub allow_renaming: bool,
    /// Model of the robot.
    #[serde(skip, default = "no_model")]
    pub model: Arc<RobotModel>,
    /// Collision shapes; made from the model outside the physics thread.
    #[serde(skip)]
    pub shapes: Arc<Shapes>,
    /// Pose `world_from_root`.
    #[serde(with = "pose3")]
    pub pose: DPose3,
    /// Coordinates of `pose` that the world chooses. Robots that are spawned together are moved together, as
    /// the first one says.
    #[serde(default)]
    pub free_place: FreePlace,
    /// Whether its root link is fixed; `None` fixes a root link called `world`.
    pub fixed_base: Option<bool>,
    /// Whether its joints are not actuated; else they hold their position.
    pub passive: bool,
    /// Initial positions by joint name, rad or m. Others start at zero, or at the nearest limit if zero is
    /// beyond it.
    pub joint_positions: Vec<(String, f64)>,
    /// Initial orientations of spherical joints. Others start at 0 0 0 1.
    pub joint_orientations: Vec<JointOrientation>,
    /// Contact settings.
    pub contact_settings: ContactSettings,
    /// Enabled and disabled pairs of the robot's links.
    pub collision_pairs: Vec<CollisionPair>,
    /// Whether it stays at a reset of scope `spawned`.
    pub loaded_at_start: bool,
}

/// Returns a placeholder for a model that a recording has as files.
fn no_model() -> Arc<RobotModel> {
    Arc::new(RobotModel::default())
}

impl Spawn {
    /// Returns whether the root link of a robot cannot move, given the requested `fixed_base`. Without a
    /// request, a link called `world` is fixed, and one with a plane, which could not move and touch.
    pub fn is_base_fixed(model: &RobotModel, fixed_base: Option<bool>) -> bool {
        let is_plane = |collision: &Collision| matches!(collision.geometry, Geometry::Plane { .. });
        let is_fixed = |root: &Link| root.name == "world" || root.collisions.iter().any(is_plane);
        fixed_base.unwrap_or_else(|| model.links.first().is_some_and(is_fixed))
    }
}

/// New model for a robot in the world. It keeps its name, pose and base, and position, velocity and target of
/// every joint that both models have by name.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Reload {
    /// Name of the robot.
    pub robot: String,
    /// New model.
    #[serde(skip, default = "no_model")]
    pub model: Arc<RobotModel>,
    /// New collision shapes.
    #[serde(skip)]
    pub shapes: Arc<Shapes>,
}

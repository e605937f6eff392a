//! Contact settings of a robot, as a user requests them.

use serde::{Deserialize, Serialize};
use simd_model::robot::Material;

use crate::plain::bounded_list;

/// Contact settings of a robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactSettings {
    /// Whether links of the robot collide with each other, unless a joint connects them.
    pub self_collision: bool,
    /// It does not sleep, even if the world lets bodies sleep.
    pub stays_awake: bool,
    /// Surfaces of links, which replace those of the description. A file has at most [`MAX_LINK_PROPERTIES`].
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_LINK_PROPERTIES, _, _>")]
    pub links: Vec<LinkProperties>,
}

/// Maximum number of entries of [`ContactSettings::links`] that are read from a file for one robot. In memory
/// an entry takes up to twenty times its bytes in a file.
pub const MAX_LINK_PROPERTIES: usize = 65_536;

/// New settings of a link.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LinkProperties {
    /// Name of the link; empty means all links of the robot.
    pub link: String,
    /// Material of the link's colliders; `None` leaves a number unchanged.
    pub material: Material,
    /// Groups of the link, one bit each; `None` leaves them.
    pub collision_group: Option<u32>,
    /// Groups that it touches, one bit each; `None` leaves them.
    pub collision_mask: Option<u32>,
    /// Damping of the link's linear motion, 1/s: see [`LinkDamping`](crate::dynamics::link_damping::LinkDamping).
    /// `None` leaves it.
    pub linear_damping: Option<f64>,
    /// Damping of its angular motion, 1/s; `None` leaves it.
    pub angular_damping: Option<f64>,
}

/// Maximum number of pairs of one robot's own links, and of links of different robots in a world.
pub const MAX_COLLISION_PAIRS: usize = 65_536;

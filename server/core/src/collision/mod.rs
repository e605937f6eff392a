//! Collision shapes and contacts of robots. The types of rapier and parry do not leave this module.
//!
//! * [`Shapes`]: the shapes of a robot, made once, away from the physics thread.
//! * [`RobotColliders`]: the shapes of one robot in the world, and their poses.
//! * `clearance`: how far a robot can move before it touches anything.
//! * [`Collider`]: one of them as plain data for drawing.
//! * [`Filter`], [`Groups`]: collision filtering between two robots, and within one.
//! * [`BroadPhase`]: pairs of robots near each other.
//! * [`NarrowPhase`]: contacts of two robots' shapes; [`FixedPair`]: its cache for two that cannot be
//!   separated.
//! * [`scene`]: shapes at one moment, for queries: [`rays`] that hit them, [`distance`] between them,
//!   overlaps.
//!
//! Collision depends on dynamics (trees, and motion of bodies); dynamics does not depend on collision.
//!
//! Nothing here depends on previous steps: equal poses give equal contacts to the bit. A restored state
//! therefore continues as the original did.

mod bounds;
mod broad;
mod clearance;
mod clip;
mod coarse_pairs;
mod colliders;
mod convex_contact;
mod convex_mesh;
pub mod distance;
mod facet_contact;
mod facets;
mod feet;
mod field_cast;
pub mod filter;
mod first_touch;
mod fixed_pair;
mod geometry;
mod groups;
mod hull;
mod hull_support;
mod mesh;
mod mesh_facets;
mod narrow;
mod near_facets;
mod overlaps;
mod part;
mod plane;
mod proxy;
pub mod rays;
mod reduce;
pub mod scene;
mod seams;
mod separation;
mod shapes;
mod simplify;
mod still;
mod surface_contact;
mod surface_distance;
mod terrain;
#[cfg(test)]
mod tests;
mod triangle_pair;
mod triangle_tree;

pub use crate::dynamics::contact_point::{ContactPoint, Surface, SurfaceCombination};
pub use broad::BroadPhase;
pub use coarse_pairs::CoarsePair;
pub use colliders::{ColliderPose, RestPose, RobotColliders, Side};
pub use convex_mesh::ConvexMesh;
pub use facet_contact::MAX_PAIR_POINTS;
pub use feet::RobotFeet;
pub use filter::{Filter, LinkPair, MAX_OWN_PAIRS, RobotLinkPair};
pub use fixed_pair::FixedPair;
pub use geometry::{Collider, ColliderGeometry};
pub use groups::Groups;
pub use narrow::NarrowPhase;
pub use part::MeshShapes;
pub use proxy::{Proxy, ProxyShape};
pub use shapes::{MeshKey, Shapes};

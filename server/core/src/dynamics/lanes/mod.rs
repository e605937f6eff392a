//! Step of several copies of one robot at once, each copy in a lane of the processor's vectors.
//!
//! Each lane has the bits that [`Articulation::step`](super::Articulation::step) gives its copy. The
//! operations are the same, in the same order, and none of them is fused. A decision in one lane is a mask in
//! all of them. The result therefore does not depend on the number of lanes or on neighbouring copies. A copy
//! can leave the lanes and return at any step.
//!
//! From the bottom to the top; a file imports only from those above it in this list:
//!
//! * `joint`: joints in lanes. `free`: free roots in lanes.
//! * `clearance`: how far copies can move before they can touch anything.
//! * `robot`: [`LaneRobot`], the copies, and how a copy enters and leaves.
//! * `root`: motion of a free root.
//! * `passes`: kinematics, articulated inertias, accelerations. `drives`: actuators of joints. `rows`: limits
//!   and dry friction.
//! * `pose`: frames in the world. `feet`: parts of a robot that touch planes. `foot_points`: their contact
//!   points. `foot_rows`: their rows.
//! * `joint_rows`: limits and dry friction together with feet.
//! * `tree_cholesky`, `implicit_inertia`: the matrix of the inertia that impulses act on. `foot_newton`,
//!   `foot_refinement`, `foot_solver`: the impulses.
//! * `step`: the step. `crowd`: robots of one world, whose contacts the world finds.
//!
//! The one-robot step does what lanes do not do:
//!
//! * contacts other than those of feet and those that a world gives, and constraints between links;
//! * robots of a single free body, ball joints, joints that follow others, gravity compensation, wrenches;
//! * a first step from set velocities, and bodies that spin fast;
//! * a floating robot whose motion is disturbed, and states that are not finite after the step.

mod clearance;
mod crowd;
mod drives;
mod feet;
mod foot_newton;
mod foot_points;
mod foot_refinement;
mod foot_rows;
mod foot_solver;
mod free;
mod implicit_inertia;
mod joint;
mod joint_rows;
mod passes;
mod pose;
mod robot;
mod root;
mod rows;
mod step;
mod tree_cholesky;

use std::sync::Arc;

pub use clearance::Clearance;
pub use crowd::{Crowd, crowd};
pub use feet::{FootPair, Guard, MAX_FEET, can_be_foot};
use glamx::DVec3;
use pulp::{Simd, WithSimd};
pub use robot::{LaneRobot, fits_lanes};

use crate::dynamics::lane::vectorized;
use crate::dynamics::{Integrator, Tree};

/// Returns the bytes that a copy of a robot takes in its lane; 0 if the processor has no vectors for it.
pub fn bytes_of_copy(tree: &Arc<Tree>) -> usize {
    vectorized(usize::MAX, Bytes(tree)).unwrap_or(0)
}

/// See [`bytes_of_copy`].
struct Bytes<'a>(&'a Arc<Tree>);

impl WithSimd for Bytes<'_> {
    type Output = usize;

    fn with_simd<S: Simd>(self, simd: S) -> usize {
        let lanes = LaneRobot::new(simd, self.0, DVec3::ZERO, (1.0, 1), Integrator::Leapfrog);
        lanes.bytes() / S::F64_LANES
    }
}

//! The step of several copies of one robot at once, a copy a lane of the processor's vectors.
//!
//! Each lane has the bits that [`Articulation::step`](super::Articulation::step) gives its copy: the operations are the same, in
//! the same order, none of them is fused, and what is decided in one lane is a mask in all of them. So it does not matter how many
//! lanes there are, nor which copies are beside one, and a copy can leave the lanes and come back at any step.
//!
//! From the bottom to the top; a file imports only from those above it in this list:
//!
//! * [`vectorized`]: code for the vectors of the processor. `number`, `vectors`: arithmetic over lanes.
//! * `joint`: what lanes know of a joint. `free`: the same of a root that is free.
//! * `clearance`: how far copies can move before they can touch anything.
//! * `robot`: [`LaneRobot`], the copies; how a copy comes in and goes out.
//! * `root`: how a root that is free moves.
//! * `passes`: kinematics, articulated inertias, accelerations. `drives`: what joints are driven by. `rows`: limits and dry
//!   friction.
//! * `pose`: frames in the world. `feet`: what of a robot touches planes. `foot_points`: where. `foot_rows`: the rows of that.
//! * `joint_rows`: limits and dry friction beside feet.
//! * `tree_cholesky`, `implicit_inertia`: the matrix of what impulses work against. `foot_newton`, `foot_refinement`,
//!   `foot_solver`: the impulses.
//! * `step`: the step. `crowd`: robots of one world, whose contacts the world finds.
//! * `single_bodies`: sweeps over contacts of single bodies, in whose lanes are contacts and not copies.
//!
//! What lanes do not do, the one-robot step does: contact but that of feet and that which a world gives, constraints between links, robots of a single free
//! body, ball joints, joints that follow others, gravity compensation, wrenches; a first step from given velocities; bodies that spin
//! fast; a floating robot whose motion something disturbs; and what is not finite afterwards.

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
mod number;
mod passes;
mod pose;
mod robot;
mod root;
mod rows;
mod single_bodies;
mod step;
mod tree_cholesky;
mod vectorized;
mod vectors;

use std::sync::Arc;

pub use clearance::Clearance;
pub use crowd::{Crowd, crowd};
pub use feet::{FootPair, Guard, MOST_FEET, can_be_foot};
use glamx::DVec3;
use pulp::{Simd, WithSimd};
pub use robot::{LaneRobot, fits_lanes};
pub use single_bodies::SingleBodies;
pub use vectorized::vectorized;

use crate::dynamics::{Integrator, Tree};

/// Bytes that a copy of a robot takes in its lane; 0 where the processor has no vectors for it.
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

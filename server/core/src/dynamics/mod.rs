//! Articulated bodies: one file per idea, as Featherstone's "Rigid Body Dynamics
//! Algorithms" (2008) has them.
//!
//! * [`real`]: what mathematics is written over: a number, or one of each of several copies.
//! * [`spatial`], [`inertia`], [`symmetric`]: spatial vectors and inertias.
//! * [`tree`]: a robot as a tree of moving bodies; immutable.
//! * [`kinematics`], [`articulated`], [`integrate`]: the passes of a step; [`integrator`]: which velocities they act on.
//! * [`trigonometry`]: sines and cosines that have the same bits everywhere.
//! * [`spherical`]: ball joints.
//! * [`spin`], [`velocity_terms`]: what spins fast stays finite.
//! * [`actuator`], [`gains`], [`gravity_compensation`]: what drives a joint.
//! * [`mass_matrix`]: the joint-space mass matrix; [`implicit_inertia`]: the same with what actuators add, as a step needs it.
//! * [`link_motion`]: how links are accelerated; [`reactions`]: what joints carry.
//! * [`constraint`]: limits, dry friction, mimic, contact; [`contact_point`]: what collision finds for it.
//! * [`articulation`]: the state of one robot, and its step.
//! * [`configuration`]: where a robot is, apart from any world; [`jacobian`],
//!   [`inverse_dynamics`], [`inverse_kinematics`]: what follows from it.
//! * [`lanes`]: copies of one robot stepped, and contacts of single bodies swept, side by side.
//! * [`island`]: robots that touch, solved together; [`block_cholesky`]: their sparse matrix.

pub mod actuator;
mod arcs;
pub mod articulated;
pub mod articulation;
pub mod block_cholesky;
pub mod configuration;
pub mod constraint;
pub mod contact_point;
pub mod gains;
pub mod gravity_compensation;
pub mod implicit_inertia;
pub mod inertia;
pub mod integrate;
pub mod integrator;
pub mod inverse_dynamics;
pub mod inverse_kinematics;
pub mod island;
pub mod jacobian;
pub mod kinematics;
pub mod lanes;
pub mod ldlt;
pub mod link_motion;
pub mod mass_matrix;
pub mod reactions;
pub mod real;
pub mod scratch;
pub mod spatial;
pub mod spatials;
pub mod spherical;
pub mod spin;
pub mod symmetric;
pub mod tree;
pub mod trigonometry;
pub mod velocity_terms;

pub use actuator::{Actuator, Axis, Mode};
pub use articulation::{Articulation, BodyState, LARGEST_STATE};
pub use configuration::Configuration;
pub use integrator::Integrator;
pub use tree::Tree;

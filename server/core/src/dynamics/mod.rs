//! Articulated bodies: one file per idea, after Featherstone's "Rigid Body Dynamics Algorithms" (2008).
//!
//! * [`real`]: numeric types of the mathematics: a number, or one number of each of several copies.
//! * [`spatial`], [`inertia`], [`symmetric`]: spatial vectors and inertias.
//! * [`tree`]: a robot as a tree of moving bodies; immutable.
//! * [`kinematics`], [`articulated`], [`integrate`]: the passes of a step; [`integrator`]: the velocities
//!   that they act on.
//! * [`trigonometry`]: sines and cosines with the same bits everywhere.
//! * [`spherical`]: ball joints.
//! * [`spin`], [`velocity_terms`]: stability of fast spins.
//! * [`actuator`], [`gains`], [`gravity_compensation`]: actuators of joints.
//! * [`mass_matrix`]: the joint-space mass matrix; [`implicit_inertia`]: the same with the actuators' terms,
//!   as a step needs it.
//! * [`link_motion`]: accelerations of links; [`link_damping`]: forces against their motion; [`reactions`]: loads of
//!   joints.
//! * [`tendon`]: joints whose positions are sums of others.
//! * [`bullet`]: Bullet's laws of contacts, limits and speeds, for scripts that depend on them.
//! * [`constraint`]: limits, dry friction, mimic, contact; [`contact_point`]: the contacts that collision
//!   finds for it.
//! * [`articulation`]: the state of one robot, and its step.
//! * [`configuration`]: pose and motion of a robot apart from any world; [`jacobian`], [`inverse_dynamics`],
//!   [`inverse_kinematics`]: quantities derived from it.
//! * [`block_cholesky`], [`direct`]: the direct solver of robots that touch.
//! * [`lane`]: arithmetic over lanes; [`single_bodies`]: sweeps over contacts of single bodies in lanes.
//! * [`island`]: robots that touch, solved together; [`member`]: one of them.
//! * [`lanes`]: copies of one robot stepped side by side.

pub mod actuator;
mod arcs;
pub mod articulated;
pub mod articulation;
pub mod block_cholesky;
pub mod bullet;
pub mod configuration;
pub mod constraint;
pub mod contact_point;
pub mod direct;
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
pub mod lane;
pub mod lanes;
pub mod ldlt;
pub mod link_damping;
pub mod link_motion;
pub mod mass_matrix;
pub mod member;
pub mod reactions;
pub mod real;
pub mod scratch;
pub mod single_bodies;
pub mod spatial;
pub mod spatials;
pub mod spherical;
pub mod spin;
pub mod symmetric;
pub mod tendon;
pub mod tree;
pub mod trigonometry;
pub mod velocity_terms;

pub use actuator::{Actuator, Axis, Mode, Servo};
pub use articulation::{Articulation, BodyState};
pub use configuration::Configuration;
pub use integrator::Integrator;
pub use real::LARGEST_STATE;
pub use tree::Tree;

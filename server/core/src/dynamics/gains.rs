//! Default gains from each joint's composite inertia, so that any robot holds a pose without tuning.

use super::actuator::{Axis, DEFAULT_BANDWIDTH};
use super::inertia::Rigid;
use super::kinematics::placement;
use super::tree::{JointType, Tree};

/// Smallest composite inertia for gains, kg m^2 or kg: joints that carry nothing get gains too.
const LEAST: f64 = 1e-9;

/// Returns M_ii of each velocity at positions `q`, without armature: the diagonal of the composite-rigid-body
/// algorithm (Featherstone table 6.2). 0 for free bodies.
pub fn composite_inertia(tree: &Tree, q: &[f64]) -> Vec<f64> {
    let mut composite: Vec<Rigid> = tree.bodies.iter().map(|body| body.inertia).collect();
    let mut diagonal = vec![0.0; tree.velocity_count];
    for (i, body) in tree.bodies.iter().enumerate().rev() {
        match body.joint_type {
            JointType::Revolute | JointType::Spherical { .. } => {
                diagonal[body.velocity] = composite[i].moment.zz;
            }
            JointType::Prismatic => diagonal[body.velocity] = composite[i].mass,
            JointType::Free { .. } => {}
        }
        if let Some(parent) = body.parent {
            let at = placement(body, q);
            let lifted = composite[i].turned(&at.rotation).shifted(at.origin);
            composite[parent] += lifted;
        }
    }
    // A joint also moves its followers.
    for pair in &tree.mimics {
        let follower = diagonal[tree.bodies[pair.follower].velocity];
        diagonal[tree.bodies[pair.leader].velocity] += pair.multiplier * pair.multiplier * follower;
    }
    diagonal
}

/// Sets default gains for positions `q`: kp = w^2 M_ii, kd = 2 w M_ii. A tendon moves its joints at once:
/// 1 / M_ii is the sum of theirs, with the squares of their factors.
pub fn set_default_gains(tree: &Tree, q: &[f64], axes: &mut [Axis]) {
    for (axis, inertia) in axes.iter_mut().zip(composite_inertia(tree, q)) {
        let settings = &mut axis.settings;
        settings.composite_inertia = (inertia + settings.armature).max(LEAST);
        settings.default_stiffness = DEFAULT_BANDWIDTH * DEFAULT_BANDWIDTH * settings.composite_inertia;
        settings.default_damping = 2.0 * DEFAULT_BANDWIDTH * settings.composite_inertia;
    }
    for tendon in &tree.tendons {
        let mobility = |&(body, factor): &(usize, f64)| {
            factor * factor / axes[tree.bodies[body].velocity].settings.composite_inertia
        };
        let inertia = 1.0 / tendon.terms.iter().map(mobility).sum::<f64>();
        let settings = &mut axes[tree.bodies[tendon.body].velocity].settings;
        settings.composite_inertia = (inertia.min(f64::MAX) + settings.armature).max(LEAST);
        settings.default_stiffness = DEFAULT_BANDWIDTH * DEFAULT_BANDWIDTH * settings.composite_inertia;
        settings.default_damping = 2.0 * DEFAULT_BANDWIDTH * settings.composite_inertia;
    }
}

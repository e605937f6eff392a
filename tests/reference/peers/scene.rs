//! Scenes: copies of a robot, each holding a bent pose.

use std::collections::BTreeMap;
use std::sync::Arc;

use glamx::{DPose3, DVec3};
use serde::{Deserialize, Serialize};
use simd_core::dynamics::gains::composite_inertia;
use simd_core::dynamics::tree::JointType;
use simd_core::dynamics::{Tree, actuator};
use simd_model::RobotModel;
use simd_tests::robots;

/// A time step of every simulator, seconds.
pub(crate) const TIME_STEP: f64 = 1e-3;

/// A robot, its placement, and the number of copies.
#[derive(Deserialize)]
pub(crate) struct Scene {
    pub(crate) urdf: String,
    /// Its root link can move.
    pub(crate) free: bool,
    /// Robots in the world, with 3 m between them.
    pub(crate) copies: usize,
    /// Positions that joints hold instead of a bent one; zero for joints that it does not name.
    #[serde(default)]
    pose: Option<BTreeMap<String, f64>>,
    /// Set for a scene with contact.
    pub(crate) contact: Option<Contact>,
}

/// Additional data of a scene with contact.
#[derive(Deserialize)]
pub(crate) struct Contact {
    /// Height of the robot's root link above level ground, metres.
    pub(crate) height: f64,
    /// Friction between any two bodies.
    pub(crate) friction: f64,
    /// Seconds until it stands or lies still.
    pub(crate) settle: f64,
    /// True if bodies may end elsewhere than they start.
    pub(crate) heap: bool,
    pub(crate) things: Vec<Thing>,
}

/// A free body, or a fixed one without a mass.
#[derive(Deserialize)]
pub(crate) struct Thing {
    /// `box` or `sphere`.
    pub(crate) shape: String,
    /// Edges of a box, or the radius of a sphere, metres.
    pub(crate) size: Vec<f64>,
    /// Its centre, world.
    pub(crate) at: [f64; 3],
    /// kg.
    pub(crate) mass: f64,
}

/// Position and gains of a joint of one axis.
#[derive(Clone, Serialize)]
pub(crate) struct Held {
    pub(crate) name: String,
    /// Initial and held position, rad or m.
    pub(crate) position: f64,
    /// simd's default gains: N m/rad or N/m; N m s/rad or N s/m. `None` if it follows another joint.
    pub(crate) gains: Option<(f64, f64)>,
    /// The most effort that it may apply, N m or N.
    pub(crate) effort: Option<f64>,
}

/// Positions at which joints are held, as parts of their range: bent, and away from every limit.
const BENT: [f64; 5] = [0.6, 0.4, 0.55, 0.35, 0.65];
/// Limits of a joint without limits, rad.
const UNLIMITED: (f64, f64) = (-3.0, 3.0);

impl Scene {
    pub(crate) fn model(&self) -> Arc<RobotModel> {
        robots::read(&self.urdf).0
    }

    /// Returns the pose of the root link of a copy.
    pub(crate) fn root_pose(copy: usize) -> DPose3 {
        DPose3::from_translation(DVec3::new(3.0 * (copy % 10) as f64, 3.0 * (copy / 10) as f64, 0.0))
    }

    /// Returns the held positions of the movable joints, in the order of the tree's bodies.
    pub(crate) fn joints(&self) -> Vec<Held> {
        let model = self.model();
        let tree = Tree::new(&model, !self.free);
        let moving: Vec<_> = tree.bodies.iter().filter_map(|body| Some((body, body.joint?))).collect();
        let mut q = vec![0.0; tree.position_count];
        let mut held = Vec::new();
        for (index, &(body, joint)) in moving.iter().enumerate() {
            let joint = &model.joints[joint];
            let (lower, upper) = joint.limits.lower.zip(joint.limits.upper).unwrap_or(UNLIMITED);
            q[body.position] = match &self.pose {
                Some(pose) => pose.get(&joint.name).copied().unwrap_or(0.0),
                None => lower + (upper - lower) * BENT[index % BENT.len()],
            };
        }
        for pair in &tree.mimics {
            let (follower, leader) = (&tree.bodies[pair.follower], &tree.bodies[pair.leader]);
            q[follower.position] = pair.multiplier * q[leader.position] + pair.offset;
        }
        if let Some(JointType::Free { .. }) = tree.bodies.first().map(|body| body.joint_type) {
            q[6] = 1.0;
        }
        let inertia = composite_inertia(&tree, &q);
        for (body, joint) in moving {
            let joint = &model.joints[joint];
            let resistance = inertia[body.velocity] * actuator::DEFAULT_BANDWIDTH;
            let gains = (resistance * actuator::DEFAULT_BANDWIDTH, 2.0 * resistance);
            held.push(Held {
                name: joint.name.clone(),
                position: q[body.position],
                gains: joint.mimic.is_none().then_some(gains),
                effort: joint.limits.effort,
            });
        }
        held
    }
}

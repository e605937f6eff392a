//! Robots built in code: chains of rods on revolute or prismatic joints.

use glamx::{DMat3, DPose3, DVec3};
use simd_model::RobotModel;
use simd_model::robot::{Inertial, Joint, JointKind, JointLimits, Link};

/// Returns a rod of 1 kg and `length` along x from its joint: moment m l^2 / 12 about its middle.
pub(crate) fn rod(length: f64) -> Inertial {
    let moment = length * length / 12.0;
    Inertial {
        mass: 1.0,
        center_of_mass: DVec3::new(length / 2.0, 0.0, 0.0),
        inertia: DMat3::from_diagonal(DVec3::new(1e-4, moment, moment)),
    }
}

/// Rods of one metre, each on the tip of the previous one, turning about y; joints "joint-1", "joint-2", ...
pub(crate) fn chain(count: usize) -> RobotModel {
    let link = |i: usize| Link {
        name: format!("link-{i}"),
        inertial: if i == 0 { Inertial::ZERO } else { rod(1.0) },
        visuals: Vec::new(),
        collisions: Vec::new(),
    };
    let joint = |i: usize| Joint {
        name: format!("joint-{i}"),
        kind: JointKind::Continuous,
        parent: i - 1,
        child: i,
        parent_from_joint: DPose3::from_translation(DVec3::new(if i == 1 { 0.0 } else { 1.0 }, 0.0, 0.0)),
        axis: DVec3::Y,
        limits: JointLimits::default(),
        damping: 0.0,
        friction: 0.0,
        mimic: None,
    };
    RobotModel {
        name: "chain".into(),
        links: (0..=count).map(link).collect(),
        joints: (1..=count).map(joint).collect(),
        ..RobotModel::default()
    }
}

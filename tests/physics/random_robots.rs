//! Robots and commands that no person would write, from a seed.

use fastrand::Rng;
use glamx::{DMat3, DPose3, DQuat, DVec3};
use simd_core::Command;
use simd_core::simulation::command::*;
use simd_model::RobotModel;
use simd_model::robot::{Inertial, Joint, JointKind, JointLimits, Link, Mimic};

/// Returns a number of either sign, its size evenly spread over decades.
fn wild(rng: &mut Rng, least: f64, most: f64) -> f64 {
    let size = (least.ln() + rng.f64() * (most / least).ln()).exp();
    if rng.bool() { size } else { -size }
}

fn vector(rng: &mut Rng, size: f64) -> DVec3 {
    DVec3::new(rng.f64() - 0.5, rng.f64() - 0.5, rng.f64() - 0.5) * 2.0 * size
}

fn rotation(rng: &mut Rng) -> DQuat {
    DQuat::from_scaled_axis(vector(rng, 3.0))
}

/// Returns a tree of 2 to 40 links with joints of all kinds. Some links are massless, some a thousand times
/// as heavy as others.
pub(crate) fn robot(rng: &mut Rng) -> RobotModel {
    let count = rng.usize(2..=40);
    let kinds = [
        JointKind::Revolute,
        JointKind::Revolute,
        JointKind::Continuous,
        JointKind::Prismatic,
        JointKind::Fixed,
        JointKind::Floating,
        JointKind::Planar,
        JointKind::Spherical,
    ];
    let mut model = RobotModel {
        name: "random".into(),
        links: vec![link(rng, 0)],
        joints: Vec::new(),
        ..RobotModel::default()
    };
    for child in 1..count {
        let kind = kinds[rng.usize(0..kinds.len())];
        // Mostly chains, sometimes a branch. The order of the model is depth-first, so a branch can only
        // start from a link on the path to the last one.
        let mut parent = child - 1;
        while parent > 0 && rng.u8(0..4) == 0 {
            parent = model.joints[parent - 1].parent;
        }
        let (lower, upper) = (-rng.f64() * 2.0, rng.f64() * 2.0);
        let limited = rng.bool();
        let optional = |rng: &mut Rng, least, most| rng.bool().then(|| wild(rng, least, most).abs());
        model.links.push(link(rng, child));
        model.joints.push(Joint {
            name: format!("joint-{child}"),
            kind,
            parent,
            child,
            parent_from_joint: DPose3::from_parts(vector(rng, 0.5), rotation(rng)),
            axis: vector(rng, 1.0).try_normalize().unwrap_or(DVec3::Z),
            limits: JointLimits {
                lower: limited.then_some(lower),
                upper: limited.then_some(upper),
                effort: optional(rng, 1e-2, 1e3),
                velocity: optional(rng, 1e-1, 1e2),
            },
            damping: optional(rng, 1e-3, 1e2).unwrap_or(0.0),
            friction: optional(rng, 1e-3, 1e1).unwrap_or(0.0),
            mimic: None,
        });
    }
    let single = |joint: &Joint| {
        matches!(joint.kind, JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic)
    };
    let singles: Vec<usize> = (0..model.joints.len()).filter(|&i| single(&model.joints[i])).collect();
    if let [leader, .., follower] = singles[..] {
        let mimic = Mimic { joint: leader, multiplier: wild(rng, 0.1, 3.0), offset: 0.1 };
        model.joints[follower].mimic = rng.bool().then_some(mimic);
    }
    model
}

fn link(rng: &mut Rng, index: usize) -> Link {
    let inertial = if rng.u8(0..5) == 0 {
        Inertial::ZERO
    } else {
        let mass = wild(rng, 1e-2, 1e1).abs();
        // The moments of a solid box keep the triangle rule.
        let size = DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 0.4 + 0.02;
        let squares = size * size;
        let moments = DVec3::new(squares.y + squares.z, squares.z + squares.x, squares.x + squares.y);
        let turn = DMat3::from_quat(rotation(rng));
        let inertia = turn * DMat3::from_diagonal(moments * (mass / 12.0)) * turn.transpose();
        Inertial { mass, center_of_mass: vector(rng, 0.3), inertia }
    };
    Link { name: format!("link-{index}"), inertial, visuals: Vec::new(), collisions: Vec::new() }
}

/// Returns a robot with all of its joints driven or not, at a random place, fixed or free.
pub(crate) fn spawn(rng: &mut Rng, name: &str) -> Spawn {
    Spawn {
        name: name.into(),
        allow_renaming: false,
        model: robot(rng).into(),
        pose: DPose3::from_parts(vector(rng, 2.0), rotation(rng)),
        fixed_base: Some(rng.bool()),
        passive: rng.bool(),
        joint_positions: Vec::new(),
        joint_orientations: Vec::new(),
        shapes: Default::default(),
        contact_settings: Default::default(),
        collision_pairs: Vec::new(),
        free_place: Default::default(),
        loaded_at_start: false,
    }
}

/// Returns a command, often one that is refused.
pub(crate) fn command(rng: &mut Rng, robot: &str, model: &RobotModel) -> Command {
    let joint = format!("joint-{}", rng.usize(1..=model.links.len()));
    let value = match rng.u8(0..12) {
        0 => f64::NAN,
        1 => f64::INFINITY,
        _ => wild(rng, 1e-3, 1e2),
    };
    let robot = if rng.u8(0..12) == 0 { "missing" } else { robot }.to_owned();
    let gain = |rng: &mut Rng| rng.bool().then(|| wild(rng, 1e-2, 1e6).abs());
    let target = match rng.u8(0..9) {
        0 => Target::Position {
            position: value,
            velocity: 0.0,
            stiffness: gain(rng),
            damping: gain(rng),
            feed_forward: 0.0,
            max_effort: gain(rng),
            max_velocity: gain(rng),
        },
        1 => {
            Target::Velocity { velocity: value, damping: gain(rng), feed_forward: 0.0, max_effort: gain(rng) }
        }
        2 => Target::Effort(value),
        3 => Target::Passive,
        4 => Target::Orientation {
            orientation: rotation(rng) * if value > 50.0 { 2.0 } else { 1.0 },
            velocity: DVec3::ZERO,
            stiffness: gain(rng),
            damping: gain(rng),
            feed_forward: vector(rng, 1.0),
            max_effort: gain(rng),
            max_velocity: gain(rng),
        },
        5 => Target::AngularVelocity {
            velocity: vector(rng, 1.0) * value,
            damping: gain(rng),
            feed_forward: DVec3::ZERO,
            max_effort: gain(rng),
        },
        6 => Target::Torque(vector(rng, 1.0) * value),
        7 => Target::Servo {
            position: value,
            rate: wild(rng, 1e-2, 1e3),
            velocity: wild(rng, 1e-3, 1e2),
            slip: rng.f64() * 2.2 - 1.1,
            damping: gain(rng),
            feed_forward: 0.0,
            max_effort: gain(rng),
            max_velocity: gain(rng),
        },
        _ => Target::Hold,
    };
    let spherical = rng
        .bool()
        .then(|| SphericalReset { orientation: rotation(rng), angular_velocity: vector(rng, 1.0) * value });
    match rng.u8(0..8) {
        0 => Command::ResetJoints {
            robots: vec![RobotReset {
                robot,
                joints: vec![JointReset {
                    joint,
                    axis: rng.u32(0..3),
                    position: value,
                    velocity: value,
                    spherical,
                }],
            }],
        },
        1 => Command::ApplyWrench(LinkWrench {
            robot,
            link: format!("link-{}", rng.usize(0..=model.links.len())),
            force: vector(rng, 10.0) * value,
            torque: vector(rng, 1.0),
            in_link_axes: rng.bool(),
            point: vector(rng, 0.1),
            duration: [WrenchDuration::NextStep, WrenchDuration::For(0.02), WrenchDuration::UntilCleared]
                [rng.usize(..3)],
        }),
        2 => Command::SetJointProperties {
            robot,
            joints: vec![JointProperties {
                joint,
                damping: rng.bool().then_some(value),
                friction: rng.bool().then_some(value.abs()),
                armature: rng.bool().then_some(value.abs()),
                ..JointProperties::default()
            }],
        },
        _ => Command::SetTargets(SetTargets {
            robots: vec![RobotTargets {
                robot,
                joints: vec![JointTarget { joint, axis: rng.u32(0..2), target }],
                ..RobotTargets::default()
            }],
            refuse_beyond_limits: rng.bool(),
            source: None,
        }),
    }
}

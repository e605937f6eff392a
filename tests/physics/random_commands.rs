//! Commands of any kind for a given world.

use fastrand::Rng;
use glamx::DVec3;
use simd_core::simulation::command::*;
use simd_core::{BulletContacts, Command, Integrator, Simulation, SurfaceCombination};
use simd_model::robot::{JointLimits, Material};
use simd_tests::scenes::*;

use crate::saved_state_files::at;

/// Returns a possible request of a client. A refused one is refused in both worlds.
pub(crate) fn random_command(rng: &mut Rng, world: &Simulation) -> Command {
    let seen = look(world);
    let entity = &seen.world.entities[rng.usize(..seen.world.entities.len())];
    let (robot, model) = (entity.name.clone(), &entity.model);
    let joint = rng.choice(&model.joints).map_or("none".into(), |joint| joint.name.clone());
    let link = rng.choice(&model.links).map_or("none".into(), |link| link.name.clone());
    let number = 2.0 * rng.f64() - 1.0;
    match rng.u8(0..12) {
        0 | 1 => {
            let target = match rng.u8(0..5) {
                0 => Target::velocity(number),
                1 => Target::Effort(number),
                2 => Target::Hold,
                3 => Target::Position {
                    position: number,
                    velocity: 0.1,
                    stiffness: Some(50.0),
                    damping: None,
                    feed_forward: 0.1,
                    max_effort: Some(0.5),
                    max_velocity: Some(0.3),
                },
                _ => Target::position(number),
            };
            let joints = vec![JointTarget { joint, axis: 0, target }];
            let robots = vec![RobotTargets { robot, joints, ..Default::default() }];
            Command::SetTargets(SetTargets { robots, ..Default::default() })
        }
        2 => {
            let properties = JointProperties {
                joint,
                damping: Some(0.1 + number.abs()),
                friction: Some(number.abs()),
                armature: Some(0.01),
                limits: rng.bool().then_some(JointLimits {
                    lower: Some(-1.0),
                    upper: None,
                    effort: Some(3.0),
                    velocity: Some(1.0),
                }),
                default_gains: None,
                gravity_compensation: None,
                profile: None,
                spring: None,
            };
            Command::SetJointProperties { robot, joints: vec![properties] }
        }
        3 => {
            let rolling_friction = rng.bool().then(|| 0.01 * number.abs());
            let spinning_friction = rng.bool().then(|| 0.01 * number.abs());
            let material = Material {
                friction: Some(number.abs()),
                restitution: None,
                rolling_friction,
                spinning_friction,
                contact_stiffness: rng.bool().then(|| 1e4 + 1e3 * number.abs()),
                contact_damping: rng.bool().then(|| 100.0 * number.abs()),
            };
            let collision_mask = rng.bool().then(|| rng.u32(..));
            let linear_damping = rng.bool().then(|| number.abs());
            let angular_damping = rng.bool().then(|| number.abs());
            let properties = LinkProperties {
                link,
                material,
                collision_mask,
                linear_damping,
                angular_damping,
                ..Default::default()
            };
            let stays_awake = [None, Some(true), Some(false)][rng.usize(..3)];
            Command::SetLinkProperties { robot, links: vec![properties], stays_awake }
        }
        9 => {
            let other = &seen.world.entities[rng.usize(..seen.world.entities.len())];
            let other_link = rng.choice(&other.model.links).map_or("none".into(), |link| link.name.clone());
            let enabled = [None, Some(false), Some(true)][rng.usize(0..3)];
            let pair = CollisionPair { link, other_robot: other.name.clone(), other_link, enabled };
            let self_collision = (rng.u8(0..3) == 0).then(|| rng.bool());
            Command::SetCollisionFilter(CollisionFilterChange { robot, self_collision, pairs: vec![pair] })
        }
        4 => Command::ApplyWrench(LinkWrench {
            robot,
            link,
            force: DVec3::new(number, -0.0, 5.0 * number),
            torque: DVec3::ZERO,
            in_link_axes: rng.bool(),
            point: DVec3::splat(0.01),
            duration: [
                WrenchDuration::NextStep,
                WrenchDuration::For(0.05 * rng.f64()),
                WrenchDuration::UntilCleared,
            ][rng.usize(0..3)],
        }),
        11 => Command::PullLink(LinkPull { robot, link, target: Some(DVec3::X), ..Default::default() }),
        5 => Command::SetPhysics(PhysicsChange {
            gravity: Some(DVec3::new(-0.0, 0.3 * number, -9.81)),
            time_step: rng.bool().then_some(5e-4 + 1e-3 * number.abs()),
            substeps: Some(rng.u32(1..3)),
            integrator: rng
                .choice([
                    None,
                    Some(Integrator::Leapfrog),
                    Some(Integrator::Euler),
                    Some(Integrator::Bullet(BulletContacts::default())),
                ])
                .flatten(),
            surface_combination: rng
                .choice([None, Some(SurfaceCombination::Multiply), Some(SurfaceCombination::Max)])
                .flatten(),
            sleeping: rng.choice([None, Some(false), Some(true)]).flatten(),
        }),
        6 => Command::ResetJoints { robots: vec![RobotReset { robot, joints: Vec::new() }] },
        7 => {
            let pose = DVec3::new(number, number, 0.5);
            Command::SetEntityState { robot, pose: Some(at(pose)), twist: None }
        }
        _ => Command::Reset(ResetScope {
            state: rng.u8(0..4) == 0,
            ..ResetScope { time: true, ..Default::default() }
        }),
    }
}

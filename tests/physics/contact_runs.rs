//! Runs with contacts: energy, sleep, and collision filters.

use std::sync::Arc;

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::command::*;
use simd_core::{Command, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Geometry, Joint, JointKind, JointLimits};
use simd_tests::scenes::*;

/// Balls, boxes, cylinders, capsules and a driven arm fall into a box.
pub(crate) fn jumble(rng: &mut Rng) -> Simulation {
    let mut world = world(1e-3);
    spawn(&mut world, robot("box", &container(DVec3::new(1.0, 1.0, 2.0)), DPose3::IDENTITY, true));
    for i in 0..14 {
        let size = 0.05 + 0.05 * rng.f64();
        let model = match i % 4 {
            0 => ball(size, 0.5),
            1 => cuboid(DVec3::new(size, 1.5 * size, 2.0 * size), 0.5),
            2 => {
                let geometry = Geometry::Cylinder { radius: size, length: 2.0 * size };
                solid(&[(DPose3::IDENTITY, geometry)], 0.5)
            }
            _ => {
                let geometry = Geometry::Capsule { radius: 0.5 * size, length: 2.0 * size };
                solid(&[(DPose3::IDENTITY, geometry)], 0.5)
            }
        };
        let at = DVec3::new(0.6 * rng.f64() - 0.3, 0.6 * rng.f64() - 0.3, 0.2 + 0.15 * f64::from(i));
        let turn = DQuat::from_scaled_axis(DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 3.0);
        spawn(&mut world, robot(&format!("body-{i}"), &model, DPose3::from_parts(at, turn), false));
    }
    spawn(&mut world, Spawn { passive: false, ..robot("arm", &arm(), DPose3::IDENTITY, true) });
    let target = Target::velocity(2.0);
    let joints = vec![JointTarget { joint: "turn".into(), axis: 0, target }];
    let robots = vec![RobotTargets { robot: "arm".into(), joints, ..Default::default() }];
    apply(&mut world, Command::SetTargets(SetTargets { robots, ..Default::default() }));
    world
}

/// Returns a rod that turns about z just above the ground.
fn arm() -> Arc<RobotModel> {
    let mut model = (*solid(&[], 1.0)).clone();
    let size = DVec3::new(0.4, 0.04, 0.04);
    let at = DPose3::from_translation(DVec3::new(0.3, 0.0, 0.05));
    let rod = solid(&[(at, Geometry::Box { size })], 1.0);
    model.links.push(rod.links[0].clone());
    model.links[0].name = "base".into();
    model.joints.push(Joint {
        name: "turn".into(),
        kind: JointKind::Continuous,
        parent: 0,
        child: 1,
        parent_from_joint: DPose3::IDENTITY,
        axis: DVec3::Z,
        limits: JointLimits { effort: Some(5.0), ..JointLimits::default() },
        damping: 0.0,
        friction: 0.1,
        mimic: None,
    });
    Arc::new(model)
}

/// Deleted robots leave no trace in the motion of the others.
#[test]
fn robots_that_are_gone_leave_no_trace() {
    let poses = |world: &Simulation| {
        let seen = look(world);
        let bits = |root: &simd_core::simulation::published_state::RootState| {
            root.pose.translation.to_array().map(f64::to_bits)
        };
        let named = seen
            .world
            .entities
            .iter()
            .zip(&seen.roots)
            .map(|(entity, root)| (entity.name.clone(), bits(root)));
        named.filter(|(name, _)| !name.starts_with("gone")).collect::<Vec<_>>()
    };
    let scene = |world: &mut Simulation| {
        spawn(world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
        for i in 0..4 {
            let at = DPose3::from_translation(DVec3::new(0.02 * f64::from(i), 0.0, 0.2 + 0.3 * f64::from(i)));
            spawn(world, robot(&format!("box-{i}"), &cuboid(DVec3::splat(0.2), 1.0), at, false));
        }
    };
    let mut plain = world(1e-3);
    scene(&mut plain);
    let mut other = world(1e-3);
    for name in ["gone-1", "gone-2"] {
        let at = DPose3::from_translation(DVec3::Z);
        spawn(&mut other, robot(name, &ball(0.2, 1.0), at, false));
    }
    apply(&mut other, Command::Delete { robot: "gone-1".into() });
    scene(&mut other);
    apply(&mut other, Command::Delete { robot: "gone-2".into() });
    for _ in 0..2_000 {
        plain.step();
        other.step();
    }
    assert_eq!(poses(&plain), poses(&other));
}

/// Nothing drives it, so its energy never rises over the whole run. In one step it rises by at most the lift
/// of a hit one step above the ground.
#[test]
fn contacts_make_no_energy_from_nothing() {
    for seed in 0..6 {
        let rng = &mut Rng::with_seed(seed);
        let mut world = jumble(rng);
        apply(&mut world, Command::Delete { robot: "arm".into() });
        let energy = |world: &Simulation| -> f64 {
            let seen = look(world);
            let of = |(root, entity): (
                &simd_core::simulation::published_state::RootState,
                &Arc<simd_core::simulation::published_state::EntityLayout>,
            )| {
                if entity.fixed_base {
                    return 0.0;
                }
                let inertial = &entity.model.links[0].inertial;
                let own = root.pose.rotation.inverse() * root.angular;
                inertial.mass * (0.5 * root.linear.length_squared() + 9.81 * root.pose.translation.z)
                    + 0.5 * own.dot(inertial.inertia * own)
            };
            seen.roots.iter().zip(&seen.world.entities).map(of).sum()
        };
        let start = energy(&world);
        let mut least = start;
        for step in 0..3_000 {
            world.step();
            let now = energy(&world);
            assert!(now < least + 2e-3 * start, "seed {seed}, step {step}: {least} became {now}");
            least = least.min(now);
        }
        assert!(least < 0.5 * start, "{start} {least}");
    }
}

/// Links with the deepest possible overlap separate at the documented speed, and are at rest afterwards: the
/// correction of overlaps adds no speed.
#[test]
fn overlapping_bodies_separate_without_flying_off() {
    let mut world = world(1e-3);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    let at = DPose3::from_translation(DVec3::Z * 0.02);
    spawn(&mut world, robot("box", &cuboid(DVec3::splat(0.2), 1.0), at, false));
    let mut highest = 0.0f64;
    for _ in 0..1_000 {
        world.step();
        highest = highest.max(look(&world).roots[1].pose.translation.z);
    }
    assert!((0.0999..0.1005).contains(&highest), "{highest}");
}

fn box_at_rest() -> Simulation {
    let mut world = world(1e-3);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    let board = DPose3::from_translation(DVec3::Z * 0.05);
    spawn(&mut world, robot("board", &cuboid(DVec3::new(1.0, 1.0, 0.1), 1.0), board, true));
    for i in 0..2 {
        let at = DPose3::from_translation(DVec3::Z * (0.2 + 0.2 * f64::from(i)));
        spawn(&mut world, robot(&format!("box-{i}"), &cuboid(DVec3::splat(0.2), 1.0), at, false));
    }
    (0..3_000).for_each(|_| world.step());
    let seen = look(&world);
    assert!(seen.roots.iter().all(|root| root.linear == DVec3::ZERO), "they sleep");
    world
}

/// Each way to wake a sleeping body: the box below or above moves.
#[test]
fn sleeping_bodies_wake_when_something_changes() {
    let moved = |world: &mut Simulation, what: &str| {
        (0..300).for_each(|_| world.step());
        let z = look(world).roots.iter().last().map(|root| root.pose.translation).unwrap();
        assert!(z.distance(DVec3::Z * 0.4) > 0.01, "{what}: {z}");
    };
    let mut world = box_at_rest();
    apply(&mut world, Command::Delete { robot: "board".into() });
    moved(&mut world, "the board is gone");

    let mut world = box_at_rest();
    apply(&mut world, Command::Delete { robot: "box-0".into() });
    moved(&mut world, "the box below is gone");

    let mut world = box_at_rest();
    throw(&mut world, "box-0", DVec3::X * 2.0, DVec3::ZERO);
    moved(&mut world, "the box below is thrown");

    let mut world = box_at_rest();
    let gravity = Some(DVec3::Z * 5.0);
    apply(&mut world, Command::SetPhysics(PhysicsChange { gravity, ..Default::default() }));
    moved(&mut world, "gravity is turned");

    let mut world = box_at_rest();
    let push = LinkWrench {
        robot: "box-1".into(),
        link: "body".into(),
        force: DVec3::X * 30.0,
        torque: DVec3::ZERO,
        in_link_axes: false,
        point: DVec3::ZERO,
        duration: WrenchDuration::UntilCleared,
    };
    apply(&mut world, Command::ApplyWrench(push));
    moved(&mut world, "a wrench");

    let mut world = box_at_rest();
    let pose = Some(DPose3::from_translation(DVec3::Z * 0.15));
    apply(&mut world, Command::SetEntityState { robot: "board".into(), pose, twist: None });
    moved(&mut world, "the board is lifted");
    // Last, since the robot that is looked at must be the last one.
    let mut world = box_at_rest();
    let at = DPose3::from_translation(DVec3::new(-1.0, 0.0, 0.4));
    spawn(&mut world, robot("ball", &ball(0.1, 5.0), at, false));
    throw(&mut world, "ball", DVec3::X * 8.0, DVec3::ZERO);
    (0..300).for_each(|_| world.step());
    let hit = look(&world).roots[3].pose.translation;
    assert!(hit.x > 0.05, "a ball hits it: {hit}");
}

/// A sleeping body still reports its contacts and their forces.
#[test]
fn sleeping_bodies_still_report_their_contacts() {
    let world = box_at_rest();
    let below = contacts(&world, Some("box-1"));
    let force: f64 = below.iter().map(|contact| contact.normal_force).sum();
    assert_eq!(below.len(), 4);
    assert!((force - 9.81).abs() < 1e-2, "{force}");
}

/// Two rods on one base turn into each other: no joint connects them, and they collide if self-collision is
/// on. Each overlaps the base, its neighbour, and never collides with it.
#[test]
fn links_of_one_robot_touch_where_asked_and_neighbours_never() {
    let mut model = (*arm()).clone();
    model.links[0] = cuboid(DVec3::splat(0.2), 1.0).links[0].clone();
    let (second, joint) = (model.links[1].clone(), model.joints[0].clone());
    model.links.push(second);
    model.joints.push(Joint { name: "other".into(), child: 2, ..joint });
    let model = Arc::new(model);
    for self_collision in [false, true] {
        let mut world = world(1e-3);
        let asked = Spawn {
            joint_positions: vec![("turn".into(), 0.0), ("other".into(), 2.0)],
            contact_settings: ContactSettings { self_collision, ..ContactSettings::default() },
            ..robot("robot", &model, DPose3::IDENTITY, true)
        };
        spawn(&mut world, asked);
        let target = Target::Effort(1.0);
        let joints = vec![JointTarget { joint: "turn".into(), axis: 0, target }];
        let robots = vec![RobotTargets { robot: "robot".into(), joints, ..Default::default() }];
        apply(&mut world, Command::SetTargets(SetTargets { robots, ..Default::default() }));
        world.step();
        assert!(contacts(&world, None).is_empty());
        (0..2_000).for_each(|_| world.step());
        let seen = look(&world).positions;
        let passed = seen[0] > seen[1] + 0.2;
        assert_eq!(passed, !self_collision, "{seen:?}");
        if self_collision {
            assert!(seen[1] > 2.1, "the second rod is pushed along: {seen:?}");
        }
    }
}

#[test]
fn a_ray_hits_the_nearest_link_and_says_where() {
    let world = box_at_rest();
    let rays = vec![
        [DVec3::Z * 2.0, DVec3::ZERO],
        [DVec3::new(5.0, 0.0, 1.0), DVec3::new(5.0, 0.0, -1.0)],
        [DVec3::new(5.0, 0.0, 1.0), DVec3::new(5.0, 0.0, 0.5)],
    ];
    let hits = look(&world).cast_rays(&rays, None, &|| false).unwrap();
    let top = hits[0].as_ref().unwrap();
    assert_eq!((top.robot.as_str(), top.link.as_str()), ("box-1", "body"));
    assert!((top.point.z - 0.5).abs() < 1e-3 && (top.fraction - 0.75).abs() < 1e-3, "{top:?}");
    assert!(top.normal.distance(DVec3::Z) < 1e-3, "{top:?}");
    let ground = hits[1].as_ref().unwrap();
    assert_eq!(ground.robot, "ground");
    assert!((ground.fraction - 0.5).abs() < 1e-12, "{ground:?}");
    assert_eq!(hits[2], None);
    let many = vec![[DVec3::ZERO, DVec3::X]; 20_001];
    let refused = look(&world).cast_rays(&many, None, &|| false).unwrap_err().to_string();
    assert_eq!(refused, "the number of rays of one query would be 20001, and the limit is 20000");
}

/// The more slippery surface decides the friction, which can be changed while the box lies.
#[test]
fn a_box_slides_when_its_link_becomes_slippery() {
    let tilt = DQuat::from_rotation_y(0.2);
    let mut world = world(1e-3);
    spawn(&mut world, robot("slope", &plane(DVec3::Z), DPose3::from_rotation(tilt), true));
    let pose = DPose3::from_parts(tilt * DVec3::Z * 0.1, tilt);
    spawn(&mut world, robot("box", &cuboid(DVec3::splat(0.2), 1.0), pose, false));
    (0..2_000).for_each(|_| world.step());
    assert!(look(&world).roots[1].pose.translation.x < 0.03);
    let links = surface(0.05, 0.0).links;
    apply(&mut world, Command::SetLinkProperties { robot: "box".into(), links, stays_awake: None });
    (0..1_000).for_each(|_| world.step());
    let expected = 9.81 * (0.2f64.sin() - 0.05 * 0.2f64.cos());
    let velocity = look(&world).roots[1].linear.length();
    assert!((velocity / expected - 1.0).abs() < 2e-3, "{velocity} {expected}");
    let wrong = surface(-1.0, 0.0).links;
    let refused =
        world.apply(&Command::SetLinkProperties { robot: "box".into(), links: wrong, stays_awake: None });
    assert_eq!(
        refused.unwrap_err().to_string(),
        "links[0].friction (all links) is -1; it must be between 0 and 1000000"
    );
}

/// A plane can only be part of a fixed body.
#[test]
fn a_plane_that_could_move_touches_nothing() {
    let mut world = world(1e-3);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, false));
    assert_eq!(world.collider_count(), 0);
}

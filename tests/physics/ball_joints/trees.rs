//! Trees with ball joints in worlds: conserved quantities, contacts, constraints, saved states, many steps.

use fastrand::Rng;
use simd_core::collision::Shapes;
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::*;
use simd_core::{Command, PhysicsSettings, PublishedState, Simulation};
use simd_model::robot::{Collision, Geometry, Material};

use super::*;
use simd_tests::world::{apply, look, passive};

fn any(rng: &mut Rng, size: f64) -> DVec3 {
    DVec3::new(rng.f64() - 0.5, rng.f64() - 0.5, rng.f64() - 0.5) * 2.0 * size
}

/// Returns a tree of links with inertia, three quarters of them on ball joints.
pub(super) fn tree(rng: &mut Rng, links: usize) -> RobotModel {
    let link = |rng: &mut Rng, name: String| {
        let spread = DVec3::new(rng.f64() + 0.2, rng.f64() + 0.2, rng.f64() + 0.2) * 0.02;
        let moments = DVec3::new(spread.y + spread.z, spread.x + spread.z, spread.x + spread.y);
        let axes = DMat3::from_quat(turn(any(rng, 3.0)));
        let inertial = Inertial {
            mass: 0.3 + rng.f64(),
            center_of_mass: any(rng, 0.2),
            inertia: axes * DMat3::from_diagonal(moments) * axes.transpose(),
        };
        Link { name, inertial, visuals: Vec::new(), collisions: Vec::new() }
    };
    let mut model = RobotModel {
        name: "tree".into(),
        links: vec![link(rng, "link-0".into())],
        joints: Vec::new(),
        ..RobotModel::default()
    };
    for child in 1..links {
        let mut parent = child - 1;
        while parent > 0 && rng.u8(0..3) == 0 {
            parent = model.joints[parent - 1].parent;
        }
        let kind = match rng.u8(0..8) {
            0 => JointKind::Continuous,
            1 => JointKind::Prismatic,
            _ => JointKind::Spherical,
        };
        model.links.push(link(rng, format!("link-{child}")));
        model.joints.push(Joint {
            name: format!("joint-{child}"),
            kind,
            parent,
            child,
            parent_from_joint: DPose3::from_parts(any(rng, 0.3), turn(any(rng, 3.0))),
            axis: any(rng, 1.0).normalize(),
            limits: JointLimits::default(),
            damping: 0.0,
            friction: 0.0,
            mimic: None,
        });
    }
    model
}

fn world(model: &Arc<RobotModel>, free: bool, gravity: DVec3, h: f64, integrator: Integrator) -> Simulation {
    let settings = PhysicsSettings { time_step: h, gravity, integrator, ..PhysicsSettings::default() };
    let mut world = Simulation::new(settings, WorldLimits::default());
    apply(&mut world, Command::Spawn(Box::new(passive(model, free, &[]))));
    world
}

/// Joints somewhere, moving.
fn throw(world: &mut Simulation, model: &RobotModel, rng: &mut Rng, speed: f64) {
    let joints = model.joints.iter().map(|joint| {
        let spherical = (joint.kind == JointKind::Spherical)
            .then(|| SphericalReset { orientation: turn(any(rng, 2.0)), angular_velocity: any(rng, speed) });
        let (position, velocity) = (any(rng, 0.2).x, any(rng, speed).x);
        JointReset { joint: joint.name.clone(), axis: 0, position, velocity, spherical }
    });
    let robots = vec![RobotReset { robot: "robot".into(), joints: joints.collect() }];
    apply(world, Command::ResetJoints { robots });
    if !world.layout().entities[0].fixed_base {
        let twist = Some((any(rng, 1.0), any(rng, speed)));
        apply(world, Command::SetEntityState { robot: "robot".into(), pose: None, twist });
    }
}

/// Linear momentum, angular momentum about the world's origin, and kinetic energy.
fn motion(model: &RobotModel, seen: &PublishedState) -> (DVec3, DVec3, f64) {
    let (poses, twists) = (seen.link_poses(0).unwrap(), seen.link_twists(0).unwrap());
    let mut sum = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for ((link, pose), (linear, angular)) in model.links.iter().zip(poses).zip(twists) {
        let Inertial { mass, center_of_mass, inertia } = link.inertial;
        let center = pose.transform_point(center_of_mass);
        let velocity = linear + angular.cross(pose.rotation * center_of_mass);
        let spin = pose.rotation * (inertia * (pose.rotation.inverse() * angular));
        sum.0 += velocity * mass;
        sum.1 += center.cross(velocity * mass) + spin;
        sum.2 += 0.5 * (mass * velocity.length_squared() + angular.dot(spin));
    }
    sum
}

/// In flight without gravity, by leapfrog: momentum, angular momentum and energy are kept. The error falls
/// about with the square of the step.
#[test]
fn a_floating_tree_keeps_its_momentum_and_energy() {
    let mut slopes = Vec::new();
    for seed in 0..12 {
        let drift = [2e-3, 5e-4].map(|h| {
            let rng = &mut Rng::with_seed(seed);
            let model = Arc::new(tree(rng, 7));
            let mut world = world(&model, true, DVec3::ZERO, h, Integrator::Leapfrog);
            throw(&mut world, &model, rng, 2.0);
            let start = motion(&model, &look(&world));
            (0..(2.0 / h) as u32).for_each(|_| world.step());
            let end = motion(&model, &look(&world));
            let size = start.0.length() + 1.0;
            [
                (end.0 - start.0).length() / size,
                (end.1 - start.1).length() / (start.1.length() + 1.0),
                (end.2 / start.2 - 1.0).abs(),
            ]
        });
        println!("seed {seed}: {:?} and {:?}", drift[0], drift[1]);
        assert!(drift[1].iter().all(|drift| *drift < 1e-3), "seed {seed}: {drift:?}");
        slopes.push((drift[0][1] / drift[1][1]).log2() / 2.0);
    }
    slopes.sort_by(f64::total_cmp);
    println!("slopes of the angular momentum's drift {slopes:.2?}");
    assert!(slopes[slopes.len() / 2] > 1.8, "{slopes:?}");
}

/// Fixed and free trees under gravity: halving the step divides the error by two with Euler and by four with
/// leapfrog. This holds in the mean over trees.
#[test]
fn random_trees_with_ball_joints_are_of_second_order() {
    for (integrator, order) in [(Integrator::Euler, 1.0), (Integrator::Leapfrog, 2.0)] {
        let mut slopes: Vec<f64> = (0..20)
            .map(|seed| {
                let ends = [1e-3, 5e-4, 2.5e-4].map(|h| {
                    let rng = &mut Rng::with_seed(seed);
                    let model = Arc::new(tree(rng, 6));
                    let mut world = world(&model, rng.bool(), GRAVITY, h, integrator);
                    throw(&mut world, &model, rng, 1.0);
                    (0..(0.4 / h).round() as u32).for_each(|_| world.step());
                    look(&world).link_poses(0).unwrap()
                });
                let apart = |a: &[DPose3], b: &[DPose3]| {
                    let apart = a.iter().zip(b).map(|(a, b)| {
                        a.translation.distance(b.translation)
                            + rotation_vector(a.rotation.inverse() * b.rotation).length()
                    });
                    apart.fold(0.0, f64::max)
                };
                (apart(&ends[0], &ends[1]) / apart(&ends[1], &ends[2])).log2()
            })
            .collect();
        slopes.sort_by(f64::total_cmp);
        let middle = slopes[slopes.len() / 2];
        println!("{integrator:?}: slopes {slopes:.2?}");
        assert!((middle - order).abs() < 0.1, "{integrator:?}: {slopes:?}");
    }
}

/// Damped trees without gravity lose energy with every integrator; undamped ones under leapfrog keep it to a
/// thousandth over twenty seconds.
#[test]
fn the_energy_of_a_tree_never_grows() {
    for seed in 0..8 {
        for integrator in BOTH {
            let rng = &mut Rng::with_seed(seed);
            let mut model = tree(rng, 6);
            model.joints.iter_mut().for_each(|joint| joint.damping = 0.02);
            let model = Arc::new(model);
            let mut world = world(&model, seed % 2 == 0, DVec3::ZERO, 1e-3, integrator);
            throw(&mut world, &model, rng, 2.0);
            let first = motion(&model, &look(&world)).2;
            let mut most = 0.0f64;
            for _ in 0..200 {
                (0..50).for_each(|_| world.step());
                most = most.max(motion(&model, &look(&world)).2 / first);
            }
            assert!(most < 1.001, "seed {seed}, {integrator:?}: {most}");
        }
        let rng = &mut Rng::with_seed(seed);
        let model = Arc::new(tree(rng, 5));
        let mut world = world(&model, false, DVec3::ZERO, 1e-3, Integrator::Leapfrog);
        throw(&mut world, &model, rng, 2.0);
        let first = motion(&model, &look(&world)).2;
        let mut worst = 0.0f64;
        for _ in 0..400 {
            (0..50).for_each(|_| world.step());
            worst = worst.max((motion(&model, &look(&world)).2 / first - 1.0).abs());
        }
        println!("seed {seed}: energy off by {worst:.1e} over 20 s");
        assert!(worst < 2e-2, "seed {seed}: {worst}");
    }
}

fn collision(geometry: Geometry, at: DVec3) -> Collision {
    Collision { link_from_shape: DPose3::from_translation(at), geometry, material: Material::default() }
}

fn ground() -> RobotModel {
    let plane = collision(Geometry::Plane { normal: DVec3::Z }, DVec3::ZERO);
    let link = Link {
        name: "ground".into(),
        inertial: Inertial::ZERO,
        visuals: Vec::new(),
        collisions: vec![plane],
    };
    RobotModel { name: "ground".into(), links: vec![link], joints: Vec::new(), ..RobotModel::default() }
}

/// A heap of ball joints falls on the ground, and links are welded and pinned to each other and to the world
/// meanwhile. It comes to rest, and the ground and the pins carry its weight.
#[test]
fn a_rag_doll_comes_to_rest_on_the_ground() {
    for integrator in BOTH {
        let rng = &mut Rng::with_seed(11);
        let mut model = tree(rng, 8);
        model.joints.iter_mut().for_each(|joint| joint.damping = 0.05);
        for link in &mut model.links {
            let at = link.inertial.center_of_mass;
            link.collisions.push(collision(Geometry::Sphere { radius: 0.08 }, at));
        }
        let model = Arc::new(model);
        let settings = PhysicsSettings { time_step: 1e-3, integrator, ..PhysicsSettings::default() };
        let mut world = Simulation::new(settings, WorldLimits::default());
        let spawn = Spawn {
            pose: DPose3::from_translation(DVec3::Z * 1.5),
            contact_settings: ContactSettings { self_collision: true, ..ContactSettings::default() },
            ..passive(&model, true, &[])
        };
        let shapes = Arc::new(Shapes::new(&model));
        apply(&mut world, Command::Spawn(Box::new(Spawn { shapes, ..spawn })));
        let ground = Arc::new(ground());
        let shapes = Arc::new(Shapes::new(&ground));
        let spawn = Spawn { name: "ground".into(), shapes, ..passive(&ground, false, &[]) };
        apply(&mut world, Command::Spawn(Box::new(spawn)));
        (0..8_000).for_each(|_| world.step());
        let seen = look(&world);
        let kinetic = motion(&model, &seen).2;
        let weight: f64 = model.links.iter().map(|link| link.inertial.mass * 9.81).sum();
        let on_ground = seen.contacts.iter().filter(|contact| contact.robots[0] != contact.robots[1]);
        let carried: f64 = on_ground.map(|contact| contact.normal_force).sum();
        println!("{integrator:?}: {kinetic:.1e} J, {carried:.4} N of {weight:.4} N");
        assert!(kinetic < 1e-4, "{integrator:?}: {kinetic}");
        assert!((carried / weight - 1.0).abs() < 0.02, "{integrator:?}: {carried} {weight}");
    }
}

/// A chain of ball joints with its end pinned to the world, and one with its end welded there. Both hang and
/// keep their place to a micrometre, even while they swing.
#[test]
fn constraints_hold_through_ball_joints() {
    let kinds = [RequestedConstraint::PointToPoint, RequestedConstraint::Weld];
    for (kind, integrator) in kinds.into_iter().flat_map(|kind| BOTH.map(|integrator| (kind, integrator))) {
        let rng = &mut Rng::with_seed(3);
        let mut model = tree(rng, 7);
        model.joints.iter_mut().for_each(|joint| {
            joint.kind = JointKind::Spherical;
            joint.damping = 0.02;
        });
        let model = Arc::new(model);
        let mut world = world(&model, false, GRAVITY, 1e-3, integrator);
        throw(&mut world, &model, rng, 0.5);
        let end = |robot: &str, link: &str| RequestedEnd {
            robot: robot.into(),
            link: link.into(),
            ..RequestedEnd::default()
        };
        let create = CreateConstraint {
            name: "pin".into(),
            kind,
            parent: end("robot", "link-6"),
            child: end("", ""),
            max_force: None,
            max_torque: None,
            breaks: false,
            disable_collisions: false,
        };
        apply(&mut world, Command::CreateConstraint(Box::new(create)));
        let mut worst = 0.0f64;
        for step in 0..5_000 {
            world.step();
            let state = look(&world).constraint_states[0];
            if step > 1_000 {
                worst = worst.max(state.position_error.abs()).max(state.angle_error.abs());
            }
        }
        println!("{kind:?}, {integrator:?}: {worst:.1e}");
        assert!(worst < 1e-5, "{kind:?}, {integrator:?}: {worst:e}");
    }
}

/// A restored world with driven ball joints repeats the same motion to the bit.
#[test]
fn a_restored_world_goes_the_same_way_to_the_bit() {
    for integrator in BOTH {
        let rng = &mut Rng::with_seed(9);
        let model = Arc::new(tree(rng, 6));
        let mut world = world(&model, true, GRAVITY, 1e-3, integrator);
        throw(&mut world, &model, rng, 3.0);
        let joint = |joint: &Joint| JointTarget {
            joint: joint.name.clone(),
            axis: 0,
            target: Target::orientation(turn(DVec3::new(0.3, 0.9, -1.0))),
        };
        let spherical = model.joints.iter().filter(|joint| joint.kind == JointKind::Spherical);
        let joints: Vec<JointTarget> = spherical.take(2).map(joint).collect();
        let robots = vec![RobotTargets { robot: "robot".into(), joints, ..RobotTargets::default() }];
        apply(&mut world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
        (0..100).for_each(|_| world.step());
        apply(&mut world, Command::SaveState { name: "here".into() });
        let run = |world: &mut Simulation| -> Vec<u64> {
            (0..500)
                .map(|_| {
                    world.step();
                    world.fingerprint()
                })
                .collect()
        };
        let first = run(&mut world);
        apply(&mut world, Command::RestoreState { name: "here".into() });
        assert_eq!(first, run(&mut world), "{integrator:?}");
        let saved = crate::saved_state_files::through_a_file(&world, "here");
        apply(&mut world, Command::ImportSavedState { name: "file".into(), saved });
        apply(&mut world, Command::RestoreState { name: "file".into() });
        assert_eq!(first, run(&mut world), "{integrator:?}, through a file");
    }
}

/// Inverse kinematics turns ball joints too, and finds goals that the tree can reach.
#[test]
fn inverse_kinematics_turns_ball_joints() {
    use simd_core::dynamics::Configuration;
    use simd_core::dynamics::inverse_kinematics::{Goal, Movable, SolverOptions, inverse_kinematics};
    let mut found = 0;
    for seed in 0..30 {
        let rng = &mut Rng::with_seed(seed);
        let mut model = tree(rng, 4);
        model.joints.iter_mut().for_each(|joint| joint.kind = JointKind::Spherical);
        let tree = Tree::new(&model, true);
        let mut there = vec![0.0; tree.position_count];
        for body in tree.bodies.iter().filter(|body| body.joint_type.positions() == 4) {
            write_orientation(&mut there[body.position..], turn(any(rng, 1.5)));
        }
        let link = tree.links.len() - 1;
        let pose = tree.link_poses(DPose3::IDENTITY, &there)[link];
        let goal =
            Goal { link, point: DVec3::ZERO, position: pose.translation, orientation: Some(pose.rotation) };
        let free = |body| Movable { body, lower: f64::NEG_INFINITY, upper: f64::INFINITY };
        let movables: Vec<Movable> = (0..tree.bodies.len()).map(free).collect();
        let start: Vec<f64> = (0..model.joints.len()).flat_map(|_| [0.0, 0.0, 0.0, 1.0]).collect();
        let options = SolverOptions { iterations: 200, tolerance: 1e-8 };
        let guess = Configuration::at(DPose3::IDENTITY, start);
        let answer = inverse_kinematics(&tree, &guess, &goal, &movables, options, &|| false);
        let reached = tree.link_poses(DPose3::IDENTITY, &answer.positions)[link];
        if answer.converged {
            found += 1;
            assert!(reached.translation.distance(pose.translation) < 1e-7, "seed {seed}");
            assert!(rotation_vector(reached.rotation.inverse() * pose.rotation).length() < 1e-7);
        }
        for q in answer.positions.chunks(4) {
            assert!((orientation(q).length() - 1.0).abs() < 1e-14);
        }
    }
    assert!(found >= 28, "{found} of 30");
}

//! A step allocates nothing once a robot has had its maximum number of constraints.
#![cfg(test)]

#[path = "../physics/chains.rs"]
mod chains;

use std::io::Write as _;
use std::sync::Arc;

use allocation_counter::measure;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use glamx::{DPose3, DVec3};
use simd_core::collision::{MeshShapes, Shapes};
use simd_core::dynamics::{Articulation, Axis, Integrator, Tree};
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::*;
use simd_core::{Command, PhysicsSettings, PublishedState, Simulation};
use simd_model::robot::{JointKind, JointLimits, Sha256};
use simd_model::sensor::{ChannelNoise, Channels, Noise, SensorKind};
use simd_model::{Asset, Assets, ReadOptions, RobotModel};
use simd_tests::robots;

/// Steps before counting, at each width of the limits.
const WARM_UP: usize = 300;
/// Steps that are counted.
const COUNTED: usize = 1_000;

fn apply(world: &mut Simulation, command: Command) {
    let applied = world.apply(&command);
    assert!(applied.is_ok(), "{applied:?}");
}

fn spawn(world: &mut Simulation, name: &str, model: &Arc<RobotModel>, fixed: bool, passive: bool) {
    let spawn = Spawn {
        name: name.into(),
        allow_renaming: false,
        model: Arc::clone(model),
        pose: DPose3::IDENTITY,
        fixed_base: Some(fixed),
        passive,
        joint_positions: Vec::new(),
        joint_orientations: Vec::new(),
        shapes: Default::default(),
        contact_settings: Default::default(),
        collision_pairs: Vec::new(),
        free_place: Default::default(),
        loaded_at_start: false,
    };
    apply(world, Command::Spawn(Box::new(spawn)));
}

/// Gives each joint that moves dry friction and limits this far from zero.
fn hinder(world: &mut Simulation, robot: &str, model: &RobotModel, reach: f64) {
    let axes = model.joints.iter().filter(|joint| joint.kind != JointKind::Fixed);
    let joints = axes.map(|joint| JointProperties {
        joint: joint.name.clone(),
        friction: Some(0.2),
        limits: Some(JointLimits { lower: Some(-reach), upper: Some(reach), ..joint.limits }),
        ..JointProperties::default()
    });
    apply(world, Command::SetJointProperties { robot: robot.into(), joints: joints.collect() });
}

/// Returns an arm and a branching tree, fixed and free, driven and passive, with dry friction, hanging into
/// their limits. It has run for a while, at first with the limits of each joint so close together that all
/// possible constraints were active.
fn busy_world() -> Simulation {
    let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    let models =
        ["seven_arm/urdf/seven_arm.urdf", "branching/urdf/branching.urdf"].map(|urdf| robots::read(urdf).0);
    for reach in [4e-4, 0.05] {
        for model in &models {
            for (passive, fixed) in [(false, true), (true, true), (false, false), (true, false)] {
                let name = format!("{}-{passive}-{fixed}", model.name);
                if reach < 1e-3 {
                    spawn(&mut world, &name, model, fixed, passive);
                }
                hinder(&mut world, &name, model, reach);
            }
        }
        (0..WARM_UP).for_each(|_| world.step());
    }
    world
}

/// A chain whose end turns by 0.4 rad a step, in the first such step: the derivative of its velocity terms
/// would take eight megabytes.
#[test]
fn a_long_chain_that_spins_fast_takes_no_memory() {
    let count = 1_000;
    let tree = Arc::new(Tree::new(&chains::chain(count), true));
    let axes = vec![Axis::default(); tree.velocity_count];
    let mut body = Articulation::new(tree, DPose3::IDENTITY, axes, &[]);
    body.step(DVec3::ZERO, 1e-3, Integrator::Leapfrog);
    body.velocities_mut()[count - 1] = 400.0;
    let seen = measure(|| body.step(DVec3::ZERO, 1e-3, Integrator::Leapfrog));
    assert_eq!(seen.count_total, 0, "{seen:?}");
    assert!(body.is_finite() && body.velocities()[count - 1] > 1.0);
}

/// Zero is exact: this thread runs nothing else, and the counter is per thread.
#[test]
fn a_step_allocates_nothing() {
    let mut world = busy_world();
    world.take_events();
    let seen = measure(|| (0..COUNTED).for_each(|_| world.step()));
    assert_eq!(seen.count_total, 0, "{seen:?}");
    let events = world.take_events();
    assert!(events.is_empty(), "{events:?}");
}

/// One in the axes of the world on each link of each robot, until it is cleared.
#[test]
fn a_step_in_which_wrenches_act_allocates_nothing() {
    let mut world = busy_world();
    let mut seen = PublishedState::default();
    world.observe(&mut seen);
    for entity in &seen.world.entities {
        for link in &entity.model.links {
            let wrench = LinkWrench {
                robot: entity.name.clone(),
                link: link.name.clone(),
                force: DVec3::new(0.1, 0.2, 0.3),
                torque: DVec3::X,
                in_link_axes: false,
                point: DVec3::Z,
                duration: WrenchDuration::UntilCleared,
            };
            apply(&mut world, Command::ApplyWrench(wrench));
        }
    }
    world.step();
    let seen = measure(|| (0..COUNTED).for_each(|_| world.step()));
    assert_eq!(seen.count_total, 0, "{seen:?}");
}

/// Noise is drawn and samples are taken. The measurements are computed from the published state, in separate
/// memory.
#[test]
fn a_step_in_which_sensors_are_due_allocates_nothing() {
    let (model, _) = robots::read("seven_arm/urdf/seven_arm.urdf");
    let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    spawn(&mut world, "arm", &model, true, false);
    for kind in [SensorKind::Imu, SensorKind::LinkState, SensorKind::Odometry] {
        let noise = Noise { standard_deviation: 0.1, random_walk: 0.1, ..Noise::default() };
        let noisy =
            |(channels, _): &(Channels, usize)| ChannelNoise { channels: *channels, axis: None, noise };
        let create = CreateSensor {
            robot: "arm".into(),
            name: String::new(),
            link: String::new(),
            joint: String::new(),
            pose: DPose3::IDENTITY,
            rate: None,
            kind,
            noise: kind.channels().iter().map(noisy).collect(),
            seed: None,
        };
        apply(&mut world, Command::CreateSensor(Box::new(create)));
    }
    let mut due = Vec::new();
    for _ in 0..WARM_UP {
        world.step();
        due.clear();
        world.take_due_samples(&mut due);
    }
    let seen = measure(|| {
        for _ in 0..COUNTED {
            world.step();
            due.clear();
            world.take_due_samples(&mut due);
        }
    });
    assert_eq!(seen.count_total, 0, "{seen:?}");
    assert_eq!(due.len(), 3);
}

/// While they are carried out: how one begins and ends is reported in words.
#[test]
fn a_step_of_trajectories_allocates_nothing() {
    let (model, _) = robots::read("seven_arm/urdf/seven_arm.urdf");
    let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    spawn(&mut world, "arm", &model, true, false);
    let moving = model.joints.iter().filter(|joint| joint.kind != JointKind::Fixed);
    let joints: Vec<String> = moving.map(|joint| joint.name.clone()).collect();
    let row = |number: usize| TrajectoryPoint {
        time: 0.01 * (number + 1) as f64,
        positions: vec![0.2 * (0.05 * number as f64).sin(); joints.len()],
        velocities: vec![(0.05 * number as f64).cos(); joints.len()],
        ..TrajectoryPoint::default()
    };
    let tolerance = Tolerance { position: Some(10.0), velocity: None };
    let request = FollowTrajectory {
        robot: "arm".into(),
        points: Arc::new((0..400).map(row).collect()),
        tolerances: vec![[tolerance; 2]; joints.len()],
        joints,
        ..FollowTrajectory::default()
    };
    apply(
        &mut world,
        Command::FollowTrajectory(FollowTrajectory { begin: Begin::Queued, ..request.clone() }),
    );
    apply(&mut world, Command::FollowTrajectory(FollowTrajectory { begin: Begin::Queued, ..request }));
    (0..WARM_UP).for_each(|_| world.step());
    world.take_events();
    let seen = measure(|| (0..COUNTED).for_each(|_| world.step()));
    assert_eq!(seen.count_total, 0, "{seen:?}");
    assert!(world.take_events().is_empty(), "it goes on");
}

#[test]
fn observing_into_a_used_state_allocates_nothing() {
    let mut world = busy_world();
    let mut state = PublishedState::default();
    world.observe(&mut state);
    let seen = measure(|| {
        for _ in 0..COUNTED {
            world.step();
            world.observe(&mut state);
        }
    });
    assert_eq!(seen.count_total, 0, "{seen:?}");
}

/// An A1, and boxes and balls on a plane. The boxes are kept awake. There are no overlapping hulls and
/// cylinders, for which parry's EPA allocates.
#[test]
fn a_step_with_contacts_allocates_nothing() {
    let (model, _) = robots::read("pybullet_data/a1/a1.urdf");
    let mut world = simd_tests::scenes::a1(1e-3, &model);
    for i in 0..12 {
        use simd_tests::scenes::{ball, cuboid, robot};
        let (name, model) = (format!("body-{i}"), [ball(0.1, 1.0), cuboid(DVec3::splat(0.2), 1.0)]);
        let at = DPose3::from_translation(DVec3::new(1.0, 0.03 * f64::from(i), 0.1 + 0.25 * f64::from(i)));
        simd_tests::scenes::spawn(&mut world, robot(&name, &model[i as usize % 2], at, false));
    }
    (0..4 * COUNTED).for_each(|_| world.step());
    simd_tests::scenes::throw(&mut world, "body-0", DVec3::X, DVec3::ZERO);
    world.take_events();
    let seen = measure(|| (0..COUNTED).for_each(|_| world.step()));
    assert_eq!(seen.count_total, 0, "{seen:?}");
    assert!(!simd_tests::scenes::contacts(&world, None).is_empty());
}

/// Ten standing A1, most of them in lanes.
#[test]
fn a_step_of_robots_that_step_several_at_once_allocates_nothing() {
    let (model, _) = robots::read("pybullet_data/a1/a1.urdf");
    let mut world = simd_tests::scenes::many_a1(1e-3, &model, 10);
    (0..COUNTED).for_each(|_| world.step());
    assert!(world.robots_at_once() >= 8, "{}", world.robots_at_once());
    let seen = measure(|| (0..COUNTED).for_each(|_| world.step()));
    assert_eq!(seen.count_total, 0, "{seen:?}");
}

/// Boxes on a chain that is welded, hinged and roped to others and to the world, and a gear between two arms.
#[test]
fn a_step_with_constraints_between_links_allocates_nothing() {
    use simd_tests::scenes::{cuboid, robot};
    let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    let model = cuboid(DVec3::splat(0.1), 1.0);
    let kinds = [
        RequestedConstraint::Weld,
        RequestedConstraint::PointToPoint,
        RequestedConstraint::Hinge { axis: DVec3::Y },
        RequestedConstraint::Slide { axis: DVec3::X },
        RequestedConstraint::Distance { length: None, is_rope: true },
    ];
    let end = |robot: &str| RequestedEnd { robot: robot.into(), ..RequestedEnd::default() };
    let constraint = |kind, parent, child| CreateConstraint {
        name: String::new(),
        kind,
        parent,
        child,
        max_force: Some(1e3),
        max_torque: None,
        breaks: false,
        disable_collisions: true,
    };
    for i in 0..10 {
        let at = DPose3::from_translation(DVec3::new(0.15 * f64::from(i), 0.0, 2.0));
        let name = format!("body-{i}");
        // Without shapes: the folding chain would make and lose contacts.
        let body = Spawn { shapes: Default::default(), ..robot(&name, &model, at, false) };
        simd_tests::scenes::spawn(&mut world, body);
        let parent = if i == 0 { end("") } else { end(&format!("body-{}", i - 1)) };
        let create = constraint(kinds[i as usize % kinds.len()], parent, end(&name));
        apply(&mut world, Command::CreateConstraint(Box::new(create)));
    }
    let (arm, _) = robots::read("seven_arm/urdf/seven_arm.urdf");
    for name in ["left", "right"] {
        spawn(&mut world, name, &arm, true, true);
    }
    let joint = arm.joints.iter().find(|joint| joint.kind == JointKind::Revolute).unwrap();
    let end = |robot: &str| RequestedEnd { joint: joint.name.clone(), ..end(robot) };
    let gear = RequestedConstraint::Gear { ratio: 2.0, offset: None };
    apply(&mut world, Command::CreateConstraint(Box::new(constraint(gear, end("left"), end("right")))));
    // Until the arms have reached all their limits.
    (0..10 * WARM_UP).for_each(|_| world.step());
    world.take_events();
    let mut state = PublishedState::default();
    world.observe(&mut state);
    let seen = measure(|| {
        for _ in 0..COUNTED {
            world.step();
            world.observe(&mut state);
        }
    });
    assert_eq!(seen.count_total, 0, "{seen:?}");
    assert_eq!(state.constraint_states.len(), 11);
}

/// Counts the allocations of the physics thread; the other thread does the same work.
#[test]
fn a_step_on_two_threads_allocates_nothing() {
    use simd_core::pool::Pool;
    use simd_tests::scenes::{cuboid, plane, robot};
    use simd_world::driver::{RealTime, StepThreads};

    let (model, _) = robots::read("seven_arm/urdf/seven_arm.urdf");
    let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    let ground = robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true);
    simd_tests::scenes::spawn(&mut world, ground);
    let cube = cuboid(DVec3::splat(0.2), 1.0);
    for i in 0..60 {
        spawn(&mut world, &format!("arm-{i}"), &model, true, i % 2 == 0);
        let at = DPose3::from_translation(DVec3::new(f64::from(i), 0.0, 0.15));
        simd_tests::scenes::spawn(&mut world, robot(&format!("box-{i}"), &cube, at, false));
    }
    let threads = StepThreads::start(2, RealTime::default()).unwrap().unwrap();
    world.set_pool(Some(threads as Arc<dyn Pool>));
    world.take_events();
    // Until the boxes sleep and the arms have reached all their limits.
    (0..10 * WARM_UP).for_each(|_| world.step());
    let seen = measure(|| (0..COUNTED).for_each(|_| world.step()));
    assert_eq!(seen.count_total, 0, "{seen:?}");
    let events = world.take_events();
    assert!(events.is_empty(), "{events:?}");
}

/// Returns a binary STL with this many triangles on one line.
fn lines(triangles: u32) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend(triangles.to_le_bytes());
    let corners = [[0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
    let mut triangle = vec![0; 12];
    triangle.extend(corners.iter().flatten().flat_map(|number| number.to_le_bytes()));
    triangle.extend([0; 2]);
    (0..triangles).for_each(|_| bytes.extend(&triangle));
    bytes
}

/// Returns a grey 8 bit PNG with this size in its header and this many zeros as its unpacked data.
fn picture(width: u32, height: u32, zeros: usize) -> Vec<u8> {
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::best());
    packed.write_all(&vec![0; zeros]).unwrap();
    let header = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[8, 0, 0, 0, 0]].concat();
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    for (kind, data) in [(b"IHDR", header), (b"IDAT", packed.finish().unwrap()), (b"IEND", Vec::new())] {
        bytes.extend(u32::try_from(data.len()).unwrap().to_be_bytes());
        bytes.extend(kind);
        bytes.extend(data);
        bytes.extend([0; 4]);
    }
    bytes
}

struct OneFile(Arc<[u8]>);

impl Assets for OneFile {
    fn find(&self, _uri: &str) -> Result<Asset, Vec<String>> {
        Ok(Asset { sha256: Sha256::of(&self.0), bytes: Arc::clone(&self.0) })
    }
}

/// Returns the peak memory in bytes that reading a robot of one mesh and making its shapes takes, without the
/// file.
fn taken_at_once(uri: &str, file: Vec<u8>) -> u64 {
    let files = OneFile(file.into());
    let urdf = format!(
        "<robot name='r'><link name='l'><collision><geometry><mesh filename='{uri}'/></geometry></collision></link></robot>"
    );
    let seen = measure(|| {
        let read = simd_model::read(urdf.as_bytes(), &files, &ReadOptions::default());
        let shapes = read.map(|(model, _)| Shapes::reusing(&model, true, MeshShapes::Mesh, &[]));
        assert!(shapes.is_ok());
    });
    println!("{uri}: {} MB", seen.bytes_max / 1_000_000);
    seen.bytes_max
}

/// A million triangles without an area, and two pictures. The unpacked data of one is a thousand times its
/// pixels, and the header of the other has too many pixels.
#[test]
fn harmful_meshes_take_bounded_memory() {
    assert!(taken_at_once("line.stl", lines(1_000_000)) < 600_000_000);
    assert!(taken_at_once("bomb.png", picture(200, 200, 100_000_000)) < 20_000_000);
    assert!(taken_at_once("whole.png", picture(1_000, 1_000, 1_001_000)) < 300_000_000);
    assert!(taken_at_once("huge.png", picture(100_000, 100_000, 10_000_000)) < 1_000_000);
}

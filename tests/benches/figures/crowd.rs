//! Milliseconds per step of many robots, and the times to spawn, read and delete them.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use glamx::{DPose3, DVec3};
use simd_core::collision::Shapes;
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::*;
use simd_core::{Command, PhysicsSettings, PublishedState, Simulation};
use simd_model::RobotModel;
use simd_model::robot::JointKind;
use simd_tests::robots;

/// Robots of the last rows.
const MANY: usize = 500;

/// Prints the tables.
pub(crate) fn print() {
    arms_at_one_pose();
    many_robots();
}

/// Arms that are fixed to the world, all at one pose or with 3 m between them.
fn arms_at_one_pose() {
    println!("fixed arms, 1 ms, one thread: milliseconds a step");
    let [head, first, rest, moving] = ["", "first step", "holding", "moving"];
    println!("  {head:36} {first:>12} {rest:>12} {moving:>12}");
    for urdf in ["seven_arm/urdf/seven_arm.urdf", "pybullet_data/kuka_iiwa/model.urdf"] {
        let (model, _) = robots::read(urdf);
        let shapes = Arc::new(Shapes::new(&model));
        for (count, apart) in [(40, 3.0), (40, 0.0), (100, 3.0), (100, 0.0)] {
            let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
            (0..count).for_each(|i| spawn(&mut world, i, &model, &shapes, apart));
            let first = steps(&mut world, 1);
            steps(&mut world, 10);
            let rest = steps(&mut world, 20);
            (0..count).for_each(|i| send(&mut world, i, &model));
            steps(&mut world, 10);
            let moving = steps(&mut world, 10);
            let place = if apart > 0.0 { "3 m apart" } else { "at one pose" };
            let name = format!("{count} arms {place}, {}", model.name);
            println!("  {name:36} {first:12.2} {rest:12.3} {moving:12.2}");
        }
    }
}

/// Returns the mean time of a step, ms.
fn steps(world: &mut Simulation, count: usize) -> f64 {
    let start = Instant::now();
    (0..count).for_each(|_| world.step());
    start.elapsed().as_secs_f64() * 1e3 / count as f64
}

fn spawn(world: &mut Simulation, i: usize, model: &Arc<RobotModel>, shapes: &Arc<Shapes>, apart: f64) {
    let spawn = Spawn {
        name: format!("arm-{i}"),
        allow_renaming: false,
        model: Arc::clone(model),
        pose: DPose3::from_translation(DVec3::new((i % 10) as f64, (i / 10) as f64, 0.0) * apart),
        fixed_base: Some(true),
        passive: false,
        joint_positions: Vec::new(),
        joint_orientations: Vec::new(),
        shapes: Arc::clone(shapes),
        contact_settings: ContactSettings::default(),
        collision_pairs: Vec::new(),
        free_place: Default::default(),
        loaded_at_start: false,
    };
    assert!(world.apply(&Command::Spawn(Box::new(spawn))).is_ok());
}

/// Sends each arm to another pose.
fn send(world: &mut Simulation, i: usize, model: &RobotModel) {
    let joints = model.joints.iter().filter(|joint| joint.kind != JointKind::Fixed).enumerate();
    let target = |(k, joint): (usize, &simd_model::robot::Joint)| JointTarget {
        joint: joint.name.clone(),
        axis: 0,
        target: Target::position(0.5 * ((i * 7 + k * 3) as f64).sin()),
    };
    let robots = vec![RobotTargets {
        robot: format!("arm-{i}"),
        joints: joints.map(target).collect(),
        ..Default::default()
    }];
    assert!(world.apply(&Command::SetTargets(SetTargets { robots, ..SetTargets::default() })).is_ok());
}

/// Spawns, steps, looks at and deletes many.
fn many_robots() {
    let (model, _) = robots::read("seven_arm/urdf/seven_arm.urdf");
    let shapes = Arc::new(Shapes::new(&model));
    let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    println!("{MANY} seven-joint arms, 3 m between them: microseconds for each of them");
    let row = |what: &str, start: Instant| {
        println!("  {what:30} {:10.2}", start.elapsed().as_secs_f64() * 1e6 / MANY as f64);
    };
    let start = Instant::now();
    (0..MANY).for_each(|i| spawn(&mut world, i, &model, &shapes, 3.0));
    row("spawn", start);
    let start = Instant::now();
    (0..MANY).for_each(|i| send(&mut world, i, &model));
    row("targets, a command each", start);
    steps(&mut world, 10);
    let start = Instant::now();
    world.step();
    row("step", start);
    let mut state = PublishedState::default();
    let start = Instant::now();
    world.observe(black_box(&mut state));
    row("observe", start);
    let start = Instant::now();
    for i in 0..MANY {
        assert!(world.apply(&Command::Delete { robot: format!("arm-{i}") }).is_ok());
    }
    row("delete, the oldest first", start);
}

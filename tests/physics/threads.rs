//! A world that is stepped by one thread, by two and by four: equal to the bit. `THREADED_STEPS` of the
//! environment gives another number of steps.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::pool::Pool;
use simd_core::simulation::command::*;
use simd_core::{Command, Simulation};
use simd_model::RobotModel;
use simd_model::robot::JointKind;
use simd_tests::scenes::*;
use simd_world::driver::{RealTime, StepThreads};

use crate::constraints::tree;
use crate::contacts::keep_awake;
use crate::saved_state_files::through_a_file;

/// Pairs of robots with falling bodies beside them, too far apart to touch each other. Threads are used if
/// the groups except the largest have enough degrees of freedom and rows. With the bodies that lie awake
/// there are far more.
const PAIRS: usize = 20;

/// At one place of this many, bodies fall asleep.
const SLEEPS: usize = 4;

/// Counts the halves that another thread did.
#[derive(Debug)]
struct Counting(Arc<StepThreads>, Arc<AtomicU64>);

impl Pool for Counting {
    fn join(&self, first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send)) {
        let own = std::thread::current().id();
        self.0.join(first, &mut || {
            self.1.fetch_add(u64::from(std::thread::current().id() != own), Relaxed);
            second();
        });
    }

    fn thread(&self) -> usize {
        self.0.thread()
    }

    fn keep_awake(&self, work: &mut (dyn FnMut() + Send)) {
        self.0.keep_awake(work);
    }
}

/// At each place there are two robots with a constraint between them, one kind after the other. Bodies fall
/// on the ground there and come to rest. Some robots have actuators. At some places a robot is tied to the
/// base of another one.
fn scene(rng: &mut Rng) -> Simulation {
    let mut world = world(1e-3);
    let rough = || surface(0.7, 0.1);
    spawn(
        &mut world,
        Spawn { contact_settings: rough(), ..robot("ground", &plane(DVec3::Z), at(0.0), true) },
    );
    for index in 0..PAIRS {
        let x = 10.0 * index as f64;
        let mut make = |name: &str, up: f64| {
            // A gear needs a joint of one axis on both sides.
            let geared = |model: &Arc<RobotModel>| model.joints.len() > 1 && axis_of(model).is_some();
            let model = std::iter::repeat_with(|| tree(rng)).find(geared).unwrap();
            let turn = DQuat::from_scaled_axis(DVec3::new(rng.f64(), rng.f64(), rng.f64()));
            let pose = DPose3::from_parts(DVec3::new(x, up, 4.0), turn);
            let passive = rng.bool();
            spawn(&mut world, Spawn { passive, ..robot(&format!("{name}-{index}"), &model, pose, true) });
        };
        make("first", 0.0);
        make("second", 0.3);
        for (name, size, up) in [("box", 0.2, 0.15), ("other-box", 0.15, 0.4), ("ball", 0.1, 0.7)] {
            let model = if name == "ball" { ball(size, 0.5) } else { cuboid(DVec3::splat(size), 1.0) };
            let pose = DPose3::from_translation(DVec3::new(x + 2.0 + 0.02 * up, 0.01, up));
            let name = format!("{name}-{index}");
            spawn(&mut world, Spawn { contact_settings: rough(), ..robot(&name, &model, pose, false) });
        }
        if index % SLEEPS != 0 {
            // This also keeps the bodies on it awake.
            keep_awake(&mut world, &format!("box-{index}"));
        }
        constrain(&mut world, index);
    }
    world
}

fn at(x: f64) -> DPose3 {
    DPose3::from_translation(DVec3::X * x)
}

/// Returns the first joint with one axis.
fn axis_of(model: &RobotModel) -> Option<String> {
    let has_one = |kind| matches!(kind, JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic);
    model.joints.iter().find(|joint| has_one(joint.kind)).map(|joint| joint.name.clone())
}

fn constrain(world: &mut Simulation, index: usize) {
    let seen = look(world);
    let end = |robot: &str, link: usize, pose: Option<DPose3>| {
        let robot = format!("{robot}-{index}");
        let joint = || axis_of(&seen.entity(&robot).unwrap().1.model).unwrap();
        // A gear has no frame.
        let (link, joint) = if pose.is_none() && index % 7 == 4 {
            (String::new(), joint())
        } else {
            (format!("link-{link}"), String::new())
        };
        RequestedEnd { robot, link, joint, pose }
    };
    let origin = Some(DPose3::IDENTITY);
    let kind = match index % 7 {
        0 => RequestedConstraint::Weld,
        1 => RequestedConstraint::PointToPoint,
        2 => RequestedConstraint::Hinge { axis: DVec3::X },
        3 => RequestedConstraint::Slide { axis: DVec3::Y },
        4 => RequestedConstraint::Gear { ratio: 0.5, offset: None },
        5 => RequestedConstraint::Distance { length: None, is_rope: false },
        _ => RequestedConstraint::Distance { length: None, is_rope: true },
    };
    let second = if matches!(kind, RequestedConstraint::Distance { .. }) { origin } else { None };
    let is_gear = matches!(kind, RequestedConstraint::Gear { .. });
    // The second time a robot's root, which cannot move, is one of the two; its own joints belong to another
    // group.
    let first = if index >= 7 && !is_gear { 0 } else { 1 };
    let first_pose = if is_gear { None } else { origin };
    let second = if is_gear { None } else { second };
    // The weld breaks when the robots fall into it.
    let breaks = index == 0;
    let create = CreateConstraint {
        name: String::new(),
        kind,
        parent: end("first", first, first_pose),
        child: end("second", 1, second),
        max_force: breaks.then_some(100.0),
        max_torque: None,
        breaks,
        disable_collisions: false,
    };
    apply(world, Command::CreateConstraint(Box::new(create)));
}

/// Result of a run.
struct Run {
    /// Fingerprint of each step.
    prints: Vec<u64>,
    /// Steps in which threads shared the work.
    divided: u64,
    /// Steps that were interrupted and undone.
    given_up: u64,
}

/// Returns a run on this many threads.
fn run(threads: usize, steps: u64) -> Run {
    let divided = Arc::new(AtomicU64::new(0));
    let mut rng = Rng::with_seed(16);
    let mut world = scene(&mut rng);
    let pool = StepThreads::start(threads, RealTime::default()).unwrap();
    let pool = pool.map(|pool| Arc::new(Counting(pool, Arc::clone(&divided))) as Arc<dyn Pool>);
    world.set_pool(pool);
    let mut run = Run { prints: Vec::new(), divided: 0, given_up: 0 };
    for step in 0..steps {
        match step * 8 {
            at if at == steps => apply(&mut world, Command::SaveState { name: "kept".into() }),
            at if at == 2 * steps => apply(&mut world, Command::RestoreState { name: "kept".into() }),
            at if at == 4 * steps => {
                apply(&mut world, Command::SaveState { name: "kept".into() });
                let saved = through_a_file(&world, "kept");
                apply(&mut world, Command::ImportSavedState { name: "brought".into(), saved });
            }
            at if at == 5 * steps => apply(&mut world, Command::RestoreState { name: "brought".into() }),
            _ => {}
        }
        let joins = divided.load(Relaxed);
        if step % 100 == 0 {
            // Interrupted halfway, on any thread.
            let (asked, before) = (AtomicU64::new(0), world.fingerprint());
            let last = rng.u64(0..400);
            if !world.step_interruptible(&|| asked.fetch_add(1, Relaxed) >= last) {
                assert_eq!(world.fingerprint(), before, "step {step}");
                run.given_up += 1;
                world.step();
            }
            run.prints.push(world.fingerprint());
        } else {
            world.step();
        }
        run.divided += u64::from(divided.load(Relaxed) > joins);
        world.take_events();
    }
    run.prints.push(world.fingerprint());
    run
}

#[test]
fn a_world_is_equal_to_the_bit_on_one_thread_on_two_and_on_four() {
    let steps = std::env::var("THREADED_STEPS").ok().and_then(|steps| steps.parse().ok()).unwrap_or(1_600);
    let on = |threads| std::thread::spawn(move || run(threads, steps));
    let [one, two, four] = [1, 2, 4].map(on).map(|run| run.join().unwrap());
    assert_eq!(one.prints, two.prints);
    assert_eq!(one.prints, four.prints);
    assert_eq!(one.divided, 0);
    // The number depends on the other load of the machine.
    let least = steps / 20;
    assert!(two.divided >= least && four.divided >= least, "{} and {} of {steps}", two.divided, four.divided);
    let given_up = [&one, &two, &four].map(|run| run.given_up);
    assert!(given_up.iter().all(|count| *count > 0), "{given_up:?} steps were given up");
}

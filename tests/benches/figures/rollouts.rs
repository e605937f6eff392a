//! Arm-steps a second of rollouts: in the core, by a number of threads, and through a daemon. Then the
//! lateness of a world while rollouts are computed without a pause.

use std::hint::black_box;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use simd_client::proto::{
    RolloutControl, RolloutControlMode, RolloutCost, RolloutJointTerm, rollout_cost::Term,
};
use simd_client::{Client, packed, proto};
use simd_core::Simulation;
use simd_core::dynamics::lanes::bytes_of_copy;
use simd_core::rollout::request::{Control, ControlMode, Cost, CostTerm, Interpolation, Named};
use simd_core::rollout::{Rollout, RolloutRequest};
use simd_tests::process::{Process, leave_the_last_processor};
use simd_tests::robots::assets;
use simd_tests::soak::Steps;
use simd_tests::statistics::Spread;
use simd_tests::{robots, scenes};

use crate::{lateness, step};

const COPIES: usize = 1_024;
const STEPS: u64 = 100;
const ROUNDS: usize = 9;
/// Turns in which lateness is measured, and the time of each.
const TURNS: usize = 5;
const MEASURED: Duration = Duration::from_secs(5);

/// How copies step: one after the other, in the vectors of AVX2, and in the widest that the processor has.
#[derive(Clone, Copy)]
enum Way {
    Alone,
    FourLanes,
    WidestLanes,
}

const WAYS: [(&str, Way); 3] =
    [("one by one", Way::Alone), ("four lanes", Way::FourLanes), ("all lanes", Way::WidestLanes)];

/// Joints of the arm.
const JOINTS: usize = 7;
/// Knots of each copy, and steps between them.
const KNOTS: (usize, u64) = (10, 10);

/// Scene of a rollout.
struct Scene {
    world: Simulation,
    robot: &'static str,
    /// Positions about which targets are drawn, of all joints.
    middle: Vec<f64>,
    /// Largest deviation of a target from them.
    most: f64,
}

impl Scene {
    /// Returns an arm that hits nothing.
    fn of_arm(world: Simulation) -> Self {
        Self { world, robot: "arm-0", middle: vec![0.0; JOINTS], most: 0.5 }
    }

    /// Returns a quadruped that stands on a plane with all feet.
    fn of_quadruped() -> Self {
        let mut world = scenes::a1(1e-3, &scenes::quadruped());
        (0..500).for_each(|_| world.step());
        Self { world, robot: "a1", middle: scenes::A1_STANDS.repeat(4), most: 0.035 }
    }

    /// Targets that differ from copy to copy and from round to round.
    fn values(&self, round: usize) -> Vec<f64> {
        let mut random = fastrand::Rng::with_seed(round as u64);
        let joints = self.middle.len();
        let drawn =
            |index: usize, random: f64| self.middle[index % joints] + 2.0 * self.most * (random - 0.5);
        (0..COPIES * KNOTS.0 * joints).map(|index| drawn(index, random.f64())).collect()
    }
}

/// Prints the tables.
pub(crate) fn print() {
    println!(
        "\nrollouts of the seven-joint arm, actuators and limits: {COPIES} copies of {STEPS} steps, millions of arm-steps a second"
    );
    let (model, _) = robots::read("seven_arm/urdf/seven_arm.urdf");
    let world = step::world(&model, 1, true);
    // A copy also has a world beside its lane: for its start, and for steps that lanes do not do.
    println!(
        "  bytes a copy: {} in its lane, {} of targets in the request",
        bytes_of_copy(&world.layout().entities[0].tree),
        size_of_val(&values(0)[..]) / COPIES
    );
    let arm = Scene::of_arm(world);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    for (name, with_costs, threads) in [
        ("steps alone, one thread", false, 1),
        ("with costs of each step, one thread", true, 1),
        ("steps alone, all threads", false, threads),
        ("with costs of each step, all threads", true, threads),
    ] {
        // In turns, so that all see the same machine.
        let mut rounds = WAYS.map(|_| Vec::new());
        for round in 0..ROUNDS {
            for (rounds, (_, way)) in rounds.iter_mut().zip(WAYS) {
                rounds.push(in_the_core(&arm, round, (with_costs, way), threads));
            }
        }
        for ((way, _), rounds) in WAYS.into_iter().zip(rounds) {
            println!("  {name:38} {way:10} {}", Spread::of(rounds));
        }
    }
    println!("\nthe same of a quadruped that stands on a plane, millions of robot-steps a second");
    let quadruped = Scene::of_quadruped();
    for (name, with_costs, threads) in
        [("steps alone, one thread", false, 1), ("with costs of each step, one thread", true, 1)]
    {
        let mut rounds = WAYS.map(|_| Vec::new());
        for round in 0..ROUNDS {
            for (rounds, (_, way)) in rounds.iter_mut().zip(WAYS) {
                rounds.push(in_the_core(&quadruped, round, (with_costs, way), threads));
            }
        }
        for ((way, _), rounds) in WAYS.into_iter().zip(rounds) {
            println!("  {name:38} {way:10} {}", Spread::of(rounds));
        }
    }
    let runtime = lateness::runtime();
    runtime.block_on(async {
        let running = lateness::start(vec![lateness::arm(0)], 1e-3).await;
        let client = Client::connect(&running.address.to_string()).await.expect("it answers");
        let mut rounds = Vec::new();
        for round in 0..ROUNDS {
            let begun = Instant::now();
            let found = client.rollout(asked(round), |_| ()).await.expect("it is computed");
            black_box(found.total_costs());
            rounds.push(millions(begun));
        }
        println!("  {:38} {}", "through a daemon that plays, over gRPC", Spread::of(rounds));
        running.drain().await;
    });
    print_lateness();
}

/// Prints how late steps are while rollouts are computed.
pub(crate) fn print_lateness() {
    println!(
        "\nthe same arm at 1 kHz, alone and while clients ask for rollouts without a pause, {} s each, {TURNS} turns",
        MEASURED.as_secs()
    );
    println!("                                            lateness of steps: p50, p99, p99.9 (microseconds)");
    late_rows("physics thread as all others", "");
    late_rows("priority 40", "[realtime]\npriority = 40\n");
    // The processor set applies to a thread and those that it starts: the rest of the bench keeps its own.
    let with_its_own = || {
        let processor = leave_the_last_processor();
        let processors = processor.map_or(String::new(), |number| format!("processors = [{number}]\n"));
        late_rows("priority 40, its own processor", &format!("[realtime]\npriority = 40\n{processors}"));
    };
    std::thread::scope(|scope| {
        scope.spawn(with_its_own);
    });
}

/// In turn, so that other load of the machine is the same for all.
fn late_rows(title: &str, real_time: &str) {
    let runtime = lateness::runtime();
    let asking = [0, 1, 2];
    let mut turns = asking.map(|_| Vec::new());
    for _ in 0..TURNS {
        for (turns, asking) in turns.iter_mut().zip(asking) {
            let steps = runtime.block_on(late(real_time, asking));
            turns.push([0.5, 0.99, 0.999].map(|part| steps.lateness.percentile(part) * 1e6));
        }
    }
    for (turns, asking) in turns.into_iter().zip(asking) {
        let [half, most, latest] =
            [0, 1, 2].map(|part| Spread::of(turns.iter().map(|turn| turn[part]).collect()));
        println!("  {title:30} {asking:3} asking   {half}   {most}   {latest}");
    }
}

/// Measures the lateness of a daemon's steps with this many clients.
async fn late(real_time: &str, asking: usize) -> Steps {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("simd.toml");
    let urdf = assets().join("seven_arm/urdf/seven_arm.urdf");
    let robot = format!("[[robots]]\npath = {urdf:?}\nname = \"arm-0\"\nfixed = true\n");
    std::fs::write(&path, format!("{real_time}{robot}")).expect("a file");
    let daemon = Process::start(["--time-step", "0.001", "--config", &path.to_string_lossy()]).await;
    let client = daemon.client().await;
    let asking: Vec<_> = (0..asking).map(|_| tokio::spawn(ask(daemon.endpoint.clone()))).collect();
    // The first calls make data that all later ones share.
    tokio::time::sleep(Duration::from_secs(1)).await;
    let before = Steps::so_far(&client).await.expect("the daemon answers");
    tokio::time::sleep(MEASURED).await;
    let after = Steps::so_far(&client).await.expect("the daemon answers");
    asking.into_iter().for_each(|asking| asking.abort());
    after.since(&before)
}

/// Requests rollouts in an endless loop.
async fn ask(endpoint: String) {
    let client = Client::connect(&endpoint).await.expect("the daemon listens");
    for round in 0.. {
        let _found = client.rollout(asked(round), |_| ()).await;
    }
}

fn millions(begun: Instant) -> f64 {
    COPIES as f64 * STEPS as f64 / begun.elapsed().as_secs_f64() / 1e6
}

/// Targets that differ from copy to copy and from round to round.
fn values(round: usize) -> Vec<f64> {
    let mut random = fastrand::Rng::with_seed(round as u64);
    (0..COPIES * KNOTS.0 * JOINTS).map(|_| random.f64() - 0.5).collect()
}

fn in_the_core(scene: &Scene, round: usize, (with_costs, way): (bool, Way), threads: usize) -> f64 {
    let joints = Named { robot: scene.robot.into(), names: Vec::new() };
    let of = Cost::JointPositions { joints, targets: Vec::new(), wrapped: false };
    let request = RolloutRequest {
        copies: COPIES,
        steps: STEPS,
        controls: vec![Control {
            robot: scene.robot.into(),
            joints: Vec::new(),
            mode: ControlMode::Position,
            values: scene.values(round),
            knots: KNOTS.0,
            knot_steps: KNOTS.1,
            interpolation: Interpolation::Hold,
            stiffness: Vec::new(),
            damping: Vec::new(),
            feedback: None,
        }],
        costs: with_costs.then_some(CostTerm { weight: 1.0, final_weight: 0.0, of }).into_iter().collect(),
        ..RolloutRequest::default()
    };
    let begun = Instant::now();
    let rollout = Rollout::new(scene.world.to_saved(), request, u64::MAX).expect("it can be");
    let rollout = match way {
        Way::Alone => rollout.without_lanes(),
        Way::FourLanes => rollout.with_four_lanes(),
        Way::WidestLanes => rollout,
    };
    let next = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                let mut worker = rollout.worker();
                loop {
                    let batch = next.fetch_add(1, Ordering::Relaxed);
                    if batch >= rollout.batches() {
                        return;
                    }
                    black_box(rollout.advance(&mut worker, batch, &|| false));
                }
            });
        }
    });
    millions(begun)
}

fn asked(round: usize) -> proto::RolloutRequest {
    let term = RolloutJointTerm { robot: "arm-0".into(), ..Default::default() };
    proto::RolloutRequest {
        copies: COPIES as u32,
        steps: STEPS as u32,
        controls: vec![RolloutControl {
            robot: "arm-0".into(),
            mode: RolloutControlMode::Position.into(),
            values: packed(&values(round)),
            knots: KNOTS.0 as u32,
            knot_steps: KNOTS.1 as u32,
            ..Default::default()
        }],
        costs: vec![RolloutCost {
            weight: 1.0,
            term: Some(Term::JointPositions(term)),
            ..Default::default()
        }],
        ..Default::default()
    }
}

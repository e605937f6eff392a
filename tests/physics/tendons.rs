//! Tendons: joints whose positions are sums of others. `described_servos` compares their motion with MuJoCo's; here
//! are their limits, their friction, their bits, and contacts.

use fastrand::Rng;
use glamx::DVec3;
use simd_core::simulation::command::*;
use simd_core::{Command, Integrator, PhysicsSettings, PublishedState, Simulation, simulation::WorldLimits};
use simd_tests::world::{apply, look};
use simd_tests::{robots, scenes};

fn world(mjcf: &str, gravity: DVec3, integrator: Integrator) -> Simulation {
    let settings = PhysicsSettings { time_step: 1e-3, integrator, gravity, ..PhysicsSettings::default() };
    let mut world = Simulation::new(settings, WorldLimits::default());
    for (number, described) in robots::described(mjcf).into_iter().enumerate() {
        let name = format!("robot_{number}");
        let spawn = Spawn {
            passive: false,
            ..scenes::robot(&name, &described.model, described.pose, described.fixed)
        };
        scenes::spawn(&mut world, spawn);
    }
    world
}

fn target(world: &mut Simulation, joint: &str, target: Target) {
    let joints = vec![JointTarget { joint: joint.into(), axis: 0, target }];
    let robots = vec![RobotTargets { robot: "robot_0".into(), joints, ..RobotTargets::default() }];
    apply(world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
}

/// Returns position and velocity of a joint of the first robot.
fn joint(state: &PublishedState, name: &str) -> (f64, f64) {
    let entity = &state.world.entities[0];
    let joint = entity.model.joints.iter().position(|joint| joint.name == name).unwrap();
    let q = entity.positions.start + entity.joint_positions[joint].start;
    let v = entity.velocities.start + entity.joint_velocities[joint].start;
    (state.positions[q], state.velocities[v])
}

const HEAD: &str = "<mujoco model='m'><compiler angle='radian' autolimits='true'/>";

/// A chain of joints with random axes and masses, and tendons with random factors.
fn chain(
    of: &mut Rng,
    free: bool,
    tendon: impl Fn(&mut Rng, usize) -> String,
) -> (String, Vec<Vec<(String, f64)>>) {
    let count = of.usize(2..5);
    let between = |of: &mut Rng, low: f64, high: f64| low + of.f64() * (high - low);
    let mut bodies = String::new();
    if free {
        bodies += "<body name='root'><freejoint/><inertial pos='0 0 0' mass='1' diaginertia='0.1 0.1 0.1'/>";
    }
    for index in 0..count {
        let axis = [0, 1, 2].map(|_| format!("{:.3}", between(of, -1.0, 1.0))).join(" ");
        bodies += &format!(
            "<body name='b{index}' pos='0.3 0 0.1'><joint name='j{index}' axis='{axis}' armature='0.01' damping='0.05'/>\
             <inertial pos='0.2 0.05 0' mass='{:.3}' diaginertia='0.02 0.025 0.03'/>",
            between(of, 0.3, 1.5)
        );
    }
    bodies += &"</body>".repeat(count + usize::from(free));
    let mut sums = Vec::new();
    let mut tendons = String::new();
    for index in 0..of.usize(1..4) {
        let mut joints: Vec<usize> = (0..count).collect();
        of.shuffle(&mut joints);
        joints.truncate(of.usize(2..=count));
        let sum: Vec<(String, f64)> = (joints.iter())
            .map(|joint| (format!("j{joint}"), between(of, 0.3, 1.5) * if of.bool() { 1.0 } else { -1.0 }))
            .collect();
        let terms: String =
            sum.iter().map(|(joint, by)| format!("<joint joint='{joint}' coef='{by}'/>")).collect();
        tendons += &format!("<fixed name='t{index}' {}>{terms}</fixed>", tendon(of, index));
        sums.push(sum);
    }
    let actuators: String =
        (0..sums.len()).map(|index| format!("<motor name='m{index}' tendon='t{index}'/>")).collect();
    let text = format!(
        "{HEAD}<worldbody>{bodies}</worldbody><tendon>{tendons}</tendon><actuator>{actuators}</actuator></mujoco>"
    );
    (text, sums)
}

#[test]
fn a_tendon_has_the_sum_of_its_joints_and_stays_within_its_limits() {
    for seed in 0..40 {
        let mut of = Rng::with_seed(seed);
        let integrator = if of.bool() { Integrator::Leapfrog } else { Integrator::Euler };
        let (text, sums) = chain(&mut of, false, |_, _| "range='-0.3 0.4'".to_owned());
        let mut world = world(&text, DVec3::new(0.0, 0.0, -9.81), integrator);
        let mut beyond = 0.0_f64;
        for _ in 0..2_000 {
            world.step();
            let state = look(&world);
            for (index, sum) in sums.iter().enumerate() {
                let (position, velocity) = joint(&state, &format!("t{index}"));
                let of_joints = |pick: fn((f64, f64)) -> f64| {
                    sum.iter().map(|(name, by)| by * pick(joint(&state, name))).sum::<f64>()
                };
                let off =
                    (position - of_joints(|of| of.0)).abs().max((velocity - of_joints(|of| of.1)).abs());
                assert!(off < 1e-9, "seed {seed}: {off}");
                beyond = beyond.max(-0.3 - position).max(position - 0.4);
            }
        }
        // Limits of several tendons of the same joints may need more sweeps than a step has.
        let most = if sums.len() == 1 { 1e-6 } else { 2e-3 };
        assert!(beyond < most, "seed {seed}: {beyond:e} beyond a limit of {} tendons", sums.len());
    }
}

/// Two masses of 1 kg on a tendon of their sum, whose friction is 1 N.
#[test]
fn the_dry_friction_of_a_tendon_brakes_the_sum_of_its_joints() {
    let body = |name: &str| {
        format!(
            "<body name='{name}_body'><joint name='{name}' type='slide' axis='1 0 0'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>"
        )
    };
    let text = format!(
        "{HEAD}<worldbody><body name='base'><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>{}{}</body></worldbody>\
         <tendon><fixed name='t' frictionloss='1'><joint joint='a' coef='1'/><joint joint='b' coef='1'/></fixed></tendon>\
         <actuator><motor joint='a'/></actuator></mujoco>",
        body("a"),
        body("b")
    );
    for (effort, of_a, of_b) in [(0.9, 0.45, -0.45), (4.0, 3.0, -1.0)] {
        let mut world = world(&text, DVec3::ZERO, Integrator::Leapfrog);
        target(&mut world, "a", Target::Effort(effort));
        for _ in 0..1_000 {
            world.step();
        }
        let state = look(&world);
        for (name, expected) in [("a", of_a), ("b", of_b), ("t", of_a + of_b)] {
            let (_, velocity) = joint(&state, name);
            assert!((velocity - expected).abs() < 1e-6, "{name} of {effort}: {velocity}, not {expected}");
        }
    }
}

/// A gripper whose fingers share the force of one tendon, and find a free box between them, which is not in the
/// middle. Both sides press with the tendon's force.
#[test]
fn fingers_on_one_tendon_hold_a_box_with_its_force() {
    let finger = |name: &str, side: f64| {
        format!(
            "<body name='{name}_finger' pos='0 {} 0'><joint name='{name}' type='slide' axis='0 {} 0' damping='1'/>\
             <geom type='box' size='0.05 0.01 0.05' mass='0.1'/></body>",
            side * 0.1,
            -side
        )
    };
    let text = format!(
        "{HEAD}<worldbody><body name='palm'><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>{}{}</body>\
         <body name='box' pos='0 0.03 0'><freejoint/><geom type='box' size='0.02 0.02 0.02' mass='0.2'/></body></worldbody>\
         <tendon><fixed name='t'><joint joint='l' coef='1'/><joint joint='r' coef='1'/></fixed></tendon>\
         <actuator><position tendon='t' kp='1000' kv='20' forcerange='-10 10'/></actuator></mujoco>",
        finger("l", 1.0),
        finger("r", -1.0)
    );
    let mut world = world(&text, DVec3::ZERO, Integrator::Leapfrog);
    target(&mut world, "t", Target::position(0.3));
    for _ in 0..3_000 {
        world.step();
    }
    let state = look(&world);
    let forces = |side: f64| {
        let of = state.contacts.iter().filter(|contact| contact.normal.y * side > 0.5);
        of.map(|contact| contact.normal_force).sum::<f64>()
    };
    // The fingers are at 0.1, are 0.02 thick, and the box takes 0.04.
    let (position, velocity) = joint(&state, "t");
    assert!((position - 0.14).abs() < 1e-4 && velocity.abs() < 1e-6, "{position} {velocity}");
    assert!((forces(1.0) - 10.0).abs() < 1e-3 && (forces(-1.0) - 10.0).abs() < 1e-3, "{:#?}", state.contacts);
}

#[test]
fn gains_and_efforts_of_any_size_keep_a_chain_finite() {
    for seed in 0..60 {
        let mut of = Rng::with_seed(seed);
        let (text, sums) = chain(&mut of, seed % 3 == 0, |of, _| {
            let power = |of: &mut Rng| 10f64.powf(of.f64() * 12.0 - 3.0);
            format!("stiffness='{}' damping='{}' range='-1 1'", power(of), power(of))
        });
        let mut world = world(&text, DVec3::new(0.0, 0.0, -9.81), Integrator::Leapfrog);
        for index in 0..sums.len() {
            let power = 10f64.powf(of.f64() * 12.0 - 3.0);
            let gains = (Some(power), Some(power * of.f64()));
            let mut to = Target::position(0.5);
            if let Target::Position { stiffness, damping, .. } = &mut to {
                (*stiffness, *damping) = gains;
            }
            target(&mut world, &format!("t{index}"), to);
        }
        for _ in 0..1_000 {
            world.step();
        }
        let fastest = look(&world).velocities.iter().fold(0.0_f64, |most, velocity| most.max(velocity.abs()));
        assert!(fastest < 1e3, "seed {seed}: {fastest}");
    }
}

#[test]
fn a_restored_world_of_tendons_continues_with_the_same_bits() {
    for seed in 0..10 {
        let mut of = Rng::with_seed(seed);
        let (text, _) = chain(&mut of, true, |_, _| {
            "stiffness='20' springlength='0.2' range='-0.1 0.4' frictionloss='0.1'".into()
        });
        let mut world = world(&text, DVec3::new(0.0, 0.0, -9.81), Integrator::Leapfrog);
        target(&mut world, "t0", Target::Effort(0.3));
        (0..200).for_each(|_| world.step());
        apply(&mut world, Command::SaveState { name: "there".into() });
        (0..200).for_each(|_| world.step());
        let expected = world.fingerprint();
        apply(&mut world, Command::RestoreState { name: "there".into() });
        (0..200).for_each(|_| world.step());
        assert_eq!(world.fingerprint(), expected, "seed {seed}");
    }
}

#[test]
fn a_reset_of_joints_moves_their_tendons() {
    let mut of = Rng::with_seed(1);
    let (text, sums) = chain(&mut of, false, |_, _| String::new());
    let mut world = world(&text, DVec3::ZERO, Integrator::Leapfrog);
    let (first, by) = &sums[0][0];
    let reset = JointReset { joint: first.clone(), position: 0.5, velocity: -0.25, ..JointReset::default() };
    let robots = vec![RobotReset { robot: "robot_0".into(), joints: vec![reset] }];
    apply(&mut world, Command::ResetJoints { robots });
    assert_eq!(joint(&look(&world), "t0"), (0.5 * by, -0.25 * by));
}

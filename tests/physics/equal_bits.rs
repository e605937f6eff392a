//! Runs with contacts are equal to the bit, over everything that a step reads.

use crate::seeds::seeds;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

use fastrand::Rng;
use glamx::{DMat3, DPose3, DVec3};
use simd_core::simulation::command::*;
use simd_core::{Command, Integrator, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Inertial, JointLimits, Material};
use simd_tests::scenes::*;

use crate::chains::chain;
use crate::constraints::held;
use crate::contact_runs::jumble;
use crate::random_commands::random_command;
use crate::sleeping::is_asleep;

/// Throws one of the bodies and turns the arm at another velocity, so that nothing comes to rest for good.
fn stir(world: &mut Simulation, rng: &mut Rng) {
    let mut any = || 4.0 * rng.f64() - 2.0;
    let (linear, angular) = (DVec3::new(any(), any(), 3.0 + any()), DVec3::new(any(), any(), any()));
    let target = Target::velocity(2.0 * any());
    throw(world, &format!("body-{}", rng.usize(0..14)), linear, angular);
    let joints = vec![JointTarget { joint: "turn".into(), axis: 0, target }];
    let robots = vec![RobotTargets { robot: "arm".into(), joints, ..Default::default() }];
    apply(world, Command::SetTargets(SetTargets { robots, ..Default::default() }));
}

/// On the ground far below the box.
fn below(x: f64, height: f64) -> DPose3 {
    DPose3::from_translation(DVec3::new(x, 0.0, height - 5.0))
}

/// Returns settings with this material for all links of a robot.
fn of_all(material: Material) -> ContactSettings {
    let links = vec![LinkProperties { material, ..LinkProperties::default() }];
    ContactSettings { links, ..ContactSettings::default() }
}

/// Adds contacts of both solvers below the box. A tower with masses as 1 to 1,000 is solved directly, and a
/// ball with friction against rolling and spinning is not. The ball is thrown repeatedly.
fn add_tower_and_roller(world: &mut Simulation) {
    spawn(world, robot("ground", &plane(DVec3::Z), below(0.0, 0.0), true));
    for (i, mass) in [1.0, 1e3, 1.0, 1e3].into_iter().enumerate() {
        let model = cuboid(DVec3::splat(0.2), mass);
        spawn(world, robot(&format!("tall-{i}"), &model, below(10.0, 0.1 + 0.2 * i as f64), false));
    }
    let material =
        Material { rolling_friction: Some(1e-3), spinning_friction: Some(1e-3), ..Material::default() };
    let roller = robot("roller", &ball(0.1, 1.0), below(20.0, 0.1), false);
    spawn(world, Spawn { contact_settings: of_all(material), ..roller });
}

/// Adds a box on contacts with springs, two boxes on a common hinge, and a wheel. It spins so fast that its
/// velocity terms are solved for.
fn add_springs_hinge_and_gyroscope(world: &mut Simulation) {
    let material =
        Material { contact_stiffness: Some(1e4), contact_damping: Some(50.0), ..Material::default() };
    let model = cuboid(DVec3::splat(0.2), 1.0);
    let soft = robot("soft", &model, below(30.0, 0.1), false);
    spawn(world, Spawn { contact_settings: of_all(material), ..soft });
    for (i, x) in [40.0, 40.25].into_iter().enumerate() {
        spawn(world, robot(&format!("held-{i}"), &model, below(x, 0.1), false));
    }
    let end = |robot: &str, pose| RequestedEnd { robot: robot.into(), pose, ..RequestedEnd::default() };
    let between = Some(DPose3::from_translation(DVec3::new(0.125, 0.0, 0.1)));
    let kind = RequestedConstraint::Hinge { axis: DVec3::Y };
    let hinge = held(kind, end("held-0", between), end("held-1", None));
    apply(world, Command::CreateConstraint(Box::new(hinge)));
    spawn(world, robot("gyroscope", &Arc::new(gyroscope()), below(50.0, 1.0), true));
}

/// Returns a wheel in two rings, on three axes through its middle. The rings brake, since by Euler it would
/// not stay finite otherwise.
fn gyroscope() -> RobotModel {
    let mut model = chain(3);
    let (ring, wheel) = (DVec3::splat(0.01), DVec3::new(0.002, 0.002, 0.003));
    let parts = [(DVec3::Z, 0.1, ring), (DVec3::X, 0.1, ring), (DVec3::Z, 0.0, wheel)];
    for (i, (axis, damping, moments)) in parts.into_iter().enumerate() {
        let joint = &mut model.joints[i];
        (joint.axis, joint.damping, joint.parent_from_joint) = (axis, damping, DPose3::IDENTITY);
        model.links[i + 1].inertial =
            Inertial { mass: 1.0, center_of_mass: DVec3::ZERO, inertia: DMat3::from_diagonal(moments) };
    }
    model
}

/// Throws and turns the bodies below the box.
fn stir_below(world: &mut Simulation, way: f64) {
    throw(world, "roller", DVec3::Y * way, DVec3::new(-10.0 * way, 0.0, 5.0));
    throw(world, "tall-3", DVec3::X * 0.02 * way, DVec3::ZERO);
    throw(world, "soft", DVec3::Z, DVec3::X * way);
    throw(world, "held-1", DVec3::new(0.5 * way, 0.0, 1.0), DVec3::Y * way);
    let turn = |joint: &str, position: f64, velocity: f64| JointReset {
        joint: joint.into(),
        position,
        velocity,
        ..JointReset::default()
    };
    let joints =
        vec![turn("joint-1", 0.0, 2.0 * way), turn("joint-2", 0.6, 0.0), turn("joint-3", 0.0, 400.0)];
    apply(world, Command::ResetJoints { robots: vec![RobotReset { robot: "gyroscope".into(), joints }] });
}

/// Returns how many contacts have impulses of a direct solution, and how many have those of sweeps.
fn solved(world: &mut Simulation) -> [usize; 2] {
    apply(world, Command::SaveState { name: "solved".into() });
    let state = look(world).saved("solved").unwrap().saved().clone();
    let contacts = &state.world_state().contacts;
    let pressing = contacts.iter().filter(|contact| contact.impulse != DVec3::ZERO);
    let directly = pressing.clone().filter(|contact| contact.is_least).count();
    [directly, pressing.count() - directly]
}

/// One world runs undisturbed; the other is saved, runs ahead and is restored, many times. Both contact
/// solvers take part.
#[test]
fn long_runs_are_equal_also_across_restores() {
    run_alone_and_restored(Integrator::Leapfrog);
}

#[test]
fn long_runs_of_euler_are_equal_also_across_restores() {
    run_alone_and_restored(Integrator::Euler);
}

fn run_alone_and_restored(integrator: Integrator) {
    let [mut alone, mut restored] = [0, 0].map(|_| jumble(&mut Rng::with_seed(11)));
    for world in [&mut alone, &mut restored] {
        add_tower_and_roller(world);
        add_springs_hinge_and_gyroscope(world);
        let integrator = Some(integrator);
        apply(world, Command::SetPhysics(PhysicsChange { integrator, ..Default::default() }));
    }
    let (mut stirs, mut restores) = ([0, 0].map(|_| Rng::with_seed(12)), Rng::with_seed(13));
    let (mut touching, mut ahead, mut directly, mut by_sweeps, mut on_springs) = (0, 0, 0, 0, 0);
    let steps = seeds("EQUAL_STEPS", 8_000) as usize;
    for step in 0..steps {
        if step % 1_000 == 0 {
            on_springs += contacts(&alone, Some("soft")).len();
            stir(&mut alone, &mut stirs[0]);
            stir(&mut restored, &mut stirs[1]);
            for world in [&mut alone, &mut restored] {
                stir_below(world, if step % 2_000 == 0 { 1.0 } else { -1.0 });
            }
            touching += contacts(&alone, None).len();
            let [direct, swept] = solved(&mut alone);
            (directly, by_sweeps) = (directly + direct, by_sweeps + swept);
        }
        ahead += go_back_at_times(&mut restored, &mut restores, 500, 50);
        alone.step();
        restored.step();
        // A difference persists once it exists.
        if step % 20 == 19 {
            assert_eq!(alone.fingerprint(), restored.fingerprint(), "step {step}");
        }
    }
    println!(
        "{touching} contacts looked at, {directly} solved directly and {by_sweeps} by sweeps, {on_springs} of a body \
         on springs, {ahead} steps taken back"
    );
    let [hundreds, thousands] = [steps / 100, steps / 1_000];
    assert!(touching > hundreds && ahead > hundreds && directly > 5 * thousands);
    assert!(by_sweeps > thousands && on_springs > thousands);
    let seen = look(&alone);
    let fastest = seen.velocities.iter().map(|velocity| velocity.abs()).fold(0.0, f64::max);
    assert!(seen.roots.iter().all(|root| root.disabled.is_none()), "{:?}", seen.roots);
    assert!(seen.constraints.len() == 1 && fastest > 300.0, "{fastest} rad/s");
}

/// Bits, over everything that a step reads: at random steps, in scenes that hit, slide, roll,
/// rest and sleep. The state saved runs on as the restored one, twice.
#[test]
fn a_restored_state_with_contacts_runs_on_to_the_bit() {
    for seed in 0..4 {
        let rng = &mut Rng::with_seed(seed);
        let mut world = jumble(rng);
        for _ in 0..4 {
            (0..rng.usize(1..900)).for_each(|_| world.step());
            apply(&mut world, Command::SaveState { name: "here".into() });
            let more = rng.usize(1..500);
            let mut hashes = Vec::new();
            for again in 0..3 {
                let run: Vec<u64> = (0..more)
                    .map(|_| {
                        world.step();
                        world.fingerprint()
                    })
                    .collect();
                hashes.push(run);
                if again < 2 {
                    apply(&mut world, Command::RestoreState { name: "here".into() });
                }
            }
            assert!(hashes[0] == hashes[1] && hashes[1] == hashes[2], "seed {seed}");
        }
    }
}

/// Reads change nothing: a run with constant queries of contacts and rays is equal to the bit to one without.
#[test]
fn looking_at_contacts_changes_no_bit() {
    let [mut watched, mut alone] = [0, 0].map(|_| jumble(&mut Rng::with_seed(9)));
    for _ in 0..1_000 {
        watched.step();
        alone.step();
        contacts(&watched, None);
        let rays = vec![[DVec3::Z, DVec3::ZERO]];
        look(&watched).cast_rays(&rays, None, &|| false).unwrap();
        watched.collider_poses("arm").unwrap();
        assert_eq!(watched.fingerprint(), alone.fingerprint());
    }
}

/// An interrupted step has no effect, at whichever of its checks it stops: the world is unchanged, and
/// continues like one that was never interrupted.
#[test]
fn an_interrupted_step_never_began() {
    let [mut alone, mut interrupted] = [0, 0].map(|_| jumble(&mut Rng::with_seed(21)));
    let mut stirs = [0, 0].map(|_| Rng::with_seed(22));
    let mut checks = 0;
    for step in 0..3_000 {
        if step % 500 == 0 {
            for (world, rng) in [&mut alone, &mut interrupted].into_iter().zip(&mut stirs) {
                stir(world, rng);
                let substeps = Some(1 + step as u32 / 500 % 3);
                apply(world, Command::SetPhysics(PhysicsChange { substeps, ..Default::default() }));
                let wrench = LinkWrench {
                    robot: "body-1".into(),
                    link: "body".into(),
                    force: DVec3::Z,
                    torque: DVec3::ZERO,
                    in_link_axes: false,
                    point: DVec3::X,
                    duration: WrenchDuration::NextStep,
                };
                apply(world, Command::ApplyWrench(wrench));
                world.take_events();
            }
        }
        alone.step();
        if step % 100 != 0 {
            interrupted.step();
            assert_eq!(interrupted.fingerprint(), alone.fingerprint(), "step {step}");
            continue;
        }
        let before = interrupted.fingerprint();
        for last in 0.. {
            let asked = AtomicU64::new(0);
            let interrupt = || asked.fetch_add(1, Relaxed) >= last;
            if interrupted.step_interruptible(&interrupt) {
                break;
            }
            assert_eq!(interrupted.fingerprint(), before, "step {step}, check {last}");
            assert!(interrupted.take_events().is_empty());
            checks += 1;
        }
        assert_eq!(interrupted.fingerprint(), alone.fingerprint(), "step {step}");
    }
    assert!(checks > 500, "{checks}");
}

/// A step caches which robots it has to process, and how. The cache is right whatever happens between steps:
/// a world continues like one that was interrupted and so computes it again for each step.
#[test]
fn cached_data_of_robots_is_valid_after_any_command() {
    let mut worlds = [0, 0].map(|_| jumble(&mut Rng::with_seed(31)));
    for world in &mut worlds {
        for i in 0..3 {
            let at = DPose3::from_translation(DVec3::new(10.0 + f64::from(i), 0.0, 5.0));
            spawn(
                world,
                Spawn { passive: i == 0, ..robot(&format!("chain-{i}"), &Arc::new(chain(2)), at, i > 0) },
            );
        }
        spawn(world, robot("ground", &plane(DVec3::Z), below(0.0, 0.0), true));
        spawn(world, robot("house", &cuboid(DVec3::ONE, 1.0), below(60.0, 0.5), true));
        spawn(world, robot("sleeper", &cuboid(DVec3::splat(0.2), 1.0), below(70.0, 0.1), false));
    }
    let rng = &mut Rng::with_seed(32);
    let (mut disabled, mut asleep) = (0, 0);
    for step in 0..8_000 {
        let body = if rng.bool() { "sleeper".into() } else { format!("body-{}", rng.usize(..14)) };
        let command = match (step % 2_000, rng.u16(..600)) {
            // A limit that cannot be: the chain is taken out of the simulation.
            (300, _) => {
                let limits = JointLimits { lower: Some(1e300), ..JointLimits::default() };
                let joint = worlds[0].layout().entities.iter().find(|entity| entity.name == "chain-2");
                let joint = joint.unwrap().model.joints[0].name.clone();
                let joints = vec![JointProperties { joint, limits: Some(limits), ..Default::default() }];
                Some(Command::SetJointProperties { robot: "chain-2".into(), joints })
            }
            (600, _) => Some(Command::Delete { robot: "chain-2".into() }),
            (601, _) => {
                let at = DPose3::from_translation(DVec3::new(12.0, 0.0, 5.0));
                let again = Spawn { passive: false, ..robot("chain-2", &Arc::new(chain(2)), at, true) };
                Some(Command::Spawn(Box::new(again)))
            }
            (_, 0) => Some(random_command(rng, &worlds[0])),
            (_, 1) => Some(Command::PullLink(LinkPull {
                robot: body,
                link: "body".into(),
                point: DVec3::ZERO,
                target: rng.bool().then_some(DVec3::Z),
                stiffness: None,
                max_force: None,
                duration: Some(1.0),
            })),
            (_, 2) => Some(Command::ApplyWrench(LinkWrench {
                robot: body,
                link: "body".into(),
                force: DVec3::Z,
                torque: DVec3::X,
                in_link_axes: false,
                point: DVec3::ZERO,
                duration: WrenchDuration::NextStep,
            })),
            _ => None,
        };
        let [known, anew] = &mut worlds;
        if let Some(command) = command {
            assert_eq!(
                known.apply(&command).is_ok(),
                anew.apply(&command).is_ok(),
                "step {step}: {command:?}"
            );
        }
        assert!(!anew.step_interruptible(&|| true));
        known.step();
        anew.step();
        assert_eq!(known.fingerprint(), anew.fingerprint(), "step {step}");
        let seen = look(known);
        disabled += seen.roots.iter().filter(|root| root.disabled.is_some()).count();
        asleep += usize::from(step % 100 == 99 && is_asleep(known, "sleeper"));
    }
    assert!(disabled > 0 && asleep > 0, "{disabled} {asleep}");
}

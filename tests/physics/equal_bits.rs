//! Runs with contacts are equal to the bit, over everything that a step reads.

use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

use fastrand::Rng;
use glamx::{DPose3, DVec3};
use simd_core::simulation::command::*;
use simd_core::{Command, Integrator, Simulation};
use simd_model::robot::Material;
use simd_tests::scenes::*;

use crate::contact_runs::jumble;

/// Throws one of the bodies and lets the arm turn at another velocity, so that nothing comes to rest for good.
fn stir(world: &mut Simulation, rng: &mut Rng) {
    let mut any = || 4.0 * rng.f64() - 2.0;
    let (linear, angular) = (DVec3::new(any(), any(), 3.0 + any()), DVec3::new(any(), any(), any()));
    let target = Target::velocity(2.0 * any());
    throw(world, &format!("body-{}", rng.usize(0..14)), linear, angular);
    let joints = vec![JointTarget { joint: "turn".into(), axis: 0, target }];
    let robots = vec![RobotTargets { robot: "arm".into(), joints, ..Default::default() }];
    apply(world, Command::SetTargets(SetTargets { robots, ..Default::default() }));
}

/// What is solved directly, and what has friction against rolling and spinning and so is not: below the box a tower of
/// masses as 1 to 1,000 and a ball, which is thrown again and again.
fn add_tower_and_roller(world: &mut Simulation) {
    let at = |x: f64, height: f64| DPose3::from_translation(DVec3::new(x, 0.0, height - 5.0));
    spawn(world, robot("ground", &plane(DVec3::Z), at(0.0, 0.0), true));
    for (i, mass) in [1.0, 1e3, 1.0, 1e3].into_iter().enumerate() {
        let model = cuboid(DVec3::splat(0.2), mass);
        spawn(world, robot(&format!("tall-{i}"), &model, at(10.0, 0.1 + 0.2 * i as f64), false));
    }
    let material =
        Material { rolling_friction: Some(1e-3), spinning_friction: Some(1e-3), ..Material::default() };
    let contact_settings = ContactSettings {
        links: vec![LinkProperties { material, ..LinkProperties::default() }],
        ..ContactSettings::default()
    };
    let roller = robot("roller", &ball(0.1, 1.0), at(20.0, 0.1), false);
    spawn(world, Spawn { contact_settings, ..roller });
}

/// How many contacts have impulses of a direct solution, and how many have those of sweeps.
fn solved(world: &mut Simulation) -> [usize; 2] {
    apply(world, Command::SaveState { name: "solved".into() });
    let state = look(world).saved("solved").unwrap().saved().clone();
    let contacts = &state.world_state().contacts;
    let pressing = contacts.iter().filter(|contact| contact.impulse != DVec3::ZERO);
    let directly = pressing.clone().filter(|contact| contact.is_least).count();
    [directly, pressing.count() - directly]
}

/// The one world is left alone; the other is saved, runs ahead and is put back again and again. Both ways of solving
/// contacts take part.
#[test]
fn a_hundred_thousand_steps_are_equal_also_across_restores() {
    run_alone_and_restored(Integrator::Leapfrog);
}

#[test]
fn a_hundred_thousand_steps_of_euler_are_equal_also_across_restores() {
    run_alone_and_restored(Integrator::Euler);
}

fn run_alone_and_restored(integrator: Integrator) {
    let [mut alone, mut restored] = [0, 0].map(|_| jumble(&mut Rng::with_seed(11)));
    for world in [&mut alone, &mut restored] {
        add_tower_and_roller(world);
        let integrator = Some(integrator);
        apply(world, Command::SetPhysics(PhysicsChange { integrator, ..Default::default() }));
    }
    let (mut stirs, mut restores) = ([0, 0].map(|_| Rng::with_seed(12)), Rng::with_seed(13));
    let (mut touching, mut ahead, mut directly, mut by_sweeps) = (0, 0, 0, 0);
    for step in 0..100_000 {
        if step % 1_000 == 0 {
            stir(&mut alone, &mut stirs[0]);
            stir(&mut restored, &mut stirs[1]);
            for world in [&mut alone, &mut restored] {
                let way = if step % 2_000 == 0 { 1.0 } else { -1.0 };
                throw(world, "roller", DVec3::Y * way, DVec3::new(-10.0 * way, 0.0, 5.0));
                throw(world, "tall-3", DVec3::X * 0.02 * way, DVec3::ZERO);
            }
            touching += contacts(&alone, None).len();
            let [direct, swept] = solved(&mut alone);
            (directly, by_sweeps) = (directly + direct, by_sweeps + swept);
        }
        if restores.usize(0..500) == 0 {
            apply(&mut restored, Command::SaveState { name: "here".into() });
            let more = restores.usize(1..50);
            (0..more).for_each(|_| restored.step());
            ahead += more;
            apply(&mut restored, Command::RestoreState { name: "here".into() });
        }
        alone.step();
        restored.step();
        // What differs once differs from then on.
        if step % 20 == 19 {
            assert_eq!(alone.fingerprint(), restored.fingerprint(), "step {step}");
        }
    }
    println!(
        "{touching} contacts looked at, {directly} solved directly and {by_sweeps} by sweeps, {ahead} steps taken back"
    );
    assert!(touching > 1_000 && ahead > 1_000 && directly > 500 && by_sweeps > 100);
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

/// Looking changes nothing: a run that is asked for contacts and rays all the time is equal to
/// the bit to one that is not.
#[test]
fn looking_at_contacts_changes_no_bit() {
    let [mut watched, mut alone] = [0, 0].map(|_| jumble(&mut Rng::with_seed(9)));
    for _ in 0..1_000 {
        watched.step();
        alone.step();
        contacts(&watched, None);
        let rays = vec![[DVec3::Z, DVec3::ZERO]];
        look(&watched).cast_rays(&rays, None, || false).unwrap();
        watched.collider_poses("arm").unwrap();
        assert_eq!(watched.fingerprint(), alone.fingerprint());
    }
}

/// A step that is interrupted is as if it had never begun, at whichever of its checks that was: the world is
/// what it was before, and goes on as one does that was never interrupted.
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

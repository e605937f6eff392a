//! Damping of links, held against its law: a mass loses m k v (1 + v) of its momentum per second.

use glamx::{DPose3, DVec3};
use simd_core::dynamics::link_damping::LinkDamping;
use simd_core::simulation::command::{LinkProperties, PhysicsChange};
use simd_core::{Command, Simulation};
use simd_tests::scenes::{ball, cuboid, pendulum, plane, robot, spawn, throw};
use simd_tests::world::{apply, at, euler, leapfrog, look, passive, run};

use crate::sleeping::is_asleep;

fn damp(world: &mut Simulation, robot: &str, damping: LinkDamping) {
    let LinkDamping { linear, angular } = damping;
    let links = vec![LinkProperties {
        linear_damping: Some(linear),
        angular_damping: Some(angular),
        ..LinkProperties::default()
    }];
    apply(world, Command::SetLinkProperties { robot: robot.into(), links, stays_awake: None });
}

fn without_gravity(world: &mut Simulation) {
    let change = PhysicsChange { gravity: Some(DVec3::ZERO), ..PhysicsChange::default() };
    apply(world, Command::SetPhysics(change));
}

/// Solution of v' = -k v (1 + v).
fn left(start: f64, k: f64, time: f64) -> f64 {
    let ratio = start / (1.0 + start) * (-k * time).exp();
    ratio / (1.0 - ratio)
}

/// To the first order in the step: k h of the motion, and its square.
#[test]
fn free_motion_decays_by_the_law() {
    for (k, h) in [(0.04, 1e-3), (2.0, 1e-4)] {
        for mut world in [euler(h), leapfrog(h)] {
            without_gravity(&mut world);
            spawn(&mut world, robot("body", &ball(0.1, 3.0), DPose3::IDENTITY, false));
            damp(&mut world, "body", LinkDamping { linear: k, angular: 2.0 * k });
            throw(&mut world, "body", DVec3::X * 3.0, DVec3::Z * 5.0);
            let root = run(&mut world, 1.0).roots[0].clone();
            let (linear, angular) = (left(3.0, k, 1.0), left(5.0, 2.0 * k, 1.0));
            assert!((root.linear.x / linear - 1.0).abs() < 20.0 * k * h, "{k}: {} {linear}", root.linear);
            assert!((root.angular.z / angular - 1.0).abs() < 20.0 * k * h, "{k}: {} {angular}", root.angular);
        }
    }
}

/// A rod that swings loses what its middle loses. `(I + m r^2) w' = -m g r sin(q) - m k r^2 w (1 + r w) - I k w (1 + w)`.
#[test]
fn a_swinging_rod_loses_what_its_links_lose() {
    let (length, mass, k, h) = (1.0, 2.0, 0.5, 1e-4);
    let mut world = leapfrog(h);
    let model = pendulum(length, mass);
    spawn(&mut world, passive(&model, false, &[1.0]));
    damp(&mut world, "robot", LinkDamping { linear: k, angular: k });
    let inertia = model.links[1].inertial.inertia.col(1).y;
    let r = length / 2.0;
    let (mut q, mut w) = (1.0_f64, 0.0_f64);
    let acceleration = |q: f64, w: f64| {
        let lost = mass * k * r * r * w * (1.0 + r * w.abs()) + inertia * k * w * (1.0 + w.abs());
        (-mass * 9.81 * r * q.sin() - lost) / (inertia + mass * r * r)
    };
    // The midpoint rule, at a tenth of the step.
    for _ in 0..100_000 {
        let (middle, speed) = (q + 0.5e-5 * w, w + 0.5e-5 * acceleration(q, w));
        w += 1e-5 * acceleration(middle, speed);
        q += 1e-5 * speed;
    }
    let state = run(&mut world, 1.0);
    assert!((state.positions[0] - q).abs() < 2e-4, "{} {q}", state.positions[0]);
    assert!((state.velocities[0] - w).abs() < 1e-3, "{} {w}", state.velocities[0]);
}

#[test]
fn damping_of_any_size_stops_a_body_and_turns_none_around() {
    let most = LinkDamping { linear: LinkDamping::MAX, angular: LinkDamping::MAX };
    // Leapfrog's kick reaches half a step further: there h k (1 + v) is 0.6 and 1.
    let moderate = LinkDamping { linear: 2.0, angular: 2.0 };
    for (mut world, damping) in [(euler(1e-2), most), (leapfrog(1e-2), moderate)] {
        without_gravity(&mut world);
        spawn(&mut world, robot("body", &ball(0.1, 3.0), at(0.0, 0.0, 100.0), false));
        damp(&mut world, "body", damping);
        throw(&mut world, "body", DVec3::X * 30.0, DVec3::Z * 50.0);
        for _ in 0..1_000 {
            world.step();
            let root = look(&world).roots[0].clone();
            assert!(root.linear.x >= -1e-9 && root.angular.z >= -1e-9, "{root:?}");
        }
        let root = look(&world).roots[0].clone();
        assert!(root.linear.length() < 1e-3 && root.angular.length() < 1e-3, "{root:?}");
    }
}

/// A world without damping has the same bits as one in which it was set and taken back.
#[test]
fn damping_that_is_taken_back_leaves_nothing() {
    let fall = |damps: bool| {
        let mut world = euler(1e-3);
        spawn(&mut world, robot("body", &cuboid(DVec3::new(0.1, 0.2, 0.3), 1.0), at(0.0, 0.0, 9.0), false));
        if damps {
            damp(&mut world, "body", LinkDamping { linear: 0.04, angular: 0.04 });
            assert_eq!(look(&world).settings[0].link_damping, [LinkDamping { linear: 0.04, angular: 0.04 }]);
            damp(&mut world, "body", LinkDamping::default());
        }
        assert!(look(&world).settings[0].link_damping.is_empty());
        run(&mut world, 0.5).roots[0].clone()
    };
    assert_eq!(format!("{:?}", fall(true)), format!("{:?}", fall(false)));
}

#[test]
fn a_damped_body_at_rest_falls_asleep() {
    let mut world = euler(1e-3);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    spawn(&mut world, robot("box", &cuboid(DVec3::splat(0.2), 1.0), at(0.0, 0.0, 0.1), false));
    damp(&mut world, "box", LinkDamping { linear: 0.04, angular: 0.04 });
    run(&mut world, 1.5);
    assert!(is_asleep(&mut world, "box"));
}

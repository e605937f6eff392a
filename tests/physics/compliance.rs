//! Contacts that are springs with dampers, held against closed forms.

use glamx::{DPose3, DVec3};
use simd_core::simulation::command::Spawn;
use simd_core::{Command, Simulation};
use simd_tests::scenes::*;
use simd_tests::world::run;

use crate::contacts::keep_awake;

const G: f64 = 9.81;

/// Returns a world of this step with ground.
fn ground(h: f64) -> Simulation {
    let mut world = world(h);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    world
}

fn soften(world: &mut Simulation, robot: &str, (stiffness, damping): (f64, f64)) {
    let mut links = surface(1.0, 0.0).links;
    for link in &mut links {
        (link.material.contact_stiffness, link.material.contact_damping) = (Some(stiffness), Some(damping));
    }
    apply(world, Command::SetLinkProperties { robot: robot.into(), links, stays_awake: None });
}

fn at(x: f64, z: f64) -> DPose3 {
    DPose3::from_translation(DVec3::new(x, 0.0, z))
}

fn height(world: &Simulation, robot: usize) -> f64 {
    look(world).roots[robot].pose.translation.z
}

/// depth = m g / k, to 1e-9 m: an implicit spring is exact at rest, at any time step.
#[test]
fn a_body_on_a_spring_is_as_deep_as_hookes_law_says() {
    for (h, stiffness) in [(1e-3, 1e3), (4e-3, 1e5), (1e-3, 1e7)] {
        let mut world = ground(h);
        spawn(&mut world, robot("body", &ball(0.1, 2.0), at(0.0, 0.1), false));
        soften(&mut world, "body", (stiffness, 2.0 * (2.0 * stiffness).sqrt()));
        keep_awake(&mut world, "body");
        run(&mut world, 3.0);
        let depth = 0.1 - height(&world, 1);
        assert!((depth - 2.0 * G / stiffness).abs() < 1e-9, "{h} {stiffness}: {depth}");
        let force: f64 = look(&world).contacts.iter().map(|contact| contact.normal_force).sum();
        assert!((force / (2.0 * G) - 1.0).abs() < 1e-6, "{force}");
    }
}

/// A ball that falls on a spring leaves it with its initial speed, except for the damping of an implicit
/// step. That is the damping of a damper of h k, exp(-pi h w / 2). The time between is half a swing, `(pi + 2
/// atan(g / (w v))) / w`, to three steps.
#[test]
fn a_ball_swings_half_a_period_on_a_spring_and_leaves_with_the_speed_that_it_had() {
    let (h, mass, stiffness): (f64, f64, f64) = (1e-4, 1.0, 1e4);
    let omega = (stiffness / mass).sqrt();
    let mut world = ground(h);
    spawn(&mut world, robot("body", &ball(0.1, mass), at(0.0, 0.1 + 0.2), false));
    soften(&mut world, "body", (stiffness, 0.0));
    let speed = |world: &Simulation| look(world).roots[1].linear.z;
    let mut came = 0.0;
    while height(&world, 1) > 0.1 {
        came = -speed(&world);
        world.step();
    }
    let mut steps = 0;
    while height(&world, 1) <= 0.1 {
        world.step();
        steps += 1;
    }
    let time = (std::f64::consts::PI + 2.0 * (G / (omega * came)).atan()) / omega;
    assert!((f64::from(steps) * h - time).abs() < 3.0 * h, "{} {time}", f64::from(steps) * h);
    let left = speed(&world) / came;
    let expected = (-std::f64::consts::FRAC_PI_2 * h * omega).exp();
    assert!((left - expected).abs() < 0.003, "{left} {expected}");
}

/// Five boxes, each with springs of k: between two of them are k / 2 at each of four corners, under the
/// lowest k. To 1e-9 m.
#[test]
fn springs_of_two_that_touch_are_one_after_the_other() {
    const STIFFNESS: f64 = 2e4;
    let mut world = ground(1e-3);
    for index in 0..5 {
        let name = format!("box_{index}");
        let body =
            robot(&name, &cuboid(DVec3::splat(0.2), 1.0), at(0.0, 0.1 + 0.2 * f64::from(index)), false);
        spawn(&mut world, Spawn { contact_settings: surface(0.5, 0.0), ..body });
        soften(&mut world, &name, (STIFFNESS, 200.0));
    }
    run(&mut world, 5.0);
    let mut below = 0.0;
    for index in 0..5_u32 {
        let carried = f64::from(5 - index) * G;
        let stiffness = 4.0 * if index == 0 { STIFFNESS } else { STIFFNESS / 2.0 };
        let gap = height(&world, 1 + index as usize) - 0.1 - below;
        assert!((gap + carried / stiffness).abs() < 1e-9, "{index}: {gap} {}", carried / stiffness);
        below = height(&world, 1 + index as usize) + 0.1;
    }
}

/// The energy of bodies that fall on springs of any stiffness and damping never grows, and resting bodies
/// fall asleep.
#[test]
fn springs_of_contacts_add_no_energy() {
    for stiffness in [1e-3, 1.0, 1e3, 1e6, 1e12] {
        for damping in [0.0, 1.0, 1e3, 1e12] {
            let mut world = ground(2e-3);
            let shapes =
                [cuboid(DVec3::new(0.3, 0.2, 0.1), 1.0), ball(0.1, 3.0), cuboid(DVec3::splat(0.1), 0.2)];
            for (index, shape) in shapes.iter().enumerate() {
                let name = format!("body_{index}");
                let pose = at(0.02 * index as f64, 0.3 + 0.3 * index as f64);
                spawn(
                    &mut world,
                    Spawn { contact_settings: surface(0.5, 0.5), ..robot(&name, shape, pose, false) },
                );
                soften(&mut world, &name, (stiffness, damping));
            }
            let energy = |world: &Simulation| {
                let seen = look(world);
                let of = |(root, mass): (usize, f64)| {
                    let root = &seen.roots[root];
                    mass * (0.5 * root.linear.length_squared() + G * root.pose.translation.z)
                };
                [(1, 1.0), (2, 3.0), (3, 0.2)].into_iter().map(of).sum::<f64>()
            };
            let first = energy(&world);
            let mut most = first;
            for _ in 0..1500 {
                world.step();
                most = most.max(energy(&world));
            }
            assert!(most <= first * (1.0 + 1e-6), "{stiffness} {damping}: {first} {most}");
            assert!(energy(&world).is_finite());
        }
    }
}

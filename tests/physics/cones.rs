//! Cones: on their base, on their side, on a slope and on their apex. Soles of many corners, which stand like
//! round ones.

use simd_tests::world::run;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use glamx::{DMat3, DPose3, DQuat, DVec3};
use simd_core::Command;
use simd_core::simulation::command::{LinkWrench, Spawn, WrenchDuration};
use simd_model::RobotModel;
use simd_model::robot::Geometry;
use simd_tests::scenes::*;

use crate::contacts::keep_awake;
use crate::grounds::{field, grid, ground, mesh};

const G: f64 = 9.81;

/// Filled evenly: its centre a quarter of its length above the base.
fn cone(radius: f64, length: f64, mass: f64) -> Arc<RobotModel> {
    let mut model = (*solid(&[(DPose3::IDENTITY, Geometry::Cone { radius, length })], mass)).clone();
    for link in &mut model.links {
        let across = mass * (3.0 / 20.0 * radius * radius + 3.0 / 80.0 * length * length);
        link.inertial.inertia =
            DMat3::from_diagonal(DVec3::new(across, across, 0.3 * mass * radius * radius));
        link.inertial.center_of_mass = DVec3::Z * (-length / 4.0);
    }
    Arc::new(model)
}

/// A resting cone penetrates by 0.01 mm.
#[test]
fn a_cone_rests_on_its_base_and_on_its_side() {
    let (radius, length, mass) = (0.1, 0.3, 1.0);
    let half_angle = f64::atan2(radius, length);
    let floors = [
        ("plane", ground(&plane(DVec3::Z))),
        ("mesh", ground(&grid(7, 4.0, || 0.1, |_, _| 0.0))),
        ("height field", ground(&field(9, 4.0, |_, _| 0.0))),
    ];
    for (name, floor) in floors {
        let mut world = world(1e-3);
        spawn(&mut world, floor);
        spawn(
            &mut world,
            robot(
                "stands",
                &cone(radius, length, mass),
                DPose3::from_translation(DVec3::new(0.31, 0.17, length / 2.0)),
                false,
            ),
        );
        // From apex to rim along x.
        let turn = DQuat::from_rotation_y(FRAC_PI_2 + half_angle);
        let middle = DVec3::new(-0.9, -0.4, 0.5 * radius * half_angle.cos());
        let lies = robot("lies", &cone(radius, length, mass), DPose3::from_parts(middle, turn), false);
        spawn(&mut world, lies);
        run(&mut world, 0.8);
        let seen = look(&world);
        let [stands, lies] = [&seen.roots[1], &seen.roots[2]];
        assert!(
            (stands.pose.translation.z - length / 2.0).abs() < 2e-5,
            "{name}: {}",
            stands.pose.translation
        );
        assert!((stands.pose.rotation * DVec3::Z).z > 1.0 - 1e-9, "{name}");
        assert!((lies.pose.translation - middle).length() < 1e-4, "{name}: {}", lies.pose.translation);
        // The weight acts three quarters of the way from the apex to the base's middle. The ground's forces
        // are below it, at any number of points of the line.
        let found = contacts(&world, Some("lies"));
        let all: f64 = found.iter().map(|contact| contact.normal_force).sum();
        let borne: DVec3 = found.iter().map(|contact| contact.point * (contact.normal_force / all)).sum();
        let weight = lies.pose.transform_point(DVec3::Z * (-length / 4.0));
        assert!((all - mass * G).abs() < 1e-6, "{name}: {all}");
        assert!((borne - weight).truncate().length() < 1e-5, "{name}: {borne} below {weight}");
        assert!(found.len() >= 2, "{name}: {found:?}");
    }
}

/// It tips if its centre, a quarter of its length above the base, is beyond the rim: tan = 4 r / L.
#[test]
fn a_cone_stands_on_a_slope_until_its_centre_is_beyond_its_rim() {
    let (radius, length) = (0.1, 0.8);
    let limit = f64::atan(4.0 * radius / length);
    for (part, tips) in [(0.97, false), (1.03, true)] {
        let turn = DQuat::from_rotation_y(part * limit);
        let mut world = world(1e-3);
        let slope = robot("slope", &plane(DVec3::Z), DPose3::from_rotation(turn), true);
        spawn(&mut world, Spawn { contact_settings: surface(5.0, 0.0), ..slope });
        let body = robot(
            "body",
            &cone(radius, length, 1.0),
            DPose3::from_parts(turn * DVec3::Z * (length / 2.0), turn),
            false,
        );
        spawn(&mut world, Spawn { contact_settings: surface(5.0, 0.0), ..body });
        keep_awake(&mut world, "body");
        run(&mut world, 3.0);
        let up = look(&world).roots[1].pose.rotation * DVec3::Z;
        let leans = up.angle_between(turn * DVec3::Z);
        assert_eq!(leans > 0.3, tips, "{part}: {leans}");
        assert!(tips || leans < 1e-4, "{leans}");
    }
}

/// A cone falls over on an apex, and does not pass through.
#[test]
fn cones_that_fall_on_each_other_and_on_meshes_stay_outside() {
    let mut world = world(1e-3);
    spawn(&mut world, ground(&grid(16, 2.0, || 0.0, |x, y| 0.3 * (x * x + y * y))));
    for i in 0..12 {
        let turn = f64::from(i);
        let rotation = DQuat::from_rotation_x(2.3 * turn) * DQuat::from_rotation_y(1.7 * turn);
        let at = DVec3::new(0.15 * (turn * 2.1).sin(), 0.15 * (turn * 2.1).cos(), 0.3 + 0.25 * turn);
        let body =
            robot(&format!("body-{i}"), &cone(0.08, 0.2, 0.3), DPose3::from_parts(at, rotation), false);
        spawn(&mut world, body);
    }
    run(&mut world, 4.0);
    let seen = look(&world);
    for root in &seen.roots[1..] {
        let place = root.pose.transform_point(DVec3::Z * -0.05);
        assert!(place.z > 0.3 * place.truncate().length_squared() && place.z < 0.9, "{place}");
        // Nothing but rubbing ends their rolling to and fro in the bowl.
        assert!(root.linear.length() < 0.5, "{}", root.linear);
    }
    let deepest = seen.contacts.iter().map(|contact| contact.depth).fold(0.0, f64::max);
    assert!(deepest < 2e-4, "{deepest}");
}

/// Returns a prism with this many sides about z, as the hull of a mesh.
fn prism(sides: u32, radius: f64, height: f64, mass: f64) -> Arc<RobotModel> {
    let corner = |i: u32| {
        let turn = f64::from(i / 2) * TAU / f64::from(sides);
        DVec3::new(
            radius * turn.cos(),
            radius * turn.sin(),
            if i.is_multiple_of(2) { 0.5 } else { -0.5 } * height,
        )
    };
    let all = mesh((0..2 * sides).map(corner).collect(), vec![[0, 1, 2]], None, DVec3::ONE);
    let mut model = (*all).clone();
    for link in &mut model.links {
        let across = mass * (3.0 * radius * radius + height * height) / 12.0;
        link.inertial.mass = mass;
        link.inertial.inertia =
            DMat3::from_diagonal(DVec3::new(across, across, 0.5 * mass * radius * radius));
    }
    Arc::new(model)
}

/// A sole of forty corners under a push that would tip it if only one side carried. F h = 0.6 m g r, while a
/// square within the rim carries 0.7.
#[test]
fn a_sole_of_many_corners_carries_on_all_sides() {
    let (radius, height, mass) = (0.1, 0.1, 1.0);
    let block = Geometry::Box { size: DVec3::new(1.0, 1.0, 0.5) };
    let floors = [
        ("plane", ground(&plane(DVec3::Z))),
        (
            "box",
            robot(
                "ground",
                &solid(&[(DPose3::from_translation(DVec3::Z * -0.25), block)], 1.0),
                DPose3::IDENTITY,
                true,
            ),
        ),
        ("mesh", ground(&grid(5, 2.0, || 0.13, |_, _| 0.0))),
        ("height field", ground(&field(8, 2.0, |_, _| 0.0))),
    ];
    for (name, floor) in floors {
        for direction in 0..12 {
            let mut world = world(1e-3);
            spawn(&mut world, floor.clone());
            let pose = DPose3::from_translation(DVec3::new(0.03, -0.02, height / 2.0));
            spawn(&mut world, robot("body", &prism(40, radius, height, mass), pose, false));
            let turn = f64::from(direction) * TAU / 12.0 + 0.05;
            let push = LinkWrench {
                robot: "body".into(),
                link: "body".into(),
                force: DVec3::new(turn.cos(), turn.sin(), 0.0) * (0.6 * mass * G * radius / height),
                torque: DVec3::ZERO,
                in_link_axes: false,
                point: DVec3::Z * (height / 2.0),
                duration: WrenchDuration::UntilCleared,
            };
            apply(&mut world, Command::ApplyWrench(push));
            run(&mut world, 0.5);
            let root = look(&world).roots[1].clone();
            let tilt = (root.pose.rotation * DVec3::Z).angle_between(DVec3::Z);
            assert!(tilt < 1e-3, "{name}, {direction}: {tilt}");
            assert!((root.pose.translation - pose.translation).length() < 1e-3, "{name}, {direction}");
        }
    }
}

//! Sensors of contact: both sides of a contact, feet that carry a weight, thresholds.

use simd_tests::world::at;
use std::sync::Arc;

use glamx::{DMat3, DPose3, DQuat, DVec3};
use simd_core::simulation::command::{LinkWrench, WrenchDuration};
use simd_core::simulation::measure::{ContactMeasurement, Measurement};
use simd_core::{Command, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Collision, Geometry, Inertial, Joint, JointKind, JointLimits, Link, Material};
use simd_model::sensor::SensorKind;
use simd_tests::robots;
use simd_tests::scenes::{a1, apply, cuboid, plane, robot, spawn, throw, world};

use super::{add, create, measured};

const G: f64 = 9.81;
const TOUCH: SensorKind = SensorKind::Contact { threshold: 0.0 };

fn touches(world: &mut Simulation) -> Vec<ContactMeasurement> {
    let of = |measurement| match measurement {
        Measurement::Contact(contact) => contact,
        other => panic!("{other:?}"),
    };
    measured(world).into_iter().map(of).collect()
}

fn ground() -> Simulation {
    let mut world = world(1e-3);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    world
}

/// Newton's third law, to the bit, in each of three thousand steps in which one box falls onto another and
/// slides. It compares each box's measurement of the other.
#[test]
fn both_sides_of_a_contact_feel_the_same_with_opposite_signs() {
    let mut world = ground();
    spawn(&mut world, robot("low", &cuboid(DVec3::new(0.4, 0.4, 0.2), 3.0), at(0.0, 0.0, 0.1), false));
    let askew = DPose3::from_parts(DVec3::new(0.02, 0.01, 0.5), DQuat::from_rotation_x(0.3));
    spawn(&mut world, robot("high", &cuboid(DVec3::splat(0.2), 1.0), askew, false));
    throw(&mut world, "high", DVec3::X * 0.5, DVec3::ZERO);
    add(&mut world, create("low", "body", DPose3::IDENTITY, TOUCH));
    add(&mut world, create("high", "body", DPose3::IDENTITY, TOUCH));
    let mut touched = 0;
    for _ in 0..3_000 {
        let [low, high]: [ContactMeasurement; 2] = touches(&mut world).try_into().unwrap();
        let on_low = low.partners.iter().find(|partner| partner.robot == 2);
        let on_high = high.partners.iter().find(|partner| partner.robot == 1);
        let (Some(on_low), Some(on_high)) = (on_low, on_high) else { continue };
        assert_eq!(on_low.force, -on_high.force);
        assert_eq!((on_low.normal_force, on_low.depth), (on_high.normal_force, on_high.depth));
        assert_eq!(on_low.points, on_high.points);
        assert_eq!(high.touching, on_high.normal_force > 0.0);
        touched += usize::from(high.touching);
    }
    assert!(touched > 200, "{touched}");
    // At rest the lower one carries both on the ground, and the upper one on it: to the precision of resting
    // forces.
    let [low, high]: [ContactMeasurement; 2] = touches(&mut world).try_into().unwrap();
    assert!((high.force - DVec3::Z * G).length() < 1e-3, "{}", high.force);
    assert!((low.force - DVec3::Z * 3.0 * G).length() < 1e-3, "{}", low.force);
    assert_eq!(low.partners.iter().map(|partner| partner.robot).collect::<Vec<_>>(), [0, 2]);
}

/// Returns a body of 4 kg on four legs of 0.5 kg, each a separate link with a ball as its foot.
fn stool() -> Arc<RobotModel> {
    let inertia = DMat3::from_diagonal(DVec3::splat(0.02));
    let link = |name: String, mass: f64, shape: Option<Geometry>| Link {
        name,
        inertial: Inertial { mass, center_of_mass: DVec3::ZERO, inertia },
        visuals: Vec::new(),
        collisions: shape
            .map(|geometry| Collision {
                link_from_shape: DPose3::IDENTITY,
                geometry,
                material: Material::default(),
            })
            .into_iter()
            .collect(),
    };
    let mut links = vec![link("body".into(), 4.0, None)];
    let mut joints = Vec::new();
    for (leg, (x, y)) in [(0.2, 0.1), (0.2, -0.1), (-0.3, 0.1), (-0.3, -0.1)].into_iter().enumerate() {
        links.push(link(format!("foot-{leg}"), 0.5, Some(Geometry::Sphere { radius: 0.02 })));
        joints.push(Joint {
            name: format!("leg-{leg}"),
            kind: JointKind::Fixed,
            parent: 0,
            child: leg + 1,
            parent_from_joint: at(x, y, -0.3),
            axis: DVec3::Z,
            limits: JointLimits::default(),
            damping: 0.0,
            friction: 0.0,
            mimic: None,
        });
    }
    Arc::new(RobotModel { name: "stool".into(), links, joints, ..RobotModel::default() })
}

/// The feet of a standing robot carry its 6 kg in all, the front ones more, since they are nearer to its
/// centre. Resting bodies are solved to rounding: 1e-6 N.
#[test]
fn forces_on_the_feet_of_a_standing_robot_sum_to_its_weight() {
    let mut world = ground();
    spawn(&mut world, robot("stool", &stool(), at(0.0, 0.0, 0.32), false));
    (0..4).for_each(|leg| add(&mut world, create("stool", &format!("foot-{leg}"), DPose3::IDENTITY, TOUCH)));
    (0..1_000).for_each(|_| drop(touches(&mut world)));
    let feet = touches(&mut world);
    assert!(feet.iter().all(|foot| foot.touching && foot.partners.len() == 1), "{feet:?}");
    let sum: DVec3 = feet.iter().map(|foot| foot.force).sum();
    assert!((sum - DVec3::Z * 6.0 * G).length() < 1e-6, "{sum}");
    // Moments about y: the centre of mass lies at x = -0.1 * 2 / 6.
    let center = 2.0 * 0.5 * (0.2 - 0.3) / 6.0;
    let front = 6.0 * G * (center + 0.3) / 0.5;
    let on_front = feet[0].force.z + feet[1].force.z;
    assert!((on_front - front).abs() < 1e-6, "{on_front} N, not {front}");
}

/// The A1 of `pybullet_data` on bent legs, held by the springs of its joints. The forces of its four toes sum
/// to its weight within a millionth of it once it has come to rest, asleep or kept awake. No other part of it
/// has contacts.
#[test]
fn forces_on_the_toes_of_a_standing_a1_sum_to_its_weight() {
    let (model, _) = robots::read("pybullet_data/a1/a1.urdf");
    let weight = model.links.iter().map(|link| link.inertial.mass).sum::<f64>() * G;
    for stays_awake in [false, true] {
        let mut world = a1(1e-3, &model);
        if stays_awake {
            push(&mut world, "a1", "trunk", DVec3::Z * 1e-12);
        }
        (0..10_000).for_each(|_| world.step());
        for link in &model.links {
            add(&mut world, create("a1", &link.name, DPose3::IDENTITY, TOUCH));
        }
        let touched = touches(&mut world);
        let on_toes: Vec<_> =
            model.links.iter().zip(&touched).filter(|(link, _)| link.name.ends_with("_toe")).collect();
        assert_eq!(on_toes.len(), 4);
        assert!(on_toes.iter().all(|(_, toe)| toe.touching && toe.partners.len() == 1), "{on_toes:#?}");
        assert_eq!(touched.iter().filter(|of| of.touching).count(), 4, "it stands only on its toes");
        let sum: DVec3 = on_toes.iter().map(|(_, toe)| toe.force).sum();
        let error = (sum - DVec3::Z * weight).length() / weight;
        println!("{sum} N, of {weight} N; {error:.1e} of it off");
        assert!(error < 1e-6, "{sum} N, and not {weight} N upwards: {error:e} of it off");
    }
}

/// Pushes a link forever. A pushed body does not fall asleep.
fn push(world: &mut Simulation, robot: &str, link: &str, force: DVec3) {
    let (robot, link, duration) = (robot.into(), link.into(), WrenchDuration::UntilCleared);
    let (torque, point) = (DVec3::ZERO, DVec3::ZERO);
    let push = LinkWrench { robot, link, force, torque, in_link_axes: false, point, duration };
    apply(world, Command::ApplyWrench(push));
}

#[test]
fn a_foot_switch_says_that_it_is_touched_from_its_threshold_on() {
    for (threshold, expected) in [(9.0, true), (10.0, false)] {
        let mut world = ground();
        spawn(&mut world, robot("box", &cuboid(DVec3::splat(0.2), 1.0), at(0.0, 0.0, 0.1), false));
        add(&mut world, create("box", "body", DPose3::IDENTITY, SensorKind::Contact { threshold }));
        (0..500).for_each(|_| drop(touches(&mut world)));
        let feet = touches(&mut world);
        assert_eq!(feet[0].touching, expected, "{feet:?}");
        assert!((feet[0].normal_force - G).abs() < 1e-6);
    }
}

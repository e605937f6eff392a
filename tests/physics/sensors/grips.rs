//! Sensors on both sides of contacts: a cube between two fingers, each with a wrist sensor, an inertial unit
//! and a contact sensor.

use glamx::{DPose3, DVec3};
use simd_core::Simulation;
use simd_core::simulation::command::{PhysicsChange, Spawn};
use simd_core::simulation::measure::{ContactMeasurement, ImuMeasurement, Measurement};
use simd_model::sensor::{SensorKind, WrenchAxes, WrenchDirection};
use simd_tests::scenes::{apply, cuboid, go_to, gripper, plane, robot, spawn, surface, world};

use super::{add, create, measured};

const G: f64 = 9.81;
/// Masses of a finger and of the cube, kg.
const FINGER: f64 = 0.1;
const CUBE: f64 = 0.2;

/// Indices of the robots.
const GROUND: usize = 0;
const GRIPPER: usize = 1;
const HELD: usize = 2;
/// Index of the left finger's link; the right finger's follows.
const LEFT: usize = 2;

/// Measurements of a body, in the world's axes: its specific force, and the contact forces that act on it.
struct Felt {
    specific: DVec3,
    contact: ContactMeasurement,
}

/// Data of a step: the forces of their joints on the two fingers, the measurements of the fingers, and those
/// of the cube.
struct Grip {
    wrists: [DVec3; 2],
    fingers: [Felt; 2],
    cube: Felt,
}

/// Returns a hand over a cube that lies on the ground.
fn hand() -> Simulation {
    let mut world = world(1e-3);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    let model = gripper();
    let mut hand = robot("gripper", &model, DPose3::from_translation(DVec3::Z * 0.02), true);
    hand.contact_settings = surface(1.0, 0.0);
    spawn(&mut world, Spawn { passive: false, ..hand });
    let at = DPose3::from_translation(DVec3::new(0.002, 0.01, 0.035));
    let mut cube = robot("cube", &cuboid(DVec3::splat(0.06), CUBE), at, false);
    cube.contact_settings = surface(1.0, 0.0);
    spawn(&mut world, cube);
    let wrench =
        SensorKind::ForceTorque { axes: WrenchAxes::Child, direction: WrenchDirection::ParentOnChild };
    for (finger, link) in ["left", "right"].into_iter().zip(&model.links[LEFT..]) {
        add(&mut world, create("gripper", finger, DPose3::IDENTITY, wrench));
        let center = DPose3::from_translation(link.inertial.center_of_mass);
        add(&mut world, create("gripper", finger, center, SensorKind::Imu));
        add(&mut world, create("gripper", finger, DPose3::IDENTITY, SensorKind::Contact { threshold: 0.0 }));
    }
    add(&mut world, create("cube", "body", DPose3::IDENTITY, SensorKind::Imu));
    add(&mut world, create("cube", "body", DPose3::IDENTITY, SensorKind::Contact { threshold: 0.0 }));
    world
}

fn step(world: &mut Simulation) -> Grip {
    use Measurement::{Contact, ForceTorque, Imu};
    let felt = |imu: &ImuMeasurement, contact: &ContactMeasurement| Felt {
        specific: imu.orientation * imu.linear_acceleration,
        contact: contact.clone(),
    };
    let all = measured(world);
    let [
        ForceTorque(left),
        Imu(left_unit),
        Contact(on_left),
        ForceTorque(right),
        Imu(right_unit),
        Contact(on_right),
        Imu(unit),
        Contact(on_cube),
    ] = &all[..]
    else {
        panic!("{all:?}");
    };
    // The fingers slide, so that their axes are the world's.
    Grip {
        wrists: [left.force, right.force],
        fingers: [felt(left_unit, on_left), felt(right_unit, on_right)],
        cube: felt(unit, on_cube),
    }
}

/// Returns the force of a link of a robot on this one.
fn of(contact: &ContactMeasurement, robot: usize, link: Option<usize>) -> DVec3 {
    let partners = contact.partners.iter();
    let wanted =
        partners.filter(|partner| partner.robot == robot && link.is_none_or(|link| partner.link == link));
    wanted.map(|partner| partner.force).sum()
}

/// Newton's second law for each body, whose specific force is the force on it for each kilogram, and his
/// third for each pair of them. They hold in each step while two fingers close on a cube, press it from both
/// sides, and lift it. The sum of the two wrists' forces then equals the sum of the three bodies' forces,
/// less the ground's. To rounding, at whatever part of the step a contact begins: 1e-9 of 40 N.
#[test]
fn readings_of_two_wrists_sum_to_the_load_of_the_cube_between_them() {
    let mut world = hand();
    go_to(&mut world, "gripper", &[("left", 0.09), ("right", 0.09)]);
    let near = |a: DVec3, b: DVec3, what: &str, step: usize| {
        assert!((a - b).length() < 4e-8, "{what} in step {step}: {a} and {b}, {:e} apart", (a - b).length());
    };
    let (mut pressed, mut lifted) = (0, 0);
    for number in 0..3_000 {
        if number == 1_000 {
            go_to(&mut world, "gripper", &[("lift", 0.3)]);
        }
        let Grip { wrists, fingers, cube } = step(&mut world);
        for (index, finger) in fingers.iter().enumerate() {
            near(finger.specific * FINGER, wrists[index] + finger.contact.force, "a finger", number);
            // To the bit.
            let link = LEFT + index;
            assert_eq!(of(&finger.contact, HELD, None), -of(&cube.contact, GRIPPER, Some(link)));
        }
        near(cube.specific * CUBE, cube.contact.force, "the cube", number);
        let ground = of(&cube.contact, GROUND, None);
        let on_fingers: DVec3 = fingers.iter().map(|finger| of(&finger.contact, GROUND, None)).sum();
        let moved: DVec3 = fingers.iter().map(|finger| finger.specific * FINGER).sum();
        let all = moved + cube.specific * CUBE - ground - on_fingers;
        near(wrists[0] + wrists[1], all, "both wrists", number);
        let presses = fingers.iter().all(|finger| finger.contact.touching);
        pressed += usize::from(presses);
        lifted += usize::from(presses && ground == DVec3::ZERO);
    }
    assert!(pressed > 1_500 && lifted > 1_000, "{pressed} {lifted}");
    // At rest in the air: the wrists carry fingers and cube, and press it from both sides with the efforts of
    // their motors.
    let Grip { wrists: [left, right], .. } = step(&mut world);
    let weight = (2.0 * FINGER + CUBE) * G;
    assert!((left + right - DVec3::Z * weight).length() < 1e-3, "{}", left + right);
    assert!((left.y + 20.0).abs() < 0.01 && (right.y - 20.0).abs() < 0.01, "{left} {right}");
}

/// A step may have parts. Then contact sensors measure the mean over them, and the wrists and inertial
/// units measure the last one. At rest the two agree: a finger that is pressed by 20 N from one side carries
/// that and its weight.
#[test]
fn in_parts_of_a_step_wrists_and_contacts_agree_at_rest() {
    let mut world = hand();
    let change = PhysicsChange { substeps: Some(4), ..PhysicsChange::default() };
    apply(&mut world, simd_core::Command::SetPhysics(change));
    go_to(&mut world, "gripper", &[("left", 0.09), ("right", 0.09)]);
    (0..2_000).for_each(|_| drop(step(&mut world)));
    let Grip { wrists, fingers, .. } = step(&mut world);
    for (wrist, finger) in wrists.iter().zip(&fingers) {
        let carried = *wrist + finger.contact.force;
        assert!((carried - finger.specific * FINGER).length() < 1e-4, "{wrist} {carried}");
        assert!((finger.contact.force.y.abs() - 20.0).abs() < 0.01, "{}", finger.contact.force);
    }
}

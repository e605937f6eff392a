//! A crawl on four legs, whose hips and legs follow position targets while their feet press, stick, slip and
//! leave the ground.

use std::sync::Arc;

use glamx::{DMat3, DPose3, DVec3};
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::{JointTarget, RobotTargets, SetTargets, Spawn, Target};
use simd_core::{Command, Integrator, PhysicsSettings, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Collision, Geometry, Inertial, Joint, JointKind, JointLimits, Link, Material};
use simd_tests::scenes::{apply, look, plane, robot, spawn, surface};

/// Metres, as are the others.
const LEG: f64 = 0.2;
const FOOT_RADIUS: f64 = 0.025;
/// Seconds of a stride.
const PERIOD: f64 = 0.5;
/// The part of it that a foot is on the ground.
const STANCE: f64 = 0.75;
/// Radians that a leg swings to either side.
const REACH: f64 = 0.15;
const LIFT: f64 = 0.03;
/// Seconds from target to target.
const TURN: f64 = 0.01;
/// Names, places of hips, and parts of a stride that they are ahead.
const LEGS: [(&str, f64, f64, f64); 4] = [
    ("front_left", 0.17, 0.12, 0.0),
    ("front_right", 0.17, -0.12, 0.5),
    ("back_left", -0.17, 0.12, 0.75),
    ("back_right", -0.17, -0.12, 0.25),
];

/// Returns the robot of the Python client's example.
fn walker() -> Arc<RobotModel> {
    let link = |name: &str, mass: f64, moment: DVec3, center: DVec3, shape: Option<(DVec3, Geometry)>| Link {
        name: name.into(),
        inertial: Inertial { mass, center_of_mass: center, inertia: DMat3::from_diagonal(moment) },
        visuals: Vec::new(),
        collisions: shape
            .map(|(at, geometry)| Collision {
                link_from_shape: DPose3::from_translation(at),
                geometry,
                material: Material::default(),
            })
            .into_iter()
            .collect(),
    };
    let joint =
        |name: String, kind: JointKind, [parent, child]: [usize; 2], at: DVec3, limits: [f64; 4]| Joint {
            name,
            kind,
            parent,
            child,
            parent_from_joint: DPose3::from_translation(at),
            axis: if kind == JointKind::Revolute { DVec3::Y } else { DVec3::Z },
            limits: JointLimits {
                lower: Some(limits[0]),
                upper: Some(limits[1]),
                effort: Some(limits[2]),
                velocity: Some(limits[3]),
            },
            damping: 0.0,
            friction: 0.0,
            mimic: None,
        };
    let body = Geometry::Box { size: DVec3::new(0.4, 0.2, 0.08) };
    let moment = DVec3::new(0.02, 0.05, 0.06);
    let mut links = vec![link("body", 4.0, moment, DVec3::ZERO, Some((DVec3::ZERO, body)))];
    let mut joints = Vec::new();
    let center = DVec3::Z * (-LEG / 4.0);
    for (name, x, y, _) in LEGS {
        let thigh = links.len();
        links.push(link(&format!("{name}_thigh"), 0.3, DVec3::new(1e-3, 1e-3, 5e-4), center, None));
        let end = Some((DVec3::Z * (-LEG / 2.0), Geometry::Sphere { radius: FOOT_RADIUS }));
        links.push(link(&format!("{name}_foot"), 0.2, DVec3::new(5e-4, 5e-4, 1e-4), center, end));
        let hip = DVec3::new(x, y, 0.0);
        joints.push(joint(
            format!("{name}_hip"),
            JointKind::Revolute,
            [0, thigh],
            hip,
            [-0.8, 0.8, 60.0, 8.0],
        ));
        let knee = DVec3::Z * (-LEG / 2.0);
        let limits = [-0.02, 0.08, 200.0, 2.0];
        joints.push(joint(format!("{name}_leg"), JointKind::Prismatic, [thigh, thigh + 1], knee, limits));
    }
    Arc::new(RobotModel { name: "walker".into(), links, joints, ..RobotModel::default() })
}

fn targets(time: f64) -> SetTargets {
    let mut joints = Vec::new();
    for (name, _, _, ahead) in LEGS {
        let part = (time / PERIOD + ahead).fract();
        let (swing, lift) = if part < STANCE {
            (2.0 * part / STANCE - 1.0, 0.0)
        } else {
            let angle = std::f64::consts::PI * (part - STANCE) / (1.0 - STANCE);
            (angle.cos(), angle.sin())
        };
        for (joint, position) in [("hip", REACH * swing), ("leg", LIFT * lift)] {
            let target = Target::position(position);
            joints.push(JointTarget { joint: format!("{name}_{joint}"), axis: 0, target });
        }
    }
    let robots = vec![RobotTargets { robot: "walker".into(), joints, ..RobotTargets::default() }];
    SetTargets { robots, ..SetTargets::default() }
}

/// Returns the distance of the body after five seconds.
fn walk(integrator: Integrator, time_step: f64) -> DVec3 {
    let settings = PhysicsSettings { time_step, integrator, ..PhysicsSettings::default() };
    let mut world = Simulation::new(settings, WorldLimits { robots: 2, saved_states: 1 });
    let ground = robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true);
    spawn(&mut world, Spawn { contact_settings: surface(1.0, 0.0), ..ground });
    let at = DPose3::from_translation(DVec3::Z * (LEG + FOOT_RADIUS));
    spawn(&mut world, Spawn { passive: false, ..robot("walker", &walker(), at, false) });
    let pass = |world: &mut Simulation, seconds: f64| {
        (0..(seconds / time_step).round() as usize).for_each(|_| world.step());
    };
    pass(&mut world, 0.2);
    let place = |world: &Simulation| look(world).roots[1].pose.translation;
    let begin = place(&world);
    for turn in 0..500 {
        apply(&mut world, Command::SetTargets(targets(TURN * f64::from(turn))));
        pass(&mut world, TURN);
    }
    place(&world) - begin
}

/// While a foot is on the ground, 0.375 s, the body moves `2 * 0.15 rad * 0.2 m`. That is 0.8 m in five
/// seconds, with any integrator and time step. Measured: 0.797 m to 0.803 m from 1 ms to 0.1 ms, and 0.02 m
/// to 0.041 m aside. The tolerances are twice that and more.
///
/// With feet that are lifted by 0.05 m it would not distinguish integrators. Targets each 10 ms then jerk the
/// legs so much that the body rocks from side to side or not, by chance. With time steps from 1 ms to 0.1 ms
/// it moves 0.33 m to 0.75 m by leapfrog. By Euler it moves 0.37 m to 0.84 m, and in MuJoCo 0.37 m at 0.2 ms
/// and 0.81 m at 0.1 ms.
#[test]
fn a_crawl_is_the_same_by_both_integrators() {
    for time_step in [1e-3, 2.5e-4] {
        for integrator in [Integrator::Leapfrog, Integrator::Euler] {
            let moved = walk(integrator, time_step);
            println!("{integrator:?}, {time_step} s: {moved:.4}");
            assert!((moved.x - 0.8).abs() < 0.01, "{integrator:?}, {time_step} s: {moved}");
            assert!(moved.y.abs() < 0.08, "{integrator:?}, {time_step} s: {moved}");
            assert!(moved.z.abs() < 0.003, "{integrator:?}, {time_step} s: {moved}");
        }
    }
}

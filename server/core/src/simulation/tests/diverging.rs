//! Diverging robots and their neighbours: distant ones keep their bits, and touching ones keep the forces of
//! everything else.

use simd_model::robot::{Collision, Geometry, Material};

use super::*;
use crate::collision::Shapes;

/// Distances of objects from a diverging robot, metres.
const DISTANCES: [f64; 3] = [5.0, 30.0, 300.0];

/// Returns a link with a shape, of this mass.
fn solid(name: &str, geometry: Geometry, mass: f64) -> Link {
    let inertia = DMat3::from_diagonal(DVec3::splat(mass * 0.04 / 6.0));
    let material = Material::default();
    let collisions = vec![Collision { link_from_shape: DPose3::IDENTITY, geometry, material }];
    let inertial = Inertial { mass, center_of_mass: DVec3::ZERO, inertia };
    Link { collisions, ..link(name, inertial) }
}

/// Returns a cube of 0.2 m and this mass.
fn cube(name: &str, mass: f64) -> Link {
    solid(name, Geometry::Box { size: DVec3::splat(0.2) }, mass)
}

fn of_link(link: Link) -> Arc<RobotModel> {
    Arc::new(RobotModel { name: link.name.clone(), links: vec![link], ..RobotModel::default() })
}

/// Returns a cube that can stand, with the arm on it.
fn standing() -> Arc<RobotModel> {
    let mut model = (*arm()).clone();
    model.links[0] = cube("base_link", 2.0);
    model.links[1].collisions = solid("arm", Geometry::Sphere { radius: 0.02 }, 1.0).collisions;
    Arc::new(model)
}

fn add(world: &mut Simulation, name: &str, model: Arc<RobotModel>, at: DVec3, fixed: bool) {
    let pose = DPose3::from_parts(at, DQuat::IDENTITY);
    let shapes = Arc::new(Shapes::new(&model));
    let spawn = Spawn { pose, shapes, fixed_base: Some(fixed), ..spawn(name, model) };
    world.apply(&Command::Spawn(Box::new(spawn))).unwrap();
}

fn ground() -> Simulation {
    let mut world = world(1e-3);
    let plane = of_link(solid("ground", Geometry::Plane { normal: DVec3::Z }, 1.0));
    add(&mut world, "ground", plane, DVec3::ZERO, true);
    world
}

/// Returns towers of two boxes and robots with a joint, on the ground. If `has_wild`, a robot stands in their
/// middle, and a box falls high above it. Also returns the number of the others.
fn scene(has_wild: bool, substeps: u32) -> (Simulation, usize) {
    let mut world = ground();
    let change = PhysicsChange { substeps: Some(substeps), ..PhysicsChange::default() };
    world.apply(&Command::SetPhysics(change)).unwrap();
    for (i, far) in DISTANCES.into_iter().enumerate() {
        for (j, z) in [0.1, 0.3].into_iter().enumerate() {
            add(
                &mut world,
                &format!("box-{i}-{j}"),
                of_link(cube("box", 1.0)),
                DVec3::new(far, 0.0, z),
                false,
            );
        }
        add(&mut world, &format!("robot-{i}"), standing(), DVec3::new(0.0, far, 0.1), false);
    }
    let others = world.entities.len();
    if has_wild {
        add(&mut world, "wild", standing(), DVec3::Z * 0.1, false);
        add(&mut world, "falling", of_link(cube("box", 1.0)), DVec3::Z * 3.5, false);
    }
    (0..300).for_each(|_| world.step());
    (world, others)
}

/// Returns everything that a world shows of its first robots. Numbers are printed so that they can be read
/// back exactly.
fn shown(world: &Simulation, robots: usize) -> String {
    let state = look(world);
    let last = &state.world.entities[robots - 1];
    let (positions, velocities) = (last.positions.end, last.velocities.end);
    let of_these = state.contacts.iter().filter(|contact| contact.robots.iter().all(|robot| *robot < robots));
    let contacts: Vec<_> = of_these.collect();
    assert!(contacts.len() >= 3 * 4 * DISTANCES.len(), "{} contacts", contacts.len());
    format!(
        "{:?}",
        (
            &state.roots[..robots],
            &state.positions[..positions],
            &state.velocities[..velocities],
            &state.efforts[..velocities],
            &state.accelerations[..velocities],
            contacts,
        )
    )
}

fn throw(linear: DVec3, angular: DVec3) -> Command {
    Command::SetEntityState { robot: "wild".into(), pose: None, twist: Some((linear, angular)) }
}

/// In the air, where it then stays.
fn spin(angular: DVec3) -> Command {
    Command::SetEntityState { robot: "falling".into(), pose: None, twist: Some((DVec3::ZERO, angular)) }
}

/// Beyond numbers whose squares are finite.
fn push() -> Command {
    Command::ApplyWrench(LinkWrench {
        robot: "wild".into(),
        link: "base_link".into(),
        force: DVec3::new(1e150, -1e150, 1e149),
        torque: DVec3::splat(1e150),
        in_link_axes: false,
        point: DVec3::ZERO,
        duration: WrenchDuration::UntilCleared,
    })
}

fn turn_joint(velocity: f64) -> Command {
    let joints = vec![JointReset { joint: "shoulder".into(), velocity, ..JointReset::default() }];
    Command::ResetJoints { robots: vec![RobotReset { robot: "wild".into(), joints }] }
}

/// Contacts are looked for along the motion, and robots near each other are solved together. A robot at 1e6
/// m/s was therefore solved together with all within a kilometre, and hit what it passed. If it was not
/// finite, it removed their contacts.
#[test]
fn a_robot_that_diverges_changes_no_bit_of_those_that_stand_far_away() {
    let commands = [
        ("thrown at a tower", throw(DVec3::X * 1e6, DVec3::ZERO)),
        ("thrown past them", throw(DVec3::new(8e5, 6e5, 1e3), DVec3::ZERO)),
        ("thrown at the ground", throw(DVec3::new(1e9, 0.0, -1e6), DVec3::ZERO)),
        ("thrown as fast as can be", throw(DVec3::new(-1e12, 1e12, 0.0), DVec3::splat(1e12))),
        ("spun", spin(DVec3::new(1e5, 0.0, 1e5))),
        ("spun faster", spin(DVec3::new(0.0, 3e6, 1e7))),
        ("turned at its joint", turn_joint(1e9)),
        ("pushed", push()),
    ];
    for substeps in [1, 3] {
        for (what, command) in &commands {
            let ((mut alone, others), (mut with, _)) = (scene(false, substeps), scene(true, substeps));
            assert!(shown(&alone, others) == shown(&with, others), "{what}: before");
            with.apply(command).unwrap();
            for step in 0..30 {
                alone.step();
                with.step();
                let is_equal = shown(&alone, others) == shown(&with, others);
                assert!(is_equal, "{what}, {substeps} parts, step {step}");
            }
        }
    }
}

/// A robot that diverges may be part of a tower. The others lose only its load, in the step in which it is disabled.
#[test]
fn the_support_of_a_diverging_robot_carries_its_own_weight_in_each_step() {
    let mut world = ground();
    for i in 0..3 {
        let at = DVec3::Z * (0.1 + 0.2 * f64::from(i));
        add(&mut world, &format!("box-{i}"), of_link(cube("box", 1.0)), at, false);
    }
    add(&mut world, "wild", standing(), DVec3::Z * 0.7, false);
    run(&mut world, 0.5);
    let carried = |world: &Simulation| {
        let state = look(world);
        let on_ground = state.contacts.iter().filter(|contact| contact.robots[0] == 0);
        on_ground.map(|contact| contact.normal_force).sum::<f64>()
    };
    assert!((carried(&world) - 5.19992 * 9.81).abs() < 0.5, "{}", carried(&world));
    world.apply(&push()).unwrap();
    for step in 0..20 {
        world.step();
        let state = look(&world);
        assert!(state.roots[..4].iter().all(|root| root.disabled.is_none()), "step {step}");
        assert!((carried(&world) - 3.0 * 9.81).abs() < 0.1, "step {step}: {}", carried(&world));
    }
    assert!(look(&world).roots[4].disabled.is_some(), "it has diverged");
}

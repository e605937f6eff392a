//! Scenes with contact, for tests and benchmarks: primitives as models, and worlds of them.

use std::sync::Arc;

use glamx::{DMat3, DPose3, DVec3};
use simd_core::collision::Shapes;
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::{LinkProperties, Spawn, Touches};
use simd_core::simulation::query::ContactReport;
use simd_core::{Answer, Command, PhysicsSettings, Query, Simulation, Snapshot};
use simd_model::RobotModel;
use simd_model::robot::{Collision, Geometry, Inertial, Link, Material};

/// An empty world on Earth.
pub fn world(time_step: f64) -> Simulation {
    let settings = PhysicsSettings { time_step, ..PhysicsSettings::default() };
    Simulation::new(settings, WorldLimits { robots: 2_000, snapshots: 32 })
}

/// One link of solid shapes, each with its place, of this mass in all. Its moment is that of
/// the first shape.
pub fn solid(shapes: &[(DPose3, Geometry)], mass: f64) -> Arc<RobotModel> {
    let moment = match shapes.first() {
        Some((_, Geometry::Box { size })) => {
            let s = *size * *size;
            DVec3::new(s.y + s.z, s.z + s.x, s.x + s.y) * (mass / 12.0)
        }
        Some((_, Geometry::Sphere { radius })) => DVec3::splat(0.4 * mass * radius * radius),
        Some((_, Geometry::Cylinder { radius, length } | Geometry::Capsule { radius, length })) => {
            let across = mass * (3.0 * radius * radius + length * length) / 12.0;
            DVec3::new(across, across, 0.5 * mass * radius * radius)
        }
        _ => DVec3::splat(mass),
    };
    let collision = |(at, geometry): &(DPose3, Geometry)| Collision {
        link_from_shape: *at,
        geometry: geometry.clone(),
        material: Material::default(),
    };
    let link = Link {
        name: "body".into(),
        inertial: Inertial { mass, center_of_mass: DVec3::ZERO, inertia: DMat3::from_diagonal(moment) },
        visuals: Vec::new(),
        collisions: shapes.iter().map(collision).collect(),
    };
    Arc::new(RobotModel { name: "solid".into(), links: vec![link], joints: Vec::new() })
}

/// A box of these full lengths.
pub fn cuboid(size: DVec3, mass: f64) -> Arc<RobotModel> {
    solid(&[(DPose3::IDENTITY, Geometry::Box { size })], mass)
}

/// A ball.
pub fn ball(radius: f64, mass: f64) -> Arc<RobotModel> {
    solid(&[(DPose3::IDENTITY, Geometry::Sphere { radius })], mass)
}

/// All that lies below a plane.
pub fn plane(normal: DVec3) -> Arc<RobotModel> {
    solid(&[(DPose3::IDENTITY, Geometry::Plane { normal })], 1.0)
}

/// A floor and four walls, open above; the inside is `size` long, wide and high, and the floor's
/// upper side lies at 0.
pub fn container(size: DVec3) -> Arc<RobotModel> {
    const THICK: f64 = 0.1;
    let wall = |at: DVec3, size: DVec3| (DPose3::from_translation(at), Geometry::Box { size });
    let (x, y, z) = (size.x, size.y, size.z);
    let long = y + 2.0 * THICK;
    solid(
        &[
            wall(DVec3::new(0.0, 0.0, -THICK / 2.0), DVec3::new(x + 2.0 * THICK, long, THICK)),
            wall(DVec3::new((x + THICK) / 2.0, 0.0, z / 2.0), DVec3::new(THICK, long, z)),
            wall(DVec3::new(-(x + THICK) / 2.0, 0.0, z / 2.0), DVec3::new(THICK, long, z)),
            wall(DVec3::new(0.0, (y + THICK) / 2.0, z / 2.0), DVec3::new(x, THICK, z)),
            wall(DVec3::new(0.0, -(y + THICK) / 2.0, z / 2.0), DVec3::new(x, THICK, z)),
        ],
        1.0,
    )
}

/// A request for a robot at rest, without an actuator.
pub fn robot(name: &str, model: &Arc<RobotModel>, pose: DPose3, fixed: bool) -> Spawn {
    Spawn {
        name: name.into(),
        allow_renaming: false,
        model: Arc::clone(model),
        shapes: Arc::new(Shapes::new(model)),
        pose,
        fixed_base: Some(fixed),
        passive: true,
        joint_positions: Vec::new(),
        touches: Touches::default(),
        loaded_at_start: false,
    }
}

/// Friction and restitution of all of a robot's links.
pub fn surface(friction: f64, restitution: f64) -> Touches {
    let material = Material { friction: Some(friction), restitution: Some(restitution) };
    Touches { itself: false, links: vec![LinkProperties { link: String::new(), material }] }
}

/// Applies a command that must be accepted.
///
/// # Panics
/// Where it is refused: then the test has failed.
#[allow(clippy::panic, reason = "the test has failed")]
pub fn apply(world: &mut Simulation, command: Command) {
    if let Err(refused) = world.apply(&command) {
        panic!("{refused}");
    }
}

/// Spawns a robot.
pub fn spawn(world: &mut Simulation, spawn: Spawn) {
    apply(world, Command::Spawn(Box::new(spawn)));
}

/// Gives a free root other velocities, world axes.
pub fn throw(world: &mut Simulation, robot: &str, linear: DVec3, angular: DVec3) {
    let twist = Some((linear, angular));
    apply(world, Command::SetEntityState { robot: robot.into(), pose: None, twist });
}

/// What the world looks like.
pub fn look(world: &Simulation) -> Snapshot {
    let mut snapshot = Snapshot::default();
    world.observe(&mut snapshot);
    snapshot
}

/// What touches, of one robot or of all.
pub fn contacts(world: &Simulation, robot: Option<&str>) -> Vec<ContactReport> {
    match world.query(&Query::Contacts { robot: robot.map(str::to_owned) }) {
        Ok(Answer::Contacts(contacts)) => contacts,
        _ => Vec::new(),
    }
}

/// Ten boxes of 0.2 m and 1 kg on a plane, one on the other.
pub fn stack(time_step: f64) -> Simulation {
    let mut world = world(time_step);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    let model = cuboid(DVec3::splat(0.2), 1.0);
    for i in 0..10 {
        let at = DPose3::from_translation(DVec3::new(0.0, 0.0, 0.1 + 0.2 * f64::from(i)));
        spawn(&mut world, robot(&format!("box-{i}"), &model, at, false));
    }
    world
}

/// So many balls of 5 cm radius and 0.1 kg, in a loose grid above a box of 1 m by 1 m.
pub fn rain(time_step: f64, count: usize) -> Simulation {
    let mut world = world(time_step);
    spawn(&mut world, robot("box", &container(DVec3::new(1.0, 1.0, 2.0)), DPose3::IDENTITY, true));
    let model = ball(0.05, 0.1);
    for i in 0..count {
        let (layer, place) = (i / 64, i % 64);
        let shift = 0.01 * (layer % 3) as f64;
        let at = DVec3::new(
            -0.42 + 0.115 * (place % 8) as f64 + shift,
            -0.42 + 0.115 * (place / 8) as f64 + 0.5 * shift,
            0.1 + 0.11 * layer as f64,
        );
        spawn(&mut world, robot(&format!("ball-{i}"), &model, DPose3::from_translation(at), false));
    }
    world
}

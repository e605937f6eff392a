//! Scenes with contact, for tests and benchmarks: primitives as models, and worlds of them.

pub use crate::world::look;
use std::sync::Arc;

use glamx::{DMat3, DPose3, DVec3};
use simd_core::collision::Shapes;
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::{
    ContactSettings, JointTarget, LinkProperties, RobotTargets, SetTargets, Spawn, Target,
};
use simd_core::simulation::published_state::ContactReport;
use simd_core::{Command, PhysicsSettings, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Collision, Geometry, Inertial, Joint, JointKind, JointLimits, Link, Material};

/// Returns an empty world on Earth.
pub fn world(time_step: f64) -> Simulation {
    let settings = PhysicsSettings { time_step, ..PhysicsSettings::default() };
    Simulation::new(settings, WorldLimits { robots: 2_000, saved_states: 32 })
}

/// Returns one link of solid shapes, each with its place, of this total mass. The first shape gives its
/// moment.
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
        Some((_, Geometry::Cone { radius, length })) => {
            let across = mass * (3.0 / 20.0 * radius * radius + length * length / 10.0);
            DVec3::new(across, across, 0.3 * mass * radius * radius)
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
    Arc::new(RobotModel {
        name: "solid".into(),
        links: vec![link],
        joints: Vec::new(),
        ..RobotModel::default()
    })
}

/// Returns a box of these full lengths.
pub fn cuboid(size: DVec3, mass: f64) -> Arc<RobotModel> {
    solid(&[(DPose3::IDENTITY, Geometry::Box { size })], mass)
}

/// Returns a ball.
pub fn ball(radius: f64, mass: f64) -> Arc<RobotModel> {
    solid(&[(DPose3::IDENTITY, Geometry::Sphere { radius })], mass)
}

/// Returns the half-space below a plane.
pub fn plane(normal: DVec3) -> Arc<RobotModel> {
    solid(&[(DPose3::IDENTITY, Geometry::Plane { normal })], 1.0)
}

/// Returns a floor and four walls, open above; the inside is `size` long, wide and high, and the floor's
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

/// Returns a request for a robot at rest, without an actuator.
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
        joint_orientations: Vec::new(),
        contact_settings: ContactSettings::default(),
        collision_pairs: Vec::new(),
        free_place: Default::default(),
        loaded_at_start: false,
    }
}

/// Friction and restitution of all of a robot's links.
pub fn surface(friction: f64, restitution: f64) -> ContactSettings {
    let material =
        Material { friction: Some(friction), restitution: Some(restitution), ..Material::default() };
    let links = vec![LinkProperties { material, ..LinkProperties::default() }];
    ContactSettings { links, ..ContactSettings::default() }
}

/// Applies a command that must be accepted.
///
/// # Panics
/// Panics if it is refused: then the test has failed.
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

/// A contact point of two links, by their names; its numbers are those of a `ContactReport`.
#[derive(Clone, Debug)]
pub struct Touching {
    /// Names of the two robots.
    pub robots: [String; 2],
    /// Names of the two links.
    pub links: [String; 2],
    /// World, metres.
    pub point: DVec3,
    /// From the first to the second.
    pub normal: DVec3,
    /// Depth of the overlap, metres.
    pub depth: f64,
    /// N.
    pub normal_force: f64,
    /// On the second, N.
    pub friction_force: DVec3,
}

/// Returns the contacts of one robot or of all.
pub fn contacts(world: &Simulation, robot: Option<&str>) -> Vec<Touching> {
    let seen = look(world);
    let touching = |report: &ContactReport| {
        let ContactReport { robots, links, point, normal, depth, normal_force, friction_force, .. } = *report;
        let entities = robots.map(|index| &seen.world.entities[index]);
        let link = |side: usize| entities[side].model.links[links[side]].name.clone();
        let (robots, links) = (entities.map(|entity| entity.name.clone()), [link(0), link(1)]);
        Touching { robots, links, point, normal, depth, normal_force, friction_force }
    };
    let all = seen.contacts.iter().map(touching);
    all.filter(|it| robot.is_none_or(|robot| it.robots.iter().any(|name| name == robot))).collect()
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

/// Returns a world with a box of 1 m by 1 m. Above it, in a loose grid, are this many balls of 5 cm radius
/// and 0.1 kg.
pub fn rain(time_step: f64, count: usize) -> Simulation {
    let mut world = world(time_step);
    spawn(&mut world, robot("box", &container(DVec3::new(1.0, 1.0, 2.0)), DPose3::IDENTITY, true));
    let model = ball(0.05, 0.1);
    for i in 0..count {
        let (layer, index) = (i / 64, i % 64);
        let shift = 0.01 * (layer % 3) as f64;
        let at = DVec3::new(
            -0.42 + 0.115 * (index % 8) as f64 + shift,
            -0.42 + 0.115 * (index / 8) as f64 + 0.5 * shift,
            0.1 + 0.11 * layer as f64,
        );
        spawn(&mut world, robot(&format!("ball-{i}"), &model, DPose3::from_translation(at), false));
    }
    world
}

/// Returns a link of one box, at a place in its own frame, with its mass there.
fn boxed(name: &str, at: DVec3, size: DVec3, mass: f64) -> Link {
    let mut link = cuboid(size, mass).links[0].clone();
    link.name = name.into();
    link.inertial.center_of_mass = at;
    for collision in &mut link.collisions {
        collision.link_from_shape = DPose3::from_translation(at);
    }
    link
}

fn joint(name: &str, kind: JointKind, (parent, child): (usize, usize), at: DVec3, axis: DVec3) -> Joint {
    Joint {
        name: name.into(),
        kind,
        parent,
        child,
        parent_from_joint: DPose3::from_translation(at),
        axis,
        limits: JointLimits::default(),
        damping: 0.0,
        friction: 0.0,
        mimic: None,
    }
}

/// Returns a base without a shape, and a rod of this length that hangs from it and turns about y.
pub fn pendulum(length: f64, mass: f64) -> Arc<RobotModel> {
    let base = Link { collisions: Vec::new(), ..boxed("base", DVec3::ZERO, DVec3::splat(0.1), 1.0) };
    let rod = boxed("rod", DVec3::Z * (-length / 2.0), DVec3::new(0.04, 0.04, length), mass);
    let hinge = joint("hinge", JointKind::Continuous, (0, 1), DVec3::ZERO, DVec3::Y);
    Arc::new(RobotModel {
        name: "pendulum".into(),
        links: vec![base, rod],
        joints: vec![hinge],
        ..RobotModel::default()
    })
}

/// Returns a hand that moves up and down on a rail, with two fingers that close along y. With the lift at 0
/// the finger tips are at the base's height; open by 0.1 m each at 0.
pub fn gripper() -> Arc<RobotModel> {
    let base = Link { collisions: Vec::new(), ..boxed("base", DVec3::ZERO, DVec3::splat(0.1), 1.0) };
    let hand = boxed("hand", DVec3::Z * 0.2, DVec3::new(0.1, 0.3, 0.05), 1.0);
    let finger = |name: &str| boxed(name, DVec3::Z * 0.05, DVec3::new(0.03, 0.02, 0.1), 0.1);
    let slide = |name: &str, child: usize, y: f64| {
        let axis = DVec3::Y * -y.signum();
        let mut joint = joint(name, JointKind::Prismatic, (1, child), DVec3::Y * y, axis);
        joint.limits =
            JointLimits { lower: Some(0.0), upper: Some(0.1), effort: Some(20.0), velocity: Some(0.5) };
        joint
    };
    let mut lift = joint("lift", JointKind::Prismatic, (0, 1), DVec3::ZERO, DVec3::Z);
    lift.limits =
        JointLimits { lower: Some(0.0), upper: Some(1.0), effort: Some(200.0), velocity: Some(0.3) };
    Arc::new(RobotModel {
        name: "gripper".into(),
        links: vec![base, hand, finger("left"), finger("right")],
        joints: vec![lift, slide("left", 2, 0.11), slide("right", 3, -0.11)],
        ..RobotModel::default()
    })
}

/// Returns a table of 10 kg: a top of 1.2 by 0.8 m on four legs of 6 cm, 0.75 m high. The origin of its link
/// is in the middle of its feet.
pub fn table() -> Arc<RobotModel> {
    let part = |at: DVec3, size: DVec3| (DPose3::from_translation(at), Geometry::Box { size });
    let leg = |x: f64, y: f64| part(DVec3::new(0.5 * x, 0.3 * y, 0.36), DVec3::new(0.06, 0.06, 0.72));
    let top = part(DVec3::Z * 0.735, DVec3::new(1.2, 0.8, 0.03));
    let shapes = [top, leg(-1.0, -1.0), leg(-1.0, 1.0), leg(1.0, -1.0), leg(1.0, 1.0)];
    let mut model = (*solid(&shapes, 10.0)).clone();
    for link in &mut model.links {
        link.inertial.center_of_mass = DVec3::Z * 0.6;
    }
    Arc::new(model)
}

/// Returns a quadruped: a trunk of 6 kg, and four legs. Each has a hip that turns about x, two segments of
/// 0.2 m that turn about y, and a foot of 2 cm radius. With the joints at 0 its legs point straight down.
pub fn quadruped() -> Arc<RobotModel> {
    let mut links = vec![boxed("trunk", DVec3::ZERO, DVec3::new(0.4, 0.2, 0.1), 6.0)];
    let mut joints = Vec::new();
    for (leg, x, y) in [
        ("front_right", 0.18, -0.05),
        ("front_left", 0.18, 0.05),
        ("rear_right", -0.18, -0.05),
        ("rear_left", -0.18, 0.05),
    ] {
        let first = links.len();
        let side = f64::signum(y) * 0.08;
        let segment = |name: &str, mass: f64| {
            boxed(&format!("{leg}_{name}"), DVec3::Z * -0.1, DVec3::new(0.03, 0.03, 0.16), mass)
        };
        links.push(boxed(&format!("{leg}_hip"), DVec3::ZERO, DVec3::splat(0.06), 0.6));
        links.push(segment("upper", 0.9));
        let mut lower = segment("lower", 0.2);
        lower.collisions.push(Collision {
            link_from_shape: DPose3::from_translation(DVec3::Z * -0.2),
            geometry: Geometry::Sphere { radius: 0.02 },
            material: Material::default(),
        });
        links.push(lower);
        for (part, link, parent, at, axis) in [
            ("hip", first, 0, DVec3::new(x, y, 0.0), DVec3::X),
            ("upper", first + 1, first, DVec3::Y * side, DVec3::Y),
            ("lower", first + 2, first + 1, DVec3::Z * -0.2, DVec3::Y),
        ] {
            joints.push(joint(&format!("{leg}_{part}"), JointKind::Continuous, (parent, link), at, axis));
        }
    }
    Arc::new(RobotModel { name: "quadruped".into(), links, joints, ..RobotModel::default() })
}

/// Sends joints of a robot to positions.
pub fn go_to(world: &mut Simulation, robot: &str, positions: &[(&str, f64)]) {
    let target = |&(joint, position): &(&str, f64)| JointTarget {
        joint: joint.into(),
        axis: 0,
        target: Target::Position {
            position,
            velocity: 0.0,
            stiffness: None,
            damping: None,
            feed_forward: 0.0,
            max_effort: None,
            max_velocity: None,
        },
    };
    let joints = positions.iter().map(target).collect();
    let robots = vec![RobotTargets { robot: robot.into(), joints, ..RobotTargets::default() }];
    apply(world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
}

/// Joints of a standing quadruped: hip, upper and lower joint of a leg, rad.
pub const A1_STANDS: [f64; 3] = [0.0, 0.67, -1.3];

/// Returns an A1 of `pybullet_data` above the ground with bent legs, holding that pose.
pub fn a1(time_step: f64, model: &Arc<RobotModel>) -> Simulation {
    many_a1(time_step, model, 1)
}

/// Returns this many of them in a row, a metre from each other.
pub fn many_a1(time_step: f64, model: &Arc<RobotModel>, count: usize) -> Simulation {
    let mut world = world(time_step);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    let moving = model.joints.iter().filter(|joint| joint.kind.moves());
    let positions: Vec<_> = moving.map(|joint| (joint.name.clone(), a1_angle(&joint.name))).collect();
    for index in 0..count {
        let at = DPose3::from_translation(DVec3::new(0.0, index as f64, 0.36));
        let name = if index == 0 { "a1".to_owned() } else { format!("a1-{index}") };
        let joint_positions = positions.clone();
        spawn(&mut world, Spawn { joint_positions, passive: false, ..robot(&name, model, at, false) });
    }
    world
}

fn a1_angle(joint: &str) -> f64 {
    let part = ["hip", "upper", "lower"].into_iter().position(|part| joint.contains(part));
    part.and_then(|part| A1_STANDS.get(part)).copied().unwrap_or(0.0)
}

/// Returns a free robot that stands on the ground with this height of its root, holding its joints at 0.
pub fn standing(time_step: f64, model: &Arc<RobotModel>, height: f64) -> Simulation {
    let mut world = world(time_step);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    let at = DPose3::from_translation(DVec3::Z * height);
    spawn(&mut world, Spawn { passive: false, ..robot("robot", model, at, false) });
    world
}

/// Once in this many calls, saves the state, does up to `most` steps and restores it. Returns the number of
/// those steps.
pub fn go_back_at_times(
    world: &mut Simulation,
    rng: &mut fastrand::Rng,
    once_in: usize,
    most: usize,
) -> usize {
    if rng.usize(0..once_in) > 0 {
        return 0;
    }
    apply(world, Command::SaveState { name: "here".into() });
    let steps = rng.usize(1..most);
    (0..steps).for_each(|_| world.step());
    apply(world, Command::RestoreState { name: "here".into() });
    steps
}

//! Contacts held against closed forms: sliding, sticking, rolling, bouncing, weight and momentum.

use simd_tests::world::run;
use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use simd_core::collision::{Shapes, Surface};
use simd_core::simulation::command::{
    JointReset, LinkWrench, PhysicsChange, RobotReset, Spawn, WrenchDuration,
};
use simd_core::{Command, Simulation, SurfaceCombination};
use simd_model::robot::{Collision, Geometry, JointKind};
use simd_tests::scenes::*;

const G: f64 = 9.81;

/// Keeps a body from falling asleep, by a push that moves nothing.
pub(crate) fn keep_awake(world: &mut Simulation, robot: &str) {
    let push = LinkWrench {
        robot: robot.into(),
        link: "body".into(),
        force: DVec3::Z * 1e-12,
        torque: DVec3::ZERO,
        in_link_axes: false,
        point: DVec3::ZERO,
        duration: WrenchDuration::UntilCleared,
    };
    apply(world, Command::ApplyWrench(push));
}

fn combine(world: &mut Simulation, combination: SurfaceCombination) {
    let change = PhysicsChange { surface_combination: Some(combination), ..PhysicsChange::default() };
    apply(world, Command::SetPhysics(change));
}

/// Returns a body on a plane that is tilted about y by `angle`, this high above it. Downhill is the second
/// value.
fn on_a_slope(angle: f64, body: Spawn, height: f64, friction: f64, h: f64) -> (Simulation, DVec3) {
    let tilt = DQuat::from_rotation_y(angle);
    let mut world = world(h);
    let slope = robot("slope", &plane(DVec3::Z), DPose3::from_rotation(tilt), true);
    spawn(&mut world, Spawn { contact_settings: surface(friction, 0.0), ..slope });
    let pose = DPose3::from_parts(tilt * DVec3::Z * height, tilt);
    spawn(&mut world, Spawn { pose, contact_settings: surface(friction, 0.0), ..body });
    keep_awake(&mut world, "body");
    (world, tilt * DVec3::X)
}

/// Returns a block of half a metre by half a metre, 0.2 m high.
fn block() -> Spawn {
    robot("body", &cuboid(DVec3::new(0.5, 0.5, 0.2), 2.0), DPose3::IDENTITY, false)
}

/// v = g (sin a - mu cos a) t, Coulomb's law. 1e-3 of it: the block meets the plane in the first step,
/// without a jump.
#[test]
fn a_block_slides_down_a_slope_as_coulombs_law_says() {
    for (h, angle, friction) in [(1e-3, 0.5, 0.3), (1e-3, 0.3, 0.0), (4e-3, 0.7, 0.5)] {
        let (mut world, downhill) = on_a_slope(angle, block(), 0.1, friction, h);
        run(&mut world, 1.0);
        let velocity = look(&world).roots[1].linear.dot(downhill);
        let expected = G * (angle.sin() - friction * angle.cos());
        assert!((velocity / expected - 1.0).abs() < 1e-3, "{angle} {friction}: {velocity} {expected}");
    }
}

/// tan a < mu: it stays. A tenth of a millimetre in ten seconds is not visible; MuJoCo's block of the same
/// friction creeps by 15 mm (`tests/reference/make_contacts.py`).
#[test]
fn a_block_on_a_slope_that_is_rough_enough_stays() {
    for h in [1e-3, 4e-3] {
        let (mut world, downhill) = on_a_slope(0.3, block(), 0.1, 0.4, h);
        run(&mut world, 0.1);
        let start = look(&world).roots[1].pose.translation;
        run(&mut world, 10.0);
        let way = look(&world).roots[1].pose.translation - start;
        assert!(way.length() < 1e-4, "{h}: {way}, {} downhill", way.dot(downhill));
    }
}

/// Coulomb's law as above, with each rule's combination of frictions of 0.6 and 0.4; a change of the rule
/// also applies to existing contacts.
#[test]
fn the_world_says_what_friction_two_surfaces_have() {
    for (combination, friction) in
        [(SurfaceCombination::Min, 0.4), (SurfaceCombination::Multiply, 0.24), (SurfaceCombination::Max, 0.6)]
    {
        let angle: f64 = 0.7;
        let (mut world, downhill) = on_a_slope(angle, block(), 0.1, 0.6, 1e-3);
        let links = surface(0.4, 0.0).links;
        apply(&mut world, Command::SetLinkProperties { robot: "body".into(), links, stays_awake: None });
        run(&mut world, 0.1);
        let before = look(&world).roots[1].linear.dot(downhill);
        combine(&mut world, combination);
        run(&mut world, 1.0);
        let gained = look(&world).roots[1].linear.dot(downhill) - before;
        let expected = G * (angle.sin() - friction * angle.cos());
        assert!((gained / expected - 1.0).abs() < 1e-3, "{combination:?}: {gained} {expected}");
    }
}

/// A ball of restitution 0.8 on ground without restitution: e² of the height, with 1 % for the error of the
/// step.
#[test]
fn the_world_says_how_two_surfaces_bounce() {
    let height = |combination: SurfaceCombination| {
        let mut world = world(1e-3);
        combine(&mut world, combination);
        let ground = robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true);
        spawn(&mut world, Spawn { contact_settings: surface(1.0, 0.0), ..ground });
        let at = DPose3::from_translation(DVec3::Z * 1.1);
        spawn(
            &mut world,
            Spawn { contact_settings: surface(1.0, 0.8), ..robot("ball", &ball(0.1, 1.0), at, false) },
        );
        // It falls for 0.45 s, and rises for 0.36 s if it bounces.
        run(&mut world, 0.5);
        let mut top: f64 = 0.0;
        for _ in 0..500 {
            world.step();
            top = top.max(look(&world).roots[1].pose.translation.z - 0.1);
        }
        top
    };
    for combination in [SurfaceCombination::Min, SurfaceCombination::Max] {
        assert!((height(combination) / 0.64 - 1.0).abs() < 0.01, "{combination:?}: {}", height(combination));
    }
    assert!(height(SurfaceCombination::Multiply) < 1e-3);
}

/// Rolling over each other: each one's friction against rolling is multiplied by the other one's friction, as
/// in Bullet.
#[test]
fn products_of_surfaces_are_bullets() {
    let a = Surface {
        friction: 0.5,
        restitution: 0.9,
        rolling_friction: 0.01,
        spinning_friction: 0.02,
        ..Surface::default()
    };
    let b = Surface { friction: 0.8, restitution: 0.5, rolling_friction: 0.03, ..Surface::default() };
    let both = a.against(b, SurfaceCombination::Multiply);
    let expected = [0.4, 0.45, 0.01 * 0.8 + 0.03 * 0.5, 0.02 * 0.8];
    let found = [both.friction, both.restitution, both.rolling_friction, both.spinning_friction];
    for (found, expected) in found.into_iter().zip(expected) {
        assert!((found - expected).abs() < 1e-15, "{found} {expected}");
    }
    let large = Surface { friction: 1e300, rolling_friction: 1e300, ..a };
    assert!(large.against(large, SurfaceCombination::Multiply).friction.is_finite());
    assert!(large.against(large, SurfaceCombination::Multiply).rolling_friction.is_finite());
}

/// a = 5/7 g sin a for a solid ball, and v = w r. 1e-3 of it.
#[test]
fn a_ball_rolls_down_a_slope_without_slipping() {
    let (angle, radius) = (0.3, 0.1);
    let body = robot("body", &ball(radius, 1.0), DPose3::IDENTITY, false);
    let (mut world, downhill) = on_a_slope(angle, body, radius, 1.0, 1e-3);
    run(&mut world, 1.0);
    let root = &look(&world).roots[1];
    let expected = 5.0 / 7.0 * G * f64::sin(angle);
    let velocity = root.linear.dot(downhill);
    assert!((velocity / expected - 1.0).abs() < 1e-3, "{velocity} {expected}");
    assert!((root.angular.length() * radius / velocity - 1.0).abs() < 1e-3);
}

/// The nth rebound reaches e^2n of the height. A hit is found up to one step's distance above the ground, and
/// rebounds from there. Each rebound may be v h higher, and that is the bound.
#[test]
fn a_ball_bounces_to_the_heights_that_its_restitution_gives() {
    let (height, radius) = (1.0, 0.1);
    for (e, h) in [(0.8f64, 1e-3), (0.5, 1e-3), (0.8, 1e-4), (1.0, 1e-4)] {
        let mut world = world(h);
        spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
        let at = DPose3::from_translation(DVec3::Z * (height + radius));
        let body = robot("body", &ball(radius, 1.0), at, false);
        spawn(&mut world, Spawn { contact_settings: surface(1.0, e), ..body });
        let (mut tops, mut rising, mut before) = (Vec::new(), false, 0.0);
        while tops.len() < 4 {
            world.step();
            let root = look(&world).roots[1].clone();
            let rises = root.linear.z > 0.0;
            if rising && !rises {
                tops.push(before - radius);
            }
            (rising, before) = (rises, root.pose.translation.z);
        }
        let speed = (2.0 * G * height).sqrt();
        for (n, top) in tops.iter().enumerate() {
            let expected = e.powi(2 * (n as i32 + 1)) * height;
            let bound = 2.0 * (n + 1) as f64 * speed * h;
            assert!((top - expected).abs() < bound, "e {e} h {h}, rebound {n}: {top} {expected}");
        }
    }
}

/// At 1 ms it moves 5 mm a step, more than twice the thickness of the wall.
#[test]
fn five_metres_a_second_do_not_pass_a_wall_of_two_millimetres() {
    for (radius, h) in [(0.05, 1e-3), (0.005, 1e-3), (0.001, 1e-3), (0.01, 4e-3)] {
        let mut world = world(h);
        let wall = cuboid(DVec3::new(0.002, 1.0, 1.0), 1.0);
        spawn(&mut world, robot("wall", &wall, DPose3::IDENTITY, true));
        let start = DPose3::from_translation(DVec3::new(-0.2, 0.0, 0.0));
        spawn(&mut world, robot("body", &ball(radius, 0.1), start, false));
        throw(&mut world, "body", DVec3::new(5.0, 0.1, 0.0), DVec3::ZERO);
        run(&mut world, 0.2);
        let x = look(&world).roots[1].pose.translation.x;
        assert!(x < -radius, "a ball of {radius} m at {h} s is at {x}");
    }
}

/// A standing body pushes the ground with its weight: every step, to rounding of the solver.
#[test]
fn standing_bodies_push_the_ground_with_their_weight() {
    let mut world = stack(1e-3);
    (0..10).for_each(|i| keep_awake(&mut world, &format!("box-{i}")));
    run(&mut world, 1.0);
    for _ in 0..100 {
        world.step();
        let ground = contacts(&world, Some("ground"));
        let force: f64 = ground.iter().map(|contact| contact.normal_force).sum();
        assert_eq!(ground.len(), 4);
        assert!((force - 10.0 * G).abs() < 1e-2, "{force}");
        assert!(ground.iter().all(|contact| contact.normal.distance(DVec3::Z) < 1e-9));
    }
}

/// Momentum before and after a hit agrees to the solver's bound, and the body at rest moves on.
#[test]
fn a_hit_moves_both_and_keeps_their_momentum() {
    for (friction, restitution) in [(0.0, 0.0), (1.0, 0.0), (0.5, 0.7)] {
        let mut world = world(1e-3);
        let physics = PhysicsChange { gravity: Some(DVec3::ZERO), ..Default::default() };
        apply(&mut world, Command::SetPhysics(physics));
        let contact_settings = || surface(friction, restitution);
        let at = |x: f64, y: f64| DPose3::from_translation(DVec3::new(x, y, 0.0));
        let small = robot("small", &cuboid(DVec3::splat(0.1), 1.0), at(-0.3, 0.0), false);
        let large = robot("large", &ball(0.1, 3.0), at(0.0, 0.05), false);
        spawn(&mut world, Spawn { contact_settings: contact_settings(), ..small });
        spawn(&mut world, Spawn { contact_settings: contact_settings(), ..large });
        throw(&mut world, "small", DVec3::X * 2.0, DVec3::ZERO);
        run(&mut world, 1.0);
        let seen = look(&world);
        let [a, b] = [&seen.roots[0], &seen.roots[1]];
        let linear = a.linear * 1.0 + b.linear * 3.0;
        assert!(linear.distance(DVec3::X * 2.0) < 1e-5, "{linear}");
        assert!(b.linear.x > 0.3, "{}", b.linear);
        let spin = |root: &simd_core::simulation::published_state::RootState, mass: f64, moment: f64| {
            root.pose.translation.cross(root.linear) * mass + root.angular * moment
        };
        let angular = spin(a, 1.0, 0.01 / 6.0) + spin(b, 3.0, 0.4 * 3.0 * 0.01);
        assert!(angular.length() < 1e-3, "{angular}");
        let energy = a.linear.length_squared() + 3.0 * b.linear.length_squared();
        assert!(energy < 4.0 + 1e-9);
    }
}

/// A prism over a regular polygon of twelve corners, which parry's faces of four corners would not carry. It
/// stands on a plane and on a box without tilting.
#[test]
fn a_hull_with_a_round_sole_stands() {
    use std::sync::Arc;

    use simd_model::robot::{Geometry, MeshAsset, Sha256};
    let corner = |i: u32| {
        let turn = f64::from(i % 12) * std::f64::consts::TAU / 12.0;
        DVec3::new(0.1 * turn.cos(), 0.1 * turn.sin(), if i < 12 { -0.1 } else { 0.1 })
    };
    let vertices = (0..24).map(corner).collect();
    let asset = MeshAsset {
        sha256: Sha256([7; 32]),
        vertices,
        triangles: vec![[0, 1, 2]],
        paints: Vec::new(),
        files: Vec::new(),
        grid: None,
    };
    let mesh = Geometry::Mesh { uri: "prism.stl".into(), scale: DVec3::ONE, asset: Some(Arc::new(asset)) };
    let model = solid(&[(DPose3::IDENTITY, mesh)], 0.05);
    for ground in [plane(DVec3::Z), cuboid(DVec3::new(1.0, 1.0, 0.2), 1.0)] {
        let mut world = world(1e-3);
        spawn(&mut world, robot("ground", &ground, DPose3::IDENTITY, true));
        let top = if ground.links[0].collisions[0].geometry == (Geometry::Plane { normal: DVec3::Z }) {
            0.0
        } else {
            0.1
        };
        let at = DPose3::from_translation(DVec3::Z * (top + 0.101));
        spawn(&mut world, robot("body", &model, at, false));
        keep_awake(&mut world, "body");
        run(&mut world, 5.0);
        let root = &look(&world).roots[1];
        let off = root.pose.translation - DVec3::Z * (top + 0.1);
        assert!(off.length() < 1e-3, "on {:?} it is off by {off}", ground.links[0].collisions[0].geometry);
        assert!((root.pose.rotation * DVec3::Z).z > 0.99999 && root.linear.length() < 1e-3);
    }
}

/// A pad on a joint about the vertical, which can move along one tangent only, under the weight of two rods
/// that slide down. Friction at 1 m brakes it by mu (m1 + m2) g r / I, with I = 1/3 kg m^2 of a rod about its
/// end. 1 %: the pad meets the ground within the first step.
#[test]
fn friction_brakes_what_can_move_along_one_direction_alone() {
    let mut model = crate::chains::chain(2);
    (model.joints[0].kind, model.joints[0].axis) = (JointKind::Prismatic, DVec3::Z);
    (model.joints[1].kind, model.joints[1].axis) = (JointKind::Continuous, DVec3::Z);
    model.links[2].collisions = vec![Collision {
        link_from_shape: DPose3::from_translation(DVec3::X),
        geometry: Geometry::Sphere { radius: 0.05 },
        material: Default::default(),
    }];
    let model = Arc::new(model);
    let mut world = world(1e-3);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    let arm = Spawn {
        pose: DPose3::from_translation(DVec3::Z * 0.05),
        shapes: Arc::new(Shapes::new(&model)),
        contact_settings: surface(0.5, 0.0),
        ..simd_tests::world::passive(&model, false, &[])
    };
    spawn(&mut world, arm);
    let joint =
        JointReset { joint: "joint-2".into(), axis: 0, position: 0.0, velocity: 10.0, ..Default::default() };
    apply(
        &mut world,
        Command::ResetJoints { robots: vec![RobotReset { robot: "robot".into(), joints: vec![joint] }] },
    );
    run(&mut world, 0.2);
    let expected = 10.0 - 0.5 * 2.0 * G * 3.0 * 0.2;
    let velocity = look(&world).velocities[1];
    assert!((velocity / expected - 1.0).abs() < 0.01, "{velocity} {expected}");
    run(&mut world, 0.5);
    let velocity = look(&world).velocities[1];
    assert!(velocity.abs() < 1e-6, "{velocity}");
}

/// The search distance for contacts depends on the speed at which two shapes approach, and not on their speed
/// of fall. At 588 m/s a step of a millisecond moves each by 0.6 m.
#[test]
fn bodies_that_fall_side_by_side_do_not_touch_however_fast() {
    let mut world = world(1e-3);
    for (name, x) in [("left", 0.0), ("right", 0.3)] {
        spawn(&mut world, robot(name, &ball(0.1, 1.0), DPose3::from_translation(DVec3::X * x), false));
    }
    run(&mut world, 60.0);
    let seen = look(&world);
    assert!(seen.roots[0].linear.z < -500.0);
    assert!(seen.contacts.is_empty(), "{} contacts", seen.contacts.len());
}

#[test]
fn a_plane_that_is_not_said_to_be_free_is_fixed() {
    let mut world = world(1e-3);
    spawn(
        &mut world,
        Spawn { fixed_base: None, ..robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true) },
    );
    spawn(&mut world, Spawn { pose: DPose3::from_translation(DVec3::Z * 0.1), ..block() });
    run(&mut world, 1.0);
    let seen = look(&world);
    assert!((seen.roots[1].pose.translation.z - 0.1).abs() < 1e-3 && seen.roots[0].linear.z == 0.0);
}

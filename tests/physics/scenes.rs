//! Robots that touch: they stand, walk, push, grip and hit. The bounds of the stack and the slope are
//! from MuJoCo, whose soft contacts sink and creep by more; the others are what a person would call
//! standing, holding or pushed. The gait was tuned until it walked.

use glamx::{DPose3, DVec3};
use simd_core::Simulation;
use simd_core::simulation::command::Spawn;
use simd_tests::{robots, scenes::*};

fn run(world: &mut Simulation, seconds: f64) {
    let steps = (seconds / world.settings().time_step).round() as u64;
    (0..steps).for_each(|_| world.step());
}

fn normal_force(world: &Simulation, robot: &str) -> f64 {
    contacts(world, Some(robot)).iter().map(|contact| contact.normal_force).sum()
}

/// On four feet, which carry its weight to 0.1 %, without drifting by a tenth of a millimetre in
/// ten seconds.
#[test]
fn an_a1_stands_still_on_its_feet() {
    let (model, _) = robots::read("pybullet_data/a1/a1.urdf");
    let mass: f64 = model.links.iter().map(|link| link.inertial.mass).sum();
    for time_step in [1e-3, 2e-3] {
        let mut world = a1(time_step, &model);
        run(&mut world, 2.0);
        let start = look(&world).roots[1].pose;
        run(&mut world, 10.0);
        let end = look(&world).roots[1].pose;
        assert!(start.translation.distance(end.translation) < 1e-4);
        assert!(start.rotation.angle_between(end.rotation) < 1e-4);
        let feet = contacts(&world, Some("a1"));
        assert!(feet.len() == 4 && feet.iter().all(|foot| foot.links[1].ends_with("toe")), "{feet:?}");
        assert!((normal_force(&world, "a1") / (mass * 9.81) - 1.0).abs() < 1e-3);
    }
}

/// A trot: pairs of opposite legs swing and push in turn, open loop. In eight seconds it goes at
/// least 0.3 m ahead, stays up, and no foot sinks into the ground by 1 mm.
#[test]
fn an_a1_walks_a_scripted_gait() {
    let (model, _) = robots::read("pybullet_data/a1/a1.urdf");
    let mut world = a1(1e-3, &model);
    run(&mut world, 1.0);
    let start = look(&world).roots[1].pose.translation;
    let mut deepest = 0.0f64;
    for step in 0..8_000u32 {
        let phase = f64::from(step) * 1e-3 * std::f64::consts::TAU / 0.3;
        if step % 10 == 0 {
            let mut joints = Vec::new();
            for (leg, shift) in [("FR", 0.0), ("RL", 0.0), ("FL", 0.5), ("RR", 0.5)] {
                let phase = phase + shift * std::f64::consts::TAU;
                // The foot goes back while it is down, and ahead while the knee lifts it.
                let (swing, lift) = (phase.cos(), (-phase.sin()).max(0.0));
                joints.push((format!("{leg}_upper_joint"), A1_STANDS[1] - 0.05 * swing + 0.15 * lift));
                joints.push((format!("{leg}_lower_joint"), A1_STANDS[2] - 0.3 * lift));
            }
            let joints: Vec<(&str, f64)> = joints.iter().map(|(name, q)| (name.as_str(), *q)).collect();
            go_to(&mut world, "a1", &joints);
        }
        world.step();
        deepest = contacts(&world, Some("ground")).iter().map(|foot| foot.depth).fold(deepest, f64::max);
    }
    let root = look(&world).roots[1].pose;
    let way = root.translation - start;
    assert!(way.x > 0.3 && root.translation.z > 0.25, "{way}");
    assert!((root.rotation * DVec3::Z).z > 0.9, "it stands upright");
    assert!(deepest < 1e-3, "{deepest}");
}

/// 20 N on each side of a cube of 0.2 kg, whose weight is 2 N. Held for ten seconds it slips by less
/// than a tenth of a millimetre.
#[test]
fn a_gripper_closes_on_a_cube_lifts_it_and_holds_it() {
    let mut world = world(1e-3);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    let cube = DPose3::from_translation(DVec3::Z * 0.03);
    spawn(&mut world, robot("cube", &cuboid(DVec3::splat(0.06), 0.2), cube, false));
    let base = DPose3::from_translation(DVec3::Z * 0.01);
    spawn(&mut world, Spawn { passive: false, ..robot("gripper", &gripper(), base, true) });
    go_to(&mut world, "gripper", &[("left", 0.1), ("right", 0.1)]);
    run(&mut world, 1.0);
    let grip = contacts(&world, Some("cube"));
    let left: f64 = grip.iter().filter(|c| c.links.contains(&"left".into())).map(|c| c.normal_force).sum();
    assert!((left - 20.0).abs() < 1.0, "{left} N");
    go_to(&mut world, "gripper", &[("lift", 0.5)]);
    run(&mut world, 3.0);
    let lifted = look(&world).roots[1].pose.translation;
    assert!((lifted.z - 0.53).abs() < 2e-3, "{lifted}");
    run(&mut world, 10.0);
    let held = look(&world).roots[1].pose.translation;
    assert!(held.distance(lifted) < 1e-4, "{lifted} {held}");
    assert!(contacts(&world, Some("ground")).is_empty());
    go_to(&mut world, "gripper", &[("left", 0.0), ("right", 0.0)]);
    run(&mut world, 2.0);
    assert!(look(&world).roots[1].pose.translation.z < 0.1, "it falls when it is let go");
}

/// From a right angle; where it hits the wall it stops, as restitution 0 has it, and stays there.
#[test]
fn a_pendulum_hits_a_wall_and_rests_against_it() {
    let mut world = world(1e-3);
    let wall = DPose3::from_translation(DVec3::new(-0.17, 0.0, -0.9));
    spawn(&mut world, robot("wall", &cuboid(DVec3::new(0.1, 1.0, 0.4), 1.0), wall, true));
    let start = Spawn {
        joint_positions: vec![("hinge".into(), -1.4)],
        ..robot("pendulum", &pendulum(1.0, 1.0), DPose3::IDENTITY, true)
    };
    spawn(&mut world, start);
    let mut farthest = f64::NEG_INFINITY;
    for _ in 0..3_000 {
        world.step();
        farthest = farthest.max(look(&world).positions[0]);
    }
    // The rod's face is 2 cm from its middle, and the wall's at x = -0.12, down to z = -1.1: the rod's
    // lower corner meets it at sin q + 0.02 cos q = 0.12.
    let expected = (0.12f64 / (1.0f64 + 0.02 * 0.02).sqrt()).asin() - 0.02f64.atan();
    assert!((farthest - expected).abs() < 2e-3, "{farthest} {expected}");
    let seen = look(&world);
    assert!((seen.positions[0] - expected).abs() < 0.3 && seen.velocities[0].abs() < 5.0);
}

/// A hand on a rail pushes a box of 1 kg along; it keeps in front of the hand. The ground pulls back
/// with mu (m g + v), where v is what the hand pushes down or up with by friction of their own, at
/// most mu f: f is between mu m g / (1 + mu^2) and mu m g / (1 - mu^2).
#[test]
fn a_robot_pushes_a_box_along() {
    let mut world = world(1e-3);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    let at = DPose3::from_translation(DVec3::new(0.3, 0.0, 0.1));
    let body = robot("box", &cuboid(DVec3::splat(0.2), 1.0), at, false);
    spawn(&mut world, Spawn { touches: surface(0.5, 0.0), ..body });
    // The gripper's rail lies along x.
    let turn = glamx::DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
    let base = DPose3::from_parts(DVec3::new(-0.2, 0.0, 0.1), turn);
    spawn(&mut world, Spawn { passive: false, ..robot("gripper", &gripper(), base, true) });
    go_to(&mut world, "gripper", &[("lift", 0.8), ("left", 0.06), ("right", 0.06)]);
    run(&mut world, 1.5);
    let pushed = contacts(&world, Some("gripper"));
    let force: f64 = pushed.iter().map(|contact| contact.normal_force).sum();
    assert!((0.5 * 9.81 / 1.25..0.5 * 9.81 / 0.75).contains(&force), "{force} N");
    run(&mut world, 4.0);
    let end = look(&world).roots[1].pose.translation;
    // The hand ends at -0.2 + 0.8 + 0.225; while it slows down, the box slides on a little.
    let seen = look(&world);
    assert!((0.924..0.95).contains(&end.x) && end.y.abs() < 0.01, "{end}");
    assert!((seen.positions[0] - 0.8).abs() < 1e-3 && seen.roots[1].linear.length() < 1e-3);
}

/// Two driven rods turn into each other: the weaker one is pushed back, and neither passes.
#[test]
fn two_arms_collide_and_the_weaker_gives_way() {
    let mut world = world(1e-3);
    for (name, x, effort) in [("left", -0.3, 30.0), ("right", 0.3, 10.0)] {
        let mut model = (*pendulum(1.0, 1.0)).clone();
        model.joints[0].limits.effort = Some(effort);
        let at = DPose3::from_translation(DVec3::new(x, 0.0, 2.0));
        let model = std::sync::Arc::new(model);
        spawn(&mut world, Spawn { passive: false, ..robot(name, &model, at, true) });
    }
    // About y a positive angle moves the lower end towards -x: both turn towards the other.
    go_to(&mut world, "left", &[("hinge", -0.8)]);
    go_to(&mut world, "right", &[("hinge", 0.8)]);
    run(&mut world, 4.0);
    let seen = look(&world);
    let (left, right) = (seen.positions[0], seen.positions[1]);
    assert!(left < -0.5 && right < 0.0, "the stronger one pushes the other back: {left} {right}");
    let tip = |x: f64, q: f64| DVec3::new(x - f64::sin(q), 0.0, 2.0 - f64::cos(q));
    assert!(tip(-0.3, left).x < tip(0.3, right).x, "they have not passed");
    assert!(normal_force(&world, "left") > 5.0);
}

/// A thousand, in a box: none is lost, none is deeper in another than a tenth of its radius, and they
/// come to rest.
#[test]
fn a_thousand_balls_fall_into_a_box_and_stay_there() {
    let mut world = rain(2e-3, 1_000);
    let mut deepest = 0.0f64;
    for _ in 0..10 {
        run(&mut world, 0.1);
        deepest = contacts(&world, None).iter().map(|contact| contact.depth).fold(deepest, f64::max);
    }
    let seen = look(&world);
    for root in &seen.roots[1..] {
        let at = root.pose.translation;
        assert!(at.x.abs() < 0.451 && at.y.abs() < 0.451 && at.z > 0.049, "{at}");
        assert!(root.linear.length() < 1.0);
    }
    let energy: f64 = seen.roots[1..].iter().map(|root| 0.05 * root.linear.length_squared()).sum();
    assert!(deepest < 5e-3 && energy < 1.0, "{deepest} {energy}");
}

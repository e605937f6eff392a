//! Collision filters: groups, masks, pairs and self-collision, and their change in a running world.

use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use simd_core::Command;
use simd_core::Simulation;
use simd_core::collision::Shapes;
use simd_core::simulation::Saved;
use simd_core::simulation::command::{
    CollisionFilterChange, CollisionPair, ContactSettings, JointTarget, LinkProperties, Reload, ResetScope,
    RobotTargets, SetTargets, Spawn, Target,
};
use simd_model::RobotModel;
use simd_model::robot::{Collision, Geometry, Inertial, Joint, JointKind, JointLimits, Link, Material};
use simd_tests::scenes::{apply, contacts, cuboid, look, plane, robot, spawn, world};

use crate::saved_state_files::through_a_file;

/// Returns a box of 20 cm that has come to rest on a plane and sleeps.
fn box_on_plane() -> Simulation {
    let mut world = world(1e-3);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    let at = DPose3::from_translation(DVec3::Z * 0.1);
    spawn(&mut world, robot("box", &cuboid(DVec3::splat(0.2), 1.0), at, false));
    (0..1_500).for_each(|_| world.step());
    assert!(height(&world, "box") > 0.0999 && !contacts(&world, None).is_empty());
    world
}

fn height(world: &Simulation, name: &str) -> f64 {
    let seen = look(world);
    seen.roots[seen.entity(name).unwrap().0].pose.translation.z
}

fn pair(link: &str, other_robot: &str, other_link: &str, enabled: Option<bool>) -> CollisionPair {
    CollisionPair {
        link: link.into(),
        other_robot: other_robot.into(),
        other_link: other_link.into(),
        enabled,
    }
}

fn set(world: &mut Simulation, robot: &str, self_collision: Option<bool>, pairs: Vec<CollisionPair>) {
    let change = CollisionFilterChange { robot: robot.into(), self_collision, pairs };
    apply(world, Command::SetCollisionFilter(change));
}

fn groups(world: &mut Simulation, robot: &str, group: u32, mask: u32) {
    let links = vec![LinkProperties {
        collision_group: Some(group),
        collision_mask: Some(mask),
        ..LinkProperties::default()
    }];
    apply(world, Command::SetLinkProperties { robot: robot.into(), links, stays_awake: None });
}

/// Free fall over n steps of h from rest is `g h^2 n (n + 1) / 2` in semi-implicit Euler and `g (n h)^2 / 2`
/// in the limit: 1 % covers both.
fn assert_falls(world: &mut Simulation, from: f64) {
    (0..200).for_each(|_| world.step());
    let fallen = from - height(world, "box");
    assert!((fallen / (0.5 * 9.81 * 0.2 * 0.2) - 1.0).abs() < 0.01, "{fallen}");
}

#[test]
fn a_pair_that_is_switched_off_wakes_what_slept_and_drops_its_contacts() {
    let mut world = box_on_plane();
    let before = height(&world, "box");
    set(&mut world, "box", None, vec![pair("body", "ground", "body", Some(false))]);
    assert!(contacts(&world, None).is_empty());
    assert_falls(&mut world, before);
}

/// The fixed side has the setting, and the other one sleeps.
#[test]
fn a_pair_can_be_set_from_either_side() {
    let mut world = box_on_plane();
    let before = height(&world, "box");
    set(&mut world, "ground", None, vec![pair("body", "box", "body", Some(false))]);
    assert_falls(&mut world, before);
    // From the other side, the pair follows its groups again: the box is below the ground now, and is pushed
    // out.
    set(&mut world, "box", None, vec![pair("body", "ground", "body", None)]);
    assert_eq!(look(&world).collision_pairs.len(), 0);
    (0..2_000).for_each(|_| world.step());
    assert!((height(&world, "box") - 0.1).abs() < 1e-2, "{}", height(&world, "box"));
}

#[test]
fn one_side_must_touch_a_group_of_the_other_and_pairs_win_over_them() {
    let mut world = box_on_plane();
    let before = height(&world, "box");
    groups(&mut world, "box", 2, !1);
    assert!(!contacts(&world, None).is_empty(), "the ground touches all groups");
    groups(&mut world, "ground", 1, 1);
    assert!(contacts(&world, None).is_empty());
    set(&mut world, "box", None, vec![pair("body", "ground", "body", Some(true))]);
    (0..200).for_each(|_| world.step());
    assert!((height(&world, "box") - before).abs() < 1e-4, "switched on, whatever groups say");
    set(&mut world, "box", None, vec![pair("body", "ground", "body", None)]);
    assert_falls(&mut world, before);
    let settings = &look(&world).settings[1].groups[0];
    assert_eq!((settings.group, settings.mask), (2, !1));
}

#[test]
fn a_mask_of_what_cannot_move_wakes_what_sleeps_beside_it() {
    let mut world = box_on_plane();
    let before = height(&world, "box");
    groups(&mut world, "ground", 0, 0);
    assert_falls(&mut world, before);
}

/// Returns a chain of boxes along x, each on a hinge about y and 0.3 m from the previous one. The boxes have
/// 0.2 m, so that they are apart.
fn chain(links: usize, spacing: f64) -> Arc<RobotModel> {
    let shape = Collision {
        link_from_shape: DPose3::IDENTITY,
        geometry: Geometry::Box { size: DVec3::splat(0.2) },
        material: Material::default(),
    };
    let inertial = Inertial {
        mass: 1.0,
        center_of_mass: DVec3::ZERO,
        inertia: glamx::DMat3::from_diagonal(DVec3::splat(0.01)),
    };
    let link = |i: usize| Link {
        name: format!("l{i}"),
        inertial,
        visuals: Vec::new(),
        collisions: vec![shape.clone()],
    };
    let joint = |i: usize| Joint {
        name: format!("j{i}"),
        kind: JointKind::Continuous,
        parent: i,
        child: i + 1,
        parent_from_joint: DPose3::from_translation(DVec3::X * spacing),
        axis: DVec3::Y,
        limits: JointLimits::default(),
        damping: 0.0,
        friction: 0.0,
        mimic: None,
    };
    Arc::new(RobotModel {
        name: "chain".into(),
        links: (0..links).map(link).collect(),
        joints: (0..links - 1).map(joint).collect(),
        ..RobotModel::default()
    })
}

/// Returns a chain whose first box is at the place of the third: l0 is folded over.
fn folded(self_collision: bool, pairs: Vec<CollisionPair>) -> Spawn {
    let contact_settings = ContactSettings { self_collision, ..ContactSettings::default() };
    let base = DPose3::from_translation(DVec3::Z * 5.0);
    Spawn {
        contact_settings,
        collision_pairs: pairs,
        joint_positions: vec![("j0".into(), 1.0), ("j1".into(), 1.0)],
        ..robot("chain", &chain(4, 0.3), base, true)
    }
}

/// Pairs of links that may touch, by number.
fn touching(world: &mut Simulation) -> Vec<[String; 2]> {
    (0..400).for_each(|_| world.step());
    let mut pairs: Vec<[String; 2]> = contacts(world, None).into_iter().map(|at| at.links).collect();
    pairs.dedup();
    pairs
}

/// The last link swings against the first ones; the filter selects those that it hits.
#[test]
fn own_pairs_are_switched_by_name_where_the_robot_touches_itself() {
    let run = |self_collision, pairs| {
        let mut world = world(1e-3);
        spawn(&mut world, folded(self_collision, pairs));
        // Folds the second hinge, against gravity.
        let joints = vec![JointTarget { joint: "j1".into(), axis: 0, target: Target::Effort(40.0) }];
        let robots = vec![RobotTargets { robot: "chain".into(), joints, ..RobotTargets::default() }];
        apply(&mut world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
        let mut seen = Vec::new();
        for _ in 0..10 {
            seen.extend(touching(&mut world));
        }
        seen
    };
    let has = |seen: &[[String; 2]], a: &str, b: &str| seen.contains(&[a.to_owned(), b.to_owned()]);
    let all = run(true, Vec::new());
    assert!(has(&all, "l0", "l3") && has(&all, "l1", "l3"), "{all:?}");
    assert!(
        !all.iter().any(|[a, b]| a[1..].parse::<i32>().unwrap() + 1 == b[1..].parse::<i32>().unwrap()),
        "{all:?}"
    );
    let off = run(true, vec![pair("l3", "", "l0", Some(false))]);
    assert!(!has(&off, "l0", "l3") && has(&off, "l1", "l3"), "{off:?}");
    let none = run(false, vec![pair("l0", "", "l3", Some(true))]);
    assert!(none.is_empty(), "without self-collision: {none:?}");
}

/// Neighbours 0.15 m apart, whose boxes of 0.2 m overlap as they are spawned and separate as they turn.
/// Enabled later, they are an initial overlap and are not thrown apart.
#[test]
fn neighbours_that_are_switched_on_overlap_at_first_and_are_let_go() {
    let mut world = world(1e-3);
    let contact_settings = ContactSettings { self_collision: true, ..ContactSettings::default() };
    let base = DPose3::from_translation(DVec3::Z * 5.0);
    let asked = Spawn { contact_settings, ..robot("chain", &chain(2, 0.15), base, true) };
    spawn(&mut world, asked);
    world.step();
    set(&mut world, "chain", None, vec![pair("l0", "", "l1", Some(true))]);
    world.step();
    assert!(contacts(&world, None).is_empty());
    assert!(look(&world).velocities[0].abs() < 0.1, "{:?}", look(&world).velocities);
    // Apart, and at each other again.
    set(&mut world, "chain", None, vec![pair("l0", "", "l1", None)]);
    assert!(look(&world).settings[0].collision_pairs.is_empty());
}

#[test]
fn a_change_that_is_refused_changes_nothing_and_says_what_is_wrong() {
    let mut world = box_on_plane();
    let before = world.fingerprint();
    let mut refusal = |pairs: Vec<CollisionPair>| {
        let change = CollisionFilterChange { robot: "box".into(), self_collision: Some(true), pairs };
        world.apply(&Command::SetCollisionFilter(change)).unwrap_err().to_string()
    };
    let good = pair("body", "ground", "body", Some(false));
    assert!(refusal(vec![good.clone(), pair("body", "moon", "body", Some(false))]).contains("moon"));
    assert!(refusal(vec![good.clone(), pair("lid", "ground", "body", Some(false))]).contains("lid"));
    let own = refusal(vec![good, pair("body", "", "body", Some(false))]);
    assert_eq!(own, "pairs[1].other_link is \"body\"; it must be another link");
    assert_eq!(world.fingerprint(), before);
}

/// Filters are part of the state: of its fingerprint, and of saved, exported and restored states.
#[test]
fn filters_are_saved_restored_and_exported() {
    let mut world = box_on_plane();
    spawn(&mut world, folded(true, vec![pair("l0", "", "l2", Some(false))]));
    let before = world.fingerprint();
    apply(&mut world, Command::SaveState { name: "before".into() });
    set(&mut world, "chain", Some(false), vec![pair("l1", "box", "body", Some(true))]);
    let changed = world.fingerprint();
    assert_ne!(changed, before);
    set(&mut world, "box", None, vec![pair("body", "ground", "body", Some(false))]);
    assert_ne!(world.fingerprint(), changed);
    groups(&mut world, "box", 4, 2);
    (0..5).for_each(|_| world.step());
    apply(&mut world, Command::SaveState { name: "after".into() });
    let saved = through_a_file(&world, "after");
    let mut other = imported(saved);
    assert_eq!(other.fingerprint(), world.fingerprint());
    let (seen, there) = (look(&world), look(&other));
    assert_eq!((&seen.settings, &seen.collision_pairs), (&there.settings, &there.collision_pairs));
    assert_eq!(seen.collision_pairs.len(), 2);
    for _ in 0..300 {
        world.step();
        other.step();
        assert_eq!(other.fingerprint(), world.fingerprint());
    }
    apply(&mut world, Command::RestoreState { name: "before".into() });
    assert_eq!(world.fingerprint(), before);
    let seen = look(&world);
    assert!(seen.collision_pairs.is_empty() && seen.settings[2].self_collision);
    assert_eq!(seen.settings[2].collision_pairs.len(), 1);
}

fn imported(saved: Saved) -> Simulation {
    let mut other = world(1e-3);
    apply(&mut other, Command::ImportSavedState { name: "it".into(), saved });
    apply(&mut other, Command::RestoreState { name: "it".into() });
    other
}

/// Indices of robots and links move; filters stay with the names.
#[test]
fn pairs_follow_robots_that_go_and_links_that_move() {
    let mut world = world(1e-3);
    let at = |z: f64| DPose3::from_parts(DVec3::Z * z, DQuat::IDENTITY);
    let block = cuboid(DVec3::splat(0.2), 1.0);
    spawn(&mut world, robot("first", &block, at(9.0), true));
    spawn(&mut world, Spawn { loaded_at_start: true, ..robot("ground", &plane(DVec3::Z), at(0.0), true) });
    spawn(&mut world, robot("middle", &block, at(7.0), true));
    spawn(&mut world, Spawn { loaded_at_start: true, ..robot("box", &block, at(0.1), false) });
    spawn(&mut world, folded(true, vec![pair("l0", "", "l3", Some(true))]));
    let off = Some(false);
    set(
        &mut world,
        "box",
        None,
        vec![pair("body", "ground", "body", off), pair("body", "first", "body", off)],
    );
    set(
        &mut world,
        "chain",
        None,
        vec![pair("l3", "middle", "body", off), pair("l1", "middle", "body", off)],
    );
    apply(&mut world, Command::Delete { robot: "first".into() });
    let pairs = |world: &Simulation| {
        let seen = look(world);
        let name = |robot: usize, link: usize| {
            let entity = &seen.world.entities[robot];
            format!("{}/{}", entity.name, entity.model.links[link].name)
        };
        let both = |of: &simd_core::collision::RobotLinkPair| {
            [0, 1].map(|side| name(of.robots[side], of.pair.links[side])).join(" ")
        };
        seen.collision_pairs.iter().map(both).collect::<Vec<_>>()
    };
    assert_eq!(pairs(&world), ["ground/body box/body", "middle/body chain/l1", "middle/body chain/l3"]);
    // The chain without its last link, and with another first one.
    let mut model = (*chain(3, 0.3)).clone();
    model.links[0].name = "root".into();
    model.links.iter_mut().skip(1).enumerate().for_each(|(i, link)| link.name = format!("l{}", i + 2));
    let model = Arc::new(model);
    let shapes = Arc::new(Shapes::new(&model));
    apply(&mut world, Command::Reload(Box::new(Reload { robot: "chain".into(), model, shapes })));
    assert_eq!(pairs(&world), ["ground/body box/body", "middle/body chain/l3"]);
    assert!(look(&world).settings[3].collision_pairs.is_empty(), "l0 is gone");
    assert!(look(&world).settings[3].self_collision);
    apply(&mut world, Command::Reset(ResetScope { spawned: true, ..ResetScope::default() }));
    assert_eq!(pairs(&world), ["ground/body box/body"]);
    assert_falls(&mut world, 0.1);
}

/// Four links of 600 shapes are 6 * 600^2 pairs, none of which is listed; as many shapes of one link are not
/// a pair.
#[test]
fn a_robot_of_too_many_pairs_of_shapes_is_refused_where_it_is_to_touch_itself() {
    let mut model = (*chain(4, 0.3)).clone();
    for link in &mut model.links {
        link.collisions = vec![link.collisions[0].clone(); 600];
    }
    let model = Arc::new(model);
    let named = |name: &str, model: &Arc<RobotModel>, self_collision: bool| {
        let contact_settings = ContactSettings { self_collision, ..ContactSettings::default() };
        Spawn { contact_settings, ..robot(name, model, DPose3::IDENTITY, true) }
    };
    let mut world = world(1e-3);
    let refusal = |world: &mut Simulation, command: Command| {
        let before = world.fingerprint();
        let refused = world.apply(&command).unwrap_err().to_string();
        assert_eq!(world.fingerprint(), before);
        assert!(refused.contains("2160000") && refused.contains("1000000"), "{refused}");
        assert!(refused.contains("hull"), "{refused}");
    };
    refusal(&mut world, Command::Spawn(Box::new(named("heap", &model, true))));
    spawn(&mut world, named("heap", &model, false));
    let change =
        CollisionFilterChange { robot: "heap".into(), self_collision: Some(true), pairs: Vec::new() };
    refusal(&mut world, Command::SetCollisionFilter(change));
    spawn(&mut world, named("few", &chain(4, 0.3), true));
    let shapes = Arc::new(Shapes::new(&model));
    refusal(&mut world, Command::Reload(Box::new(Reload { robot: "few".into(), model, shapes })));
    let mut one = (*cuboid(DVec3::splat(0.2), 1.0)).clone();
    one.links[0].collisions = vec![one.links[0].collisions[0].clone(); 2_400];
    spawn(&mut world, named("one", &Arc::new(one), true));
}

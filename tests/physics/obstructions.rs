//! A joint that contacts keep from its target reports the body that blocks it.

use glamx::{DPose3, DVec3};
use simd_core::Simulation;
use simd_core::simulation::command::*;
use simd_tests::robots::from_text;
use simd_tests::scenes::*;
use simd_tests::world::{at, run};

use crate::holding::set_targets;

/// An arm of two links of 0.4 m on a post, which turns about z, and a gripper's slide at its end.
const ARM: &str = r#"<robot name="arm"><link name="post"/>
<link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0.2 0 0"/><geometry><box size="0.3 0.05 0.05"/></geometry></collision></link>
<link name="lower"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0.2 0 0"/><geometry><box size="0.3 0.05 0.05"/></geometry></collision></link>
<link name="slide"><inertial><mass value="0.1"/>
<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.04 0.04 0.04"/></geometry></collision></link>
<joint name="shoulder" type="revolute"><parent link="post"/><child link="upper"/><origin xyz="0 0 0.5"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="50" velocity="2"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="50" velocity="2"/></joint>
<joint name="slide" type="prismatic"><parent link="lower"/><child link="slide"/><origin xyz="0.4 0 0"/><axis xyz="1 0 0"/>
<limit lower="0" upper="0.3" effort="50" velocity="2"/></joint></robot>"#;

/// Returns the arm, and a crate that cannot move at a place.
fn scene(crate_at: DPose3) -> Simulation {
    let mut world = world(1e-3);
    spawn(&mut world, Spawn { passive: false, ..robot("arm", &from_text(ARM), DPose3::IDENTITY, true) });
    spawn(&mut world, robot("crate", &cuboid(DVec3::splat(0.2), 1.0), crate_at, true));
    world
}

/// Names of the joint, its link, and the blocking robot and link, for blocked joints of the first robot.
fn blocked(world: &Simulation) -> Vec<[String; 4]> {
    let seen = look(world);
    let model = &seen.world.entities[0].model;
    let name = |found: simd_core::simulation::obstructions::Obstruction| {
        let by = &seen.world.entities[found.by_robot];
        [
            model.joints[found.joint].name.clone(),
            model.links[found.link].name.clone(),
            by.name.clone(),
            by.model.links[found.by_link].name.clone(),
        ]
    };
    seen.obstructions(0).into_iter().map(name).collect()
}

fn names(of: [&str; 4]) -> [String; 4] {
    of.map(str::to_owned)
}

#[test]
fn a_joint_that_is_stopped_on_its_way_names_the_link_that_stops_it() {
    let mut world = scene(at(0.45, 0.35, 0.5));
    set_targets(&mut world, "arm", &[("shoulder", Target::position(1.5))]);
    run(&mut world, 0.1);
    assert!(blocked(&world).is_empty(), "it is on its way");
    run(&mut world, 3.0);
    let found = blocked(&world);
    assert!(found.contains(&names(["shoulder", "lower", "crate", "body"])), "{found:?}");
    // Behind the crate nothing holds it.
    apply(&mut world, simd_core::Command::Delete { robot: "crate".into() });
    run(&mut world, 3.0);
    assert!(blocked(&world).is_empty(), "{:?}", blocked(&world));
}

#[test]
fn joints_that_turn_or_slide_by_velocity_name_what_stops_them() {
    let mut world = scene(at(1.05, 0.0, 0.5));
    set_targets(&mut world, "arm", &[("slide", Target::velocity(0.5))]);
    run(&mut world, 2.0);
    assert_eq!(blocked(&world), [names(["slide", "slide", "crate", "body"])]);
    let mut world = scene(at(0.5, 0.25, 0.5));
    set_targets(&mut world, "arm", &[("elbow", Target::velocity(1.0))]);
    run(&mut world, 2.0);
    let found = blocked(&world);
    assert!(found.contains(&names(["elbow", "lower", "crate", "body"])), "{found:?}");
}

#[test]
fn a_joint_that_reaches_its_target_or_pushes_on_request_is_not_blocked() {
    let mut world = scene(at(1.05, 0.0, 0.5));
    set_targets(&mut world, "arm", &[("shoulder", Target::position(0.0)), ("slide", Target::position(0.05))]);
    run(&mut world, 2.0);
    assert!(blocked(&world).is_empty(), "{:?}", blocked(&world));
    set_targets(&mut world, "arm", &[("slide", Target::Effort(5.0))]);
    run(&mut world, 2.0);
    assert!(blocked(&world).is_empty(), "an effort has no place to reach");
}

/// Feet carry the robot: their contacts take all of the actuators' efforts, and all joints are at their
/// targets.
#[test]
fn a_robot_that_stands_is_not_blocked_by_the_ground() {
    let mut world = world(1e-3);
    spawn(
        &mut world,
        Spawn {
            passive: false,
            ..robot("dog", &quadruped(), DPose3::from_translation(DVec3::Z * 0.5), false)
        },
    );
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    run(&mut world, 3.0);
    assert!(!look(&world).contacts.is_empty());
    assert!(blocked(&world).is_empty(), "{:?}", blocked(&world));
}

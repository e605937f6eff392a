//! Selections over a small world.

use super::*;
use crate::convert::test_world::{publish, simulation, spawn};

fn select(robot: &str, joints: &[&str]) -> JointSelection {
    JointSelection { robot: robot.into(), joints: joints.iter().map(|name| (*name).into()).collect() }
}

#[test]
fn no_selection_is_all_joints_of_all_robots_in_the_order_of_their_spawning() {
    let states = Selection::default().states(&publish(&simulation(), 7)).unwrap();
    assert_eq!(states.stamp.unwrap().sequence, 7);
    let robots: Vec<_> = states.robots.iter().map(|robot| robot.robot.as_str()).collect();
    assert_eq!(robots, ["left", "right"]);
    for (robot, sign) in states.robots.iter().zip([1.0, -1.0]) {
        // Shoulder, puck x y angle, slide.
        assert_eq!(robot.position, [0.25 * sign, 0.0, 0.0, 0.0, 0.5 * sign]);
        for length in [robot.velocity.len(), robot.effort.len(), robot.target.len()] {
            assert_eq!(length, 5);
        }
        assert_eq!(robot.mode, [v1::JointMode::Hold as i32; 5]);
        assert_eq!(robot.flags.len(), 5);
    }
}

#[test]
fn a_subset_comes_in_the_order_asked_for() {
    let wanted = vec![select("right", &["slide", "tool", "shoulder"]), select("left", &["puck"])];
    let states = Selection::new(wanted).states(&publish(&simulation(), 1)).unwrap();
    assert_eq!(states.robots[0].robot, "right");
    assert_eq!(states.robots[0].position, [-0.5, -0.25], "a fixed joint has no values");
    assert_eq!(states.robots[0].mode.len(), 2);
    assert_eq!(states.robots[1].robot, "left");
    assert_eq!(states.robots[1].position, [0.0; 3]);
}

#[test]
fn unknown_names_are_refused_by_name() {
    let state = publish(&simulation(), 1);
    let refused = |selection| Selection::new(vec![selection]).states(&state).unwrap_err();
    let Error::RobotNotFound { robot, known } = refused(select("middle", &[])) else { panic!() };
    assert_eq!((robot.as_str(), known), ("middle", vec!["left".to_owned(), "right".to_owned()]));
    let Error::JointNotFound { robot, joint, .. } = refused(select("left", &["elbow"])) else { panic!() };
    assert_eq!((robot.as_str(), joint.as_str()), ("left", "elbow"));
}

#[test]
fn a_selection_follows_the_robots_of_the_world() {
    let mut simulation = simulation();
    let mut all = Selection::default();
    let mut left = Selection::new(vec![select("left", &["slide"])]);
    assert_eq!(all.states(&publish(&simulation, 1)).unwrap().robots.len(), 2);
    let before = left.states(&publish(&simulation, 1)).unwrap().robots.remove(0);

    simulation.apply(&simd_core::Command::Delete { robot: "left".into() }).unwrap();
    assert_eq!(all.states(&publish(&simulation, 2)).unwrap().robots.len(), 1);
    assert!(left.states(&publish(&simulation, 2)).is_err());

    simulation.apply(&spawn("left", &[("slide", 0.75)])).unwrap();
    let after = left.states(&publish(&simulation, 3)).unwrap().robots.remove(0);
    assert_eq!(after.position, [0.75]);
    assert_ne!(after.layout_version, before.layout_version);
}

#[test]
fn names_are_looked_up_once_a_layout() {
    let simulation = simulation();
    let mut selection = Selection::new(vec![select("left", &["slide"])]);
    selection.states(&publish(&simulation, 1)).unwrap();
    // A name that does not exist: looking it up again would fail.
    selection.wanted[0].robot = "missing".into();
    assert!(selection.states(&publish(&simulation, 2)).is_ok());
}

#[test]
fn a_robot_by_its_index_is_as_it_is_by_its_name() {
    let state = publish(&simulation(), 5);
    for (index, name) in ["left", "right"].into_iter().enumerate() {
        let by_name = Selection::new(vec![select(name, &[])]).states(&state).unwrap();
        assert_eq!(Selection::whole_robot(&state, index), Some(by_name));
    }
    assert_eq!(Selection::whole_robot(&state, 2), None);
}

#[test]
fn robots_of_a_selection_come_in_its_order_with_their_indices() {
    let state = publish(&simulation(), 1).state;
    let robots = |wanted: &[&str]| -> Vec<(usize, String)> {
        let wanted = wanted.iter().map(|robot| select(robot, &[])).collect();
        let found = Selection::new(wanted).robots(&state.world).unwrap();
        found.into_iter().map(|(index, entity)| (index, entity.name.clone())).collect()
    };
    let [left, right] = [(0, "left".to_owned()), (1, "right".to_owned())];
    assert_eq!(robots(&["right", "left", "right"]), [right.clone(), left.clone(), right.clone()]);
    assert_eq!(robots(&[]), [left, right]);
}

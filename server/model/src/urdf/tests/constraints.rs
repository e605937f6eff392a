//! Constraints of links in addition to the tree.

use glamx::DVec3;

use super::*;
use crate::setup::{ConstraintOn, LinkConstraintKind};

/// Two arms on a base, the second 1 m along x, with further content from line 2 on.
fn two_arms(content: &str) -> String {
    let arm = |name: &str, x: f64| {
        format!(
            "<link name='{name}'>{}</link><joint name='{name}_joint' type='continuous'><origin xyz='{x} 0 0'/>\
             <parent link='base'/><child link='{name}'/><axis xyz='0 1 0'/></joint>",
            BODY.replace('\n', " ")
        )
    };
    format!("<robot name='r'><link name='base'/>{}{}\n{content}</robot>", arm("a", 0.0), arm("b", 1.0))
}

fn constraints(content: &str) -> (Vec<crate::setup::LinkConstraint>, LoadReport) {
    let (model, report) = robot(&two_arms(content));
    (model.setup.constraints, report)
}

#[test]
fn every_kind_of_constraint_is_read() {
    for (kind, attributes, expected) in [
        ("weld", "", LinkConstraintKind::Weld),
        ("point_to_point", "", LinkConstraintKind::PointToPoint),
        ("hinge", "", LinkConstraintKind::Hinge(DVec3::Y)),
        ("slide", "", LinkConstraintKind::Slide(DVec3::Y)),
        ("distance", "length='0.5'", LinkConstraintKind::Distance { length: Some(0.5), is_rope: false }),
        ("rope", "", LinkConstraintKind::Distance { length: None, is_rope: true }),
    ] {
        let (read, report) = constraints(&format!(
            "<constraint name='c' type='{kind}' {attributes} max_force='9'><parent link='a'><origin xyz='1 0 0'/></parent>\
             <child link='b'/><axis xyz='0 2 0'/></constraint>"
        ));
        assert_eq!(read.len(), 1, "{kind}: {:?}", warnings(&report));
        assert_eq!((read[0].kind, read[0].max_force), (expected, Some(9.0)));
        assert_eq!(read[0].ends[0].pose.map(|pose| pose.translation), Some(DVec3::X));
        assert_eq!(read[0].ends[1].pose, None);
        assert_eq!(read[0].collisions, matches!(expected, LinkConstraintKind::Distance { .. }));
        assert_eq!(find(&report, "between \"a\" and \"b\"").disposition, Disposition::Used);
    }
    let (read, _) = constraints(
        "<constraint name='g' type='gear' ratio='-2' offset='0.1'><parent joint='a_joint'/><child joint='b_joint'/></constraint>\
         <constraint name='w' type='weld' collide='true'><parent/><child link='b'/></constraint>\
         <constraint name='o' type='weld'><parent robot='other' link='x'/><child link='b'/></constraint>",
    );
    assert_eq!(read[0].kind, LinkConstraintKind::Gear { ratio: -2.0, offset: Some(0.1) });
    assert_eq!(read[1].ends[0].on, ConstraintOn::World);
    assert!(read[1].collisions);
    assert_eq!(read[2].ends[0].on, ConstraintOn::Other { robot: "other".into(), name: "x".into() });
}

#[test]
fn constraints_that_hold_nothing_are_left_out_with_the_reason() {
    let hold =
        |attributes: &str, ends: &str| format!("<constraint name='c' {attributes}>{ends}</constraint>");
    let both = "<parent link='a'/><child link='b'/>";
    for (text, why) in [
        (hold("type='wled'", both), "did you mean weld?"),
        (hold("", both), "type=\"\" is not one of"),
        (hold("type='weld'", "<parent link='a'/>"), "it has no child"),
        (hold("type='weld'", "<parent link='a'/><child link='a'/>"), "its two ends are the same"),
        (hold("type='weld'", "<parent/><child/>"), "neither of its ends is of this robot"),
        (
            hold("type='weld'", "<parent link='c'/><child link='b'/>"),
            "its parent \"c\" is not a link of the robot",
        ),
        (hold("type='gear'", both), "its parent names no joint"),
        (
            hold("type='gear' ratio='nan'", "<parent joint='a_joint'/><child joint='b_joint'/>"),
            "ratio is not finite",
        ),
        (hold("type='distance' length='-1'", both), "its length is negative"),
        (hold("type='hinge'", &format!("{both}<axis xyz='0 0 0'/>")), "its axis is 0"),
        (
            hold("type='weld'", "<parent link='a'><origin xyz='1 2'/></parent><child link='b'/>"),
            "xyz is 2 numbers",
        ),
        (
            hold("type='weld'", "<parent link='a'><origin xyz='0 -1e13 0'/></parent><child link='b'/>"),
            "the origin of an end is farther away than 1e12 m",
        ),
    ] {
        let (read, report) = constraints(&text);
        assert_eq!(read, [], "{text}");
        let said = warnings(&report);
        assert!(said.iter().any(|said| said.contains(why) && said.ends_with("left out")), "{text}: {said:?}");
    }
    let many = "<constraint type='weld'><parent link='a'/><child link='b'/></constraint>".repeat(1100);
    let (read, report) = constraints(&many);
    assert_eq!(read.len(), 1024);
    assert!(warnings(&report).iter().any(|said| said.contains("more than 1024 constraints")));
}

#[test]
fn a_joint_of_gazebo_closes_a_loop_where_the_links_are_at_zero() {
    let (read, report) = constraints(
        "<gazebo><joint name='loop' type='revolute'><pose>0.5 0 0 0 0 0</pose><parent>a</parent><child>b</child>\
         <axis><xyz>0 1 0</xyz><limit><lower>-1</lower><upper>1</upper></limit></axis></joint></gazebo>",
    );
    assert_eq!(read[0].kind, LinkConstraintKind::Hinge(DVec3::Y));
    // The child is 1 m along x from the parent.
    let places = read[0].ends.each_ref().map(|end| end.pose.map(|pose| pose.translation));
    assert_eq!(places, [Some(DVec3::X * 1.5), Some(DVec3::X * 0.5)]);
    assert_eq!(warnings(&report), ["a constraint that closes a loop has no limits, damping or friction"]);
    let (read, report) = constraints(
        "<gazebo><joint name='s' type='screw'><parent>a</parent><child>b</child></joint></gazebo>",
    );
    assert_eq!(read, []);
    assert_eq!(warnings(&report), ["a constraint cannot be a joint of type \"screw\": left out"]);
}

#[test]
fn constraints_grow_with_the_robot() {
    let text = two_arms(
        "<constraint type='distance' length='0.5'><parent link='a'><origin xyz='1 0 0'/></parent><child link='b'/></constraint>",
    );
    let options = ReadOptions { scale: 2.0, ..ReadOptions::default() };
    let (model, _) = read(text.as_bytes(), &Files::default(), &options).unwrap();
    let constraint = &model.setup.constraints[0];
    assert_eq!(constraint.kind, LinkConstraintKind::Distance { length: Some(1.0), is_rope: false });
    assert_eq!(constraint.ends[0].pose.map(|pose| pose.translation), Some(DVec3::X * 2.0));
}

//! Mimic joints, and scaled robots.

use super::*;
use crate::robot::{Geometry, Mimic};

fn three(mimics: [&str; 3], kinds: [&str; 3]) -> String {
    let link = |name: &str| format!("<link name='{name}'>{BODY}</link>");
    let joint = |i: usize| {
        let (kind, mimic) = (kinds[i], mimics[i]);
        let limit = "<limit lower='-1' upper='1' effort='2' velocity='3'/>";
        format!(
            "\n<joint name='j{i}' type='{kind}'><parent link='l{i}'/><child link='l{}'/><axis xyz='0 0 1'/>\
             <origin xyz='1 0 0'/>{limit}{mimic}</joint>",
            i + 1
        )
    };
    let links: String = ["l0", "l1", "l2", "l3"].map(link).concat();
    format!("<robot name='r'>{links}{}</robot>", [0, 1, 2].map(joint).concat())
}

#[test]
fn a_joint_follows_another_by_name() {
    let mimics = ["<mimic joint='j2'/>", "<mimic joint='j2' multiplier='-2' offset='0.5'/>", ""];
    let (model, report) = robot(&three(mimics, ["revolute"; 3]));
    assert_eq!(model.joints[0].mimic, Some(Mimic { joint: 2, multiplier: 1.0, offset: 0.0 }));
    assert_eq!(model.joints[1].mimic, Some(Mimic { joint: 2, multiplier: -2.0, offset: 0.5 }));
    assert_eq!(warnings(&report), [""; 0]);
}

#[test]
fn following_an_unknown_or_a_fixed_joint_is_dropped_with_a_warning() {
    let (model, report) =
        robot(&three(["<mimic joint='x'/>", "<mimic joint='j2'/>", ""], ["revolute", "revolute", "fixed"]));
    assert!(model.joints.iter().all(|joint| joint.mimic.is_none()));
    assert_eq!(warnings(&report).len(), 2);
    assert_eq!(
        find(&report, "\"x\", which is not defined").line,
        Some(2 + BODY.lines().count() as u32 * 4 - 4)
    );
}

#[test]
fn joints_that_follow_one_another_in_a_loop_go_their_own_ways() {
    let looped =
        three(["<mimic joint='j1'/>", "<mimic joint='j2'/>", "<mimic joint='j1'/>"], ["revolute"; 3]);
    let (model, report) = robot(&looped);
    let leaders: Vec<_> = model.joints.iter().map(|joint| joint.mimic.map(|mimic| mimic.joint)).collect();
    assert_eq!(leaders, [Some(1), None, None], "the first follows one of the loop, and is not on it");
    let expected = "joints follow one another in a loop: \"j1\", \"j2\"; each moves independently";
    assert_eq!(warnings(&report), [expected]);
    let (model, report) = robot(&three(["<mimic joint='j0'/>", "", ""], ["revolute"; 3]));
    assert!(model.joints.iter().all(|joint| joint.mimic.is_none()));
    assert_eq!(warnings(&report).len(), 1);
}

#[test]
fn a_scale_multiplies_lengths_and_inertias_but_no_mass_angle_or_effort() {
    let mimics = [
        "",
        "<mimic joint='j0' multiplier='3' offset='0.5'/>",
        "<mimic joint='j1' multiplier='3' offset='0.5'/>",
    ];
    let urdf = three(mimics, ["revolute", "prismatic", "prismatic"]);
    let options = ReadOptions { scale: 2.0, ..ReadOptions::default() };
    let (model, _) = read(urdf.as_bytes(), &Files::default(), &options).unwrap();
    let link = &model.links[1].inertial;
    assert_eq!((link.mass, link.center_of_mass.x, link.inertia.x_axis.x), (1.0, 0.2, 0.4));
    let [turns, slides, follows] = &model.joints[..] else { panic!("three joints") };
    assert_eq!(turns.parent_from_joint.translation.x, 2.0);
    assert_eq!(
        (turns.limits.upper, turns.limits.velocity, turns.limits.effort),
        (Some(1.0), Some(3.0), Some(2.0))
    );
    assert_eq!(
        (slides.limits.upper, slides.limits.velocity, slides.limits.effort),
        (Some(2.0), Some(6.0), Some(2.0))
    );
    // Metres per radian double; metres per metre do not change.
    assert_eq!(slides.mimic, Some(Mimic { joint: 0, multiplier: 6.0, offset: 1.0 }));
    assert_eq!(follows.mimic, Some(Mimic { joint: 1, multiplier: 3.0, offset: 1.0 }));
}

#[test]
fn a_scale_multiplies_shapes() {
    let urdf = "<robot name='r'><link name='a'><collision><origin xyz='1 0 0'/><geometry><box size='1 2 3'/></geometry>\
        </collision><visual><geometry><mesh filename='m.stl' scale='1 -1 1'/></geometry></visual></link></robot>";
    let options = ReadOptions { scale: 0.5, ..ReadOptions::default() };
    let (model, _) = read(urdf.as_bytes(), &Files::default(), &options).unwrap();
    let collision = &model.links[0].collisions[0];
    assert_eq!(collision.link_from_shape.translation.x, 0.5);
    assert!(matches!(collision.geometry, Geometry::Box { size } if size.to_array() == [0.5, 1.0, 1.5]));
    let visual = &model.links[0].visuals[0].geometry;
    assert!(matches!(visual, Geometry::Mesh { scale, .. } if scale.to_array() == [0.5, -0.5, 0.5]));
}

#[test]
fn a_scale_that_is_not_a_size_is_refused() {
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY, 1001.0] {
        let options = ReadOptions { scale, ..ReadOptions::default() };
        let urdf = one_joint("fixed", "");
        let message = read(urdf.as_bytes(), &Files::default(), &options).unwrap_err().message;
        assert!(message.contains("it must be above 0 and at most 1000"), "{message}");
    }
}

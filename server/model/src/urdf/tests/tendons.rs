//! Joints that are sums of others.

use super::*;
use crate::setup::{DriveMode, Tendon};

/// Two arms, and a joint `t` with this content, on a link with this content.
fn pulled(content: &str, link: &str) -> String {
    let joint = |name: &str, kind: &str, content: &str| {
        format!(
            "<joint name='{name}' type='{kind}'><parent link='base'/><child link='l{name}'/><axis xyz='0 0 1'/>{content}</joint>\n"
        )
    };
    let arms =
        ["a", "b"].map(|name| format!("<link name='l{name}'>{BODY}</link>{}", joint(name, "continuous", "")));
    format!(
        "<robot name='r'><link name='base'/><link name='lt'>{link}</link>{}{}</robot>",
        arms.concat(),
        joint("t", "prismatic", content)
    )
}

#[test]
fn a_tendon_is_a_sum_of_joints_and_is_not_driven() {
    let (model, report) = robot(&pulled(
        "<tendon offset='0.5'><joint joint='a' coef='2'/><joint joint='b' coef='-1'/><joint joint='b' coef='-2'/></tendon>",
        "",
    ));
    assert_eq!(warnings(&report), [""; 0]);
    let index = |name: &str| model.joints.iter().position(|joint| joint.name == name).unwrap();
    let terms = vec![(index("a"), 2.0), (index("b"), -3.0)];
    assert_eq!(model.setup.tendons, [Tendon { joint: index("t"), terms, offset: 0.5 }]);
    let of = model.setup.joints.iter().find(|setup| setup.joint == index("t")).unwrap();
    assert_eq!(of.mode, Some(DriveMode::Passive));
    find(&report, "a tendon: 2 \"a\" + -3 \"b\" + 0.5");
}

#[test]
fn what_cannot_be_a_tendon_is_named_and_moves_by_itself() {
    let sum = "<tendon><joint joint='a' coef='2'/></tendon>";
    let follower = format!("<mimic joint='a'/>{sum}");
    for (content, link, words) in [
        (sum, BODY, "its link has mass"),
        (&follower, "", "the joint follows another one"),
        ("<tendon><joint joint='x' coef='2'/></tendon>", "", "no joint \"x\""),
        ("<tendon><joint joint='t' coef='2'/></tendon>", "", "of no tendon"),
        ("<tendon><joint joint='a' coef='2'/><joint joint='a' coef='-2'/></tendon>", "", "it has no joint"),
    ] {
        let (model, report) = robot(&pulled(content, link));
        assert_eq!(model.setup.tendons, [], "{content}");
        find(&report, words);
        assert!(!warnings(&report).is_empty());
    }
    let many = format!("<tendon>{}</tendon>", "<joint joint='a' coef='1'/>".repeat(3_000));
    assert_eq!(robot(&pulled(&many, "")).0.setup.tendons[0].terms, [(0, 3_000.0)]);
}

#[test]
fn a_scale_keeps_the_joints_of_a_tendon() {
    let text = pulled("<tendon offset='0.5'><joint joint='a' coef='2'/></tendon>", "");
    let options = ReadOptions { scale: 3.0, ..ReadOptions::default() };
    let (model, _) = read(text.as_bytes(), &Files::default(), &options).unwrap();
    let tendon = &model.setup.tendons[0];
    assert_eq!((tendon.terms[0].1, tendon.offset), (6.0, 1.5), "it slides, and its joint turns");
}

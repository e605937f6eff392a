//! MJCF's `<replicate>`.

use super::{near, refusal, robot, root_from_link};

fn mjcf(content: &str) -> String {
    format!(
        "<mujoco model='m'><worldbody><body name='a'><joint name='i' axis='0 0 1'/><geom size='0.1'/>{content}</body></worldbody></mujoco>"
    )
}

#[test]
fn each_copy_is_moved_and_turned_from_the_one_before_it() {
    let (model, report) = robot(&mjcf(
        "<replicate count='3' offset='1 0 0' euler='0 0 90' sep='-'>\
         <body name='b' pos='0.1 0 0'><joint name='j' axis='0 0 1'/><geom size='0.1'/></body></replicate>",
    ));
    for (name, position) in [("b-0", [0.1, 0.0, 0.0]), ("b-1", [1.0, 0.1, 0.0]), ("b-2", [0.9, 1.0, 0.0])] {
        let pose = root_from_link(&model, name);
        assert!(near(pose.translation, position), "{name}: {}", pose.translation);
    }
    let joints: Vec<&str> = model.joints.iter().map(|joint| joint.name.as_str()).collect();
    for name in ["j-0", "j-1", "j-2"] {
        assert!(joints.contains(&name), "{joints:?}");
    }
    assert!(report.findings.iter().all(|finding| !finding.message.contains("not read")), "{report:?}");
}

#[test]
fn copies_of_copies_are_numbered_from_the_inside_with_the_digits_of_the_count() {
    let (model, _) = robot(&mjcf(
        "<replicate count='2' offset='0 1 0' sep='_'><replicate count='10' offset='0 0 0.1'>\
         <body name='b'><joint name='j'/><geom size='0.1'/></body></replicate></replicate>",
    ));
    assert_eq!(model.links.iter().filter(|link| link.name.starts_with('b')).count(), 20);
    assert!(near(root_from_link(&model, "b09_1").translation, [0.0, 1.0, 0.9]));
}

#[test]
fn copies_are_bounded_and_their_count_is_a_whole_number() {
    let endless = refusal(&mjcf("<replicate count='1000000000'/>"));
    assert!(endless.contains("more than 500000 elements"), "{endless}");
    let many = "<replicate count='1000'><replicate count='1000'><site name='s'/></replicate></replicate>";
    assert!(refusal(&mjcf(many)).contains("more than 500000 elements"));
    for count in ["", "count='0'", "count='-1'", "count='1.5'"] {
        let message = refusal(&mjcf(&format!("<replicate {count}/>")));
        assert!(message.contains("its count is not a whole number above 0"), "{message}");
    }
}

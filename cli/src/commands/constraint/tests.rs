//! What is made of arguments of `simctl constraint`.

use super::*;

#[test]
fn ends_are_read_as_people_write_them() {
    let link = end(Kind::Weld, "hand/tip link", None);
    assert_eq!((link.robot.as_str(), link.link.as_str(), link.joint.as_str()), ("hand", "tip link", ""));
    let joint = end(Kind::Gear, "hand/left", None);
    assert_eq!((joint.robot.as_str(), joint.link.as_str(), joint.joint.as_str()), ("hand", "", "left"));
    assert_eq!(end(Kind::Weld, "world", None), ConstraintEnd::default());
    assert_eq!(end(Kind::Weld, "hand", None).link, "");
}

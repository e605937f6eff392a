//! Types, axes, limits, damping and friction.

use glamx::DVec3;

use super::*;
use crate::robot::{JointKind, JointLimits};

#[test]
fn every_kind_of_joint_is_read_and_others_are_refused() {
    for (word, kind) in [
        ("revolute", JointKind::Revolute),
        ("continuous", JointKind::Continuous),
        ("prismatic", JointKind::Prismatic),
        ("fixed", JointKind::Fixed),
        ("floating", JointKind::Floating),
        ("planar", JointKind::Planar),
        ("spherical", JointKind::Spherical),
    ] {
        assert_eq!(joint(word, "").0.kind, kind);
    }
    let message = refusal(&one_joint("ball", ""));
    assert!(message.starts_with("joint \"j\" (line 4): type=\"ball\" is not one of: revolute,"), "{message}");
    assert!(message.ends_with("; did you mean spherical?"), "{message}");
}

#[test]
fn a_joint_without_parent_child_or_type_is_refused() {
    let missing = |joint: &str| refusal(&format!("<robot name='r'><link name='a'/>\n{joint}</robot>"));
    assert_eq!(missing("<joint name='j'/>"), "joint \"j\" (line 2): it has no type");
    assert_eq!(missing("<joint name='j' type='fixed'/>"), "joint \"j\" (line 2): it has no parent");
    let childless = "<joint name='j' type='fixed'><parent link='a'/></joint>";
    assert_eq!(missing(childless), "joint \"j\" (line 2): it has no child");
}

#[test]
fn a_missing_axis_is_x_as_urdf_says() {
    let (joint, report) = joint("continuous", "");
    assert_eq!(joint.axis, DVec3::X);
    assert_eq!(find(&report, "no axis").disposition, Disposition::Defaulted);
    assert_eq!(warnings(&report), [""; 0]);
}

#[test]
fn an_axis_is_made_one_long() {
    let axis = |xyz: &str| joint("continuous", &format!("<axis xyz='{xyz}'/>"));
    let (turned, report) = axis("0 0 -2");
    assert_eq!(turned.axis, DVec3::NEG_Z);
    assert_eq!(warnings(&report), ["the axis has length 2.000000 and was normalized"]);
    let (rounded, report) = axis("0.577 0.577 0.577");
    assert!((rounded.axis.length() - 1.0).abs() < 1e-15);
    assert_eq!(find(&report, "was normalized").disposition, Disposition::Used);
    let (exact, report) = axis("0 0.70710678 0.70710678");
    assert!((exact.axis.length() - 1.0).abs() < 1e-15);
    assert!(report.findings.iter().all(|finding| !finding.message.contains("normalized")));
}

#[test]
fn a_zero_axis_is_x_with_a_warning_but_of_no_matter_on_a_fixed_joint() {
    let (moving, report) = joint("revolute", "<axis xyz='0 0 0'/>");
    assert_eq!(moving.axis, DVec3::X);
    assert_eq!(warnings(&report), ["the axis is 0; 1 0 0 is used"]);
    assert_eq!(warnings(&joint("fixed", "<axis xyz='0 0 0'/>").1), [""; 0]);
}

#[test]
fn limits_are_as_the_file_says() {
    let (joint, report) = joint("revolute", "<limit lower='-1' upper='2' effort='3' velocity='4'/>");
    let expected =
        JointLimits { lower: Some(-1.0), upper: Some(2.0), effort: Some(3.0), velocity: Some(4.0) };
    assert_eq!(joint.limits, expected);
    assert_eq!(warnings(&report), [""; 0]);
}

#[test]
fn four_zeros_are_no_limits_since_solidworks_writes_them_so() {
    let (joint, report) = joint("revolute", "<limit lower='0' upper='0' effort='0' velocity='0'/>");
    assert_eq!(joint.limits, JointLimits::default());
    let finding = find(&report, "lower, upper, effort, velocity: 0 or left out");
    assert_eq!((finding.severity, finding.disposition), (Severity::Info, Disposition::Defaulted));
    assert_eq!(finding.element, "joint \"j\" limit");
}

#[test]
fn zeros_beside_an_absent_effort_and_velocity_are_no_limits_too() {
    assert_eq!(joint("prismatic", "<limit lower='0' upper='0'/>").0.limits, JointLimits::default());
}

#[test]
fn lower_and_upper_both_left_out_are_no_limits() {
    let (joint, report) = joint("revolute", "<limit effort='5' velocity='0'/>");
    assert_eq!(joint.limits, JointLimits { effort: Some(5.0), ..JointLimits::default() });
    find(&report, "lower, upper, velocity: 0 or left out");
}

#[test]
fn one_bound_left_out_is_zero_as_urdf_says() {
    let (joint, report) = joint("revolute", "<limit upper='1.5'/>");
    assert_eq!((joint.limits.lower, joint.limits.upper), (Some(0.0), Some(1.5)));
    find(&report, "lower is not given: 0");
}

#[test]
fn equal_bounds_lock_the_joint_with_a_warning() {
    let (locked, report) = joint("revolute", "<limit lower='0' upper='0' effort='10' velocity='0'/>");
    assert_eq!((locked.limits.lower, locked.limits.upper), (Some(0.0), Some(0.0)));
    assert_eq!(warnings(&report), ["lower and upper are both 0: the joint is locked there"]);
    let (locked, _) = joint("prismatic", "<limit lower='0.5' upper='0.5'/>");
    assert_eq!((locked.limits.lower, locked.limits.upper), (Some(0.5), Some(0.5)));
}

#[test]
fn bounds_in_the_wrong_order_are_swapped_with_a_warning() {
    let (joint, report) = joint("revolute", "<limit lower='2' upper='-1' effort='1' velocity='1'/>");
    assert_eq!((joint.limits.lower, joint.limits.upper), (Some(-1.0), Some(2.0)));
    assert_eq!(find(&report, "were swapped").disposition, Disposition::Repaired);
}

#[test]
fn negative_effort_and_velocity_lose_their_sign_with_a_warning() {
    let (joint, report) = joint("revolute", "<limit lower='-1' upper='1' effort='-3' velocity='-4'/>");
    assert_eq!((joint.limits.effort, joint.limits.velocity), (Some(3.0), Some(4.0)));
    assert_eq!(warnings(&report).len(), 2);
}

#[test]
fn a_revolute_joint_without_a_limit_moves_without_limits_and_says_so() {
    let (joint, report) = joint("revolute", "");
    assert_eq!(joint.limits, JointLimits::default());
    find(&report, "it moves without limits");
}

#[test]
fn a_continuous_joint_has_no_position_limits_but_keeps_its_effort() {
    let (joint, report) = joint("continuous", "<limit lower='-1' upper='1' effort='9' velocity='2'/>");
    assert_eq!(
        joint.limits,
        JointLimits { effort: Some(9.0), velocity: Some(2.0), ..JointLimits::default() }
    );
    find(&report, "a continuous joint has no position limits");
}

#[test]
fn damping_and_friction_are_the_files_else_zero_and_never_negative() {
    let (given, _) = joint("revolute", "<dynamics damping='0.5' friction='0.25'/>");
    assert_eq!((given.damping, given.friction), (0.5, 0.25));
    assert_eq!(joint("revolute", "").0.damping, 0.0);
    let (negative, report) = joint("revolute", "<dynamics damping='-0.5'/>");
    assert_eq!(negative.damping, 0.0);
    assert_eq!(warnings(&report), ["damping -0.5 is negative: read as 0"]);
}

#[test]
fn elements_that_urdf_rs_requires_may_be_missing() {
    let content =
        "<safety_controller soft_lower_limit='1'/><limit effort='1'/><calibration/><axis xyz='0 0 1'/>";
    let (_, report) = joint("continuous", content);
    assert_eq!(find(&report, "not read by simd").element, "joint \"j\" safety_controller");
    assert_eq!(warnings(&report), [""; 0]);
}

#[test]
fn a_second_limit_is_ignored_with_a_warning() {
    let (joint, report) = joint("revolute", "<limit lower='-1' upper='1'/><limit lower='-2' upper='2'/>");
    assert_eq!(joint.limits.upper, Some(1.0));
    assert_eq!(warnings(&report), ["one too many: the one before it is used"]);
}

#[test]
fn roll_pitch_and_yaw_turn_about_fixed_axes_in_this_order() {
    let (joint, _) = joint("fixed", "<origin rpy='0.3 0.5 0.7'/>");
    let [roll, pitch, yaw] = [0.3_f64, 0.5, 0.7];
    // Last column of Rz(yaw) Ry(pitch) Rx(roll), written out.
    let expected = DVec3::new(
        yaw.cos() * pitch.sin() * roll.cos() + yaw.sin() * roll.sin(),
        yaw.sin() * pitch.sin() * roll.cos() - yaw.cos() * roll.sin(),
        pitch.cos() * roll.cos(),
    );
    assert!((joint.parent_from_joint.rotation * DVec3::Z - expected).length() < 1e-15);
}

#[test]
fn a_quaternion_is_read_exactly_and_wins_over_angles() {
    let (joint, report) =
        joint("fixed", "<origin quat_xyzw='0 0.70710678118654752 0 0.70710678118654752' rpy='1 2 3'/>");
    assert!((joint.parent_from_joint.rotation * DVec3::Z - DVec3::X).length() < 1e-15);
    assert_eq!(warnings(&report), ["rpy and quat_xyzw are both given: quat_xyzw is used"]);
}

#[test]
fn a_gazebo_element_is_of_the_link_and_of_the_joint_of_its_name() {
    let (model, report) = robot(
        "<robot name='r'><link name='a'/>\
         <link name='b'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1'/></inertial></link>\
         <joint name='b' type='continuous'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/></joint>\
         <gazebo reference='b'><springStiffness>3</springStiffness><mu1>0.7</mu1></gazebo>\
         <gazebo reference='b'><springReference>0.1</springReference></gazebo></robot>",
    );
    let spring = model.setup.joints[0].spring.unwrap();
    assert_eq!((spring.stiffness, spring.rest), (3.0, 0.1));
    find(&report, "friction 0.7 of link \"b\"");
    assert!(!report.findings.iter().any(|finding| finding.message.contains("not read")), "{report:?}");
}

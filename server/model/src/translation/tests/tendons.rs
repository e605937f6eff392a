//! Fixed tendons of MJCF: their properties and actuators become those of the joint that leads theirs, or of a joint
//! that is their sum.

use super::*;
use crate::robot::JointKind;
use crate::setup::{DriveMode, JointSetup, Spring, Tendon};

/// Two fingers, of which the second follows the first by `follow`, beside a third joint.
fn hand(sections: &str, follow: &str) -> String {
    format!(
        "<mujoco model='m'><compiler angle='radian'/><equality>{follow}</equality>\n{sections}\n<worldbody>\
         <body name='a'><joint name='l' armature='0.01' range='-2 2'/><geom size='0.1'/></body>\
         <body name='palm'><geom size='0.1'/>\
         <body name='one'><joint name='a' armature='0.01' range='-2 2' stiffness='1' springref='0.5'/><geom size='0.1'/></body>\
         <body name='two'><joint name='b' armature='0.01' springref='0.25'/><geom size='0.1'/></body></body>\
         </worldbody></mujoco>"
    )
}

/// Returns the robot with the fingers.
fn fingers(text: &str) -> (RobotModel, LoadReport) {
    let translation = translated(text);
    let urdf = &translation.model("palm").unwrap_or_else(|refused| panic!("{refused}")).urdf;
    let (model, _) = read(urdf.as_bytes(), &Files::default(), &ReadOptions::default()).unwrap();
    (model, translation.report)
}

fn setup(model: &RobotModel, name: &str) -> JointSetup {
    let index = model.joints.iter().position(|joint| joint.name == name).unwrap();
    model.setup.joints.iter().find(|setup| setup.joint == index).copied().unwrap_or_default()
}

const FOLLOW: &str = "<joint joint1='b' joint2='a' polycoef='0.1 -2 0 0 0'/>";

#[test]
fn a_tendon_of_joints_that_follow_one_has_its_properties_at_this_one() {
    // b = 0.1 - 2 a, so that the length 0.5 a - 0.5 b is 1.5 a - 0.05.
    let text = hand(
        "<tendon><fixed name='t' stiffness='8' springlength='0.4' damping='4' frictionloss='2' armature='0.2' range='-0.35 0.7' limited='true'>\
         <joint joint='a' coef='0.5'/><joint joint='b' coef='-0.5'/></fixed></tendon>",
        FOLLOW,
    );
    let (model, report) = fingers(&text);
    assert_eq!(warnings(&report), []);
    let (a, of_a) = (joint(&model, "a"), setup(&model, "a"));
    let near =
        |measured: f64, expected: f64| assert!((measured - expected).abs() < 1e-12, "{measured} {expected}");
    near(a.damping, 4.0 * 2.25);
    near(a.friction, 2.0 * 1.5);
    // The follower's rotor counts four times.
    near(of_a.armature, 0.01 + 0.2 * 2.25 + 4.0 * 0.01);
    near(a.limits.lower.unwrap(), -0.3 / 1.5);
    near(a.limits.upper.unwrap(), 0.75 / 1.5);
    let spring = of_a.spring.unwrap();
    near(spring.stiffness, 1.0 + 8.0 * 2.25);
    near(spring.stiffness * spring.rest, 0.5 + 8.0 * 2.25 * 0.45 / 1.5);
}

#[test]
fn a_spring_without_a_length_is_at_rest_where_those_of_its_joints_are() {
    let tendon = "<tendon><fixed name='t' stiffness='8'><joint joint='a' coef='1'/><joint joint='b' coef='1'/></fixed></tendon>";
    let (model, _) = fingers(&hand(tendon, FOLLOW));
    // The length 0.1 - a is 0.5 + 0.25 at rest.
    let spring = setup(&model, "a").spring.unwrap();
    assert!((spring.stiffness * spring.rest - (0.5 + 8.0 * (0.1 - 0.75))).abs() < 1e-12);
}

#[test]
fn an_actuator_of_a_tendon_drives_the_leader() {
    let tendon = "<tendon><fixed name='t'><joint joint='a' coef='0.5'/><joint joint='b' coef='-0.5'/></fixed></tendon>";
    for (actuator, stiffness, damping, effort, mode) in [
        (
            "<position tendon='t' kp='10' kv='2' gear='2' forcerange='-3 3'/>",
            Some(90.0),
            Some(18.0),
            Some(9.0),
            None,
        ),
        ("<velocity tendon='t' kv='2'/>", None, Some(4.5), None, Some(DriveMode::Velocity)),
        (
            "<motor tendon='t' ctrlrange='-1 1' ctrllimited='true'/>",
            None,
            None,
            Some(1.5),
            Some(DriveMode::Effort),
        ),
    ] {
        let (model, report) = fingers(&hand(&format!("{tendon}<actuator>{actuator}</actuator>"), FOLLOW));
        assert_eq!(warnings(&report), []);
        let of = setup(&model, "a");
        assert_eq!((of.stiffness, of.damping, of.mode), (stiffness, damping, mode), "{actuator}");
        assert_eq!(joint(&model, "a").limits.effort, effort, "{actuator}");
        find(&report, "through the tendon \"t\", 1.5 times");
    }
}

/// The hands of known grippers, whose controls go from 0 to 255.
#[test]
fn a_control_in_other_units_is_a_servo_whose_targets_are_positions() {
    let sections = "<tendon><fixed name='split'><joint joint='a' coef='0.5'/><joint joint='b' coef='0.5'/></fixed></tendon>\
                    <actuator><general tendon='split' forcerange='-5 5' ctrlrange='0 255' gainprm='0.25 0 0' biastype='affine' biasprm='1 -100 -10'/></actuator>";
    let (model, report) = fingers(&hand(sections, "<joint joint1='b' joint2='a'/>"));
    let of = setup(&model, "a");
    assert_eq!((of.stiffness, of.damping, of.mode), (Some(100.0), Some(10.0), None));
    find(&report, "a control of u is the position target 0.0025 u + 0.01");
}

/// MuJoCo 4.0.0 computes these.
#[test]
fn a_ratio_of_damping_counts_all_joints_of_a_tendon() {
    for (factor, expected) in [(0.5, 5.218003791014232), (0.25, 6.119687887709525)] {
        let sections = format!(
            "<tendon><fixed name='t'><joint joint='a' coef='0.5'/><joint joint='b' coef='{factor}'/></fixed></tendon>\
             <actuator><position tendon='t' kp='100' dampratio='1'/></actuator>"
        );
        let text = hand(&sections, "<joint joint1='b' joint2='a'/>");
        let text = text.replace("name='b' armature='0.01'", "name='b' armature='0.03'");
        let (model, _) = fingers(&text);
        let gear: f64 = 0.5 + factor;
        let damping = setup(&model, "a").damping.unwrap() / (gear * gear);
        assert!((damping / expected - 1.0).abs() < 1e-9, "{damping}, not {expected}");
    }
}

#[test]
fn a_tendon_of_joints_that_move_by_themselves_is_a_joint_whose_position_is_their_sum() {
    let text = hand(
        "<tendon><fixed name='t' stiffness='8' springlength='0.4' damping='4' frictionloss='2' armature='0.2' range='-0.35 0.7' limited='true'>\
         <joint joint='a' coef='0.5'/><joint joint='b' coef='-1.5'/></fixed></tendon>\
         <actuator><position tendon='t' kp='10' kv='2' gear='2' forcerange='-3 3'/></actuator>",
        "",
    );
    let (model, report) = fingers(&text);
    assert_eq!(warnings(&report), []);
    let (t, of) = (joint(&model, "t"), setup(&model, "t"));
    let index = |name: &str| model.joints.iter().position(|joint| joint.name == name).unwrap();
    let terms = vec![(index("a"), 0.5), (index("b"), -1.5)];
    assert_eq!(model.setup.tendons, [Tendon { joint: index("t"), terms, offset: 0.0 }]);
    assert_eq!((t.kind, t.damping, t.friction), (JointKind::Prismatic, 4.0, 2.0));
    assert_eq!((t.limits.lower, t.limits.upper, t.limits.effort), (Some(-0.35), Some(0.7), Some(6.0)));
    assert_eq!(of.spring, Some(Spring { stiffness: 8.0, rest: 0.4 }));
    assert_eq!((of.armature, of.stiffness, of.damping, of.mode), (0.2, Some(40.0), Some(8.0), None));
    find(&report, "the joint \"t\" of the robot is its length, a sum of the joints \"a\", \"b\"");
    assert_eq!(setup(&model, "a").mode, Some(DriveMode::Passive));
}

#[test]
fn followers_in_a_sum_count_for_the_joints_that_they_follow() {
    let text = hand(
        "<tendon><fixed name='a'><joint joint='a' coef='1'/><joint joint='b' coef='3'/><joint joint='c' coef='2'/></fixed></tendon>\
         <actuator><motor tendon='a'/></actuator>",
        FOLLOW,
    );
    let text = text.replace(
        "<body name='two'>",
        "<body name='three'><joint name='c'/><geom size='0.1'/></body><body name='two'>",
    );
    let (model, report) = fingers(&text);
    assert_eq!(warnings(&report), []);
    // b = 0.1 - 2 a. A joint has the name of the tendon.
    let tendon = &model.setup.tendons[0];
    let terms: Vec<(&str, f64)> =
        tendon.terms.iter().map(|(joint, by)| (model.joints[*joint].name.as_str(), *by)).collect();
    assert_eq!(terms, [("a", -5.0), ("c", 2.0)]);
    assert!((tendon.offset - 0.3).abs() < 1e-12);
    assert_eq!(model.joints[tendon.joint].name, "a_tendon");
    assert_eq!(setup(&model, "a_tendon").mode, Some(DriveMode::Effort));
}

#[test]
fn tendons_that_are_not_read_are_named_with_what_is_lost() {
    let sections = "<tendon>\n<fixed name='t' stiffness='8' damping='1'><joint joint='a' coef='1'/><joint joint='l' coef='1'/></fixed>\n\
                    <spatial name='s' frictionloss='1'/></tendon>\n<actuator>\n<position tendon='t' kp='1'/>\n<motor tendon='s'/></actuator>";
    let (model, report) = fingers(&hand(sections, ""));
    let said = warnings(&report);
    let has = |line: u32, words: &str| {
        assert!(
            said.iter().any(|(at, message)| *at == Some(line) && message.contains(words)),
            "{words}: {said:#?}"
        );
    };
    has(3, "its joints (\"a\", \"l\") are not of one robot: it is without its spring, damping");
    has(4, "only tendons of joints are read by simd: the robot is without its friction");
    has(6, "the joints of tendon \"t\" (\"a\", \"l\") are not of one robot");
    has(7, "there is no fixed tendon \"s\"");
    assert_eq!(setup(&model, "a").mode, Some(DriveMode::Passive));
}

#[test]
fn an_actuator_of_a_follower_drives_the_joint_that_it_follows() {
    let (model, report) =
        fingers(&hand("<actuator><position joint='b' kp='10' kv='1' forcerange='-1 1'/></actuator>", FOLLOW));
    assert_eq!(warnings(&report), []);
    let of = setup(&model, "a");
    assert_eq!((of.stiffness, of.damping), (Some(40.0), Some(4.0)));
    assert_eq!(joint(&model, "a").limits.effort, Some(2.0));
}

#[test]
fn servos_of_position_and_velocity_at_one_joint_are_one_and_motors_add_up() {
    for (actuators, expected) in [
        ("<position joint='a' kp='10' kv='1'/><velocity joint='a' kv='2'/>", (Some(10.0), Some(3.0), None)),
        ("<velocity joint='a' kv='2'/><position joint='a' kp='10'/>", (Some(10.0), Some(2.0), None)),
    ] {
        let (model, report) = fingers(&hand(&format!("<actuator>{actuators}</actuator>"), ""));
        assert_eq!(warnings(&report), [], "{actuators}");
        let of = setup(&model, "a");
        assert_eq!((of.stiffness, of.damping, of.mode), expected, "{actuators}");
    }
    let motors = "<motor joint='a' forcerange='-1 1'/><motor joint='a' gear='2' forcerange='-1 1'/>";
    let (model, _) = fingers(&hand(&format!("<actuator>{motors}</actuator>"), ""));
    assert_eq!(joint(&model, "a").limits.effort, Some(3.0));
    let both = "<motor joint='a'/><position joint='a' kp='10'/>";
    let (_, report) = fingers(&hand(&format!("<actuator>{both}</actuator>"), ""));
    find(&report, "has an actuator already");
}

#[test]
fn tendons_that_are_equal_couple_their_joints() {
    let tendons = "<tendon><fixed name='s'><joint joint='a' coef='2'/></fixed><fixed name='t'><joint joint='b' coef='4'/></fixed></tendon>";
    // 2 a = 0.4 + 3 (4 b).
    let (model, report) = fingers(&hand(tendons, "<tendon tendon1='s' tendon2='t' polycoef='0.4 3 0 0 0'/>"));
    assert_eq!(warnings(&report), []);
    let mimic = joint(&model, "b").mimic.unwrap();
    assert!(
        (mimic.multiplier - 1.0 / 6.0).abs() < 1e-12 && (mimic.offset + 0.1 / 3.0).abs() < 1e-12,
        "{mimic:?}"
    );
    let (model, report) = fingers(&hand(tendons, "<tendon tendon1='s' polycoef='0.4'/>"));
    assert_eq!(warnings(&report), []);
    assert_eq!(model.setup.constraints.len(), 1, "the joint is kept at 0.2");
    let (_, report) = fingers(&hand(tendons, "<tendon tendon1='x'/>"));
    find(&report, "it names no fixed tendon");
}

#[test]
fn many_tendons_and_joints_of_one_are_bounded() {
    let joints = "<joint joint='a' coef='1'/>".repeat(3_000);
    let tendons = format!("<fixed name='t'>{joints}</fixed>").repeat(20);
    let many: String =
        (0..3_000).map(|n| format!("<fixed name='t{n}'><joint joint='a' coef='1'/></fixed>")).collect();
    let (_, report) = fingers(&hand(&format!("<tendon>{tendons}{many}</tendon>"), ""));
    find(&report, "at most 100 joints");
    find(&report, "more than 1024 tendons");
}

#[test]
fn weights_that_all_links_of_a_joint_lack_are_compensated_and_others_are_named_once() {
    let of = |first: &str, second: &str, actuator: &str| {
        let text = format!(
            "<mujoco model='m'><actuator>{actuator}</actuator><worldbody><body name='a' {first}><joint name='j'/><geom size='0.1'/>\
             <body name='b' {second}><joint name='k'/><geom size='0.1'/></body></body></worldbody></mujoco>"
        );
        let (model, report) = robot(&text);
        let said: Vec<String> =
            warnings(&report).into_iter().map(|(_, message)| message.to_owned()).collect();
        (["j", "k"].map(|name| setup(&model, name).gravity_compensation), said)
    };
    let servos = "<position joint='j' kp='1'/><position joint='k' kp='1'/>";
    assert_eq!(of("gravcomp='1'", "gravcomp='1'", servos), ([true, true], vec![]));
    let (compensated, said) = of("", "gravcomp='1'", servos);
    assert_eq!((compensated, said.len()), ([false, true], 1), "{said:?}");
    let (compensated, said) = of("gravcomp='0.5'", "gravcomp='0.5'", servos);
    assert_eq!(compensated, [false, false]);
    assert!(said.len() == 1 && said[0].contains("gravcomp of \"a\", \"b\""), "{said:?}");
    let (compensated, said) =
        of("gravcomp='1'", "gravcomp='1'", "<motor joint='j'/><position joint='k' kp='1'/>");
    assert_eq!(compensated, [true, true]);
    assert!(said.len() == 1 && said[0].contains("these have none"), "{said:?}");
}

#[test]
fn one_joint_of_several_of_a_body_is_kept_by_its_limits() {
    let text = "<mujoco model='m'><compiler angle='radian'/><equality><joint joint1='b' polycoef='0.25'/></equality><worldbody>\
                <body name='one'><joint name='a'/><joint name='b' axis='0 1 0' ref='0.5'/><geom size='0.1'/></body></worldbody></mujoco>";
    let (model, report) = robot(text);
    let limits = joint(&model, "b").limits;
    assert_eq!((limits.lower, limits.upper), (Some(0.75), Some(0.75)));
    find(&report, "locked by its limits");
}

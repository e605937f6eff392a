//! URDFs in the wild: forms that other readers accept are read, and oddities are reported.

use super::*;
use crate::setup::DriveMode;

const ROBOT: &str = "<link name='a'><inertial><mass value='1'/><inertia ixx='0.01' ixy='0' ixz='0' iyy='0.01' iyz='0' izz='0.01'/></inertial></link>\
    <link name='b'><inertial><mass value='1'/><inertia ixx='0.01' ixy='0' ixz='0' iyy='0.01' iyz='0' izz='0.01'/></inertial></link>\
    <link name='c'><inertial><mass value='1'/><inertia ixx='0.01' ixy='0' ixz='0' iyy='0.01' iyz='0' izz='0.01'/></inertial></link>\
    <joint name='right' type='revolute'><parent link='a'/><child link='b'/><axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='50' velocity='5'/></joint>";

/// Returns a robot with two joints; the second one contains `inner`.
fn two(inner: &str, content: &str) -> String {
    format!(
        "<robot name='r'>{ROBOT}<joint name='left' type='revolute'><parent link='a'/><child link='c'/><axis xyz='0 1 0'/>\
         <limit lower='-1' upper='1' effort='50' velocity='5'/>{inner}</joint>{content}</robot>"
    )
}

fn control(left: &str) -> String {
    format!(
        "<ros2_control name='s' type='system'><joint name='right'><command_interface name='position'/></joint>{left}</ros2_control>"
    )
}

#[test]
fn xml_that_other_readers_take_is_repaired_with_a_note() {
    for (content, note, line) in [
        ("<!-- ---------- arm -------- -->\n<link name='a'/>", "two dashes", 2),
        (
            "<link name='a'><visual><geometry><mesh filename='a & b.stl'/></geometry></visual></link>",
            "begins no reference",
            2,
        ),
        ("<link name='x' name='a'/>", "\"name\" is given twice", 2),
        ("<link name='a' p:q='1'/>", "the prefix \"p\" is not declared", 2),
    ] {
        let (model, report) = robot(&format!("<robot name='r'>\n{content}</robot>"));
        assert_eq!(model.links[0].name, "a", "{content}");
        let finding = find(&report, note);
        assert_eq!((finding.line, finding.disposition), (Some(line), Disposition::Repaired), "{content}");
    }
}

#[test]
fn looks_that_cannot_be_read_refuse_no_robot() {
    for looks in [
        "<material name='m'><color rgba='0.1 0.1'/></material>",
        "<material name=''><color rgba='0.7 0.7 NaN 1'/></material>",
        "<material name='grey'><color rgba='grey'/></material>",
    ] {
        let text = format!(
            "<robot name='r'><link name='a'><visual><geometry><sphere radius='0.1'/></geometry>{looks}</visual></link></robot>"
        );
        let (model, report) = robot(&text);
        assert_eq!(model.links[0].visuals.len(), 1, "{looks}");
        assert_eq!(model.links[0].visuals[0].color, None, "{looks}");
        assert_eq!(find(&report, "since it is only visual").severity, Severity::Warning, "{looks}");
    }
    let origin = "<robot name='r'><link name='a'><visual><origin xyz='0 0'/><geometry><sphere radius='0.1'/></geometry></visual></link></robot>";
    let (model, report) = robot(origin);
    assert_eq!(model.links[0].visuals.len(), 0);
    find(&report, "since it is only visual");
    // Faults of colliders do not concern the look.
    assert!(read_text(&origin.replace("visual", "collision")).is_err());
}

#[test]
fn an_inertia_that_no_body_of_the_shapes_and_mass_has_is_a_warning() {
    let with = |mass: f64, moment: f64, shape: &str| {
        moving_link(&format!(
            "<inertial><mass value='{mass}'/><inertia ixx='{moment}' ixy='0' ixz='0' iyy='{moment}' iyz='0' izz='{moment}'/></inertial>\
             <collision><geometry>{shape}</geometry></collision>"
        ))
    };
    let said = "has another unit";
    for (mass, moment, shape) in [
        (60.0, 0.001, "<box size='0.6 0.5 0.2'/>"),
        (0.001, 1.0, "<sphere radius='0.01'/>"),
        (7.293, 2.9595, "<cylinder radius='0.05' length='0.4'/>"),
    ] {
        let (_, report) = robot(&with(mass, moment, shape));
        assert_eq!(find(&report, said).severity, Severity::Warning, "{mass} {moment}");
    }
    for (mass, moment, shape) in [
        (1.0, 0.01, "<box size='0.2 0.2 0.2'/>"),
        (1.0, 0.03, "<box size='0.2 0.2 0.2'/>"),
        (1.0, 0.001, "<box size='0.2 0.2 0.2'/>"),
    ] {
        let (_, report) = robot(&with(mass, moment, shape));
        assert!(!report.findings.iter().any(|finding| finding.message.contains(said)), "{mass} {moment}");
    }
    let bare = moving_link(
        "<inertial><mass value='0.001'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>",
    );
    find(&robot(&bare).1, "31.62");
}

#[test]
fn a_joint_of_ros2_control_follows_by_its_parameters_or_its_element() {
    for left in [
        "<joint name='left'><param name='mimic'>right</param><param name='multiplier'>2</param><param name='offset'>0.1</param></joint>",
        "<joint name='left'><mimic joint='right' multiplier='2' offset='0.1'/></joint>",
    ] {
        let (model, _) = robot(&two("", &control(left)));
        let mimic = model.joints.iter().find(|joint| joint.name == "left").unwrap().mimic.unwrap();
        assert_eq!(
            (model.joints[mimic.joint].name.as_str(), mimic.multiplier, mimic.offset),
            ("right", 2.0, 0.1)
        );
    }
    let (model, report) = robot(&two(
        "<mimic joint='right'/>",
        &control("<joint name='left' mimic='false'><command_interface name='position'/></joint>"),
    ));
    assert!(model.joints.iter().all(|joint| joint.mimic.is_none()));
    find(&report, "follows no other joint");
    for (left, said) in [
        ("<joint name='left'><param name='mimic'>rihgt</param></joint>", "did you mean \"right\""),
        ("<joint name='left'><param name='mimic'>left</param></joint>", "would follow itself"),
        (
            "<joint name='left'><foo bar='1'/><param name='speed'>1</param></joint>",
            "not read by simd: <foo>, the parameter \"speed\"",
        ),
    ] {
        let (model, report) = robot(&two("", &control(left)));
        assert!(model.joints.iter().all(|joint| joint.mimic.is_none()));
        find(&report, said);
    }
}

#[test]
fn a_joint_without_a_command_interface_is_not_driven() {
    for left in ["<joint name='left'/>", "<joint name='left'><state_interface name='position'/></joint>"] {
        let (model, _) = robot(&two("", &control(left)));
        let index = model.joints.iter().position(|joint| joint.name == "left").unwrap();
        let setup = model.setup.joints.iter().find(|setup| setup.joint == index).unwrap();
        assert_eq!(setup.mode, Some(DriveMode::Passive), "{left}");
    }
}

#[test]
fn ros2_control_in_a_gazebo_element_is_read() {
    let inside = "<gazebo><ros2_control name='g' type='system'><joint name='left'><command_interface name='velocity'/></joint></ros2_control></gazebo>";
    let (model, report) = robot(&two("", inside));
    let index = model.joints.iter().position(|joint| joint.name == "left").unwrap();
    let setup = model.setup.joints.iter().find(|setup| setup.joint == index).unwrap();
    assert_eq!(setup.mode, Some(DriveMode::Velocity));
    assert!(!report.findings.iter().any(|finding| finding.message.starts_with("not read by simd")));
}

#[test]
fn each_unread_element_for_gazebo_is_named_and_a_static_robot_is_a_warning() {
    let own = "<gazebo><static>true</static><plugin filename='x'/></gazebo><gazebo reference='left'><cfmDamping>1</cfmDamping></gazebo>";
    let (_, report) = robot(&two("", own));
    for (severity, said) in [
        (Severity::Info, "not read by simd: static, plugin"),
        (Severity::Info, "not read by simd: cfmDamping"),
        (Severity::Warning, "not read by simd, so the robot moves: load it with a fixed base"),
    ] {
        assert!(
            report.findings.iter().any(|of| of.severity == severity && of.message == said),
            "{said}: {report:?}"
        );
    }
    let (_, report) = robot(&two("", "<gazebo><static>false</static></gazebo>"));
    assert!(
        !report.findings.iter().any(|of| of.severity == Severity::Warning && of.message.contains("moves"))
    );
}

#[test]
fn a_loop_of_joints_is_refused_with_a_word_of_constraints() {
    let why =
        refusal(&two("", "<joint name='back' type='fixed'><parent link='c'/><child link='a'/></joint>"));
    assert!(why.contains("<constraint>"), "{why}");
}

//! Recognition of URDFs, and the tree of their links.

use super::*;

#[test]
fn a_root_element_other_than_robot_is_named_in_the_refusal() {
    assert_eq!(
        refusal("<?xml version='1.0'?>\n<sdf/>"),
        "line 2: this is not a URDF: the root element is <sdf>; `simctl robot convert` writes it as URDF"
    );
    assert!(describe(b"<COLLADA/>").unwrap_err().message.contains("the root element is <COLLADA>"));
}

#[test]
fn broken_xml_is_refused_with_line_and_column() {
    let message = refusal("<robot name='r'>\n  <link name='a'>\n</robot>");
    assert_eq!(message, "line 3: the XML is broken at column 1: expected 'link' tag, not 'robot'");
    assert!(refusal("").contains("no root element"));
    assert!(refusal("binary rubbish").contains("line 1"));
}

#[test]
fn a_byte_order_mark_and_crlf_are_read() {
    let text = format!("\u{feff}{}", one_joint("continuous", "").replace('\n', "\r\n"));
    assert_eq!(robot(&text).0.links.len(), 2);
}

#[test]
fn text_that_is_not_utf8_is_read_as_what_it_says_or_seems_to_be() {
    let read = |bytes: &[u8]| read(bytes, &Files::default(), &ReadOptions::default());
    let (model, report) = read(b"<robot name='r'>\n<link name='\xe9'/></robot>").unwrap();
    assert_eq!(model.links[0].name, "\u{e9}");
    let finding = find(&report, "a byte here is not UTF-8");
    assert_eq!((finding.line, finding.severity), (Some(2), Severity::Warning));
    let said = b"<?xml version='1.0' encoding=\"ISO-8859-1\"?><robot name='r'><link name='\xe9'/></robot>";
    assert_eq!(warnings(&read(said).unwrap().1), [""; 0]);
    let text = "<robot name='r'>\n<link name='\u{65e5}\u{1f916}'/></robot>";
    for (mark, bytes) in [
        (&b"\xff\xfe"[..], text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<_>>()),
        (&b"\xfe\xff"[..], text.encode_utf16().flat_map(u16::to_be_bytes).collect::<Vec<_>>()),
    ] {
        for mark in [mark, b""] {
            let (model, report) = read(&[mark, &bytes].concat()).unwrap();
            assert_eq!(model.links[0].name, "\u{65e5}\u{1f916}");
            assert_eq!(find(&report, "no inertial").line, Some(2));
        }
    }
}

#[test]
fn bytes_that_are_not_text_are_refused_as_such() {
    let refusal = |bytes: &[u8]| describe(bytes).unwrap_err().message;
    assert_eq!(refusal(b"\x89PNG\r\n\x1a\n"), "this is not a URDF: it is not text");
    assert_eq!(refusal(b"solid \0\0\0\0\xff<"), "this is not a URDF: it is not text");
    assert!(refusal(b"\xff\xfe\0\0<\0\0\0").contains("UTF-32"));
    assert!(refusal(b"\xff\xfe<\0r").contains("ends within a character"));
    assert!(refusal(b"\xff\xfe<\0\n\0\0\xd8<\0").starts_with("line 2: the URDF is broken UTF-16"));
}

#[test]
fn a_robot_without_links_is_refused() {
    assert_eq!(refusal("<robot name='r'/>"), "robot (line 1): the robot has no links");
    let soft = "<robot name='r'><reduced_deformable name='r'/></robot>";
    assert_eq!(
        refusal(soft),
        "robot (line 1): the robot has no links: <reduced_deformable> is a soft body, and simd has rigid bodies only"
    );
}

#[test]
fn an_unprocessed_xacro_file_is_called_one() {
    let xacro =
        "<robot name='r' xmlns:xacro='http://www.ros.org/wiki/xacro'>\n<xacro:macro name='m'/></robot>";
    assert!(refusal(xacro).starts_with("line 2: this is a xacro file"));
    assert!(refusal("<robot name='r'>\n<xacro:macro name='m'/></robot>").contains("xacro file"));
    // Expanded files still declare xacro's prefix.
    robot("<robot name='r' xmlns:xacro='http://www.ros.org/wiki/xacro'><link name='a'/></robot>");
}

#[test]
fn an_undeclared_prefix_is_read_as_if_it_were_declared() {
    let urdf = "<!-- <robot> -->\n<robot name='r'><link name='a'/>\n<gazebo><sensor:camera x:y='1'/></gazebo></robot>";
    let (model, report) = robot(urdf);
    assert_eq!(model.name, "r");
    assert_eq!(find(&report, "\"sensor\"").disposition, Disposition::Repaired);
    assert_eq!(find(&report, "not read by simd").line, Some(3));
}

#[test]
fn unread_elements_are_reported_with_their_line() {
    let urdf = "<robot name='r' version='1.0'>\n<link name='a' colour='red'/>\n<transmission name='t'/>\n<gazebo/>\n\
        <ros2_control/>\n</robot>";
    let (_, report) = robot(urdf);
    let ignored: Vec<_> =
        report.findings.iter().filter(|it| it.disposition == Disposition::Ignored).collect();
    let what: Vec<_> = ignored.iter().map(|it| (it.element.as_str(), it.line, it.severity)).collect();
    let info = Severity::Info;
    let expected = [
        ("link \"a\"", Some(2), info),
        ("transmission", Some(3), info),
        ("gazebo", Some(4), info),
        ("ros2_control", Some(5), info),
    ];
    assert_eq!(what, expected);
}

#[test]
fn names_with_any_character_of_text_come_through_whole() {
    let (model, _) = robot("<robot name='a &amp; b'><link name='&lt;l&gt; &quot;é&apos; 日本'/></robot>");
    assert_eq!((model.name.as_str(), model.links[0].name.as_str()), ("a & b", "<l> \"é' 日本"));
}

#[test]
fn a_nameless_link_or_joint_is_refused_and_a_nameless_robot_named() {
    assert_eq!(refusal("<robot name='r'>\n<link/></robot>"), "link (line 2): it has no name");
    assert_eq!(refusal("<robot name='r'>\n<link name=' '/></robot>"), "link \" \" (line 2): it has no name");
    assert_eq!(robot("<robot><link name='a'/></robot>").0.name, "robot");
    assert_eq!(describe(b"<robot><link name='a'/></robot>").unwrap().name, "robot");
}

#[test]
fn two_links_of_one_name_are_refused_and_the_second_of_two_joints_is_renamed() {
    let links = "<robot name='r'>\n<link name='a'/>\n<link name='a'/></robot>";
    assert_eq!(refusal(links), "link \"a\" (line 3): another link has this name, at line 2");
    let joints = "<robot name='r'><link name='a'/><link name='b'/><link name='c'/>\n\
        <joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint>\n\
        <joint name='j' type='fixed'><parent link='a'/><child link='c'/></joint></robot>";
    let (model, report) = robot(joints);
    let names: Vec<_> = model.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["j", "j_2"]);
    find(&report, "another joint has this name, at line 2: this one is called \"j_2\"");
}

fn tree(joints: &[(&str, &str)]) -> String {
    let links: String = ["a", "b", "c", "d"].iter().map(|name| format!("<link name='{name}'/>")).collect();
    let joints: String = joints
        .iter()
        .enumerate()
        .map(|(i, (parent, child))| {
            format!(
                "\n<joint name='j{i}' type='fixed'><parent link='{parent}'/><child link='{child}'/></joint>"
            )
        })
        .collect();
    format!("<robot name='r'>{links}{joints}</robot>")
}

#[test]
fn links_that_form_no_tree_are_refused_by_name() {
    let unknown = tree(&[("a", "b"), ("x", "c")]);
    assert_eq!(refusal(&unknown), "joint \"j1\" (line 3): its parent link \"x\" is not defined");
    let unknown = tree(&[("a", "x")]);
    assert_eq!(refusal(&unknown), "joint \"j0\" (line 2): its child link \"x\" is not defined");
    let itself = tree(&[("a", "a")]);
    assert_eq!(refusal(&itself), "joint \"j0\" (line 2): its parent and its child are the same link \"a\"");
    let two_parents = tree(&[("a", "b"), ("c", "b")]);
    assert!(refusal(&two_parents).contains("its child link \"b\" already hangs on joint \"j0\" (line 2)"));
    let two_roots = tree(&[("a", "b"), ("c", "d")]);
    assert!(
        refusal(&two_roots)
            .ends_with("2 root links; a robot has one (the link that is not the child of a joint): \"a\" (line 1), \"c\" (line 1)")
    );
    let all_loop = tree(&[("a", "b"), ("b", "c"), ("c", "d"), ("d", "a")]);
    assert!(refusal(&all_loop).contains("joints form a loop"));
    let apart = tree(&[("b", "c"), ("c", "d"), ("d", "b")]);
    let message = refusal(&apart);
    for joint in ["\"j0\" (line 2)", "\"j1\" (line 3)", "\"j2\" (line 4)"] {
        assert!(message.contains(joint), "{message}");
    }
}

#[test]
fn links_come_depth_first_and_joint_i_ends_at_link_i_plus_1() {
    let (model, _) = robot(&tree(&[("d", "b"), ("b", "c"), ("d", "a")]));
    let names: Vec<_> = model.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!(names, ["d", "b", "c", "a"]);
    let ends: Vec<_> =
        model.joints.iter().map(|joint| (joint.name.as_str(), joint.parent, joint.child)).collect();
    assert_eq!(ends, [("j0", 0, 1), ("j1", 1, 2), ("j2", 0, 3)]);
}

#[test]
fn a_number_that_is_none_is_refused_with_element_and_line() {
    let message = refusal(&one_joint("continuous", "\n<origin xyz='1 x 2 3'/>"));
    let expected = "joint \"j\" origin (line 5): xyz=\"1 x 2 3\" has a word that is not a number: \"x\"";
    assert_eq!(message, expected);
    for (value, why) in [
        ("1 2", "is 2 numbers instead of 3"),
        ("NaN 0 0", "is not finite"),
        ("inf 0 0", "is not finite"),
        ("1e999 0 0", "is not finite"),
        ("1e30 0 0", "is beyond the range of simd"),
        ("1,x 0 0", "has a word that is not a number"),
        ("${x} 0 0", "is an unexpanded xacro expression"),
    ] {
        let message = refusal(&one_joint("continuous", &format!("<origin xyz='{value}'/>")));
        assert!(message.contains(why), "{message}");
    }
}

#[test]
fn numbers_as_solidworks_writes_them_are_read() {
    let (joint, report) =
        joint("continuous", "<origin xyz='3.4E-19 -0 .5' rpy=' 0\n0 0 '/><axis xyz='0 1 0'/>");
    assert_eq!(joint.parent_from_joint.translation.to_array(), [3.4e-19, -0.0, 0.5]);
    assert_eq!(warnings(&report), [""; 0]);
    let (_, report) = super::joint("continuous", "<origin xyz='' rpy='0 0 0'/>");
    assert_eq!(find(&report, "xyz is empty").severity, Severity::Info);
}

#[test]
fn strict_refuses_a_warning_and_says_which() {
    let urdf = one_joint("prismatic", "<limit lower='2' upper='-1'/>");
    let strict = ReadOptions { strict: true, ..ReadOptions::default() };
    let refused = read(urdf.as_bytes(), &Files::default(), &strict).unwrap_err();
    assert!(refused.message.contains("lower 2 is above upper -1"), "{refused}");
    assert_eq!(find(&refused.report, "were swapped").severity, Severity::Error);
    assert_eq!(robot(&urdf).1.at_least(Severity::Warning).count(), 1);
}

#[test]
fn a_description_lists_each_mesh_once_in_the_order_of_use() {
    let urdf = "<robot name='two words'><link name='a'>\
        <visual><geometry><mesh filename='b.STL'/></geometry></visual>\
        <collision><geometry><mesh filename='a b.stl'/></geometry></collision></link>\
        <link name='b'><visual><geometry><mesh filename='b.STL'/></geometry></visual></link></robot>";
    let described = describe(urdf.as_bytes()).unwrap();
    assert_eq!(described.name, "two words");
    assert_eq!(described.asset_uris, ["b.STL", "a b.stl"]);
}

#[test]
fn equals_signs_in_comments_and_scripts_are_no_attributes() {
    let line = "=".repeat(1000);
    robot(&format!(
        "<!-- {line} --><robot name='r'><link name='a'/><gazebo><![CDATA[{line}]]></gazebo></robot>"
    ));
}

//! Each limit at its value, where the file is read, and one above it, where it is refused or cut.

use std::time::Duration;

use simd_model::robot::{Geometry, RobotModel, Sha256};
use simd_model::{Asset, Assets, Disposition, LoadLimits, LoadReport, ReadOptions, Severity};

use crate::meshes;

/// Meshes by their number of triangles.
struct Made;

impl Assets for Made {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        let name = uri.trim_end_matches(".stl");
        // Files of as many triangles are not one file.
        let (count, which) = name.split_once('-').unwrap_or((name, "0"));
        let mut bytes = meshes::strewn(count.parse().unwrap());
        bytes[0] = which.as_bytes()[0];
        Ok(Asset { sha256: Sha256::of(&bytes), bytes: bytes.into() })
    }
}

/// Returns the robot, or the sentence that refuses it.
fn read(urdf: &[u8], limits: LoadLimits) -> Result<(RobotModel, LoadReport), String> {
    let options = ReadOptions { limits, ..ReadOptions::default() };
    simd_model::read(urdf, &Made, &options).map_err(|refused| refused.message)
}

fn refused(urdf: &str) -> String {
    read(urdf.as_bytes(), LoadLimits::default()).expect_err("it is past the limit")
}

fn is_read(urdf: &str) {
    if let Err(message) = read(urdf.as_bytes(), LoadLimits::default()) {
        panic!("it is at the limit, and refused: {message}");
    }
}

fn robot(content: &str) -> String {
    format!("<robot name='r'><link name='a'/>{content}</robot>")
}

fn times(count: usize, of: impl Fn(usize) -> String) -> String {
    (0..count).map(of).collect()
}

#[test]
fn bytes_of_a_urdf() {
    let most = LoadLimits::default().urdf_bytes;
    let padded = |size: usize| {
        let urdf = robot("");
        let spaces = " ".repeat(size - urdf.len());
        urdf + &spaces
    };
    is_read(&padded(most));
    assert_eq!(refused(&padded(most + 1)), "the URDF has 16777217 bytes; the limit is 16777216");
    // The bytes count in UTF-16 too.
    let wide: Vec<u8> = padded(most / 2 + 1).encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert!(read(&wide, LoadLimits::default()).unwrap_err().contains("16777218 bytes"));
}

#[test]
fn nodes_of_a_urdf() {
    let most = LoadLimits::default().xml_nodes as usize;
    // The document itself, the root and the link are nodes too.
    is_read(&robot(&"<x/>".repeat(most - 3)));
    assert_eq!(refused(&robot(&"<x/>".repeat(most - 2))), "the URDF has more than 250000 XML nodes");
}

#[test]
fn depth_of_a_urdf() {
    let most = LoadLimits::default().xml_depth;
    let nested = |depth: usize| robot(&("<x>".repeat(depth - 1) + &"</x>".repeat(depth - 1)));
    is_read(&nested(most));
    assert_eq!(refused(&nested(most + 1)), "line 1: elements are nested deeper than 100 levels");
}

#[test]
fn attributes_of_an_element() {
    let most = LoadLimits::default().xml_attributes;
    let with = |count: usize| robot(&format!("\n<x{}/>", times(count, |i| format!(" a{i}=''"))));
    is_read(&with(most));
    assert_eq!(refused(&with(most + 1)), "line 2: an element has some 129 attributes; the limit is 128");
}

#[test]
fn namespaces_of_a_urdf() {
    let most = LoadLimits::default().xml_namespaces;
    let with = |count: usize| robot(&times(count, |i| format!("<x xmlns='n{i}'/>")));
    is_read(&with(most));
    assert_eq!(refused(&with(most + 1)), "257 namespaces are declared; the limit is 256");
}

#[test]
fn bytes_of_a_name() {
    let most = LoadLimits::default().name_bytes;
    let with = |size: usize| format!("<robot name='r'>\n<link name='{}'/></robot>", "n".repeat(size));
    is_read(&with(most));
    let message = refused(&with(most + 1));
    assert!(message.ends_with("(line 2): name has 1025 bytes; the limit is 1024"), "{message}");
}

#[test]
fn links_and_joints_of_a_robot() {
    let most = LoadLimits::default().links;
    let link = |i: usize| format!("<link name='l{i}'/>");
    let joint = |i: usize| {
        format!(
            "<joint name='j{i}' type='fixed'><parent link='l{}'/><child link='l{}'/></joint>",
            i / 2,
            i + 1
        )
    };
    let with =
        |links: usize| format!("<robot name='r'>{}{}</robot>", times(links, link), times(links - 1, joint));
    is_read(&with(most));
    assert_eq!(refused(&with(most + 1)), "robot (line 1): the robot has 1001 links; the limit is 1000");
    let joints = format!("<robot name='r'><link name='l0'/>{}</robot>", times(most + 1, joint));
    assert_eq!(refused(&joints), "robot (line 1): the robot has 1001 joints; the limit is 1000");
}

#[test]
fn shapes_of_a_robot() {
    let most = LoadLimits::default().shapes;
    let shape = "<collision><geometry><sphere radius='1'/></geometry></collision>";
    let with =
        |count: usize| format!("<robot name='r'><link name='a'>{}</link></robot>", shape.repeat(count));
    is_read(&with(most));
    assert_eq!(refused(&with(most + 1)), "robot (line 1): the robot has 10001 shapes; the limit is 10000");
    let with = |count: usize| robot(&"<material name='m'/>".repeat(count));
    is_read(&with(most));
    assert_eq!(refused(&with(most + 1)), "robot (line 1): the robot has 10001 materials; the limit is 10000");
}

/// Returns a robot with a mesh for each name.
fn with_meshes(names: &[&str]) -> String {
    let mesh =
        |name: &&str| format!("<collision><geometry><mesh filename='{name}.stl'/></geometry></collision>");
    let meshes: String = names.iter().map(mesh).collect();
    format!("<robot name='r'><link name='a'>{meshes}</link></robot>")
}

/// Returns the number of meshes of a robot that were read, and the warnings.
fn meshes_read(names: &[&str], limits: LoadLimits) -> (usize, Vec<String>) {
    let (model, report) = read(with_meshes(names).as_bytes(), limits).unwrap();
    let is_there = |geometry: &Geometry| matches!(geometry, Geometry::Mesh { asset: Some(_), .. });
    let read = model.links[0].collisions.iter().filter(|collision| is_there(&collision.geometry)).count();
    let warnings = report.at_least(Severity::Warning).map(|finding| finding.message.clone());
    (read, warnings.filter(|message| message.contains("mesh")).collect())
}

#[test]
fn bytes_of_a_mesh() {
    let bytes = meshes::strewn(5).len();
    let at = LoadLimits { mesh_bytes: bytes, ..LoadLimits::default() };
    assert_eq!(meshes_read(&["5"], at), (1, vec![]));
    let past = LoadLimits { mesh_bytes: bytes - 1, ..LoadLimits::default() };
    let message = "mesh \"5.stl\" is not read: it has 334 bytes; the limit is 333; it touches nothing";
    assert_eq!(meshes_read(&["5"], past), (0, vec![message.to_owned()]));
}

/// The readers of the formats check the default before they allocate.
#[test]
fn triangles_of_a_mesh() {
    let at = LoadLimits { mesh_triangles: 5, ..LoadLimits::default() };
    assert_eq!(meshes_read(&["5"], at), (1, vec![]));
    let past = LoadLimits { mesh_triangles: 4, ..LoadLimits::default() };
    let message = "mesh \"5.stl\" is not read: it has 5 triangles; the limit is 4; it touches nothing";
    assert_eq!(meshes_read(&["5"], past), (0, vec![message.to_owned()]));
}

#[test]
fn triangles_of_a_robot() {
    let at = LoadLimits { robot_triangles: 8, ..LoadLimits::default() };
    assert_eq!(meshes_read(&["5-a", "3-b"], at), (2, vec![]));
    let past = LoadLimits { robot_triangles: 7, ..LoadLimits::default() };
    let message =
        "mesh \"3-b.stl\" is not read: with it the robot has more than 7 triangles; it touches nothing";
    assert_eq!(meshes_read(&["5-a", "3-b"], past), (1, vec![message.to_owned()]));
    // One file is counted once, however often it is named.
    assert_eq!(meshes_read(&["5-a", "5-a", "5-a"], past), (3, vec![]));
}

#[test]
fn findings_of_a_report() {
    let most = LoadLimits::default().findings;
    let ignored = |report: &LoadReport| {
        let one = |it: &&simd_model::Finding| it.disposition == Disposition::Ignored && it.line.is_some();
        let rest = report.findings.iter().find(|finding| finding.message.contains("left out"));
        (report.findings.iter().filter(one).count(), rest.map(|finding| finding.message.clone()))
    };
    let with = |count: usize| {
        let content = "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1'/></inertial>".to_owned();
        let urdf = format!("<robot name='r'><link name='a'>{content}{}</link></robot>", "<x/>".repeat(count));
        read(urdf.as_bytes(), LoadLimits::default()).unwrap().1
    };
    assert_eq!(ignored(&with(most)), (1000, None));
    assert_eq!(ignored(&with(most + 1)), (1000, Some("1 more findings like these are left out".to_owned())));
}

#[test]
fn seconds_of_reading() {
    let never = LoadLimits { time: Duration::ZERO, ..LoadLimits::default() };
    let message = read(robot("").as_bytes(), never).unwrap_err();
    assert_eq!(message, "reading it takes longer than 0 s, which is the limit");
    let ever = LoadLimits { time: Duration::MAX, ..LoadLimits::default() };
    assert!(read(robot("").as_bytes(), ever).is_ok());
}

#[test]
fn smaller_limits_are_kept_too() {
    let few = LoadLimits { links: 1, xml_nodes: 10, xml_depth: 2, name_bytes: 1, ..LoadLimits::default() };
    assert!(read(b"<robot name='r'><link name='a'/></robot>", few).is_ok());
    for (urdf, why) in [
        ("<robot name='r'><link name='a'/><link name='b'/></robot>", "2 links; the limit is 1"),
        ("<robot name='r'><link name='a'><x/></link></robot>", "deeper than 2 levels"),
        ("<robot name='rr'><link name='a'/></robot>", "2 bytes; the limit is 1"),
        (
            "<robot name='r'><link name='a'/><a/><a/><a/><a/><a/><a/><a/><a/></robot>",
            "more than 10 XML nodes",
        ),
    ] {
        let message = read(urdf.as_bytes(), few).unwrap_err();
        assert!(message.contains(why), "{message}");
    }
}

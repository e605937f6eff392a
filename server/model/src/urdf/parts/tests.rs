//! The robot of repaired elements is the one that urdf-rs reads from the same elements as text.

use std::fs;
use std::path::{Path, PathBuf};

use super::super::findings::Findings;
use super::super::{document, repair};
use super::*;
use crate::limits::LoadLimits;

/// Writes elements that urdf-rs knows.
fn write(part: &Part, xml: &mut String) {
    let (tag, attributes) = match part.tag {
        "texture" | "contact" => return,
        "cone" | "plane" => ("sphere", " radius=\"1\"".to_owned()),
        tag => {
            let texts = part.texts.iter().map(|(name, text)| (*name, escaped(text)));
            let numbers = part.numbers.iter().map(|(name, values)| {
                let words: Vec<String> = values.iter().map(|value| format!("{value:e}")).collect();
                (*name, words.join(" "))
            });
            let zeros = match tag {
                "inertia" => ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"].as_slice(),
                "limit" => &["velocity"],
                _ => &[],
            };
            let zeros = zeros.iter().filter(|name| part.number(name).is_none());
            let zeros = zeros.map(|name| (*name, "0".to_owned()));
            let all = texts.chain(numbers).chain(zeros).map(|(name, text)| format!(" {name}=\"{text}\""));
            (tag, all.collect())
        }
    };
    *xml += &format!("<{tag}{attributes}>");
    part.parts.iter().for_each(|part| write(part, xml));
    if part.tag == "inertial" {
        if part.find("mass").is_none() {
            *xml += "<mass value=\"0\"/>";
        }
        if part.find("inertia").is_none() {
            *xml += "<inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/>";
        }
    }
    *xml += &format!("</{tag}>");
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Compares a description's robot with the one of urdf-rs; `false` if the description is refused.
fn compare(urdf: &[u8], name: &str) -> bool {
    let limits = LoadLimits::default();
    let mut findings = Findings::new(limits.findings);
    let compared = document::open(urdf, &limits, &mut findings, |root, findings| {
        let part = repair::parts(root, &limits, findings)?;
        let mut xml = String::new();
        write(&part, &mut xml);
        let read = urdf_rs::read_from_string(&xml).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(format!("{:?}", robot(&part)), format!("{read:?}"), "{name}");
        Ok(())
    });
    compared.is_ok()
}

fn descriptions(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            descriptions(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "urdf") {
            found.push(path);
        }
    }
}

#[test]
fn a_robot_is_what_urdf_rs_reads() {
    let mut found = Vec::new();
    descriptions(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests"), &mut found);
    let read = found.iter().filter(|path| compare(&fs::read(path).unwrap(), &path.display().to_string()));
    let count = read.count();
    assert!(count > 20, "{count} of {} descriptions are read", found.len());
}

#[test]
fn all_elements_and_values_are_what_urdf_rs_reads() {
    let urdf = br#"<robot name="a &amp; &quot;b&quot; &lt;c&gt; 'd'">
      <material name=" red "><color rgba="1 0 0.1"/><texture filename="a.png"/></material>
      <link name="base">
        <inertial><origin xyz="0.1 -0 1e-300" rpy="1e5 3 0.30000000000000004"/></inertial>
        <inertial/>
        <contact><lateral_friction value="0.5"/></contact>
        <visual><geometry><cone radius="1" length="2"/></geometry><material name=""/></visual>
        <visual><origin rpy="0 0 1"/><geometry><mesh filename=" a b.stl" scale="2"/></geometry></visual>
        <visual><geometry><plane/></geometry></visual>
        <collision><geometry><capsule radius="0.2" length="1"/></geometry></collision>
        <collision><geometry><sphere radius="3"/></geometry></collision>
      </link>
      <link name="arm">
        <inertial><mass value="2"/><inertia ixx="1" iyy="5e-324"/></inertial>
        <visual><geometry><box size="1 2 3"/></geometry><material name="own"><color rgba="0 0 0 1"/></material></visual>
        <collision><geometry><cylinder radius="1" length="1.7976931348623157e8"/></geometry></collision>
      </link>
      <link name="hand"/>
      <joint name="a" type="REVOLUTE">
        <parent link="base"/><child link="arm"/><axis xyz="0 0.6 0.8"/>
        <limit lower="-inf" upper="1" effort="5" velocity="inf"/>
        <dynamics damping="0.5" armature="1"/><safety_controller k_velocity="3"/>
      </joint>
      <joint name="b" type="prismatic">
        <parent link="arm"/><child link="hand"/><limit effort="1"/>
        <mimic joint="a" multiplier="-2"/><dynamics friction="1"/><origin xyz="1 2 3"/>
      </joint>
    </robot>"#;
    assert!(compare(urdf, "all elements"));
}

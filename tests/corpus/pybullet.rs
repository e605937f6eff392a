//! The robots of `pybullet_data`: whether simd and PyBullet load them. A reader that shares only the XML
//! parser with simd's checks the result.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use roxmltree::{Document, Node};
use serde::Deserialize;
use simd_assets::Locator;
use simd_model::robot::{Geometry, JointKind, RobotModel};
use simd_model::{LoadReport, ReadOptions, Severity};
use simd_tests::pybullet_data;

use crate::case::Disk;

/// Results of `tests/reference/make_pybullet_loads.py`.
#[derive(Deserialize)]
struct PyBullet {
    files: usize,
    loaded: usize,
    refused: Vec<String>,
}

/// Files that simd refuses, each with the words of the reason: the torus is soft, it has no links.
const REFUSED: [(&str, &str); 1] = [("torus_deform.urdf", "the robot has no links")];

fn urdfs(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            match path.is_dir() {
                true => folders.push(path),
                false if path.extension().is_some_and(|extension| extension == "urdf") => found.push(path),
                false => {}
            }
        }
    }
    found.sort();
    found
}

#[test]
fn as_many_load_as_in_pybullet_and_each_as_an_independent_reader_finds_it() {
    let reference = Path::new(env!("CARGO_MANIFEST_DIR")).join("reference/pybullet_loads.json");
    let pybullet: PyBullet = serde_json::from_str(&std::fs::read_to_string(reference).unwrap()).unwrap();
    let root = pybullet_data::folder();
    let files = urdfs(&root);
    assert_eq!(files.len(), pybullet.files);
    let (mut refused, mut repaired, mut differences) = (Vec::new(), 0, Vec::new());
    let mut slowest = (Duration::ZERO, String::new());
    for path in &files {
        let name = path.strip_prefix(&root).unwrap().to_str().unwrap().to_owned();
        let bytes = std::fs::read(path).unwrap();
        let start = Instant::now();
        // PyBullet looks in its data folder too.
        let locator = Locator::new(path).within(&root);
        let read = simd_model::read(&bytes, &Disk(locator), &ReadOptions::default());
        slowest = slowest.max((start.elapsed(), name.clone()));
        match read {
            Err(why) => refused.push((name, why.message)),
            Ok((model, report)) => {
                repaired += usize::from(report.at_least(Severity::Warning).count() > 0);
                let found = different(&Plain::of_text(&bytes), &Plain::of_model(&model), &report);
                differences.extend(found.into_iter().map(|difference| format!("{name}: {difference}")));
            }
        }
    }
    let loaded = files.len() - refused.len();
    println!(
        "{} files; PyBullet loads {}, simd {loaded}, {repaired} with a warning",
        files.len(),
        pybullet.loaded
    );
    println!("slowest: {:.0?} {}", slowest.0, slowest.1);
    for (name, why) in &refused {
        println!("simd refuses {name}: {why}");
    }
    for name in pybullet.refused.iter().filter(|name| refused.iter().all(|(other, _)| other != *name)) {
        println!("PyBullet refuses {name}, which simd loads");
    }
    assert!(differences.is_empty(), "{} differences:\n{}", differences.len(), differences.join("\n"));
    let is_right = |(name, why): &(String, String)| {
        REFUSED.iter().any(|(expected, words)| name == expected && why.contains(words))
    };
    assert!(refused.len() == REFUSED.len() && refused.iter().all(is_right), "{refused:?}");
    assert!(loaded >= pybullet.loaded, "{loaded} of {}", pybullet.loaded);
}

/// A robot without anything that needs a decision.
#[derive(Debug, Default, PartialEq)]
struct Plain {
    /// Mass, and shapes that touch.
    links: BTreeMap<String, (f64, Vec<String>)>,
    /// Type, parent, child.
    joints: BTreeMap<String, [String; 3]>,
}

/// Returns the differences without a warning in the report.
fn different(text: &Plain, model: &Plain, report: &LoadReport) -> Vec<String> {
    let is_reported = |element: &str, words: &[&str]| {
        let of = |finding: &&simd_model::Finding| finding.element.starts_with(element);
        report.findings.iter().filter(of).any(|finding| {
            let repaired = finding.severity >= Severity::Warning;
            repaired || words.iter().any(|words| finding.message.contains(words))
        })
    };
    let mut found = Vec::new();
    let names: [Vec<&String>; 2] = [text, model].map(|robot| robot.links.keys().collect());
    if names[0] != names[1] {
        found.push(format!("links {names:?}"));
    }
    for (name, (mass, shapes)) in &text.links {
        let Some((model_mass, model_shapes)) = model.links.get(name) else { continue };
        let element = format!("link \"{name}\"");
        if mass != model_mass && !is_reported(&element, &["it has no mass"]) {
            found.push(format!("{element}: mass {mass} is {model_mass}"));
        }
        if shapes != model_shapes && !is_reported(&element, &[]) {
            found.push(format!("{element}: {shapes:?} are {model_shapes:?}"));
        }
    }
    let names: [Vec<&String>; 2] = [text, model].map(|robot| robot.joints.keys().collect());
    if names[0] != names[1] {
        found.push(format!("joints {names:?}"));
    }
    for (name, joint) in &text.joints {
        if model.joints.get(name).is_some_and(|other| other != joint) {
            found.push(format!("joint {name}: {joint:?} is {:?}", model.joints[name]));
        }
    }
    found
}

fn child<'a, 'i>(node: Node<'a, 'i>, tag: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|child| child.has_tag_name(tag))
}

fn attribute(node: Option<Node>, name: &str) -> String {
    node.and_then(|node| node.attribute(name)).unwrap_or_default().to_owned()
}

/// Returns the numbers of an attribute, as short as can be; commas are spaces.
fn numbers(node: Node, name: &str) -> String {
    let text = attribute(Some(node), name).replace(',', " ");
    let numbers: Vec<String> = text
        .split_whitespace()
        .map(|word| word.parse().map_or(f64::NAN, |number: f64| number).to_string())
        .collect();
    numbers.join(" ")
}

impl Plain {
    /// Reads the numbers by walking the elements.
    fn of_text(bytes: &[u8]) -> Self {
        let text = String::from_utf8_lossy(bytes);
        let robot = text.find("<robot").unwrap()..text.rfind("</robot>").unwrap() + "</robot>".len();
        let mut text = text[robot].to_owned();
        while let Err(roxmltree::Error::UnknownNamespace(prefix, _)) = Document::parse(&text) {
            text.insert_str("<robot".len(), &format!(" xmlns:{prefix}='{prefix}'"));
        }
        let document = Document::parse(&text).unwrap();
        let mut plain = Self::default();
        for node in document.root_element().children() {
            let name = attribute(Some(node), "name");
            if node.has_tag_name("link") {
                let mass = child(node, "inertial").and_then(|inertial| child(inertial, "mass"));
                let mass = mass
                    .and_then(|mass| mass.attribute("value"))
                    .map_or(0.0, |mass| mass.trim().parse().unwrap_or(f64::NAN));
                let collisions = node.children().filter(|child| child.has_tag_name("collision"));
                plain.links.insert(name, (mass, collisions.filter_map(shape).collect()));
            } else if node.has_tag_name("joint") {
                let end = |tag| attribute(child(node, tag), "link");
                plain.joints.insert(name, [attribute(Some(node), "type"), end("parent"), end("child")]);
            }
        }
        plain
    }

    /// Returns the numbers of simd's robot.
    fn of_model(model: &RobotModel) -> Self {
        let link = |link: &simd_model::robot::Link| {
            let shapes = link.collisions.iter().map(|collision| described(&collision.geometry)).collect();
            (link.name.clone(), (link.inertial.mass, shapes))
        };
        let joint = |joint: &simd_model::robot::Joint| {
            let kind = match joint.kind {
                JointKind::Revolute => "revolute",
                JointKind::Continuous => "continuous",
                JointKind::Prismatic => "prismatic",
                JointKind::Fixed => "fixed",
                JointKind::Floating => "floating",
                JointKind::Planar => "planar",
                JointKind::Spherical => "spherical",
            };
            let ends = [joint.parent, joint.child].map(|link| model.links[link].name.clone());
            let [parent, child] = ends;
            (joint.name.clone(), [kind.to_owned(), parent, child])
        };
        Self {
            links: model.links.iter().map(link).collect(),
            joints: model.joints.iter().map(joint).collect(),
        }
    }
}

fn shape(collision: Node) -> Option<String> {
    let shape = child(collision, "geometry")?.children().find(Node::is_element)?;
    let sizes: &[&str] = match shape.tag_name().name() {
        "box" => &["size"],
        "sphere" => &["radius"],
        "cylinder" | "capsule" | "cone" => &["radius", "length"],
        "plane" => &["normal"],
        "mesh" => return Some(format!("mesh {}", attribute(Some(shape), "filename"))),
        // Bullet has more shapes than URDF.
        other => return Some(other.to_owned()),
    };
    let sizes: Vec<String> = sizes.iter().map(|name| numbers(shape, name)).collect();
    Some(format!("{} {}", shape.tag_name().name(), sizes.join(" ")))
}

fn described(geometry: &Geometry) -> String {
    let several = |numbers: [f64; 3]| numbers.map(|number| number.to_string()).join(" ");
    match geometry {
        Geometry::Box { size } => format!("box {}", several(size.to_array())),
        Geometry::Sphere { radius } => format!("sphere {radius}"),
        Geometry::Cylinder { radius, length } => format!("cylinder {radius} {length}"),
        Geometry::Capsule { radius, length } => format!("capsule {radius} {length}"),
        Geometry::Cone { radius, length } => format!("cone {radius} {length}"),
        Geometry::Plane { normal } => format!("plane {}", several(normal.to_array())),
        Geometry::Mesh { uri, .. } => format!("mesh {uri}"),
    }
}

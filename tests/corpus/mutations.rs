//! No change of a good file makes the reader panic or return an impossible robot: each result is a tree with
//! finite numbers.

use std::path::{Path, PathBuf};

use fastrand::Rng;
use simd_model::robot::{Geometry, RobotModel};
use simd_model::{Asset, Assets, ReadOptions, Severity};

use crate::case::Case;

/// No files at all.
pub(crate) struct Nothing;

impl Assets for Nothing {
    fn find(&self, _uri: &str) -> Result<Asset, Vec<String>> {
        Err(Vec::new())
    }
}

/// Returns the URDFs of the repository, and the cases of the corpus.
fn good_files() -> Vec<Vec<u8>> {
    let is_read = |case: &&Case| case.read().model.is_some();
    let mut files: Vec<Vec<u8>> = Case::all().iter().filter(is_read).map(Case::bytes).collect();
    let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("assets")];
    while let Some(folder) = folders.pop() {
        let mut inside: Vec<PathBuf> =
            std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        inside.sort();
        for path in inside {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|it| it == "urdf") {
                files.push(std::fs::read(path).unwrap());
            }
        }
    }
    files
}

/// Words that harm readers of URDF.
const WORDS: &[&str] = &[
    "",
    " ",
    "0",
    "-0",
    "-1",
    "1e-320",
    "1e18",
    "-1e18",
    "1e19",
    "1e308",
    "inf",
    "-inf",
    "nan",
    "0,5",
    "1 2 3 4",
    "${x}",
    "$(optenv A 1 2 3)",
    "<",
    ">",
    "/>",
    "\"",
    "'",
    "&",
    "&#0;",
    "&#x10FFFF;",
    "]]>",
    "<!--",
    "-->",
    "<?xml?>",
    "\0",
    "\u{feff}",
    "é",
    "日本",
    "<a>",
    "</robot>",
    "xmlns=''",
    "x:y='1'",
    "spherical",
    "floating",
    "planar",
    "mesh",
    "<limit/>",
    "<mimic joint='j'/>",
    "<inertial/>",
    "<gazebo reference='a'><mu1>x</mu1></gazebo>",
    "../../../etc/passwd",
];

/// Damages a file, most often a little.
fn damage(mut bytes: Vec<u8>, random: &mut Rng) -> Vec<u8> {
    for _ in 0..=random.usize(..3) {
        let start = random.usize(..=bytes.len());
        let end = (start + random.usize(..24)).min(bytes.len());
        match random.u8(..16) {
            // A word instead of some bytes.
            0 | 1 => drop(bytes.splice(start..end, random.choice(WORDS).unwrap_or(&"").bytes())),
            // The value of an attribute.
            2..=11 => replace_value(&mut bytes, random),
            // A piece twice, or nowhere.
            12 => {
                let piece = bytes[start..end].to_vec();
                bytes.splice(start..start, piece);
            }
            13 => drop(bytes.drain(start..end)),
            // A line elsewhere: elements in the wrong place.
            _ => {
                let mut lines: Vec<&[u8]> = bytes.split(|byte| *byte == b'\n').collect();
                let (one, other) = (random.usize(..lines.len()), random.usize(..lines.len()));
                lines.swap(one, other);
                bytes = lines.join(&b'\n');
            }
        }
    }
    bytes
}

/// Replaces a value by the same number of other numbers, or by a harmful word.
fn replace_value(bytes: &mut Vec<u8>, random: &mut Rng) {
    const NUMBERS: &[&str] = &["0", "-0", "-1", "1", "0.3", "1e-320", "1e-9", "1000", "1e18", "-1e18"];
    let quotes: Vec<usize> = (0..bytes.len()).filter(|i| bytes[*i] == b'"' || bytes[*i] == b'\'').collect();
    if quotes.len() < 2 {
        return;
    }
    // From an opening quote to its closing one, unless either is damaged.
    let first = 2 * random.usize(..quotes.len() / 2);
    let value = quotes[first] + 1..quotes[first + 1];
    let text = String::from_utf8_lossy(&bytes[value.clone()]).into_owned();
    let is_numbers = text.split_whitespace().all(|word| word.parse::<f64>().is_ok());
    let new = if is_numbers && random.u8(..8) > 0 {
        let number = |_| *random.choice(NUMBERS).unwrap();
        text.split_whitespace().map(number).collect::<Vec<_>>().join(" ")
    } else {
        (*random.choice(WORDS).unwrap()).to_owned()
    };
    bytes.splice(value, new.bytes());
}

fn is_sound(model: &RobotModel) {
    assert_eq!(model.joints.len() + 1, model.links.len());
    for (index, joint) in model.joints.iter().enumerate() {
        assert!(joint.child == index + 1 && joint.parent <= index);
        assert!((joint.axis.length() - 1.0).abs() < 1e-9, "{joint:?}");
        let (lower, upper) = joint.limits.range();
        assert!(lower <= upper && joint.damping >= 0.0 && joint.friction >= 0.0, "{joint:?}");
        assert!(joint.limits.effort.is_none_or(|effort| effort > 0.0 && effort.is_finite()), "{joint:?}");
        assert!(joint.parent_from_joint.translation.is_finite(), "{joint:?}");
        let leads = |joint: usize| model.joints[joint].mimic.map(|mimic| mimic.joint);
        let steps = std::iter::successors(leads(index), |next| leads(*next)).take(model.joints.len() + 1);
        assert!(steps.count() <= model.joints.len(), "{joint:?} follows itself");
    }
    for link in &model.links {
        let inertial = &link.inertial;
        assert!(
            inertial.mass >= 0.0 && inertial.mass.is_finite() && inertial.inertia.is_finite(),
            "{link:?}"
        );
        for collision in &link.collisions {
            let size = match &collision.geometry {
                Geometry::Box { size } => size.min_element(),
                Geometry::Sphere { radius } => *radius,
                Geometry::Cylinder { radius, length }
                | Geometry::Capsule { radius, length }
                | Geometry::Cone { radius, length } => radius.min(*length),
                Geometry::Plane { normal } => normal.length(),
                Geometry::Mesh { scale, .. } => scale.abs().min_element(),
            };
            assert!(size > 0.0 && size.is_finite(), "{collision:?}");
            assert!(collision.material.friction.is_none_or(|friction| friction >= 0.0));
        }
    }
}

#[test]
fn no_damage_to_a_good_file_makes_the_reader_panic() {
    let files = good_files();
    let (mut read, mut refused) = (0, 0);
    for seed in 0..12_000_u64 {
        let random = &mut Rng::with_seed(seed);
        let bytes = damage(files[random.usize(..files.len())].clone(), random);
        let scale = *random.choice(&[1.0, 1.0, 1e-3, 1000.0]).unwrap();
        let options = ReadOptions { scale, strict: random.u8(..8) == 0, ..ReadOptions::default() };
        match simd_model::read(&bytes, &Nothing, &options) {
            Ok((model, _)) => {
                is_sound(&model);
                read += 1;
            }
            Err(why) => {
                let last = why.report.findings.last().map(|finding| finding.severity);
                assert_eq!(last, Some(Severity::Error), "seed {seed}: {why}");
                assert!(!why.message.is_empty() && !why.message.contains("urdf-rs"), "seed {seed}: {why}");
                refused += 1;
            }
        }
    }
    println!("{read} damaged files were read, {refused} refused");
    assert!(read > 2000 && refused > 2000, "{read} read, {refused} refused");
}

//! Each element and attribute of the published schemas of SDF and MJCF is read, or the report names it.
//!
//! `schemas/*.txt` has the names. The indentation of a line is the level of its element; the type of its text follows a
//! colon, and its attributes follow `@`. SDF's names are those of sdformat 1.9, MJCF's are those that `mj_printSchema` of
//! MuJoCo prints. The test puts each into a description with several values. One of them must change the robots, or the
//! report says that it is not read.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use simd_model::{Disposition, LoadLimits, TranslatedModel, Translation};

use crate::mutations::Nothing;

/// Words that change nothing in the description of this test: other settings and files use them. Cases of `descriptions` do.
const USED_ELSEWHERE: [&str; 9] = [
    "compiler@assetdir",
    "compiler@balanceinertia",
    "compiler@coordinate",
    "compiler@fitaabb",
    "compiler@meshdir",
    "compiler@strippath",
    "compiler@texturedir",
    "default@class",
    "default/geom@group",
];

/// An element of a description or of a schema.
#[derive(Clone, Debug, Default)]
struct Node {
    tag: String,
    attributes: Vec<(String, String)>,
    text: String,
    children: Vec<Node>,
}

impl Node {
    fn parse(xml: &str) -> Self {
        fn of(node: roxmltree::Node) -> Node {
            Node {
                tag: node.tag_name().name().to_owned(),
                attributes: node
                    .attributes()
                    .map(|it| (it.name().to_owned(), it.value().to_owned()))
                    .collect(),
                text: node.text().unwrap_or_default().trim().to_owned(),
                children: node.children().filter(roxmltree::Node::is_element).map(of).collect(),
            }
        }
        of(roxmltree::Document::parse(xml).unwrap().root_element())
    }

    /// The element at a path below this one. Elements that are missing are added.
    fn at(&mut self, path: &[String]) -> &mut Self {
        let [tag, rest @ ..] = path else { return self };
        let index = self.children.iter().position(|child| child.tag == *tag).unwrap_or_else(|| {
            self.children.push(Self { tag: tag.clone(), ..Self::default() });
            self.children.len() - 1
        });
        self.children[index].at(rest)
    }

    fn set(&mut self, name: &str, value: &str) {
        self.attributes.retain(|(other, _)| other != name);
        self.attributes.push((name.to_owned(), value.to_owned()));
    }

    fn write(&self, out: &mut String) {
        let attributes: String =
            self.attributes.iter().map(|(name, value)| format!(" {name}=\"{value}\"")).collect();
        write!(out, "<{}{attributes}>{}", self.tag, self.text).unwrap();
        self.children.iter().for_each(|child| child.write(out));
        writeln!(out, "</{}>", self.tag).unwrap();
    }
}

/// A name of a schema.
struct Word {
    /// Tags from below the root to the element.
    path: Vec<String>,
    attribute: Option<String>,
    /// Type of the element's text; empty for elements without text.
    text: String,
}

impl Word {
    fn name(&self) -> String {
        let at = self.attribute.as_ref().map(|name| format!("@{name}")).unwrap_or_default();
        format!("{}{at}", self.path.join("/"))
    }

    fn values(&self) -> &'static [&'static str] {
        match (&self.attribute, self.text.as_str()) {
            (Some(_), _) => &[
                "0.37",
                "2",
                "0.1 0.2",
                "0.1 0.2 0.3",
                "0.5 0.5 0.5 0.5",
                "0.1 0.2 0.3 0.4 0.5 0.6",
                "true",
                "false",
                "x",
                "shell",
                "edge",
                "checker",
                "slide",
                "quat_xyzw",
            ],
            (None, "") => &[""],
            (None, "bool") => &["true", "false"],
            (None, "string") => &["x", "1"],
            _ => &["0.37", "3", "0.1 0.2", "0.1 0.2 0.3", "0.5 0.5 0.5 0.5", "0.1 0.2 0.3 0.4 0.5 0.6"],
        }
    }
}

fn words(schema: &str) -> Vec<Word> {
    let mut words = Vec::new();
    let mut path: Vec<String> = Vec::new();
    for line in schema.lines().skip(1) {
        let mut parts = line.split_whitespace();
        let (tag, text) = parts.next().map(|head| head.split_once(':').unwrap_or((head, ""))).unwrap();
        path.truncate(line.len() - line.trim_start().len() - 1);
        path.push(tag.to_owned());
        words.push(Word { path: path.clone(), attribute: None, text: text.to_owned() });
        words.extend(parts.map(|attribute| Word {
            path: path.clone(),
            attribute: Some(attribute.trim_start_matches('@').to_owned()),
            text: String::new(),
        }));
    }
    words
}

/// The robots of a description, and the findings of what is ignored; nothing if it is refused.
fn read(document: &Node) -> Option<(Translation, BTreeSet<String>)> {
    let mut xml = String::new();
    document.write(&mut xml);
    let translation = simd_model::translate(xml.as_bytes(), &Nothing, &LoadLimits::default()).ok()??;
    let ignored =
        translation.report.findings.iter().filter(|finding| finding.disposition == Disposition::Ignored);
    let ignored = ignored.map(|finding| format!("{} {}", finding.element, finding.message)).collect();
    Some((translation, ignored))
}

/// Whether both give the same robots; lines may differ.
fn are_equal(one: &Translation, other: &Translation) -> bool {
    let robot = |it: &TranslatedModel| (it.urdf.clone(), it.pose, it.fixed);
    one.models.iter().map(robot).eq(other.models.iter().map(robot)) && one.meshes == other.meshes
}

/// Whether no value of a word changes anything, and no finding names it.
fn is_lost(base: &Node, word: &Word) -> bool {
    let mut without = base.clone();
    if word.attribute.is_some() {
        without.at(&word.path);
    } else {
        without.at(&word.path[..word.path.len() - 1]);
    }
    let without = read(&without);
    let mut accepted = 0;
    for value in word.values() {
        let mut with = base.clone();
        let element = with.at(&word.path);
        match &word.attribute {
            Some(name) => element.set(name, value),
            None => element.text = (*value).to_owned(),
        }
        let Some((translation, ignored)) = read(&with) else { continue };
        accepted += 1;
        let is_read = without.as_ref().is_none_or(|(other, _)| !are_equal(other, &translation));
        let has = |name: &String| {
            let is_name = |part: &str| part == name;
            ignored.iter().any(|it| it.split(|c: char| !c.is_alphanumeric() && c != '_').any(is_name))
        };
        if is_read || word.path.iter().chain(&word.attribute).any(has) {
            return false;
        }
    }
    accepted > 0
}

fn lost(schema: &str, base: &str) -> Vec<String> {
    let base = Node::parse(base);
    assert!(read(&base).is_some());
    let words = words(schema);
    // The contents of an element stand for it.
    let is_container = |word: &Word| {
        let is_within = |other: &Word| other.path.starts_with(&word.path) && other.name() != word.name();
        word.attribute.is_none() && word.text.is_empty() && words.iter().any(is_within)
    };
    let lost = words.iter().filter(|word| !is_container(word) && is_lost(&base, word)).map(Word::name);
    lost.filter(|name| !name.ends_with("@name") && !USED_ELSEWHERE.contains(&name.as_str())).collect()
}

#[test]
fn each_word_of_sdf_is_read_or_named() {
    let lost = lost(include_str!("schemas/sdf.txt"), include_str!("schemas/base.sdf"));
    assert!(lost.is_empty(), "{} are lost:\n{}", lost.len(), lost.join("\n"));
}

#[test]
fn each_word_of_mjcf_is_read_or_named() {
    let lost = lost(include_str!("schemas/mjcf.txt"), include_str!("schemas/base.xml"));
    assert!(lost.is_empty(), "{} are lost:\n{}", lost.len(), lost.join("\n"));
}

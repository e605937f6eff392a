//! Checks the structure of the document before any recursive code reads it.

use std::collections::{HashMap, HashSet};

use roxmltree::{Document, Error, Node, NodeId, ParsingOptions};

use super::Description;
use super::findings::{Findings, Refusal, quoted};
use super::vocabulary::NAMELESS;
use crate::limits::LoadLimits;
use crate::report::Disposition::Repaired;

/// Parses with a limit on nodes. Neither roxmltree nor this code recurses.
pub(crate) fn parse_xml<'t>(text: &'t str, limits: &LoadLimits) -> Result<Document<'t>, Error> {
    let options = ParsingOptions { allow_dtd: false, nodes_limit: limits.xml_nodes, ..Default::default() };
    Document::parse_with_options(text, options)
}

/// Checks counts that slow roxmltree before it parses the text.
pub(crate) fn check_counts(text: &str, limits: &LoadLimits) -> Result<(), Refusal> {
    let namespaces = text.matches("xmlns").count();
    if namespaces > limits.xml_namespaces {
        let cap = limits.xml_namespaces;
        return Err(Refusal::of_file(format!("{namespaces} namespaces are declared; the limit is {cap}")));
    }
    // Each node has at most two tags.
    let most_tags = 2 * (limits.xml_nodes as usize) + 2;
    let (mut line, mut tags) = (1, 0);
    let mut rest = text;
    while let Some(open) = rest.find('<') {
        let (skipped, tag) = rest.split_at(open);
        line += newlines(skipped);
        tags += 1;
        if tags > most_tags {
            return Err(too_many_nodes(limits));
        }
        let length = if tag.starts_with("<!--") {
            tag.find("-->").unwrap_or(tag.len())
        } else if tag.starts_with("<![CDATA[") {
            tag.find("]]>").unwrap_or(tag.len())
        } else {
            let length = tag.get(1..).and_then(|tag| tag.find('<')).map_or(tag.len(), |next| next + 1);
            let signs = tag.bytes().take(length).filter(|byte| *byte == b'=').count();
            if signs > limits.xml_attributes {
                let cap = limits.xml_attributes;
                let message = format!("an element has some {signs} attributes; the limit is {cap}");
                return Err(Refusal::at(line, message));
            }
            length
        };
        let (passed, next) = tag.split_at(length);
        line += newlines(passed);
        rest = next;
    }
    Ok(())
}

fn too_many_nodes(limits: &LoadLimits) -> Refusal {
    Refusal::of_file(format!("the URDF has more than {} XML nodes", limits.xml_nodes))
}

fn newlines(text: &str) -> u32 {
    text.bytes().fold(0, |n, byte| n + u32::from(byte == b'\n'))
}

/// Refuses elements that are deeper than the limit.
pub(crate) fn check_depth(document: &Document, cap: usize) -> Result<(), Refusal> {
    // In document order, a parent comes before its children.
    let mut depths: HashMap<NodeId, usize> = HashMap::new();
    for node in document.descendants().filter(Node::is_element) {
        let above = node.parent_element().and_then(|parent| depths.get(&parent.id()));
        let depth = above.map_or(1, |above| above + 1);
        if depth > cap {
            let line = document.text_pos_at(node.range().start).row;
            return Err(Refusal::at(line, format!("elements are nested deeper than {cap} levels")));
        }
        depths.insert(node.id(), depth);
    }
    Ok(())
}

/// Returns the fault of the text, as a sentence.
pub(crate) fn syntax(error: Error, limits: &LoadLimits) -> Refusal {
    match error {
        Error::NodesLimitReached => too_many_nodes(limits),
        Error::DtdDetected => {
            Refusal::of_file("the URDF has a document type declaration (DTD); simd reads none".to_owned())
        }
        Error::NoRootNode => Refusal::of_file("this is not a URDF: it has no root element".to_owned()),
        Error::DuplicatedAttribute(name, at) => {
            Refusal::at(at.row, format!("attribute {} is given twice at column {}", quoted(&name), at.col))
        }
        Error::UnexpectedEndOfStream | Error::UnclosedRootNode => {
            Refusal::of_file("the XML is broken: the file ends before its root element does".to_owned())
        }
        Error::UnknownToken(at) => {
            let message =
                "the XML is broken at column {}: a tag, a comment or the end of the file must be here";
            Refusal::at(at.row, message.replace("{}", &at.col.to_string()))
        }
        error => {
            let position = error.pos();
            let text = error.to_string();
            let what = text.strip_suffix(&format!(" at {position}")).unwrap_or(&text);
            let what: String = what.chars().take(200).collect();
            Refusal::at(position.row, format!("the XML is broken at column {}: {what}", position.col))
        }
    }
}

/// Returns the `<robot>`, if the document is a URDF.
pub(crate) fn robot_element<'a, 'i>(
    document: &'a Document<'i>,
    findings: &mut Findings,
) -> Result<Node<'a, 'i>, Refusal> {
    let root = document.root_element();
    let robot = if is(root, "robot") { root } else { inner_robot(root, findings)? };
    if let Some(node) = document.descendants().find(|node| is_directive(*node)) {
        let message = "this is a xacro file: name it .xacro, or run xacro on it and load the result";
        return Err(Refusal::at(findings.line(node), message.to_owned()));
    }
    if !robot.children().any(|node| is(node, "link")) {
        // An extension of Bullet.
        let soft = robot.children().find(|node| is(*node, "deformable") || is(*node, "reduced_deformable"));
        let why = soft.map(|node| {
            format!(": <{}> is a soft body, and simd has rigid bodies only", node.tag_name().name())
        });
        return Err(findings.refuse(robot, format!("the robot has no links{}", why.unwrap_or_default())));
    }
    Ok(robot)
}

/// Returns whether an element is in xacro's namespace, declared or not.
pub(crate) fn is_of_xacro(node: Node) -> bool {
    node.tag_name().namespace().is_some_and(|uri| uri.contains("xacro"))
}

/// Returns whether an element is a directive of xacro, none of which remain after an expansion. Other
/// elements call macros; xacro does not change the call of an unknown macro.
fn is_directive(node: Node) -> bool {
    const DIRECTIVES: [&str; 11] = [
        "arg",
        "attribute",
        "call",
        "element",
        "if",
        "include",
        "insert_block",
        "macro",
        "property",
        "unless",
        "tag",
    ];
    is_of_xacro(node) && DIRECTIVES.contains(&node.tag_name().name())
}

/// Returns the robot in `<urdf><robot>...</robot></urdf>`, as some exporters write it.
fn inner_robot<'a, 'i>(root: Node<'a, 'i>, findings: &mut Findings) -> Result<Node<'a, 'i>, Refusal> {
    let tag = quoted(root.tag_name().name()).replace('"', "");
    let mut robots = root.children().filter(|node| is(*node, "robot"));
    let (Some(robot), None) = (robots.next(), robots.next()) else {
        let advice = match tag.as_str() {
            "sdf" | "mujoco" => "; `simctl robot convert` writes it as URDF",
            "COLLADA" => "; this is a mesh: send the URDF that names it",
            _ if tag.eq_ignore_ascii_case("robot") => "; write it <robot>",
            _ => "",
        };
        let message = format!("this is not a URDF: the root element is <{tag}>{advice}");
        return Err(Refusal::at(findings.line(root), message));
    };
    findings.warn(robot, Repaired, format!("it stands inside of <{tag}>; read as if it were the root"));
    Ok(robot)
}

/// Returns whether a node is an element of URDF with this name.
pub(crate) fn is(node: Node, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name && node.tag_name().namespace() == node_default(node)
}

/// Returns the default namespace: an `xmlns` on the root applies to all elements, which are URDF
/// nevertheless.
fn node_default<'a>(node: Node<'a, '_>) -> Option<&'a str> {
    node.document().root_element().default_namespace()
}

/// Returns the elements that name mesh files, in the order of the text.
pub(crate) fn meshes<'a, 'input>(root: Node<'a, 'input>) -> impl Iterator<Item = Node<'a, 'input>> {
    root.children()
        .filter(|node| is(*node, "link"))
        .flat_map(|link| link.children().filter(|node| is(*node, "visual") || is(*node, "collision")))
        .flat_map(|shape| shape.children().filter(|node| is(*node, "geometry")))
        .flat_map(|geometry| geometry.children().filter(|node| is(*node, "mesh")))
}

/// Returns the materials of the robot and of its visuals.
fn materials<'a, 'input>(root: Node<'a, 'input>) -> impl Iterator<Item = Node<'a, 'input>> {
    let visuals = root
        .children()
        .filter(|node| is(*node, "link"))
        .flat_map(|link| link.children().filter(|node| is(*node, "visual")));
    let own = visuals.flat_map(|visual| visual.children().filter(|node| is(*node, "material")));
    root.children().filter(|node| is(*node, "material")).chain(own)
}

/// Returns the URI of a material's picture.
pub(super) fn texture_of<'a>(material: Node<'a, '_>) -> Option<&'a str> {
    texture(material)?.attribute("filename").filter(|uri| !uri.trim().is_empty())
}

/// Returns the texture element of a material.
pub(super) fn texture<'a, 'input>(material: Node<'a, 'input>) -> Option<Node<'a, 'input>> {
    material.children().find(|node| is(*node, "texture"))
}

/// Returns the name, the URIs of meshes and the URIs of pictures.
pub(crate) fn description(root: Node) -> Description {
    let mut seen = HashSet::new();
    let asset_uris = meshes(root)
        .filter_map(|mesh| mesh.attribute("filename"))
        .chain(materials(root).filter_map(texture_of))
        .filter(|uri| !uri.trim().is_empty() && seen.insert(*uri))
        .map(str::to_owned)
        .collect();
    let name = root.attribute("name").filter(|name| !name.trim().is_empty()).unwrap_or(NAMELESS);
    Description { name: name.to_owned(), asset_uris, models: Vec::new() }
}

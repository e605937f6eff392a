//! The structure of the document, checked before anything that recurses sees it.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

use roxmltree::{Document, Error, Node, NodeId, ParsingOptions};

use super::Description;
use super::findings::{Findings, Refusal, quoted};
use super::vocabulary::NAMELESS;
use crate::limits;
use crate::report::Disposition;

/// Parses the text. Neither roxmltree nor what is here recurses.
pub(super) fn parse(text: &str) -> Result<Document<'_>, Refusal> {
    check_counts(text)?;
    let document = parse_xml(text).map_err(syntax)?;
    check_depth(&document)?;
    Ok(document)
}

fn parse_xml(text: &str) -> Result<Document<'_>, Error> {
    let options = ParsingOptions { allow_dtd: false, nodes_limit: limits::XML_NODES, ..Default::default() };
    Document::parse_with_options(text, options)
}

/// Real files use prefixes that they do not declare (`<controller:plugin>`):
/// declares them at the root, on the root's line.
pub(super) fn bind_prefixes<'a>(text: &'a str, findings: &mut Findings) -> Result<Cow<'a, str>, Refusal> {
    const MOST: usize = 16;
    check_counts(text)?;
    let mut text = Cow::Borrowed(text);
    for _ in 0..MOST {
        let prefix = match parse_xml(&text) {
            Err(Error::UnknownNamespace(prefix, _)) if prefix.len() <= limits::NAME_BYTES => prefix,
            _ => break,
        };
        let Some(end) = root_name_end(&text) else { break };
        let (before, after) = text.split_at(end);
        text = Cow::Owned(format!("{before} xmlns:{prefix}=\"undeclared:{prefix}\"{after}"));
        let message = format!("the prefix {} is not declared; read as if it were", quoted(&prefix));
        findings.info_of_file(Disposition::Repaired, message);
    }
    Ok(text)
}

/// Where the name in the root's start tag ends.
fn root_name_end(text: &str) -> Option<usize> {
    let mut at = 0;
    loop {
        let rest = text.get(at..)?;
        let open = rest.find('<')?;
        let tag = rest.get(open..)?;
        let end = if tag.starts_with("<!--") {
            tag.find("-->")? + 3
        } else if tag.starts_with("<?") {
            tag.find("?>")? + 2
        } else {
            let name = tag.find(|c: char| c.is_whitespace() || c == '>' || c == '/')?;
            return Some(at + open + name);
        };
        at += open + end;
    }
}

/// Counts that make roxmltree slow, before it sees them.
fn check_counts(text: &str) -> Result<(), Refusal> {
    let namespaces = text.matches("xmlns").count();
    if namespaces > limits::XML_NAMESPACES {
        let cap = limits::XML_NAMESPACES;
        return Err(Refusal::of_file(format!("{namespaces} namespaces are declared; the most is {cap}")));
    }
    let mut line = 1;
    let mut rest = text;
    while let Some(open) = rest.find('<') {
        let (skipped, tag) = rest.split_at(open);
        line += newlines(skipped);
        let length = if tag.starts_with("<!--") {
            tag.find("-->").unwrap_or(tag.len())
        } else if tag.starts_with("<![CDATA[") {
            tag.find("]]>").unwrap_or(tag.len())
        } else {
            let length = tag.get(1..).and_then(|tag| tag.find('<')).map_or(tag.len(), |next| next + 1);
            let signs = tag.bytes().take(length).filter(|byte| *byte == b'=').count();
            if signs > limits::XML_ATTRIBUTES {
                let cap = limits::XML_ATTRIBUTES;
                let message = format!("an element has some {signs} attributes; the most is {cap}");
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

fn newlines(text: &str) -> u32 {
    text.bytes().fold(0, |n, byte| n + u32::from(byte == b'\n'))
}

fn check_depth(document: &Document) -> Result<(), Refusal> {
    // Document order: a parent comes before its children.
    let mut depths: HashMap<NodeId, usize> = HashMap::new();
    for node in document.descendants().filter(Node::is_element) {
        let above = node.parent_element().and_then(|parent| depths.get(&parent.id()));
        let depth = above.map_or(1, |above| above + 1);
        if depth > limits::XML_DEPTH {
            let (cap, line) = (limits::XML_DEPTH, document.text_pos_at(node.range().start).row);
            return Err(Refusal::at(line, format!("elements are nested deeper than {cap} levels")));
        }
        depths.insert(node.id(), depth);
    }
    Ok(())
}

fn syntax(error: Error) -> Refusal {
    match error {
        Error::NodesLimitReached => {
            let cap = limits::XML_NODES;
            Refusal::of_file(format!("the URDF has more than {cap} XML nodes"))
        }
        Error::DtdDetected => {
            Refusal::of_file("the URDF has a document type declaration (DTD); simd reads none".to_owned())
        }
        Error::NoRootNode => Refusal::of_file("this is not a URDF: it has no root element".to_owned()),
        error => {
            let position = error.pos();
            let text = error.to_string();
            let what = text.strip_suffix(&format!(" at {position}")).unwrap_or(&text);
            let what: String = what.chars().take(200).collect();
            Refusal::at(position.row, format!("the XML is broken at column {}: {what}", position.col))
        }
    }
}

/// The root, if the document is a URDF.
pub(super) fn robot_element<'a, 'i>(
    document: &'a Document<'i>,
    findings: &Findings,
) -> Result<Node<'a, 'i>, Refusal> {
    let root = document.root_element();
    if !is(root, "robot") {
        let tag = quoted(root.tag_name().name()).replace('"', "");
        let message = format!("this is not a URDF: the root element is <{tag}>");
        return Err(Refusal::at(findings.line(root), message));
    }
    let xacro = |node: &Node| node.tag_name().namespace().is_some_and(|uri| uri.contains("xacro"));
    if let Some(node) = document.descendants().find(xacro) {
        let message = "this is a xacro file; run xacro on it and send what that prints";
        return Err(Refusal::at(findings.line(node), message.to_owned()));
    }
    if !root.children().any(|node| is(node, "link")) {
        return Err(findings.refuse(root, "the robot has no links"));
    }
    Ok(root)
}

/// Whether a node is an element of URDF with this name.
pub(super) fn is(node: Node, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name && node.tag_name().namespace() == node_default(node)
}

/// An `xmlns` on the root makes all elements its own; they are URDF all the same.
fn node_default<'a>(node: Node<'a, '_>) -> Option<&'a str> {
    node.document().root_element().default_namespace()
}

/// The name and the mesh URIs.
pub(super) fn description(text: &str, findings: &mut Findings) -> Result<Description, Refusal> {
    let text = bind_prefixes(text, findings)?;
    let document = parse(&text)?;
    findings.set_text(&text);
    let root = robot_element(&document, findings)?;
    let mut seen = HashSet::new();
    let asset_uris = root
        .children()
        .filter(|node| is(*node, "link"))
        .flat_map(|link| link.children().filter(|node| is(*node, "visual") || is(*node, "collision")))
        .flat_map(|shape| shape.children().filter(|node| is(*node, "geometry")))
        .flat_map(|geometry| geometry.children().filter(|node| is(*node, "mesh")))
        .filter_map(|mesh| mesh.attribute("filename"))
        .filter(|uri| !uri.trim().is_empty() && seen.insert(*uri))
        .map(str::to_owned)
        .collect();
    let name = root.attribute("name").filter(|name| !name.trim().is_empty()).unwrap_or(NAMELESS);
    Ok(Description { name: name.to_owned(), asset_uris })
}

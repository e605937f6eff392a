//! A xacro file as a tree of elements that know their file and line.

use std::rc::Rc;

use roxmltree::{Document, Error as XmlError, Node, ParsingOptions};

use crate::error::Fault;
use crate::limits;

/// Prefix of xacro's attributes.
pub(crate) const XACRO: &str = "xacro:";

/// An element.
#[derive(Debug)]
pub(crate) struct Element {
    /// Name with its prefix, except for elements of xacro.
    pub(crate) name: String,
    pub(crate) is_xacro: bool,
    pub(crate) attributes: Vec<(String, String)>,
    pub(crate) children: Vec<Item>,
    /// Index of its file.
    pub(crate) file: usize,
    pub(crate) line: u32,
}

/// A child of an element. Comments are left out.
#[derive(Debug)]
pub(crate) enum Item {
    Element(Rc<Element>),
    Text(String),
}

impl Element {
    /// Returns an attribute's text, as written.
    pub(crate) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }
}

/// Prefixes with their namespaces.
pub(crate) type Namespaces = Vec<(String, String)>;

/// Parses a file's text: its root and the namespaces that it declares.
pub(crate) fn parse(text: &str, file: usize) -> Result<(Rc<Element>, Namespaces), (Fault, u32)> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    check_counts(text).map_err(|fault| (fault, 0))?;
    let options = ParsingOptions { allow_dtd: false, nodes_limit: limits::XML_NODES, ..Default::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        let line = error.pos().row;
        let fault = match error {
            XmlError::NodesLimitReached => format!("the file has more than {} XML nodes", limits::XML_NODES),
            XmlError::DtdDetected => {
                "the file has a document type declaration (DTD); none is read".to_owned()
            }
            error => format!("the XML is not valid: {error}"),
        };
        (fault, line)
    })?;
    let mut namespaces = Namespaces::new();
    let root = element(&document, document.root_element(), file, 1, &mut namespaces)?;
    Ok((Rc::new(root), namespaces))
}

fn check_counts(text: &str) -> Result<(), Fault> {
    if text.matches("xmlns").count() > limits::XML_NAMESPACES {
        return Err(format!("the file declares more than {} namespaces", limits::XML_NAMESPACES));
    }
    let signs = |tag: &str| tag.bytes().filter(|byte| *byte == b'=').count();
    if text.split('<').any(|tag| !tag.starts_with("!--") && signs(tag) > limits::XML_ATTRIBUTES) {
        return Err(format!("an element has more than {} attributes", limits::XML_ATTRIBUTES));
    }
    Ok(())
}

fn element(
    document: &Document,
    node: Node,
    file: usize,
    depth: usize,
    namespaces: &mut Namespaces,
) -> Result<Element, (Fault, u32)> {
    let line = document.text_pos_at(node.range().start).row;
    if depth > limits::XML_DEPTH {
        return Err((format!("elements are nested deeper than {} levels", limits::XML_DEPTH), line));
    }
    let mut is_xacro = false;
    let mut qualified = |namespace: Option<&str>, name: &str| {
        // The address varies between files: wiki.ros.org, www.ros.org, ros.org/wiki.
        if namespace.is_some_and(|address| address.trim_end_matches('/').ends_with("xacro")) {
            return (name.to_owned(), true);
        }
        let prefix = namespace.and_then(|address| node.lookup_prefix(address));
        match (namespace, prefix) {
            (Some(address), Some(prefix)) if !prefix.is_empty() && prefix != "xml" => {
                if !namespaces.iter().any(|(known, _)| known == prefix) {
                    namespaces.push((prefix.to_owned(), address.to_owned()));
                }
                (format!("{prefix}:{name}"), false)
            }
            (_, Some("xml")) => (format!("xml:{name}"), false),
            _ => (name.to_owned(), false),
        }
    };
    let (name, of_xacro) = qualified(node.tag_name().namespace(), node.tag_name().name());
    is_xacro |= of_xacro;
    let attributes = node
        .attributes()
        .map(|attribute| {
            let (name, is_xacro) = qualified(attribute.namespace(), attribute.name());
            (if is_xacro { format!("{XACRO}{name}") } else { name }, attribute.value().to_owned())
        })
        .collect();
    let mut children = Vec::new();
    for child in node.children() {
        if child.is_element() {
            children.push(Item::Element(Rc::new(element(document, child, file, depth + 1, namespaces)?)));
        } else if let Some(text) = child.text().filter(|text| child.is_text() && !text.trim().is_empty()) {
            children.push(Item::Text(text.to_owned()));
        }
    }
    Ok(Element { name, is_xacro, attributes, children, file, line })
}

//! XML of a COLLADA file: checked for input that slows the parser, then searched by name and id.

use std::borrow::Cow;
use std::cell::Cell;
use std::collections::HashMap;

use roxmltree::{Document, Error, Node, NodeId, ParsingOptions};

use crate::limits;
use crate::mesh::shown;

/// Decodes the text. Only names can contain non-ASCII characters, and they are only compared: so bytes that
/// are not UTF-8 do no harm.
pub(super) fn decode(bytes: &[u8]) -> Result<Cow<'_, str>, String> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
        return Err("it is UTF-16; save it as UTF-8".to_owned());
    }
    let text = String::from_utf8_lossy(bytes);
    // Each invalid byte becomes three.
    if text.len() > limits::COLLADA_BYTES {
        return Err("it is not UTF-8; save it as UTF-8".to_owned());
    }
    Ok(text)
}

/// Parses the document: no DTD, and limits on depth and width.
pub(super) fn parse(text: &str) -> Result<Document<'_>, String> {
    check_counts(text)?;
    let nodes_limit = limits::COLLADA_NODES;
    let options = ParsingOptions { allow_dtd: false, nodes_limit, ..Default::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| match error {
        Error::NodesLimitReached => format!("it has more than {nodes_limit} XML nodes"),
        Error::DtdDetected => "it has a document type declaration (DTD); simd reads none".to_owned(),
        Error::NoRootNode => "it is not COLLADA: it has no root element".to_owned(),
        error => format!("its XML is not valid: {error}"),
    })?;
    check_depth(&document)?;
    Ok(document)
}

/// Limits attributes and namespaces: roxmltree compares each attribute of an element with each other one, and
/// copies namespaces from element to element.
fn check_counts(text: &str) -> Result<(), String> {
    let namespaces = text.matches("xmlns").count();
    if namespaces > limits::XML_NAMESPACES {
        return Err(format!("{namespaces} namespaces are declared; the limit is {}", limits::XML_NAMESPACES));
    }
    let mut all = 0;
    // The text between two `<` has at least the attributes of one element.
    for tag in text.split('<') {
        let here = tag.bytes().filter(|byte| *byte == b'=').count();
        all += here;
        if here > limits::XML_ATTRIBUTES {
            return Err(format!(
                "an element has some {here} attributes; the limit is {}",
                limits::XML_ATTRIBUTES
            ));
        }
    }
    if all > limits::COLLADA_ATTRIBUTES {
        return Err(format!("it has some {all} attributes; the limit is {}", limits::COLLADA_ATTRIBUTES));
    }
    Ok(())
}

fn check_depth(document: &Document) -> Result<(), String> {
    // In document order, a parent comes before its children.
    let mut depths: HashMap<NodeId, usize> = HashMap::new();
    for node in document.descendants().filter(Node::is_element) {
        let above = node.parent_element().and_then(|parent| depths.get(&parent.id()));
        let depth = above.map_or(1, |above| above + 1);
        if depth > limits::XML_DEPTH {
            return Err(at(node, &format!("elements are nested deeper than {} levels", limits::XML_DEPTH)));
        }
        depths.insert(node.id(), depth);
    }
    Ok(())
}

/// A document, with its elements by id.
pub(super) struct File<'a> {
    pub(super) root: Node<'a, 'a>,
    by_id: HashMap<&'a str, Node<'a, 'a>>,
    walked: Cell<usize>,
}

impl<'a> File<'a> {
    /// Makes it from a document whose root is `<COLLADA>`.
    pub(super) fn new(document: &'a Document<'a>) -> Result<Self, String> {
        let root = document.root_element();
        if !is(root, "COLLADA") {
            return Err(at(
                root,
                &format!("it is not COLLADA: its root is {}", shown(root.tag_name().name())),
            ));
        }
        let mut by_id = HashMap::new();
        for node in document.descendants().filter(Node::is_element) {
            if let Some(id) = node.attribute("id") {
                by_id.entry(id).or_insert(node);
            }
        }
        Ok(Self { root, by_id, walked: Cell::new(0) })
    }

    /// Counts visited bytes: a short file can refer to its longest part a million times.
    pub(super) fn walk(&self, bytes: usize) -> Result<(), String> {
        let walked = self.walked.get().saturating_add(bytes);
        self.walked.set(walked);
        if walked <= limits::COLLADA_WALK {
            return Ok(());
        }
        Err(format!(
            "its parts refer to one another so often that reading it walks over more than {} bytes",
            limits::COLLADA_WALK
        ))
    }

    /// Returns the element of an id.
    pub(super) fn by_id(&self, id: &str) -> Option<Node<'a, 'a>> {
        self.by_id.get(id).copied()
    }

    /// Returns the element of a given name that an attribute of `node` refers to, within this file.
    pub(super) fn follow(
        &self,
        node: Node<'a, 'a>,
        attribute: &str,
        name: &str,
    ) -> Result<Node<'a, 'a>, String> {
        let Some(url) = node.attribute(attribute) else {
            return Err(at(node, &format!("<{}> has no {attribute}", node.tag_name().name())));
        };
        let Some(id) = url.strip_prefix('#') else {
            let message = format!("{} refers to another file, which simd does not open", shown(url));
            return Err(at(node, &message));
        };
        let found = self.by_id.get(id).copied().filter(|found| is(*found, name));
        found.ok_or_else(|| at(node, &format!("{} refers to no <{name}>", shown(url))))
    }
}

/// Returns whether a node is an element of this name, in any namespace.
pub(super) fn is(node: Node, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name
}

/// Returns the first child with a name.
pub(super) fn child<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    node.children().find(|child| is(*child, name))
}

/// Returns the children with a name.
pub(super) fn children<'a>(node: Node<'a, 'a>, name: &'static str) -> impl Iterator<Item = Node<'a, 'a>> {
    node.children().filter(move |child| is(*child, name))
}

/// Returns the words in an element, without comments.
pub(super) fn words<'a>(node: Node<'a, 'a>) -> impl Iterator<Item = &'a str> {
    let texts = node.children().filter(Node::is_text).filter_map(|text| text.text());
    texts.flat_map(str::split_ascii_whitespace)
}

/// Reads exactly `N` numbers.
pub(super) fn numbers<const N: usize>(node: Node) -> Result<[f64; N], String> {
    let mut found = [0.0; N];
    let mut count = 0;
    for word in words(node) {
        if let Some(slot) = found.get_mut(count) {
            *slot = number(node, word)?;
        }
        count += 1;
    }
    if count == N {
        return Ok(found);
    }
    Err(at(node, &format!("<{}> has {count} numbers instead of {N}", node.tag_name().name())))
}

/// Parses a finite number.
pub(super) fn number(node: Node, word: &str) -> Result<f64, String> {
    let number = word.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| at(node, &format!("{} is not a finite number", shown(word))))
}

/// Parses an integer that is not negative.
pub(super) fn whole(node: Node, word: &str) -> Result<usize, String> {
    word.parse().map_err(|_| at(node, &format!("{} is not a whole number that fits", shown(word))))
}

/// Parses an attribute like [`whole`], with a default.
pub(super) fn attribute(node: Node, name: &str, default: usize) -> Result<usize, String> {
    node.attribute(name).map_or(Ok(default), |word| whole(node, word.trim()))
}

/// Returns a sentence with the line of a node.
pub(super) fn at(node: Node, message: &str) -> String {
    let line = node.document().text_pos_at(node.range().start).row;
    format!("line {line}: {message}")
}

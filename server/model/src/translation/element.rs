//! An element of a description's file, which knows its line.

use roxmltree::Node;

use super::notes::{Notes, Stop};
use super::sources::Source;
use super::unread::What;
use crate::report::Disposition::{Ignored, Repaired};
use crate::urdf::findings::quoted;
use crate::urdf::numbers::{self, Shape};

/// An element. Cheap to copy.
#[derive(Clone, Copy)]
pub(crate) struct Element<'a> {
    pub(crate) node: Node<'a, 'a>,
    source: &'a Source<'a>,
    /// Index of its file in the description.
    pub(crate) file: usize,
}

impl<'a> Element<'a> {
    /// Returns the root of a file.
    pub(crate) fn root(sources: &'a [Source<'a>], file: usize) -> Option<Self> {
        let source = sources.get(file)?;
        Some(Self { node: source.document.root_element(), source, file })
    }

    fn with(self, node: Node<'a, 'a>) -> Self {
        Self { node, ..self }
    }

    pub(crate) fn tag(self) -> &'a str {
        self.node.tag_name().name()
    }

    pub(crate) fn line(self) -> u32 {
        self.source.line(self.node.range().start)
    }

    /// Returns the name of its file; `None` for the file that was sent.
    pub(crate) fn file_name(self) -> Option<&'a str> {
        Some(self.source.uri.as_str()).filter(|uri| !uri.is_empty())
    }

    /// Returns the folder of URIs in its file: `model://arm/` for `model://arm/model.sdf`.
    pub(crate) fn folder(self) -> &'a str {
        let uri = self.source.uri.as_str();
        uri.rfind('/').and_then(|end| uri.get(..=end)).unwrap_or_default()
    }

    /// Returns its label in a report: `joint "elbow" axis`.
    pub(crate) fn label(self) -> String {
        let mut words: Vec<String> = self
            .node
            .ancestors()
            .filter(|node| node.is_element() && node.parent_element().is_some())
            .take(4)
            .map(|node| match node.attribute("name") {
                Some(name) => format!("{} {}", node.tag_name().name(), quoted(name)),
                None => node.tag_name().name().to_owned(),
            })
            .collect();
        if words.is_empty() {
            return "file".to_owned();
        }
        words.reverse();
        words.join(" ")
    }

    /// Returns the elements in it.
    pub(crate) fn elements(self) -> impl Iterator<Item = Self> {
        self.source.asked.note(self.tag(), What::Anything);
        self.node.children().filter(Node::is_element).map(move |node| self.with(node))
    }

    /// The element and all elements within it, which are not noted as read.
    pub(crate) fn descendants(self) -> impl Iterator<Item = Self> {
        self.node.descendants().filter(Node::is_element).map(move |node| self.with(node))
    }

    /// Elements of a name in it.
    pub(crate) fn children(self, tag: &'static str) -> impl Iterator<Item = Self> {
        self.source.asked.note(self.tag(), What::Child(tag));
        self.elements().filter(move |element| element.tag() == tag)
    }

    /// Returns the first element in it with a tag.
    pub(crate) fn child(self, tag: &'static str) -> Option<Self> {
        self.children(tag).next()
    }

    /// Returns the element at the end of a path.
    pub(crate) fn at(self, path: &[&'static str]) -> Option<Self> {
        path.iter().try_fold(self, |element, tag| element.child(tag))
    }

    pub(crate) fn attribute(self, name: &str) -> Option<&'a str> {
        self.source.asked.note(self.tag(), What::Attribute(name));
        self.node.attribute(name)
    }

    /// Notes that the element is read with all of its attributes.
    pub(crate) fn is_read(self) {
        self.source.asked.note(self.tag(), What::Anything);
        for attribute in self.node.attributes() {
            self.source.asked.note(self.tag(), What::Attribute(attribute.name()));
        }
    }

    /// Returns an attribute without surrounding blanks, unless it is empty.
    pub(crate) fn word(self, name: &str) -> Option<&'a str> {
        self.attribute(name).map(str::trim).filter(|word| !word.is_empty())
    }

    /// Returns its text without surrounding blanks.
    pub(crate) fn text(self) -> &'a str {
        self.source.asked.note(self.tag(), What::Anything);
        self.node.text().unwrap_or_default().trim()
    }

    /// Returns the text of a child.
    pub(crate) fn text_of(self, tag: &'static str) -> Option<&'a str> {
        self.child(tag).map(Self::text).filter(|text| !text.is_empty())
    }

    /// Returns whether the text of a child is true.
    pub(crate) fn says(self, tag: &'static str) -> Option<bool> {
        let text = self.text_of(tag)?;
        Some(text == "1" || text.eq_ignore_ascii_case("true"))
    }

    /// Returns the numbers of its text.
    pub(crate) fn numbers<const N: usize>(self, notes: &mut Notes) -> Result<Option<[f64; N]>, Stop> {
        if self.text().is_empty() {
            return Ok(None);
        }
        parse(self, "", self.text(), notes).map(Some)
    }

    /// Returns the number of a child; it may be infinite.
    pub(crate) fn number_of(self, tag: &'static str, notes: &mut Notes) -> Result<Option<f64>, Stop> {
        let Some(child) = self.child(tag).filter(|child| !child.text().is_empty()) else { return Ok(None) };
        let read = numbers::read(child.text(), Shape::Bound);
        let read = read.map_err(|why| Stop::at(child, format!("{} {why}", quoted(child.text()))))?;
        if let Some(repair) = read.repair {
            notes.warn(child, Repaired, format!("{} {repair}", quoted(child.text())));
        }
        Ok(read.values.first().copied())
    }
}

/// Parses the numbers of a text in an element, from an attribute of this name, or from its text if the name
/// is empty.
pub(crate) fn parse<const N: usize>(
    at: Element,
    name: &str,
    text: &str,
    notes: &mut Notes,
) -> Result<[f64; N], Stop> {
    let of = |what: &str| match name {
        "" => format!("{} {what}", quoted(text)),
        name => format!("{name}={} {what}", quoted(text)),
    };
    let read = numbers::read(text, Shape::Exactly(N)).map_err(|why| Stop::at(at, of(&why)))?;
    if let Some(repair) = read.repair {
        notes.warn(at, Repaired, of(&repair));
    }
    read.values.try_into().map_err(|_count| Stop::at(at, of("has a wrong number of values")))
}

/// Reports the children of an element that are not in `known`, each tag once.
pub(crate) fn report_unknown(at: Element, known: &[&str], why: &str, notes: &mut Notes) {
    let mut named: Vec<&str> = Vec::new();
    for child in at.elements() {
        let tag = child.tag();
        if !known.contains(&tag) && !named.contains(&tag) && named.len() < 12 {
            named.push(tag);
            notes.info(child, Ignored, format!("not read by simd{why}"));
        }
    }
}

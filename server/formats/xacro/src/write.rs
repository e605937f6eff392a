//! Writes the expanded tree as text, with the origin of each line.

use std::rc::Rc;

use crate::error::Fault;
use crate::limits;
use crate::source::Namespaces;

/// A part of the expanded tree.
#[derive(Clone, Debug)]
pub(crate) enum Made {
    Element(Rc<MadeElement>),
    Text(String),
}

/// An element of the URDF.
#[derive(Debug)]
pub(crate) struct MadeElement {
    pub(crate) name: String,
    pub(crate) attributes: Vec<(String, String)>,
    pub(crate) children: Vec<Made>,
    /// Nesting depth of its elements, including itself.
    pub(crate) depth: usize,
    pub(crate) file: usize,
    pub(crate) line: u32,
}

impl MadeElement {
    /// Returns the nesting depth of children.
    pub(crate) fn depth_of(children: &[Made]) -> usize {
        let depth = |made: &Made| match made {
            Made::Element(element) => element.depth,
            Made::Text(_) => 0,
        };
        children.iter().map(depth).max().unwrap_or(0)
    }
}

/// The text, and the origin of each line.
pub(crate) struct Written {
    pub(crate) text: String,
    pub(crate) lines: Vec<(usize, u32)>,
}

/// Writes a document.
pub(crate) fn write(root: &MadeElement, namespaces: &Namespaces) -> Result<Written, Fault> {
    let mut writer = Written { text: String::new(), lines: Vec::new() };
    writer.line("<?xml version=\"1.0\"?>", (root.file, root.line));
    writer.element(root, namespaces)?;
    Ok(writer)
}

impl Written {
    fn line(&mut self, text: &str, origin: (usize, u32)) {
        self.text.push_str(text);
        self.text.push('\n');
        self.lines.push(origin);
    }

    fn element(&mut self, element: &MadeElement, namespaces: &Namespaces) -> Result<(), Fault> {
        if self.text.len() > limits::OUTPUT_BYTES {
            return Err(format!("the result is longer than {} bytes", limits::OUTPUT_BYTES));
        }
        let origin = (element.file, element.line);
        let mut tag = format!("<{}", element.name);
        for (prefix, address) in namespaces {
            tag += &format!(" xmlns:{prefix}=\"{}\"", escaped(address));
        }
        for (name, value) in &element.attributes {
            tag += &format!(" {name}=\"{}\"", escaped(value));
        }
        if element.children.is_empty() {
            self.line(&(tag + "/>"), origin);
            return Ok(());
        }
        self.line(&(tag + ">"), origin);
        for child in &element.children {
            match child {
                Made::Element(element) => self.element(element, &Namespaces::new())?,
                Made::Text(text) => {
                    for line in text.trim().lines() {
                        self.line(&escaped(line), origin);
                    }
                }
            }
        }
        self.line(&format!("</{}>", element.name), origin);
        Ok(())
    }
}

fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' => out.push_str("&#10;"),
            c if c.is_control() && c != '\t' => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

//! Reports each kind of element and attribute of a description that no reader requested.
//!
//! Elements record requests by their tags and the names of attributes, so that no list of words can become
//! stale.

use std::cell::RefCell;
use std::collections::HashSet;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash as _, Hasher as _};

use super::element::Element;
use super::notes::Notes;
use super::sources::Source;
use crate::report::Disposition::Ignored;
use crate::urdf::findings::quoted;

/// Maximum number of reported kinds; further ones are only counted.
const MAX_KINDS: usize = 100;

/// Requests in one file.
#[derive(Default)]
pub(crate) struct Asked(RefCell<HashSet<u64>>);

/// A request to an element.
#[derive(Clone, Copy, Hash)]
pub(super) enum What<'w> {
    /// All of its contents.
    Anything,
    Attribute(&'w str),
    Child(&'w str),
}

impl Asked {
    /// Records a request to elements of a tag.
    pub(super) fn note(&self, tag: &str, what: What) {
        let mut asked = self.0.borrow_mut();
        asked.insert(key(tag, what));
        asked.insert(key(tag, What::Anything));
    }

    fn keys(&self) -> Vec<u64> {
        self.0.borrow().iter().copied().collect()
    }
}

fn key(tag: &str, what: What) -> u64 {
    let mut hasher = DefaultHasher::new();
    (tag, what).hash(&mut hasher);
    hasher.finish()
}

/// Reports what was not requested in any file, each kind once.
pub(crate) fn report<'a>(sources: &'a [Source<'a>], notes: &mut Notes) {
    let all: HashSet<u64> = sources.iter().flat_map(|source| source.asked.keys()).collect();
    let asked = |tag: &str, what: What| all.contains(&key(tag, what));
    let mut named: HashSet<u64> = HashSet::new();
    let mut left_out = 0_usize;
    for (file, source) in sources.iter().enumerate() {
        // The reader of URDF reports on an included one.
        let Some(root) = Element::root(sources, file).filter(|root| root.tag() != "robot") else { continue };
        let mut open = vec![root];
        while let Some(element) = open.pop() {
            let tag = element.tag();
            for attribute in element.node.attributes() {
                let name = attribute.name();
                // Attributes of the root describe the format, and are not part of a robot.
                let is_root = element.node == source.document.root_element();
                let is_known = is_root || name == "name" || asked(tag, What::Attribute(name));
                if is_known || !named.insert(key(tag, What::Attribute(name))) {
                    continue;
                }
                if named.len() > MAX_KINDS {
                    left_out += 1;
                    continue;
                }
                notes.info(element, Ignored, format!("attribute {} is not read by simd", quoted(name)));
            }
            let first = open.len();
            for child in element.elements() {
                let inner = child.tag();
                if asked(inner, What::Anything) || asked(tag, What::Child(inner)) {
                    open.push(child);
                } else if !notes.has_ignored(child) && named.insert(key(tag, What::Child(inner))) {
                    if named.len() > MAX_KINDS {
                        left_out += 1;
                    } else {
                        notes.info(child, Ignored, "not read by simd");
                    }
                }
            }
            // In the order of the file.
            if let Some(children) = open.get_mut(first..) {
                children.reverse();
            }
        }
    }
    if let Some(root) = Element::root(sources, 0).filter(|_| left_out > 0) {
        notes.info(
            root,
            Ignored,
            format!("{left_out} more kinds of elements and attributes are not read by simd"),
        );
    }
}

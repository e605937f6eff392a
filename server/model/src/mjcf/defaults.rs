//! `<default>`: default attributes of elements, by class.

use std::collections::{BTreeMap, BTreeSet};

use crate::report::Disposition::Ignored;
use crate::translation::element::Element;
use crate::translation::notes::{Notes, Stop};
use crate::urdf::findings::quoted;

/// Maximum number of classes in a file.
const MAX_CLASSES: usize = 10_000;
/// Nesting depth of classes.
const MAX_DEPTH: usize = 100;

/// All classes. The first is the main one, from which all others inherit.
#[derive(Default)]
pub(super) struct Classes<'a> {
    list: Vec<Class<'a>>,
    by_name: BTreeMap<&'a str, usize>,
}

#[derive(Default)]
struct Class<'a> {
    parent: Option<usize>,
    /// By tag.
    elements: BTreeMap<&'a str, Element<'a>>,
}

/// An element with the defaults of its class.
#[derive(Clone, Copy)]
pub(super) struct Classed<'c, 'a> {
    pub(super) element: Element<'a>,
    classes: &'c Classes<'a>,
    class: Option<usize>,
    /// Tags of its defaults in classes.
    tags: [&'static str; 2],
}

impl<'a> Classes<'a> {
    /// Reads a top-level `<default>`.
    pub(super) fn read(&mut self, element: Element<'a>, notes: &mut Notes) -> Result<(), Stop> {
        if self.list.is_empty() {
            self.list.push(Class::default());
        }
        if let Some(name) = element.word("class") {
            self.by_name.insert(name, 0);
        }
        let mut open = vec![(element, 0, 0)];
        while let Some((element, class, depth)) = open.pop() {
            for child in element.elements() {
                if child.tag() != "default" {
                    if let Some(class) = self.list.get_mut(class) {
                        class.elements.insert(child.tag(), child);
                    }
                    continue;
                }
                let Some(name) = child.word("class") else {
                    notes.warn(child, Ignored, "it has no class; left out");
                    continue;
                };
                if self.list.len() >= MAX_CLASSES || depth >= MAX_DEPTH {
                    let message =
                        format!("there are more than {MAX_CLASSES} classes, or deeper ones than {MAX_DEPTH}");
                    return Err(Stop::at(child, message));
                }
                let index = self.list.len();
                self.list.push(Class { parent: Some(class), elements: BTreeMap::new() });
                self.by_name.insert(name, index);
                open.push((child, index, depth + 1));
            }
        }
        Ok(())
    }

    /// Warns of classes that no `<default>` has, each name once. Their elements take the class around them.
    pub(super) fn warn_of_unknown(&self, sections: &[Element<'a>], notes: &mut Notes) {
        let sections = sections.iter().filter(|section| section.tag() != "default");
        let mut named: BTreeSet<&str> = BTreeSet::new();
        for element in sections.flat_map(|section| section.descendants()) {
            for attribute in ["class", "childclass"] {
                let Some(name) = element.node.attribute(attribute) else { continue };
                if self.find(name).is_none() && named.len() < MAX_CLASSES && named.insert(name) {
                    let message = format!("{attribute} {} is not defined; it is left out", quoted(name));
                    notes.warn(element, Ignored, message);
                }
            }
        }
    }

    /// The class of a name. `None` where there is none of it.
    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// Returns an element with its own class, the class of the surrounding bodies, or the main one.
    pub(super) fn of<'c>(
        &'c self,
        element: Element<'a>,
        child_class: Option<usize>,
        tags: [&'static str; 2],
    ) -> Classed<'c, 'a> {
        let own = element.word("class").and_then(|name| self.find(name));
        let main = (!self.list.is_empty()).then_some(0);
        Classed { element, classes: self, class: own.or(child_class).or(main), tags }
    }
}

impl<'a> Classed<'_, 'a> {
    /// Returns a value, and the element that has it.
    pub(super) fn get(&self, name: &str) -> Option<(Element<'a>, &'a str)> {
        let given = |element: Element<'a>| Some((element, element.word(name)?));
        given(self.element).or_else(|| {
            let mut at = self.class;
            // A class inherits from an earlier one.
            while let Some(class) = at.and_then(|class| self.classes.list.get(class)) {
                let found = self.tags.iter().find_map(|tag| given(*class.elements.get(tag)?));
                if found.is_some() {
                    return found;
                }
                at = class.parent;
            }
            None
        })
    }

    /// Returns a word.
    pub(super) fn word(&self, name: &str) -> Option<&'a str> {
        self.get(name).map(|(_, word)| word)
    }
}

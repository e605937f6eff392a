//! `<attach>`: a body, a frame or the whole world of another file, or of the same one, with a prefix before
//! all names.
//!
//! The settings, classes and assets of its file apply to the attached part. The rest of that file (actuators,
//! equalities, sensors and so on) is not read, and a note says so.

use std::collections::BTreeMap;
use std::rc::Rc;

use super::body::Inside;
use super::{Reader, Scope, files};
use crate::report::Disposition::Ignored;
use crate::translation::element::Element;
use crate::translation::notes::Stop;

/// Sections of an attached file that are not read.
const LEFT_OUT: [&str; 7] = ["actuator", "equality", "contact", "sensor", "keyframe", "tendon", "deformable"];
/// Nesting depth of bodies and frames in the search.
const MAX_DEPTH: usize = 100;

/// Files that may be attached, and their contents.
#[derive(Default)]
pub(super) struct Attachable<'a> {
    /// Scopes that were read so far, by the index of the file.
    scopes: BTreeMap<usize, Scope<'a>>,
    /// By the index of the file. Each is searched once, however many of its parts are attached.
    worlds: BTreeMap<usize, Rc<World<'a>>>,
}

/// The parts of a file that may be attached.
#[derive(Default)]
struct World<'a> {
    sections: Vec<Element<'a>>,
    /// Bodies and frames by tag and name, the first of each.
    named: BTreeMap<(&'a str, &'a str), Element<'a>>,
}

impl<'a> Reader<'a> {
    pub(super) fn attach(
        &mut self,
        element: Element<'a>,
        body: usize,
        inside: Inside<'_>,
    ) -> Result<(), Stop> {
        self.count_element(element)?;
        let file_index = match element.word("model") {
            Some(model) => self.file_of_model(element, model)?,
            None => element.file,
        };
        let prefix = format!("{}{}", inside.prefix, element.word("prefix").unwrap_or_default());
        let inner = Inside { class: None, prefix: &prefix, depth: inside.depth + 1, ..inside };
        let own = match element.word("model") {
            Some(_) => {
                let scope = match self.attachable.scopes.remove(&file_index) {
                    Some(scope) => scope,
                    None => self.read_scope(file_index)?,
                };
                Some(std::mem::replace(&mut self.scope, scope))
            }
            None => None,
        };
        let read = self.attach_of(element, file_index, body, inner);
        if let Some(own) = own {
            let scope = std::mem::replace(&mut self.scope, own);
            self.attachable.scopes.insert(file_index, scope);
        }
        read
    }

    fn attach_of(
        &mut self,
        element: Element<'a>,
        file_index: usize,
        body: usize,
        inside: Inside<'_>,
    ) -> Result<(), Stop> {
        let world = self.world(file_index)?;
        let named = ["body", "frame"].into_iter().find_map(|tag| Some((tag, element.word(tag)?)));
        let Some((tag, name)) = named else {
            if element.word("model").is_none() {
                return Err(Stop::at(element, "it names no model, no body and no frame"));
            }
            for section in &world.sections {
                self.count_element(*section)?;
                self.content(*section, body, inside)?;
            }
            return Ok(());
        };
        let found = world.named.get(&(tag, name)).copied();
        let Some(found) = found else {
            return Err(Stop::at(element, format!("there is no {tag} {name:?} to attach")));
        };
        self.one(found, body, inside)
    }

    /// Returns the index of the file of a model in the assets.
    fn file_of_model(&self, at: Element<'a>, model: &str) -> Result<usize, Stop> {
        let file_index = self.scope.models.get(model).copied();
        file_index.ok_or_else(|| Stop::at(at, format!("there is no model {model:?} among the assets")))
    }

    /// Reads settings, classes and assets of a file.
    pub(super) fn read_scope(&mut self, file_index: usize) -> Result<Scope<'a>, Stop> {
        let mut scope = Scope::default();
        let Some(root) = Element::root(self.sources, file_index) else { return Ok(scope) };
        let sections = files::expanded(root, self.sources, self.file_indices)?;
        let of = |tag: &'static str| sections.iter().copied().filter(move |section| section.tag() == tag);
        for section in of("compiler") {
            scope.compiler.read(section, &mut self.notes)?;
        }
        let folder = root.folder();
        scope.compiler.folder = folder.to_owned();
        for section in of("default") {
            scope.classes.read(section, &mut self.notes)?;
        }
        scope.classes.warn_of_unknown(&sections, &mut self.notes);
        for section in of("asset") {
            let elements = files::expanded(section, self.sources, self.file_indices)?;
            let Scope { library, compiler, classes, .. } = &mut scope;
            library.read(&elements, self.assets, compiler, classes, &mut self.made, &mut self.notes)?;
            for element in elements.iter().filter(|element| element.tag() == "model") {
                let Some(file) = element.word("file") else { continue };
                let file_index = self.file_indices.models.get(file).copied();
                let file_index = file_index
                    .ok_or_else(|| Stop::at(*element, format!("the file {file:?} is not found")))?;
                let own = || Element::root(self.sources, file_index)?.word("model");
                if let Some(name) = element.word("name").or_else(own) {
                    scope.models.insert(name, file_index);
                }
            }
        }
        // The first file is read completely.
        if file_index > 0 {
            for section in sections.iter().filter(|section| LEFT_OUT.contains(&section.tag())) {
                if section.elements().next().is_some() {
                    let message = "not read by simd in an attached file: left out";
                    self.notes.warn(*section, Ignored, message);
                }
            }
        }
        Ok(scope)
    }

    fn world(&mut self, file_index: usize) -> Result<Rc<World<'a>>, Stop> {
        if let Some(world) = self.attachable.worlds.get(&file_index) {
            return Ok(Rc::clone(world));
        }
        let mut world = World::default();
        if let Some(root) = Element::root(self.sources, file_index) {
            world.sections = files::expanded(root, self.sources, self.file_indices)?;
            world.sections.retain(|section| section.tag() == "worldbody");
        }
        let mut open: Vec<(Element<'a>, usize)> =
            world.sections.iter().map(|section| (*section, 0)).collect();
        open.reverse();
        while let Some((section, depth)) = open.pop() {
            if let Some(name) = section.word("name") {
                world.named.entry((section.tag(), name)).or_insert(section);
            }
            let inside = files::expanded(section, self.sources, self.file_indices)?;
            let inside =
                inside.into_iter().filter(|inner| matches!(inner.tag(), "body" | "frame" | "replicate"));
            let first = open.len();
            open.extend(inside.filter(|_| depth < MAX_DEPTH).map(|inner| (inner, depth + 1)));
            // The last one is read next.
            open.get_mut(first..).unwrap_or_default().reverse();
        }
        let world = Rc::new(world);
        self.attachable.worlds.insert(file_index, Rc::clone(&world));
        Ok(world)
    }
}

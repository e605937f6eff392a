//! Expands xacro's directives to elements.

mod call;
mod declare;
mod files;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use simd_assets::Locator;

use self::files::read;
use crate::error::{Error, Fault, shown};
use crate::scope::{Block, Scopes};
use crate::source::XACRO;
use crate::source::{self, Element, Item, Namespaces};
use crate::value::Value;
use crate::write::{Made, MadeElement, write};
use crate::{Expanded, limits};

/// One expansion.
pub(crate) struct Expansion<'l> {
    locator: &'l Locator,
    /// Arguments of the caller, then the files' defaults.
    pub(crate) arguments: BTreeMap<String, String>,
    /// Arguments of the caller.
    pub(crate) given: BTreeMap<String, String>,
    /// Variables of comprehensions and lambdas, the innermost last.
    pub(crate) locals: Vec<(Rc<str>, Value)>,
    /// Whether an expression of `$(eval ...)` is evaluated.
    pub(crate) in_eval: bool,
    pub(crate) scopes: Scopes,
    pub(crate) expression_depth: usize,
    files: Vec<PathBuf>,
    /// Indices of the files that are being expanded, the innermost last.
    open_files: Vec<usize>,
    namespaces: Namespaces,
    messages: Vec<String>,
    /// Index of the file that is expanded.
    file: usize,
    /// Index of the file whose include is expanded: in a macro, the file of the call.
    including: usize,
    readings: usize,
    bytes: usize,
    steps: usize,
}

/// Expanded content of an element.
#[derive(Default)]
struct Body {
    made: Vec<Made>,
    /// Attributes from `<xacro:attribute>`.
    attributes: Vec<(String, String)>,
}

impl<'l> Expansion<'l> {
    /// Begins an expansion with the caller's arguments.
    pub(crate) fn new(locator: &'l Locator, arguments: &BTreeMap<String, String>) -> Self {
        Self {
            locator,
            arguments: arguments.clone(),
            given: arguments.clone(),
            locals: Vec::new(),
            in_eval: false,
            scopes: Scopes::new(),
            expression_depth: 0,
            files: Vec::new(),
            open_files: vec![0],
            namespaces: Namespaces::new(),
            messages: Vec::new(),
            file: 0,
            including: 0,
            readings: 0,
            bytes: 0,
            steps: 0,
        }
    }

    /// Expands a file.
    pub(crate) fn run(self, path: &Path) -> Result<Expanded, Error> {
        let here = |fault| Error { message: fault, file: Some(path.to_path_buf()), line: 0 };
        let absolute = std::path::absolute(path).map_err(|error| here(error.to_string()))?;
        let text = read(&absolute, limits::FILE_BYTES).map_err(here)?;
        self.run_root(absolute, &text)
    }

    /// Expands a text.
    pub(crate) fn run_text(self, text: &str) -> Result<Expanded, Error> {
        self.run_root(PathBuf::new(), text)
    }

    fn run_root(mut self, path: PathBuf, text: &str) -> Result<Expanded, Error> {
        self.files.push(path);
        self.readings = 1;
        self.bytes = text.len();
        let root = self.parse(text, 0)?;
        // The root's attributes may use declarations of its content: `name="$(arg name)"`.
        let body = self.children(&root, 1)?;
        let attributes = self.attributes(&root)?;
        let made = self.make(&root, root.name.clone(), attributes, body.made)?;
        let written = write(&made, &self.namespaces).map_err(|fault| self.at(&root, fault))?;
        let Self { files, messages, .. } = self;
        Ok(Expanded { urdf: written.text, files, messages, lines: written.lines })
    }

    fn parse(&mut self, text: &str, file: usize) -> Result<Rc<Element>, Error> {
        let name = self.files.get(file).filter(|path| !path.as_os_str().is_empty()).cloned();
        let parsed = source::parse(text, file);
        let (root, namespaces) = parsed.map_err(|(message, line)| Error { message, file: name, line })?;
        for namespace in namespaces {
            if !self.namespaces.iter().any(|(known, _)| *known == namespace.0) {
                self.namespaces.push(namespace);
            }
        }
        Ok(root)
    }

    fn at(&self, element: &Element, message: Fault) -> Error {
        let file = self.files.get(element.file).filter(|path| !path.as_os_str().is_empty()).cloned();
        Error { message, file, line: element.line }
    }

    /// Counts steps and refuses too many.
    pub(crate) fn step(&mut self, by: usize) -> Result<(), Fault> {
        self.steps = self.steps.saturating_add(by);
        if self.steps <= limits::STEPS {
            return Ok(());
        }
        Err(format!("expanding takes more than {} steps", limits::STEPS))
    }

    /// Keeps a message of a file.
    pub(crate) fn message(&mut self, message: String) {
        if self.messages.len() < limits::MESSAGES {
            self.messages.push(message);
        }
    }

    /// Returns the folder of the file that is being expanded.
    pub(crate) fn folder(&self) -> String {
        self.folder_of(self.file)
    }

    fn folder_of(&self, file: usize) -> String {
        let folder = self.files.get(file).and_then(|path| path.parent());
        folder.map_or_else(String::new, |folder| folder.to_string_lossy().into_owned())
    }

    /// Expands the content of an element, without its attributes.
    fn children(&mut self, element: &Element, depth: usize) -> Result<Body, Error> {
        let mut body = Body::default();
        for item in &element.children {
            match item {
                Item::Element(child) => self.element(child, depth, &mut body)?,
                Item::Text(text) => {
                    let text = self.text(text, self.scopes.top()).map_err(|fault| self.at(element, fault))?;
                    body.made.extend((!text.trim().is_empty()).then_some(Made::Text(text)));
                }
            }
        }
        Ok(body)
    }

    /// Expands an element that is not xacro's.
    fn plain(&mut self, element: &Element, depth: usize) -> Result<MadeElement, Error> {
        let level = self.scopes.top();
        let mut attributes = self.attributes(element)?;
        let mut children = Vec::new();
        for item in &element.children {
            match item {
                Item::Element(child) => {
                    let mut body = Body::default();
                    self.element(child, depth + 1, &mut body)?;
                    children.append(&mut body.made);
                    merge(&mut attributes, body.attributes);
                }
                Item::Text(text) => {
                    let text = self.text(text, level).map_err(|fault| self.at(element, fault))?;
                    children.push(Made::Text(text));
                }
            }
        }
        self.make(element, element.name.clone(), attributes, children)
    }

    fn attributes(&mut self, element: &Element) -> Result<Vec<(String, String)>, Error> {
        let level = self.scopes.top();
        let mut attributes = Vec::with_capacity(element.attributes.len());
        let plain = element.attributes.iter().filter(|(name, _)| !name.starts_with(XACRO));
        for (name, text) in plain {
            let value = self.text(text, level).map_err(|fault| self.at(element, fault))?;
            attributes.push((name.clone(), path(value)));
        }
        Ok(attributes)
    }

    fn make(
        &self,
        element: &Element,
        name: String,
        attributes: Vec<(String, String)>,
        children: Vec<Made>,
    ) -> Result<MadeElement, Error> {
        let depth = MadeElement::depth_of(&children) + 1;
        if depth > limits::XML_DEPTH {
            let message = format!("the result is nested deeper than {} levels", limits::XML_DEPTH);
            return Err(self.at(element, message));
        }
        let (file, line) = (element.file, element.line);
        Ok(MadeElement { name, attributes, children, depth, file, line })
    }

    fn element(&mut self, element: &Rc<Element>, depth: usize, body: &mut Body) -> Result<(), Error> {
        self.step(1).map_err(|fault| self.at(element, fault))?;
        if depth > limits::DEPTH {
            let mut message =
                format!("elements, macros and includes are nested deeper than {}", limits::DEPTH);
            if self.open_files.iter().filter(|file| **file == self.file).count() > 1 {
                message += ": this file includes itself";
            }
            return Err(self.at(element, message));
        }
        if !element.is_xacro {
            let made = self.plain(element, depth)?;
            body.made.push(Made::Element(Rc::new(made)));
            return Ok(());
        }
        self.expression_depth = 0;
        match element.name.as_str() {
            "property" => self.property(element).map_err(|fault| self.at(element, fault)),
            "arg" => self.declare_argument(element).map_err(|fault| self.at(element, fault)),
            "macro" => self.define(element).map_err(|fault| self.at(element, fault)),
            "include" => self.include(element, depth, body),
            "if" | "unless" => {
                let is = self.condition(element).map_err(|fault| self.at(element, fault))?;
                if is == (element.name == "if") { self.content(element, depth, body) } else { Ok(()) }
            }
            "insert_block" => self.insert(element, depth, body),
            "attribute" => {
                let added = self.added_attribute(element).map_err(|fault| self.at(element, fault))?;
                merge(&mut body.attributes, vec![added]);
                Ok(())
            }
            "element" => self.named_element(element, depth, body),
            "call" => {
                let name = self.required(element, "macro").map_err(|fault| self.at(element, fault))?;
                self.call_macro(&name, element, depth, body)
            }
            name => self.call_macro(name, element, depth, body),
        }
    }

    /// Expands the content of an element in place of the element.
    fn content(&mut self, element: &Element, depth: usize, body: &mut Body) -> Result<(), Error> {
        let mut inner = self.children(element, depth + 1)?;
        body.made.append(&mut inner.made);
        merge(&mut body.attributes, inner.attributes);
        Ok(())
    }

    fn required(&mut self, element: &Element, name: &str) -> Result<String, Fault> {
        let text =
            element.attribute(name).ok_or_else(|| format!("<xacro:{}> has no {name}", element.name))?;
        self.text(text, self.scopes.top())
    }

    fn condition(&mut self, element: &Element) -> Result<bool, Fault> {
        let text =
            element.attribute("value").ok_or_else(|| format!("<xacro:{}> has no value", element.name))?;
        self.value(text, self.scopes.top())?.condition()
    }

    fn insert(&mut self, element: &Rc<Element>, depth: usize, body: &mut Body) -> Result<(), Error> {
        let name = self.required(element, "name").map_err(|fault| self.at(element, fault))?;
        match self.scopes.block(&name) {
            Some(Block::Made(made)) => body.made.extend(made.iter().cloned()),
            Some(Block::Source(source)) => self.content(&source, depth, body)?,
            None => return Err(self.at(element, format!("there is no block {}", shown(&name)))),
        }
        let inserted = body.made.len();
        self.step(inserted).map_err(|fault| self.at(element, fault))
    }

    fn added_attribute(&mut self, element: &Element) -> Result<(String, String), Fault> {
        let name = self.required(element, "name")?;
        let value = self.required(element, "value")?;
        check_name(&name)?;
        Ok((name, path(value)))
    }

    fn named_element(&mut self, element: &Rc<Element>, depth: usize, body: &mut Body) -> Result<(), Error> {
        let level = self.scopes.top();
        let mut name = String::new();
        let mut attributes = Vec::new();
        let is_prefixed = element.attribute("xacro:name").is_some();
        let own = if is_prefixed { "xacro:name" } else { "name" };
        for (key, text) in &element.attributes {
            let value = self.text(text, level).map_err(|fault| self.at(element, fault))?;
            if key == own {
                name = value;
            } else {
                attributes.push((key.clone(), path(value)));
            }
        }
        check_name(&name).map_err(|fault| self.at(element, fault))?;
        let inner = self.children(element, depth + 1)?;
        merge(&mut attributes, inner.attributes);
        let made = self.make(element, name, attributes, inner.made)?;
        body.made.push(Made::Element(Rc::new(made)));
        Ok(())
    }
}

/// Shortens `file://$(find arm)/a.stl` to `package://arm/a.stl`: no path of this disk is written.
fn path(value: String) -> String {
    match value.strip_prefix("file://").filter(|rest| rest.starts_with("package://")) {
        Some(rest) => rest.to_owned(),
        None => value,
    }
}

/// Checks that a text is a valid XML name.
fn check_name(name: &str) -> Result<(), Fault> {
    let is_first = |c: char| c.is_alphabetic() || c == '_';
    let is_part = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.');
    if name.starts_with(is_first) && name.chars().all(is_part) {
        return Ok(());
    }
    Err(format!("{} cannot be a name in XML", shown(name)))
}

fn merge(attributes: &mut Vec<(String, String)>, new: Vec<(String, String)>) {
    for (name, value) in new {
        attributes.retain(|(known, _)| *known != name);
        attributes.push((name, value));
    }
}

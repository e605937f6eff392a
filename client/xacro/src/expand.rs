//! The directives of xacro: what each element becomes.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use simd_assets::Locator;

use crate::error::{Error, Fault, not_supported, shown};
use crate::limits;
use crate::macros::{Macro, Parameter, parameters};
use crate::scope::{Block, Entry, Scopes};
use crate::source::{self, Element, Item, Namespaces};
use crate::value::Value;
use crate::write::{Made, MadeElement, write};
use crate::{Expanded, yaml};

/// One expansion.
pub(crate) struct Expansion<'l> {
    locator: &'l Locator,
    /// Of the caller, then of the files' defaults.
    pub(crate) arguments: BTreeMap<String, String>,
    pub(crate) scopes: Scopes,
    pub(crate) expression_depth: usize,
    files: Vec<PathBuf>,
    namespaces: Namespaces,
    messages: Vec<String>,
    /// The file that is being expanded.
    file: usize,
    readings: usize,
    bytes: usize,
    steps: usize,
}

/// What elements became.
#[derive(Default)]
struct Body {
    made: Vec<Made>,
    /// Of `<xacro:attribute>`.
    attributes: Vec<(String, String)>,
}

impl<'l> Expansion<'l> {
    /// With arguments as the caller gives them.
    pub(crate) fn new(locator: &'l Locator, arguments: &BTreeMap<String, String>) -> Self {
        Self {
            locator,
            arguments: arguments.clone(),
            scopes: Scopes::new(),
            expression_depth: 0,
            files: Vec::new(),
            namespaces: Namespaces::new(),
            messages: Vec::new(),
            file: 0,
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
        // The root's attributes may use what its content declares: `name="$(arg name)"`.
        let body = self.children(&root, 1)?;
        let attributes = self.attributes(&root)?;
        let made = self.make(&root, root.name.clone(), attributes, body.made)?;
        let written = write(&made, &self.namespaces).map_err(|fault| self.at(&root, fault))?;
        let Self { files, messages, .. } = self;
        Ok(Expanded { urdf: written.text, files, messages, lines: written.lines })
    }

    fn parse(&mut self, text: &str, file: usize) -> Result<Rc<Element>, Error> {
        let place = self.files.get(file).filter(|path| !path.as_os_str().is_empty()).cloned();
        let parsed = source::parse(text, file);
        let (root, namespaces) = parsed.map_err(|(message, line)| Error { message, file: place, line })?;
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

    /// Counts what is done.
    pub(crate) fn step(&mut self, by: usize) -> Result<(), Fault> {
        self.steps = self.steps.saturating_add(by);
        if self.steps <= limits::STEPS {
            return Ok(());
        }
        Err(format!("expanding takes more than {} steps", limits::STEPS))
    }

    /// Keeps what a file wants to say.
    pub(crate) fn message(&mut self, message: String) {
        if self.messages.len() < limits::MESSAGES {
            self.messages.push(message);
        }
    }

    /// The folder of the file that is being expanded.
    pub(crate) fn folder(&self) -> String {
        let folder = self.files.get(self.file).and_then(|path| path.parent());
        folder.map_or_else(String::new, |folder| folder.to_string_lossy().into_owned())
    }

    /// The content of an element, but for its attributes.
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

    /// An element that is not of xacro.
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
        for (name, text) in &element.attributes {
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
            let message = format!("what is expanded is nested deeper than {} levels", limits::XML_DEPTH);
            return Err(self.at(element, message));
        }
        let (file, line) = (element.file, element.line);
        Ok(MadeElement { name, attributes, children, depth, file, line })
    }

    fn element(&mut self, element: &Rc<Element>, depth: usize, body: &mut Body) -> Result<(), Error> {
        self.step(1).map_err(|fault| self.at(element, fault))?;
        if depth > limits::DEPTH {
            let message = format!("elements, macros and includes are nested deeper than {}", limits::DEPTH);
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

    /// The content of an element, as if it stood there alone.
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

    fn property(&mut self, element: &Rc<Element>) -> Result<(), Fault> {
        let name = self.required(element, "name")?;
        let top = self.scopes.top();
        let level = match element.attribute("scope") {
            None | Some("") => top,
            Some("parent") => top.saturating_sub(1),
            Some("global") => 0,
            Some(scope) => return Err(format!("{} is no scope; it is parent or global", shown(scope))),
        };
        let is_lazy = element.attribute("lazy_eval").is_none_or(|word| Value::literal(word).truth());
        if element.attribute("remove").is_some() {
            return Err(not_supported("remove of a property"));
        }
        let (text, is_default) = match (element.attribute("value"), element.attribute("default")) {
            (Some(text), _) => (Some(text), false),
            (None, default) => (default, default.is_some()),
        };
        if is_default && self.scopes.entry(&name, top).is_some() {
            return Ok(());
        }
        let Some(text) = text else {
            self.scopes.set_block(level, &name, Block::Source(element.clone()));
            return Ok(());
        };
        let entry = match Value::literal(text) {
            Value::Text(text) if level != top || !is_lazy => {
                Entry::Value(self.value(&text, top)?.into_literal())
            }
            Value::Text(text) if text.contains('$') => Entry::Lazy(text),
            value => Entry::Value(value),
        };
        self.step(text.len() / 16)?;
        self.scopes.set(level, &name, entry);
        Ok(())
    }

    fn declare_argument(&mut self, element: &Element) -> Result<(), Fault> {
        let name = self.required(element, "name")?;
        if let Some(default) = element.attribute("default").filter(|_| !self.arguments.contains_key(&name)) {
            let default = self.text(default, self.scopes.top())?;
            self.arguments.insert(name, default);
        }
        Ok(())
    }

    fn define(&mut self, element: &Rc<Element>) -> Result<(), Fault> {
        let name = self.required(element, "name")?;
        let name = name.strip_prefix("xacro:").unwrap_or(&name).to_owned();
        let parameters = parameters(element.attribute("params").unwrap_or_default())?;
        self.scopes.set_macro(Macro { name, parameters, element: element.clone() });
        Ok(())
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
        // The element's own name is the first attribute of that name, with xacro's prefix.
        for (key, text) in &element.attributes {
            let value = self.text(text, level).map_err(|fault| self.at(element, fault))?;
            if key == "name" && name.is_empty() {
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

    fn call_macro(
        &mut self,
        name: &str,
        element: &Rc<Element>,
        depth: usize,
        body: &mut Body,
    ) -> Result<(), Error> {
        let Some(known) = self.scopes.find_macro(name) else {
            return Err(self.at(element, format!("there is no macro {}", shown(name))));
        };
        let top = self.scopes.top();
        let mut values = BTreeMap::new();
        for (key, text) in
            element.attributes.iter().filter(|(key, _)| !(element.name == "call" && key == "macro"))
        {
            let is_known =
                known.parameters.iter().any(|p| matches!(p, Parameter::Value { name, .. } if name == key));
            if !is_known {
                let message = format!("the macro {} has no parameter {}", shown(name), shown(key));
                return Err(self.at(element, message));
            }
            let value = self.value(text, top).map_err(|fault| self.at(element, fault))?;
            values.insert(key.clone(), value.into_literal());
        }
        // Blocks are the elements in the call, expanded for the caller.
        let mut blocks = Vec::new();
        let given = self.children(element, depth + 1)?;
        let mut given = given.made.into_iter().filter_map(|made| match made {
            Made::Element(element) => Some(element),
            Made::Text(_) => None,
        });
        for parameter in &known.parameters {
            match parameter {
                Parameter::Block { name: block, content } => {
                    let Some(made) = given.next() else {
                        let message = format!("the call of {} lacks the block {}", shown(name), shown(block));
                        return Err(self.at(element, message));
                    };
                    let made = if *content { made.children.clone() } else { vec![Made::Element(made)] };
                    blocks.push((block.clone(), Block::Made(Rc::new(made))));
                }
                Parameter::Value { name: parameter, forward, default } if !values.contains_key(parameter) => {
                    let value = self.default(parameter, *forward, default.as_deref(), top);
                    let value = value.map_err(|fault| {
                        self.at(
                            element,
                            format!("the call of {} lacks {}: {fault}", shown(name), shown(parameter)),
                        )
                    })?;
                    values.insert(parameter.clone(), value);
                }
                Parameter::Value { .. } => {}
            }
        }
        if given.next().is_some() {
            return Err(self.at(element, format!("the call of {} has a block too many", shown(name))));
        }
        self.scopes.enter();
        let level = self.scopes.top();
        for (name, value) in values {
            self.scopes.set(level, &name, Entry::Value(value));
        }
        for (name, block) in blocks {
            self.scopes.set_block(level, &name, block);
        }
        let outer = std::mem::replace(&mut self.file, known.element.file);
        self.content(&known.element, depth, body)?;
        self.file = outer;
        self.scopes.leave();
        Ok(())
    }

    fn default(
        &mut self,
        name: &str,
        forward: bool,
        default: Option<&str>,
        level: usize,
    ) -> Result<Value, Fault> {
        if forward && self.scopes.entry(name, level).is_some() {
            return self.value(&format!("${{{name}}}"), level);
        }
        let default = default.ok_or("it has no default")?;
        Ok(self.value(default, level)?.into_literal())
    }

    fn include(&mut self, element: &Rc<Element>, depth: usize, body: &mut Body) -> Result<(), Error> {
        if element.attribute("ns").is_some() {
            return Err(self.at(element, not_supported("ns of an include")));
        }
        let optional = element.attribute("optional").is_some_and(|word| Value::literal(word).truth());
        let name = self.required(element, "filename").map_err(|fault| self.at(element, fault))?;
        if name.contains(['*', '[', '?']) {
            return Err(self.at(element, not_supported("patterns in the name of an include")));
        }
        let found = self.open(&name, limits::FILE_BYTES);
        let (path, text) = match found {
            Ok(found) => found,
            Err(_) if optional => return Ok(()),
            Err(fault) => return Err(self.at(element, fault)),
        };
        let file = match self.files.iter().position(|known| *known == path) {
            Some(known) => known,
            None => {
                self.files.push(path);
                self.files.len() - 1
            }
        };
        let root = self.parse(&text, file)?;
        let outer = std::mem::replace(&mut self.file, file);
        self.content(&root, depth, body)?;
        self.file = outer;
        Ok(())
    }

    /// Reads a YAML file as values.
    pub(crate) fn load_yaml(&mut self, name: &str) -> Result<Value, Fault> {
        let (path, text) = self.open(name, limits::YAML_BYTES)?;
        let (value, entries) = yaml::read(&text).map_err(|fault| format!("{}: {fault}", path.display()))?;
        self.step(entries)?;
        Ok(value)
    }

    /// A file that a file names: by its package, else from the folder of the file.
    fn open(&mut self, name: &str, most: u64) -> Result<(PathBuf, String), Fault> {
        self.readings += 1;
        if self.readings > limits::FILES {
            return Err(format!("more than {} files are read", limits::FILES));
        }
        let name = path(name.to_owned());
        let uri = match name.contains("://") {
            true => name,
            false => normal(&Path::new(&self.folder()).join(&name)).to_string_lossy().into_owned(),
        };
        let path = self.locator.find_source(&uri).map_err(|not_found| not_found.to_string())?;
        let text = read(&path, most)?;
        self.bytes += text.len();
        if self.bytes > limits::ALL_BYTES {
            return Err(format!("the files have more than {} bytes together", limits::ALL_BYTES));
        }
        Ok((path, text))
    }
}

/// `file://$(find arm)/a.stl` is `package://arm/a.stl`: no path of this disk is written.
fn path(value: String) -> String {
    match value.strip_prefix("file://").filter(|rest| rest.starts_with("package://")) {
        Some(rest) => rest.to_owned(),
        None => value,
    }
}

/// Without `.` and `..`, by the text alone.
fn normal(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for component in path.components() {
        match component {
            std::path::Component::ParentDir => drop(normal.pop()),
            std::path::Component::CurDir => {}
            component => normal.push(component),
        }
    }
    normal
}

fn read(path: &Path, most: u64) -> Result<String, Fault> {
    let unreadable = |error: std::io::Error| format!("cannot read {}: {error}", path.display());
    let mut text = Vec::new();
    std::fs::File::open(path)
        .map_err(unreadable)?
        .take(most + 1)
        .read_to_end(&mut text)
        .map_err(unreadable)?;
    if text.len() as u64 > most {
        return Err(format!("{} has more than {most} bytes", path.display()));
    }
    String::from_utf8(text).map_err(|_| format!("{} is not UTF-8; save it as UTF-8", path.display()))
}

/// What is written as a name must be one.
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

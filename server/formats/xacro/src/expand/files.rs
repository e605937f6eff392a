//! Includes and YAML files, found by the locator and within limits.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use simd_assets::files;

use super::{Body, Expansion, path};
use crate::error::{Error, Fault, not_supported, shown};
use crate::source::Element;
use crate::value::Value;
use crate::{limits, pattern, yaml};

impl Expansion<'_> {
    pub(super) fn include(
        &mut self,
        element: &Rc<Element>,
        depth: usize,
        body: &mut Body,
    ) -> Result<(), Error> {
        let here = |expansion: &Self, fault| expansion.at(element, fault);
        let namespace = match element.attribute("ns") {
            Some(text) => Some(self.text(text, self.scopes.top()).map_err(|fault| here(self, fault))?),
            None => None,
        };
        let optional = element.attribute("optional").is_some_and(|word| Value::literal(word).truth());
        let name = self.required(element, "filename").map_err(|fault| self.at(element, fault))?;
        if name.is_empty() && !optional {
            let written = element.attribute("filename").unwrap_or_default();
            return Err(self.at(element, format!("the name of the file is empty, in {}", shown(written))));
        }
        let outer = namespace.filter(|name| !name.is_empty()).map(|name| self.scopes.begin_namespace(&name));
        if name.contains(['*', '[', '?']) {
            let names = self.matching(&name).map_err(|fault| self.at(element, fault))?;
            if names.is_empty() {
                self.message(format!("no file is called {}", shown(&name)));
            }
            for name in names {
                self.include_one(&name, false, element, depth, body)?;
            }
        } else {
            self.include_one(&name, optional, element, depth, body)?;
        }
        if let Some(outer) = outer {
            self.scopes.end_namespace(outer);
        }
        Ok(())
    }

    fn include_one(
        &mut self,
        name: &str,
        optional: bool,
        element: &Rc<Element>,
        depth: usize,
        body: &mut Body,
    ) -> Result<(), Error> {
        let found = self.open(name, limits::FILE_BYTES);
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
        // A missing package is looked for in the folder of the file, which then includes itself.
        let package = name.strip_prefix("package://").and_then(|rest| rest.split('/').next());
        if let Some(package) = package
            && self.open_files.contains(&file)
            && !self.locator.knows_package(package)
        {
            return Err(self.at(element, format!("the package {} is not found", shown(package))));
        }
        let root = self.parse(&text, file)?;
        let outer = (self.file, self.including);
        (self.file, self.including) = (file, file);
        self.open_files.push(file);
        self.content(&root, depth, body)?;
        self.open_files.pop();
        (self.file, self.including) = outer;
        Ok(())
    }

    /// Returns the files that match a pattern in the last part of a name, in order. Files that may not be
    /// read are left out.
    fn matching(&mut self, pattern: &str) -> Result<Vec<String>, Fault> {
        let name = path(pattern.to_owned());
        let (folder, pattern) = name.rsplit_once('/').unwrap_or((".", &name));
        if folder.contains(['*', '[', '?']) {
            return Err(not_supported("patterns in the folder of an include"));
        }
        let on_disk = match folder.strip_prefix("package://") {
            Some(rest) => {
                let (package, rest) = rest.split_once('/').unwrap_or((rest, ""));
                let package = self.locator.package(package);
                package.ok_or_else(|| format!("the package of {} is not found", shown(&name)))?.join(rest)
            }
            None => normal(&Path::new(&self.folder_of(self.including)).join(folder)),
        };
        let entries = std::fs::read_dir(on_disk).into_iter().flatten().filter_map(Result::ok);
        let mut names: Vec<String> = entries
            .take(limits::ENTRIES)
            .filter_map(|entry| entry.file_name().into_string().ok())
            .filter(|name| pattern::fits(pattern, name))
            .map(|name| format!("{folder}/{name}"))
            .filter(|name| self.find(name).is_ok())
            .collect();
        names.sort();
        Ok(names)
    }

    /// Reads a YAML file as values.
    pub(crate) fn load_yaml(&mut self, name: &str) -> Result<Value, Fault> {
        let (path, text) = self.open(name, limits::YAML_BYTES)?;
        let mut evaluate = |text: &str| {
            let value = self.number(text)?;
            value.number().ok_or_else(|| format!("{} is not a number", shown(text)))
        };
        let (value, entries) =
            yaml::read(&text, &mut evaluate).map_err(|fault| format!("{}: {fault}", path.display()))?;
        self.step(entries)?;
        Ok(value)
    }

    /// Returns a name as an absolute path, from the folder of the file whose include is expanded.
    pub(crate) fn absolute(&self, name: &str) -> String {
        if name.contains("://") {
            return name.to_owned();
        }
        normal(&Path::new(&self.folder_of(self.including)).join(name)).to_string_lossy().into_owned()
    }

    /// Finds the file of a name. In a macro, searches the folder of the call first, like the official
    /// package, then the folder of the macro.
    fn find(&self, name: &str) -> Result<PathBuf, Fault> {
        let found = self.locator.find_source(&self.absolute(name));
        if self.including == self.file || name.contains("://") {
            return found.map_err(|not_found| not_found.to_string());
        }
        found.or_else(|not_found| {
            let own = normal(&Path::new(&self.folder()).join(name));
            self.locator.find_source(&own.to_string_lossy()).map_err(|_| not_found.to_string())
        })
    }

    /// Reads a file that a file names: by its package, or from the folder of the file.
    fn open(&mut self, name: &str, most: u64) -> Result<(PathBuf, String), Fault> {
        self.readings += 1;
        if self.readings > limits::FILES {
            return Err(format!("more than {} files are read", limits::FILES));
        }
        if name.is_empty() {
            return Err("the name of the file is empty".to_owned());
        }
        let path = self.find(&path(name.to_owned()))?;
        let text = read(&path, most)?;
        self.bytes += text.len();
        if self.bytes > limits::ALL_BYTES {
            return Err(format!("the files have more than {} bytes together", limits::ALL_BYTES));
        }
        Ok((path, text))
    }
}

/// Removes `.` and `..` from the text, without looking at the disk.
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

pub(super) fn read(path: &Path, most: u64) -> Result<String, Fault> {
    let text = match files::open(path).and_then(|file| files::read(file, most)) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::FileTooLarge => {
            return Err(format!("{} has more than {most} bytes", path.display()));
        }
        Err(error) => return Err(format!("cannot read {}: {error}", path.display())),
    };
    String::from_utf8(text).map_err(|_| format!("{} is not UTF-8; save it as UTF-8", path.display()))
}

//! Files that files name: includes and YAML, by the locator alone and within limits.

use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::{Body, Expansion, path};
use crate::error::{Error, Fault, not_supported};
use crate::source::Element;
use crate::value::Value;
use crate::{limits, yaml};

impl Expansion<'_> {
    pub(super) fn include(
        &mut self,
        element: &Rc<Element>,
        depth: usize,
        body: &mut Body,
    ) -> Result<(), Error> {
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

pub(super) fn read(path: &Path, most: u64) -> Result<String, Fault> {
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

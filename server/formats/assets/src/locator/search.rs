//! Search for one file, from folder to folder.

use std::path::{Path, PathBuf};

use super::Kind;
use crate::boundary::join_within;
use crate::{Inside, Why, inside, package};

/// One search: the places that it tried, and the first reason for passing a file by.
pub(super) struct Search<'a> {
    pub(super) root: Option<&'a Path>,
    pub(super) kind: Kind,
    pub(super) any_case: bool,
    pub(super) places: Vec<PathBuf>,
    pub(super) why: Option<Why>,
}

impl Search<'_> {
    /// Returns the real path of `folder/rest`, if it is a file that may be sent. Links of an `installed`
    /// package may lead into the source of the package of that name.
    pub(super) fn look(
        &mut self,
        folder: &Path,
        boundary: &Path,
        rest: &str,
        installed: Option<&str>,
    ) -> Option<PathBuf> {
        let Some(candidate) = join_within(folder, boundary, rest) else {
            self.pass_by(Why::ClimbsOut);
            return None;
        };
        if !self.places.contains(&candidate) {
            self.places.push(candidate.clone());
        }
        let (top, boundary, rest) = self.real(boundary, &candidate)?;
        let found = match inside(&top, &rest) {
            Inside::Missing if self.any_case => match in_other_case(&top, &rest) {
                Ok(found) => Inside::There(found?),
                Err(why) => {
                    self.pass_by(why);
                    return None;
                }
            },
            found => found,
        };
        let real = match found {
            Inside::There(real) if real.starts_with(&boundary) => real,
            Inside::Missing => return None,
            Inside::There(_) | Inside::LeadsOut => {
                let source = installed.filter(|_| self.root.is_none()).and_then(|name| {
                    let real = candidate.canonicalize().ok()?;
                    real.ancestors()
                        .any(|above| package::manifest_name(above).as_deref() == Some(name))
                        .then_some(real)
                });
                let Some(real) = source else {
                    self.pass_by(Why::LinkLeadsOut);
                    return None;
                };
                real
            }
        };
        if !real.is_file() {
            return None;
        }
        if !self.kind.has(&real) {
            self.pass_by(match self.kind {
                Kind::Mesh | Kind::MeshOrDescription => Why::NotAMesh,
                Kind::Source => Why::NotASource,
            });
            return None;
        }
        Some(real)
    }

    /// Returns the real folder to start from, the real folder to stay in, and the path from the first to the
    /// candidate. With a root, nothing outside of it is looked at.
    fn real(&self, boundary: &Path, candidate: &Path) -> Option<(PathBuf, PathBuf, PathBuf)> {
        let Some(root) = self.root else {
            let real = boundary.canonicalize().ok()?;
            return Some((real.clone(), real, candidate.strip_prefix(boundary).ok()?.to_path_buf()));
        };
        let real = root.canonicalize().ok()?;
        let root = std::path::absolute(root).ok()?;
        let from_root = |path: &Path| {
            path.strip_prefix(&root).or_else(|_| path.strip_prefix(&real)).ok().map(Path::to_path_buf)
        };
        let Inside::There(boundary) = inside(&real, &from_root(boundary)?) else { return None };
        let rest = from_root(candidate)?;
        Some((real, boundary, rest))
    }

    /// Keeps the first reason: it belongs to the likeliest place.
    pub(super) fn pass_by(&mut self, why: Why) {
        self.why.get_or_insert(why);
    }
}

/// Returns the one path that differs from `rest` only in capital letters.
fn in_other_case(top: &Path, rest: &Path) -> Result<Option<PathBuf>, Why> {
    let mut at = PathBuf::new();
    for component in rest.components() {
        let next = at.join(component);
        if let Inside::There(_) = inside(top, &next) {
            at = next;
            continue;
        }
        let Inside::There(folder) = inside(top, &at) else { return Ok(None) };
        let wanted = component.as_os_str().to_string_lossy().to_lowercase();
        let Ok(entries) = std::fs::read_dir(folder) else { return Ok(None) };
        let mut alike = entries
            .filter_map(Result::ok)
            .map(|entry| entry.file_name())
            .filter(|name| name.to_string_lossy().to_lowercase() == wanted);
        match (alike.next(), alike.next()) {
            (Some(name), None) => at.push(name),
            (Some(_), Some(_)) => return Err(Why::Ambiguous),
            (None, _) => return Ok(None),
        }
    }
    Ok(match inside(top, &at) {
        Inside::There(found) => Some(found),
        Inside::Missing | Inside::LeadsOut => None,
    })
}

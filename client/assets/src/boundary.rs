//! Whether a path stays inside a folder, by its text and by the disk.

use std::path::{Component, Path, PathBuf};

/// The real path of `path`, if that lies in `folder` or below it once all
/// symbolic links are resolved. `None` where it does not, or does not exist.
pub fn below(folder: &Path, path: &Path) -> Option<PathBuf> {
    let folder = folder.canonicalize().ok()?;
    let path = path.canonicalize().ok()?;
    path.starts_with(&folder).then_some(path)
}

/// Joins without asking the disk, so that a path that climbs out is refused
/// before anybody learns whether it exists.
pub(crate) fn join_within(folder: &Path, boundary: &Path, rest: &str) -> Option<PathBuf> {
    let mut joined = folder.to_path_buf();
    for component in Path::new(rest).components() {
        match component {
            Component::CurDir => {}
            Component::Normal(name) => joined.push(name),
            Component::ParentDir => {
                joined.pop();
                if !joined.starts_with(boundary) {
                    return None;
                }
            }
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    joined.starts_with(boundary).then_some(joined)
}

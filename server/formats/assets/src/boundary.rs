//! Containment of paths in folders, by their text and on the disk.

use std::collections::VecDeque;
use std::ffi::OsString;
use std::path::{Component, Path, PathBuf};

/// Returns the real path of `path`, if that lies in `folder` or below it once all symbolic links are
/// resolved. `None` if it does not, or does not exist.
pub fn below(folder: &Path, path: &Path) -> Option<PathBuf> {
    let folder = folder.canonicalize().ok()?;
    let path = path.canonicalize().ok()?;
    path.starts_with(&folder).then_some(path)
}

/// Result of following a path in a folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Inside {
    /// A file or folder exists; this is its real path.
    There(PathBuf),
    /// No file or folder exists.
    Missing,
    /// A symbolic link leads out of the folder, whether or not its target exists.
    LeadsOut,
}

/// Follows `rest` from `folder`, link by link, without looking at anything outside: a caller does not learn
/// whether a path outside exists. `..` applies to the targets of links.
///
/// `folder` is a real path, as from [`Path::canonicalize`].
pub fn inside(folder: &Path, rest: &Path) -> Inside {
    /// More than the system follows.
    const MAX_LINKS: usize = 64;
    let mut links = 0;
    let mut at = folder.to_path_buf();
    let mut ahead: VecDeque<Step> = steps(rest).collect();
    while let Some(step) = ahead.pop_front() {
        match step {
            Step::Root(root) => at = root,
            Step::Up => drop(at.pop()),
            // Outside: a link may lead back in, but nothing is looked at here.
            Step::Down(name) if !at.starts_with(folder) => at.push(name),
            Step::Down(name) => {
                let next = at.join(name);
                // A path that returns from outside is at the folder, which is real.
                let Ok(metadata) = next.symlink_metadata() else { return Inside::Missing };
                if !metadata.is_symlink() {
                    at = next;
                    continue;
                }
                links += 1;
                let Ok(target) = next.read_link() else { return Inside::Missing };
                if links > MAX_LINKS {
                    return Inside::Missing;
                }
                for step in steps(&target).collect::<Vec<_>>().into_iter().rev() {
                    ahead.push_front(step);
                }
            }
        }
    }
    if !at.starts_with(folder) {
        return Inside::LeadsOut;
    }
    if at.symlink_metadata().is_ok() { Inside::There(at) } else { Inside::Missing }
}

/// One step along a path.
enum Step {
    Root(PathBuf),
    Up,
    Down(OsString),
}

fn steps(path: &Path) -> impl Iterator<Item = Step> {
    path.components().filter_map(|component| match component {
        Component::Prefix(_) | Component::RootDir => Some(Step::Root(Path::new(&component).to_path_buf())),
        Component::CurDir => None,
        Component::ParentDir => Some(Step::Up),
        Component::Normal(name) => Some(Step::Down(name.to_owned())),
    })
}

/// Joins paths without reading the disk, so that a path that climbs out is refused before the caller learns
/// whether it exists.
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

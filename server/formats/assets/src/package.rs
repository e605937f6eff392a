//! Recognises the folders of packages by name, `package.xml` and contents.

use std::io::Read as _;
use std::path::{Path, PathBuf};

use crate::files;

/// Maximum number of folders above the URDF that are searched.
const MAX_ANCESTORS: usize = 8;

/// Returns the folder of the URDF and the folders above it, nearest first, up to `top`. Includes both the
/// given and the real path: either may hold the package if the URDF was reached through a symbolic link.
pub(crate) fn ancestors(urdf_folder: &Path, top: Option<&Path>) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = Vec::new();
    let given = std::path::absolute(urdf_folder).ok();
    for start in [given, urdf_folder.canonicalize().ok()].into_iter().flatten() {
        for folder in start.ancestors().take(MAX_ANCESTORS) {
            let inside = top.is_none_or(|top| crate::below(top, folder).is_some());
            // The root of the file system is never a package.
            if !inside || folder.parent().is_none() {
                break;
            }
            if !found.iter().any(|known| known == folder) {
                found.push(folder.to_path_buf());
            }
        }
    }
    found
}

/// Returns whether the folder is the package of this name, by its own name or by its manifest.
pub(crate) fn is_named(folder: &Path, name: &str) -> bool {
    folder.file_name().is_some_and(|own| own == name) || manifest_name(folder).is_some_and(|own| own == name)
}

/// Returns whether the folder looks like any package.
pub(crate) fn looks_like_one(folder: &Path) -> bool {
    folder.join("package.xml").is_file() || folder.join("urdf").is_dir()
}

/// Returns the package of the URDF, if known. Relative and absolute paths may only name files in it.
pub(crate) fn home(ancestors: &[PathBuf]) -> Option<PathBuf> {
    let manifest = ancestors.iter().find(|folder| folder.join("package.xml").is_file());
    let by_layout = || {
        let is_urdf = |folder: &&PathBuf| {
            folder.file_name().is_some_and(|name| name == "urdf" || name == "robots" || name == "robot")
        };
        // At most as deep as `NAME/urdf/arm/arm.urdf`: farther up, a folder of that name is not evidence.
        ancestors.iter().take(2).find(is_urdf)?.parent()
    };
    manifest
        .map(PathBuf::as_path)
        .or_else(by_layout)
        .or_else(|| ancestors.first().map(PathBuf::as_path))
        .map(Path::to_path_buf)
}

/// Returns `<name>` of the folder's `package.xml`, found by its text: nothing else of it is needed.
pub(crate) fn manifest_name(folder: &Path) -> Option<String> {
    let path = folder.join("package.xml");
    if !path.is_file() {
        return None;
    }
    let mut bytes = Vec::new();
    files::open(&path).ok()?.take(64 * 1024).read_to_end(&mut bytes).ok()?;
    let text = String::from_utf8_lossy(&bytes);
    let (_, after) = text.split_once("<name>")?;
    let (name, _) = after.split_once("</name>")?;
    Some(name.trim().to_owned())
}

/// Returns the folders in a folder, by name. Leaves out hidden ones, and links, which may form cycles.
pub(crate) fn folders_in(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let is_folder = |entry: &std::fs::DirEntry| entry.file_type().is_ok_and(|kind| kind.is_dir());
    let is_hidden = |entry: &std::fs::DirEntry| entry.file_name().as_encoded_bytes().starts_with(b".");
    let mut found: Vec<PathBuf> = entries
        .filter_map(Result::ok)
        .filter(|entry| is_folder(entry) && !is_hidden(entry))
        .map(|entry| entry.path())
        .collect();
    found.sort();
    found
}

//! What makes a folder a package: its name, its `package.xml`, what is in it.

use std::{
    fs::File,
    io::Read,
    path::{Path, PathBuf},
};

/// How many folders above the URDF are looked at.
const MAX_ANCESTORS: usize = 8;

/// The folder of the URDF and those above it, nearest first, stopping at `top`.
/// Both by the path as it was given and by the real one, since either may hold
/// the package where the URDF was reached through a symbolic link.
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

/// Whether the folder is the package of this name, by its own name or by its manifest.
pub(crate) fn is_named(folder: &Path, name: &str) -> bool {
    folder.file_name().is_some_and(|own| own == name) || manifest_name(folder).is_some_and(|own| own == name)
}

/// Whether the folder looks like some package.
pub(crate) fn looks_like_one(folder: &Path) -> bool {
    folder.join("package.xml").is_file() || folder.join("urdf").is_dir()
}

/// The package that the URDF is part of, as far as it is known: what relative and
/// absolute paths may name lies in it.
pub(crate) fn home(ancestors: &[PathBuf]) -> Option<PathBuf> {
    let manifest = ancestors.iter().find(|folder| folder.join("package.xml").is_file());
    let by_layout = || {
        let is_urdf = |folder: &&PathBuf| {
            folder.file_name().is_some_and(|name| name == "urdf" || name == "robots" || name == "robot")
        };
        // No deeper than `NAME/urdf/arm/arm.urdf`: farther up, a folder of that name means little.
        ancestors.iter().take(2).find(is_urdf)?.parent()
    };
    manifest
        .map(PathBuf::as_path)
        .or_else(by_layout)
        .or_else(|| ancestors.first().map(PathBuf::as_path))
        .map(Path::to_path_buf)
}

/// `<name>` of the folder's `package.xml`, found by its text: no more is needed of it.
pub(crate) fn manifest_name(folder: &Path) -> Option<String> {
    let path = folder.join("package.xml");
    if !path.is_file() {
        return None;
    }
    let mut bytes = Vec::new();
    File::open(path).ok()?.take(64 * 1024).read_to_end(&mut bytes).ok()?;
    let text = String::from_utf8_lossy(&bytes);
    let (_, after) = text.split_once("<name>")?;
    let (name, _) = after.split_once("</name>")?;
    Some(name.trim().to_owned())
}

/// The folders in a folder, in the order of their names. Not hidden ones, and not links:
/// those may lead in circles.
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

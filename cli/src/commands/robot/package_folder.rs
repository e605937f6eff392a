//! Folders of ROS packages on the command line.

use std::path::PathBuf;

/// Folder of a ROS package that a URDF names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PackageFolder {
    pub(crate) name: String,
    pub(crate) folder: PathBuf,
}

/// Reads `NAME=FOLDER`.
pub(crate) fn package_folder(text: &str) -> Result<PackageFolder, String> {
    match text.split_once('=') {
        Some((name, folder)) if !name.is_empty() && !folder.is_empty() => {
            Ok(PackageFolder { name: name.to_owned(), folder: PathBuf::from(folder) })
        }
        _ => Err("must be NAME=FOLDER".to_owned()),
    }
}

//! A robot on this disk: its URDF, and where the files that it names are.

use std::{
    fs,
    path::{Path, PathBuf},
};

use simd_assets::{Locator, find_urdf};

use crate::Error;

/// A URDF file, read, and the [`Locator`] of the files that it names.
#[derive(Clone, Debug)]
pub struct Package {
    /// The URDF file.
    pub path: PathBuf,
    /// Its bytes, as they are.
    pub urdf: Vec<u8>,
    /// Finds the files that it names.
    pub locator: Locator,
}

impl Package {
    /// Opens a URDF file, or the folder of a ROS package that holds exactly one, in
    /// itself or in its folder `urdf`. What it names is looked for in `ROS_PACKAGE_PATH` and
    /// `AMENT_PREFIX_PATH` too.
    ///
    /// # Errors
    /// [`Error::NoUrdf`] where there is no URDF or several, or where the file needs
    /// xacro first, [`Error::File`] where it cannot be read.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = find_urdf(path.as_ref())?;
        let urdf = fs::read(&path).map_err(|source| Error::File { path: path.clone(), source })?;
        Ok(Self { locator: Locator::new(&path).with_environment(), path, urdf })
    }

    /// Says where a ROS package is that the URDF names, before any search.
    #[must_use]
    pub fn with_package(mut self, name: &str, folder: &Path) -> Self {
        self.locator = self.locator.with_package(name, folder);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_package_folder_is_opened_with_its_urdf_and_finds_its_files() {
        let dir = tempfile::TempDir::new().unwrap();
        for file in ["urdf/arm.urdf", "meshes/a.stl"] {
            let path = dir.path().join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, file).unwrap();
        }
        let package = Package::open(dir.path()).unwrap();
        assert_eq!(package.urdf, b"urdf/arm.urdf");
        assert!(package.locator.find("../meshes/a.stl").is_ok());
        assert!(matches!(Package::open(dir.path().join("meshes")), Err(Error::NoUrdf(_))));
    }
}

//! A robot on this disk: its URDF, and the files that it names.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use simd_assets::{Locator, find_description, has_xacro, is_xacro};
use simd_xacro::Expanded;

use crate::Error;

/// A URDF file, its contents, and the [`Locator`] of the files that it names.
#[derive(Clone, Debug)]
pub struct Package {
    /// The URDF file, or the xacro file that it comes from.
    pub path: PathBuf,
    /// The URDF's bytes: from the file, or expanded from its xacro.
    pub urdf: Vec<u8>,
    /// Finds the files that the URDF names.
    pub locator: Locator,
    /// Result of the xacro file, if it was one.
    expanded: Option<Expanded>,
}

/// Options for opening a robot.
#[derive(Clone, Debug, Default)]
pub struct OpenOptions {
    /// Folders of ROS packages by name, which come before any search.
    pub packages: Vec<(String, PathBuf)>,
    /// For a xacro file: values of its `$(arg NAME)`.
    pub xacro_arguments: BTreeMap<String, String>,
}

impl Package {
    /// Opens a URDF file, or the folder of a ROS package that holds exactly one, directly or in its folder
    /// `urdf`. `ROS_PACKAGE_PATH` and `AMENT_PREFIX_PATH` are also searched for the files that it names. A
    /// `.xacro` file is expanded, without ROS; so is a file of another name with xacro in it.
    ///
    /// # Errors
    /// [`Error::NoUrdf`] if there is no URDF or several, [`Error::File`] if it cannot be read,
    /// [`Error::Xacro`] if a xacro file cannot be expanded.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::open_with(path, &OpenOptions::default())
    }

    /// Like [`open`](Self::open), with options.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_with(path: impl AsRef<Path>, options: &OpenOptions) -> Result<Self, Error> {
        let path = find_description(path.as_ref())?;
        let locator = Locator::new(&path).with_environment();
        let locator = options
            .packages
            .iter()
            .fold(locator, |locator, (name, folder)| locator.with_package(name, folder));
        let urdf = fs::read(&path).map_err(|reason| Error::File { path: path.clone(), reason })?;
        if is_xacro(&path) || has_xacro(&urdf) {
            let expanded = simd_xacro::expand(&path, &options.xacro_arguments, &locator)?;
            let urdf = expanded.urdf.clone().into_bytes();
            return Ok(Self { path, urdf, locator, expanded: Some(expanded) });
        }
        Ok(Self { path, urdf, locator, expanded: None })
    }

    /// Sets the folder of a ROS package that the URDF names, which comes before any search. A xacro file is
    /// expanded before this call: see [`OpenOptions`].
    #[must_use]
    pub fn with_package(mut self, name: &str, folder: &Path) -> Self {
        self.locator = self.locator.with_package(name, folder);
        self
    }

    /// Returns whether it is an SDF or MJCF, which may include other files.
    pub fn includes(&self) -> bool {
        let extension = self.path.extension().and_then(|extension| extension.to_str());
        extension.is_some_and(|extension| {
            ["sdf", "world", "xml", "mjcf"].contains(&extension.to_ascii_lowercase().as_str())
        })
    }

    /// Returns the xacro file and line from which a line of the URDF comes, for load reports. `None` if the
    /// URDF was not a xacro.
    pub fn xacro_source(&self, line: u32) -> Option<(&Path, u32)> {
        self.expanded.as_ref()?.source(line)
    }

    /// Returns the output of `xacro.message` and `xacro.warning`.
    pub fn xacro_messages(&self) -> &[String] {
        self.expanded.as_ref().map_or(&[], |expanded| &expanded.messages)
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

    #[test]
    fn a_file_with_xacro_in_it_is_expanded_whatever_its_name_ends_in() {
        let dir = tempfile::TempDir::new().unwrap();
        let path = dir.path().join("base.urdf");
        let text = "<robot name='r' xmlns:xacro='http://ros.org/wiki/xacro'><xacro:arg name='p' default='left_'/>\
            <link name='$(arg p)base'/></robot>";
        fs::write(&path, text).unwrap();
        let package = Package::open(&path).unwrap();
        assert!(String::from_utf8_lossy(&package.urdf).contains("<link name=\"left_base\"/>"));
        fs::write(&path, "<robot name='r'><!-- <xacro:arg/> --><link name='$(x)'/></robot>").unwrap();
        assert!(Package::open(&path).unwrap().xacro_source(1).is_none());
    }

    #[test]
    fn a_xacro_is_expanded_and_its_lines_lead_back() {
        let dir = tempfile::TempDir::new().unwrap();
        let path = dir.path().join("arm.urdf.xacro");
        let text = "<robot name='$(arg name)' xmlns:xacro='http://ros.org/wiki/xacro'>\n\n\n<link name='base'/></robot>";
        fs::write(&path, text).unwrap();
        let lacking = Package::open(&path).unwrap_err().to_string();
        assert!(
            lacking.ends_with("arm.urdf.xacro:1: the argument \"name\" is not given and has no default"),
            "{lacking}"
        );
        let arguments = BTreeMap::from([("name".to_owned(), "arm".to_owned())]);
        let options = OpenOptions { xacro_arguments: arguments, ..OpenOptions::default() };
        let package = Package::open_with(dir.path(), &options).unwrap();
        assert_eq!(
            package.urdf,
            b"<?xml version=\"1.0\"?>\n<robot name=\"arm\">\n<link name=\"base\"/>\n</robot>\n"
        );
        assert_eq!(package.xacro_source(3), Some((path.as_path(), 4)));
    }
}

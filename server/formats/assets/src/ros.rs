//! Packages of a ROS installation and models of Gazebo, from environment variables.

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use crate::package;

/// Maximum depth of the search below an entry of `ROS_PACKAGE_PATH`, and maximum number of folders.
const MAX_DEPTH: usize = 4;
const MAX_FOLDERS: usize = 5_000;

/// Folders in which ROS keeps packages. Searched once, at the first use.
#[derive(Clone, Debug, Default)]
pub(crate) struct RosPaths {
    /// `ROS_PACKAGE_PATH`: folders with packages somewhere below.
    package_path: Vec<PathBuf>,
    /// `AMENT_PREFIX_PATH`: packages are in `share`.
    prefixes: Vec<PathBuf>,
    /// Gazebo's folders, with models by their folders' names.
    models: Vec<PathBuf>,
    crawled: Arc<OnceLock<BTreeMap<String, PathBuf>>>,
}

impl RosPaths {
    /// Makes it from lists of folders, as in the variables.
    pub(crate) fn new(package_path: Vec<PathBuf>, prefixes: Vec<PathBuf>) -> Self {
        Self { package_path, prefixes, models: Vec::new(), crawled: Arc::default() }
    }

    /// Adds folders of Gazebo's models.
    pub(crate) fn with_models(self, models: Vec<PathBuf>) -> Self {
        Self { models, ..self }
    }

    /// Returns the folders of a package, the likeliest first.
    pub(crate) fn folders(&self, name: &str) -> Vec<PathBuf> {
        let crawled = self.crawled().get(name).cloned();
        let installed = self.prefixes.iter().map(|prefix| prefix.join("share").join(name));
        let models = self.models.iter().map(|folder| folder.join(name));
        crawled.into_iter().chain(installed.chain(models).filter(|folder| folder.is_dir())).collect()
    }

    /// Returns the folder of the package that a path lies in.
    pub(crate) fn package_of(&self, path: &Path) -> Option<PathBuf> {
        let crawled = self.crawled().values().find(|folder| path.starts_with(folder)).cloned();
        crawled.or_else(|| {
            self.prefixes.iter().find_map(|prefix| {
                let share = prefix.join("share");
                let name = path.strip_prefix(&share).ok()?.components().next()?;
                Some(share.join(name))
            })
        })
    }

    /// Searches like `rospack`: breadth first, not inside packages, and the first of a name counts.
    fn crawled(&self) -> &BTreeMap<String, PathBuf> {
        self.crawled.get_or_init(|| {
            let mut found = BTreeMap::new();
            let mut looked = 0;
            let mut ahead: VecDeque<(PathBuf, usize)> =
                self.package_path.iter().map(|folder| (folder.clone(), 0)).collect();
            while let Some((folder, depth)) = ahead.pop_front() {
                looked += 1;
                if looked > MAX_FOLDERS {
                    break;
                }
                if let Some(name) = package::manifest_name(&folder) {
                    found.entry(name).or_insert(folder);
                    continue;
                }
                if depth < MAX_DEPTH && !folder.join("CATKIN_IGNORE").exists() {
                    ahead.extend(package::folders_in(&folder).into_iter().map(|inner| (inner, depth + 1)));
                }
            }
            found
        })
    }
}

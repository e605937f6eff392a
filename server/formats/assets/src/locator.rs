//! Finds the file on this disk for a URI in a URDF.

mod search;

use std::path::{Path, PathBuf};

use self::search::Search;
use crate::boundary::join_within;
use crate::{
    NotFound, Why, package,
    ros::RosPaths,
    uri::{self, Uri},
};

/// Extensions of the files that a URDF may name. Without this list, `package://.ssh/id_rsa` in an untrusted
/// URDF would make a client upload its owner's key.
const EXTENSIONS: &[&str] = &[
    "stl", "obj", "dae", "ply", "off", "gltf", "glb", "bin", "mtl", "3ds", "3mf", "fbx", "wrl", "x3d", "msh",
    "usd", "usda", "usdc", "usdz", "step", "stp", "iges", "igs", "png", "jpg", "jpeg", "bmp", "tga", "tif",
    "tiff", "gif", "webp", "dds", "hdr",
];

/// Extensions of descriptions that may include others: their text becomes a part of an uploaded robot.
const DESCRIPTIONS: &[&str] = &["sdf", "world", "xml", "mjcf", "config"];

/// Extensions of the other files that an SDF may include.
const INCLUDED: &[&str] = &["urdf"];

/// Extensions of the files that a xacro file may name: their text becomes a part of an uploaded URDF.
const SOURCES: &[&str] = &["xacro", "urdf", "xml", "gazebo", "yaml", "yml"];

/// Environment variables of all versions of Gazebo that list folders of models.
const MODEL_PATHS: [&str; 5] = [
    "GZ_SIM_RESOURCE_PATH",
    "IGN_GAZEBO_RESOURCE_PATH",
    "GAZEBO_MODEL_PATH",
    "GAZEBO_RESOURCE_PATH",
    "SDF_PATH",
];

/// Finds the files that one URDF names.
///
/// ```no_run
/// use std::path::Path;
///
/// let locator = simd_assets::Locator::new(Path::new("/home/me/arm/urdf/arm.urdf"));
/// let mesh = locator.find("package://arm/meshes/base_link.STL")?;
/// # Ok::<(), simd_assets::NotFound>(())
/// ```
#[derive(Clone, Debug)]
pub struct Locator {
    /// Folder of relative paths.
    folder: PathBuf,
    /// Folders by package name, which come before all others.
    packages: Vec<(String, PathBuf)>,
    ros: RosPaths,
    /// Folder outside of which no file is found.
    root: Option<PathBuf>,
    /// Whether it is an SDF or MJCF, which may include other files.
    includes: bool,
}

impl Locator {
    /// Makes a locator for a URDF file, whose packages are looked for in the folders above it.
    pub fn new(urdf: &Path) -> Self {
        let folder = match urdf.parent() {
            Some(folder) if folder.as_os_str().is_empty() => PathBuf::from("."),
            Some(folder) => folder.to_path_buf(),
            None => urdf.to_path_buf(),
        };
        Self {
            folder,
            packages: Vec::new(),
            ros: RosPaths::default(),
            root: None,
            includes: is_including(urdf),
        }
    }

    /// Sets the folder of a package, which comes before any search.
    #[must_use]
    pub fn with_package(mut self, name: &str, folder: &Path) -> Self {
        self.packages.push((name.to_owned(), folder.to_path_buf()));
        self
    }

    /// Refuses files outside of `root` once symbolic links are resolved, and searches no folder outside of
    /// it. Relative and absolute paths may then name any file in `root`.
    #[must_use]
    pub fn within(mut self, root: &Path) -> Self {
        self.root = Some(root.to_path_buf());
        self
    }

    /// Also looks in the packages of a ROS installation, before the folders above the URDF:
    /// `ROS_PACKAGE_PATH` and `AMENT_PREFIX_PATH`, as lists of folders.
    #[must_use]
    pub fn with_ros_paths(mut self, package_path: Vec<PathBuf>, prefixes: Vec<PathBuf>) -> Self {
        self.ros = RosPaths::new(package_path, prefixes);
        self
    }

    /// Like [`with_ros_paths`](Self::with_ros_paths), from the environment variables of this process, with
    /// Gazebo's for models.
    #[must_use]
    pub fn with_environment(self) -> Self {
        let folders = |name: &str| std::env::var_os(name).map(|list| std::env::split_paths(&list).collect());
        let folders = |name: &str| {
            let list: Vec<PathBuf> = folders(name).unwrap_or_default();
            list.into_iter().filter(|folder| folder.is_absolute()).collect::<Vec<PathBuf>>()
        };
        let models = MODEL_PATHS.iter().flat_map(|name| folders(name)).collect();
        self.with_ros_paths(folders("ROS_PACKAGE_PATH"), folders("AMENT_PREFIX_PATH"))
            .with_model_paths(models)
    }

    /// Also looks for models in these folders, by their folders' names.
    #[must_use]
    pub fn with_model_paths(mut self, models: Vec<PathBuf>) -> Self {
        self.ros = self.ros.with_models(models);
        self
    }

    /// Returns the real path of the file that `uri` names.
    ///
    /// # Errors
    /// [`NotFound`] if there is no such file, or it lies outside of its package or of the root. Also if its
    /// name has no extension of a mesh or an image.
    pub fn find(&self, uri: &str) -> Result<PathBuf, NotFound> {
        self.search(uri, self.kind()).map(|(path, _aside)| path)
    }

    fn kind(&self) -> Kind {
        if self.includes { Kind::MeshOrDescription } else { Kind::Mesh }
    }

    /// Returns, as a fragment of a sentence, the folder in which the file of `uri` was found, if it differs
    /// from `uri`. `None` also if there is no file.
    pub fn note(&self, uri: &str) -> Option<String> {
        let (_, aside) = self.search(uri, self.kind()).ok()?;
        aside.map(|folder| format!("it is found from the package's folder {}", folder.display()))
    }

    /// Returns the real path of a xacro file, or of a YAML file that a xacro file names, within the same
    /// bounds.
    ///
    /// # Errors
    /// As [`find`](Self::find).
    pub fn find_source(&self, uri: &str) -> Result<PathBuf, NotFound> {
        self.search(uri, Kind::Source).map(|(path, _aside)| path)
    }

    /// Returns the folder of a package.
    pub fn package(&self, name: &str) -> Option<PathBuf> {
        let ancestors = package::ancestors(&self.folder, self.root.as_deref());
        let all = self.folders_of(&ancestors, name);
        let (named, others): (Vec<_>, Vec<_>) =
            all.into_iter().filter(|folder| folder.path.is_dir()).partition(|folder| folder.is_named);
        named.into_iter().chain(others).next().map(|folder| folder.path)
    }

    /// Returns whether a folder is known to be this package, by its name, its manifest or the map.
    pub fn knows_package(&self, name: &str) -> bool {
        let ancestors = package::ancestors(&self.folder, self.root.as_deref());
        self.folders_of(&ancestors, name).iter().any(|folder| folder.is_named && folder.path.is_dir())
    }

    /// Returns the file. Also returns the folder in which it was found, if `uri` names another one or none.
    fn search(&self, uri: &str, kind: Kind) -> Result<(PathBuf, Option<PathBuf>), NotFound> {
        let not_found = |why, places| NotFound { uri: uri.to_owned(), why, places };
        let readings = uri::readings(uri).map_err(|why| not_found(why, Vec::new()))?;
        let ancestors = package::ancestors(&self.folder, self.root.as_deref());
        let mut search =
            Search { root: self.root.as_deref(), kind, any_case: false, places: Vec::new(), why: None };
        // Other letter cases are tried only if no file has the exact name.
        for any_case in [false, true] {
            search.any_case = any_case;
            for reading in &readings {
                let found = match reading {
                    Uri::Package { name, rest } => self.in_package(&mut search, &ancestors, name, rest),
                    Uri::Relative(path) => self.relative(&mut search, &ancestors, path),
                    Uri::Absolute(path) => self.absolute(&mut search, &ancestors, path),
                };
                if let Some(found) = found {
                    return Ok((found, None));
                }
                let rest = match reading {
                    Uri::Package { name, rest } if name.is_empty() => rest,
                    Uri::Relative(path) => path,
                    Uri::Package { .. } | Uri::Absolute(_) => continue,
                };
                for folder in Self::roots(&ancestors) {
                    // A path that climbs out of a package is not looked up from its folder.
                    if join_within(&folder, &folder, rest).is_none() {
                        continue;
                    }
                    if let Some(found) = search.look(&folder, &folder, rest, None) {
                        return Ok((found, Some(folder)));
                    }
                }
            }
        }
        Err(not_found(search.why.unwrap_or(Why::Missing), search.places))
    }

    fn in_package(
        &self,
        search: &mut Search,
        ancestors: &[PathBuf],
        name: &str,
        rest: &str,
    ) -> Option<PathBuf> {
        self.folders_of(ancestors, name).into_iter().find_map(|folder| {
            let installed = folder.is_installed.then_some(name);
            search.look(&folder.path, &folder.path, rest, installed)
        })
    }

    /// Returns the folders in which a package may be, in the order of the search.
    fn folders_of(&self, ancestors: &[PathBuf], name: &str) -> Vec<Folder> {
        let folder = |path| Folder { path, is_named: true, is_installed: false };
        let mapped = self.packages.iter().filter(|(known, _)| known == name);
        let mut all: Vec<Folder> = mapped.map(|(_, path)| folder(path.clone())).collect();
        if !name.is_empty() {
            all.extend(
                self.ros.folders(name).into_iter().map(|path| Folder { is_installed: true, ..folder(path) }),
            );
            for above in ancestors {
                if package::is_named(above, name) {
                    all.push(folder(above.clone()));
                }
                all.push(folder(above.join(name)));
                // A folder of models beside the folder of worlds: `models/NAME` for `worlds/w.sdf`.
                all.push(folder(above.join("models").join(name)));
            }
        }
        if name.is_empty() {
            return all;
        }
        // The folder of an export is often renamed, but the URDF in it is not.
        let renamed = ancestors.iter().filter(|above| package::looks_like_one(above));
        all.extend(renamed.map(|above| Folder { is_named: false, ..folder(above.clone()) }));
        all
    }

    fn relative(&self, search: &mut Search, ancestors: &[PathBuf], path: &str) -> Option<PathBuf> {
        let folder = std::path::absolute(&self.folder).ok()?;
        let boundary = match &self.root {
            Some(_) => self.boundary(ancestors)?,
            // Other programs of this user would also read it.
            None => folder.ancestors().last()?.to_path_buf(),
        };
        if let Some(found) = search.look(&folder, &boundary, path, None) {
            return Some(found);
        }
        // Try again from the real folder, in which `..` may mean another folder.
        let real = folder.canonicalize().ok()?;
        if real == folder {
            return None;
        }
        search.look(&real, &boundary.canonicalize().ok()?, path, None)
    }

    fn absolute(&self, search: &mut Search, ancestors: &[PathBuf], path: &str) -> Option<PathBuf> {
        let path = Path::new(path);
        let folders = self.packages.iter().map(|(_, folder)| folder.clone()).chain(self.boundary(ancestors));
        let beside = ancestors.iter().filter_map(|above| {
            let name = path.strip_prefix(above).ok()?.components().next()?;
            Some(above.join(name)).filter(|folder| folder.join("package.xml").is_file())
        });
        let mut is_known = false;
        for folder in folders.chain(self.ros.package_of(path)).chain(beside) {
            let Ok(folder) = std::path::absolute(folder) else { continue };
            let real = folder.canonicalize().unwrap_or_else(|_| folder.clone());
            for folder in [folder, real] {
                let Some(rest) = path.strip_prefix(&folder).ok().and_then(Path::to_str) else { continue };
                is_known = true;
                let name = folder.file_name().and_then(|name| name.to_str());
                if let Some(found) = search.look(&folder, &folder, rest, name) {
                    return Some(found);
                }
            }
        }
        if !is_known {
            search.pass_by(Why::AbsoluteOutside);
        }
        None
    }

    /// Returns the folders above the URDF that belong to a package: exports name files from there, even if
    /// the URDF lies deeper.
    fn roots(ancestors: &[PathBuf]) -> Vec<PathBuf> {
        let mut roots: Vec<PathBuf> =
            ancestors.iter().filter(|above| package::looks_like_one(above)).cloned().collect();
        roots.extend(package::home(ancestors).filter(|home| !roots.contains(home)));
        roots
    }

    /// Returns the folder that absolute paths, and relative ones below a root, must stay in.
    fn boundary(&self, ancestors: &[PathBuf]) -> Option<PathBuf> {
        match &self.root {
            Some(root) => std::path::absolute(root).ok(),
            None => package::home(ancestors),
        }
    }
}

/// A folder that may belong to a package.
struct Folder {
    path: PathBuf,
    /// Known by its name, its manifest or the map; else it only looks like some package.
    is_named: bool,
    /// Installed by ROS: its files may be links into the package's source.
    is_installed: bool,
}

/// Required type of a file.
#[derive(Clone, Copy)]
enum Kind {
    Mesh,
    /// For an SDF or MJCF.
    MeshOrDescription,
    Source,
}

impl Kind {
    fn has(self, file: &Path) -> bool {
        let extension = file.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        let known: &[&[&str]] = match self {
            Self::Mesh => &[EXTENSIONS],
            Self::MeshOrDescription => &[EXTENSIONS, DESCRIPTIONS, INCLUDED],
            Self::Source => &[SOURCES],
        };
        extension.is_some_and(|extension| known.iter().any(|known| known.contains(&extension.as_str())))
    }
}

/// Returns whether a file is an SDF or MJCF by its name.
fn is_including(file: &Path) -> bool {
    let extension = file.extension().and_then(|extension| extension.to_str()).map(str::to_ascii_lowercase);
    extension.is_some_and(|extension| DESCRIPTIONS.contains(&extension.as_str()))
}

#[cfg(test)]
mod tests;
#[cfg(test)]
#[cfg(unix)]
mod vectors;

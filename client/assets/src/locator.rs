//! From a URI that a URDF names to a file on this disk.

use std::path::{Path, PathBuf};

use crate::{
    below,
    boundary::join_within,
    package,
    uri::{self, Uri},
};

/// Extensions of what a URDF may name. Without this list, `package://.ssh/id_rsa`
/// in a stranger's URDF would have a client upload its owner's key.
const EXTENSIONS: &[&str] = &[
    "stl", "obj", "dae", "ply", "off", "gltf", "glb", "bin", "mtl", "3ds", "3mf", "fbx", "wrl", "x3d", "msh",
    "usd", "usda", "usdc", "usdz", "step", "stp", "iges", "igs", "png", "jpg", "jpeg", "bmp", "tga", "tif",
    "tiff", "gif", "webp", "dds", "hdr",
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
    /// Where relative paths begin.
    folder: PathBuf,
    /// Folders by package name, which come before all else.
    packages: Vec<(String, PathBuf)>,
    /// Nothing outside of it is found.
    root: Option<PathBuf>,
}

/// Why there is no file for a URI.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{reason}{}", Searched(places))]
pub struct NotFound {
    /// A sentence that names the URI.
    pub reason: String,
    /// The files that would have been it, in the order in which they were looked for.
    pub places: Vec<PathBuf>,
    /// The URI means nothing here, or what it means may not be given away: the
    /// reason says so. Else there simply is no such file.
    pub refused: bool,
}

impl Locator {
    /// For a URDF file, whose packages are looked for in the folders above it.
    pub fn new(urdf: &Path) -> Self {
        let folder = match urdf.parent() {
            Some(folder) if folder.as_os_str().is_empty() => PathBuf::from("."),
            Some(folder) => folder.to_path_buf(),
            None => urdf.to_path_buf(),
        };
        Self { folder, packages: Vec::new(), root: None }
    }

    /// Says where a package is, before any search.
    #[must_use]
    pub fn with_package(mut self, name: &str, folder: &Path) -> Self {
        self.packages.push((name.to_owned(), folder.to_path_buf()));
        self
    }

    /// Refuses what lies outside of `root` once symbolic links are resolved, and
    /// searches no folder outside of it. Relative and absolute paths may then name
    /// whatever lies in `root`.
    #[must_use]
    pub fn within(mut self, root: &Path) -> Self {
        self.root = Some(root.to_path_buf());
        self
    }

    /// The real path of the file that `uri` names.
    ///
    /// # Errors
    /// [`NotFound`] where there is no such file, where it lies outside of its
    /// package or of the root, or where it is not a mesh or an image by its name.
    pub fn find(&self, uri: &str) -> Result<PathBuf, NotFound> {
        let readings = uri::readings(uri).map_err(|phrase| NotFound {
            reason: format!("`{uri}` {phrase}"),
            places: Vec::new(),
            refused: true,
        })?;
        let ancestors = package::ancestors(&self.folder, self.root.as_deref());
        let mut search = Search { root: self.root.as_deref(), places: Vec::new(), refusal: None };
        for reading in &readings {
            let found = match reading {
                Uri::Package { name, rest } => self.in_package(&mut search, &ancestors, name, rest),
                Uri::Relative(path) => self.relative(&mut search, &ancestors, path),
                Uri::Absolute(path) => self.absolute(&mut search, &ancestors, path),
            };
            if let Some(found) = found {
                return Ok(found);
            }
        }
        Err(NotFound {
            reason: match search.refusal {
                Some(phrase) => format!("`{uri}` {phrase}"),
                None => format!("no file for `{uri}`"),
            },
            places: search.places,
            refused: search.refusal.is_some(),
        })
    }

    fn in_package(
        &self,
        search: &mut Search,
        ancestors: &[PathBuf],
        name: &str,
        rest: &str,
    ) -> Option<PathBuf> {
        for (_, folder) in self.packages.iter().filter(|(known, _)| known == name) {
            if let Some(found) = search.look(folder, folder, rest) {
                return Some(found);
            }
        }
        for folder in ancestors.iter().filter(|_| !name.is_empty()) {
            if package::is_named(folder, name)
                && let Some(found) = search.look(folder, folder, rest)
            {
                return Some(found);
            }
            let beside = folder.join(name);
            if let Some(found) = search.look(&beside, &beside, rest) {
                return Some(found);
            }
        }
        // The folder of an export is often renamed, and the URDF in it is not.
        for folder in ancestors.iter().filter(|folder| package::looks_like_one(folder)) {
            if let Some(found) = search.look(folder, folder, rest) {
                return Some(found);
            }
        }
        None
    }

    fn relative(&self, search: &mut Search, ancestors: &[PathBuf], path: &str) -> Option<PathBuf> {
        let folder = std::path::absolute(&self.folder).ok()?;
        let boundary = self.boundary(ancestors)?;
        if let Some(found) = search.look(&folder, &boundary, path) {
            return Some(found);
        }
        // Again from the real folder, in which `..` may mean something else.
        let real = folder.canonicalize().ok()?;
        if real == folder {
            return None;
        }
        search.look(&real, &boundary.canonicalize().ok()?, path)
    }

    fn absolute(&self, search: &mut Search, ancestors: &[PathBuf], path: &str) -> Option<PathBuf> {
        let folders = self.packages.iter().map(|(_, folder)| folder.clone()).chain(self.boundary(ancestors));
        for folder in folders {
            let Ok(folder) = std::path::absolute(folder) else { continue };
            let real = folder.canonicalize().unwrap_or_else(|_| folder.clone());
            for folder in [folder, real] {
                let Ok(rest) = Path::new(path).strip_prefix(&folder) else { continue };
                if let Some(found) = rest.to_str().and_then(|rest| search.look(&folder, &folder, rest)) {
                    return Some(found);
                }
            }
        }
        if search.places.is_empty() {
            search.refuse("is an absolute path outside of the robot's package");
        }
        None
    }

    /// What relative and absolute paths must stay in.
    fn boundary(&self, ancestors: &[PathBuf]) -> Option<PathBuf> {
        match &self.root {
            Some(root) => std::path::absolute(root).ok(),
            None => package::home(ancestors),
        }
    }
}

/// One search: where it looked, and why it passed by what it saw.
struct Search<'a> {
    root: Option<&'a Path>,
    places: Vec<PathBuf>,
    refusal: Option<&'static str>,
}

impl Search<'_> {
    /// The real path of `folder/rest`, if it is a file to be given away.
    fn look(&mut self, folder: &Path, boundary: &Path, rest: &str) -> Option<PathBuf> {
        let Some(candidate) = join_within(folder, boundary, rest) else {
            self.refuse("climbs out of the robot's package with `..`");
            return None;
        };
        if !self.places.contains(&candidate) {
            self.places.push(candidate.clone());
        }
        if !candidate.is_file() {
            return None;
        }
        let inside = below(boundary, &candidate)
            .filter(|real| self.root.is_none_or(|root| below(root, real).is_some()));
        let Some(real) = inside else {
            self.refuse("leads out of the robot's package through a symbolic link");
            return None;
        };
        let extension = real.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        if !extension.is_some_and(|e| EXTENSIONS.contains(&e.as_str())) {
            self.refuse("is not a mesh or an image by its name");
            return None;
        }
        Some(real)
    }

    /// The first refusal is kept: it is of the likeliest place.
    fn refuse(&mut self, phrase: &'static str) {
        self.refusal.get_or_insert(phrase);
    }
}

/// The end of the sentence, where there were any places.
struct Searched<'a>(&'a [PathBuf]);

impl std::fmt::Display for Searched<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (index, place) in self.0.iter().enumerate() {
            let before = if index == 0 { "; searched " } else { ", " };
            write!(f, "{before}{}", place.display())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;

//! Robots on the daemon's own disk: permitted paths, and the files that a URDF there names.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use simd_assets::{Inside, Locator, NoUrdf, below, files, find_urdf, find_urdf_within, inside};
use simd_model::robot::Sha256;
use simd_model::{Asset, Assets};

use crate::call_error::CallError;

/// Folders below which clients may name files.
#[derive(Clone, Debug, Default)]
pub(super) struct Roots {
    /// Folders as the operator wrote them, absolute, each with its resolved path.
    roots: Vec<(PathBuf, PathBuf)>,
}

/// A URDF on the disk.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct OnDisk {
    /// Path of the URDF.
    pub(super) urdf: PathBuf,
    /// Folder that must contain its files; `None` for a robot that the operator named.
    pub(super) root: Option<PathBuf>,
}

impl Roots {
    /// # Errors
    /// Returns the folder that is not readable, and the error.
    pub(super) fn new(folders: &[PathBuf]) -> Result<Self, (PathBuf, std::io::Error)> {
        let root = |folder: &PathBuf| {
            let failed = |error| (folder.clone(), error);
            let given = std::path::absolute(folder).map_err(failed)?;
            let real = folder.canonicalize().map_err(failed)?;
            std::fs::read_dir(&real).map_err(failed)?;
            Ok((given, real))
        };
        Ok(Self { roots: folders.iter().map(root).collect::<Result<_, (PathBuf, std::io::Error)>>()? })
    }

    /// Finds the URDF at a client's path. A relative path begins at a root. A path outside of the roots gets
    /// the same error, whether it exists or not.
    ///
    /// # Errors
    /// Returns an error if it is outside, also through a symbolic link, or is not a robot.
    pub(super) fn find(&self, path: &str) -> Result<OnDisk, CallError> {
        if self.roots.is_empty() {
            return Err(not_allowed(format!(
                "the path {path:?} cannot be used, since this daemon has no asset root; start it with \
                 --asset-root FOLDER, or send the robot's files"
            )));
        }
        let mut missing = false;
        for (given, real) in &self.roots {
            for root in [given, real] {
                let Some(rest) = stays_in(root, Path::new(path)) else { continue };
                match inside(real, &rest) {
                    Inside::There(found) => {
                        let urdf = find_urdf_within(real, &found).map_err(no_urdf)?;
                        // The file in a folder may again be a symbolic link.
                        return match below(real, &urdf) {
                            Some(urdf) => Ok(OnDisk { urdf, root: Some(real.clone()) }),
                            None => Err(leads_out(path)),
                        };
                    }
                    Inside::LeadsOut => return Err(leads_out(path)),
                    Inside::Missing => {}
                }
                missing = true;
            }
        }
        Err(if missing {
            CallError::FileNotFound { message: format!("there is no file {path:?} below the asset roots") }
        } else {
            not_allowed(format!("the path {path:?} is not below one of the daemon's asset roots"))
        })
    }
}

/// Finds the URDF of a robot that the operator named, at any path.
pub(super) fn find_for_operator(path: &Path) -> Result<OnDisk, CallError> {
    find_urdf(path).map(|urdf| OnDisk { urdf, root: None }).map_err(no_urdf)
}

/// Joins `path` to `root` and removes `..`; `None` if the result is textually outside of `root`.
fn stays_in(root: &Path, path: &Path) -> Option<PathBuf> {
    let mut joined = PathBuf::new();
    for component in root.join(path).components() {
        match component {
            Component::ParentDir => drop(joined.pop()),
            Component::CurDir => {}
            Component::Prefix(_) | Component::RootDir | Component::Normal(_) => joined.push(component),
        }
    }
    joined.strip_prefix(root).ok().map(Path::to_path_buf)
}

/// Reads a file of at most `limit` bytes.
pub(super) fn read_file(path: &Path, limit: u64) -> Result<Arc<[u8]>, CallError> {
    let unreadable = |error: std::io::Error| CallError::FileNotFound {
        message: format!("cannot read {}: {error}", path.display()),
    };
    match files::open(path).and_then(|file| files::read(file, limit)) {
        Ok(bytes) => Ok(bytes.into()),
        Err(error) if error.kind() == ErrorKind::FileTooLarge => Err(CallError::LimitExceeded {
            what: format!("the size of {} in bytes", path.display()),
            value: std::fs::metadata(path).map_or(limit + 1, |metadata| metadata.len()),
            limit,
        }),
        Err(error) => Err(unreadable(error)),
    }
}

/// Files that a URDF on the disk names.
#[derive(Debug)]
pub(super) struct DiskAssets {
    locator: Locator,
    limit: u64,
    /// Files that were read, for viewers.
    read: RefCell<BTreeMap<Sha256, Arc<[u8]>>>,
}

impl DiskAssets {
    /// Makes a reader of files of at most `limit` bytes each.
    pub(super) fn new(robot: &OnDisk, limit: u64) -> Self {
        let locator = Locator::new(&robot.urdf);
        let locator = match &robot.root {
            Some(root) => locator.within(root),
            None => locator.with_environment(),
        };
        Self { locator, limit, read: RefCell::default() }
    }

    /// Returns all files that were read.
    pub(super) fn into_files(self) -> BTreeMap<Sha256, Arc<[u8]>> {
        self.read.into_inner()
    }
}

impl Assets for DiskAssets {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        let path = self.locator.find(uri).map_err(|not_found| {
            if not_found.places.is_empty() {
                return vec![format!("nowhere, because {}", not_found.reason())];
            }
            not_found.places.iter().map(|place| place.display().to_string()).collect()
        })?;
        let bytes = read_file(&path, self.limit).map_err(|error| vec![error.to_string()])?;
        let sha256 = Sha256::of(&bytes);
        let bytes = self.read.borrow_mut().entry(sha256).or_insert(bytes).clone();
        Ok(Asset { sha256, bytes })
    }

    fn note(&self, uri: &str) -> Option<String> {
        let other_case = || simd_model::other_case(uri, self.locator.find(uri).ok()?.to_str()?);
        self.locator.note(uri).or_else(other_case)
    }
}

fn no_urdf(error: NoUrdf) -> CallError {
    match error {
        NoUrdf::Unreadable { .. } => CallError::FileNotFound { message: error.to_string() },
        NoUrdf::Unfit { path, reason } => CallError::InvalidValue {
            element: "path".into(),
            value: format!("{:?}", path.display().to_string()),
            expected: format!("it {reason}"),
        },
    }
}

fn leads_out(path: &str) -> CallError {
    not_allowed(format!("the path {path:?} leads out of the asset roots through a symbolic link"))
}

fn not_allowed(message: String) -> CallError {
    CallError::PathNotAllowed { message }
}

#[cfg(test)]
mod tests;

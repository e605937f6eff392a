//! Atomic replacement of files. If the program is killed or the disk is full, the old file stays; files that
//! must be written in place are an exception.

#[cfg(test)]
mod tests;

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// A file in the same folder as the one that it replaces. If it is dropped before [`finish`](Self::finish),
/// it is deleted, and the old file does not change.
#[derive(Debug)]
pub struct Replacement {
    file: File,
    /// Path of the old file, with links followed: a link continues to point to the file.
    path: PathBuf,
    /// Temporary path; `None` if the file is written in place.
    beside: Option<PathBuf>,
    /// Whether no old file may exist.
    is_new: bool,
}

impl Replacement {
    /// Begins a file that replaces the one at `path`, or is new. It gets the owner and the permissions of the
    /// old file, or the process's defaults.
    ///
    /// The file is written in place if `path` is
    ///
    /// * no regular file, such as a pipe or `/dev/full`;
    /// * the target of a standard stream;
    /// * a link whose target does not exist;
    /// * a writable file whose folder allows no other file with its owner.
    ///
    /// # Errors
    /// Returns an error if the old file is not writable, or if there is none and the folder is not writable.
    pub fn begin(path: &Path) -> io::Result<Self> {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        /// Maximum number of tries. Killed programs may have left files of these names: in containers,
        /// programs often have the same process number.
        const TRIES: usize = 1_000;
        let mut begun = Err(there_already());
        for _ in 0..TRIES {
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            // The name leaves out the file's own name, which may already have the maximum length.
            let name = format!(".simd-{}-{number}.new", std::process::id());
            begun = Self::beside(path, |path| path.with_file_name(&name));
            if !matches!(&begun, Err(error) if error.kind() == ErrorKind::AlreadyExists) {
                break;
            }
        }
        begun
    }

    /// Begins a file at a path at which nothing exists, and nothing may exist when it is finished.
    ///
    /// # Errors
    /// Returns an error if something exists there, or if the folder is not writable.
    pub fn begin_new(path: &Path) -> io::Result<Self> {
        if fs::symlink_metadata(path).is_ok() {
            return Err(there_already());
        }
        let mut file = Self::begin(path)?;
        file.is_new = true;
        Ok(file)
    }

    /// Like [`begin`](Self::begin), for a file that only this program writes, on one thread at a time. The
    /// temporary file is `FILE.new`; one that a killed program left there is deleted.
    ///
    /// # Errors
    /// As [`begin`](Self::begin).
    pub fn begin_alone(path: &Path) -> io::Result<Self> {
        const SUFFIX: &str = ".new";
        match fs::remove_file(with_suffix(&followed(path), SUFFIX)) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
            _ => Self::beside(path, |path| with_suffix(path, SUFFIX)),
        }
    }

    /// Takes the permissions of other users before anything is written.
    ///
    /// # Errors
    /// Returns an error if the system refuses.
    #[cfg_attr(not(unix), allow(clippy::unnecessary_wraps, reason = "only Unix has modes"))]
    pub fn make_private(&self) -> io::Result<()> {
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            self.file.set_permissions(fs::Permissions::from_mode(0o600))?;
        }
        Ok(())
    }

    fn beside(path: &Path, beside: impl FnOnce(&Path) -> PathBuf) -> io::Result<Self> {
        let before = match fs::metadata(path) {
            Ok(before) => Some(before),
            Err(error) if error.kind() == ErrorKind::NotFound => None,
            Err(error) => return Err(error),
        };
        let Some(before) = before else {
            if fs::symlink_metadata(path).is_ok() {
                return Self::in_place(path);
            }
            let beside = beside(path);
            let file = created(&beside, None)?;
            return Ok(Self { file, path: path.to_owned(), beside: Some(beside), is_new: false });
        };
        if !before.is_file() || is_stream(&before) {
            return Self::in_place(path);
        }
        let path = followed(path);
        // A file without write permission must not be replaced, even if its folder would allow it.
        OpenOptions::new().write(true).open(&path)?;
        let beside = beside(&path);
        let file = match created(&beside, Some(&before)) {
            Err(error)
                if matches!(error.kind(), ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem) =>
            {
                return Self::in_place(&path);
            }
            created => created?,
        };
        let replacement = Self { file, path, beside: Some(beside), is_new: false };
        if give_owner(&replacement.file, &before).is_err() {
            return Self::in_place(&replacement.path);
        }
        // Permissions come after the owner: a change of the owner clears some of them.
        replacement.file.set_permissions(before.permissions())?;
        Ok(replacement)
    }

    fn in_place(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().write(true).create(true).truncate(true).open(path)?;
        Ok(Self { file, path: path.to_owned(), beside: None, is_new: false })
    }

    /// Puts the file in its place, once it is completely on the disk.
    ///
    /// # Errors
    /// Returns an error if the disk is full, or if the file cannot be put there. The old file does not change
    /// then, unless it was written in place.
    pub fn finish(mut self) -> io::Result<()> {
        let Some(beside) = self.beside.clone() else {
            return if self.file.metadata()?.is_file() { self.file.sync_all() } else { Ok(()) };
        };
        self.file.sync_all()?;
        // Linking fails if something exists there; renaming would not.
        let is_linked = self.is_new
            && match fs::hard_link(&beside, &self.path) {
                Ok(()) => true,
                Err(_) if fs::symlink_metadata(&self.path).is_ok() => return Err(there_already()),
                // The file system does not support links.
                Err(_) => false,
            };
        if is_linked {
            fs::remove_file(&beside)?;
        } else {
            match fs::rename(&beside, &self.path) {
                // A file that is itself a mount point, as in a container.
                Err(error) if error.kind() == ErrorKind::ResourceBusy => {
                    fs::copy(&beside, &self.path)?;
                    File::open(&self.path)?.sync_all()?;
                    fs::remove_file(&beside)?;
                }
                renamed => renamed?,
            }
        }
        self.beside = None;
        // Syncs the folder too, so that the name is on the disk, if the system supports it.
        let folder = self.path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Ok(folder) = File::open(folder.unwrap_or(Path::new("."))) {
            let _ = folder.sync_all();
        }
        Ok(())
    }
}

impl Write for Replacement {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Drop for Replacement {
    fn drop(&mut self) {
        if let Some(beside) = &self.beside {
            // The rest would take space on a full disk.
            let _ = fs::remove_file(beside);
        }
    }
}

/// Replaces a file, or writes a new one: see [`Replacement::begin`].
///
/// # Errors
/// Returns an error if it cannot be written. The old file does not change then, unless it is written in
/// place.
pub fn replace_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = Replacement::begin(path)?;
    file.write_all(bytes)?;
    file.finish()
}

/// Returns a new file. Until it has the owner and permissions of the old file, only its owner has
/// permissions, and no more than before.
#[cfg_attr(not(unix), allow(unused_variables, reason = "only Unix has modes"))]
fn created(path: &Path, before: Option<&Metadata>) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    if let Some(before) = before {
        use std::os::unix::fs::{OpenOptionsExt as _, PermissionsExt as _};
        options.mode(before.permissions().mode() & 0o600);
    }
    options.open(path)
}

/// Returns whether standard input, output or error is this file: then another program may replace it.
fn is_stream(file: &Metadata) -> bool {
    #[cfg(unix)]
    {
        use std::os::fd::{AsFd as _, BorrowedFd};
        use std::os::unix::fs::MetadataExt as _;
        let is_it = |stream: BorrowedFd<'_>| {
            let stream = stream.try_clone_to_owned().and_then(|stream| File::from(stream).metadata());
            stream.is_ok_and(|stream| (stream.dev(), stream.ino()) == (file.dev(), file.ino()))
        };
        is_it(io::stdin().as_fd()) || is_it(io::stdout().as_fd()) || is_it(io::stderr().as_fd())
    }
    #[cfg(not(unix))]
    {
        let _ = file;
        false
    }
}

/// Gives a file the owner and the group of another file.
#[cfg_attr(not(unix), allow(unused_variables, clippy::unnecessary_wraps, reason = "only Unix has owners"))]
fn give_owner(file: &File, before: &Metadata) -> io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        let own = file.metadata()?;
        if (own.uid(), own.gid()) != (before.uid(), before.gid()) {
            std::os::unix::fs::fchown(file, Some(before.uid()), Some(before.gid()))?;
        }
    }
    Ok(())
}

/// Returns the target of a path, or the path itself if nothing exists there.
fn followed(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

/// Returns a path with `suffix` appended.
pub fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

fn there_already() -> io::Error {
    io::Error::new(ErrorKind::AlreadyExists, "the file already exists")
}

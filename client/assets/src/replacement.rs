//! Files that take the place of others once they are whole: a program that is killed meanwhile, and a disk that is full, leave those
//! before, but for those that have to be written in place.

#[cfg(test)]
mod tests;

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// A file that is written beside the one that it replaces. Where it is dropped before [`finish`](Self::finish), it goes again, and
/// the one before stays as it was.
#[derive(Debug)]
pub struct Replacement {
    file: File,
    /// What it replaces, with links followed: a link goes on leading to the file.
    path: PathBuf,
    /// Where it is until then; none of what can be written in place alone.
    beside: Option<PathBuf>,
    /// Whether there must be none before.
    is_new: bool,
}

impl Replacement {
    /// Begins a file in place of the one there, or of none. It has the owner and the permissions of the one before, else those that
    /// the process gives its files. Written in place is what is no file, such as a pipe or `/dev/full`; what a standard stream
    /// goes to; what a link without an end leads to; and a file that may be written where another one of its owner may not
    /// be put beside it.
    ///
    /// # Errors
    /// Returns an error if the one before may not be written, and where there is none and the folder takes none.
    pub fn begin(path: &Path) -> io::Result<Self> {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        /// Names that programs with the same number, as each has in a container, may have left when they were killed.
        const TRIES: usize = 1_000;
        let mut begun = Err(there_already());
        for _ in 0..TRIES {
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            // Without the file's own name, to which nothing may fit.
            let name = format!(".simd-{}-{number}.new", std::process::id());
            begun = Self::beside(path, |path| path.with_file_name(&name));
            if !matches!(&begun, Err(error) if error.kind() == ErrorKind::AlreadyExists) {
                break;
            }
        }
        begun
    }

    /// The same for a path at which there is nothing, also once it is finished.
    ///
    /// # Errors
    /// Returns an error if something is there, and where the folder takes no file.
    pub fn begin_new(path: &Path) -> io::Result<Self> {
        if fs::symlink_metadata(path).is_ok() {
            return Err(there_already());
        }
        let mut file = Self::begin(path)?;
        file.is_new = true;
        Ok(file)
    }

    /// The same as [`begin`](Self::begin) for a file that no other program writes, and this one on one thread at a time: it is
    /// `FILE.new` until it is finished, and what a program that was killed has left there goes.
    ///
    /// # Errors
    /// As there.
    pub fn begin_alone(path: &Path) -> io::Result<Self> {
        const SUFFIX: &str = ".new";
        match fs::remove_file(with_suffix(&followed(path), SUFFIX)) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
            _ => Self::beside(path, |path| with_suffix(path, SUFFIX)),
        }
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
        // A file that may not be written may not be replaced either, though its folder would allow it.
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
        // After the owner, whom they are lost with.
        replacement.file.set_permissions(before.permissions())?;
        Ok(replacement)
    }

    fn in_place(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().write(true).create(true).truncate(true).open(path)?;
        Ok(Self { file, path: path.to_owned(), beside: None, is_new: false })
    }

    /// Puts it in its place, once all of it is on the disk.
    ///
    /// # Errors
    /// Returns an error if the disk takes no more, and where it may not be put there: then the one before stays as it was, unless it was
    /// written in place.
    pub fn finish(mut self) -> io::Result<()> {
        let Some(beside) = self.beside.clone() else {
            return if self.file.metadata()?.is_file() { self.file.sync_all() } else { Ok(()) };
        };
        self.file.sync_all()?;
        // To link fails where something is there, which to rename does not.
        let is_linked = self.is_new
            && match fs::hard_link(&beside, &self.path) {
                Ok(()) => true,
                Err(_) if fs::symlink_metadata(&self.path).is_ok() => return Err(there_already()),
                // The file system has no links.
                Err(_) => false,
            };
        if is_linked {
            fs::remove_file(&beside)?;
        } else {
            match fs::rename(&beside, &self.path) {
                // A file that is mounted by itself, as into a container.
                Err(error) if error.kind() == ErrorKind::ResourceBusy => {
                    fs::copy(&beside, &self.path)?;
                    File::open(&self.path)?.sync_all()?;
                    fs::remove_file(&beside)?;
                }
                renamed => renamed?,
            }
        }
        self.beside = None;
        // The name is on the disk too, where the system can say so of a folder.
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
            // What is there takes room on a disk that is full.
            let _ = fs::remove_file(beside);
        }
    }
}

/// Writes a whole file in place of the one there, or of none: see [`Replacement::begin`].
///
/// # Errors
/// Returns an error if it cannot be written; the one before stays as it was then, unless it is one of those that are written in place.
pub fn replace_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = Replacement::begin(path)?;
    file.write_all(bytes)?;
    file.finish()
}

/// A new file, which allows its owner alone what the one before does until it has that one's owner and permissions.
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

/// Whether standard input, output or error is this file: then it is another program's to replace.
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

/// Gives a file the owner and the group of another.
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

/// Where a path leads to; the path itself where there is nothing.
fn followed(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

/// A path with more at its end.
pub fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

fn there_already() -> io::Error {
    io::Error::new(ErrorKind::AlreadyExists, "a file is there already")
}

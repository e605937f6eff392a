//! Opens files: only regular ones, without waiting for pipes, and with a limit of bytes. The daemon opens all files
//! here that others may have put there.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

/// Maximum number of names for files that are put aside.
const ASIDES: usize = 100;

/// Opens a file that the operator named, or that was looked for below a root, also through a link.
///
/// # Errors
/// Returns an error if it cannot be opened, or is a pipe, a device or a folder.
pub fn open(path: &Path) -> io::Result<File> {
    regular(options().open(path)?)
}

/// Opens a file by its name in a folder where other users may put files: a link there may lead out of it.
///
/// # Errors
/// As [`open`], and if it is a link.
pub fn open_in(folder: &Path, name: &str) -> io::Result<File> {
    let path = folder.join(name);
    if fs::symlink_metadata(&path)?.is_symlink() {
        return Err(io::Error::other("it is a link, and may lead out of its folder"));
    }
    let mut options = options();
    #[cfg(target_os = "linux")]
    add_flags(&mut options, rustix::fs::OFlags::NOFOLLOW | rustix::fs::OFlags::NONBLOCK);
    regular(options.open(&path)?)
}

/// Reads all of an open file.
///
/// # Errors
/// Returns an error if it has more bytes than the limit, even if it grows while it is read.
pub fn read(file: File, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.take(limit + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > limit {
        true => Err(io::Error::new(io::ErrorKind::FileTooLarge, format!("it has more than {limit} bytes"))),
        false => Ok(bytes),
    }
}

/// Reads a text that the operator named.
///
/// # Errors
/// As [`open`] and [`read`], and if it is not UTF-8.
pub fn read_text(path: &Path, limit: u64) -> io::Result<String> {
    let bytes = read(open(path)?, limit)?;
    String::from_utf8(bytes).map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8"))
}

/// Renames a file to `FILE.unusable`, with a number if that exists already. Returns the new name.
///
/// # Errors
/// Returns an error if it cannot be renamed, or too many such files exist.
pub fn put_aside(path: &Path) -> io::Result<PathBuf> {
    let names = (1..=ASIDES).map(|number| match number {
        1 => ".unusable".to_owned(),
        number => format!(".unusable.{number}"),
    });
    for suffix in names {
        let mut name = path.as_os_str().to_owned();
        name.push(suffix);
        let aside = PathBuf::from(name);
        if fs::symlink_metadata(&aside).is_err() {
            return fs::rename(path, &aside).map(|()| aside);
        }
    }
    Err(io::Error::new(
        io::ErrorKind::AlreadyExists,
        format!("{ASIDES} files were put aside before; delete some"),
    ))
}

/// Returns options for reading, without waiting for a pipe's writer.
fn options() -> OpenOptions {
    let mut options = File::options();
    options.read(true);
    #[cfg(target_os = "linux")]
    add_flags(&mut options, rustix::fs::OFlags::NONBLOCK);
    options
}

#[cfg(target_os = "linux")]
fn add_flags(options: &mut OpenOptions, flags: rustix::fs::OFlags) {
    use std::os::unix::fs::OpenOptionsExt as _;
    options.custom_flags(i32::try_from(flags.bits()).unwrap_or_default());
}

fn regular(file: File) -> io::Result<File> {
    match file.metadata()?.is_file() {
        true => Ok(file),
        false => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "it is not a file, but a pipe, a device or a folder",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn pipes_are_refused_at_once_and_links_in_a_folder_too() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let made = std::process::Command::new("mkfifo").arg(path("pipe")).status().unwrap();
        assert!(made.success());
        fs::write(path("file"), "text").unwrap();
        std::os::unix::fs::symlink(path("file"), path("link")).unwrap();
        for name in ["pipe", "."] {
            let refused = open_in(folder.path(), name).unwrap_err();
            assert!(refused.to_string().starts_with("it is not a file"), "{name}: {refused}");
            open(&path(name)).unwrap_err();
        }
        let refused = open_in(folder.path(), "link").unwrap_err();
        assert!(refused.to_string().starts_with("it is a link"), "{refused}");
        assert_eq!(read(open(&path("link")).unwrap(), 4).unwrap(), b"text", "an operator may link");
        assert_eq!(read(open_in(folder.path(), "file").unwrap(), 4).unwrap(), b"text");
        read(open(&path("file")).unwrap(), 3).unwrap_err();
    }

    #[test]
    fn files_that_are_put_aside_replace_none_that_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("world");
        let mut asides = Vec::new();
        for text in ["first", "second", "third"] {
            fs::write(&path, text).unwrap();
            asides.push(put_aside(&path).unwrap());
        }
        assert!(!path.exists());
        let kept: Vec<_> = asides.iter().map(|aside| fs::read_to_string(aside).unwrap()).collect();
        assert_eq!(kept, ["first", "second", "third"]);
        assert!(asides[2].ends_with("world.unusable.3"), "{asides:?}");
    }
}

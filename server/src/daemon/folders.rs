//! Folders that the daemon writes to, judged before it starts: one that takes no file would lose the world at the end of a run.

use std::fs::{self, OpenOptions};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::Error;
use crate::config::Config;

/// Checks the folders that the configuration names.
///
/// # Errors
/// Returns an error for the first folder that is missing or takes no file.
pub(super) fn judge(config: &Config) -> Result<(), Error> {
    let recordings = &config.recording;
    if let Some(folder) = recordings.directory.as_deref().filter(|_| !recordings.is_made) {
        takes_files(folder).map_err(|source| refused("recording.directory", folder, source))?;
    }
    match config.autosave.as_ref().filter(|autosave| !autosave.is_made) {
        Some(autosave) => takes(&autosave.file),
        None => Ok(()),
    }
}

/// Makes the folder of the autosave, if the configuration leaves it to the daemon.
///
/// # Errors
/// Returns an error if the folder cannot be made, or takes no file.
pub(super) fn make(config: &Config) -> Result<(), Error> {
    let Some(autosave) = config.autosave.as_ref().filter(|autosave| autosave.is_made) else { return Ok(()) };
    let folder = folder_of(&autosave.file);
    fs::create_dir_all(folder)
        .and_then(|()| takes_files(folder))
        .map_err(|source| refused("autosave.file", folder, source))
}

/// Checks that a file may be written, also if its folder takes no other one. A pipe is refused: opening it
/// would wait for its reader.
fn takes(file: &Path) -> Result<(), Error> {
    let folder = folder_of(file);
    let written = match fs::metadata(file) {
        Err(error) if error.kind() == ErrorKind::NotFound => takes_files(folder),
        Err(error) => Err(error),
        Ok(metadata) if !metadata.is_file() => {
            let source = io::Error::other("it is not a file, but a pipe, a device or a folder");
            return Err(refused("autosave.file", file, source));
        }
        Ok(_) => OpenOptions::new().write(true).open(file).map(drop),
    };
    written.map_err(|source| refused("autosave.file", folder, source))
}

/// Writes a file without a name, since permissions do not tell of file systems that are read only.
fn takes_files(folder: &Path) -> io::Result<()> {
    fs::read_dir(folder)?;
    tempfile::tempfile_in(folder).map(drop)
}

fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn refused(key: &'static str, folder: &Path, source: io::Error) -> Error {
    Error::Folder { key, folder: PathBuf::from(folder), source }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Autosave;
    use std::time::Duration;

    fn with_autosave(file: PathBuf, is_made: bool) -> Config {
        let every = Duration::from_secs(60);
        Config { autosave: Some(Autosave { file, every, restore: false, is_made }), ..Config::default() }
    }

    #[test]
    fn folders_that_are_missing_or_no_folders_are_refused_under_their_key() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("file");
        fs::write(&file, "text").unwrap();
        for folder in [home.path().join("missing"), file.clone()] {
            let mut config = Config::default();
            config.recording.directory = Some(folder.clone());
            let sentence = judge(&config).unwrap_err().to_string();
            let begin = format!("recording.directory: {}: ", folder.display());
            assert!(sentence.starts_with(&begin), "{sentence}");
            let sentence = judge(&with_autosave(folder.join("world"), false)).unwrap_err().to_string();
            assert!(sentence.starts_with("autosave.file: "), "{sentence}");
        }
        judge(&with_autosave(file.clone(), false)).unwrap();
        assert_eq!(fs::read_to_string(file).unwrap(), "text", "a look changes no file");
        assert_eq!(fs::read_dir(home.path()).unwrap().count(), 1, "and leaves none");
    }

    #[cfg(unix)]
    #[test]
    fn an_autosave_that_is_not_a_file_is_refused_at_once() {
        let home = tempfile::tempdir().unwrap();
        let pipe = home.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for path in [pipe, home.path().to_owned()] {
            let sentence = judge(&with_autosave(path.clone(), false)).unwrap_err().to_string();
            let said = format!("autosave.file: {}: it is not a file", path.display());
            assert!(sentence.starts_with(&said), "{sentence}");
        }
    }

    #[test]
    fn the_folder_of_a_default_is_made_at_the_start_and_not_by_a_check() {
        let home = tempfile::tempdir().unwrap();
        let config = with_autosave(home.path().join("simd/world"), true);
        judge(&config).unwrap();
        assert!(!home.path().join("simd").exists());
        make(&config).unwrap();
        assert!(home.path().join("simd").is_dir());
    }
}

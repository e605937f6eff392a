//! The recordings in the daemon's folder: their list, contents and bytes, and their end.

use std::fs;
use std::path::Path;

use simd_assets::files;

use super::{
    RecordingContents, RecordingInfo, RecordingState, Recordings, impossible, names, reading, unusable,
};
use crate::call_error::CallError;

impl Recordings {
    /// Returns all recordings, by name.
    ///
    /// # Errors
    /// Returns an error if no folder is configured, or it cannot be read.
    pub(crate) fn list(&self) -> Result<Vec<RecordingInfo>, CallError> {
        let directory = self.directory()?;
        let mut all = match list(directory) {
            // The first recording makes it.
            Err(error) if self.settings.is_made && error.kind() == std::io::ErrorKind::NotFound => Vec::new(),
            listed => listed.map_err(|error| unusable(directory, &error))?,
        };
        if let Some(running) = self.running() {
            let is_it = |info: &&mut RecordingInfo| *info.name == *running.name;
            if let Some(info) = all.iter_mut().find(is_it) {
                info.state = RecordingState::Recording;
            }
        }
        Ok(all)
    }

    /// Finds a recording by its name.
    ///
    /// # Errors
    /// Returns an error if the recording does not exist.
    pub(crate) fn find(&self, name: &str) -> Result<RecordingInfo, CallError> {
        let mut all = self.list()?;
        match all.iter().position(|info| info.name == name) {
            Some(index) => Ok(all.swap_remove(index)),
            None => {
                let known = all.into_iter().map(|info| info.name).collect();
                Err(CallError::RecordingNotFound { name: name.to_owned(), known })
            }
        }
    }

    /// Returns the contents of a recording's complete files.
    ///
    /// # Errors
    /// Returns an error if the recording does not exist, or cannot be read.
    pub(crate) fn contents(
        &self,
        info: &RecordingInfo,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Result<RecordingContents, CallError> {
        let directory = self.directory()?;
        let names = info.files.iter().map(|(name, _)| name.as_str());
        reading::contents(directory, names, is_cancelled).map_err(|error| unusable(directory, &error))
    }

    /// Returns a part of a recording's file, and the size of that file.
    ///
    /// # Errors
    /// Returns an error if the recording or the file does not exist, or cannot be read.
    pub(crate) fn read(
        &self,
        name: &str,
        file: &str,
        offset: u64,
        most: usize,
    ) -> Result<(Vec<u8>, u64), CallError> {
        use std::io::{Read as _, Seek as _, SeekFrom};
        let info = self.find(name)?;
        let directory = self.directory()?;
        // The name comes from the list of files, and not from the request.
        let found = match (file, &info.files[..]) {
            ("", [(only, _)]) => Some(only),
            _ => info.files.iter().map(|(there, _)| there).find(|there| *there == file),
        };
        let Some(found) = found else {
            let known: Vec<&str> = info.files.iter().map(|(there, _)| there.as_str()).collect();
            return Err(CallError::InvalidValue {
                element: "file".into(),
                value: format!("{file:?}"),
                expected: format!("it must be one of {}", known.join(", ")),
            });
        };
        let read = || {
            let mut file = files::open_in(directory, found)?;
            let total = file.metadata()?.len();
            let offset = offset.min(total);
            file.seek(SeekFrom::Start(offset))?;
            let mut data = Vec::new();
            file.take(most as u64).read_to_end(&mut data)?;
            Ok((data, total))
        };
        read().map_err(|error| unusable(directory, &error))
    }

    /// Deletes the files of a recording.
    ///
    /// # Errors
    /// Returns an error if the recording does not exist, runs, or a file cannot be deleted.
    pub(crate) fn delete(&self, name: &str) -> Result<(), CallError> {
        let info = self.find(name)?;
        if info.state == RecordingState::Recording {
            return Err(impossible(format!("recording {name:?} is being made; stop it first")));
        }
        let directory = self.directory()?;
        let delete = |(file, _): &(String, u64)| fs::remove_file(directory.join(file));
        info.files.iter().try_for_each(delete).map_err(|error| unusable(directory, &error))
    }
}

/// Returns the recordings in a folder.
pub(super) fn list(directory: &Path) -> std::io::Result<Vec<RecordingInfo>> {
    let mut all: Vec<RecordingInfo> = Vec::new();
    for (name, file) in names::files(directory)? {
        let metadata = match fs::symlink_metadata(directory.join(&file)) {
            // A link or a pipe is not a recording.
            Ok(metadata) if !metadata.is_file() => continue,
            Ok(metadata) => metadata,
            // A ring that is running deletes its oldest files.
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => continue,
            Err(error) => return Err(error),
        };
        let state = match reading::is_complete(directory, &file) {
            true => RecordingState::Complete,
            false => RecordingState::Unfinished,
        };
        let (bytes, modified) = (metadata.len(), metadata.modified().ok());
        match all.last_mut().filter(|last| last.name == name) {
            // Files are in order.
            Some(last) => {
                last.files.push((file, bytes));
                (last.state, last.modified) = (state, modified);
            }
            None => all.push(RecordingInfo { name, state, files: vec![(file, bytes)], modified }),
        }
    }
    Ok(all)
}

//! Recordings, which the daemon makes on its own disk.

use std::path::Path;

use simd_proto::v1::{
    DeleteRecordingRequest, GetRecordingRequest, GetRecordingResponse, ListRecordingsRequest,
    ReadRecordingRequest, Recording, StartRecordingRequest, StopRecordingRequest,
};

use crate::{Client, Error, client::present};

/// `RecordingService`.
impl Client {
    /// Starts a recording of every command from now on, with states of the world.
    ///
    /// # Errors
    /// `RECORDING_NOT_POSSIBLE` if the daemon has no folder for recordings or another recording runs,
    /// `RECORDING_EXISTS`, `INVALID_VALUE`, `LIMIT_EXCEEDED`.
    pub async fn start_recording(&self, request: StartRecordingRequest) -> Result<Recording, Error> {
        present(self.unary(self.recording_service().start_recording(request)).await?.recording, "recording")
    }

    /// Stops the recording of this name, or the running one if it is empty. Returns when its file is
    /// complete.
    ///
    /// # Errors
    /// `RECORDING_NOT_POSSIBLE` if no recording of that name runs.
    pub async fn stop_recording(&self, name: &str) -> Result<Recording, Error> {
        let request = StopRecordingRequest { name: name.to_owned(), ..Default::default() };
        present(self.unary(self.recording_service().stop_recording(request)).await?.recording, "recording")
    }

    /// Returns all recordings, by name.
    ///
    /// # Errors
    /// `RECORDING_NOT_POSSIBLE` if the daemon has no folder for recordings.
    pub async fn recordings(&self) -> Result<Vec<Recording>, Error> {
        Ok(self.unary(self.recording_service().list_recordings(ListRecordingsRequest {})).await?.recordings)
    }

    /// Returns one recording, and its contents.
    ///
    /// # Errors
    /// `RECORDING_NOT_FOUND`.
    pub async fn recording(&self, name: &str) -> Result<GetRecordingResponse, Error> {
        self.unary(self.recording_service().get_recording(GetRecordingRequest { name: name.to_owned() }))
            .await
    }

    /// Writes its files into a folder on this disk. Returns their names and their total size in bytes. Each
    /// file gets its name once it is complete.
    ///
    /// # Errors
    /// `RECORDING_NOT_FOUND`, and [`Error::Write`], also if a file already exists.
    pub async fn download_recording(&self, name: &str, folder: &Path) -> Result<(Vec<String>, u64), Error> {
        let recording = present(self.recording(name).await?.recording, "recording")?;
        let (mut names, mut bytes) = (Vec::new(), 0);
        for file in recording.files {
            // A name from the daemon must not lead out of the folder.
            let plain = Path::new(&file.name).file_name().is_some_and(|plain| *plain == *file.name);
            let path = folder.join(&file.name);
            let failed = |reason| Error::Write { path: path.clone(), reason };
            if !plain {
                return Err(failed(std::io::ErrorKind::InvalidFilename.into()));
            }
            let mut out = simd_assets::Replacement::begin_new(&path).map_err(failed)?;
            let mut offset = 0;
            while offset < file.bytes {
                let request = ReadRecordingRequest {
                    name: name.to_owned(),
                    file: file.name.clone(),
                    offset,
                    max_bytes: file.bytes - offset,
                };
                let part = self.unary(self.recording_service().read_recording(request)).await?.data;
                if part.is_empty() {
                    break;
                }
                std::io::Write::write_all(&mut out, &part).map_err(failed)?;
                offset += part.len() as u64;
            }
            out.finish().map_err(failed)?;
            bytes += offset;
            names.push(file.name);
        }
        Ok((names, bytes))
    }

    /// Deletes its files.
    ///
    /// # Errors
    /// `RECORDING_NOT_FOUND`, `RECORDING_NOT_POSSIBLE` while it runs.
    pub async fn delete_recording(&self, name: &str) -> Result<(), Error> {
        let request = DeleteRecordingRequest { name: name.to_owned(), ..Default::default() };
        self.unary(self.recording_service().delete_recording(request)).await.map(drop)
    }
}

//! Recordings, which the daemon makes on its own disk.

use std::path::Path;

use simd_proto::v1::{
    DeleteRecordingRequest, GetRecordingRequest, GetRecordingResponse, ListRecordingsRequest,
    ReadRecordingRequest, Recording, StartRecordingRequest, StopRecordingRequest,
};

use crate::{Client, Error, client::present};

/// `RecordingService`.
impl Client {
    /// Begins a recording: every command from now on, and what the world looks like.
    ///
    /// # Errors
    /// `RECORDING_NOT_POSSIBLE` where the daemon has no folder for recordings or makes one already, `RECORDING_EXISTS`,
    /// `INVALID_VALUE`, `LIMIT_EXCEEDED`.
    pub async fn start_recording(&self, request: StartRecordingRequest) -> Result<Recording, Error> {
        present(self.unary(self.recording_service().start_recording(request)).await?.recording, "recording")
    }

    /// Ends the recording of this name, or whichever is being made where it is empty. The answer comes when its file is complete.
    ///
    /// # Errors
    /// `RECORDING_NOT_POSSIBLE` where none of that name is being made.
    pub async fn stop_recording(&self, name: &str) -> Result<Recording, Error> {
        let request = StopRecordingRequest { name: name.to_owned(), ..Default::default() };
        present(self.unary(self.recording_service().stop_recording(request)).await?.recording, "recording")
    }

    /// Those there are, by name.
    ///
    /// # Errors
    /// `RECORDING_NOT_POSSIBLE` where the daemon has no folder for recordings.
    pub async fn recordings(&self) -> Result<Vec<Recording>, Error> {
        Ok(self.unary(self.recording_service().list_recordings(ListRecordingsRequest {})).await?.recordings)
    }

    /// One of them, and what is in it.
    ///
    /// # Errors
    /// `RECORDING_NOT_FOUND`.
    pub async fn recording(&self, name: &str) -> Result<GetRecordingResponse, Error> {
        self.unary(self.recording_service().get_recording(GetRecordingRequest { name: name.to_owned() }))
            .await
    }

    /// Writes its files into a folder on this disk; gives their names and how many bytes they are together. Each has its name once
    /// it is whole.
    ///
    /// # Errors
    /// `RECORDING_NOT_FOUND`, and [`Error::Write`], also where a file is there already.
    pub async fn download_recording(&self, name: &str, folder: &Path) -> Result<(Vec<String>, u64), Error> {
        let recording = present(self.recording(name).await?.recording, "recording")?;
        let (mut names, mut bytes) = (Vec::new(), 0);
        for file in recording.files {
            // The daemon's word for it leads nowhere else.
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
    /// `RECORDING_NOT_FOUND`, `RECORDING_NOT_POSSIBLE` while it is being made.
    pub async fn delete_recording(&self, name: &str) -> Result<(), Error> {
        let request = DeleteRecordingRequest { name: name.to_owned(), ..Default::default() };
        self.unary(self.recording_service().delete_recording(request)).await.map(drop)
    }
}

//! Export and import of saved states, as files on this disk.

use std::path::Path;

use sha2::{Digest as _, Sha256};
use simd_proto::v1::{ExportSavedStateRequest, ImportSavedStateRequest, SavedStateInfo};

use crate::{
    Client, Error,
    client::present,
    upload::{hash_of, hexadecimal, off_the_runtime},
};

/// The part of `SimulationService` that needs a disk.
impl Client {
    /// Writes a saved state, with all files of its robots, into a file on this disk. An existing file is
    /// replaced once the new one is complete. Returns its size in bytes.
    ///
    /// # Errors
    /// `SAVED_STATE_NOT_FOUND`; `LIMIT_EXCEEDED` if the robots' meshes are larger than a file may be;
    /// [`Error::Write`].
    pub async fn export_saved_state(&self, name: &str, file: impl AsRef<Path>) -> Result<u64, Error> {
        let request = ExportSavedStateRequest { name: name.to_owned() };
        let export = self.unary_while_alive(self.simulation().export_saved_state(request)).await?;
        let bytes = self.asset(&export.sha256).await?;
        if hexadecimal(&Sha256::digest(&bytes)) != export.sha256 {
            return Err(Error::Answer { reason: "the file does not have the announced hash".to_owned() });
        }
        let path = file.as_ref().to_path_buf();
        let to = path.clone();
        let written = off_the_runtime(move || simd_assets::replace_file(&to, &bytes)).await;
        written.map(|()| export.total_bytes).map_err(|reason| Error::Write { path, reason })
    }

    /// Keeps the saved state of a file on this disk in the daemon's memory. The world does not change:
    /// [`restore_state`](Self::restore_state) restores the state. An empty name keeps the state's own name; a
    /// saved state of that name is replaced.
    ///
    /// # Errors
    /// * [`Error::File`].
    /// * `INVALID_SAVED_STATE` if the file is not a saved state, is damaged or has a newer format, or if this
    ///   daemon reads its robots differently.
    /// * `LIMIT_EXCEEDED`, `OWNED_BY_ANOTHER`.
    pub async fn import_saved_state(
        &self,
        file: impl AsRef<Path>,
        name: &str,
    ) -> Result<SavedStateInfo, Error> {
        let path = file.as_ref();
        let unreadable = |reason| Error::File { path: path.to_path_buf(), reason };
        let sha256 = hash_of(path).await.map_err(unreadable)?;
        self.send(path, &sha256).await?;
        let (name, take_over) = (name.to_owned(), self.takes_over);
        let request = ImportSavedStateRequest { sha256, name, take_over, ..Default::default() };
        let request = self.claimed(request);
        let answer = self.unary_while_alive(self.simulation().import_saved_state(request)).await?;
        present(answer.saved_state, "saved_state")
    }
}

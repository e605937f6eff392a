//! Saved states to files and from them.

use std::sync::Arc;

use bytes::Bytes;
use simd_core::simulation::command::SavedStateInfo;
use simd_core::{Command, Reply};
use simd_model::robot::Sha256;

use super::{CallError, SimHandle};

impl SimHandle {
    /// Writes a saved state into a file, which is kept as an upload is; gives its hash and size.
    ///
    /// # Errors
    /// Where there is no such state, and where the file would be larger than an upload may be.
    pub async fn export_saved_state(&self, name: String) -> Result<(Sha256, u64), CallError> {
        let (sha256, file) = self.saved_state_file(&name).await?;
        let size = file.len() as u64;
        self.loader().insert(sha256, file)?;
        Ok((sha256, size))
    }

    /// A saved state as a file, with its hash.
    ///
    /// # Errors
    /// Where there is no such state, and where the file would be larger than an upload may be.
    pub(crate) async fn saved_state_file(&self, name: &str) -> Result<(Sha256, Arc<[u8]>), CallError> {
        let state = self.newest();
        let kept = state.state.saved(name)?;
        let (info, saved) = (kept.info(), kept.saved().clone());
        drop(state);
        self.loader().write_saved_state(info.name, saved).await
    }

    /// Keeps the state that is in an uploaded file, under this name or, where it is empty, under the
    /// one that it had.
    ///
    /// # Errors
    /// Where the file was not uploaded, is not a saved state or is damaged, and where its robots cannot be read as they were.
    pub async fn import_saved_state(
        &self,
        sha256: Sha256,
        name: String,
    ) -> Result<SavedStateInfo, CallError> {
        let file = self.loader().asset(&sha256);
        let lacking = || CallError::AssetNotUploaded { uri: String::new(), sha256: sha256.to_string() };
        self.import_saved_state_file(file.ok_or_else(lacking)?, name).await
    }

    /// The same of a file in memory.
    ///
    /// # Errors
    /// Where the file is not a saved state or is damaged, and where its robots cannot be read as they were.
    pub(crate) async fn import_saved_state_file(
        &self,
        file: Bytes,
        name: String,
    ) -> Result<SavedStateInfo, CallError> {
        let (name, saved) = self.loader().read_saved_state(file, name).await?;
        let done = self.command(Command::ImportSavedState { name, saved }).await?;
        match done.applied.reply {
            Reply::SavedState(info) => Ok(info),
            other => Err(CallError::Internal { message: format!("this is not a saved state: {other:?}") }),
        }
    }
}

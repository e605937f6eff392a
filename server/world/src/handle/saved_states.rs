//! Saved states to files and from them.

use std::sync::Arc;

use bytes::Bytes;
use simd_core::simulation::command::SavedStateInfo;
use simd_core::{Command, Reply};
use simd_model::robot::Sha256;

use super::{CallError, Done, SimHandle};
use crate::driver::Event;

impl SimHandle {
    /// Writes a saved state into a file, which is kept as an upload is; gives its hash and size.
    ///
    /// # Errors
    /// Returns an error if there is no such state, and where the file would be larger than an upload may be.
    pub async fn export_saved_state(&self, name: String) -> Result<(Sha256, u64), CallError> {
        let (sha256, file) = self.saved_state_file(&name).await?;
        let size = file.len() as u64;
        self.loader().insert(sha256, file)?;
        Ok((sha256, size))
    }

    async fn saved_state_file(&self, name: &str) -> Result<(Sha256, Arc<[u8]>), CallError> {
        let state = self.newest();
        let kept = state.state.saved(name)?;
        let (info, saved) = (kept.info(), kept.saved().clone());
        drop(state);
        self.loader().write_saved_state(info.name, saved).await
    }

    /// The present state of the world as a file, in which it is called `name`; with the sequence of the published state of
    /// that moment. No saved state is made: clients may have all that there may be, and that name too.
    ///
    /// # Errors
    /// Returns an error if the file would be larger than an upload may be, and where the driver ended.
    pub async fn present_state_file(&self, name: &str) -> Result<(u64, Arc<[u8]>), CallError> {
        let (saved, published) = self.ask(|reply| Event::WholeState { reply }).await?;
        let (_, file) = self.loader().write_saved_state(name.to_owned(), saved).await?;
        Ok((published.sequence, file))
    }

    /// Makes the state in a file the present one. It is kept for that moment alone, under this name, and the limit of clients'
    /// saved states does not count it: before there are clients, the world has room for one.
    ///
    /// # Errors
    /// Returns an error if the file is not a saved state or is damaged, and where its robots cannot be read as they were.
    pub async fn restore_at_start(&self, file: Bytes, name: &str) -> Result<Done, CallError> {
        let (name, saved) = self.loader().read_saved_state(file, name.to_owned()).await?;
        self.post(Command::ImportSavedState { name: name.clone(), saved }).await?;
        let restored = self.post(Command::RestoreState { name: name.clone() }).await;
        self.post(Command::DeleteSavedState { name }).await?;
        restored
    }

    /// Keeps the state that is in an uploaded file, under this name or, where it is empty, under the
    /// one that it had.
    ///
    /// # Errors
    /// Returns an error if the file was not uploaded, is not a saved state or is damaged, and where its robots cannot be read as they were.
    pub async fn import_saved_state(
        &self,
        sha256: Sha256,
        name: String,
    ) -> Result<SavedStateInfo, CallError> {
        let file = self.loader().asset(&sha256);
        let lacking = || CallError::AssetNotUploaded { uri: String::new(), sha256: sha256.to_string() };
        let (name, saved) = self.loader().read_saved_state(file.ok_or_else(lacking)?, name).await?;
        let done = self.command(Command::ImportSavedState { name, saved }).await?;
        match done.applied.reply {
            Reply::SavedState(info) => Ok(info),
            other => Err(CallError::Internal { message: format!("this is not a saved state: {other:?}") }),
        }
    }
}

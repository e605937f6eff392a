//! Saved states in files.

use std::sync::Arc;

use bytes::Bytes;
use simd_core::simulation::command::SavedStateInfo;
use simd_core::{Command, Reply};
use simd_model::robot::Sha256;

use super::{CallError, Done, SimHandle};
use crate::driver::Event;

impl SimHandle {
    /// Writes a saved state into a file, which is stored like an upload; returns its hash and size.
    ///
    /// # Errors
    /// Returns an error if the state does not exist, or the file would exceed the limit of uploads.
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
        self.loader().write_saved_state(&self.call.account, info.name, saved).await
    }

    /// Returns the sequence of the present published state, and the state as a file, in which it is called
    /// `name`. No saved state is made: clients may have used up their limit, or use that name.
    ///
    /// # Errors
    /// Returns an error if the file would exceed the limit of uploads, or the driver has ended.
    pub async fn present_state_file(&self, name: &str) -> Result<(u64, Arc<[u8]>), CallError> {
        let (saved, published) = self.ask(|reply| Event::WholeState { reply }).await?;
        let (_, file) = self.loader().write_saved_state(&self.call.account, name.to_owned(), saved).await?;
        Ok((published.sequence, file))
    }

    /// Restores the state in a file. It is kept under this name only for that moment, and the limit of
    /// clients' saved states does not count it. Before there are clients, the world has room for one.
    ///
    /// # Errors
    /// Returns an error if the file is not a saved state or is damaged, or its robots cannot be read as they
    /// were.
    pub async fn restore_at_start(&self, file: Bytes, name: &str) -> Result<Done, CallError> {
        let (name, saved) = self.loader().read_saved_state(&self.call.account, file, name.to_owned()).await?;
        self.post(Command::ImportSavedState { name: name.clone(), saved }).await?;
        let restored = self.post(Command::RestoreState { name: name.clone() }).await;
        self.post(Command::DeleteSavedState { name }).await?;
        restored
    }

    /// Imports the saved state in an uploaded file under this name; an empty name keeps its old one.
    ///
    /// # Errors
    /// Returns an error if the file was not uploaded, is not a saved state, or is damaged. Also if its robots
    /// cannot be read as they were.
    pub async fn import_saved_state(
        &self,
        sha256: Sha256,
        name: String,
    ) -> Result<SavedStateInfo, CallError> {
        let file = self.loader().asset(&sha256);
        let lacking = || CallError::AssetNotUploaded { uri: String::new(), sha256: sha256.to_string() };
        let (name, saved) =
            self.loader().read_saved_state(&self.call.account, file.ok_or_else(lacking)?, name).await?;
        let done = self.command(Command::ImportSavedState { name, saved }).await?;
        match done.applied.reply {
            Reply::SavedState(info) => Ok(info),
            other => Err(CallError::Internal { message: format!("this is not a saved state: {other:?}") }),
        }
    }
}

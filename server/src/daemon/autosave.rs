//! The world in a file: written at intervals and at the drain, and read at the next start.

use std::io::{self, Write as _};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use simd_assets::{Replacement, files};

use crate::config::Autosave;
use simd_world::handle::{CallError, SimHandle};

/// Name of the state in its file. The world has no saved state with it: clients' names and limits are theirs.
const NAME: &str = "autosave";
/// Longest time of the last save, which is part of the drain.
const LAST: Duration = Duration::from_millis(700);

/// Reason why there is no file.
#[derive(Debug, thiserror::Error)]
enum Failed {
    #[error("{0}")]
    State(#[from] CallError),
    #[error("{0}")]
    File(#[from] io::Error),
}

/// Restores the world from the file. Returns whether there was one. An unusable file is moved aside with a
/// line in the log, and the daemon starts with its configuration.
pub(super) async fn restore(handle: &SimHandle, settings: &Autosave) -> bool {
    let path = &settings.file;
    let limit = handle.info().limits.asset_bytes;
    let read = {
        let path = path.clone();
        tokio::task::spawn_blocking(move || read(&path, limit)).await.map_err(io::Error::other).flatten()
    };
    let file = match read {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return false,
        Err(error) => return set_aside(path, &error),
    };
    match handle.restore_at_start(file.into(), NAME).await {
        Ok(done) => {
            let robots = handle.newest().state.roots.len();
            tracing::info!(file = %path.display(), robots, step = done.applied.at.step, "the world is as it was saved");
            true
        }
        Err(error) => set_aside(path, &error),
    }
}

/// Reads at most `limit` bytes.
fn read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    files::read(files::open(path)?, limit).map_err(|error| match error.kind() {
        io::ErrorKind::FileTooLarge => io::Error::other(format!("{error}, the limit is service.asset_bytes")),
        _ => error,
    })
}

fn set_aside(path: &Path, error: &dyn std::fmt::Display) -> bool {
    let moved = match files::put_aside(path) {
        Ok(aside) => format!("it is {} now", aside.display()),
        Err(error) => format!("it cannot be moved aside either: {error}"),
    };
    tracing::error!("the autosave {} cannot be used: {error}; {moved}", path.display());
    false
}

/// Writes the world each time that it has changed, until the daemon drains. The log reports the first
/// failure, and the next success.
pub(super) async fn keep(handle: SimHandle, settings: Autosave) {
    let mut timer = tokio::time::interval(settings.every);
    timer.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    timer.tick().await;
    let draining = handle.draining();
    let mut written = None;
    let mut is_failing = false;
    while draining.run_until_cancelled(timer.tick()).await.is_some() {
        if written.is_some_and(|written| handle.newest().sequence <= written) {
            continue;
        }
        // An older save must not replace the last one, which the drain writes.
        let saving = draining.run_until_cancelled(save(&handle, &settings.file));
        let Some(saved) = saving.await else { return };
        match saved {
            Ok(sequence) => {
                if std::mem::take(&mut is_failing) {
                    tracing::info!(file = %settings.file.display(), "the world is saved again");
                }
                written = Some(sequence);
            }
            Err(Failed::State(CallError::ShuttingDown)) => return,
            Err(error) if !is_failing => {
                is_failing = true;
                tracing::error!("the world is not saved to {}: {error}", settings.file.display());
            }
            Err(_) => {}
        }
    }
}

/// Writes the world for the last time, once no more calls arrive.
pub(super) async fn last(handle: &SimHandle, settings: &Autosave) {
    let file = settings.file.display();
    match tokio::time::timeout(LAST, save(handle, &settings.file)).await {
        Ok(Ok(_sequence)) => tracing::info!(%file, "the world is saved"),
        Ok(Err(error)) => tracing::error!("the world is not saved to {file}: {error}"),
        Err(_elapsed) => tracing::error!("the world is not saved to {file}: it takes too long"),
    }
}

/// Saves the world; returns the sequence of the written state.
async fn save(handle: &SimHandle, path: &Path) -> Result<u64, Failed> {
    let (sequence, file) = handle.present_state_file(NAME).await?;
    let path = path.to_owned();
    tokio::task::spawn_blocking(move || replace(&path, &file)).await.map_err(io::Error::other)??;
    Ok(sequence)
}

/// Locked while a file is written: the last save may begin while another one is on its way to the disk.
static WRITING: Mutex<()> = Mutex::new(());

/// Writes a new file, which replaces the old one once it is complete on the disk. Whenever the daemon
/// is killed, one of the two is complete.
fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let _alone = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    // A pipe that was put there may have no reader.
    if std::fs::metadata(path).is_ok_and(|there| !there.is_file()) {
        return Err(io::Error::other("it is not a file, but a pipe, a device or a folder"));
    }
    let mut file = Replacement::begin_alone(path)?;
    file.write_all(bytes)?;
    file.finish()
}

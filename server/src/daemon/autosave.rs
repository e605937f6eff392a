//! The world in a file: written as it runs and where the daemon drains, and read where it starts again.

use std::io::{self, Write as _};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use simd_assets::Replacement;

use crate::config::Autosave;
use simd_world::files;
use simd_world::handle::{CallError, SimHandle};

/// What the state is called in its file. The world has no saved state of it: clients' names and limits are theirs.
const NAME: &str = "autosave";
/// How long the last one may take, of the time in which a daemon drains.
const LAST: Duration = Duration::from_millis(700);

/// Why there is no file.
#[derive(Debug, thiserror::Error)]
enum Failed {
    #[error("{0}")]
    State(#[from] CallError),
    #[error("{0}")]
    File(#[from] io::Error),
}

/// Puts the world back to what the file has. Says whether there was one. A file that cannot be used is moved aside, with a
/// line in the log, and the daemon starts as it is configured.
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

/// At most so many bytes.
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

/// Writes the world each time that it has changed, until the daemon drains. Where that fails, the log says so once, and
/// once more when it succeeds again.
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
        // The last one, which the drain writes, is not to be replaced by an older one.
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

/// Writes the world for the last time, once no more calls come.
pub(super) async fn last(handle: &SimHandle, settings: &Autosave) {
    let file = settings.file.display();
    match tokio::time::timeout(LAST, save(handle, &settings.file)).await {
        Ok(Ok(_sequence)) => tracing::info!(%file, "the world is saved"),
        Ok(Err(error)) => tracing::error!("the world is not saved to {file}: {error}"),
        Err(_elapsed) => tracing::error!("the world is not saved to {file}: it takes too long"),
    }
}

/// Gives the sequence of the state that was written.
async fn save(handle: &SimHandle, path: &Path) -> Result<u64, Failed> {
    let (sequence, file) = handle.present_state_file(NAME).await?;
    let path = path.to_owned();
    tokio::task::spawn_blocking(move || replace(&path, &file)).await.map_err(io::Error::other)??;
    Ok(sequence)
}

/// Held while a file is written: the last one may come while another is on its way to the disk.
static WRITING: Mutex<()> = Mutex::new(());

/// Writes a file beside the old one, which it replaces once all of it is on the disk: whenever the daemon is killed,
/// one of the two is there whole.
fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let _alone = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    let mut file = Replacement::begin_alone(path)?;
    file.write_all(bytes)?;
    file.finish()
}

//! The loop: ask the daemon for a picture to draw, draw it, send it. Several workers run at the same time, so
//! that one picture is drawn while another is sent.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use anyhow::{Context as _, bail};
use simd_client::proto::{PictureTask, PutPictureRequest};
use simd_client::{Client, Code, ConnectOptions, Error};
use tokio::sync::Mutex;
use tokio::task::JoinSet;

use crate::appearance::{AppearanceError, Appearances};
use crate::draw::DrawError;
use crate::drawing::Drawing;
use crate::task;

/// Time that the daemon waits for work: less than the five seconds after which it forgets a renderer.
const WAIT: Duration = Duration::from_secs(2);
/// Pause between tries while no daemon answers.
const FIRST_PAUSE: Duration = Duration::from_millis(250);
const LONGEST_PAUSE: Duration = Duration::from_secs(5);
/// Number of pictures in a row that the driver may fail at before the program ends. A service manager then
/// restarts it.
const MAX_FAILURES: u32 = 3;

/// Settings of the loop.
#[derive(Clone, Debug)]
pub(crate) struct Work {
    pub(crate) endpoint: String,
    pub(crate) connect: ConnectOptions,
    /// Name of this renderer.
    pub(crate) name: String,
    /// Pictures at the same time.
    pub(crate) workers: usize,
    /// GPU memory for meshes, bytes.
    pub(crate) mesh_bytes: u64,
    /// End after one picture.
    pub(crate) once: bool,
}

/// State that the workers share.
struct Shared {
    work: Work,
    client: Client,
    drawing: Drawing,
    /// One worker fetches new robots; the others most likely need them too.
    appearances: Mutex<Appearances>,
    failures: AtomicU32,
}

/// Draws until an error that waiting cannot solve; with `once`, one picture.
///
/// # Errors
/// Returns an error if the daemon refuses this client, or the GPU failed repeatedly.
pub(crate) async fn run(work: Work, drawing: Drawing) -> anyhow::Result<()> {
    let client = connect(&work).await?;
    tracing::info!("{} draws for the daemon at {}", work.name, work.endpoint);
    let appearances = Mutex::new(Appearances::new(client.clone(), drawing.clone(), work.mesh_bytes));
    let workers = if work.once { 1 } else { work.workers };
    let shared = Arc::new(Shared { work, client, drawing, appearances, failures: AtomicU32::new(0) });
    let mut all = JoinSet::new();
    for _ in 0..workers {
        all.spawn(worker(Arc::clone(&shared)));
    }
    match all.join_next().await {
        Some(ended) => ended.context("a task of this program ended")?,
        None => Ok(()),
    }
}

/// Connects; waits until a daemon answers.
async fn connect(work: &Work) -> anyhow::Result<Client> {
    let mut pause = Pause::default();
    loop {
        match Client::connect_with(&work.endpoint, work.connect.clone()).await {
            Ok(client) => return Ok(client),
            Err(error) if is_passing(&error) && !work.once => pause.after(&error).await,
            Err(error) => return Err(error.into()),
        }
    }
}

/// Draws one picture after the other.
async fn worker(shared: Arc<Shared>) -> anyhow::Result<()> {
    let mut pause = Pause::default();
    loop {
        match shared.client.next_picture(&shared.work.name, WAIT).await {
            Ok(Some(task)) => {
                pause = Pause::default();
                shared.draw(task).await?;
                if shared.work.once {
                    return Ok(());
                }
            }
            Ok(None) => pause = Pause::default(),
            Err(error) if is_passing(&error) => {
                // The daemon may be restarting, with other robots of the same names.
                shared.appearances.lock().await.forget_robots();
                pause.after(&error).await;
            }
            Err(error) => return Err(error.into()),
        }
    }
}

impl Shared {
    /// Draws a picture and sends it, or the reason why not. A failure that concerns only this picture is not
    /// an error.
    async fn draw(&self, task: PictureTask) -> anyhow::Result<()> {
        let name = &self.work.name;
        let answer = match self.drawn(&task).await {
            Ok(answer) => {
                self.failures.store(0, Ordering::Relaxed);
                answer
            }
            Err(AppearanceError::Daemon(error)) if is_passing(&error) => {
                tracing::warn!("a picture was not drawn: {error}");
                return Ok(());
            }
            Err(error) => {
                tracing::warn!("a picture was not drawn: {error}");
                if let AppearanceError::Draw(DrawError::Driver(reason)) = &error
                    && self.failures.fetch_add(1, Ordering::Relaxed) + 1 >= MAX_FAILURES
                {
                    bail!("{MAX_FAILURES} pictures in a row were not drawn: {reason}");
                }
                task::refusal(&task, name, error.to_string())
            }
        };
        match self.client.put_picture(answer).await {
            Ok(true) => tracing::debug!("drew a picture of {} x {} pixels", task.width, task.height),
            Ok(false) => tracing::debug!("a picture was drawn that is no longer waited for"),
            Err(error) => tracing::warn!("a picture was not sent: {error}"),
        }
        Ok(())
    }

    async fn drawn(&self, task: &PictureTask) -> Result<PutPictureRequest, AppearanceError> {
        let appearances = self.appearances.lock().await.of(&task.robots).await?;
        let scene = match task::scene(task, &appearances) {
            Ok(scene) => scene,
            Err(reason) => return Ok(task::refusal(task, &self.work.name, reason)),
        };
        let picture = self.drawing.draw(scene).await?;
        Ok(task::answer(task, &self.work.name, picture))
    }
}

/// Returns whether waiting may help.
fn is_passing(error: &Error) -> bool {
    let Some(code) = error.code() else { return false };
    match error {
        Error::Untrusted { .. } => false,
        _ => matches!(
            code,
            Code::Unavailable | Code::DeadlineExceeded | Code::ResourceExhausted | Code::Aborted
        ),
    }
}

/// A pause that grows with each use, up to a bound.
struct Pause(Duration);

impl Default for Pause {
    fn default() -> Self {
        Self(FIRST_PAUSE)
    }
}

impl Pause {
    async fn after(&mut self, error: &Error) {
        if self.0 == FIRST_PAUSE {
            tracing::warn!("{error}; trying again");
        }
        tokio::time::sleep(self.0).await;
        self.0 = (2 * self.0).min(LONGEST_PAUSE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_faults_that_a_returning_daemon_mends_are_waited_for() {
        let endpoint = || "lab:7400".to_owned();
        let reason = String::new;
        assert!(is_passing(&Error::Unreachable { endpoint: endpoint(), reason: reason() }));
        assert!(is_passing(&Error::TimedOut { endpoint: endpoint(), after: WAIT }));
        assert!(is_passing(&Error::StreamEnded { endpoint: endpoint() }));
        let (sentence, untrusted) = (String::new(), endpoint());
        assert!(!is_passing(&Error::Untrusted { endpoint: untrusted, sentence, reason: reason() }));
        assert!(!is_passing(&Error::Endpoint { endpoint: endpoint(), reason: reason() }));
        assert!(!is_passing(&Error::Certificate { reason: reason() }));
    }

    #[tokio::test(start_paused = true)]
    async fn pauses_grow_up_to_a_bound() {
        let error = Error::StreamEnded { endpoint: "lab:7400".to_owned() };
        let mut pause = Pause::default();
        let start = tokio::time::Instant::now();
        pause.after(&error).await;
        assert_eq!(start.elapsed(), FIRST_PAUSE);
        for _ in 0..10 {
            pause.after(&error).await;
        }
        assert_eq!(pause.0, LONGEST_PAUSE);
    }
}

//! The thread that draws. It takes pictures and meshes, and answers when they are done; all waits for the GPU
//! happen here.

use tokio::sync::{mpsc, oneshot};

use crate::draw::{DrawError, Renderer, Surface};
use crate::scene::{Mesh, Picture, Scene};

/// Maximum number of waiting jobs; the sender of another one waits.
const WAITING: usize = 16;

enum Job {
    Upload { mesh: Box<Mesh>, answer: oneshot::Sender<Result<Surface, DrawError>> },
    Draw { scene: Box<Scene>, answer: oneshot::Sender<Result<Picture, DrawError>> },
}

/// Handle of the thread. Cheap to clone; the thread ends with the last handle.
#[derive(Clone)]
pub(crate) struct Drawing(mpsc::Sender<Job>);

impl Drawing {
    /// Starts the thread. Also returns a receiver that is disconnected once the thread has freed the GPU.
    ///
    /// # Errors
    /// Returns an error if the system cannot start a thread.
    pub(crate) fn start(mut renderer: Renderer) -> std::io::Result<(Self, std::sync::mpsc::Receiver<()>)> {
        let (jobs, mut waiting) = mpsc::channel(WAITING);
        let (end, ended) = std::sync::mpsc::channel();
        std::thread::Builder::new().name("drawing".to_owned()).spawn(move || {
            while let Some(job) = waiting.blocking_recv() {
                // The sender may be gone; then the result is dropped.
                match job {
                    Job::Upload { mesh, answer } => drop(answer.send(renderer.upload(&mesh))),
                    Job::Draw { scene, answer } => drop(answer.send(renderer.draw(&scene))),
                }
            }
            drop(renderer);
            drop(end);
        })?;
        Ok((Self(jobs), ended))
    }

    /// Uploads a mesh to the GPU.
    pub(crate) async fn upload(&self, mesh: Mesh) -> Result<Surface, DrawError> {
        let (answer, answered) = oneshot::channel();
        self.ask(Job::Upload { mesh: Box::new(mesh), answer }, answered).await
    }

    /// Draws a picture.
    pub(crate) async fn draw(&self, scene: Scene) -> Result<Picture, DrawError> {
        let (answer, answered) = oneshot::channel();
        self.ask(Job::Draw { scene: Box::new(scene), answer }, answered).await
    }

    async fn ask<T>(
        &self,
        job: Job,
        answered: oneshot::Receiver<Result<T, DrawError>>,
    ) -> Result<T, DrawError> {
        let ended = || DrawError::Driver("the thread that draws has ended".to_owned());
        self.0.send(job).await.map_err(|_| ended())?;
        answered.await.map_err(|_| ended())?
    }
}

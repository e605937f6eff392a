//! Bringing robots in, as every front-end can ask for it.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use bytes::Bytes;
use simd_core::collision::{ConvexMesh, MeshShapes};
use simd_core::simulation::command::{Reload, Spawn};
use simd_core::{Command, Reply};
use simd_model::robot::{MeshAsset, Sha256};
use simd_model::{RobotModel, wire_name};
use tokio::sync::watch;
use tokio::time::Instant;

use super::partial;
use super::progress::{Phase, Progress, Reporter};
use super::reading::{Made, Making, Origin, Reading, summary};
use crate::handle::{
    AssetState, CallError, Loaded, Prepared, Reloaded, SimHandle, Source, SpawnRequest, Validated,
};

impl SimHandle {
    /// Keeps a description and says which of its files are lacking.
    ///
    /// # Errors
    /// Where it is too large or cannot be read at all.
    pub async fn prepare(
        &self,
        urdf: Bytes,
        assets: BTreeMap<String, Sha256>,
    ) -> Result<Prepared, CallError> {
        let loader = self.loader();
        loader.check_description(urdf.len())?;
        let reading = loader.limits.reading;
        let (described, description, urdf) = loader
            .off_thread(move || {
                let urdf: Arc<[u8]> = Arc::from(&urdf[..]);
                (simd_model::describe(&urdf, &reading), Sha256::of(&urdf), urdf)
            })
            .await?;
        let described = described.map_err(refused)?;
        loader.insert(description, urdf)?;
        let shelf = loader.lock();
        let state = |uri: String| {
            let state = match assets.get(&uri) {
                None => AssetState::Unresolved,
                Some(sha256) if shelf.store.contains(sha256) => AssetState::Present,
                Some(_) => AssetState::Lacking,
            };
            (uri, state)
        };
        let assets = described.asset_uris.into_iter().map(state).collect();
        Ok(Prepared { description, name: wire_name(&described.name), assets })
    }

    /// Takes a part of a file; gives how much of it is here.
    ///
    /// # Errors
    /// Where the file is too large, where parts do not fit, and where the whole
    /// does not have the hash.
    pub async fn upload(
        &self,
        sha256: Sha256,
        total: u64,
        offset: u64,
        data: Bytes,
    ) -> Result<u64, CallError> {
        let loader = self.loader();
        let limit = loader.limits.asset_bytes;
        if total > limit {
            let what = "the size of the file in bytes".into();
            return Err(CallError::LimitExceeded { what, value: total, limit });
        }
        let bytes = loop {
            let checked = {
                let mut shelf = loader.lock();
                if let Some(kept) = shelf.store.get(&sha256) {
                    let there = kept.len() as u64;
                    if there == total {
                        return Ok(there);
                    }
                    let message = format!("the file {sha256} has {there} bytes, not {total}");
                    return Err(CallError::UploadMismatch { message });
                }
                match shelf.store.checking(&sha256) {
                    Some(checked) => checked,
                    None => match shelf.partials.append(sha256, total, offset, &data, Instant::now())? {
                        partial::Progress::Received(received) => return Ok(received),
                        partial::Progress::Complete(bytes) => {
                            shelf.store.begin_check(sha256);
                            break bytes;
                        }
                    },
                }
            };
            checked.cancelled().await;
        };
        // A task of its own: others wait for the file, also where this caller goes away.
        let handle = self.clone();
        let checked = tokio::spawn(async move {
            let check = Check { handle, sha256 };
            let loader = check.handle.loader();
            let (found, bytes) = loader.off_thread(move || (Sha256::of(&bytes), Arc::from(bytes))).await?;
            if found != sha256 {
                let message = format!("the file has the hash {found}, not {sha256}; send it anew");
                return Err(CallError::UploadMismatch { message });
            }
            loader.insert(sha256, bytes)?;
            Ok(total)
        });
        let failed = |error| CallError::Internal { message: format!("a file was not checked: {error}") };
        checked.await.map_err(failed)?
    }

    /// Reads a description as a spawn would, and only reports.
    ///
    /// # Errors
    /// Where its bytes cannot be had.
    pub async fn validate(&self, source: Source, scale: f64) -> Result<Validated, CallError> {
        let making = self.loader().making(scale, false, MeshShapes::Hull);
        let reading = self.loader().read(&source.into(), making, Reporter::default()).await?;
        let description = reading.used.description;
        Ok(match reading.outcome {
            Ok(Made { model, report, .. }) => {
                Validated { summary: summary(&model, &report), report, model: Some(model), description }
            }
            Err(refused) => Validated {
                summary: format!("refused: {refused}"),
                report: refused.report,
                model: None,
                description,
            },
        })
    }

    /// Brings a robot into the world.
    ///
    /// # Errors
    /// Where it cannot be read, and where the world refuses it.
    pub async fn spawn(&self, request: SpawnRequest) -> Result<Loaded, CallError> {
        let origin = request.source.clone().into();
        self.bring_in(origin, request, false, Reporter::default()).await
    }

    /// The same, and says how far it is.
    ///
    /// # Errors
    /// As [`spawn`](Self::spawn).
    pub async fn spawn_reporting(
        &self,
        request: SpawnRequest,
        listener: watch::Sender<Progress>,
    ) -> Result<Loaded, CallError> {
        let origin = request.source.clone().into();
        self.bring_in(origin, request, false, Reporter::to(listener)).await
    }

    /// Brings in a robot that the operator named: from any path, and to stay at a
    /// reset of spawned robots.
    pub(crate) async fn spawn_at_start(
        &self,
        path: PathBuf,
        request: SpawnRequest,
    ) -> Result<Loaded, CallError> {
        self.bring_in(Origin::Operator(path), request, true, Reporter::default()).await
    }

    async fn bring_in(
        &self,
        origin: Origin,
        request: SpawnRequest,
        loaded_at_start: bool,
        reporter: Reporter,
    ) -> Result<Loaded, CallError> {
        let SpawnRequest { name, scale, strict, mesh_shapes, .. } = &request;
        let making = self.loader().making(*scale, *strict, *mesh_shapes);
        let Made { model, shapes, report } = self.make(origin, making, reporter.clone()).await?;
        let summary = summary(&model, &report);
        let name = wire_name(if name.is_empty() { &model.name } else { name });
        let spawn = Spawn {
            contact_settings: request.contact_settings,
            name,
            allow_renaming: request.allow_renaming,
            model,
            shapes,
            pose: request.pose,
            fixed_base: request.fixed_base,
            passive: request.passive,
            joint_positions: request.joint_positions,
            loaded_at_start,
        };
        let mut name = spawn.name.clone();
        reporter.say(Phase::Spawning);
        let done = self.command(Command::Spawn(Box::new(spawn))).await?;
        if let Reply::Spawned { name: given } = &done.applied.reply {
            name.clone_from(given);
        }
        tracing::info!(robot = name, "spawned {summary}");
        Ok(Loaded { done, name, report, summary })
    }

    /// Gives a robot a new model: from a new source, or from where it came from, read again.
    ///
    /// # Errors
    /// Where there is no such robot, and where the model cannot be read.
    pub async fn reload(
        &self,
        robot: String,
        source: Option<Source>,
        strict: bool,
    ) -> Result<Reloaded, CallError> {
        let (origin, scale, mesh_shapes) = {
            let newest = self.newest();
            let Some((_, entity)) = newest.state.entity(&robot) else {
                let entities = newest.state.world.entities.iter();
                let known = entities.map(|entity| entity.name.clone()).collect();
                return Err(simd_core::Error::RobotNotFound { robot, known }.into());
            };
            let known = self
                .loader()
                .with_known(&entity.model, |known| (known.origin.clone(), known.scale, known.mesh_shapes));
            match (source, known) {
                (Some(source), known) => {
                    let (scale, mesh_shapes) = known.map_or((1.0, MeshShapes::Hull), |(_, s, m)| (s, m));
                    (source.into(), scale, mesh_shapes)
                }
                (None, Some(known)) => known,
                (None, None) => {
                    let message = format!("it is not known where robot {robot:?} came from");
                    return Err(CallError::Internal { message });
                }
            }
        };
        let making = self.loader().making(scale, strict, mesh_shapes);
        let Made { model, shapes, report } = self.make(origin, making, Reporter::default()).await?;
        let summary = summary(&model, &report);
        tracing::info!(robot, "reloads {summary}");
        let done = self.command(Command::Reload(Box::new(Reload { robot, model, shapes }))).await?;
        let (added, removed) = match &done.applied.reply {
            Reply::Reloaded { added, removed } => (added.clone(), removed.clone()),
            _ => Default::default(),
        };
        Ok(Reloaded { done, report, summary, added, removed })
    }

    /// The hash of a robot's description.
    pub fn description_of(&self, robot: &str) -> Option<Sha256> {
        let newest = self.newest();
        let (_, entity) = newest.state.entity(robot)?;
        self.description_of_model(&entity.model)
    }

    /// The description that a model was read from, if it was read from one.
    pub fn description_of_model(&self, model: &Arc<RobotModel>) -> Option<Sha256> {
        self.loader().with_known(model, |known| known.description)
    }

    /// A file that was uploaded or that a robot uses.
    pub fn asset(&self, sha256: &Sha256) -> Option<Bytes> {
        self.loader().lock().store.get(sha256).map(Bytes::from_owner)
    }

    /// Does what takes long with the mesh of a file, off the threads that others wait for;
    /// `None` where no robot uses it.
    ///
    /// # Errors
    /// Where too much waits for its turn already.
    pub(crate) async fn with_mesh<T: Send + 'static>(
        &self,
        sha256: &Sha256,
        work: impl FnOnce(&MeshAsset) -> T + Send + 'static,
    ) -> Result<Option<T>, CallError> {
        let Some(mesh) = self.loader().decoded.find(sha256) else { return Ok(None) };
        self.loader().off_thread(move || work(&mesh)).await.map(Some)
    }

    /// Does what takes long with a convex collider of a robot in the world, off the threads that
    /// others wait for; `None` where no robot has it.
    ///
    /// # Errors
    /// If too much waits to be read already.
    pub(crate) async fn with_collider<T: Send + 'static>(
        &self,
        sha256: Sha256,
        work: impl FnOnce(ConvexMesh) -> T + Send + 'static,
    ) -> Result<Option<T>, CallError> {
        let newest = self.newest();
        let mut robots = newest.state.world.entities.iter();
        let Some(collider) = robots.find_map(|robot| robot.shapes.convex_mesh(&sha256)) else {
            return Ok(None);
        };
        self.loader().off_thread(move || work(collider)).await.map(Some)
    }

    /// The text of a robot's description with other file names of its meshes; `None` where it is
    /// not kept.
    ///
    /// # Errors
    /// Where too much waits for its turn already.
    pub(crate) async fn description_with(
        &self,
        robot: &str,
        address: impl Fn(&str) -> Option<String> + Send + 'static,
    ) -> Result<Option<String>, CallError> {
        let Some(urdf) = self.description_of(robot).and_then(|sha256| self.asset(&sha256)) else {
            return Ok(None);
        };
        let limits = self.loader().limits.reading;
        let text = self.loader().off_thread(move || simd_model::readdress(&urdf, &limits, &address)).await?;
        text.map(Some).map_err(refused)
    }

    pub(super) async fn make(
        &self,
        origin: Origin,
        making: Making,
        reporter: Reporter,
    ) -> Result<Made, CallError> {
        let Reading { used, outcome } = self.loader().read(&origin, making, reporter).await?;
        let made = outcome.map_err(refused)?;
        self.loader().keep(&made.model, used, origin, making)?;
        Ok(made)
    }
}

/// A check of a file's hash, which ends with it however that comes about.
struct Check {
    handle: SimHandle,
    sha256: Sha256,
}

impl Drop for Check {
    fn drop(&mut self) {
        self.handle.loader().lock().store.end_check(&self.sha256);
    }
}

fn refused(refused: simd_model::Refused) -> CallError {
    CallError::InvalidDescription { message: refused.message, report: Box::new(refused.report) }
}

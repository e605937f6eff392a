//! Robots: spawning them, and their descriptions.

mod place;
mod reload;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use bytes::Bytes;
use glamx::DPose3;
use simd_core::collision::{ConvexMesh, MeshShapes};
use simd_core::simulation::command::{CollisionPair, ContactSettings, JointOrientation, Spawn};
use simd_core::simulation::free_place::FreePlace;
use simd_core::{Command, Reply};
use simd_model::robot::{MeshAsset, Sha256};
use simd_model::{LoadReport, RobotModel, SrdfPair, wire_name};
use tokio::sync::watch;

pub use self::reload::Reloaded;
use super::{CallError, SimHandle};
use crate::driver::{Done, Entry, ReportEntry};
use crate::loading::{
    ExpandedXacro, FilePart, Origin, Phase, Prepared, Progress, Reporter, Source, Validated, Which,
    XacroFiles, summary,
};

/// Request for a robot.
#[derive(Clone, Debug)]
pub struct SpawnRequest {
    /// Source of its description.
    pub source: Source,
    /// Name; if empty, the model's own.
    pub name: String,
    /// Whether a taken name gets `_1`, `_2`, ... instead of a refusal.
    pub allow_renaming: bool,
    /// `world_from_root`.
    pub pose: DPose3,
    /// Coordinates of `pose` that the world chooses.
    pub free_place: FreePlace,
    /// Whether the base is fixed; `None` fixes a root link called `world`.
    pub fixed_base: Option<bool>,
    /// Whether joints have no actuators, instead of holding their position.
    pub passive: bool,
    /// Initial positions, rad or m, by joint name.
    pub joint_positions: Vec<(String, f64)>,
    /// Initial orientations of spherical joints.
    pub joint_orientations: Vec<JointOrientation>,
    /// Factor of all lengths; above 0, at most 1,000.
    pub scale: f64,
    /// Whether to refuse a robot whose report has a warning.
    pub strict: bool,
    /// Conversion of its collision meshes.
    pub mesh_shapes: MeshShapes,
    /// Contact settings with other robots and with itself.
    pub contact_settings: ContactSettings,
    /// SRDF, which disables pairs of colliding links; empty for none.
    pub srdf: Bytes,
    /// Pairs of the robot's links whose collisions are switched off or on, after those of the SRDF.
    pub collision_pairs: Vec<CollisionPair>,
    /// Name of a robot in a file with several; empty for all of them.
    pub model: String,
}

impl SpawnRequest {
    /// Returns whether it has options that only make sense for a single robot.
    fn is_of_one(&self) -> bool {
        let Self { srdf, joint_positions, joint_orientations, collision_pairs, contact_settings, .. } = self;
        !srdf.is_empty()
            || !joint_positions.is_empty()
            || !joint_orientations.is_empty()
            || !collision_pairs.is_empty()
            || contact_settings.links.iter().any(|link| !link.link.is_empty())
    }
}

/// A spawned robot.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// Moment from which it exists.
    pub done: Done,
    /// Name.
    pub name: String,
    /// Names of other robots that were spawned from the same file.
    pub others: Vec<String>,
    /// Findings of the load.
    pub report: LoadReport,
    /// Summary of the report in one line.
    pub summary: String,
}

impl SimHandle {
    /// Stores a description, and returns which of its files are missing.
    ///
    /// # Errors
    /// Returns an error if it is too large, or cannot be read at all.
    pub async fn prepare(
        &self,
        urdf: Bytes,
        assets: BTreeMap<String, Sha256>,
    ) -> Result<Prepared, CallError> {
        self.loader().prepare(&self.call.account, urdf, assets).await
    }

    /// Expands a xacro file to a URDF.
    ///
    /// # Errors
    /// Returns an error if the files are too large in total, or the xacro is invalid.
    pub async fn expand_xacro(&self, files: XacroFiles) -> Result<ExpandedXacro, CallError> {
        self.loader().expand_xacro(&self.call.account, files).await
    }

    /// Stores a part of an uploaded file; returns the number of received bytes.
    ///
    /// # Errors
    /// Returns an error if the file is too large, parts do not match, or the whole file does not have the
    /// hash.
    pub async fn upload(&self, part: FilePart) -> Result<u64, CallError> {
        self.loader().upload(&self.call.account, part).await
    }

    /// Reads a description like a spawn, but only returns the report.
    ///
    /// # Errors
    /// Returns an error if its bytes are not available.
    pub async fn validate(&self, source: Source, scale: f64, model: &str) -> Result<Validated, CallError> {
        self.loader().validate(&self.call.account, source, scale, model).await
    }

    /// Spawns a robot.
    ///
    /// # Errors
    /// Returns an error if it cannot be read, or the world refuses it.
    pub async fn spawn(&self, request: SpawnRequest) -> Result<Loaded, CallError> {
        let origin = request.source.clone().into();
        self.bring_in(origin, request, false, Reporter::default()).await
    }

    /// Like `spawn`, and reports progress.
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

    /// Spawns a robot that the operator named. Its file may have any path, and the robot stays at a reset of
    /// spawned robots.
    pub async fn spawn_at_start(&self, path: PathBuf, request: SpawnRequest) -> Result<Loaded, CallError> {
        self.bring_in(Origin::Operator(path), request, true, Reporter::default()).await
    }

    async fn bring_in(
        &self,
        origin: Origin,
        request: SpawnRequest,
        loaded_at_start: bool,
        reporter: Reporter,
    ) -> Result<Loaded, CallError> {
        let SpawnRequest { name, scale, strict, mesh_shapes, fixed_base, .. } = &request;
        // The robot is noted here too, since an unreadable one never becomes a command.
        self.note_robots([name.as_str()].into_iter().filter(|name| !name.is_empty()));
        let options = self.loader().load_options(*scale, *strict, *mesh_shapes, *fixed_base);
        let srdf = request.srdf.clone();
        let which = match request.model.as_str() {
            "" if request.is_of_one() => Which::One(String::new()),
            "" => Which::All,
            model => Which::One(model.to_owned()),
        };
        let all = self
            .loader()
            .load_with_srdf(&self.call.account, origin, which, srdf, options, reporter.clone())
            .await?;
        let is_alone = all.len() == 1;
        let mut spawns = Vec::with_capacity(all.len());
        let mut report = LoadReport::default();
        let mut read = Vec::with_capacity(all.len());
        for (made, found) in all {
            report.findings.extend(made.report.findings);
            report.findings.extend(found.report.findings);
            read.push(Arc::clone(&made.model));
            let pair = |SrdfPair { links: [link, other_link], enabled }| CollisionPair {
                link,
                other_link,
                enabled: Some(enabled),
                ..CollisionPair::default()
            };
            let mut collision_pairs: Vec<CollisionPair> = found.pairs.into_iter().map(pair).collect();
            collision_pairs.extend_from_slice(&request.collision_pairs);
            let name = match (name.as_str(), is_alone) {
                ("", _) => made.model.name.clone(),
                (name, true) => name.to_owned(),
                (name, false) => format!("{name}_{}", made.model.name),
            };
            let placement = made.placement;
            spawns.push(Spawn {
                contact_settings: request.contact_settings.clone(),
                collision_pairs,
                name: wire_name(&name),
                allow_renaming: request.allow_renaming,
                model: made.model,
                shapes: made.shapes,
                pose: placement.map_or(request.pose, |placement| request.pose * placement.pose),
                fixed_base: placement.map(|placement| placement.fixed).or(request.fixed_base),
                passive: request.passive,
                joint_positions: request.joint_positions.clone(),
                joint_orientations: request.joint_orientations.clone(),
                free_place: request.free_place,
                loaded_at_start,
            });
        }
        let mut names: Vec<String> = spawns.iter().map(|spawn| spawn.name.clone()).collect();
        reporter.say(Phase::Spawning);
        let command = match (is_alone, spawns.pop()) {
            (true, Some(spawn)) => Command::Spawn(Box::new(spawn)),
            (_, last) => Command::SpawnAll(spawns.into_iter().chain(last).collect()),
        };
        let done = self.command(command).await?;
        match &done.applied.reply {
            Reply::Spawned { name } => names = vec![name.clone()],
            Reply::SpawnedAll { names: given } => names.clone_from(given),
            _ => {}
        }
        self.note_robots(names.iter().map(String::as_str));
        for (name, model) in names.iter().zip(&read) {
            self.report_place(name, model, &mut report).await;
        }
        let summaries: Vec<String> = read
            .iter()
            .enumerate()
            .map(|(index, model)| {
                // Warnings are counted once.
                if index == 0 { summary(model, &report) } else { summary(model, &LoadReport::default()) }
            })
            .collect();
        let summary = summaries.join(". ");
        let name = names.first().cloned().unwrap_or_default();
        let others: Vec<String> = names.into_iter().skip(1).collect();
        tracing::info!(robot = name, "spawned {summary}");
        if let Some(recording) = self.inner.recordings.running() {
            let entry = ReportEntry { robot: name.clone(), report: report.clone(), summary: summary.clone() };
            // The recording itself reports the cause of its end.
            let _ = recording.queue.push(Entry::Report(Box::new(entry)));
        }
        Ok(Loaded { done, name, others, report, summary })
    }

    /// Returns the hash of a robot's description.
    pub fn description_of(&self, robot: &str) -> Option<Sha256> {
        let newest = self.newest();
        let (_, entity) = newest.state.entity(robot)?;
        self.description_of_model(&entity.model)
    }

    /// Returns the description that a model was read from, if any.
    pub fn description_of_model(&self, model: &Arc<RobotModel>) -> Option<Sha256> {
        self.loader().with_known(model, |known| known.description)
    }

    /// Returns a file that was uploaded or that a robot uses.
    pub fn asset(&self, sha256: &Sha256) -> Option<Bytes> {
        self.loader().asset(sha256)
    }

    /// Runs long work on the mesh of a look, on threads that delay no other call; `None` if no robot uses the
    /// mesh.
    ///
    /// # Errors
    /// Returns an error if too many reads wait already.
    pub(crate) async fn with_mesh<T: Send + 'static>(
        &self,
        look: &Sha256,
        work: impl FnOnce(&MeshAsset) -> T + Send + 'static,
    ) -> Result<Option<T>, CallError> {
        self.loader().with_mesh(&self.call.account, look, work).await
    }

    /// Runs long work on a convex collider of a robot, on threads that delay no other call; `None` if no
    /// robot has it.
    ///
    /// # Errors
    /// Returns an error if too many reads wait already.
    pub async fn with_collider<T: Send + 'static>(
        &self,
        sha256: Sha256,
        work: impl FnOnce(ConvexMesh) -> T + Send + 'static,
    ) -> Result<Option<T>, CallError> {
        let newest = self.newest();
        let mut robots = newest.state.world.entities.iter();
        let Some(collider) = robots.find_map(|robot| robot.shapes.convex_mesh(&sha256)) else {
            return Ok(None);
        };
        self.loader().off_thread(&self.call.account, move || work(collider)).await.map(Some)
    }

    /// Returns the text of a robot's description with other file names of its meshes; `None` if the text is
    /// not stored.
    ///
    /// # Errors
    /// Returns an error if too many reads wait already.
    pub async fn description_with(
        &self,
        robot: &str,
        address: impl Fn(&str) -> Option<String> + Send + 'static,
    ) -> Result<Option<String>, CallError> {
        let Some(urdf) = self.description_of(robot).and_then(|sha256| self.asset(&sha256)) else {
            return Ok(None);
        };
        self.loader().readdress(&self.call.account, urdf, address).await.map(Some)
    }
}

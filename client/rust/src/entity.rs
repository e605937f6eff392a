//! Robots in the world: spawn, reload, delete, state, links.

use simd_proto::v1::{
    ApplyLinkWrenchRequest, DeleteEntityRequest, DescriptionSource, EntityInfo, GetAssetRequest,
    GetEntityInfoRequest, GetEntityStateRequest, GetEntityStateResponse, GetLinkPosesRequest,
    GetLinkPosesResponse, GetSceneRequest, GetSceneResponse, ListEntitiesRequest, LoadProgress, LoadReport,
    PullLinkRequest, ReloadEntityRequest, SetEntityStateRequest, SpawnEntityRequest, SpawnEntityResponse,
    SpawnEntityWithProgressRequest, Stamp, ValidateDescriptionRequest, ValidateDescriptionResponse,
    description_source::Source, spawn_entity_with_progress_response::Event,
};

use crate::{Client, Error, client::present};

/// A spawned robot.
#[derive(Clone, Debug)]
pub struct Spawned {
    /// The robot, under its name in the world.
    pub entity: EntityInfo,
    /// The other robots of an SDF or MJCF with several.
    pub others: Vec<EntityInfo>,
    /// Result of reading its description.
    pub report: LoadReport,
    /// Moment from which it is in the world.
    pub stamp: Stamp,
}

impl Spawned {
    fn new(answer: SpawnEntityResponse) -> Result<Self, Error> {
        Ok(Self {
            entity: present(answer.entity, "entity")?,
            others: answer.others,
            report: present(answer.report, "report")?,
            stamp: present(answer.stamp, "stamp")?,
        })
    }
}

/// A robot whose description was read again.
#[derive(Clone, Debug)]
pub struct Reloaded {
    /// The robot after the reload.
    pub entity: EntityInfo,
    /// Result of reading its description.
    pub report: LoadReport,
    /// Moment from which the new description holds.
    pub stamp: Stamp,
    /// Joints that it did not have before.
    pub added_joints: Vec<String>,
    /// Joints that it has no longer.
    pub removed_joints: Vec<String>,
}

/// `EntityService`, except the upload of files: see [`Client::load`].
impl Client {
    /// Spawns a robot from a source that the daemon has.
    ///
    /// # Errors
    /// `ROBOT_EXISTS`, `INVALID_DESCRIPTION`, `DESCRIPTION_NOT_UPLOADED`,
    /// `ASSET_NOT_UPLOADED`, `PATH_NOT_ALLOWED`, `FILE_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn spawn(&self, request: SpawnEntityRequest) -> Result<Spawned, Error> {
        let answer = self.unary_while_alive(self.entity().spawn_entity(request)).await?;
        Spawned::new(answer)
    }

    /// Like [`spawn`](Self::spawn), with progress. Waits as long as the daemon sends progress.
    ///
    /// # Errors
    /// As [`spawn`](Self::spawn).
    pub async fn spawn_with_progress(
        &self,
        request: SpawnEntityRequest,
        mut listener: impl FnMut(&LoadProgress),
    ) -> Result<Spawned, Error> {
        let request = SpawnEntityWithProgressRequest { spawn: Some(request) };
        let mut answers = self.unary_while_alive(self.entity().spawn_entity_with_progress(request)).await?;
        loop {
            let answer = answers.message().await;
            let answer = answer.map_err(|status| Error::from_status(&status, self.endpoint()))?;
            match present(answer.and_then(|answer| answer.event), "event")? {
                Event::Progress(progress) => listener(&progress),
                Event::Spawned(answer) => return Spawned::new(answer),
            }
        }
    }

    /// Reads a robot's description again, from its source or from a new one.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, and as [`spawn`](Self::spawn).
    pub async fn reload(&self, request: ReloadEntityRequest) -> Result<Reloaded, Error> {
        let answer = self.unary_while_alive(self.entity().reload_entity(self.claimed(request))).await?;
        Ok(Reloaded {
            entity: present(answer.entity, "entity")?,
            report: present(answer.report, "report")?,
            stamp: present(answer.stamp, "stamp")?,
            added_joints: answer.added_joints,
            removed_joints: answer.removed_joints,
        })
    }

    /// Reads a description as a spawn would, and only reports. `model` names one robot of several; empty means
    /// all.
    ///
    /// # Errors
    /// As [`spawn`](Self::spawn); the report has the faults of the description.
    pub async fn validate(
        &self,
        source: DescriptionSource,
        scale: Option<f64>,
        model: &str,
    ) -> Result<ValidateDescriptionResponse, Error> {
        let request = ValidateDescriptionRequest { source: Some(source), scale, model: model.to_owned() };
        self.unary_while_alive(self.entity().validate_description(request)).await
    }

    /// Deletes a robot.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn delete_robot(&self, robot: &str) -> Result<Stamp, Error> {
        let request = DeleteEntityRequest { robot: robot.to_owned(), ..Default::default() };
        present(self.unary(self.entity().delete_entity(self.claimed(request))).await?.stamp, "stamp")
    }

    /// Returns the robots in the world, in the order in which they were spawned.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn robots(&self) -> Result<Vec<EntityInfo>, Error> {
        Ok(self.unary(self.entity().list_entities(ListEntitiesRequest {})).await?.entities)
    }

    /// Returns base, mass and links of a robot.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn robot_info(&self, robot: &str) -> Result<EntityInfo, Error> {
        let request = GetEntityInfoRequest { robot: robot.to_owned() };
        present(self.unary(self.entity().get_entity_info(request)).await?.entity, "entity")
    }

    /// Returns pose and twist of a robot's root link.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn robot_state(&self, robot: &str) -> Result<GetEntityStateResponse, Error> {
        let request = GetEntityStateRequest { robot: robot.to_owned() };
        self.unary(self.entity().get_entity_state(request)).await
    }

    /// Moves a robot's root link.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn set_robot_state(&self, request: SetEntityStateRequest) -> Result<Stamp, Error> {
        present(self.unary(self.entity().set_entity_state(self.claimed(request))).await?.stamp, "stamp")
    }

    /// Returns world poses of links; of all robots if none is named.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn link_poses(&self, robots: &[&str]) -> Result<GetLinkPosesResponse, Error> {
        let request = GetLinkPosesRequest { robots: owned(robots) };
        self.unary(self.entity().get_link_poses(request)).await
    }

    /// Returns the visuals of robots; of all robots if none is named.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn scene(&self, robots: &[&str]) -> Result<GetSceneResponse, Error> {
        let request = GetSceneRequest { robots: owned(robots) };
        self.unary(self.entity().get_scene(request)).await
    }

    /// Returns a whole file that a scene names.
    ///
    /// # Errors
    /// Returns an error if the daemon has no such file.
    pub async fn asset(&self, sha256: &str) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        loop {
            let request =
                GetAssetRequest { sha256: sha256.to_owned(), offset: bytes.len() as u64, max_bytes: 0 };
            let part = self.unary(self.entity().get_asset(request)).await?;
            let is_last = bytes.len() as u64 + part.data.len() as u64 >= part.total_bytes;
            if part.data.is_empty() && !is_last {
                return Err(Error::Answer { reason: "an asset's part is empty".to_owned() });
            }
            bytes.extend_from_slice(&part.data);
            if is_last {
                return Ok(bytes);
            }
        }
    }

    /// Applies a wrench to a link.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `LINK_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn apply_wrench(&self, request: ApplyLinkWrenchRequest) -> Result<Stamp, Error> {
        present(self.unary(self.entity().apply_link_wrench(self.claimed(request))).await?.stamp, "stamp")
    }

    /// Pulls a link to a point of the world, or lets it go.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `LINK_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn pull(&self, request: PullLinkRequest) -> Result<Stamp, Error> {
        present(self.unary(self.entity().pull_link(self.claimed(request))).await?.stamp, "stamp")
    }
}

/// `EntityService` for descriptions on the daemon's own disk, below one of its asset roots.
impl Client {
    /// Spawns a robot whose URDF is on the daemon's disk.
    ///
    /// # Errors
    /// `PATH_NOT_ALLOWED`, `FILE_NOT_FOUND`, and as [`spawn`](Self::spawn).
    pub async fn load_on_daemon(&self, path: &str, request: SpawnEntityRequest) -> Result<Spawned, Error> {
        let source = DescriptionSource { source: Some(Source::Path(path.to_owned())), ..Default::default() };
        self.spawn(SpawnEntityRequest { source: Some(source), ..request }).await
    }
}

fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

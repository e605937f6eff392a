//! The entity service: spawns, deletes and moves robots.

use crate::service::status::OrStatus as _;
use std::sync::Arc;

use simd_core::collision::ConvexMesh;
use simd_core::dynamics::link_damping::LinkDamping;
use simd_core::simulation::published_state::EntityLayout;
use simd_core::{Command, Error};
use simd_proto::v1::{self, entity_service_server::EntityService};
use tokio::sync::watch;
use tonic::{Request, Response, Status};

use super::BoxStream;
use super::calls::handle_of;
use super::file_part::part;
use super::once::once;
use super::spawning::spawning;
use super::unread::Attachment;
use crate::convert::field::Path;
use crate::convert::from_proto::{entity as from_proto, xacro};
use crate::convert::to_proto::contact::{collision_filter, link_properties};
use crate::convert::to_proto::{self, stamp};
use simd_world::SimHandle;
use simd_world::handle::{CallError, Done, ExpandedXacro, Loaded, Published, Reloaded, Validated};
use simd_world::loading::Progress;

/// Maximum number of triangles of a collider that is sent as text, which is written for each requested
/// part of the file. Hulls and parts of meshes stay below it; terrain may not.
const MAX_TEXT_TRIANGLES: usize = 16_384;

/// Serves `simd.v1.EntityService`.
#[derive(Clone, Debug)]
pub struct Service {
    handle: SimHandle,
}

impl Service {
    /// Serves the world of a handle.
    pub fn new(handle: SimHandle) -> Self {
        Self { handle }
    }

    fn info(&self, state: &Published, index: usize, entity: &EntityLayout) -> v1::EntityInfo {
        let description = self.handle.description_of_model(&entity.model);
        let info = to_proto::entity::entity_info(entity, state.state.roots.get(index), description);
        let holder = state.state.settings.get(index).and_then(|settings| settings.claimed_by.as_deref());
        v1::EntityInfo { claimed_by: holder.unwrap_or_default().to_owned(), ..info }
    }

    /// Describes a robot that was just spawned.
    ///
    /// # Errors
    /// Returns an error if the robot no longer exists.
    fn info_of(&self, robot: &str, done: &Done) -> Result<v1::EntityInfo, CallError> {
        let state = self.handle.newest();
        let gone = || CallError::GoneAgain { robot: robot.to_owned(), step: done.applied.at.step };
        let (index, entity) = state.state.entity(robot).ok_or_else(gone)?;
        Ok(self.info(&state, index, entity))
    }

    fn spawned(&self, loaded: Loaded) -> Result<v1::SpawnEntityResponse, CallError> {
        let Loaded { done, name, others, report, summary } = loaded;
        Ok(v1::SpawnEntityResponse {
            entity: Some(self.info_of(&name, &done)?),
            others: others.iter().filter_map(|other| self.info_of(other, &done).ok()).collect(),
            report: Some(to_proto::entity::report(report, summary)),
            stamp: Some(stamp::done(&done)),
        })
    }
}

/// Finds a robot by name; also returns its index.
pub(super) fn find<'a>(
    state: &'a Published,
    robot: &str,
) -> Result<(usize, &'a Arc<EntityLayout>), CallError> {
    state.state.entity(robot).ok_or_else(|| CallError::World(not_found(state, robot)))
}

fn not_found(state: &Published, robot: &str) -> Error {
    let known = state.state.world.entities.iter().map(|entity| entity.name.clone()).collect();
    Error::RobotNotFound { robot: robot.to_owned(), known }
}

/// Finds robots by name, in this order; no names mean all robots.
pub(super) fn find_all<'a>(
    state: &'a Published,
    robots: &[String],
) -> Result<Vec<(usize, &'a Arc<EntityLayout>)>, CallError> {
    if robots.is_empty() {
        return Ok(state.state.world.entities.iter().enumerate().collect());
    }
    robots.iter().map(|robot| find(state, robot)).collect()
}

#[tonic::async_trait]
impl EntityService for Service {
    async fn prepare_description(
        &self,
        request: Request<v1::PrepareDescriptionRequest>,
    ) -> Result<Response<v1::PrepareDescriptionResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let (urdf, assets) = from_proto::prepare(request.into_inner())?;
        let prepared = handle.prepare(urdf, assets).await.or_status()?;
        Ok(Response::new(to_proto::entity::prepared(prepared)))
    }

    async fn expand_xacro(
        &self,
        request: Request<v1::ExpandXacroRequest>,
    ) -> Result<Response<v1::ExpandXacroResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let files = xacro::files(request.into_inner())?;
        let ExpandedXacro { urdf, messages } = handle.expand_xacro(files).await.or_status()?;
        Ok(Response::new(v1::ExpandXacroResponse { urdf: urdf.into_bytes(), messages }))
    }

    async fn upload_asset(
        &self,
        request: Request<v1::UploadAssetRequest>,
    ) -> Result<Response<v1::UploadAssetResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let part = from_proto::upload(request.into_inner())?;
        let received_bytes = handle.upload(part).await.or_status()?;
        Ok(Response::new(v1::UploadAssetResponse { received_bytes }))
    }

    async fn validate_description(
        &self,
        request: Request<v1::ValidateDescriptionRequest>,
    ) -> Result<Response<v1::ValidateDescriptionResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let request = request.into_inner();
        let source = from_proto::source(&Path::ROOT.field("source"), request.source)?;
        let scale = request.scale.unwrap_or(1.0);
        let (report, summary, robots) = match handle.validate(source, scale, &request.model).await {
            Ok(Validated { report, summary, robots }) => (report, summary, robots),
            // The report is the answer, and it ends with the reason.
            Err(CallError::InvalidDescription { message, report }) => (*report, message, Vec::new()),
            Err(error) => return Err(error).or_status(),
        };
        let report = Some(to_proto::entity::report(report, summary));
        let entities: Vec<_> = robots.iter().map(to_proto::entity::described).collect();
        let entity = <[_; 1]>::try_from(entities.clone()).ok().map(|[only]| only);
        Ok(Response::new(v1::ValidateDescriptionResponse { report, entity, entities }))
    }

    async fn spawn_entity(
        &self,
        request: Request<v1::SpawnEntityRequest>,
    ) -> Result<Response<v1::SpawnEntityResponse>, Status> {
        let service = self.clone();
        once(&self.handle, request, |handle, request| async move {
            let loaded = handle.spawn(from_proto::spawn(request)?).await?;
            Ok(service.spawned(loaded)?)
        })
        .await
    }

    type SpawnEntityWithProgressStream = BoxStream<v1::SpawnEntityWithProgressResponse>;

    async fn spawn_entity_with_progress(
        &self,
        request: Request<v1::SpawnEntityWithProgressRequest>,
    ) -> Result<Response<Self::SpawnEntityWithProgressStream>, Status> {
        let (metadata, extensions, request) = request.into_parts();
        let spawn = Path::ROOT.field("spawn").given(request.spawn)?;
        let request = Request::from_parts(metadata, extensions, spawn);
        let (say, heard) = watch::channel(Progress::default());
        let service = self.clone();
        // A separate task: the robot is spawned even if the caller disconnects.
        let work = tokio::spawn(async move {
            let own = service.clone();
            let spawned = once(&service.handle, request, |handle, request| async move {
                let loaded = handle.spawn_reporting(from_proto::spawn(request)?, say).await?;
                Ok(own.spawned(loaded)?)
            });
            spawned.await.map(Response::into_inner)
        });
        let work = async {
            work.await
                .unwrap_or_else(|error| Err(CallError::Internal { message: error.to_string() }).or_status())
        };
        Ok(Response::new(spawning(work, heard)))
    }

    async fn reload_entity(
        &self,
        request: Request<v1::ReloadEntityRequest>,
    ) -> Result<Response<v1::ReloadEntityResponse>, Status> {
        let service = self.clone();
        once(&self.handle, request, |handle, request| async move {
            let (robot, source) = from_proto::reload(request.robot, request.source)?;
            let reloaded = handle.reload(robot.clone(), source, request.strict).await?;
            let Reloaded { done, report, summary, added, removed } = reloaded;
            Ok(v1::ReloadEntityResponse {
                entity: Some(service.info_of(&robot, &done)?),
                report: Some(to_proto::entity::report(report, summary)),
                stamp: Some(stamp::done(&done)),
                added_joints: added,
                removed_joints: removed,
            })
        })
        .await
    }

    async fn delete_entity(
        &self,
        request: Request<v1::DeleteEntityRequest>,
    ) -> Result<Response<v1::DeleteEntityResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let command = Command::Delete { robot: from_proto::robot(request.robot)? };
            let done = handle.command(command).await?;
            Ok(v1::DeleteEntityResponse { stamp: Some(stamp::done(&done)) })
        })
        .await
    }

    async fn list_entities(
        &self,
        _request: Request<v1::ListEntitiesRequest>,
    ) -> Result<Response<v1::ListEntitiesResponse>, Status> {
        let state = self.handle.newest();
        let entities = state.state.world.entities.iter().enumerate();
        Ok(Response::new(v1::ListEntitiesResponse {
            entities: entities.map(|(index, entity)| self.info(&state, index, entity)).collect(),
            stamp: Some(stamp::published(&state)),
        }))
    }

    async fn get_entity_info(
        &self,
        request: Request<v1::GetEntityInfoRequest>,
    ) -> Result<Response<v1::GetEntityInfoResponse>, Status> {
        let robot = from_proto::robot(request.into_inner().robot)?;
        let state = self.handle.newest();
        let (index, entity) = find(&state, &robot).or_status()?;
        let entity = Some(self.info(&state, index, entity));
        Ok(Response::new(v1::GetEntityInfoResponse { entity }))
    }

    async fn get_entity_state(
        &self,
        request: Request<v1::GetEntityStateRequest>,
    ) -> Result<Response<v1::GetEntityStateResponse>, Status> {
        let robot = from_proto::robot(request.into_inner().robot)?;
        let state = self.handle.newest();
        let (index, _entity) = find(&state, &robot).or_status()?;
        let root = state.state.roots.get(index);
        Ok(Response::new(v1::GetEntityStateResponse {
            stamp: Some(stamp::published(&state)),
            pose: root.map(|root| to_proto::geometry::pose(root.pose)),
            twist: root.map(|root| to_proto::geometry::twist(root.linear, root.angular)),
        }))
    }

    async fn set_entity_state(
        &self,
        request: Request<v1::SetEntityStateRequest>,
    ) -> Result<Response<v1::SetEntityStateResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let done = handle.command(from_proto::set_entity_state(request)?).await?;
            Ok(v1::SetEntityStateResponse { stamp: Some(stamp::done(&done)) })
        })
        .await
    }

    async fn get_link_poses(
        &self,
        request: Request<v1::GetLinkPosesRequest>,
    ) -> Result<Response<v1::GetLinkPosesResponse>, Status> {
        let robots = from_proto::robots(request.into_inner().robots)?;
        let state = self.handle.newest();
        let robots = find_all(&state, &robots)
            .or_status()?
            .into_iter()
            .map(|(index, entity)| to_proto::entity::link_poses(&state.state, index, entity))
            .collect();
        Ok(Response::new(v1::GetLinkPosesResponse { stamp: Some(stamp::published(&state)), robots }))
    }

    async fn get_scene(
        &self,
        request: Request<v1::GetSceneRequest>,
    ) -> Result<Response<v1::GetSceneResponse>, Status> {
        let robots = from_proto::robots(request.into_inner().robots)?;
        let state = self.handle.newest();
        let robots = find_all(&state, &robots)
            .or_status()?
            .into_iter()
            .map(|(_index, entity)| to_proto::scene::robot_scene(entity))
            .collect();
        Ok(Response::new(v1::GetSceneResponse { robots, stamp: Some(stamp::published(&state)) }))
    }

    async fn get_asset(
        &self,
        request: Request<v1::GetAssetRequest>,
    ) -> Result<Response<v1::GetAssetResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let request = request.into_inner();
        let sha256 = from_proto::asset(&request)?;
        let asset = match handle.asset(&sha256) {
            Some(asset) => Some(asset),
            None => {
                let written = |mesh: ConvexMesh| {
                    (mesh.triangles.len() <= MAX_TEXT_TRIANGLES).then(|| to_proto::scene::obj(&mesh).into())
                };
                handle.with_collider(sha256, written).await.or_status()?.flatten()
            }
        };
        let asset = asset
            .ok_or_else(|| CallError::AssetNotUploaded { uri: String::new(), sha256: sha256.to_string() })
            .or_status()?;
        let total_bytes = asset.len() as u64;
        let bytes = part(&asset, request.offset, request.max_bytes).ok_or_else(|| {
            let expected = format!("it must be at most the file's size, {total_bytes}");
            Path::ROOT.field("offset").refuse(request.offset, expected)
        })?;
        let mut response = Response::new(v1::GetAssetResponse { data: Vec::new(), total_bytes });
        response.extensions_mut().insert(Attachment { field: 1, bytes });
        Ok(response)
    }

    async fn apply_link_wrench(
        &self,
        request: Request<v1::ApplyLinkWrenchRequest>,
    ) -> Result<Response<v1::ApplyLinkWrenchResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let done = handle.command(from_proto::link_wrench(request)?).await?;
            Ok(v1::ApplyLinkWrenchResponse { stamp: Some(stamp::done(&done)) })
        })
        .await
    }

    async fn pull_link(
        &self,
        request: Request<v1::PullLinkRequest>,
    ) -> Result<Response<v1::PullLinkResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let done = handle.command(from_proto::link_pull(request)?).await?;
            Ok(v1::PullLinkResponse { stamp: Some(stamp::done(&done)) })
        })
        .await
    }

    async fn get_link_properties(
        &self,
        request: Request<v1::GetLinkPropertiesRequest>,
    ) -> Result<Response<v1::GetLinkPropertiesResponse>, Status> {
        let robot = from_proto::robot(request.into_inner().robot)?;
        let state = self.handle.newest();
        let (index, entity) = find(&state, &robot).or_status()?;
        let settings = state.state.settings.get(index);
        let of_links =
            settings.into_iter().flat_map(|settings| settings.surfaces.iter().zip(&settings.groups));
        let links = entity.model.links.iter().zip(of_links);
        // Without any damping the list is empty.
        let damping = settings.into_iter().flat_map(|settings| settings.link_damping.iter().copied());
        let damping = damping.chain(std::iter::repeat(LinkDamping::default()));
        let stays_awake = settings.is_some_and(|settings| settings.stays_awake);
        Ok(Response::new(v1::GetLinkPropertiesResponse {
            links: links
                .zip(damping)
                .map(|((link, (surface, groups)), damping)| {
                    link_properties(&link.name, *surface, *groups, damping)
                })
                .collect(),
            stamp: Some(stamp::published(&state)),
            stays_awake,
        }))
    }

    async fn set_link_properties(
        &self,
        request: Request<v1::SetLinkPropertiesRequest>,
    ) -> Result<Response<v1::SetLinkPropertiesResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let done = handle.command(from_proto::set_link_properties(request)?).await?;
            Ok(v1::SetLinkPropertiesResponse { stamp: Some(stamp::done(&done)) })
        })
        .await
    }

    async fn get_collision_filter(
        &self,
        request: Request<v1::GetCollisionFilterRequest>,
    ) -> Result<Response<v1::GetCollisionFilterResponse>, Status> {
        let robot = from_proto::robot(request.into_inner().robot)?;
        let state = self.handle.newest();
        let (index, _entity) = find(&state, &robot).or_status()?;
        let stamp = Some(stamp::published(&state));
        Ok(Response::new(v1::GetCollisionFilterResponse { stamp, ..collision_filter(&state.state, index) }))
    }

    async fn set_collision_filter(
        &self,
        request: Request<v1::SetCollisionFilterRequest>,
    ) -> Result<Response<v1::SetCollisionFilterResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let done = handle.command(from_proto::set_collision_filter(request)?).await?;
            Ok(v1::SetCollisionFilterResponse { stamp: Some(stamp::done(&done)) })
        })
        .await
    }
}

#[cfg(test)]
mod tests;

//! The contact service: contacts, distances, rays and swept shapes.

use crate::service::status::OrStatus as _;
use simd_core::simulation::queries::{DistanceQuery, QueryBody, QuerySide};
use simd_core::simulation::rays::check_rays;
use simd_proto::v1::{self, contact_service_server::ContactService};
use tonic::{Request, Response, Status};

use super::calls::handle_of;
use super::entity::{find, find_all};
use super::kinematics::link_of;
use crate::convert::field::Path;
use crate::convert::from_proto::entity::robots;
use crate::convert::from_proto::kinematics::configuration_at;
use crate::convert::from_proto::{contact as from_proto, query};
use crate::convert::to_proto::{contact as to_proto, query as to_query, stamp};
use simd_world::SimHandle;
use simd_world::handle::{CallError, Cancelled, Published};

/// Serves `simd.v1.ContactService`.
#[derive(Clone, Debug)]
pub struct Service {
    handle: SimHandle,
}

impl Service {
    /// Serves the world of a handle.
    pub fn new(handle: SimHandle) -> Self {
        Self { handle }
    }
}

#[tonic::async_trait]
impl ContactService for Service {
    async fn get_contacts(
        &self,
        request: Request<v1::GetContactsRequest>,
    ) -> Result<Response<v1::GetContactsResponse>, Status> {
        let robot = from_proto::contacts(request.into_inner())?;
        let state = self.handle.newest();
        let only = robot.map(|robot| find(&state, &robot).map(|(index, _)| index)).transpose().or_status()?;
        let is_wanted = |robots: [usize; 2]| only.is_none_or(|only| robots.contains(&only));
        let contacts = to_proto::contacts(&state.state, is_wanted);
        Ok(Response::new(v1::GetContactsResponse { stamp: Some(stamp::published(&state)), contacts }))
    }

    async fn cast_rays(
        &self,
        request: Request<v1::CastRaysRequest>,
    ) -> Result<Response<v1::CastRaysResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let v1::CastRaysRequest { rays, collision_mask } = request.into_inner();
        let rays = from_proto::rays(rays)?;
        // Checked before the wait for a permit.
        check_rays(&rays).map_err(CallError::World).or_status()?;
        let state = self.handle.newest();
        let stamp = Some(stamp::published(&state));
        let cast =
            move |cancelled: &Cancelled| state.state.cast_rays(&rays, collision_mask, &|| cancelled.is_set());
        let hits = handle.heavy(cast).await.or_status()?.map_err(CallError::World).or_status()?;
        Ok(Response::new(v1::CastRaysResponse { stamp, hits: hits.into_iter().map(to_proto::hit).collect() }))
    }

    async fn get_closest_points(
        &self,
        request: Request<v1::GetClosestPointsRequest>,
    ) -> Result<Response<v1::GetClosestPointsResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let v1::GetClosestPointsRequest { a, b, max_distance, nearest_only, filtered } = request.into_inner();
        let (a, b) = query::sides(a, b)?;
        let state = self.handle.newest();
        let query = DistanceQuery {
            a: side(&Path::ROOT.field("a"), a, &state)?,
            b: b.map(|b| side(&Path::ROOT.field("b"), b, &state)).transpose()?,
            within: max_distance.unwrap_or(f64::INFINITY),
            nearest_only,
            filtered,
        };
        let stamp = Some(stamp::published(&state));
        let measure = move |cancelled: &Cancelled| state.state.distances(&query, &|| cancelled.is_set());
        let pairs = handle.heavy(measure).await.or_status()?.map_err(CallError::World).or_status()?;
        let pairs = pairs.into_iter().map(to_query::closest).collect();
        Ok(Response::new(v1::GetClosestPointsResponse { stamp, pairs }))
    }

    async fn find_overlaps(
        &self,
        request: Request<v1::FindOverlapsRequest>,
    ) -> Result<Response<v1::FindOverlapsResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let v1::FindOverlapsRequest { shape, pose, bounds_only } = request.into_inner();
        let (shape, pose) = query::shape(&Path::ROOT, shape, pose)?;
        let state = self.handle.newest();
        let stamp = Some(stamp::published(&state));
        let find = move |cancelled: &Cancelled| {
            state.state.overlaps(&shape, pose, bounds_only, &|| cancelled.is_set())
        };
        let links = handle.heavy(find).await.or_status()?.map_err(CallError::World).or_status()?;
        let links = links.into_iter().map(|(robot, link)| v1::LinkName { robot, link }).collect();
        Ok(Response::new(v1::FindOverlapsResponse { stamp, links }))
    }

    async fn cast_shape(
        &self,
        request: Request<v1::CastShapeRequest>,
    ) -> Result<Response<v1::CastShapeResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let v1::CastShapeRequest { shape, pose, translation } = request.into_inner();
        let (shape, pose) = query::shape(&Path::ROOT, shape, pose)?;
        let way = query::translation(translation)?;
        let state = self.handle.newest();
        let stamp = Some(stamp::published(&state));
        let cast =
            move |cancelled: &Cancelled| state.state.cast_shape(&shape, pose, way, &|| cancelled.is_set());
        let hit = handle.heavy(cast).await.or_status()?.map_err(CallError::World).or_status()?;
        Ok(Response::new(v1::CastShapeResponse { stamp, hit: Some(to_proto::hit(hit)) }))
    }

    async fn get_link_bounds(
        &self,
        request: Request<v1::GetLinkBoundsRequest>,
    ) -> Result<Response<v1::GetLinkBoundsResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let robots = robots(request.into_inner().robots)?;
        let state = self.handle.newest();
        let indices: Vec<usize> =
            find_all(&state, &robots).or_status()?.into_iter().map(|(index, _)| index).collect();
        let stamp = Some(stamp::published(&state));
        let find = move |cancelled: &Cancelled| state.state.bounds_of(&indices, &|| cancelled.is_set());
        let found = handle.heavy(find).await.or_status()?.map_err(CallError::World).or_status()?;
        let links = found.into_iter().map(|(robot, bounds)| to_query::bounds(&robot, bounds)).collect();
        Ok(Response::new(v1::GetLinkBoundsResponse { stamp, links }))
    }
}

/// Resolves a side of a distance in a state.
fn side(at: &Path<'_>, side: query::Side, state: &Published) -> Result<QuerySide, Status> {
    let body = match side {
        query::Side::Body(body) => body,
        query::Side::Shape(geometry, pose) => return Ok(QuerySide::Shape(geometry, pose)),
    };
    let (robot, entity) = find(state, &body.robot).or_status()?;
    let link = if body.link.is_empty() { None } else { Some(link_of(entity, &body.link).or_status()?) };
    let given = body.configuration;
    let configuration = given
        .map(|given| configuration_at(&at.field("configuration"), Some(given), &state.state, robot, entity))
        .transpose()?;
    Ok(QueryBody { robot, link, configuration }.into())
}

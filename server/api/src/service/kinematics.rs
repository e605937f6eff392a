//! The kinematics service: everything that follows from joint positions. It is computed from the published
//! state, outside of the physics thread.

use crate::service::status::OrStatus as _;
use glamx::DVec3;
use simd_core::Error;
use simd_core::dynamics::inverse_dynamics::{Resistance, inertia_matrix, inverse_dynamics};
use simd_core::dynamics::inverse_kinematics::{Goal, Movable, inverse_kinematics};
use simd_core::dynamics::jacobian::jacobian;
use simd_core::simulation::joint_status::JointStatus;
use simd_core::simulation::published_state::EntityLayout;
use simd_model::robot::JointKind;
use simd_proto::v1::{self, kinematics_service_server::KinematicsService};
use tonic::{Request, Response, Status};

use super::calls::handle_of;
use super::{PublishedRobot, entity, joints_of};
use crate::convert::from_proto::{entity as from_proto_entity, kinematics as from_proto};
use crate::convert::to_proto::{kinematics as to_proto, stamp};
use simd_world::SimHandle;
use simd_world::handle::{CallError, Cancelled};

/// Serves `simd.v1.KinematicsService`.
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

/// Finds a link by name.
pub(super) fn link_of(entity: &EntityLayout, link: &str) -> Result<usize, CallError> {
    let links = &entity.model.links;
    links.iter().position(|known| known.name == link).ok_or_else(|| {
        CallError::World(Error::LinkNotFound {
            robot: entity.name.clone(),
            link: link.to_owned(),
            known: links.iter().map(|link| link.name.clone()).collect(),
        })
    })
}

/// Returns the resistances of joints, by velocity.
fn resistances(entity: &EntityLayout, joints: &[JointStatus]) -> Vec<Resistance> {
    let mut resistances = vec![Resistance::default(); entity.tree.velocity_count];
    for body in entity.tree.bodies.iter().filter(|body| body.joint_type.velocities() == 1) {
        let joint = body.joint.and_then(|joint| joints.get(joint));
        if let (Some(joint), Some(resistance)) = (joint, resistances.get_mut(body.velocity)) {
            let of = &joint.settings;
            let (spring_stiffness, spring_rest) = of.spring;
            *resistance =
                Resistance { armature: of.armature, damping: of.damping, spring_stiffness, spring_rest };
        }
    }
    resistances
}

/// Returns the axes of the named joints, or of all that take targets, with their limits.
fn movables(
    entity: &EntityLayout,
    joints: &[JointStatus],
    names: &[String],
) -> Result<Vec<Movable>, CallError> {
    let model = &entity.model;
    let why_not = |index: usize| match model.joints.get(index).map(|joint| (joint.kind, joint.mimic)) {
        Some((JointKind::Fixed, _)) => Some("is fixed".to_owned()),
        Some((JointKind::Floating, _)) => Some("is floating".to_owned()),
        Some((_, Some(mimic))) => {
            let leader = model.joints.get(mimic.joint).map(|joint| joint.name.as_str());
            Some(format!("follows joint {:?}", leader.unwrap_or_default()))
        }
        Some(_) if model.setup.tendon(index).is_some() => Some("is a sum of other joints".to_owned()),
        _ => None,
    };
    let chosen: Vec<usize> = if names.is_empty() {
        (0..model.joints.len()).filter(|&index| why_not(index).is_none()).collect()
    } else {
        let find = |name: &String| {
            let (robot, joint) = (entity.name.clone(), name.clone());
            let Some(index) = model.joints.iter().position(|joint| joint.name == *name) else {
                let known = model.joints.iter().map(|joint| joint.name.clone()).collect();
                return Err(Error::JointNotFound { robot, joint, known });
            };
            match why_not(index) {
                Some(why) => Err(Error::JointNotActuated { robot, joint, why }),
                None => Ok(index),
            }
        };
        names.iter().map(find).collect::<Result<_, _>>()?
    };
    let movables = chosen.into_iter().flat_map(|index| {
        let bodies = entity.tree.joints.get(index).cloned().unwrap_or_default();
        let limits = joints.get(index).map(|joint| joint.settings.limits).unwrap_or_default();
        bodies.map(move |body| Movable {
            body,
            lower: limits.lower.unwrap_or(f64::NEG_INFINITY),
            upper: limits.upper.unwrap_or(f64::INFINITY),
        })
    });
    Ok(movables.collect())
}

#[tonic::async_trait]
impl KinematicsService for Service {
    async fn get_link_states(
        &self,
        request: Request<v1::GetLinkStatesRequest>,
    ) -> Result<Response<v1::GetLinkStatesResponse>, Status> {
        let robots = from_proto_entity::robots(request.into_inner().robots)?;
        let state = self.handle.newest();
        let robots = entity::find_all(&state, &robots)
            .or_status()?
            .into_iter()
            .map(|(index, entity)| to_proto::link_states(&state.state, index, entity))
            .collect();
        Ok(Response::new(v1::GetLinkStatesResponse { stamp: Some(stamp::published(&state)), robots }))
    }

    async fn get_joint_reactions(
        &self,
        request: Request<v1::GetJointReactionsRequest>,
    ) -> Result<Response<v1::GetJointReactionsResponse>, Status> {
        let robot = from_proto_entity::robot(request.into_inner().robot)?;
        let state = self.handle.newest();
        let (index, entity) = entity::find(&state, &robot).or_status()?;
        let wrenches = state.state.joint_reactions(index, state.physics.gravity).unwrap_or_default();
        Ok(Response::new(v1::GetJointReactionsResponse {
            stamp: Some(stamp::published(&state)),
            layout_version: entity.version,
            wrenches: wrenches.iter().flatten().flat_map(DVec3::to_array).collect(),
        }))
    }

    async fn get_jacobian(
        &self,
        request: Request<v1::GetJacobianRequest>,
    ) -> Result<Response<v1::GetJacobianResponse>, Status> {
        let v1::GetJacobianRequest { robot, link, point, configuration } = request.into_inner();
        let (robot, link) = from_proto::link(robot, link)?;
        let point = from_proto::point(point)?;
        let state = self.handle.newest();
        let (index, entity) = entity::find(&state, &robot).or_status()?;
        let link = link_of(entity, &link).or_status()?;
        let given = from_proto::configuration("configuration", configuration, &state.state, index, entity)?;
        let columns = jacobian(&entity.tree, &given, link, point);
        Ok(Response::new(to_proto::jacobian(&columns, stamp::published(&state))))
    }

    async fn get_mass_matrix(
        &self,
        request: Request<v1::GetMassMatrixRequest>,
    ) -> Result<Response<v1::GetMassMatrixResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let v1::GetMassMatrixRequest { robot, configuration } = request.into_inner();
        let robot = from_proto_entity::robot(robot)?;
        let PublishedRobot { state, index, layout: entity, joints } =
            joints_of(&self.handle, &robot).or_status()?;
        let given = from_proto::configuration("configuration", configuration, &state.state, index, &entity)?;
        let columns = u32::try_from(entity.tree.velocity_count).unwrap_or(u32::MAX);
        let resistances = resistances(&entity, &joints);
        let matrix =
            handle.heavy(move |_| inertia_matrix(&entity.tree, &given, &resistances)).await.or_status()?;
        let stamp = Some(stamp::published(&state));
        Ok(Response::new(v1::GetMassMatrixResponse { matrix, columns, stamp }))
    }

    async fn compute_inverse_dynamics(
        &self,
        request: Request<v1::ComputeInverseDynamicsRequest>,
    ) -> Result<Response<v1::ComputeInverseDynamicsResponse>, Status> {
        let v1::ComputeInverseDynamicsRequest { robot, configuration, accelerations } = request.into_inner();
        let robot = from_proto_entity::robot(robot)?;
        let PublishedRobot { state, index, layout: entity, joints } =
            joints_of(&self.handle, &robot).or_status()?;
        let given = from_proto::configuration("configuration", configuration, &state.state, index, &entity)?;
        let accelerations = from_proto::accelerations(accelerations, &entity)?;
        let (gravity, resistances) = (state.physics.gravity, resistances(&entity, &joints));
        let efforts = inverse_dynamics(&entity.tree, &given, gravity, &accelerations, &resistances);
        let stamp = Some(stamp::published(&state));
        Ok(Response::new(v1::ComputeInverseDynamicsResponse { efforts, stamp }))
    }

    async fn compute_inverse_kinematics(
        &self,
        request: Request<v1::ComputeInverseKinematicsRequest>,
    ) -> Result<Response<v1::ComputeInverseKinematicsResponse>, Status> {
        let handle = handle_of(&self.handle, &request);
        let request = request.into_inner();
        let (robot, link) = from_proto::link(request.robot, request.link)?;
        let target = from_proto::target(request.target)?;
        let point = from_proto::point(request.point)?;
        let names = from_proto::joints(request.joints)?;
        let options = from_proto::solver_options(request.max_iterations, request.tolerance)?;
        let PublishedRobot { state, index, layout: entity, joints } =
            joints_of(&self.handle, &robot).or_status()?;
        let guess = from_proto::configuration("guess", request.guess, &state.state, index, &entity)?;
        let movables = movables(&entity, &joints, &names).or_status()?;
        let (position, orientation) = (target.position, target.orientation);
        let goal = Goal { link: link_of(&entity, &link).or_status()?, point, position, orientation };
        let found = handle
            .heavy(move |cancelled: &Cancelled| {
                let is_cancelled = || cancelled.is_set();
                inverse_kinematics(&entity.tree, &guess, &goal, &movables, options, &is_cancelled)
            })
            .await
            .or_status()?;
        Ok(Response::new(to_proto::found(found, stamp::published(&state))))
    }
}

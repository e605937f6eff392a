//! The shortest path for calls that loops make at every step: it calls the service's method, without gRPC's
//! frames, headers and layers. Requests are decoded, refused, counted and recorded as over every transport. A
//! request takes the long path if it is invalid, too long or from a client of another version; the long path
//! reports why.

use simd_api::service::status::OrStatus as _;
use std::time::Instant;

use bytes::Bytes;
use prost::Message;
use simd_proto::checked::{self, Known};
use simd_proto::methods::Method;
use simd_proto::v1;
use simd_proto::v1::joint_service_server::JointService as _;
use simd_proto::v1::simulation_service_server::SimulationService as _;
use tonic::metadata::MetadataMap;
use tonic::{Request, Response, Status};

use simd_api::service::counted::reason;
use simd_api::service::transport::with_reason;
use simd_api::service::{joint, simulation, version};
use simd_world::SimHandle;
use simd_world::account::Account;
use simd_world::handle::{CallContext, Caller, Disconnect, Peer, Transport};

/// The services with such methods.
#[derive(Clone, Debug)]
pub(super) struct Direct {
    /// Handle for the client's calls.
    handle: SimHandle,
    simulation: simulation::Service,
    joint: joint::Service,
    disconnect: Disconnect,
    /// Maximum size of a request, bytes.
    limit: usize,
    /// Whether the client's version is supported.
    is_served: bool,
}

impl Direct {
    /// Makes the path for a client with these headers.
    pub(super) fn new(handle: &SimHandle, said: &MetadataMap, client: &str, disconnect: Disconnect) -> Self {
        let call = CallContext {
            caller: Caller::said(client, Transport::Handle),
            peer: Some(Peer::Process),
            ..CallContext::of(Account::Process)
        };
        Self {
            simulation: simulation::Service::new(handle.clone()),
            joint: joint::Service::new(handle.clone()),
            disconnect,
            limit: usize::try_from(handle.info().limits.message_bytes).unwrap_or(usize::MAX),
            is_served: version::check(said.as_ref()).is_ok(),
            handle: handle.of_call(call),
        }
    }

    /// Returns the answer of a method that has this path, as its message; `None` if the call must take the
    /// other path.
    pub(super) async fn call(
        &self,
        method: &'static Method,
        request: &Bytes,
    ) -> Option<Result<Bytes, Status>> {
        if !self.is_served || request.len() > self.limit {
            return None;
        }
        match method.path.as_str() {
            "/simd.v1.SimulationService/StepSimulation" => {
                self.make(method, request, |request| self.simulation.step_simulation(request)).await
            }
            "/simd.v1.JointService/GetJointStates" => {
                self.make(method, request, |request| self.joint.get_joint_states(request)).await
            }
            "/simd.v1.JointService/SetJointTargets" => {
                self.make(method, request, |request| self.joint.set_joint_targets(request)).await
            }
            "/simd.v1.JointService/ResetJoints" => {
                self.make(method, request, |request| self.joint.reset_joints(request)).await
            }
            _ => None,
        }
    }

    /// Makes a call as the services' layer does: see `calls` of the services.
    async fn make<M, A, F>(
        &self,
        method: &'static Method,
        request: &Bytes,
        work: impl FnOnce(Request<M>) -> F,
    ) -> Option<Result<Bytes, Status>>
    where
        M: Known,
        A: Message,
        F: Future<Output = Result<Response<A>, Status>>,
    {
        let request = checked::decode::<M>(request).ok()?;
        Some(self.count(method, request, work).await.map(|answer| answer.encode_to_vec().into()))
    }

    /// The answer of a step, without bytes on either way.
    pub(super) async fn step(
        &self,
        method: &'static Method,
        request: v1::StepSimulationRequest,
    ) -> Result<v1::StepSimulationResponse, Status> {
        self.count(method, request, |request| self.simulation.step_simulation(request)).await
    }

    /// Makes a call that is counted and noted.
    async fn count<M, A, F>(
        &self,
        method: &'static Method,
        request: M,
        work: impl FnOnce(Request<M>) -> F,
    ) -> Result<A, Status>
    where
        F: Future<Output = Result<Response<A>, Status>>,
    {
        let mut request = Request::new(request);
        let begun = Instant::now();
        let answer = match self.handle.count_call() {
            Ok(()) => {
                let call = self.handle.call().clone();
                let _under_way = call.caller.clone().map(|caller| self.handle.begin_call(caller));
                let of = request.extensions_mut();
                of.insert(call);
                of.insert(self.disconnect.clone());
                work(request).await.map_err(with_reason)
            }
            Err(refused) => Err(refused).or_status(),
        };
        let refusal = answer.as_ref().err();
        let how = refusal.map_or((0, ""), |status| (status.code().into(), reason(status)));
        self.handle.call_ended(method, Transport::Handle, how, begun.elapsed());
        answer.map(Response::into_inner)
    }
}

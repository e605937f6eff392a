//! Processes that answer the daemon's own messages and do nothing else: a tonic service and a Zenoh
//! queryable. One thread serves the connections of the former, as in the daemon. The daemon's cost is the
//! difference between a call of the daemon and a call of one of these.

use std::pin::Pin;

use prost::Message as _;
use simd_client::proto::joint_service_server::{JointService, JointServiceServer};
use simd_client::proto::{self, ControlRequest, ControlResponse, GetJointStatesResponse, JointStates};
use tokio::net::TcpListener;
use tokio::runtime::Builder;
use tokio_stream::wrappers::TcpListenerStream;
use tokio_stream::{Stream, StreamExt as _};
use tonic::transport::Server;
use tonic::{Request, Response, Status, Streaming};

/// The arguments that make this program one of them; the states that it answers with come after it.
pub(crate) const TONIC: &str = "--tonic";
pub(crate) const ZENOH: &str = "--zenoh-queryable";

/// Returns the argument that starts a peer: the states of each of its answers.
pub(crate) fn argument(states: &JointStates) -> String {
    states.encode_to_vec().iter().map(|byte| format!("{byte:02x}")).collect()
}

fn states() -> JointStates {
    let text = std::env::args().nth(2).expect("the states to answer with");
    let digits = text.as_bytes().chunks(2).map(|pair| str::from_utf8(pair).expect("digits"));
    let bytes: Vec<u8> = digits.map(|pair| u8::from_str_radix(pair, 16).expect("hexadecimal")).collect();
    JointStates::decode(&*bytes).expect("joint states")
}

/// Serves tonic on this thread, as one of the daemon's threads does.
pub(crate) fn tonic() {
    let runtime = Builder::new_current_thread().enable_all().build().expect("a runtime");
    runtime.block_on(async {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        println!("{}", listener.local_addr().expect("it is bound"));
        let incoming = TcpListenerStream::new(listener).filter_map(|stream| {
            let stream = stream.ok()?;
            stream.set_nodelay(true).ok()?;
            Some(Ok::<_, std::io::Error>(stream))
        });
        let service = JointServiceServer::new(Bare(states()));
        Server::builder().add_service(service).serve_with_incoming(incoming).await.expect("it serves");
    });
}

/// Answers each query of a session that connects.
pub(crate) fn zenoh() {
    let runtime = Builder::new_multi_thread().enable_all().build().expect("a runtime");
    let answer = GetJointStatesResponse { states: Some(states()) }.encode_to_vec();
    runtime.block_on(async {
        let port =
            TcpListener::bind("127.0.0.1:0").await.and_then(|it| it.local_addr()).expect("a free port");
        let locator = format!("tcp/{port}");
        let session = simd_tests::network::session("peer", &locator).await;
        let queries = session.declare_queryable("bare/**").await.expect("a queryable");
        println!("{locator}");
        while let Ok(query) = queries.recv_async().await {
            query.reply(query.key_expr().clone(), answer.clone()).express(true).await.expect("it is sent");
        }
    });
}

/// Answers every request with the same states.
#[derive(Debug)]
struct Bare(JointStates);

type Answer<'f, T> = Pin<Box<dyn Future<Output = Result<Response<T>, Status>> + Send + 'f>>;
type Answers<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

/// Methods that no row calls, as `async_trait` writes them: it does not look into macros.
macro_rules! unimplemented {
    ($($method:ident: $request:ident, $response:ident;)*) => {$(
        fn $method<'s, 'f>(&'s self, _: Request<proto::$request>) -> Answer<'f, proto::$response>
        where
            's: 'f,
            Self: 'f,
        {
            Box::pin(async { Err(Status::unimplemented("no row calls it")) })
        }
    )*};
}

#[tonic::async_trait]
impl JointService for Bare {
    type ControlStream = Answers<ControlResponse>;
    type WatchJointStatesStream = Answers<proto::WatchJointStatesResponse>;

    async fn get_joint_states(
        &self,
        _: Request<proto::GetJointStatesRequest>,
    ) -> Result<Response<GetJointStatesResponse>, Status> {
        Ok(Response::new(GetJointStatesResponse { states: Some(self.0.clone()) }))
    }

    async fn set_joint_targets(
        &self,
        _: Request<proto::SetJointTargetsRequest>,
    ) -> Result<Response<proto::SetJointTargetsResponse>, Status> {
        Ok(Response::new(proto::SetJointTargetsResponse { stamp: self.0.stamp, ..Default::default() }))
    }

    async fn control(
        &self,
        requests: Request<Streaming<ControlRequest>>,
    ) -> Result<Response<Self::ControlStream>, Status> {
        let states = self.0.clone();
        let answer = move |request: Result<ControlRequest, Status>| {
            request.map(|_| ControlResponse { states: Some(states.clone()), ..Default::default() })
        };
        Ok(Response::new(Box::pin(requests.into_inner().map(answer))))
    }

    async fn watch_joint_states(
        &self,
        _: Request<proto::WatchJointStatesRequest>,
    ) -> Result<Response<Self::WatchJointStatesStream>, Status> {
        Err(Status::unimplemented("no row calls it"))
    }

    unimplemented! {
        get_joint_layout: GetJointLayoutRequest, GetJointLayoutResponse;
        reset_joints: ResetJointsRequest, ResetJointsResponse;
        follow_trajectory: FollowTrajectoryRequest, FollowTrajectoryResponse;
        cancel_trajectory: CancelTrajectoryRequest, CancelTrajectoryResponse;
        list_trajectories: ListTrajectoriesRequest, ListTrajectoriesResponse;
        set_joint_properties: SetJointPropertiesRequest, SetJointPropertiesResponse;
        claim_joints: ClaimJointsRequest, ClaimJointsResponse;
        release_joints: ReleaseJointsRequest, ReleaseJointsResponse;
        next_joint_states: NextJointStatesRequest, NextJointStatesResponse;
    }
}

//! gRPC-Web over HTTP/1.1, as a page in a browser asks.

use std::convert::Infallible;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use hyper_util::client::legacy::Client as HttpClient;
use hyper_util::client::legacy::connect::HttpConnector;
use hyper_util::rt::TokioExecutor;
use simd_client::Client;
use tokio::sync::Semaphore;
use tonic::Status;
use tonic::body::Body;
use tonic::codegen::{Service, http};
use tonic_web::{GrpcWebCall, GrpcWebClientService};

/// Requests that wait for their answer at once, as from some tabs of six connections each. The daemon
/// serves no more than 192 connections of HTTP/1.1.
const CONNECTIONS: usize = 48;

/// Returns a client over gRPC-Web with separate connections.
pub fn client(address: SocketAddr) -> Client {
    Client::within(Web::new(address))
}

/// Services of a daemon over gRPC-Web.
#[derive(Clone)]
pub(crate) struct Web {
    http: GrpcWebClientService<HttpClient<HttpConnector, GrpcWebCall<Body>>>,
    /// Requests that wait for their answer.
    pub(crate) asking: Arc<Semaphore>,
    address: SocketAddr,
}

impl Web {
    pub(crate) fn new(address: SocketAddr) -> Self {
        let mut connector = HttpConnector::new();
        // A request is small and must not wait for the next one to fill a packet.
        connector.set_nodelay(true);
        let http = HttpClient::builder(TokioExecutor::new()).build(connector);
        let asking = Arc::new(Semaphore::new(CONNECTIONS));
        Self { http: GrpcWebClientService::new(http), asking, address }
    }
}

impl Service<http::Request<Body>> for Web {
    type Response = http::Response<Body>;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Self::Response, Infallible>> + Send>>;

    fn poll_ready(&mut self, _: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        Poll::Ready(Ok(()))
    }

    fn call(&mut self, mut request: http::Request<Body>) -> Self::Future {
        let path = request.uri().path();
        let there = http::Uri::try_from(format!("http://{}{path}", self.address));
        let (mut service, asking) = (self.http.clone(), self.asking.clone());
        Box::pin(async move {
            let _asking = asking.acquire_owned().await;
            let there = match there {
                Ok(there) => there,
                Err(error) => return Ok(Status::internal(error.to_string()).into_http()),
            };
            *request.uri_mut() = there;
            // Protocol of a browser with a server without TLS.
            *request.version_mut() = http::Version::HTTP_11;
            Ok(match service.call(request).await {
                Ok(answer) => answer.map(Body::new),
                Err(error) => Status::unavailable(error.to_string()).into_http(),
            })
        })
    }
}

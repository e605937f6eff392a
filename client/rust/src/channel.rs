//! Carriers of calls: a gRPC connection, Zenoh queries, or a function within the process.

use std::convert::Infallible;
use std::fmt;
use std::future::{Future, poll_fn};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use tonic::body::Body;
use tonic::codegen::{Service, StdError, http};
use tonic::transport;

use crate::zenoh::ZenohChannel;

/// The carrier of calls to one daemon.
#[derive(Clone, Debug)]
pub(crate) enum Channel {
    Grpc(transport::Channel),
    Zenoh(ZenohChannel),
    Local(Local),
}

type Answer = Pin<Box<dyn Future<Output = Result<http::Response<Body>, StdError>> + Send>>;

/// Services within this process.
#[derive(Clone)]
pub(crate) struct Local(Arc<dyn Fn(http::Request<Body>) -> Answer + Send + Sync>);

impl fmt::Debug for Local {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Local")
    }
}

impl Local {
    pub(crate) fn new<S>(service: S) -> Self
    where
        S: Service<http::Request<Body>, Response = http::Response<Body>, Error = Infallible>,
        S: Clone + Send + Sync + 'static,
        S::Future: Send,
    {
        Self(Arc::new(move |request| {
            let mut service = service.clone();
            Box::pin(async move {
                poll_fn(|context| service.poll_ready(context)).await?;
                Ok(service.call(request).await?)
            })
        }))
    }
}

impl From<transport::Channel> for Channel {
    fn from(channel: transport::Channel) -> Self {
        Self::Grpc(channel)
    }
}

impl From<ZenohChannel> for Channel {
    fn from(channel: ZenohChannel) -> Self {
        Self::Zenoh(channel)
    }
}

impl Service<http::Request<Body>> for Channel {
    type Response = http::Response<Body>;
    type Error = StdError;
    type Future = Answer;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), StdError>> {
        match self {
            Self::Grpc(channel) => channel.poll_ready(context).map_err(Into::into),
            Self::Zenoh(channel) => channel.poll_ready(context).map_err(Into::into),
            Self::Local(_) => Poll::Ready(Ok(())),
        }
    }

    fn call(&mut self, request: http::Request<Body>) -> Self::Future {
        match self {
            Self::Grpc(channel) => {
                let answer = channel.call(request);
                Box::pin(async move { answer.await.map_err(Into::into) })
            }
            Self::Zenoh(channel) => {
                let answer = channel.call(request);
                Box::pin(async move { answer.await.map_err(Into::into) })
            }
            Self::Local(local) => (local.0)(request),
        }
    }
}

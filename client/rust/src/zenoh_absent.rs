//! Replaces the connection over Zenoh in a build without the feature `zenoh`.

use std::convert::Infallible;
use std::future::Ready;
use std::task::{Context, Poll};

use tonic::body::Body;
use tonic::codegen::{Service, http};

use crate::{Client, ConnectOptions, Error};

/// The daemons behind one Zenoh locator, none of which this build can reach.
#[derive(Clone, Debug)]
pub struct Network(Infallible);

/// A daemon that announces itself on a Zenoh network.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Presence {
    /// The name of the daemon.
    pub name: String,
    /// The id of its Zenoh session.
    pub zid: String,
}

/// Carries calls over Zenoh; never exists in this build.
#[derive(Clone, Debug)]
pub(crate) enum ZenohChannel {}

impl Network {
    /// Refuses to join a network.
    ///
    /// # Errors
    /// Returns [`Error::Endpoint`]: this build has no Zenoh.
    pub async fn join(locator: &str, options: ConnectOptions) -> Result<Self, Error> {
        Self::open(locator, options).await
    }

    pub(crate) async fn open(locator: &str, _options: ConnectOptions) -> Result<Self, Error> {
        let reason = "this build has no Zenoh: connect over gRPC, as to 127.0.0.1:7400, or build with the feature `zenoh`";
        Err(Error::Endpoint { endpoint: locator.to_owned(), reason: reason.to_owned() })
    }

    /// Never called.
    ///
    /// # Errors
    /// None.
    pub async fn daemons(&self) -> Result<Vec<Presence>, Error> {
        match self.0 {}
    }

    /// Never called.
    pub fn client(&self, _name: &str) -> Client {
        match self.0 {}
    }

    pub(crate) fn find(&self, _name: Option<&str>) -> Result<Client, Error> {
        match self.0 {}
    }
}

impl Service<http::Request<Body>> for ZenohChannel {
    type Response = http::Response<Body>;
    type Error = Infallible;
    type Future = Ready<Result<Self::Response, Infallible>>;

    fn poll_ready(&mut self, _context: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        match *self {}
    }

    fn call(&mut self, _request: http::Request<Body>) -> Self::Future {
        match *self {}
    }
}

//! Serves the page and the API of an embedded world to others, on separate threads.

use std::net::SocketAddr;
use std::os::fd::{AsRawFd as _, RawFd};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use tokio::net::TcpListener;
use tokio::task::JoinHandle;

use super::Embedded;
use crate::config::{Config, Connections};
use crate::daemon::{self, Error};
use crate::grpc::{self, FrontEndThreads, Listeners};
use crate::http;

/// Connections end within this time of the world's end, or are cut off.
const DRAIN: Duration = Duration::from_millis(2200);

/// How a world is served, and the server while it is.
#[derive(Debug)]
pub(super) struct Serving {
    page: http::Settings,
    connections: Connections,
    /// Other machines may not reach the world.
    is_loopback_only: bool,
    /// The configuration has TLS or tokens, which a served world does not.
    is_guarded: bool,
    server: Mutex<Option<(Served, JoinHandle<()>)>>,
}

/// Address and socket of a served world.
#[derive(Clone, Copy, Debug)]
pub struct Served {
    /// With the port that it got.
    pub address: SocketAddr,
    /// The socket's descriptor. A forked process closes its copy, so that the port is free when this one ends.
    pub descriptor: RawFd,
}

impl Serving {
    pub(super) fn of(config: &Config) -> Self {
        Self {
            page: daemon::page(config, false, http::ZenohWays::default()),
            connections: config.connections,
            is_loopback_only: !config.insecure,
            is_guarded: config.tls.is_some() || config.tokens.is_some(),
            server: Mutex::default(),
        }
    }

    /// Waits until nothing is served any more, or cuts it off. The world drains.
    pub(super) async fn end(&self) {
        let server = self.server.lock().unwrap_or_else(PoisonError::into_inner).take();
        let Some((_, mut server)) = server else { return };
        if tokio::time::timeout(DRAIN, &mut server).await.is_err() {
            tracing::warn!("calls did not end in time and are cut off");
            server.abort();
        }
    }
}

impl Embedded {
    /// Serves the page and the services (gRPC, gRPC-Web, HTTP) at this address until the world ends. A world is
    /// served once. Returns its address, also if it was served before.
    ///
    /// # Errors
    /// * The address cannot be listened on.
    /// * It is not a loopback address, and the configuration does not allow others (`insecure`).
    /// * The configuration asks for TLS or tokens.
    pub fn serve(&self, address: SocketAddr) -> Result<Served, Error> {
        let Serving { page, connections, is_loopback_only, is_guarded, server } = &self.serving;
        let mut server = server.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((served, _)) = &*server {
            return Ok(*served);
        }
        if *is_guarded {
            let sentence =
                "a world in a program is served without TLS and tokens; start a daemon with `simd` for those";
            return Err(Error::Security(sentence.to_owned()));
        }
        if *is_loopback_only && !address.ip().is_loopback() {
            return Err(Error::Security(format!(
                "{address} can be reached from other machines: without TLS and tokens, anyone who reaches it commands the robots; serve \
                 at 127.0.0.1, or allow it with the setting `insecure`"
            )));
        }
        let listen = |source| Error::Listen { address: address.to_string(), source };
        let closed = || Error::Server("the world is closed".to_owned());
        let runtime = self.runtime.as_ref().filter(|_| !self.connection.is_cancelled()).ok_or_else(closed)?;
        let tcp = runtime.block_on(TcpListener::bind(address)).map_err(listen)?;
        let served = Served { address: tcp.local_addr().map_err(listen)?, descriptor: tcp.as_raw_fd() };
        let threads = FrontEndThreads::start().map_err(Error::System)?;
        let door = threads.door().clone();
        let listeners = Listeners { tcp, unix: None };
        let serving = grpc::serve(threads, self.handle.clone(), listeners, None, page.clone(), *connections);
        *server = Some((served, door.spawn(serving)));
        Ok(served)
    }
}

//! The whole daemon, from start to drain.
//!
//! The order of a start is asset roots, ports, driver (paused), robots, play, serve. So an operator sees a
//! mistake in the first second, and the first step includes every robot.

mod autosave;
mod error;
mod folders;
mod memory;
mod open_files;
mod service_manager;
mod signals;
#[cfg(test)]
mod tests;
pub(crate) mod world;

use std::io::Write as _;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use tokio::task::JoinHandle;

use crate::config::{Autosave, Config};
use crate::grpc::{FrontEndThreads, Listeners, Tls, UnixSocket};
use crate::http;
use crate::ros2;
use crate::zenoh;
pub use error::Error;
use service_manager::ServiceManager;
use signals::{SignalAction, Signals};
use simd_world::access::Access;
use simd_world::handle::SimHandle;
use simd_world::loading::Loader;

/// Maximum time for calls and streams to end after a drain begins; then they are cut off.
const DRAIN: Duration = Duration::from_millis(2200);
/// Maximum time for the driver to end after that; then it is left behind.
const LAST_STEP: Duration = Duration::from_millis(300);

/// A running daemon.
#[derive(Debug)]
pub struct Running {
    /// Handle on its world.
    pub handle: SimHandle,
    /// Address that it listens on, with the actual port.
    pub address: SocketAddr,
    /// Unix socket that it listens on too.
    pub unix_socket: Option<PathBuf>,
    tls: Option<Arc<Tls>>,
    zenoh: Option<zenoh::Serving>,
    ros2: Option<ros2::Serving>,
    server: JoinHandle<()>,
    autosave: Option<Autosave>,
}

/// Starts a daemon within this process, without signal handlers and output on stdout.
///
/// # Errors
/// Returns an error if an address, a folder or a robot of the configuration cannot be used.
pub async fn start(config: Config) -> Result<Running, Error> {
    let Files { loader, access, tls } = read(&config)?;
    folders::make(&config)?;
    let listen = |source| Error::Listen { address: config.listen.to_string(), source };
    let listener = crate::grpc::listen(config.listen).map_err(listen)?;
    let address = listener.local_addr().map_err(listen)?;
    let unix_socket = config.unix_socket.clone();
    let unix = unix_socket.as_deref().map(UnixSocket::bind).transpose().map_err(|source| {
        let path = unix_socket.as_deref().unwrap_or(Path::new("")).display();
        Error::Listen { address: format!("unix:{path}"), source }
    })?;
    let zenoh = match config.zenoh.enabled {
        true => Some(zenoh::open(&config.zenoh, &config.name).await?),
        false => None,
    };

    let handle = world::open(&config, loader, access.clone())?;
    let ready = async {
        world::fill(&config, &handle).await?;
        match zenoh {
            Some(opened) => Ok(Some(opened.serve(&handle).await?)),
            None => Ok(None),
        }
    };
    let zenoh = match ready.await {
        Ok(zenoh) => zenoh,
        Err(error) => {
            return Err(world::not_started(&handle, error));
        }
    };
    world::keep(&config, &handle);
    tokio::spawn(handle.draining().run_until_cancelled_owned(access.keep_current()));
    let ways = zenoh.as_ref().map_or_else(http::ZenohWays::default, |zenoh| http::ZenohWays {
        listen: zenoh.locators().to_vec(),
        routers: config.zenoh.connect.clone(),
    });
    let page = page(&config, tls.is_some(), ways);
    let ros2 = config.ros2.enabled.then(|| ros2::start(config.ros2, &handle)).transpose();
    let ros2 = ros2.map_err(Error::System)?;
    let threads = FrontEndThreads::start().map_err(Error::System)?;
    let listeners = Listeners { tcp: listener, unix };
    let door = threads.door().clone();
    let serving =
        crate::grpc::serve(threads, handle.clone(), listeners, tls.clone(), page, config.connections);
    let server = door.spawn(serving);
    Ok(Running { handle, address, unix_socket, tls, zenoh, ros2, server, autosave: config.autosave })
}

/// The page and the rules for browsers, which are served in addition to the calls.
pub(crate) fn page(config: &Config, is_tls: bool, zenoh: http::ZenohWays) -> http::Settings {
    http::Settings {
        bundle: http::Bundle::embedded(),
        hosts: http::Hosts::new(&config.allow_hosts),
        frame_ancestors: http::FrameAncestors::new(&config.frame_ancestors),
        is_tls,
        zenoh,
    }
}

/// Contents of the files that a start reads before it takes an address.
struct Files {
    loader: Loader,
    access: Access,
    tls: Option<Arc<Tls>>,
}

fn read(config: &Config) -> Result<Files, Error> {
    let loader = world::loader(config)?;
    let access = config.tokens.clone().map_or_else(|| Ok(Access::open()), Access::from_file);
    let access = access.map_err(Error::Security)?;
    let tls = config.tls.clone().map(Tls::read).transpose().map_err(Error::Security)?.map(Arc::new);
    folders::judge(config)?;
    Ok(Files { loader, access, tls })
}

/// Starts a daemon as far as it can without an address: reads all files, and loads the robots into a world
/// that never runs. An autosave stays as it is.
///
/// # Errors
/// Returns the error that would keep a daemon from starting.
pub async fn check(config: Config) -> Result<(), Error> {
    let Files { loader, access, tls: _ } = read(&config)?;
    let handle = world::open(&config, loader, access)?;
    let loaded = world::load_robots(&config, &handle).await;
    handle.end_driver();
    loaded
}

impl Running {
    /// Returns the scheme of its URLs.
    pub fn scheme(&self) -> &'static str {
        if self.tls.is_some() { "https" } else { "http" }
    }

    /// Reads the certificate and its key again, for new connections. Unusable files change nothing.
    pub fn reload(&self) {
        match self.tls.as_ref().map(|tls| tls.reload()) {
            Some(Ok(())) => tracing::info!("the certificate was read again"),
            Some(Err(sentence)) => tracing::error!("the certificate was not replaced: {sentence}"),
            None => tracing::info!("there is no certificate to read again"),
        }
    }

    /// Returns the Zenoh locators that it listens on, with the actual ports.
    pub fn locators(&self) -> &[String] {
        self.zenoh.as_ref().map_or(&[], zenoh::Serving::locators)
    }

    /// Returns the counts of replies over Zenoh so far, if it is served.
    pub fn zenoh_replies(&self) -> Option<zenoh::Replies> {
        self.zenoh.as_ref().map(zenoh::Serving::replies)
    }

    /// Waits until the daemon fails, and returns the reason.
    pub async fn failed(&mut self) -> Error {
        let driver_ended = self.handle.driver_ended();
        tokio::select! {
            () = driver_ended.cancelled() => {
                Error::Driver(self.handle.driver_failure().unwrap_or("it was not asked to end").to_owned())
            }
            served = &mut self.server => Error::Server(match served {
                Ok(()) => "it was not asked to end".to_owned(),
                Err(panicked) => panicked.to_string(),
            }),
        }
    }

    /// Ends every stream with OK, accepts no more calls, saves the world if autosave is enabled, and ends it.
    /// Everything that has not ended after two seconds is cut off.
    pub async fn drain(self) {
        self.handle.draining().cancel();
        let zenoh = async {
            if let Some(zenoh) = self.zenoh {
                zenoh.drain().await;
            }
        };
        let ros2 = async {
            if let Some(ros2) = self.ros2 {
                ros2.drain().await;
            }
        };
        let abort = self.server.abort_handle();
        let server = async {
            // A failed task has already returned its result.
            if self.server.is_finished() {
                return;
            }
            match tokio::time::timeout(DRAIN, self.server).await {
                Ok(Ok(())) => {}
                Ok(Err(error)) => tracing::warn!(%error, "the server failed while draining"),
                Err(_elapsed) => {
                    tracing::warn!("calls did not end in time and are cut off");
                    abort.abort();
                }
            }
        };
        tokio::join!(server, zenoh, ros2);
        // The save includes the effects of the last calls.
        world::save_last(self.autosave.as_ref(), &self.handle).await;
        self.handle.end_driver();
        if tokio::time::timeout(DRAIN, self.handle.recording_ended()).await.is_err() {
            tracing::warn!("the recording was not completed in time: the disk is slow");
        }
        if tokio::time::timeout(LAST_STEP, self.handle.driver_ended().cancelled()).await.is_err() {
            tracing::warn!("the last step did not end in time and was abandoned");
        }
    }
}

/// Returns the line with the viewer's URL. A browser cannot use an address that stands for all.
fn viewer(scheme: &str, address: SocketAddr) -> String {
    let ip = match address.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(ip) if ip.is_unspecified() => Ipv6Addr::LOCALHOST.into(),
        ip => ip,
    };
    let address = SocketAddr::new(ip, address.port());
    let lack = if http::Bundle::is_built() { "" } else { " (only tables: built without Node)" };
    format!("viewer: {scheme}://{address}/{lack}")
}

/// Writes to stdout on a separate thread, which the process does not wait for: stdout may be an unread pipe,
/// or a stopped terminal.
fn announce(text: String) -> std::io::Result<()> {
    std::thread::Builder::new().name("simd-stdout".into()).spawn(move || {
        let mut stdout = std::io::stdout().lock();
        // If stdout is closed, no program wants the lines.
        let _ = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush());
    })?;
    Ok(())
}

/// Raises the limit of open files as far as the process may, and warns if it is too low for all connections.
/// Call it before anything opens a file.
///
/// # Errors
/// Returns an error if the limit is too low for the daemon itself.
pub fn provide_open_files(config: &Config) -> Result<(), Error> {
    open_files::provide(config.connections.max)
}

/// Runs a daemon as the process. When it is ready, it prints one line on stdout, and one with the viewer's
/// URL. It notifies the service manager that started it, if any. It drains at SIGTERM, SIGINT or, if enabled,
/// the end of stdin.
///
/// # Errors
/// Returns an [`Error`], whose exit code is the process's.
pub async fn run(config: Config) -> Result<(), Error> {
    let mut signals = Signals::new(config.until_stdin_closes).map_err(Error::System)?;
    let manager = ServiceManager::of_this_process().map_err(Error::System)?;
    let name = config.name.clone();
    tracing::info!(version = env!("CARGO_PKG_VERSION"), name, "simd starts");
    let mut running = tokio::select! {
        running = start(config) => running?,
        // No client was served yet, so a drain is not needed.
        () = signals.end() => return Ok(()),
    };
    let transports = if running.locators().is_empty() { "gRPC" } else { "gRPC and Zenoh" };
    tracing::info!(address = %running.address, locators = ?running.locators(), "serving {transports}");
    let scheme = running.scheme();
    let endpoints = std::iter::once(format!("{scheme}://{}", running.address));
    let unix = running.unix_socket.iter().map(|path| format!("unix:{}", path.display()));
    let endpoints: Vec<String> = endpoints.chain(running.locators().iter().cloned()).chain(unix).collect();
    let listening = format!("listening on {}", endpoints.join(" and "));
    let viewer = viewer(scheme, running.address);
    announce(format!("simd {name} is {listening}\n{viewer}\n")).map_err(Error::System)?;
    manager.ready(&listening);
    tokio::spawn(manager.clone().keep_watchdog(running.handle.clone(), listening.clone()));

    let signal = loop {
        tokio::select! {
            signal = signals.next() => match signal {
                SignalAction::End(name) => break name,
                SignalAction::Reload => {
                    manager.reloading();
                    running.reload();
                    manager.ready(&listening);
                }
            },
            error = running.failed() => {
                running.drain().await;
                return Err(error);
            }
        }
    };
    tracing::info!(signal, "draining");
    manager.stopping().await;
    let handle = running.handle.clone();
    tokio::select! {
        () = running.drain() => match handle.driver_failure() {
            Some(failure) => Err(Error::Driver(failure.to_owned())),
            None => {
                tracing::info!("drained");
                Ok(())
            }
        },
        () = signals.end() => Err(Error::CutOff),
    }
}

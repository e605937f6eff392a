//! The Zenoh front-end: the services as queryables, states and events as publications, joint targets as a
//! subscription.
//!
//! * Here: from the session to the drain.
//! * `queries`: calls of the services.
//! * `senders`: threads that send replies.
//! * `sessions`: present sessions of clients, for objects bound to them.
//! * `publications`: the published messages.
//! * `targets`: joint targets without an answer.
//! * `proofs`: proofs that a message's sender holds a claim.
//! * `presence`: unique names of daemons on a network.
//!
//! Zenoh sends on the calling thread, and waits there for a receiver that does not read. It waits up to a
//! millisecond for a publication, and up to five seconds for a reply. So `senders` sends replies, and the one
//! task that publishes a kind of message sends its publications.

mod presence;
mod proofs;
pub(crate) mod publications;
mod queries;
mod senders;
mod sessions;
mod targets;

use std::sync::Arc;
use std::time::Duration;

use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use zenoh::Session;
use zenoh::query::Queryable;
use zenoh_runtime::ZRuntime;

use self::presence::Presence;
pub use self::senders::Replies;
use self::senders::Senders;
use self::sessions::Sessions;
use crate::config;
use simd_world::SimHandle;

/// Maximum time to answer pending queries once the daemon drains.
const DRAIN_GRACE: Duration = Duration::from_millis(1800);
/// Time after a drain in which new queries get the answer that the daemon shuts down, and not that no daemon
/// exists.
const LAST_WORDS: Duration = Duration::from_millis(100);
/// Longest wait for a session to close; then it is left behind.
const CLOSE: Duration = Duration::from_millis(500);

/// Error of the Zenoh front-end.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The settings are refused.
    #[error("{0}")]
    Settings(String),
    /// The session cannot be opened, usually because another process has the port.
    #[error(
        "cannot listen for Zenoh on {locators}: {reason}; choose another with --zenoh tcp/127.0.0.1:PORT (0 \
         takes a free one), or disable Zenoh with --zenoh off"
    )]
    Listen {
        /// Locators as the operator wrote them.
        locators: String,
        /// Error of Zenoh.
        reason: String,
    },
    /// None of the configured routers answers.
    #[error("no Zenoh router answers at {routers}: {reason}; start it first, or leave out --zenoh-connect")]
    Join {
        /// Routers as the operator wrote them.
        routers: String,
        /// Error of Zenoh.
        reason: String,
    },
    /// A daemon with the same name is already on the network.
    #[error(
        "a daemon called `{name}` is on this Zenoh network already (its session is {zid}); name this one with \
         --name"
    )]
    NameTaken {
        /// Name of both.
        name: String,
        /// Session id of the other daemon.
        zid: String,
    },
    /// The session has another fault.
    #[error("Zenoh fails: {0}")]
    Session(String),
}

impl Error {
    /// Returns the exit code of the process.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Listen { .. } => 4,
            Self::NameTaken { .. } => 6,
            Self::Settings(_) => 3,
            Self::Join { .. } | Self::Session(_) => 1,
        }
    }

    fn session(error: zenoh::Error) -> Self {
        Self::Session(error.to_string())
    }
}

/// A session that listens, before anything is served.
#[derive(Debug)]
pub struct Opened {
    session: Session,
    name: String,
    locators: Vec<String>,
    state_rate: f64,
}

/// The running front-end.
#[derive(Debug)]
pub struct Serving {
    session: Session,
    locators: Vec<String>,
    presence: Presence,
    queries: Queryable<()>,
    senders: Arc<Senders>,
    /// Tasks that answer queries.
    answers: TaskTracker,
    /// Ends publications and subscriptions.
    ended: CancellationToken,
}

/// Opens the session, and checks that the name is free.
///
/// # Errors
/// Returns an error if the session cannot listen on a locator, or the name is taken.
pub async fn open(settings: &config::Zenoh, name: &str) -> Result<Opened, Error> {
    start_threads();
    let session = zenoh::open(settings.settings().map_err(Error::Settings)?).await.map_err(|error| {
        // The first error of a chain that ends in a file and line.
        let reason = error.to_string();
        let reason = reason.split(" at /").next().unwrap_or(&reason).to_owned();
        // It lists the routers as a program would.
        let reason = match reason.rsplit_once("]. ") {
            Some((before, last)) if before.starts_with("Unable to connect to any of [") => {
                last.trim_end_matches('!').to_owned()
            }
            _ => reason,
        };
        match settings.listens_on() {
            locators if locators.is_empty() => Error::Join { routers: settings.connect.join(", "), reason },
            locators => Error::Listen { locators: locators.join(", "), reason },
        }
    })?;
    let routers = session.info().routers_zid().await.count() + session.info().peers_zid().await.count();
    if !settings.connect.is_empty() && routers == 0 {
        let routers = settings.connect.join(", ");
        tracing::warn!("no router answers at {routers}; the daemon keeps trying (see --log zenoh=info)");
    }
    presence::check(&session, name).await?;
    let mut locators: Vec<String> = session.info().locators().await.iter().map(ToString::to_string).collect();
    locators.sort();
    Ok(Opened { session, name: name.to_owned(), locators, state_rate: settings.state_rate })
}

/// Starts all threads of Zenoh. It would start some with the first session of a client, and panic there if
/// no file could be opened.
fn start_threads() {
    let all = [ZRuntime::Application, ZRuntime::Acceptor, ZRuntime::TX, ZRuntime::RX, ZRuntime::Net];
    for threads in all {
        let _started: &tokio::runtime::Handle = &threads;
    }
}

impl Opened {
    /// Serves, and then announces the daemon.
    ///
    /// # Errors
    /// Returns an error if another daemon has taken the name in the meantime.
    pub async fn serve(self, handle: &SimHandle) -> Result<Serving, Error> {
        let Self { session, name, locators, state_rate } = self;
        let (answers, ended) = (TaskTracker::new(), CancellationToken::new());
        let (queries, senders) =
            queries::serve(&session, &name, handle, Sessions::follow(&session, &name).await?, &answers)
                .await?;
        targets::serve(&session, &name, handle, &ended).await?;
        publications::serve(&session, &name, handle, state_rate, &ended).await?;
        let presence = presence::announce(&session, &name).await?;
        Ok(Serving { session, locators, presence, queries, senders, answers, ended })
    }
}

impl Serving {
    /// Returns the locators that it listens on, with the actual ports.
    pub fn locators(&self) -> &[String] {
        &self.locators
    }

    /// Returns the counts of replies so far.
    pub fn replies(&self) -> Replies {
        self.senders.replies()
    }

    /// Withdraws the name, answers pending queries, and closes the session. The handle is already draining,
    /// which ends waiting calls.
    pub async fn drain(self) {
        self.presence.withdraw().await;
        self.ended.cancel();
        tokio::time::sleep(LAST_WORDS).await;
        if let Err(error) = self.queries.undeclare().await {
            tracing::warn!("queries cannot be ended: {error}");
        }
        self.answers.close();
        if tokio::time::timeout(DRAIN_GRACE, self.answers.wait()).await.is_err() {
            tracing::warn!("queries did not end in time and are cut off");
        }
        match tokio::time::timeout(CLOSE, self.session.close()).await {
            Ok(Ok(())) => {}
            Ok(Err(error)) => tracing::warn!("the Zenoh session does not close: {error}"),
            Err(_elapsed) => tracing::warn!("the Zenoh session did not close in time and was abandoned"),
        }
    }
}

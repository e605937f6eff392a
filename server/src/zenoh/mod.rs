//! The Zenoh front-end: the services as queryables, states and events as publications,
//! joint targets as a subscription.
//!
//! * Here: from the session to the drain.
//! * `queries`: a query becomes a call of the services.
//! * `senders`: threads that replies leave on.
//! * `sessions`: which clients are there, for what is bound to them.
//! * `publications`: what is published, and to whom.
//! * `targets`: joint targets without an answer.
//! * `proofs`: whether a message's sender holds the claim that it names.
//! * `presence`: one daemon of a name on a network.
//!
//! Zenoh sends on the thread that asks it to, and waits there for a receiver that does
//! not read: up to a millisecond for a publication, up to five seconds for a reply. So
//! replies are sent by `senders`, and a publication by the one task that publishes its kind.

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

use self::presence::Presence;
pub use self::senders::Replies;
use self::senders::Senders;
use self::sessions::Sessions;
use crate::config;
use simd_world::SimHandle;

/// Queries under way may take so long to be answered once the daemon drains.
const DRAIN_GRACE: Duration = Duration::from_millis(1800);
/// A client that asks again within this time of a drain gets the answer that the daemon shuts down,
/// and not that there is none.
const LAST_WORDS: Duration = Duration::from_millis(100);
/// A session that does not close in this time is left behind.
const CLOSE: Duration = Duration::from_millis(500);

/// Why Zenoh is not served.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The settings are refused.
    #[error("{0}")]
    Settings(String),
    /// The session cannot be opened: mostly, another process has the port.
    #[error(
        "cannot listen for Zenoh on {locators}: {reason}; choose another with --zenoh tcp/127.0.0.1:PORT (0 \
         takes a free one), or do without by --zenoh off"
    )]
    Listen {
        /// As the operator wrote them.
        locators: String,
        /// Zenoh's words.
        reason: String,
    },
    /// None of the routers that are to be joined answers.
    #[error("no Zenoh router answers at {routers}: {reason}; start it first, or leave out --zenoh-connect")]
    Join {
        /// As the operator wrote them.
        routers: String,
        /// Zenoh's words.
        reason: String,
    },
    /// A daemon of the same name is there already.
    #[error(
        "a daemon called `{name}` is on this Zenoh network already (its session is {zid}); name this one with \
         --name"
    )]
    NameTaken {
        /// What both are called.
        name: String,
        /// Of the other.
        zid: String,
    },
    /// The session fails at something else.
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

/// The front-end while it serves.
#[derive(Debug)]
pub struct Serving {
    session: Session,
    locators: Vec<String>,
    presence: Presence,
    queries: Queryable<()>,
    senders: Arc<Senders>,
    /// Answers to queries.
    answers: TaskTracker,
    /// Ends what publishes and what subscribes.
    ended: CancellationToken,
}

/// Opens the session and sees whether the name is free.
///
/// # Errors
/// Returns an error if a locator cannot be listened on, or the name is taken.
pub async fn open(settings: &config::Zenoh, name: &str) -> Result<Opened, Error> {
    let session = zenoh::open(settings.settings().map_err(Error::Settings)?).await.map_err(|error| {
        // The first of a chain that goes down to the file and line.
        let reason = error.to_string();
        let reason = reason.split(" at /").next().unwrap_or(&reason).to_owned();
        match settings.listens_on() {
            locators if locators.is_empty() => Error::Join { routers: settings.connect.join(", "), reason },
            locators => Error::Listen { locators: locators.join(", "), reason },
        }
    })?;
    let routers = session.info().routers_zid().await.count() + session.info().peers_zid().await.count();
    if !settings.connect.is_empty() && routers == 0 {
        let routers = settings.connect.join(", ");
        tracing::warn!("no router answers at {routers}; it is tried again and again (see --log zenoh=info)");
    }
    presence::check(&session, name).await?;
    let mut locators: Vec<String> = session.info().locators().await.iter().map(ToString::to_string).collect();
    locators.sort();
    Ok(Opened { session, name: name.to_owned(), locators, state_rate: settings.state_rate })
}

impl Opened {
    /// Serves, and then says that the daemon is there.
    ///
    /// # Errors
    /// Returns an error if another took the name meanwhile.
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
    /// Where it listens, with the ports that it got.
    pub fn locators(&self) -> &[String] {
        &self.locators
    }

    /// What became of replies so far.
    pub fn replies(&self) -> Replies {
        self.senders.replies()
    }

    /// Says goodbye, answers what was asked, and closes the session. The handle
    /// drains already, which ends whatever waits.
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
            Err(_elapsed) => tracing::warn!("the Zenoh session does not close in time and is left behind"),
        }
    }
}

//! Unique names of daemons on a network, shown by liveliness tokens.
//!
//! A daemon looks for tokens of its name, declares its own, and looks again. If two daemons start at once, at
//! least one sees the other, in any order of their tokens. If both see each other, the one with the larger
//! session id withdraws at once, and the other waits a moment for this.

use std::time::Duration;

use simd_proto::keys;
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;
use zenoh::sample::SampleKind;

use super::Error;

/// Longest wait for the network's answers.
const ANSWER_WAIT: Duration = Duration::from_secs(2);
/// Number of checks, and the time between them, whether the other daemon has withdrawn.
const LOOKS: usize = 20;
const PAUSE: Duration = Duration::from_millis(100);

/// Token of this daemon, until it is withdrawn or the process ends.
#[derive(Debug)]
pub(super) struct Presence(LivelinessToken);

impl Presence {
    /// Withdraws the token.
    pub(super) async fn withdraw(self) {
        if let Err(error) = self.0.undeclare().await {
            tracing::warn!("the token cannot be withdrawn: {error}");
        }
    }
}

/// # Errors
/// Returns an error if a daemon with this name exists.
pub(super) async fn check(session: &Session, name: &str) -> Result<(), Error> {
    match others(session, name).await?.into_iter().next() {
        Some(zid) => Err(Error::NameTaken { name: name.to_owned(), zid }),
        None => Ok(()),
    }
}

/// Declares the token.
///
/// # Errors
/// Returns an error if another daemon with this name did so at the same time and stays.
pub(super) async fn announce(session: &Session, name: &str) -> Result<Presence, Error> {
    let own = session.zid().to_string();
    let token = session.liveliness().declare_token(keys::daemon(name, &own)).await.map_err(Error::session)?;
    let presence = Presence(token);
    for _look in 0..LOOKS {
        let others = others(session, name).await?;
        let Some(zid) = others.into_iter().next() else {
            warn_of_others(session, name).await?;
            return Ok(presence);
        };
        if zid < own {
            presence.withdraw().await;
            return Err(Error::NameTaken { name: name.to_owned(), zid });
        }
        tokio::time::sleep(PAUSE).await;
    }
    presence.withdraw().await;
    check(session, name).await?;
    Err(Error::NameTaken { name: name.to_owned(), zid: "another, that just left".into() })
}

/// Warns of other daemons with this name. Networks that are joined later may each have one: then calls reach
/// either, which the daemon can only report.
async fn warn_of_others(session: &Session, name: &str) -> Result<(), Error> {
    let (own, name) = (session.zid().to_string(), name.to_owned());
    let key = keys::daemons_named(&name);
    let subscriber = session.liveliness().declare_subscriber(key).callback(move |sample| {
        let zid = keys::parse_daemon(sample.key_expr().as_str()).map(|(_name, zid)| zid);
        if sample.kind() == SampleKind::Put && zid.is_some_and(|zid| zid != own) {
            tracing::warn!(
                zid,
                "another daemon called `{name}` joined this network; rename one of the two with --name"
            );
        }
    });
    subscriber.background().await.map_err(Error::session)
}

/// Returns the session ids of other daemons with this name, smallest first.
async fn others(session: &Session, name: &str) -> Result<Vec<String>, Error> {
    let own = session.zid().to_string();
    let tokens = session.liveliness().get(keys::daemons_named(name)).timeout(ANSWER_WAIT);
    let tokens = tokens.await.map_err(Error::session)?;
    let mut others = Vec::new();
    let all = async {
        while let Ok(reply) = tokens.recv_async().await {
            let Ok(sample) = reply.into_result() else { continue };
            match keys::parse_daemon(sample.key_expr().as_str()) {
                Some((_name, zid)) if zid != own => others.push(zid.to_owned()),
                Some(_) | None => {}
            }
        }
    };
    // Zenoh's own time limit does not always end it.
    let _ = tokio::time::timeout(ANSWER_WAIT, all).await;
    others.sort();
    Ok(others)
}

//! One daemon of a name on a network: a liveliness token that says who is there.
//!
//! A daemon looks for tokens of its name, puts up its own, and looks again. Of two that
//! start at once at least one sees the other, whichever way their tokens cross. Where
//! both see each other, the one with the larger session id gives way at once, and the
//! other waits a moment to see it go.

use std::time::Duration;

use simd_proto::keys;
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;
use zenoh::sample::SampleKind;

use super::Error;

/// How long the network may take to say who is there.
const LOOK: Duration = Duration::from_secs(2);
/// How often, and how long after each other, one looks whether the other gave way.
const LOOKS: usize = 20;
const PAUSE: Duration = Duration::from_millis(100);

/// Says that this daemon is there, until it is withdrawn or the process ends.
#[derive(Debug)]
pub(super) struct Presence(LivelinessToken);

impl Presence {
    /// Says goodbye.
    pub(super) async fn withdraw(self) {
        if let Err(error) = self.0.undeclare().await {
            tracing::warn!("the token cannot be withdrawn: {error}");
        }
    }
}

/// # Errors
/// Returns an error if a daemon of this name is there.
pub(super) async fn check(session: &Session, name: &str) -> Result<(), Error> {
    match others(session, name).await?.into_iter().next() {
        Some(zid) => Err(Error::NameTaken { name: name.to_owned(), zid }),
        None => Ok(()),
    }
}

/// Puts up the token.
///
/// # Errors
/// Returns an error if another daemon of this name did so at the same time and stays.
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

/// Two networks that are joined later may each have a daemon of this name: then calls
/// reach either, and all that can be done is to say so.
async fn warn_of_others(session: &Session, name: &str) -> Result<(), Error> {
    let (own, name) = (session.zid().to_string(), name.to_owned());
    let key = keys::daemons_named(&name);
    let subscriber = session.liveliness().declare_subscriber(key).callback(move |sample| {
        let zid = keys::parse_daemon(sample.key_expr().as_str()).map(|(_name, zid)| zid);
        if sample.kind() == SampleKind::Put && zid.is_some_and(|zid| zid != own) {
            tracing::warn!(
                zid,
                "another daemon called `{name}` came to this network; name one of the two with --name"
            );
        }
    });
    subscriber.background().await.map_err(Error::session)
}

/// Session ids of the others of this name, smallest first.
async fn others(session: &Session, name: &str) -> Result<Vec<String>, Error> {
    let own = session.zid().to_string();
    let tokens = session.liveliness().get(keys::daemons_named(name)).timeout(LOOK);
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
    let _ = tokio::time::timeout(LOOK, all).await;
    others.sort();
    Ok(others)
}

//! Zenoh sessions on loopback without discovery: routers, and programs that know only keys.

use std::sync::Arc;

use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Notify;
use zenoh::{Config, Session};

use crate::process::soon;

/// A Zenoh router within the test's own process, in place of `zenohd`.
#[derive(Debug)]
pub struct Router {
    /// Its address.
    pub locator: String,
    session: Session,
}

impl Router {
    /// On a free port.
    pub async fn start() -> Self {
        Self::start_at("tcp/127.0.0.1:0").await
    }

    /// Starts one at a locator, for instance of a stopped one.
    ///
    /// # Panics
    /// Panics if it cannot listen there: then the test has failed.
    pub async fn start_at(locator: &str) -> Self {
        let session = session("router", locator).await;
        let locator = session.info().locators().await.first().map(ToString::to_string).unwrap_or_default();
        Self { locator, session }
    }

    /// Starts one at a locator, with additional settings that override the others.
    pub async fn start_with(locator: &str, changes: &[(&str, &str)]) -> Self {
        let session = session_with("router", locator, changes).await;
        let locator = session.info().locators().await.first().map(ToString::to_string).unwrap_or_default();
        Self { locator, session }
    }

    /// Ends it, and with it every connection through it.
    ///
    /// # Panics
    /// Panics if it hangs.
    pub async fn stop(self) {
        let _ = soon("the end of the router", self.session.close().into_future()).await;
    }
}

/// Returns a session that listens at a locator, or, as a `client`, connects to it.
///
/// # Panics
/// Panics if it cannot: then the test has failed.
pub async fn session(mode: &str, locator: &str) -> Session {
    open(settings(mode, locator)).await
}

/// Like [`session`], with additional settings that override the others.
///
/// # Panics
/// Panics if Zenoh does not take it: then the test has failed.
#[allow(clippy::panic, reason = "the test has failed")]
pub async fn session_with(mode: &str, locator: &str, changes: &[(&str, &str)]) -> Session {
    let mut settings = settings(mode, locator);
    for (key, value) in changes {
        settings.insert_json5(key, value).unwrap_or_else(|error| panic!("{key}: {error}"));
    }
    open(settings).await
}

#[allow(clippy::panic, reason = "the test has failed")]
fn settings(mode: &str, locator: &str) -> Config {
    let (listen, connect) = match mode {
        "client" => (String::new(), format!("{locator:?}")),
        _ => (format!("{locator:?}"), String::new()),
    };
    let settings = format!(
        r#"{{ mode: {mode:?}, listen: {{ endpoints: [{listen}] }}, connect: {{ endpoints: [{connect}] }},
        scouting: {{ delay: 1, multicast: {{ enabled: false }}, gossip: {{ enabled: false }} }} }}"#
    );
    Config::from_json5(&settings).unwrap_or_else(|error| panic!("{error}"))
}

#[allow(clippy::panic, reason = "the test has failed")]
async fn open(settings: Config) -> Session {
    soon("the session", zenoh::open(settings).into_future()).await.unwrap_or_else(|error| panic!("{error}"))
}

/// Returns whether Zenoh reads and writes connections on one thread. Otherwise runs the test of this name again, in
/// a process where it does.
///
/// Zenoh uses a connection with TLS from two threads at the same time, which TLS does not allow (eclipse-zenoh/zenoh,
/// issue 2557). So one test in a hundred lost a connection while it was busy. With one thread a process can wait for
/// itself when it is flooded, so this is for tests of few calls.
///
/// # Panics
/// Panics if the other process fails: then the test has failed.
#[allow(clippy::unwrap_used, reason = "the test has failed")]
pub fn has_one_thread(test: &str) -> bool {
    const VARIABLE: &str = "ZENOH_RUNTIME";
    const ONE_THREAD: &str = "(rx:(worker_threads:1),tx:(handover:rx))";
    if std::env::var_os(VARIABLE).is_some() {
        return true;
    }
    let mut again = std::process::Command::new(std::env::current_exe().unwrap());
    let ended = again.args([test, "--exact", "--nocapture"]).env(VARIABLE, ONE_THREAD).status().unwrap();
    assert!(ended.success(), "{ended}");
    false
}

/// Carries one connection to a daemon until it is notified, and then nothing, as if the client's machine
/// sleeps.
///
/// # Panics
/// Panics if there is no such daemon: then the test has failed.
#[allow(clippy::unwrap_used, reason = "the test has failed")]
pub async fn stopping_proxy(locator: &str, stop: Arc<Notify>) -> String {
    let daemon = locator.strip_prefix("tcp/").unwrap().to_owned();
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let place = format!("tcp/{}", listener.local_addr().unwrap());
    tokio::spawn(async move {
        let (asker, _) = listener.accept().await.unwrap();
        let daemon = TcpStream::connect(daemon).await.unwrap();
        let (mut asker, mut daemon) = (asker, daemon);
        let carrying = tokio::io::copy_bidirectional(&mut asker, &mut daemon);
        tokio::select! { _ended = carrying => {}, () = stop.notified() => {} }
        // Nothing is closed before the end of the test.
        stop.notified().await;
    });
    place
}

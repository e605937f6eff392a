//! Who uses the daemon, and whose targets joints have: for people to see, nothing is
//! allowed or refused by it.

use std::collections::BTreeMap;
use std::fmt;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use simd_core::simulation::target_sources;
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use super::SimHandle;

/// How long after its last call a client counts as here.
const STAYS: Duration = Duration::from_secs(5);
/// Clients that are remembered.
const KEPT: usize = 256;

/// How a call came.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Transport {
    /// Over gRPC.
    Grpc,
    /// Over gRPC-Web, from a browser.
    GrpcWeb,
    /// Over Zenoh.
    Zenoh,
    /// From within the daemon's own process.
    Handle,
}

impl Transport {
    /// Its name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Grpc => "grpc",
            Self::GrpcWeb => "grpc-web",
            Self::Zenoh => "zenoh",
            Self::Handle => "handle",
        }
    }
}

/// The other end of the way by which a call came.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Peer {
    /// Of a connection.
    Connection {
        /// No two have the same as long as the daemon runs.
        number: u64,
        /// Where it comes from.
        address: IpAddr,
    },
    /// Of a session of Zenoh, by the id that it says it has.
    Session(Arc<str>),
    /// A caller within the daemon's own process.
    Process,
}

impl fmt::Display for Peer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Connection { number, address } => write!(f, "{address}, connection {number}"),
            Self::Session(id) => write!(f, "session {id}"),
            Self::Process => f.write_str("this process"),
        }
    }
}

impl Peer {
    /// Whether no other client can seem to be this one: Zenoh does not tell whose query it is, and an id can be
    /// made up.
    pub fn is_certain(&self) -> bool {
        match self {
            Self::Connection { .. } | Self::Process => true,
            Self::Session(_) => false,
        }
    }
}

/// Cancelled when the connection, or the session of Zenoh, by which a call came has ended.
#[derive(Clone, Debug)]
pub struct Disconnect(pub CancellationToken);

/// Whose ids of requests are meant: two callers with the same id have nothing to do with each other.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Scope {
    /// Of all who give this name.
    Named(Caller),
    /// Of one who gives none.
    Unnamed(Peer),
}

/// Who calls, where it says so.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Caller {
    /// As it calls itself.
    pub name: Arc<str>,
    /// How it calls.
    pub transport: Transport,
}

impl Caller {
    /// By what a header says: printable ASCII, of which the first 64 characters count.
    pub fn said(text: &str, transport: Transport) -> Option<Self> {
        let is_printable = |byte: u8| (0x20..0x7f).contains(&byte);
        let name = text.trim();
        if name.is_empty() || !name.bytes().all(is_printable) {
            return None;
        }
        let name = name.get(..simd_proto::MAX_CLIENT_NAME).unwrap_or(name);
        Some(Self { name: name.into(), transport })
    }
}

/// A client that is here.
#[derive(Clone, Debug, PartialEq)]
pub struct Client {
    /// Who it is.
    pub caller: Caller,
    /// Since its last call ended; zero while one is answered.
    pub idle: Duration,
}

/// Who set a joint's last target.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetSource {
    /// The robot's name.
    pub robot: String,
    /// The joint's name.
    pub joint: String,
    /// Empty where the client did not say who it is.
    pub client: Arc<str>,
    /// Since then.
    pub age: Duration,
}

/// What is remembered of clients.
#[derive(Debug, Default)]
pub(super) struct Clients {
    /// Held for a look or a change.
    here: Mutex<BTreeMap<Caller, Presence>>,
}

#[derive(Debug)]
struct Presence {
    /// That are answered now.
    calls: usize,
    /// When the last one ended.
    last: Instant,
}

/// A call that is answered; its client is here at least until this is dropped.
#[derive(Debug)]
pub struct UnderWay {
    clients: Arc<Clients>,
    caller: Caller,
}

impl Drop for UnderWay {
    fn drop(&mut self) {
        if let Some(presence) = self.clients.lock().get_mut(&self.caller) {
            presence.calls = presence.calls.saturating_sub(1);
            presence.last = Instant::now();
        }
    }
}

impl Clients {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<Caller, Presence>> {
        self.here.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A call begins. Where there are too many clients, the one goes that was silent for longest.
    fn begin(self: &Arc<Self>, caller: Caller) -> UnderWay {
        let mut here = self.lock();
        if here.len() >= KEPT && !here.contains_key(&caller) {
            let silent = here.iter().filter(|(_, presence)| presence.calls == 0);
            if let Some(longest) =
                silent.min_by_key(|(_, presence)| presence.last).map(|(who, _)| who.clone())
            {
                here.remove(&longest);
            }
        }
        // Where all are in the middle of a call, one more is served and not listed.
        if here.len() < KEPT || here.contains_key(&caller) {
            let new = || Presence { calls: 0, last: Instant::now() };
            here.entry(caller.clone()).or_insert_with(new).calls += 1;
        }
        drop(here);
        UnderWay { clients: self.clone(), caller }
    }

    fn list(&self) -> Vec<Client> {
        let mut here = self.lock();
        here.retain(|_, presence| presence.calls > 0 || presence.last.elapsed() < STAYS);
        let client = |(caller, presence): (&Caller, &Presence)| {
            let idle = if presence.calls > 0 { Duration::ZERO } else { presence.last.elapsed() };
            Client { caller: caller.clone(), idle }
        };
        here.iter().map(client).collect()
    }
}

impl SimHandle {
    /// A call of a client begins.
    pub fn begin_call(&self, caller: Caller) -> UnderWay {
        self.inner.clients.begin(caller)
    }

    /// The clients that are here, by name.
    pub fn clients(&self) -> Vec<Client> {
        self.inner.clients.list()
    }

    /// What says, with targets, that this caller sets them now; `None` did not say who it is.
    pub fn target_source(&self, caller: Option<&Caller>) -> Arc<target_sources::TargetSource> {
        let client = caller.map(|caller| caller.name.clone()).unwrap_or_default();
        Arc::new(target_sources::TargetSource { client, at: self.inner.started.elapsed() })
    }

    /// Who set the last target of each joint that was given one, by robot and joint.
    pub fn target_sources(&self) -> Vec<TargetSource> {
        let newest = self.newest();
        let now = self.inner.started.elapsed();
        let robots = newest.state.world.entities.iter().zip(newest.state.target_sources.iter());
        let sources = robots.flat_map(|(entity, sources)| {
            entity.model.joints.iter().zip(sources.iter()).filter_map(|(joint, source)| {
                let source = source.as_ref()?;
                Some(TargetSource {
                    robot: entity.name.clone(),
                    joint: joint.name.clone(),
                    client: source.client.clone(),
                    age: now.saturating_sub(source.at),
                })
            })
        });
        let mut sources: Vec<_> = sources.collect();
        sources.sort_by(|a, b| (&a.robot, &a.joint).cmp(&(&b.robot, &b.joint)));
        sources
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn caller(name: &str) -> Caller {
        Caller::said(name, Transport::Grpc).unwrap()
    }

    fn names(clients: &Clients) -> Vec<String> {
        clients.list().into_iter().map(|client| client.caller.name.to_string()).collect()
    }

    #[test]
    fn a_name_is_printable_and_not_long() {
        let said = |text: &str| Caller::said(text, Transport::Zenoh).map(|caller| caller.name.to_string());
        assert_eq!(said(" simctl "), Some("simctl".into()));
        assert_eq!(said(&"a".repeat(100)), Some("a".repeat(64)));
        for text in ["", "  ", "a\tb", "a\u{7f}", "ä"] {
            assert_eq!(said(text), None, "{text:?}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_client_is_here_while_it_calls_and_for_five_seconds_after() {
        let clients = Arc::new(Clients::default());
        let watching = clients.begin(caller("watcher"));
        drop(clients.begin(caller("simctl")));
        tokio::time::advance(Duration::from_secs(4)).await;
        assert_eq!(names(&clients), ["simctl", "watcher"]);
        assert_eq!(clients.list()[0].idle, Duration::from_secs(4));
        assert_eq!(clients.list()[1].idle, Duration::ZERO);
        tokio::time::advance(Duration::from_secs(2)).await;
        assert_eq!(names(&clients), ["watcher"]);
        drop(watching);
        tokio::time::advance(Duration::from_secs(4)).await;
        assert_eq!(names(&clients), ["watcher"]);
        tokio::time::advance(Duration::from_secs(2)).await;
        assert!(names(&clients).is_empty());
    }

    #[tokio::test(start_paused = true)]
    async fn endless_names_take_no_endless_memory() {
        let clients = Arc::new(Clients::default());
        let _first = clients.begin(caller("first"));
        for number in 0..10 * KEPT {
            drop(clients.begin(caller(&format!("n{number}"))));
            tokio::time::advance(Duration::from_micros(1)).await;
        }
        let names = names(&clients);
        assert_eq!(names.len(), KEPT);
        assert!(names.contains(&"first".into()), "one that waits for an answer stays");
        assert!(names.contains(&format!("n{}", 10 * KEPT - 1)));
        // Where everybody waits, one more is served all the same.
        let all: Vec<_> = (0..2 * KEPT).map(|number| clients.begin(caller(&format!("m{number}")))).collect();
        assert_eq!(clients.list().len(), KEPT);
        drop(all);
        assert!(clients.list().len() <= KEPT);
    }
}

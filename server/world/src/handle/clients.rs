//! Present clients, and the sources of joint targets. This is for people to see, and has no effect on rights.

use std::collections::BTreeMap;
use std::fmt;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use simd_core::simulation::target_sources;
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use super::SimHandle;
use crate::account::Account;

/// Time for which a client counts as present after its last call.
const STAYS: Duration = Duration::from_secs(5);
/// Maximum number of remembered clients.
const KEPT: usize = 256;

/// Transport of a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Transport {
    /// Over gRPC.
    Grpc,
    /// Over gRPC-Web, from a browser.
    GrpcWeb,
    /// In JSON, by the Connect protocol.
    Json,
    /// Over Zenoh.
    Zenoh,
    /// Within the daemon's own process.
    Handle,
}

impl Transport {
    /// Returns its name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Grpc => "grpc",
            Self::GrpcWeb => "grpc-web",
            Self::Json => "json",
            Self::Zenoh => "zenoh",
            Self::Handle => "handle",
        }
    }
}

/// Remote end of the connection of a call.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Peer {
    /// A connection.
    Connection {
        /// Number, unique for the life of the daemon.
        number: u64,
        /// Address of the remote end.
        address: IpAddr,
    },
    /// A Zenoh session, with the id that it claims to have.
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
    /// Returns whether no other client can appear as this one: Zenoh does not identify the sender of a query,
    /// and an id can be invented.
    pub fn is_certain(&self) -> bool {
        match self {
            Self::Connection { .. } | Self::Process => true,
            Self::Session(_) => false,
        }
    }
}

impl From<&Peer> for Account {
    fn from(peer: &Peer) -> Self {
        match peer {
            Peer::Connection { number, address } => Self::of_connection(*number, *address),
            Peer::Session(id) => Self::Session(Arc::clone(id)),
            Peer::Process => Self::Process,
        }
    }
}

/// Cancelled when the call's connection or Zenoh session has ended.
#[derive(Clone, Debug)]
pub struct Disconnect(pub CancellationToken);

/// Scope of request ids: callers in different scopes may use the same id.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Scope {
    /// All callers with this name.
    Named(Caller),
    /// One caller without a name.
    Unnamed(Peer),
}

/// Caller that gave its name.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Caller {
    /// Name that it gives.
    pub name: Arc<str>,
    /// Transport that it uses.
    pub transport: Transport,
}

impl Caller {
    /// Returns a caller from a header's text: printable ASCII, of which the first 64 characters count.
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

/// A present client.
#[derive(Clone, Debug, PartialEq)]
pub struct Client {
    /// Name and transport.
    pub caller: Caller,
    /// Time since its last call ended; zero during a call.
    pub idle: Duration,
}

/// Source of a joint's last target.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetSource {
    /// Name of the robot.
    pub robot: String,
    /// Name of the joint.
    pub joint: String,
    /// Name of the client; empty if it gave none.
    pub client: Arc<str>,
    /// Time since the target was set.
    pub age: Duration,
}

/// Remembered clients.
#[derive(Debug, Default)]
pub(super) struct Clients {
    /// Locked for a look or a change.
    here: Mutex<BTreeMap<Caller, Presence>>,
}

#[derive(Debug)]
struct Presence {
    /// Number of calls in progress.
    calls: usize,
    /// End of the last call.
    last: Instant,
}

/// A call in progress; its client is present at least until this is dropped.
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

    /// Notes the begin of a call. If there are too many clients, the one that was silent longest is
    /// forgotten.
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
        // If all are within a call, another one is served and not listed.
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
    /// Notes the begin of a client's call.
    pub fn begin_call(&self, caller: Caller) -> UnderWay {
        self.inner.clients.begin(caller)
    }

    /// Returns the present clients, by name.
    pub fn clients(&self) -> Vec<Client> {
        self.inner.clients.list()
    }

    /// Returns the source of targets that this handle's caller sets now.
    pub fn target_source(&self) -> Arc<target_sources::TargetSource> {
        let client = self.call.sender().unwrap_or_default();
        Arc::new(target_sources::TargetSource { client, at: self.inner.started.elapsed() })
    }

    /// Returns the source of the last target of each joint that has one, by robot and joint.
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
        // If all are within a call, another one is served nevertheless.
        let all: Vec<_> = (0..2 * KEPT).map(|number| clients.begin(caller(&format!("m{number}")))).collect();
        assert_eq!(clients.list().len(), KEPT);
        drop(all);
        assert!(clients.list().len() <= KEPT);
    }
}

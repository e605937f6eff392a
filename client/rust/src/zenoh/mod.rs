//! Connections to daemons over Zenoh.
//!
//! * This file: a network of daemons, joined at one locator.
//! * `channel`: carries gRPC calls as queries, so that the generated clients work on it.
//! * `daemons`: maps names of daemons to sessions.
//! * `claims`: proves that this client holds a claim.
//! * `tokens`: tells daemons that this client is active.
//! * `streams`: calls of many messages, which Zenoh lacks.

mod channel;
mod claims;
mod daemons;
mod streams;
mod tokens;

use std::sync::Arc;
use std::time::Duration;

use simd_proto::keys;
use tokio::runtime::{Handle, RuntimeFlavor};
use zenoh::Session;

pub(crate) use channel::ZenohChannel;

use self::claims::Counter;
use self::daemons::Daemons;
use self::tokens::Tokens;
use crate::endpoint::DaemonEndpoint;
use crate::{Client, ConnectOptions, Error, tls};

/// Larger answers are refused before they are read.
const MAX_MESSAGE_BYTES: usize = 64 * 1024 * 1024;
/// A session that is silent for this long counts as closed.
const LEASE: Duration = Duration::from_secs(5);

/// The daemons behind one Zenoh locator, which belongs to a daemon or to a router. Cheap to clone; clones
/// share the connection, which reconnects automatically after a break.
#[derive(Clone, Debug)]
pub struct Network {
    session: Session,
    daemons: Daemons,
    counter: Arc<Counter>,
    tokens: Arc<Tokens>,
    locator: Arc<str>,
    options: ConnectOptions,
}

/// A daemon that announces itself.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Presence {
    /// Name of the daemon, unique on a network.
    pub name: String,
    /// Id of its Zenoh session, which changes with each start.
    pub zid: String,
}

impl Network {
    /// Joins the network at a locator such as `tcp/127.0.0.1:7447`.
    ///
    /// # Errors
    /// [`Error::Endpoint`] if the text is not a locator, [`Error::Unreachable`] if no process listens there,
    /// [`Error::Certificate`] and [`Error::Untrusted`] as [`Client::connect`].
    pub async fn join(locator: &str, options: ConnectOptions) -> Result<Self, Error> {
        match crate::endpoint::read(locator)? {
            DaemonEndpoint::Zenoh { locator, name: _ } => Self::open(&locator, options).await,
            DaemonEndpoint::Grpc { .. } => Err(Error::Endpoint {
                endpoint: locator.to_owned(),
                reason: "it must be a Zenoh locator like tcp/127.0.0.1:7447".to_owned(),
            }),
        }
    }

    /// Joins at a parsed locator.
    pub(crate) async fn open(locator: &str, options: ConnectOptions) -> Result<Self, Error> {
        let refuse = |reason: String| Error::Endpoint { endpoint: locator.to_owned(), reason };
        // Otherwise Zenoh would panic.
        if Handle::current().runtime_flavor() == RuntimeFlavor::CurrentThread {
            return Err(refuse("Zenoh needs a tokio runtime of the multi-thread flavor".to_owned()));
        }
        let is_sealed = locator.starts_with("tls/") || locator.starts_with("quic/");
        let pems = if is_sealed { tls::read(&options)? } else { tls::Pems::default() };
        let settings = settings(locator, &options).map_err(|error| refuse(first_words(&error)))?;
        let unreachable = |reason| Error::Unreachable { endpoint: locator.to_owned(), reason };
        let failed = match tokio::time::timeout(options.connect_timeout, zenoh::open(settings)).await {
            Ok(Ok(session)) => Ok(session),
            Ok(Err(error)) => Err(first_words(&error)),
            Err(_elapsed) => Err("the connection timed out".to_owned()),
        };
        let session = match failed {
            Ok(session) => session,
            Err(reason) => {
                // Zenoh does not say what TLS said.
                let address = locator.strip_prefix("tls/").filter(|address| !address.contains(['?', '#']));
                let found = match address {
                    Some(address) => tls::probe(address, &pems, options.connect_timeout).await,
                    None => None,
                };
                return Err(Error::unreachable(locator, found.unwrap_or(reason)));
            }
        };
        let network = Self {
            session,
            daemons: Daemons::default(),
            counter: Arc::default(),
            tokens: Arc::default(),
            locator: locator.into(),
            options,
        };
        // Before the subscriber: a query does not return tokens that are being delivered to a subscription.
        network.look(&keys::every_daemon()).await.map_err(|error| unreachable(first_words(&error)))?;
        let heard = network.daemons.clone();
        let tokens = network.session.liveliness().declare_subscriber(keys::every_daemon()).history(true);
        let tokens = tokens.callback(move |sample| heard.update(&sample)).background();
        tokens.await.map_err(|error| unreachable(first_words(&error)))?;
        Ok(network)
    }

    /// Returns the daemons that are there now, by name.
    ///
    /// # Errors
    /// [`Error::Unreachable`] if the network cannot be asked.
    pub async fn daemons(&self) -> Result<Vec<Presence>, Error> {
        let unreachable = |error: zenoh::Error| Error::Unreachable {
            endpoint: self.locator.to_string(),
            reason: first_words(&error),
        };
        self.look(&keys::every_daemon()).await.map_err(unreachable)?;
        Ok(self.daemons.list())
    }

    /// Reads the present tokens.
    async fn look(&self, key: &str) -> Result<(), zenoh::Error> {
        let tokens = self.session.liveliness().get(key).timeout(self.options.connect_timeout).await?;
        let all = async {
            while let Ok(reply) = tokens.recv_async().await {
                if let Ok(sample) = reply.into_result() {
                    self.daemons.update(&sample);
                }
            }
        };
        // Zenoh's own timeout does not always end it.
        let _ = tokio::time::timeout(self.options.connect_timeout, all).await;
        Ok(())
    }

    /// Returns a client of the daemon of this name, which need not run yet.
    pub fn client(&self, name: &str) -> Client {
        let endpoint = format!("{}#{name}", self.locator);
        let channel = ZenohChannel::new(self.clone(), name);
        Client::over(channel.into(), endpoint.into(), &self.options)
    }

    /// Returns a client of the daemon of this name, which must run; without a name, of the only daemon.
    pub(crate) fn find(&self, name: Option<&str>) -> Result<Client, Error> {
        let there = self.daemons.list();
        let mut names: Vec<&str> = there.iter().map(|daemon| daemon.name.as_str()).collect();
        names.dedup();
        let unreachable = |reason| {
            let endpoint = match name {
                Some(name) => format!("{}#{name}", self.locator),
                None => self.locator.to_string(),
            };
            Error::Unreachable { endpoint, reason }
        };
        let listed = names.join(", ");
        let refuse = |reason| Err(Error::Endpoint { endpoint: self.locator.to_string(), reason });
        let name = match (name, names.as_slice()) {
            (_, []) => return Err(unreachable("there is no simd daemon".to_owned())),
            (None, [only]) => only,
            (None, names) => {
                let names = names.iter().map(|&name| name.to_owned()).collect();
                return Err(Error::SeveralDaemons { endpoint: self.locator.to_string(), names });
            }
            (Some(name), names) if names.contains(&name) => name,
            (Some(name), _) => return Err(unreachable(format!("there is no `{name}`, but {listed}"))),
        };
        let sessions: Vec<&str> =
            there.iter().filter(|daemon| daemon.name == name).map(|daemon| daemon.zid.as_str()).collect();
        match sessions.as_slice() {
            [_only] => Ok(self.client(name)),
            several => refuse(daemons::several(name, several)),
        }
    }
}

/// Returns settings as strict as the daemon's: no scouting, and no shared memory.
fn settings(locator: &str, options: &ConnectOptions) -> Result<zenoh::Config, zenoh::Error> {
    let mut settings = zenoh::Config::default();
    let text = |text: &str| format!("{text:?}");
    settings.insert_json5("mode", &text("client"))?;
    settings.insert_json5("connect/endpoints", &format!("[{}]", text(locator)))?;
    // The first try decides whether the connection succeeds; later tries follow a break.
    settings.insert_json5("connect/timeout_ms", "0")?;
    settings.insert_json5("connect/retry", "{ period_init_ms: 100, period_max_ms: 1000 }")?;
    for off in ["scouting/multicast", "scouting/gossip", "adminspace", "transport/shared_memory"] {
        settings.insert_json5(&format!("{off}/enabled"), "false")?;
    }
    let files = [
        ("root_ca_certificate", &options.tls_authorities),
        ("connect_certificate", &options.tls_certificate),
        ("connect_private_key", &options.tls_key),
    ];
    for (name, path) in files {
        if let Some(path) = path {
            let path = text(&path.display().to_string());
            settings.insert_json5(&format!("transport/link/tls/{name}"), &path)?;
        }
    }
    if options.tls_certificate.is_some() {
        settings.insert_json5("transport/link/tls/enable_mtls", "true")?;
    }
    settings.insert_json5("transport/link/rx/max_message_size", &MAX_MESSAGE_BYTES.to_string())?;
    settings.insert_json5("transport/link/tx/lease", &LEASE.as_millis().to_string())?;
    Ok(settings)
}

/// Cuts the source file and line off a Zenoh error.
fn first_words(error: &zenoh::Error) -> String {
    let text = error.to_string();
    let words = text.split(" at /").next().unwrap_or(&text);
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}

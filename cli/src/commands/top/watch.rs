//! Polls daemons, each in a separate task, so that one that hangs delays no other.

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use simd_client::{Client, ConnectOptions, Error, Network};
use tokio::{
    sync::Notify,
    time::{MissedTickBehavior, interval, timeout},
};

use super::world::{Answer, Link, World};

/// Maximum number of shown worlds.
pub(super) const MAX_WORLDS: usize = 64;

/// Connection to a daemon.
#[derive(Clone, Debug)]
pub(super) enum Place {
    Endpoint(String, ConnectOptions),
    /// The daemon of this name.
    Network(Network, String),
}

/// All worlds. Clones share them.
#[derive(Clone, Debug)]
pub(super) struct Board(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    /// Interval between two polls.
    period: Duration,
    /// Timeout of all calls in one poll.
    time_limit: Duration,
    /// Whether robots and clients of all worlds are polled, and not only of the chosen one.
    is_thorough: bool,
    state: Mutex<State>,
    /// Notifies that the picture changed.
    changed: Notify,
    /// Notifies that a poll should happen early.
    hurry: Notify,
}

#[derive(Debug, Default)]
struct State {
    seen: Vec<Seen>,
    /// Endpoint of the world whose robots and clients are shown.
    chosen: Option<String>,
}

#[derive(Debug)]
struct Seen {
    world: World,
    client: Option<Client>,
    looks: u64,
    /// Whether it is a default place that was not requested.
    is_default: bool,
}

impl Board {
    pub(super) fn new(period: Duration, time_limit: Duration, is_thorough: bool) -> Self {
        let (state, changed, hurry) = (Mutex::default(), Notify::new(), Notify::new());
        Self(Arc::new(Shared { period, time_limit, is_thorough, state, changed, hurry }))
    }

    /// Watches one more daemon, unless it is already watched or the maximum is reached.
    pub(super) fn add(&self, endpoint: &str, place: Place, is_default: bool) {
        let mut state = self.lock();
        let is_known = state.seen.iter().any(|seen| seen.world.endpoint == endpoint);
        if is_known || state.seen.len() >= MAX_WORLDS {
            return;
        }
        let world = World::new(endpoint.to_owned());
        state.seen.push(Seen { world, client: None, looks: 0, is_default });
        drop(state);
        self.0.changed.notify_one();
        tokio::spawn(self.clone().watch(endpoint.to_owned(), place));
    }

    /// Adds a place where no daemon can be polled yet.
    pub(super) fn add_lost(&self, endpoint: &str, error: &str) {
        let mut state = self.lock();
        if let Some(seen) = state.seen.iter_mut().find(|seen| seen.world.endpoint == endpoint) {
            seen.looks += 1;
        } else {
            let mut world = World::new(endpoint.to_owned());
            world.lost(error.to_owned());
            state.seen.push(Seen { world, client: None, looks: 1, is_default: false });
        }
        drop(state);
        self.0.changed.notify_one();
    }

    /// Removes that place, since it has daemons after all.
    pub(super) fn remove(&self, endpoint: &str) {
        self.lock().seen.retain(|seen| seen.world.endpoint != endpoint);
    }

    /// Chooses the world whose robots and clients are polled, at once.
    pub(super) fn choose(&self, endpoint: Option<&str>) {
        let mut state = self.lock();
        if state.chosen.as_deref() != endpoint {
            state.chosen = endpoint.map(str::to_owned);
            drop(state);
            self.0.hurry.notify_waiters();
        }
    }

    /// Returns the worlds as they are now. Default places are hidden until a daemon answers there. They are
    /// also hidden if it is a daemon of this machine that is already shown through another address.
    pub(super) fn worlds(&self) -> Vec<World> {
        let state = self.lock();
        let is_shown = |(at, seen): &(usize, &Seen)| {
            let is_same =
                |other: &Seen| other.world.name == seen.world.name && is_loopback(&other.world.endpoint);
            let is_known = state.seen.iter().take(*at).any(is_same);
            !seen.is_default || (seen.world.name.is_some() && !is_known)
        };
        state.seen.iter().enumerate().filter(is_shown).map(|(_, seen)| seen.world.clone()).collect()
    }

    /// Returns the connection to a daemon that answers.
    pub(super) fn client(&self, endpoint: &str) -> Option<Client> {
        let state = self.lock();
        state.seen.iter().find(|seen| seen.world.endpoint == endpoint)?.client.clone()
    }

    /// Returns once something has changed.
    pub(super) async fn changed(&self) {
        self.0.changed.notified().await;
    }

    /// Polls at once.
    pub(super) fn hurry(&self) {
        self.0.hurry.notify_waiters();
    }

    /// Returns once all places were searched, and each daemon was polled twice, so that there are rates.
    pub(super) async fn looked_twice(&self, found: impl Future<Output = ()>) {
        found.await;
        loop {
            let is_done = |seen: &Seen| seen.looks >= 2 || seen.world.link == Link::Lost;
            if self.lock().seen.iter().all(is_done) {
                return;
            }
            self.changed().await;
        }
    }

    async fn watch(self, endpoint: String, place: Place) {
        let mut ticks = interval(self.0.period);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut client: Option<Client> = None;
        loop {
            tokio::select! {
                _ = ticks.tick() => {}
                () = self.0.hurry.notified() => {}
            }
            let is_detailed = self.0.is_thorough || self.lock().chosen.as_deref() == Some(&*endpoint);
            let time_limit = self.0.time_limit;
            let seen = match timeout(time_limit, look(&mut client, &place, is_detailed)).await {
                Ok(seen) => seen,
                Err(_) => Err(Error::TimedOut { endpoint: endpoint.clone(), after: time_limit }),
            };
            if seen.is_err() {
                // The next poll reconnects: the connection may belong to a daemon that has ended.
                client = None;
            }
            let mut state = self.lock();
            let Some(of) = state.seen.iter_mut().find(|seen| seen.world.endpoint == endpoint) else { return };
            of.looks += 1;
            of.client.clone_from(&client);
            match seen {
                Ok((name, answer)) => {
                    if let Some((name, version)) = name {
                        (of.world.name, of.world.version) = (Some(name), Some(version));
                    }
                    of.world.answered(answer);
                }
                Err(error) => of.world.lost(error.to_string()),
            }
            drop(state);
            self.0.changed.notify_one();
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn is_loopback(endpoint: &str) -> bool {
    ["127.0.0.1", "localhost", "[::1]"].iter().any(|name| endpoint.contains(name))
}

/// Polls a daemon; for a new connection, also its name and version.
async fn look(
    known: &mut Option<Client>,
    place: &Place,
    is_detailed: bool,
) -> Result<(Option<(String, String)>, Answer), Error> {
    let (client, name) = match known {
        Some(client) => (client.clone(), None),
        None => {
            let client = match place {
                Place::Endpoint(endpoint, options) => Client::connect_with(endpoint, options.clone()).await?,
                Place::Network(network, name) => network.client(name),
            };
            let info = client.simulator_info().await?;
            (known.insert(client).clone(), Some((info.name, info.version)))
        }
    };
    let sent = Instant::now();
    let (statistics, daemon) = client.daemon_statistics().await?;
    let at = Instant::now();
    let details = match is_detailed {
        true => Some((client.robots().await?, client.clients().await?)),
        false => None,
    };
    let round_trip = at.saturating_duration_since(sent);
    Ok((name, Answer { at, round_trip, statistics, daemon, details }))
}

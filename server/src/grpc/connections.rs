//! Selection of the served connections: a total limit, a limit of each peer, and a reserve for the loopback
//! addresses. If there is no room, the longest idle connection is closed, otherwise the new one is refused.

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use super::activity::Activity;
use crate::config::Connections as DaemonLimits;
use simd_world::handle::RefusedUnanswered;

/// Time for a connection that is closed for idleness to end. A client that begins a call at that moment thus
/// knows that it must retry.
const GRACE: Duration = Duration::from_secs(1);
/// Maximum number of closing connections in addition to the served ones; the next one cuts the first.
const CLOSING: usize = 32;
/// Longest time between two checks for idle connections.
const CHECK_INTERVAL: Duration = Duration::from_secs(1);
/// Minimum time between two logged refusals.
const LOG: Duration = Duration::from_secs(1);

/// A peer with a share of the connections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Address {
    /// 127.0.0.1 or ::1, for which some are reserved. No program uses other loopback addresses by default.
    Loopback,
    V4(Ipv4Addr),
    /// First 64 bits of an IPv6 address: the owner of one such address has them all.
    V6(u64),
}

impl From<IpAddr> for Address {
    fn from(address: IpAddr) -> Self {
        match address.to_canonical() {
            IpAddr::V4(Ipv4Addr::LOCALHOST) | IpAddr::V6(Ipv6Addr::LOCALHOST) => Self::Loopback,
            IpAddr::V4(address) => Self::V4(address),
            IpAddr::V6(address) => Self::V6((address.to_bits() >> 64) as u64),
        }
    }
}

/// The served connections.
#[derive(Debug)]
pub(super) struct Connections {
    limits: DaemonLimits,
    state: Mutex<State>,
    refused: Arc<RefusedUnanswered>,
}

#[derive(Debug, Default)]
struct State {
    /// Connections by their unique numbers.
    open: BTreeMap<u64, Entry>,
    /// Time of the last logged refusal, and the number of refusals since.
    logged: Option<Instant>,
    unlogged: u64,
}

#[derive(Debug)]
struct Entry {
    address: Address,
    is_http1: bool,
    activity: Arc<Activity>,
    /// Lets it end: no more calls.
    end: CancellationToken,
    /// Ends it at once.
    cut: CancellationToken,
    closing_since: Option<Instant>,
}

/// Maximum numbers of connections of one kind.
#[derive(Clone, Copy, Debug)]
struct Shares {
    all: usize,
    /// Maximum number of all peers except the loopback addresses.
    others: usize,
    peer: usize,
}

/// Slot of a served connection.
#[derive(Debug)]
pub(super) struct Slot {
    connections: Arc<Connections>,
    /// Number, which no other connection has.
    pub(super) number: u64,
    pub(super) activity: Arc<Activity>,
    /// Cancelled to make the connection's task end it.
    pub(super) end: CancellationToken,
    /// Cancelled to end the connection at once, and when it has ended.
    pub(super) cut: CancellationToken,
}

/// There is no room, and no connection is idle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum Full {
    #[error("its address has all the connections of its share")]
    Peer,
    #[error("clients of other addresses than loopback have all the connections of their share")]
    Others,
    #[error("all connections are in use")]
    All,
}

impl Connections {
    /// Makes an empty set; `refused` counts refusals.
    pub(super) fn new(limits: DaemonLimits, refused: Arc<RefusedUnanswered>) -> Arc<Self> {
        Arc::new(Self { limits, state: Mutex::default(), refused })
    }

    pub(super) fn limits(&self) -> &DaemonLimits {
        &self.limits
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the shares of connections of any kind.
    fn shares(&self) -> Shares {
        let DaemonLimits { max, max_per_peer, loopback_reserve, .. } = self.limits;
        Shares { all: max, others: max - loopback_reserve, peer: max_per_peer }
    }

    /// Returns the shares of HTTP/1.1 connections: in proportion, and at least one each.
    fn http1_shares(&self) -> Shares {
        let shares = self.shares();
        let part = |share: usize| (share * self.limits.max_http1 / shares.all).max(1);
        Shares { all: self.limits.max_http1, others: part(shares.others), peer: part(shares.peer) }
    }

    /// Admits a connection from this address with a number. It ends with `draining`.
    pub(super) fn admit(
        self: &Arc<Self>,
        number: u64,
        address: Address,
        draining: &CancellationToken,
    ) -> Result<Slot, Full> {
        let now = Instant::now();
        let mut state = self.lock();
        let room = state.make_room(address, self.shares(), now, |_| true);
        // Cut connections exist until their tasks have run.
        let is_crowded = state.open.len() >= self.limits.max + 2 * CLOSING;
        if let Err(full) = room.and(if is_crowded { Err(Full::All) } else { Ok(()) }) {
            self.refused.connections.fetch_add(1, Ordering::Relaxed);
            state.log(full, now);
            return Err(full);
        }
        let (activity, end, cut) = (Activity::new(now), draining.child_token(), CancellationToken::new());
        let slot = Slot {
            connections: Arc::clone(self),
            number,
            activity: Arc::clone(&activity),
            end: end.clone(),
            cut: cut.clone(),
        };
        let entry = Entry { address, is_http1: false, activity, end, cut, closing_since: None };
        state.open.insert(number, entry);
        Ok(slot)
    }

    /// Returns the number of connections.
    #[cfg(test)]
    pub(super) fn count(&self) -> usize {
        self.lock().open.len()
    }

    /// Returns the idle ones.
    #[cfg(test)]
    pub(super) fn idle(&self) -> Vec<u64> {
        let state = self.lock();
        let idle = state.open.iter().filter(|(_, entry)| entry.activity.idle_since().is_some());
        idle.map(|(number, _)| *number).collect()
    }

    /// Closes connections that are idle for too long. Never returns.
    pub(super) async fn close_idle(&self) {
        // Within a quarter of the limit; an interval of zero would panic.
        let mut looks =
            tokio::time::interval((self.limits.idle / 4).clamp(Duration::from_millis(1), CHECK_INTERVAL));
        loop {
            let now = looks.tick().await;
            self.lock().close_idle(now, self.limits.idle);
        }
    }
}

impl Slot {
    pub(super) fn limits(&self) -> &DaemonLimits {
        &self.connections.limits
    }

    /// Notes that its client speaks HTTP/1.1, which has fewer slots.
    pub(super) fn becomes_http1(&self) -> Result<(), Full> {
        let now = Instant::now();
        let mut state = self.connections.lock();
        let Some(address) = state.open.get(&self.number).map(|entry| entry.address) else { return Ok(()) };
        let room = state.make_room(address, self.connections.http1_shares(), now, |entry| entry.is_http1);
        match (room, state.open.get_mut(&self.number)) {
            (Ok(()), Some(entry)) => entry.is_http1 = true,
            (Ok(()), None) => {}
            (Err(full), _) => state.log(full, now),
        }
        room
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        self.connections.lock().open.remove(&self.number);
        self.cut.cancel();
    }
}

impl State {
    /// Makes room for another connection of the kind `is_meant`.
    fn make_room(
        &mut self,
        address: Address,
        shares: Shares,
        now: Instant,
        is_meant: impl Fn(&Entry) -> bool,
    ) -> Result<(), Full> {
        if address != Address::Loopback {
            self.hold_to(shares.peer, Full::Peer, now, |entry| is_meant(entry) && entry.address == address)?;
            let is_other = |entry: &Entry| entry.address != Address::Loopback;
            self.hold_to(shares.others, Full::Others, now, |entry| is_meant(entry) && is_other(entry))?;
        }
        self.hold_to(shares.all, Full::All, now, is_meant)
    }

    /// If a group uses all of its slots, closes its longest idle connection.
    fn hold_to(
        &mut self,
        slots: usize,
        full: Full,
        now: Instant,
        is_in_group: impl Fn(&Entry) -> bool,
    ) -> Result<(), Full> {
        let is_in_group = |entry: &Entry| entry.closing_since.is_none() && is_in_group(entry);
        let group = || self.open.iter().filter(|(_, entry)| is_in_group(entry));
        if group().count() < slots {
            return Ok(());
        }
        let idle = group().filter_map(|(number, entry)| Some((entry.activity.idle_since()?, *number)));
        let (_, number) = idle.min().ok_or(full)?;
        self.close(number, now);
        self.hold_closing();
        Ok(())
    }

    fn close(&mut self, number: u64, now: Instant) {
        if let Some(entry) = self.open.get_mut(&number) {
            entry.closing_since = Some(now);
            entry.end.cancel();
        }
    }

    /// Cuts the connections that have been closing longest, if there are too many.
    fn hold_closing(&self) {
        let mut closing: Vec<_> =
            self.open.values().filter(|entry| !entry.cut.is_cancelled()).filter_map(closing).collect();
        closing.sort_unstable_by_key(|(since, _)| *since);
        let excess = closing.len().saturating_sub(CLOSING);
        for (_, entry) in closing.into_iter().take(excess) {
            entry.cut.cancel();
        }
    }

    fn close_idle(&mut self, now: Instant, limit: Duration) {
        let mut idle = Vec::new();
        for (number, entry) in &self.open {
            let Some((_, since)) = entry.activity.idle_since() else { continue };
            match entry.closing_since {
                Some(since) if now.duration_since(since) >= GRACE => entry.cut.cancel(),
                Some(_) => {}
                None if now.duration_since(since) >= limit => idle.push(*number),
                None => {}
            }
        }
        for number in idle {
            self.close(number, now);
        }
    }

    fn log(&mut self, full: Full, now: Instant) {
        self.unlogged += 1;
        if self.logged.is_some_and(|logged| now.duration_since(logged) < LOG) {
            return;
        }
        tracing::warn!(refused = self.unlogged, "a connection is refused: {full}, and none of them is idle");
        (self.logged, self.unlogged) = (Some(now), 0);
    }
}

fn closing(entry: &Entry) -> Option<(Instant, &Entry)> {
    entry.closing_since.map(|since| (since, entry))
}

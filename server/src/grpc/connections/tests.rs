//! Served, closed and refused connections.

use std::net::Ipv4Addr;

use tokio::time::advance;

use super::super::activity::Call;
use super::*;

const LIMITS: DaemonLimits = DaemonLimits {
    max: 10,
    max_per_peer: 4,
    loopback_reserve: 3,
    max_http1: 5,
    begin: Duration::from_secs(5),
    idle: Duration::from_secs(300),
    http1_silence: Duration::from_secs(600),
    body: Duration::from_secs(30),
    body_bytes_per_second: 65_536,
    stream_silence: Duration::from_secs(3600),
    calls: 1024,
    open_calls: 2048,
};

/// Connections, numbered in order, that arrive one second after each other.
struct Coming {
    connections: Arc<Connections>,
    number: u64,
}

impl Coming {
    fn new() -> Self {
        Self { connections: Connections::new(LIMITS, Arc::default()), number: 0 }
    }

    async fn next(&mut self, address: Address) -> Result<Slot, Full> {
        advance(Duration::from_secs(1)).await;
        self.number += 1;
        self.connections.admit(self.number, address, &CancellationToken::new())
    }

    /// Returns a connection with a call at work.
    async fn busy(&mut self, address: Address) -> (Slot, Arc<Call>) {
        let slot = self.next(address).await.unwrap();
        let call = Call::begin(&slot.activity);
        (slot, call)
    }
}

fn peer(number: u8) -> Address {
    Address::V4(Ipv4Addr::new(127, 0, 0, number))
}

#[test]
fn a_peer_is_an_address_of_ipv4_or_a_network_of_ipv6() {
    let of = |text: &str| Address::from(text.parse::<IpAddr>().unwrap());
    for loopback in ["127.0.0.1", "::1", "::ffff:127.0.0.1"] {
        assert_eq!(of(loopback), Address::Loopback, "{loopback}");
    }
    assert_eq!(of("127.0.0.2"), peer(2));
    assert_eq!(of("::ffff:127.0.0.2"), peer(2));
    assert_eq!(of("2001:db8:0:1::1"), of("2001:db8:0:1:ffff::9"));
    assert_ne!(of("2001:db8:0:1::1"), of("2001:db8:0:2::1"));
    assert_ne!(of("::2"), Address::Loopback);
}

#[tokio::test(start_paused = true)]
async fn others_leave_what_is_reserved_for_the_loopback_address() {
    let mut coming = Coming::new();
    let mut held = Vec::new();
    for i in 0..7 {
        held.push(coming.busy(peer(2 + i)).await);
    }
    assert_eq!(coming.next(peer(9)).await.unwrap_err(), Full::Others);
    for _ in 0..3 {
        held.push(coming.busy(Address::Loopback).await);
    }
    assert_eq!(coming.next(Address::Loopback).await.unwrap_err(), Full::All);
    held.remove(0);
    coming.next(peer(9)).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn the_loopback_address_may_have_all_slots() {
    let mut coming = Coming::new();
    let mut held = Vec::new();
    for _ in 0..10 {
        held.push(coming.busy(Address::Loopback).await);
    }
    assert_eq!(coming.next(peer(2)).await.unwrap_err(), Full::All);
}

#[tokio::test(start_paused = true)]
async fn a_peer_has_no_more_than_its_share_and_loses_its_own_idle_connection_first() {
    let mut coming = Coming::new();
    let other = coming.next(peer(3)).await.unwrap();
    let mut held = Vec::new();
    for _ in 0..3 {
        held.push(coming.busy(peer(2)).await);
    }
    let idle = coming.next(peer(2)).await.unwrap();
    let _fifth = coming.busy(peer(2)).await;
    assert!(idle.end.is_cancelled() && !other.end.is_cancelled());
    assert_eq!(coming.next(peer(2)).await.unwrap_err(), Full::Peer);
    assert!(!other.end.is_cancelled(), "it is older, and another's");
}

#[tokio::test(start_paused = true)]
async fn connections_without_calls_are_closed_first_then_the_longest_idle_and_none_that_work() {
    let mut coming = Coming::new();
    let (between, call) = coming.busy(Address::Loopback).await;
    let (waits, waiting) = coming.busy(Address::Loopback).await;
    waiting.wait();
    drop(call);
    let mut held = Vec::new();
    for _ in 0..6 {
        held.push(coming.busy(Address::Loopback).await);
    }
    let unused = coming.next(Address::Loopback).await.unwrap();
    let unused_later = coming.next(Address::Loopback).await.unwrap();
    for closed in [&unused, &unused_later, &between, &waits] {
        assert!(!closed.end.is_cancelled());
        held.push(coming.busy(Address::Loopback).await);
        assert!(closed.end.is_cancelled());
        assert!(!closed.cut.is_cancelled(), "its client learns of it first");
    }
    assert_eq!(coming.next(Address::Loopback).await.unwrap_err(), Full::All);
}

#[tokio::test(start_paused = true)]
async fn connections_of_http_1_have_separate_shares() {
    let mut coming = Coming::new();
    // 5 of 10, so that a peer has 2 of its 4, and others 3 of their 7.
    let held = Mutex::new(Vec::new());
    let browser = async |coming: &mut Coming, address| {
        let (slot, call) = coming.busy(address).await;
        let room = slot.becomes_http1();
        held.lock().unwrap().push((slot, call));
        room
    };
    browser(&mut coming, peer(2)).await.unwrap();
    browser(&mut coming, peer(2)).await.unwrap();
    assert_eq!(browser(&mut coming, peer(2)).await, Err(Full::Peer));
    browser(&mut coming, peer(3)).await.unwrap();
    assert_eq!(browser(&mut coming, peer(3)).await, Err(Full::Others));
    browser(&mut coming, Address::Loopback).await.unwrap();
    browser(&mut coming, Address::Loopback).await.unwrap();
    assert_eq!(browser(&mut coming, Address::Loopback).await, Err(Full::All));
    // The browser's connection that waits for its client is closed, and no program's.
    held.lock().unwrap()[1].1.wait();
    browser(&mut coming, Address::Loopback).await.unwrap();
    let closing: Vec<_> = held.lock().unwrap().iter().map(|(slot, _)| slot.end.is_cancelled()).collect();
    assert_eq!(closing, [false, true, false, false, false, false, false, false, false]);
}

#[tokio::test(start_paused = true)]
async fn connections_beyond_their_idle_time_are_closed_and_then_cut() {
    let mut coming = Coming::new();
    let idle = coming.next(peer(2)).await.unwrap();
    let (waits, waiting) = coming.busy(peer(2)).await;
    waiting.wait();
    let (busy, _call) = coming.busy(peer(2)).await;
    let connections = Arc::clone(&coming.connections);
    tokio::spawn(async move { connections.close_idle().await });
    tokio::time::sleep(LIMITS.idle - Duration::from_secs(4)).await;
    assert!(!idle.end.is_cancelled());
    tokio::time::timeout(Duration::from_secs(3), idle.end.cancelled()).await.unwrap();
    assert!(!idle.cut.is_cancelled());
    tokio::time::timeout(GRACE + CHECK_INTERVAL, idle.cut.cancelled()).await.unwrap();
    tokio::time::timeout(GRACE + 3 * CHECK_INTERVAL, waits.cut.cancelled()).await.unwrap();
    tokio::time::sleep(10 * LIMITS.idle).await;
    assert!(!busy.end.is_cancelled());
}

/// At any speed of arrival, and however slowly closed ones end.
#[tokio::test(start_paused = true)]
async fn a_flood_does_not_open_more_than_the_limit_and_some_that_are_closing() {
    let mut coming = Coming::new();
    let mut held = Vec::new();
    for _ in 0..10 * CLOSING {
        held.extend(coming.next(Address::Loopback).await);
    }
    assert_eq!(coming.connections.count(), LIMITS.max + 2 * CLOSING);
    let count = |is: fn(&&Slot) -> bool| held.iter().filter(is).count();
    let (closing, cut) = (count(|slot| slot.end.is_cancelled()), count(|slot| slot.cut.is_cancelled()));
    assert!(closing - cut <= CLOSING && closing >= 2 * CLOSING, "{closing} {cut}");
    // Slots are free again once connections end.
    held.clear();
    assert_eq!(coming.connections.count(), 0);
    coming.next(Address::Loopback).await.unwrap();
}

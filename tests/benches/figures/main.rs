//! Figures for this machine, printed as tables: run with `make bench`. Nothing here is asserted; compare
//! within a run.
//!
//! Each of these options prints only one table:
//! * `-- reads`: lateness under a flood of reads
//! * `-- threads`: lateness of worlds that one thread and two step
//! * `-- town`: a quadruped among fixed things
//! * `-- rapier`: costs of rapier's broad phase and queries
//! * `-- recording`: costs of a recording
//! * `-- turns`: round trips
//! * `-- hops`: a turn within a process
//! * `-- network-hops`: calls over the network
//! * `-- rollouts`: costs of copies of a world
//! * `-- rollouts-late`: lateness of steps during rollouts
//! * `-- lidar`: costs of a lidar for the steps
//! * `-- subscribers`: costs of a hundred subscribers of every state
#![allow(
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and ends where it cannot go on"
)]

mod bare;
mod crowd;
mod hops;
mod lateness;
mod lidar;
mod network_hops;
mod rapier;
mod reads;
mod recording;
mod rollouts;
mod round_trip;
mod step;
mod subscribers;
mod town;

/// As in the daemon's program: daemons run in this process.
#[cfg(feature = "jemalloc")]
#[global_allocator]
static HEAP: tikv_jemallocator::Jemalloc = tikv_jemallocator::Jemalloc;

fn main() {
    // The echoes of the round trips are this program once more, so that both ends of each
    // path are processes.
    match std::env::args().nth(1).as_deref() {
        Some(round_trip::ECHO) => return round_trip::echo(),
        Some(round_trip::ASYNC_ECHO) => return round_trip::async_echo(),
        Some(round_trip::UNIX_ECHO) => return round_trip::unix_echo(),
        Some(bare::TONIC) => return bare::tonic(),
        Some(bare::ZENOH) => return bare::zenoh(),
        Some(subscribers::SUBSCRIBE) => return subscribers::subscribe(),
        Some("town") => return town::print(),
        Some("rapier") => return rapier::print(),
        Some("reads") => return reads::print(),
        Some("threads") => return lateness::print_threads(),
        Some("recording") => return recording::print(),
        Some("turns") => return round_trip::print(),
        Some("rollouts") => return rollouts::print(),
        Some("rollouts-late") => return rollouts::print_lateness(),
        Some("lidar") => return lidar::print(),
        Some("subscribers") => return subscribers::print(),
        Some("hops") => return hops::print(),
        Some("network-hops") => return network_hops::print(),
        _ => {}
    }
    step::print();
    town::print();
    rapier::print();
    crowd::print();
    round_trip::print();
    hops::print();
    network_hops::print();
    lateness::print();
    reads::print();
    lateness::print_threads();
    recording::print();
    rollouts::print();
    lidar::print();
    subscribers::print();
}

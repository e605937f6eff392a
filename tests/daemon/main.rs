//! The real `simd`, started as a process, and the real `simctl`, as a new user sees them.

#![cfg(test)]

mod autosave;
mod cameras;
mod client;
mod constraints;
mod contacts;
mod deadlines;
mod docs;
mod doctor;
mod draining;
#[cfg(target_os = "linux")]
mod faults;
mod floods;
mod logs;
mod markers;
mod memory;
mod mistakes;
mod network;
mod operator;
mod packaging;
mod pages;
mod programs;
mod readme;
mod recordings;
mod rollouts;
mod security;
mod sensors;
mod service_manager;
mod soak;
mod step_threads;
mod threads;
mod transcript;
mod unix_socket;
#[cfg(target_os = "linux")]
mod unread;
mod untrusted_ground;
mod untrusted_input;

use serde_json::Value;
use simd_tests::process::{Process, repository};

/// Starts the world of `make demo`, playing.
pub(crate) async fn demo() -> Process {
    Process::start(["--name", "demo", "--config", "tests/assets/demo.toml"]).await
}

/// Starts the same world, paused: only `sim step` advances the time, so that its numbers are always the same.
pub(crate) async fn paused() -> Process {
    Process::start(["--name", "demo", "--config", "tests/assets/demo.toml", "--paused"]).await
}

/// Returns the JSON output of a command of `simctl`.
pub(crate) async fn written(daemon: &Process, line: &str) -> Value {
    let said = daemon.shell(&format!("simctl {line} -o json"), &repository()).await;
    assert_eq!(said.code, 0, "{line}: {}", said.err);
    serde_json::from_str(&said.out).unwrap_or_else(|error| panic!("{line}: {error}: {}", said.out))
}

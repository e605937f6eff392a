//! A world within a Rust program: loads, moves and reads an arm, without a daemon and a socket.
//!
//! ```sh
//! cargo run --package simd-server --example embedded
//! ```
#![allow(clippy::print_stdout, reason = "an example shows what it reads")]

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use simd_core::simulation::command::{RobotTargets, SetTargets, WholeTarget};
use simd_server::config::{Config, Robot};
use simd_server::embedded::Embedded;
use simd_world::handle::RunState;

fn main() -> Result<()> {
    let repository = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut arm = Robot::at(repository.join("tests/assets/seven_arm"));
    arm.name = "arm".into();
    arm.fixed = Some(true);
    let mut config = Config { robots: vec![arm], ..Config::default() };
    config.driver.state = RunState::Paused;

    let world = Embedded::start(config, "1.0", "example")?;
    let handle = world.handle();
    // A future makes the steps on this thread, so any runtime works.
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let whole = Some(WholeTarget::Position(vec![0.3; 7]));
    let targets = RobotTargets { robot: "arm".into(), whole, ..RobotTargets::default() };
    let targets = SetTargets { robots: vec![targets], ..SetTargets::default() };
    let stepped = runtime.block_on(handle.step_with(Some(targets), 1_000))?;
    println!("{} steps are done", stepped.done.applied.at.step);

    let (_, arm) = stepped.state.state.entity("arm").context("the arm is not there")?;
    let positions = stepped.state.state.positions.get(arm.positions.clone()).unwrap_or_default();
    println!("{}, {} links, is at {positions:.3?} rad", arm.name, arm.model.links.len());
    world.close();
    Ok(())
}

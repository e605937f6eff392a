//! Starts and drains, in this process.

use simd_core::Command;
use simd_core::simulation::command::PhysicsChange;

use super::*;
use crate::config::Robot;
use simd_world::handle::{CallError, RunState};

fn config() -> Config {
    Config { listen: "127.0.0.1:0".parse().unwrap(), zenoh: crate::config::Zenoh::off(), ..Config::default() }
}

#[tokio::test]
async fn a_daemon_starts_on_a_free_port_plays_and_drains() {
    let running = start(config()).await.unwrap();
    assert_ne!(running.address.port(), 0);
    assert_eq!(running.handle.statistics().state, RunState::Playing);
    let first = running.handle.newest();
    let next = running.handle.newer_than(first.sequence, None).await.unwrap();
    assert!(next.state.at.step > 0);
    let handle = running.handle.clone();
    running.drain().await;
    assert!(handle.driver_ended().is_cancelled());
}

#[tokio::test]
async fn a_port_in_use_is_named_and_has_its_exit_code() {
    let other = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = other.local_addr().unwrap();
    let error = start(Config { listen: address, ..config() }).await.unwrap_err();
    assert_eq!(error.exit_code(), 4);
    assert!(error.to_string().starts_with(&format!("cannot listen on {address}: ")), "{error}");
}

#[tokio::test]
async fn a_robot_that_cannot_be_loaded_is_named_and_has_its_exit_code() {
    let robots = vec![Robot::at("/nowhere/arm.urdf".into())];
    let error = start(Config { robots, ..config() }).await.unwrap_err();
    assert_eq!(error.exit_code(), 5);
    assert!(error.to_string().starts_with("cannot load /nowhere/arm.urdf: cannot read"), "{error}");
}

#[tokio::test]
async fn an_asset_root_that_is_not_there_is_named() {
    let error = start(Config { asset_roots: vec!["/nowhere".into()], ..config() }).await.unwrap_err();
    assert!(error.to_string().starts_with("asset root /nowhere: "), "{error}");
}

#[tokio::test]
async fn robots_are_there_before_the_first_step() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("box.urdf");
    std::fs::write(&path, r#"<robot name="box"><link name="base"/></robot>"#).unwrap();
    let mut paused = config();
    paused.driver.state = RunState::Paused;
    paused.robots = vec![Robot { name: "first".into(), ..Robot::at(path) }];
    let running = start(paused).await.unwrap();
    let newest = running.handle.newest();
    assert_eq!(newest.state.at.step, 0);
    assert!(newest.state.entity("first").is_some());
    running.drain().await;
}

/// Returns a configuration that is paused, with an autosave file that it restores if it exists.
fn saved_in(file: &Path) -> Config {
    let mut config = config();
    config.driver.state = RunState::Paused;
    let every = Duration::from_secs(3600);
    config.autosave = Some(Autosave { file: file.into(), every, restore: true, is_made: false });
    config
}

#[tokio::test]
async fn a_world_is_saved_and_restored_whatever_saved_states_its_clients_have_or_may_have() {
    let dir = tempfile::tempdir().unwrap();
    let (file, path) = (dir.path().join("world.simdstate"), dir.path().join("box.urdf"));
    std::fs::write(&path, r#"<robot name="box"><link name="base"/></robot>"#).unwrap();
    let save = |name: &str| Command::SaveState { name: name.into() };
    let mut full = saved_in(&file);
    full.limits.saved_states = 1;
    full.robots = vec![Robot { name: "first".into(), fixed: Some(true), ..Robot::at(path) }];
    let running = start(full).await.unwrap();
    running.handle.command(save("of a client")).await.unwrap();
    running.drain().await;

    let mut none = saved_in(&file);
    none.limits.saved_states = 0;
    let running = start(none).await.unwrap();
    let newest = running.handle.newest();
    assert!(newest.state.entity("first").is_some());
    assert!(newest.state.saved.is_empty(), "clients may have none, and find none");
    let refused = running.handle.command(save("of a client")).await.unwrap_err();
    assert!(matches!(refused, CallError::LimitExceeded { limit: 0, .. }), "{refused}");
    running.drain().await;
    assert!(!dir.path().join("world.simdstate.unusable").exists());
}

/// The effects of an answered call are saved, even of a late one.
#[tokio::test]
async fn effects_of_calls_while_a_daemon_drains_are_saved() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("world.simdstate");
    let running = start(saved_in(&file)).await.unwrap();
    let handle = running.handle.clone();
    let late = tokio::spawn(async move {
        handle.draining().cancelled().await;
        let change = PhysicsChange { time_step: Some(0.002), ..PhysicsChange::default() };
        handle.command(Command::SetPhysics(change)).await
    });
    running.drain().await;
    late.await.unwrap().unwrap();

    let running = start(saved_in(&file)).await.unwrap();
    assert_eq!(running.handle.physics().0.time_step, 0.002);
    running.drain().await;
}

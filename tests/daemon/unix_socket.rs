//! A Unix socket beside the port.

use std::os::unix::fs::FileTypeExt as _;

use simd_client::{Client, Error};
use simd_tests::process::{Home, Process};

#[tokio::test]
async fn clients_of_the_machine_reach_the_daemon_at_its_unix_socket() {
    let folder = Home::new();
    let path = folder.path().join("simd.sock");
    let endpoint = format!("unix:{}", path.display());
    let flags = ["--unix-socket", &path.display().to_string(), "--config", "tests/assets/demo.toml"];
    let mut daemon = Process::start(flags).await;
    let said = daemon.simctl(["joint", "set", "bench_arm", "shoulder=0.5", "-e", &endpoint]).await;
    assert_eq!(said.code, 0, "{}", said.err);
    let client = Client::connect(&endpoint).await.unwrap();
    assert_eq!(
        client.simulator_info().await.unwrap().name,
        daemon.client().await.simulator_info().await.unwrap().name
    );

    // Another one does not take it.
    let said = folder.run("simd", ["--listen", "127.0.0.1:0", "--zenoh", "off", flags[0], flags[1]]).await;
    assert_eq!(said.code, 4, "{}", said.err);
    assert!(said.err.contains(&format!("cannot listen on {endpoint}")), "{}", said.err);

    daemon.signal("TERM").await;
    daemon.ended().await;
    assert!(!path.exists(), "the file goes with the daemon");
    let Err(Error::Unreachable { endpoint: named, .. }) = Client::connect(&endpoint).await else { panic!() };
    assert_eq!(named, endpoint);
}

#[tokio::test]
async fn the_socket_of_a_daemon_that_was_killed_is_replaced() {
    let folder = Home::new();
    let path = folder.path().join("simd.sock");
    let flags = ["--unix-socket", &path.display().to_string()];
    let mut first = Process::start(flags).await;
    first.kill().await;
    assert!(std::fs::metadata(&path).unwrap().file_type().is_socket());
    let _second = Process::start(flags).await;
    Client::connect(&format!("unix:{}", path.display())).await.unwrap().simulator_info().await.unwrap();
}

#[tokio::test]
async fn tokens_are_asked_for_at_a_unix_socket_too() {
    let folder = Home::new();
    let (path, tokens) = (folder.path().join("simd.sock"), folder.path().join("tokens"));
    let added = folder
        .run("simctl", ["token", "add", "alice", "--role", "viewer", "--file", &tokens.display().to_string()])
        .await;
    assert_eq!(added.code, 0, "{}", added.err);
    let flags = ["--unix-socket", &path.display().to_string(), "--tokens", &tokens.display().to_string()];
    let daemon = Process::start(flags).await;
    let said = daemon.simctl(["sim", "status", "-e", &format!("unix:{}", path.display())]).await;
    assert_eq!(said.code, 80, "{}", said.err);
}

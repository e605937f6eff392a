//! Messages of the daemon to systemd: ready, reloading, stopping, and alive.
#![cfg(target_os = "linux")]

use std::ffi::OsStr;
use std::process::Stdio;

use simd_tests::process::{Home, Process, soon};
use tokio::net::UnixDatagram;

/// A service manager, as far as the daemon sees it.
struct Manager {
    socket: UnixDatagram,
    home: Home,
}

impl Manager {
    fn new() -> Self {
        let home = Home::new();
        Self { socket: UnixDatagram::bind(home.path().join("notify")).unwrap(), home }
    }

    /// Starts a daemon of this service manager, which wants a sign of life within this number of
    /// microseconds.
    async fn start(&self, watchdog: &str, arguments: &[&str]) -> Process {
        let socket = self.home.path().join("notify");
        let environment = [("NOTIFY_SOCKET", socket.as_os_str()), ("WATCHDOG_USEC", OsStr::new(watchdog))];
        Process::start_as(&environment, Stdio::piped(), ["--zenoh", "off"], arguments).await
    }

    async fn next(&self) -> String {
        let mut message = vec![0; 4096];
        let length = soon("a message to the service manager", self.socket.recv(&mut message)).await.unwrap();
        message.truncate(length);
        String::from_utf8(message).unwrap()
    }

    /// Returns the next that is not a sign of life.
    async fn next_change(&self) -> String {
        loop {
            let message = self.next().await;
            if message != "WATCHDOG=1\n" {
                return message;
            }
        }
    }
}

#[tokio::test]
async fn the_service_manager_hears_when_the_daemon_serves_reloads_and_ends() {
    let manager = Manager::new();
    // An hour, so that a machine that is busy for a moment changes nothing.
    let mut daemon = manager.start("3600000000", &["--name", "lab"]).await;
    let ready = manager.next_change().await;
    assert_eq!(ready, format!("READY=1\nSTATUS=listening on {}\n", daemon.endpoint));
    daemon.client().await;

    daemon.signal("HUP").await;
    let reloading = manager.next_change().await;
    let time = reloading.strip_prefix("RELOADING=1\nMONOTONIC_USEC=").unwrap().trim_end();
    assert!(time.parse::<u64>().unwrap() > 0);
    assert_eq!(manager.next_change().await, ready);

    daemon.signal("TERM").await;
    assert_eq!(manager.next_change().await, "STOPPING=1\nSTATUS=draining\n");
    assert_eq!(daemon.ended().await.0.code(), Some(0));
}

#[tokio::test]
async fn the_watchdog_is_fed_while_the_world_plays_is_paused_and_has_a_minute_between_two_steps() {
    let slow = ["--time-step", "0.1", "--rtf", "0.001"];
    for arguments in [&[][..], &["--paused"], &slow] {
        let manager = Manager::new();
        let _daemon = manager.start("40000", arguments).await;
        assert!(manager.next().await.starts_with("READY=1\n"));
        // On a busy machine a step may take longer than the 20 ms, which is reported too.
        let mut signs = 0;
        while signs < 10 {
            signs += usize::from(manager.next().await == "WATCHDOG=1\n");
        }
    }
}

/// A service manager that is gone, or wants no signs of life, does not keep the daemon from serving.
#[tokio::test]
async fn a_service_manager_that_is_gone_or_has_no_watchdog_harms_nothing() {
    let manager = Manager::new();
    let mut daemon = manager.start("0", &[]).await;
    assert!(manager.next().await.starts_with("READY=1\n"));
    drop(manager);
    daemon.client().await;
    daemon.signal("HUP").await;
    daemon.logged("the service manager cannot be notified").await;
    daemon.signal("TERM").await;
    let (status, log) = daemon.ended().await;
    assert_eq!(status.code(), Some(0), "{log}");
}

//! Notifications of the service manager that started the daemon, by systemd's sd_notify(3): ready, reloading,
//! stopping, and alive while the physics thread makes progress.

use std::io;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use tokio::sync::oneshot;
use tokio::time::MissedTickBehavior;

use simd_world::handle::SimHandle;

/// Maximum number of messages that wait for a service manager that does not read. More are lost.
const WAITING: usize = 8;
/// Longest wait for the last message, which is lost if it is not read.
const LAST: Duration = Duration::from_millis(100);

/// Connection to the service manager, or to none. Clones share it.
#[derive(Clone, Debug)]
pub(super) struct ServiceManager {
    messages: Option<SyncSender<Message>>,
}

#[derive(Debug)]
enum Message {
    /// The daemon serves; with its status text.
    Ready(String),
    /// The daemon is reloading files, and will report when it is ready.
    Reloading,
    /// The daemon ends; with the sender that confirms the notification.
    Stopping(oneshot::Sender<()>),
    /// Resets the watchdog.
    Alive,
    /// The daemon is not alive; with the reason, as its status.
    Stuck(String),
}

impl ServiceManager {
    /// Returns the service manager that started this process and expects notifications, if any. No caller
    /// waits for it: a separate thread sends the messages.
    pub(super) fn of_this_process() -> io::Result<Self> {
        if !cfg!(target_os = "linux") || std::env::var_os("NOTIFY_SOCKET").is_none() {
            return Ok(Self { messages: None });
        }
        let (sender, messages) = sync_channel(WAITING);
        std::thread::Builder::new().name("simd-notify".into()).spawn(move || send(&messages))?;
        Ok(Self { messages: Some(sender) })
    }

    /// Reports that the daemon serves.
    pub(super) fn ready(&self, status: &str) {
        self.say(Message::Ready(status.to_owned()));
    }

    /// Reports that the daemon reloads its files; [`Self::ready`] reports the end of this.
    pub(super) fn reloading(&self) {
        self.say(Message::Reloading);
    }

    /// Reports that the daemon ends, and waits a moment until this was sent.
    pub(super) async fn stopping(&self) {
        let (said, is_said) = oneshot::channel();
        self.say(Message::Stopping(said));
        let _ = tokio::time::timeout(LAST, is_said).await;
    }

    /// Resets the service manager's watchdog, if any, four times in its timeout.
    pub(super) async fn keep_watchdog(self, handle: SimHandle, status: String) {
        let Some(allowed) = watchdog() else { return };
        let mut ticks = tokio::time::interval(allowed / 4);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut was_stuck = false;
        loop {
            ticks.tick().await;
            let at_work = stuck(&handle, allowed, Instant::now());
            if let Some(at_work) = at_work {
                let at_work = at_work.as_secs_f64();
                let stuck = format!(
                    "the physics thread has been at one step for {at_work:.1} s; the watchdog is not fed"
                );
                if !was_stuck {
                    tracing::error!("{stuck}");
                }
                self.say(Message::Stuck(stuck));
            } else {
                if was_stuck {
                    self.ready(&status);
                }
                self.say(Message::Alive);
            }
            was_stuck = at_work.is_some();
        }
    }

    fn say(&self, message: Message) {
        if let Some(messages) = &self.messages {
            // A message lost to a full queue would not be read anyway.
            let _ = messages.try_send(message);
        }
    }
}

/// Returns how long the physics thread has been in one step or command, if this is more than half of the
/// watchdog's timeout. A thread that waits for the next step, or because the world is paused, is not stuck.
fn stuck(handle: &SimHandle, allowed: Duration, now: Instant) -> Option<Duration> {
    Some(handle.driver_at_work(now)).filter(|at_work| *at_work > allowed / 2)
}

/// Returns the timeout of the service manager's watchdog, if any.
fn watchdog() -> Option<Duration> {
    #[cfg(target_os = "linux")]
    return sd_notify::watchdog_enabled().filter(|allowed| !(*allowed / 4).is_zero());
    #[cfg(not(target_os = "linux"))]
    None
}

/// Sends messages until both ends are done.
fn send(messages: &Receiver<Message>) {
    let mut has_failed = false;
    for message in messages {
        let sent = message.send();
        if let Err(error) = &sent
            && !has_failed
        {
            tracing::warn!(%error, "the service manager cannot be notified");
        }
        has_failed = sent.is_err();
        if let Message::Stopping(said) = message {
            let _ = said.send(());
        }
    }
}

impl Message {
    #[cfg(target_os = "linux")]
    fn send(&self) -> io::Result<()> {
        use sd_notify::{NotifyState, notify};
        match self {
            Self::Ready(status) => notify(&[NotifyState::Ready, NotifyState::Status(status)]),
            Self::Reloading => notify(&[NotifyState::Reloading, NotifyState::monotonic_usec_now()?]),
            Self::Stopping(_) => notify(&[NotifyState::Stopping, NotifyState::Status("draining")]),
            Self::Alive => notify(&[NotifyState::Watchdog]),
            Self::Stuck(status) => notify(&[NotifyState::Status(status)]),
        }
    }

    #[cfg(not(target_os = "linux"))]
    fn send(&self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use simd_core::Simulation;
    use simd_core::simulation::WorldLimits;

    use super::*;
    use simd_world::blocking_threads::BlockingThreads;
    use simd_world::driver;
    use simd_world::driver::fake_world::BlockedWorld;
    use simd_world::handle::{DaemonInfo, DaemonLimits, RunState};
    use simd_world::loading::Loader;

    const ALLOWED: Duration = Duration::from_secs(60);

    #[tokio::test]
    async fn a_step_that_does_not_end_starves_the_watchdog_and_a_paused_world_does_not() {
        let limits = DaemonLimits::default();
        let world = Simulation::new(Default::default(), WorldLimits { robots: 1, saved_states: 0 });
        let (world, has_begun, let_go) = BlockedWorld::new(world);
        let paused = driver::Config { state: RunState::Paused, ..Default::default() };
        let driver = driver::start(world, paused).unwrap();
        let loader = Loader::new(limits, &[], BlockingThreads::computing().unwrap()).unwrap();
        let info = DaemonInfo { name: "test".into(), version: "0", limits };
        let handle = SimHandle::new(driver, loader, info);

        let later = || Instant::now() + Duration::from_secs(31);
        assert_eq!(stuck(&handle, ALLOWED, later()), None, "it is paused");
        let stepping = tokio::spawn({
            let handle = handle.clone();
            async move { handle.step(1).await.map(drop) }
        });
        tokio::task::spawn_blocking(move || has_begun.recv().unwrap()).await.unwrap();
        let since = stuck(&handle, ALLOWED, later()).expect("it is stuck");
        assert!(since > Duration::from_secs(30), "{since:?}");
        assert_eq!(stuck(&handle, ALLOWED, Instant::now() + Duration::from_secs(1)), None, "it may yet end");
        drop(let_go);
        stepping.await.unwrap().unwrap();
        // The reply is sent within the event: a command after it waits for its end.
        handle.set_state(RunState::Paused).await.unwrap();
        while stuck(&handle, ALLOWED, later()).is_some() {
            tokio::task::yield_now().await;
        }
    }
}

//! What the daemon tells the service manager that started it, as systemd's sd_notify(3) has it: that it is ready, reads its
//! files anew or ends, and that it is alive for as long as its physics thread gets on.

use std::io;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use tokio::sync::oneshot;
use tokio::time::MissedTickBehavior;

use simd_world::handle::SimHandle;

/// Messages that may wait for a service manager that does not read. More are lost.
const WAITING: usize = 8;
/// The last message may take so long, and is lost where it is not read.
const LAST: Duration = Duration::from_millis(100);

/// The service manager; or none, to which nothing is said. Clones are the same one.
#[derive(Clone, Debug)]
pub(super) struct ServiceManager {
    messages: Option<SyncSender<Message>>,
}

#[derive(Debug)]
enum Message {
    /// It serves; what to show as its status.
    Ready(String),
    /// It reads files anew, and will say when it is ready.
    Reloading,
    /// It ends; what tells that this was said.
    Stopping(oneshot::Sender<()>),
    /// The watchdog may wait for another while.
    Alive,
    /// It does not say that it is alive; why, as its status.
    Stuck(String),
}

impl ServiceManager {
    /// The one that started this process and waits to hear of it, if there is one. Nothing waits for it: what is said leaves on a
    /// thread of its own.
    pub(super) fn of_this_process() -> io::Result<Self> {
        if !cfg!(target_os = "linux") || std::env::var_os("NOTIFY_SOCKET").is_none() {
            return Ok(Self { messages: None });
        }
        let (sender, messages) = sync_channel(WAITING);
        std::thread::Builder::new().name("simd-notify".into()).spawn(move || send(&messages))?;
        Ok(Self { messages: Some(sender) })
    }

    /// The daemon serves.
    pub(super) fn ready(&self, status: &str) {
        self.say(Message::Ready(status.to_owned()));
    }

    /// The daemon reads its files anew; [`Self::ready`] says that it has.
    pub(super) fn reloading(&self) {
        self.say(Message::Reloading);
    }

    /// The daemon ends: waits for a moment until that was said.
    pub(super) async fn stopping(&self) {
        let (said, is_said) = oneshot::channel();
        self.say(Message::Stopping(said));
        let _ = tokio::time::timeout(LAST, is_said).await;
    }

    /// Feeds the watchdog of the service manager where it has one, four times in the time that it allows.
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
            // One that is lost because none are read would not be read either.
            let _ = messages.try_send(message);
        }
    }
}

/// How long the physics thread has been at one step or one command, where that is longer than half of what the watchdog
/// allows. One that waits, for the time of the next step or because the world is paused, gets on.
fn stuck(handle: &SimHandle, allowed: Duration, now: Instant) -> Option<Duration> {
    Some(handle.driver_at_work(now)).filter(|at_work| *at_work > allowed / 2)
}

/// How long the service manager waits for a sign of life, where it does.
fn watchdog() -> Option<Duration> {
    #[cfg(target_os = "linux")]
    return sd_notify::watchdog_enabled().filter(|allowed| !(*allowed / 4).is_zero());
    #[cfg(not(target_os = "linux"))]
    None
}

/// Until both ends have nothing more to send.
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

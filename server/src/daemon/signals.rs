//! Signals to the daemon: SIGTERM, SIGINT and, if enabled, the end of stdin end it. SIGHUP reloads its
//! certificate.

use std::io;

use tokio::sync::oneshot;

/// Its number on every system that has it.
#[cfg(unix)]
const SIGXFSZ: i32 = 25;

/// Effect of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SignalAction {
    /// Ends the daemon; with the name of the signal.
    End(&'static str),
    /// Reloads files.
    Reload,
}

/// Waits for signals.
#[derive(Debug)]
pub(super) struct Signals {
    #[cfg(unix)]
    terminate: tokio::signal::unix::Signal,
    #[cfg(unix)]
    interrupt: tokio::signal::unix::Signal,
    #[cfg(unix)]
    hangup: tokio::signal::unix::Signal,
    /// With a handler, a file that reaches the limit of the process's files (`RLIMIT_FSIZE`) cannot be
    /// written, as on a full disk. Without one, it kills the process.
    #[cfg(unix)]
    _file_size: tokio::signal::unix::Signal,
    /// Receives once if stdin is watched.
    stdin: Option<oneshot::Receiver<()>>,
}

impl Signals {
    /// Installs the handlers: from here on the signals no longer kill the process.
    pub(super) fn new(until_stdin_closes: bool) -> io::Result<Self> {
        #[cfg(unix)]
        use tokio::signal::unix::{SignalKind, signal};
        Ok(Self {
            #[cfg(unix)]
            terminate: signal(SignalKind::terminate())?,
            #[cfg(unix)]
            interrupt: signal(SignalKind::interrupt())?,
            #[cfg(unix)]
            hangup: signal(SignalKind::hangup())?,
            #[cfg(unix)]
            _file_size: signal(SignalKind::from_raw(SIGXFSZ))?,
            stdin: until_stdin_closes.then(end_of_stdin).transpose()?,
        })
    }

    /// Waits until the daemon must end.
    pub(super) async fn end(&mut self) {
        while self.next().await == SignalAction::Reload {}
    }

    /// Waits for the next signal.
    pub(super) async fn next(&mut self) -> SignalAction {
        let stdin = async {
            match &mut self.stdin {
                Some(end) => drop(end.await),
                None => std::future::pending().await,
            }
        };
        #[cfg(unix)]
        let signal = async {
            tokio::select! {
                _ = self.terminate.recv() => SignalAction::End("SIGTERM"),
                _ = self.interrupt.recv() => SignalAction::End("SIGINT"),
                _ = self.hangup.recv() => SignalAction::Reload,
            }
        };
        // Other systems only have Ctrl-C.
        #[cfg(not(unix))]
        let signal = async {
            if tokio::signal::ctrl_c().await.is_err() {
                std::future::pending::<()>().await;
            }
            SignalAction::End("Ctrl-C")
        };
        let (action, is_stdin) = tokio::select! {
            action = signal => (action, false),
            () = stdin => (SignalAction::End("the end of stdin"), true),
        };
        if is_stdin {
            self.stdin = None;
        }
        action
    }
}

/// Reads stdin to its end on a separate thread, which the process does not wait for.
fn end_of_stdin() -> io::Result<oneshot::Receiver<()>> {
    let (ended, end) = oneshot::channel();
    std::thread::Builder::new().name("simd-stdin".into()).spawn(move || {
        let _ = io::copy(&mut io::stdin().lock(), &mut io::sink());
        let _ = ended.send(());
    })?;
    Ok(end)
}

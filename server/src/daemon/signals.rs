//! What tells the daemon to end: SIGTERM, SIGINT and, where it was asked for, the end of stdin.

use std::io;

use tokio::sync::oneshot;

/// Waits for what ends the daemon.
#[derive(Debug)]
pub(super) struct Signals {
    #[cfg(unix)]
    terminate: tokio::signal::unix::Signal,
    #[cfg(unix)]
    interrupt: tokio::signal::unix::Signal,
    /// Comes once, where stdin is listened to.
    stdin: Option<oneshot::Receiver<()>>,
}

impl Signals {
    /// From here on the signals no longer kill the process.
    pub(super) fn new(until_stdin_closes: bool) -> io::Result<Self> {
        #[cfg(unix)]
        use tokio::signal::unix::{SignalKind, signal};
        Ok(Self {
            #[cfg(unix)]
            terminate: signal(SignalKind::terminate())?,
            #[cfg(unix)]
            interrupt: signal(SignalKind::interrupt())?,
            stdin: until_stdin_closes.then(end_of_stdin).transpose()?,
        })
    }

    /// The next one's name.
    pub(super) async fn next(&mut self) -> &'static str {
        let stdin = async {
            match &mut self.stdin {
                Some(end) => drop(end.await),
                None => std::future::pending().await,
            }
        };
        #[cfg(unix)]
        let signal = async {
            tokio::select! {
                _ = self.terminate.recv() => "SIGTERM",
                _ = self.interrupt.recv() => "SIGINT",
            }
        };
        // There is only Ctrl-C elsewhere.
        #[cfg(not(unix))]
        let signal = async {
            if tokio::signal::ctrl_c().await.is_err() {
                std::future::pending::<()>().await;
            }
            "Ctrl-C"
        };
        let (name, is_stdin) = tokio::select! {
            name = signal => (name, false),
            () = stdin => ("the end of stdin", true),
        };
        if is_stdin {
            self.stdin = None;
        }
        name
    }
}

/// Reads stdin to its end on a thread of its own, which the process does not wait for.
fn end_of_stdin() -> io::Result<oneshot::Receiver<()>> {
    let (ended, end) = oneshot::channel();
    std::thread::Builder::new().name("simd-stdin".into()).spawn(move || {
        let _ = io::copy(&mut io::stdin().lock(), &mut io::sink());
        let _ = ended.send(());
    })?;
    Ok(end)
}

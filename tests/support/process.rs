//! The real `simd` and `simctl` as processes, in a separate environment.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::time::Duration;

use simd_client::Client;
use tempfile::TempDir;
use tokio::io::{AsyncBufReadExt as _, BufReader, Lines};
use tokio::process::{Child, ChildStderr, ChildStdout, Command};
use tokio::time::timeout;

/// Timeout of all waits, far beyond the needs of a loaded machine.
const HUNG: Duration = Duration::from_secs(60);

/// A `simd` process on a free port of loopback. Dropping it kills it.
#[derive(Debug)]
pub struct Process {
    /// `http://127.0.0.1:PORT`, from the daemon's output.
    pub endpoint: String,
    /// `tcp/127.0.0.1:PORT`, the address for Zenoh.
    pub locator: Option<String>,
    child: Child,
    /// `None` if stderr goes elsewhere.
    log: Option<Lines<BufReader<ChildStderr>>>,
    /// Held open: the daemon may write more.
    _stdout: Lines<BufReader<ChildStdout>>,
    home: Home,
}

/// Output of a process and its end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Said {
    /// Its exit code; -1 if a signal ended it.
    pub code: i32,
    /// Its stdout.
    pub out: String,
    /// Its stderr.
    pub err: String,
}

/// An empty place for configuration files, so that the user's own are not read.
#[derive(Debug)]
pub struct Home(TempDir);

/// Returns the folder that the paths in the README begin at.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Returns the folder of `simd` and `simctl`: the one with `SIMD_BINARY`, which names a `simd`, or the one
/// above the test's own executable.
///
/// # Panics
/// Panics if they were not built.
#[allow(clippy::panic, reason = "the test has failed")]
pub fn binaries() -> PathBuf {
    let own = std::env::current_exe().unwrap_or_else(|error| panic!("{error}"));
    let given = std::env::var_os("SIMD_BINARY").filter(|path| !path.is_empty());
    let given = given.map(|path| repository().join(path));
    let folder = match &given {
        Some(simd) => simd.parent(),
        None => own.parent().and_then(Path::parent),
    };
    let folder = folder.unwrap_or(Path::new("."));
    for name in ["simd", "simctl"] {
        let binary = folder.join(name);
        assert!(binary.exists(), "there is no {}: `make build` builds it", binary.display());
    }
    folder.to_path_buf()
}

/// Waits for something that must happen soon.
///
/// # Panics
/// Panics if it does not: then the test has failed.
#[allow(clippy::panic, reason = "the test has failed")]
pub async fn soon<T>(what: &str, work: impl Future<Output = T>) -> T {
    timeout(HUNG, work).await.unwrap_or_else(|_| panic!("{what} did not come within {HUNG:?}"))
}

/// Keeps this thread, and those that it starts from now on, off the last of two processors or more. Returns
/// that processor; clients then represent those of other machines. `None` if there is one processor.
#[cfg(target_os = "linux")]
pub fn leave_the_last_processor() -> Option<usize> {
    use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

    let mut others = sched_getaffinity(None).ok()?;
    let last = (0..CpuSet::MAX_CPU).rev().find(|number| others.is_set(*number))?;
    others.unset(last);
    (others.count() > 0 && sched_setaffinity(None, &others).is_ok()).then_some(last)
}

#[cfg(not(target_os = "linux"))]
pub fn leave_the_last_processor() -> Option<usize> {
    None
}

/// Returns whether the system has stopped all threads of a process.
fn all_stopped(pid: u32) -> bool {
    let tasks = std::fs::read_dir(format!("/proc/{pid}/task")).into_iter().flatten().flatten();
    let state = |stat: String| stat.rsplit_once(')')?.1.trim_start().chars().next();
    // A thread that has ended meanwhile has none.
    let mut states = tasks.filter_map(|task| state(std::fs::read_to_string(task.path().join("stat")).ok()?));
    states.all(|state| matches!(state, 'T' | 'Z' | 'X'))
}

impl Home {
    /// Makes a new one.
    ///
    /// # Panics
    /// Panics if the disk gives none.
    #[allow(clippy::panic, reason = "the test has failed")]
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap_or_else(|error| panic!("{error}")))
    }

    /// Returns its path.
    pub fn path(&self) -> &Path {
        self.0.path()
    }

    /// Returns a program of ours or of the system, started in the repository's folder. It finds `simd` and
    /// `simctl` by their names and nothing else of the user's.
    pub fn command(&self, program: impl AsRef<OsStr>) -> Command {
        let inherited = std::env::var_os("PATH").unwrap_or_default();
        let folders = std::iter::once(binaries()).chain(std::env::split_paths(&inherited));
        let mut command = Command::new(program);
        command
            .current_dir(repository())
            .env("PATH", std::env::join_paths(folders).unwrap_or(inherited.clone()))
            .env("HOME", self.path())
            .env("XDG_CONFIG_HOME", self.path())
            .env("XDG_STATE_HOME", self.path().join("state"))
            .env_remove("STATE_DIRECTORY")
            .env_remove("SIMD_ENDPOINT")
            .env_remove("SIMD_TOKEN")
            .env_remove("SIMD_TLS_CA")
            .env_remove("SIMD_TLS_CLIENT_CERT")
            .env_remove("SIMD_TLS_CLIENT_KEY")
            .env_remove("NO_COLOR")
            .env_remove("RUST_LOG")
            .env_remove("NOTIFY_SOCKET")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .kill_on_drop(true);
        command
    }

    /// Runs a program of ours until it ends.
    ///
    /// # Panics
    /// Panics if it cannot be run or hangs.
    pub async fn run<I: AsRef<OsStr>>(&self, program: &str, arguments: impl IntoIterator<Item = I>) -> Said {
        let mut command = self.command(binaries().join(program));
        command.args(arguments);
        said(program, command).await
    }
}

impl Default for Home {
    fn default() -> Self {
        Self::new()
    }
}

/// Runs a command until it ends.
///
/// # Panics
/// Panics if it cannot be run or hangs.
#[allow(clippy::panic, reason = "the test has failed")]
pub async fn said(what: &str, mut command: Command) -> Said {
    let output = soon(&format!("the end of {what}"), command.output()).await;
    let output = output.unwrap_or_else(|error| panic!("{what}: {error}"));
    Said {
        code: output.status.code().unwrap_or(-1),
        out: String::from_utf8_lossy(&output.stdout).into_owned(),
        err: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

impl Process {
    /// Starts a daemon for only gRPC, and waits until it prints its address.
    ///
    /// # Panics
    /// Panics if it does not start.
    pub async fn start<I: AsRef<OsStr>>(arguments: impl IntoIterator<Item = I>) -> Self {
        Self::start_with(["--zenoh", "off"], arguments).await
    }

    /// Like [`Self::start`], for Zenoh too, with these flags for its addresses.
    ///
    /// # Panics
    /// Panics if it does not start.
    #[allow(clippy::panic, reason = "the test has failed")]
    pub async fn start_with<I: AsRef<OsStr>>(
        zenoh: [&str; 2],
        arguments: impl IntoIterator<Item = I>,
    ) -> Self {
        Self::start_logging_to(Stdio::piped(), zenoh, arguments).await
    }

    /// Like [`Self::start_with`], with another stderr than this test's.
    ///
    /// # Panics
    /// Panics if it does not start.
    #[allow(clippy::panic, reason = "the test has failed")]
    pub async fn start_logging_to<I: AsRef<OsStr>>(
        stderr: Stdio,
        zenoh: [&str; 2],
        arguments: impl IntoIterator<Item = I>,
    ) -> Self {
        Self::start_as(&[], stderr, zenoh, arguments).await
    }

    /// Like [`Self::start_logging_to`], with variables in its environment, as a service manager sets some.
    ///
    /// # Panics
    /// Panics if it does not start.
    #[allow(clippy::panic, reason = "the test has failed")]
    pub async fn start_as<I: AsRef<OsStr>>(
        environment: &[(&str, &OsStr)],
        stderr: Stdio,
        zenoh: [&str; 2],
        arguments: impl IntoIterator<Item = I>,
    ) -> Self {
        let home = Home::new();
        let mut command = home.command(binaries().join("simd"));
        command.args(["--listen", "127.0.0.1:0"]).args(zenoh).args(arguments);
        command.stdin(Stdio::piped()).stderr(stderr).envs(environment.iter().copied());
        let mut child = command.spawn().unwrap_or_else(|error| panic!("{error}"));
        let Some(stdout) = child.stdout.take() else { panic!("the daemon has no stdout") };
        let mut stdout = BufReader::new(stdout).lines();
        let mut log = child.stderr.take().map(|stderr| BufReader::new(stderr).lines());
        let ready = soon("the daemon's line on stdout", stdout.next_line()).await;
        let endpoints = match ready.as_ref().map(Option::as_deref) {
            Ok(Some(line)) => line.split_once(" is listening on ").map(|(_, endpoints)| endpoints),
            Ok(None) | Err(_) => None,
        };
        let Some(endpoints) = endpoints else {
            let mut said = String::new();
            if let Some(log) = &mut log {
                while let Ok(Some(line)) = log.next_line().await {
                    said = said + &line + "\n";
                }
            }
            panic!("the daemon does not say where it listens, but {ready:?} and\n{said}");
        };
        let mut endpoints = endpoints.split(" and ").map(str::to_owned);
        let (endpoint, locator) = (endpoints.next().unwrap_or_default(), endpoints.next());
        Self { endpoint, locator, child, log, _stdout: stdout, home }
    }

    /// The folder of the user that runs it.
    pub fn home(&self) -> &Path {
        self.home.path()
    }

    /// Its number; none once it has ended.
    pub fn pid(&self) -> Option<u32> {
        self.child.id()
    }

    /// `127.0.0.1:PORT`.
    pub fn address(&self) -> &str {
        self.endpoint.trim_start_matches("http://")
    }

    /// Returns a Rust client of it.
    ///
    /// # Panics
    /// Panics if it does not answer.
    #[allow(clippy::panic, reason = "the test has failed")]
    pub async fn client(&self) -> Client {
        Client::connect(&self.endpoint).await.unwrap_or_else(|error| panic!("{error}"))
    }

    /// `simctl` with these arguments, for this daemon, not yet run.
    pub fn simctl_command<I: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = I>) -> Command {
        let mut command = self.home.command(binaries().join("simctl"));
        command.env("SIMD_ENDPOINT", &self.endpoint).args(arguments);
        command
    }

    /// Runs `simctl` with these arguments.
    ///
    /// # Panics
    /// Panics if it hangs.
    pub async fn simctl<I: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = I>) -> Said {
        said("simctl", self.simctl_command(arguments)).await
    }

    /// Runs a line as a shell in `folder` would, that finds our programs and this daemon.
    ///
    /// # Panics
    /// Panics if it hangs.
    pub async fn shell(&self, line: &str, folder: &Path) -> Said {
        let mut command = self.home.command("sh");
        command.env("SIMD_ENDPOINT", &self.endpoint).current_dir(folder).args(["-c", line]);
        said(line, command).await
    }

    /// Kills it, as a power cut would: it closes no connection cleanly.
    ///
    /// # Panics
    /// Panics if it is gone already.
    #[allow(clippy::panic, reason = "the test has failed")]
    pub async fn kill(&mut self) {
        self.child.kill().await.unwrap_or_else(|error| panic!("{error}"));
    }

    /// Sends it a signal, for instance `TERM`. With `STOP`, returns once all of its threads have stopped:
    /// until then it may still answer.
    ///
    /// # Panics
    /// Panics if it is gone already.
    #[allow(clippy::panic, reason = "the test has failed")]
    pub async fn signal(&self, name: &str) {
        let Some(pid) = self.child.id() else { panic!("the daemon is gone already") };
        let sent = self.shell(&format!("kill -{name} {pid}"), self.home.path()).await;
        assert_eq!(sent.code, 0, "{}", sent.err);
        if name == "STOP" {
            let stopped = async {
                let mut looks = tokio::time::interval(Duration::from_millis(1));
                while !all_stopped(pid) {
                    looks.tick().await;
                }
            };
            soon("the stop of all threads", stopped).await;
        }
    }

    /// Closes its stdin, as the system does if the program that started it ends.
    pub fn close_stdin(&mut self) {
        drop(self.child.stdin.take());
    }

    /// Waits until its log has a line with this text.
    ///
    /// # Panics
    /// Panics if it ends or hangs before that.
    #[allow(clippy::panic, reason = "the test has failed")]
    pub async fn logged(&mut self, text: &str) {
        let Some(log) = &mut self.log else { panic!("its log goes elsewhere") };
        loop {
            match soon(&format!("a line with {text:?} in the log"), log.next_line()).await {
                Ok(Some(line)) if line.contains(text) => return,
                Ok(Some(_)) => {}
                ended => panic!("the log ends without a line with {text:?}: {ended:?}"),
            }
        }
    }

    /// Waits for its end. Returns its exit status and the rest of its log.
    ///
    /// # Panics
    /// Panics if it does not end.
    #[allow(clippy::panic, reason = "the test has failed")]
    pub async fn ended(&mut self) -> (ExitStatus, String) {
        let mut left = String::new();
        if let Some(log) = &mut self.log {
            while let Ok(Some(line)) = soon("the end of the daemon's log", log.next_line()).await {
                left = left + &line + "\n";
            }
        }
        let status = soon("the daemon's end", self.child.wait()).await;
        (status.unwrap_or_else(|error| panic!("{error}")), left)
    }
}

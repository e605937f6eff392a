//! The `simd` process: configuration, logging, exit code. Exit codes:
//!
//! * 0: drained after SIGTERM or SIGINT.
//! * 1: any other error, such as a fault of the physics thread or a second signal.
//! * 2: a mistake in the flags or the environment.
//! * 3: a mistake in the configuration file.
//! * 4: the daemon cannot listen on the address.
//! * 5: a robot cannot be loaded at the start.
//! * 6: a daemon with the same name is on the Zenoh network.

use std::io::{IsTerminal as _, Write as _};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;
use std::time::Duration;

use cap::Cap;
use simd_proto::text::without_error_numbers;
use simd_server::config::{self, Config, ConfigError};
use simd_server::log::{Log, LogFormat};
use simd_server::{authority, daemon, replay, zenoh_acl};
use simd_world::process;
#[cfg(feature = "jemalloc")]
use tikv_jemallocator::Jemalloc as Allocator;
use tracing_subscriber::EnvFilter;

#[cfg(not(feature = "jemalloc"))]
use std::alloc::System as Allocator;

/// Counts the allocated bytes, since growth shows there hours before it shows in the memory of the process.
/// Packages use an allocator with an arena for each processor. With glibc's, the physics thread waits for the
/// thread that holds the lock of its arena.
#[global_allocator]
static HEAP: Cap<Allocator> = Cap::new(Allocator, usize::MAX);

/// Maximum number of threads for blocking work: files of tokens and autosaves, and Zenoh's sends in place.
/// Computations have their own threads: see `blocking_threads`.
const BLOCKING_THREADS: usize = 16;
/// Longest wait after a drain for remaining work, for instance a mesh that is being parsed.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_millis(100);
/// Longest wait for the last lines of the log, which are lost if they are not read.
const LAST_WORDS: Duration = Duration::from_millis(200);

fn main() -> ExitCode {
    process::count_heap_by(|| HEAP.allocated());
    let log = match Log::to_stderr() {
        Ok(log) => log,
        // There is no thread to report it.
        Err(_) => return ExitCode::FAILURE,
    };
    log.take_panics();
    let ended = catch_unwind(AssertUnwindSafe(|| run(&log)));
    // Its panic is in the log.
    let code = ended.unwrap_or(ExitCode::FAILURE);
    log.flush(LAST_WORDS);
    code
}

fn run(log: &Log) -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().collect();
    match authority::run(&arguments).or_else(|| zenoh_acl::run(&arguments)) {
        Some(Ok(text)) => {
            let _ = write!(std::io::stdout(), "{text}");
            return ExitCode::SUCCESS;
        }
        Some(Err(text)) => {
            let is_usage = text.starts_with("error: ") || text.contains("Usage: ");
            let text = without_error_numbers(text.trim_end());
            log.say(&format!("{}{text}", if is_usage { "" } else { "simd: " }));
            return ExitCode::from(2);
        }
        None => {}
    }
    match replay::run(&arguments) {
        Some(Ok((text, code))) => {
            let _ = write!(std::io::stdout(), "{text}");
            return ExitCode::from(code);
        }
        Some(Err(text)) => {
            log.say(&without_error_numbers(text.trim_end()));
            return ExitCode::from(2);
        }
        None => {}
    }
    match config::run(&arguments, std::env::vars_os()) {
        Some(Ok(asked)) => return answer(log, asked),
        Some(Err(error)) => return refuse(log, &error),
        None => {}
    }
    let config = match Config::read(arguments, std::env::vars_os()) {
        Ok(config) => config,
        Err(error) => return refuse(log, &error),
    };
    // Zenoh logs details that operators need not read; --log zenoh=info shows them.
    let filter = EnvFilter::try_new(format!("zenoh=off,{}", config.log)).unwrap_or_default();
    let colors =
        std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|no| no.is_empty());
    // Its own errors would bypass the log to stderr, which may block and panics.
    let lines = tracing_subscriber::fmt().with_writer(log.clone()).log_internal_errors(false);
    log.set_format(config.log_format);
    match config.log_format {
        LogFormat::Text => lines.with_env_filter(filter).with_ansi(colors).init(),
        LogFormat::Json => {
            lines.with_env_filter(filter).json().with_current_span(true).with_span_list(false).init()
        }
    }
    let limit = usize::try_from(config.limits.memory_limit).unwrap_or(usize::MAX);
    if limit > 0 && HEAP.set_limit(limit).is_err() {
        log.say(&format!(
            "simd: service.memory_limit is {limit}; the daemon has allocated {} already",
            HEAP.allocated()
        ));
        return ExitCode::from(3);
    }
    if let Err(error) = daemon::provide_open_files(&config) {
        return complain(log, &error, error.exit_code());
    }
    config.driver.real_time.keep_others_off();
    let threads = BLOCKING_THREADS + std::thread::available_parallelism().map_or(1, usize::from);
    let mut builder = tokio::runtime::Builder::new_multi_thread();
    let runtime = match builder.enable_all().max_blocking_threads(threads).build() {
        Ok(runtime) => runtime,
        Err(error) => return complain(log, &error, 1),
    };
    let ended = runtime.block_on(daemon::run(config));
    runtime.shutdown_timeout(SHUTDOWN_TIMEOUT);
    match ended {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => complain(log, &error, error.exit_code()),
    }
}

/// Executes the request of `simd config`.
fn answer(log: &Log, asked: config::Asked) -> ExitCode {
    let text = match asked {
        config::Asked::Text(text) => text,
        config::Asked::Check(path, config) => {
            let runtime = match tokio::runtime::Builder::new_multi_thread().enable_all().build() {
                Ok(runtime) => runtime,
                Err(error) => return complain(log, &error, 1),
            };
            let checked = runtime.block_on(daemon::check(*config));
            runtime.shutdown_timeout(SHUTDOWN_TIMEOUT);
            match checked {
                Ok(()) => format!("{}: a daemon can be started with it\n", path.display()),
                Err(error) => return complain(log, &error, 3),
            }
        }
    };
    let _ = write!(std::io::stdout(), "{text}");
    ExitCode::SUCCESS
}

/// Reports a mistake in the configuration, or prints the text that was requested instead of a daemon.
fn refuse(log: &Log, error: &ConfigError) -> ExitCode {
    match error {
        ConfigError::HelpOrVersion(text) => {
            let _ = write!(std::io::stdout(), "{text}");
            ExitCode::SUCCESS
        }
        ConfigError::Usage(_) => complain(log, error, 2),
        ConfigError::File(_) => complain(log, error, 3),
    }
}

/// Prints one sentence on stderr.
fn complain(log: &Log, error: &dyn std::error::Error, code: u8) -> ExitCode {
    log.say(&format!("simd: {}", without_error_numbers(&error.to_string())));
    ExitCode::from(code)
}

//! The `simd` process: configuration, logging, exit code. Exit codes:
//!
//! * 0: drained after SIGTERM or SIGINT.
//! * 1: anything else, such as a fault of the physics thread or a second signal.
//! * 2: a mistake in the flags.
//! * 3: a mistake in the configuration file.
//! * 4: the address cannot be listened on.
//! * 5: a robot cannot be loaded at the start.
//! * 6: a daemon of the same name is on the Zenoh network.

use std::io::{IsTerminal as _, Write as _};
use std::process::ExitCode;
use std::time::Duration;

use simd_server::config::{Config, ConfigError};
use simd_server::daemon;
use tracing_subscriber::EnvFilter;

/// What is left after a drain (a mesh that is being parsed) may take so long.
const LEFTOVERS: Duration = Duration::from_millis(100);

fn main() -> ExitCode {
    let config = match Config::from_args(std::env::args_os()) {
        Ok(config) => config,
        Err(ConfigError::Shown(text)) => {
            let _ = write!(std::io::stdout(), "{text}");
            return ExitCode::SUCCESS;
        }
        Err(error @ ConfigError::Usage(_)) => return complain(&error, 2),
        Err(error @ ConfigError::File(_)) => return complain(&error, 3),
    };
    // Zenoh logs what operators need not read; who wants it says so with --log zenoh=info.
    let filter = EnvFilter::try_new(format!("zenoh=off,{}", config.log)).unwrap_or_default();
    let colors =
        std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|no| no.is_empty());
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).with_ansi(colors).init();
    let runtime = match tokio::runtime::Builder::new_multi_thread().enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return complain(&error, 1),
    };
    let ended = runtime.block_on(daemon::run(config));
    runtime.shutdown_timeout(LEFTOVERS);
    match ended {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => complain(&error, error.exit_code()),
    }
}

/// One sentence on stderr.
fn complain(error: &dyn std::error::Error, code: u8) -> ExitCode {
    let _ = writeln!(std::io::stderr(), "simd: {error}");
    ExitCode::from(code)
}

//! Options of every command.

use std::{path::PathBuf, time::Duration};

use clap::Args;

use crate::candidates;
use crate::output::Format;
use crate::quantity;

/// Options of every command.
#[derive(Args, Clone, Debug)]
pub(crate) struct Options {
    /// Daemon by its address: host, host:port, http://host:port, unix:PATH, or for Zenoh tcp/host:port[#NAME]
    #[arg(short, long, global = true, value_name = "ADDRESS", help_heading = "Options everywhere")]
    pub(crate) endpoint: Option<String>,
    /// Daemon by its name in the configuration file
    #[arg(long, global = true, value_name = "NAME", help_heading = "Options everywhere", add = candidates::contexts())]
    pub(crate) context: Option<String>,
    /// For https and tls/: authority that signed the daemon's certificate (PEM), else $SIMD_TLS_CA
    #[arg(long, global = true, value_name = "PATH", help_heading = "Options everywhere")]
    pub(crate) tls_ca: Option<PathBuf>,
    /// Certificate of this client (PEM), for a daemon that asks its clients for one, else
    /// $SIMD_TLS_CLIENT_CERT
    #[arg(long, global = true, value_name = "PATH", help_heading = "Options everywhere")]
    pub(crate) tls_client_cert: Option<PathBuf>,
    /// Private key of that certificate (PEM), else $SIMD_TLS_CLIENT_KEY
    #[arg(long, global = true, value_name = "PATH", help_heading = "Options everywhere")]
    pub(crate) tls_client_key: Option<PathBuf>,
    /// File with a token in its first line, for a daemon that asks for one, else $SIMD_TOKEN
    #[arg(long, global = true, value_name = "PATH", help_heading = "Options everywhere")]
    pub(crate) token_file: Option<PathBuf>,
    /// Secret of the claim that calls use, else $SIMD_CLAIM
    #[arg(long, global = true, value_name = "SECRET", help_heading = "Options everywhere")]
    pub(crate) claim: Option<String>,
    /// Tables for people, or JSON for programs
    #[arg(
        short,
        long,
        global = true,
        value_enum,
        default_value_t = Format::Table,
        value_name = "FORMAT",
        help_heading = "Options everywhere"
    )]
    pub(crate) output: Format,
    /// Short for --output json
    #[arg(long, global = true, conflicts_with = "output", help_heading = "Options everywhere")]
    pub(crate) json: bool,
    /// Seconds to wait for an answer
    #[arg(
        long,
        global = true,
        value_parser = seconds,
        default_value = "10",
        value_name = "SECONDS",
        help_heading = "Options everywhere"
    )]
    pub(crate) timeout: Duration,
}

impl Options {
    /// Returns the format of results.
    pub(crate) fn format(&self) -> Format {
        if self.json { Format::Json } else { self.output }
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = quantity::SECONDS.read(text)?;
    match Duration::try_from_secs_f64(seconds) {
        Ok(duration) if !duration.is_zero() => Ok(duration),
        _ => Err("must be above zero".to_owned()),
    }
}

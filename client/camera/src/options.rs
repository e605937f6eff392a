//! The command line. The daemon's address, token and certificates are given as for `simctl`.

use std::path::PathBuf;

use clap::{CommandFactory as _, Parser};
use simd_client::{ConnectOptions, DEFAULT_PORT, Token};

/// Maximum number of characters of a renderer's name, as in the daemon.
const NAME: usize = 128;

/// Draws the pictures of a world's cameras
///
/// A client of simd: it asks the daemon for tasks, draws pictures with a GPU through Vulkan, and sends them.
/// Without a GPU it draws with Mesa's software renderer (Debian: mesa-vulkan-drivers). Several renderers can
/// share the pictures of one world, also from other machines.
#[derive(Debug, Parser)]
#[command(name = "simd-camera", version = simd_client::PROGRAM_VERSION.as_str())]
pub(crate) struct Options {
    /// Address of the daemon: host, host:port, http://host:port, or for Zenoh tcp/host:port[#NAME]; else
    /// $SIMD_ENDPOINT, else 127.0.0.1:7400
    #[arg(short, long, value_name = "ADDRESS")]
    endpoint: Option<String>,
    /// Name of this renderer, which other clients see [default: name of the machine and a number]
    #[arg(long)]
    name: Option<String>,
    /// For https and tls/: authority that signed the daemon's certificate (PEM), else $SIMD_TLS_CA
    #[arg(long, value_name = "PATH")]
    tls_ca: Option<PathBuf>,
    /// Certificate of this client (PEM), for a daemon that asks its clients for one, else
    /// $SIMD_TLS_CLIENT_CERT
    #[arg(long, value_name = "PATH")]
    tls_client_cert: Option<PathBuf>,
    /// Private key of that certificate (PEM), else $SIMD_TLS_CLIENT_KEY
    #[arg(long, value_name = "PATH")]
    tls_client_key: Option<PathBuf>,
    /// File with a token in its first line, for a daemon that asks for one, else $SIMD_TOKEN
    #[arg(long, value_name = "PATH")]
    token_file: Option<PathBuf>,
    /// Vulkan device, by a part of its name [default: a GPU before a software renderer]
    #[arg(long, value_name = "NAME")]
    pub(crate) adapter: Option<String>,
    /// Number of pictures in work at the same time
    #[arg(long, value_name = "COUNT", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=16))]
    pub(crate) at_once: u8,
    /// GPU memory for meshes, MiB
    #[arg(long, value_name = "MIB", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(16..))]
    pub(crate) memory: u32,
    /// Smooth the edges of colours [default: true on a GPU, false on a software renderer]
    #[arg(long, value_name = "true|false")]
    pub(crate) smooth: Option<bool>,
    /// Exit when stdin closes: for a program that starts a renderer
    #[arg(long)]
    pub(crate) until_stdin_closes: bool,
    /// Exit after one picture
    #[arg(long)]
    pub(crate) once: bool,
    /// Write the manual page, as roff, to stdout
    #[arg(long, exclusive = true, hide = true)]
    pub(crate) man: bool,
}

/// Writes the manual page, as roff.
///
/// # Errors
/// Returns an error if it cannot be written.
pub(crate) fn write_manual(to: &mut impl std::io::Write) -> std::io::Result<()> {
    clap_mangen::Man::new(Options::command()).render(to)
}

impl Options {
    /// Returns the daemon's address.
    pub(crate) fn endpoint(&self) -> String {
        let environment = || std::env::var("SIMD_ENDPOINT").ok().filter(|endpoint| !endpoint.is_empty());
        self.endpoint.clone().or_else(environment).unwrap_or_else(|| format!("127.0.0.1:{DEFAULT_PORT}"))
    }

    /// Returns the token and certificates; options come before environment variables.
    ///
    /// # Errors
    /// Returns an error if the token file has no token.
    pub(crate) fn connect(&self) -> anyhow::Result<ConnectOptions> {
        let default = ConnectOptions::default();
        let token = self.token_file.as_deref().map(Token::from_file).transpose()?;
        Ok(ConnectOptions {
            token: token.or(default.token),
            tls_authorities: self.tls_ca.clone().or(default.tls_authorities),
            tls_certificate: self.tls_client_cert.clone().or(default.tls_certificate),
            tls_key: self.tls_client_key.clone().or(default.tls_key),
            ..default
        })
    }

    /// Returns the name of this renderer.
    pub(crate) fn name(&self) -> String {
        let machine = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        let made_up = || format!("{}-{}", machine.trim(), std::process::id());
        visible(&self.name.clone().unwrap_or_else(made_up))
    }
}

/// Returns the name without invisible characters, cut to the daemon's limit.
fn visible(name: &str) -> String {
    let visible: String = name.chars().filter(char::is_ascii_graphic).take(NAME).collect();
    if visible.is_empty() { format!("simd-camera-{}", std::process::id()) } else { visible }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_well_formed() {
        Options::command().debug_assert();
    }

    #[test]
    fn a_name_is_visible_and_bounded_whatever_was_typed() {
        let name = |text: &str| Options::parse_from(["simd-camera", "--name", text]).name();
        assert_eq!(name("lab 3\n"), "lab3");
        assert_eq!(name(&"n".repeat(500)).len(), NAME);
        assert!(name("\u{fc}").starts_with("simd-camera-"));
        assert!(Options::parse_from(["simd-camera"]).name().ends_with(&std::process::id().to_string()));
    }
}

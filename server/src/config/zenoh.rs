//! The configuration of Zenoh.

#[cfg(feature = "zenoh")]
mod session;

use std::path::PathBuf;

use simd_proto::keys::DEFAULT_LOCATOR;

use super::TlsFiles;

/// Maximum states per wall second.
pub(super) const MAX_STATE_RATE: f64 = 1_000.0;

/// Error of a build without Zenoh.
pub const NO_ZENOH: &str = "this build of simd has no Zenoh: leave out the settings that enable it, or build simd with the \
                            feature `zenoh`";

/// Configuration of the Zenoh front-end.
#[derive(Clone, Debug, PartialEq)]
pub struct Zenoh {
    /// Whether it is enabled.
    pub enabled: bool,
    /// Locators to listen on, as `tcp/HOST:PORT`; port 0 takes a free one. `None` means the default locator,
    /// or no locator if `connect` names a router.
    pub listen: Option<Vec<String>>,
    /// Routers to join.
    pub connect: Vec<String>,
    /// Files of TLS for `tls/` locators.
    pub tls: Option<TlsFiles>,
    /// File with settings of Zenoh, JSON5, which override the daemon's.
    pub file: Option<PathBuf>,
    /// Maximum joint states published per wall second; 0 publishes none.
    pub state_rate: f64,
}

impl Default for Zenoh {
    fn default() -> Self {
        Self {
            enabled: cfg!(feature = "zenoh"),
            listen: None,
            connect: Vec::new(),
            tls: None,
            file: None,
            state_rate: 100.0,
        }
    }
}

impl Zenoh {
    /// Returns a configuration without Zenoh.
    pub fn off() -> Self {
        Self { enabled: false, ..Self::default() }
    }

    /// Returns a configuration that listens only on a free port of loopback.
    pub fn on_free_port() -> Self {
        Self { listen: Some(vec!["tcp/127.0.0.1:0".into()]), ..Self::default() }
    }

    /// Returns the locators to listen on.
    pub fn listens_on(&self) -> Vec<String> {
        match &self.listen {
            Some(locators) => locators.clone(),
            None if self.connect.is_empty() => vec![DEFAULT_LOCATOR.to_owned()],
            None => Vec::new(),
        }
    }

    /// Sets the locators from `off`, or a list of them.
    pub(super) fn set_listen(&mut self, locators: Vec<String>) -> Result<(), String> {
        if locators.iter().any(|locator| locator == "off") {
            if locators.len() > 1 {
                return Err("zenoh is `off`, and has other locators; give only one of the two".into());
            }
            self.enabled = false;
            return Ok(());
        }
        for locator in &locators {
            check_locator(locator)?;
        }
        self.enabled = true;
        self.listen = Some(locators);
        Ok(())
    }

    pub(super) fn set_connect(&mut self, locators: Vec<String>) -> Result<(), String> {
        for locator in &locators {
            check_locator(locator)?;
        }
        self.connect = locators;
        Ok(())
    }

    /// Refuses to be enabled.
    #[cfg(not(feature = "zenoh"))]
    pub(super) fn check(&self, _insecure: bool, _has_tokens: bool) -> Result<(), String> {
        if self.enabled { Err(NO_ZENOH.to_owned()) } else { Ok(()) }
    }
}

pub(super) fn check_locator(locator: &str) -> Result<(), String> {
    let is_one = locator
        .split_once('/')
        .is_some_and(|(protocol, address)| !protocol.is_empty() && address.contains(':'))
        // A value with nested quotes would be parsed as an address, too.
        && !locator.contains("://")
        && !locator.contains(['"', '\'', ' ']);
    #[cfg(feature = "zenoh")]
    let is_one = is_one && locator.parse::<zenoh::config::EndPoint>().is_ok();
    if is_one {
        return Ok(());
    }
    Err(format!("{locator:?} is not a Zenoh locator; it must be like tcp/127.0.0.1:7447"))
}

/// Returns whether only this machine reaches the locator.
pub(super) fn is_loopback(locator: &str) -> bool {
    let address = locator.split_once('/').map_or(locator, |(_protocol, address)| address);
    let address = address.split(['?', '#']).next().unwrap_or(address);
    let host = address.rsplit_once(':').map_or(address, |(host, _port)| host);
    let host = host.trim_start_matches('[').trim_end_matches(']');
    host == "localhost" || host.parse().is_ok_and(|ip: std::net::IpAddr| ip.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loopback_is_what_only_this_machine_reaches() {
        for locator in ["tcp/127.0.0.1:7447", "tls/[::1]:1", "tcp/localhost:0", "tcp/127.8.8.8:1?rel=1"] {
            assert!(is_loopback(locator), "{locator}");
        }
        for locator in ["tcp/0.0.0.0:7447", "tcp/[::]:7447", "tls/lab:7447", "tcp/10.0.0.1:7447", "serial/a"]
        {
            assert!(!is_loopback(locator), "{locator}");
        }
    }
}

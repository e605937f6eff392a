//! The configuration of Zenoh.

#[cfg(feature = "zenoh")]
mod session;

use std::path::PathBuf;

use simd_proto::keys::DEFAULT_LOCATOR;

use super::TlsFiles;

/// States a wall second, 0 to this.
pub(super) const MAX_STATE_RATE: f64 = 1_000.0;

/// Says that a build cannot do what is asked of it.
pub const NO_ZENOH: &str = "this build of simd has no Zenoh: leave out the settings that enable it, or build simd with the \
                            feature `zenoh`";

/// How the daemon is reached over Zenoh.
#[derive(Clone, Debug, PartialEq)]
pub struct Zenoh {
    /// Whether it is.
    pub enabled: bool,
    /// Where to listen, as `tcp/HOST:PORT`; port 0 takes a free one. `None` is the
    /// default locator, or nowhere where `connect` names a router.
    pub listen: Option<Vec<String>>,
    /// Routers to join.
    pub connect: Vec<String>,
    /// What `tls/` locators are served with.
    pub tls: Option<TlsFiles>,
    /// Any settings of Zenoh's own, JSON5; they are put over ours.
    pub file: Option<PathBuf>,
    /// Joint states published a wall second at the most; 0 publishes none.
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
    /// Not reached over Zenoh.
    pub fn off() -> Self {
        Self { enabled: false, ..Self::default() }
    }

    /// On a free port of loopback, and nowhere else.
    pub fn on_free_port() -> Self {
        Self { listen: Some(vec!["tcp/127.0.0.1:0".into()]), ..Self::default() }
    }

    /// Where to listen.
    pub fn listens_on(&self) -> Vec<String> {
        match &self.listen {
            Some(locators) => locators.clone(),
            None if self.connect.is_empty() => vec![DEFAULT_LOCATOR.to_owned()],
            None => Vec::new(),
        }
    }

    /// `off`, or locators to listen on.
    pub(super) fn set_listen(&mut self, locators: Vec<String>) -> Result<(), String> {
        if locators.iter().any(|locator| locator == "off") {
            if locators.len() > 1 {
                return Err("zenoh is off and listens elsewhere; say one of the two".into());
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
        // A value that was quoted once too often is parsed as an address, too.
        && !locator.contains("://")
        && !locator.contains(['"', '\'', ' ']);
    #[cfg(feature = "zenoh")]
    let is_one = is_one && locator.parse::<zenoh::config::EndPoint>().is_ok();
    if is_one {
        return Ok(());
    }
    Err(format!("{locator:?} is no Zenoh locator; it must be like tcp/127.0.0.1:7447"))
}

/// Whether only this machine reaches it.
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

//! Zenoh: checks whether its network can be joined, its daemons, and duplicate names.

use std::time::SystemTime;

use simd_client::{ConnectOptions, DEFAULT_LOCATOR, Network, Presence};

use super::{
    Finding,
    daemon::{Seen, asked},
};
use crate::{credentials::Source, output::number::count};

const CHECK: &str = "Zenoh";

/// Checks the daemon behind a locator.
pub(super) async fn daemon(endpoint: &str, options: &ConnectOptions, token: Option<Source>) -> Seen {
    let mut seen = Seen::default();
    let (locator, name) = match endpoint.rsplit_once('#') {
        Some((locator, name)) if !name.contains('=') => (locator, Some(name)),
        _ => (endpoint, None),
    };
    let (network, there) = match joined(locator, options).await {
        Ok(joined) => joined,
        Err(finding) => {
            seen.findings.push(finding);
            return seen;
        }
    };
    seen.findings.extend(names(&there, locator));
    match meant(&there, name) {
        Ok(name) => {
            let is_plain = !locator.starts_with("tls/") && !super::daemon::is_loopback(locator);
            asked(&network.client(name), token, is_plain, SystemTime::now(), &mut seen).await;
        }
        Err(finding) => seen.findings.push(finding),
    }
    seen
}

/// Checks the Zenoh network of a daemon that was reached over gRPC. Without a locator, no network is
/// required.
pub(super) async fn beside(
    locator: Option<&str>,
    options: &ConnectOptions,
    daemon: Option<&str>,
) -> Vec<Finding> {
    // A token is not sent to an unknown listener, so no calls are made.
    let options = ConnectOptions { token: None, ..options.clone() };
    let place = locator.unwrap_or(DEFAULT_LOCATOR);
    match joined(place, &options).await {
        Ok((_, there)) => {
            let mut all = names(&there, place);
            if let Some(daemon) = daemon {
                all.extend(missing(&there, place, daemon));
            }
            all
        }
        Err(finding) if locator.is_some() => vec![finding],
        Err(finding) => vec![Finding::warning(
            CHECK,
            finding.found,
            "only clients over Zenoh need it, such as Python: start the daemon without `--zenoh off`, or use \
             --zenoh LOCATOR",
        )],
    }
}

async fn joined(locator: &str, options: &ConnectOptions) -> Result<(Network, Vec<Presence>), Finding> {
    let joined = async {
        let network = Network::join(locator, options.clone()).await?;
        let there = network.daemons().await?;
        Ok::<_, simd_client::Error>((network, there))
    };
    joined.await.map_err(|error| {
        let found = match error {
            simd_client::Error::Unreachable { reason, .. } => format!("{locator} cannot be joined: {reason}"),
            error => error.to_string(),
        };
        let advice = "start the router or the daemon that is to listen there, or name another locator";
        Finding::problem(CHECK, found, advice)
    })
}

/// Lists the daemons, and reports duplicate names.
fn names(there: &[Presence], locator: &str) -> Vec<Finding> {
    let mut all = Vec::new();
    let mut names: Vec<&str> = there.iter().map(|presence| presence.name.as_str()).collect();
    names.sort_unstable();
    for same in names.chunk_by(|a, b| a == b).filter(|same| same.len() > 1) {
        let name = same.first().copied().unwrap_or_default();
        all.push(Finding::problem(
            CHECK,
            format!("{} on {locator} are called {name}", count(same.len(), "session")),
            "end all but one, or start it with another --name: clients cannot tell which is meant",
        ));
    }
    names.dedup();
    if names.is_empty() {
        let advice = "start a daemon that joins it (`simd --zenoh-connect LOCATOR`)";
        all.push(Finding::warning(CHECK, format!("no daemon is on {locator}"), advice));
    } else {
        all.push(Finding::ok(
            CHECK,
            format!("{} on {locator}: {}", count(names.len(), "daemon"), names.join(", ")),
        ));
    }
    all
}

/// Returns the daemon of the given name, or the only one.
fn meant<'a>(there: &'a [Presence], name: Option<&str>) -> Result<&'a str, Finding> {
    let mut names: Vec<&str> = there.iter().map(|presence| presence.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    match (name, names.as_slice()) {
        (None, [only]) => Ok(only),
        (Some(name), names) => names.iter().find(|known| **known == name).copied().ok_or_else(|| {
            Finding::problem(
                "daemon",
                format!("no daemon is called {name}"),
                "`simctl daemon list` lists the daemons",
            )
        }),
        (None, []) => Err(Finding::problem("daemon", "no daemon was found", "start one on this network")),
        (None, names) => Err(Finding::problem(
            "daemon",
            format!("there are several: {}", names.join(", ")),
            "add #NAME to the locator to choose one",
        )),
    }
}

fn missing(there: &[Presence], locator: &str, daemon: &str) -> Option<Finding> {
    let is_there = there.iter().any(|presence| presence.name == daemon);
    (!is_there).then(|| {
        Finding::warning(
            CHECK,
            format!("the daemon {daemon} is not on {locator}"),
            "only clients over Zenoh need it there, such as Python: start it with --zenoh or --zenoh-connect",
        )
    })
}

#[cfg(test)]
mod tests {
    use super::super::Level;
    use super::*;

    fn there(names: &[&str]) -> Vec<Presence> {
        let presence =
            |(number, name): (usize, &&str)| Presence { name: (*name).to_owned(), zid: number.to_string() };
        names.iter().enumerate().map(presence).collect()
    }

    fn worst(findings: &[Finding]) -> Level {
        findings.iter().map(|finding| finding.level).max().unwrap()
    }

    #[test]
    fn two_of_one_name_are_a_problem() {
        assert_eq!(worst(&names(&there(&["lab", "sea"]), "tcp/x")), Level::Ok);
        let found = names(&there(&["lab", "sea", "lab"]), "tcp/x");
        assert_eq!(worst(&found), Level::Problem);
        assert!(found[0].found.contains("2 sessions on tcp/x are called lab"), "{found:?}");
        assert_eq!(worst(&names(&[], "tcp/x")), Level::Warning);
    }

    #[test]
    fn a_daemon_that_is_not_there_is_named() {
        let both = there(&["lab", "sea"]);
        assert_eq!(meant(&both, Some("sea")), Ok("sea"));
        assert_eq!(meant(&both[..1], None), Ok("lab"));
        for (there, name) in [(&both[..], None), (&both[..], Some("moon")), (&[], None), (&[], Some("lab"))] {
            assert_eq!(meant(there, name).unwrap_err().level, Level::Problem);
        }
        assert_eq!(missing(&both, "tcp/x", "lab"), None);
        assert_eq!(missing(&both, "tcp/x", "moon").unwrap().level, Level::Warning);
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_router_that_is_not_there_is_a_problem_where_it_was_said() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let locator = format!("tcp/{}", listener.local_addr().unwrap());
        drop(listener);
        let options = ConnectOptions::default();
        assert_eq!(worst(&beside(Some(&locator), &options, None).await), Level::Problem);
        assert_eq!(worst(&daemon(&locator, &options, None).await.findings), Level::Problem);
    }
}

//! `simctl doctor`: checks an installation, and gives advice.
//!
//! * This file: arguments, the order of the checks, and the table of findings.
//! * `daemon`: checks whether a daemon answers. `network`: the same over Zenoh.
//! * `certificate`: certificates of TLS. `files`: tokens and keys that others must not read.
//! * `machine`: resources for a daemon on this machine.

mod certificate;
mod daemon;
mod files;
mod machine;
mod network;

use std::{path::PathBuf, time::SystemTime};

use anyhow::bail;
use clap::Args;
use serde::Serialize;
use simd_client::is_zenoh;

use crate::{
    configuration::configuration_path,
    context::choose,
    credentials,
    options::Options,
    output::{
        Format, Output,
        number::count,
        table::{Column, Page, Table},
    },
};

/// Configuration file of a daemon that is installed as a service.
const SERVICE_CONFIGURATION: &str = "/etc/simd/simd.toml";

const ABOUT: &str = "\
Exit code: 0 without a problem, also with warnings; 1 with a problem.

Tokens and certificates of a daemon on this machine are found through its configuration file.";

#[derive(Args, Debug)]
#[command(after_help = ABOUT)]
pub(crate) struct Doctor {
    /// Configuration file of the daemon [default: /etc/simd/simd.toml if it exists]
    #[arg(long, value_name = "PATH")]
    config: Option<PathBuf>,
    /// Token file of the daemon, as in its flag of that name
    #[arg(long, value_name = "PATH")]
    tokens: Option<PathBuf>,
    /// Certificate of the daemon, as in its flag of that name
    #[arg(long, value_name = "PATH", requires = "tls_key")]
    tls_certificate: Option<PathBuf>,
    /// Key of the daemon's certificate, as in its flag of that name
    #[arg(long, value_name = "PATH", requires = "tls_certificate")]
    tls_key: Option<PathBuf>,
    /// Zenoh network to check; for a daemon on this machine tcp/127.0.0.1:7447
    #[arg(long, value_name = "LOCATOR")]
    zenoh: Option<String>,
}

/// Severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
enum Level {
    Ok,
    Warning,
    Problem,
}

/// Finding of a check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
struct Finding {
    /// Name of the check.
    check: &'static str,
    level: Level,
    found: String,
    /// Null if no action is needed.
    advice: Option<String>,
}

impl Finding {
    fn ok(check: &'static str, found: impl Into<String>) -> Self {
        Self { check, level: Level::Ok, found: found.into(), advice: None }
    }

    fn warning(check: &'static str, found: impl Into<String>, advice: impl Into<String>) -> Self {
        Self { check, level: Level::Warning, found: found.into(), advice: Some(advice.into()) }
    }

    fn problem(check: &'static str, found: impl Into<String>, advice: impl Into<String>) -> Self {
        Self { check, level: Level::Problem, found: found.into(), advice: Some(advice.into()) }
    }
}

pub(crate) async fn run(arguments: Doctor, options: &Options, output: Output) -> anyhow::Result<()> {
    let findings = look(&arguments, options).await;
    output.list(&findings, page)?;
    let problems = findings.iter().filter(|finding| finding.level == Level::Problem).count();
    if problems > 0 {
        bail!("{}", count(problems, "problem"));
    }
    if options.format() == Format::Table {
        let warnings = findings.iter().filter(|finding| finding.level == Level::Warning).count();
        output.remark(&Page::of_line(match warnings {
            0 => "no problems".to_owned(),
            warnings => format!("no problem, {}", count(warnings, "warning")),
        }))?;
    }
    Ok(())
}

async fn look(arguments: &Doctor, options: &Options) -> Vec<Finding> {
    let now = SystemTime::now();
    let mut all = files::configuration(configuration_path().as_deref());
    let chosen = choose(options).map_err(|error| {
        let advice = "name a daemon by --endpoint, or in the configuration file";
        Finding::problem("endpoint", format!("{error:#}"), advice)
    });
    let chosen = chosen.and_then(|choice| {
        all.push(Finding::ok("endpoint", format!("{}, from {}", choice.endpoint, choice.source)));
        let given = credentials::token(options, &choice)
            .and_then(|token| Ok((credentials::connect_options(options, &choice)?, token)));
        match given {
            Ok((connect, token)) => Ok((connect, choice, token.map(|(_, source)| source))),
            Err(error) => {
                let advice = "name a file that has a token in its first line";
                Err(Finding::problem("token", format!("{error:#}"), advice))
            }
        }
    });
    let mut is_here = true;
    match chosen {
        Ok((connect, choice, token)) => {
            if let Some(path) = &connect.tls_authorities {
                all.extend(certificate::authorities(path, now));
            }
            is_here = daemon::is_loopback(&choice.endpoint);
            let seen = match is_zenoh(&choice.endpoint) {
                true => network::daemon(&choice.endpoint, &connect, token).await,
                false => daemon::over_grpc(&choice.endpoint, &connect, token, now).await,
            };
            all.extend(seen.findings);
            let locator = arguments.zenoh.as_deref();
            // The endpoint's own network was already checked.
            if locator.is_some() || (is_here && !is_zenoh(&choice.endpoint)) {
                all.extend(network::beside(locator, &connect, seen.name.as_deref()).await);
            }
        }
        Err(problem) => all.push(problem),
    }
    let service = PathBuf::from(SERVICE_CONFIGURATION);
    let config = arguments.config.clone().or_else(|| (is_here && service.exists()).then_some(service));
    let (found, mut of_daemon) = config.as_deref().map(files::daemon).unwrap_or_default();
    all.extend(found);
    of_daemon.tokens = arguments.tokens.clone().or(of_daemon.tokens);
    of_daemon.certificate = arguments.tls_certificate.clone().or(of_daemon.certificate);
    of_daemon.key = arguments.tls_key.clone().or(of_daemon.key);
    if let Some(path) = &of_daemon.tokens {
        all.extend(files::tokens(path, now));
    }
    if let (Some(certificate), Some(key)) = (&of_daemon.certificate, &of_daemon.key) {
        all.extend(certificate::files(certificate, key, now));
    }
    if is_here {
        all.extend(machine::look());
    } else {
        all.push(Finding::ok("machine", "the daemon is on another one: run `simctl doctor` there too"));
    }
    all
}

fn page(findings: &[Finding]) -> Page {
    let columns = ["CHECK", "RESULT", "FOUND"].map(Column::left).into();
    let row = |finding: &Finding| {
        let level = match finding.level {
            Level::Ok => "ok",
            Level::Warning => "warning",
            Level::Problem => "problem",
        };
        vec![finding.check.to_owned(), level.to_owned(), finding.found.clone()]
    };
    let mut page = Page::new().table(Table::new(columns, findings.iter().map(row).collect()));
    let mut bad: Vec<&Finding> = findings.iter().filter(|finding| finding.advice.is_some()).collect();
    bad.sort_by_key(|finding| std::cmp::Reverse(finding.level));
    for finding in bad {
        let advice = finding.advice.as_deref().unwrap_or_default();
        page = page.line(format!("{}: {advice}", finding.check));
    }
    page
}

/// Converts a system time to seconds since 1970.
fn unix_seconds(time: SystemTime) -> i64 {
    let since = time.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_secs()).unwrap_or(i64::MAX)
}

/// Formats a time relative to now, in seconds: `in 3 days`, `5 hours ago`.
fn away(seconds: i64) -> String {
    let length = seconds.unsigned_abs();
    let (number, unit) = match length {
        0..=119 => (length, "second"),
        120..=7_199 => (length / 60, "minute"),
        7_200..=172_799 => (length / 3_600, "hour"),
        _ => (length / 86_400, "day"),
    };
    let length = count(usize::try_from(number).unwrap_or(usize::MAX), unit);
    if seconds < 0 { format!("{length} ago") } else { format!("in {length}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_given_in_units_for_people() {
        for (seconds, text) in
            [(1, "in 1 second"), (-90, "90 seconds ago"), (7_200, "in 2 hours"), (-864_000, "10 days ago")]
        {
            assert_eq!(away(seconds), text);
        }
        assert!(away(i64::MIN).ends_with("ago"));
    }

    #[test]
    fn advice_follows_the_table_with_the_worst_first() {
        let findings = [
            Finding::ok("a", "fine"),
            Finding::warning("b", "hm", "look"),
            Finding::problem("c", "bad\x1b", "act"),
        ];
        let text = page(&findings).render(false);
        let expected = "\
CHECK  RESULT   FOUND
a      ok       fine
b      warning  hm
c      problem  bad\\u{1b}
c: act
b: look
";
        assert_eq!(text, expected);
    }
}

//! `simd zenoh-acl`: access control for a Zenoh router that limits each session by the name in its
//! certificate.
//!
//! Publications bypass calls. So the daemon alone cannot keep a viewer from publishing messages that look
//! like the daemon's, but a router can.

use std::ffi::OsString;

use clap::{Args, Parser, Subcommand};
use serde_json::{Value, json};
use simd_proto::access::Role;
use simd_proto::methods;

use crate::subcommand;
use simd_world::access::role_of;

/// Keys of liveliness tokens.
const DAEMONS: &str = "@simd/daemons/*/*";
const CLIENTS: &str = "@simd/clients/*/*";
/// Keys that daemons publish.
const PUBLISHED: [&str; 7] = [
    "simd/*/joint_states/*",
    "simd/*/link_poses/*",
    "simd/*/sensor_readings/*/*",
    "simd/*/pictures/*/*",
    "simd/*/world_statistics",
    "simd/*/events",
    "simd/*/parameters",
];

/// A headless robot physics daemon: access control of Zenoh
#[derive(Debug, Parser)]
#[command(name = "simd", version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Prints the access control of a Zenoh router: the rights of sessions, by the common names of their
    /// certificates
    ZenohAcl(Names),
}

/// Common names of certificates.
#[derive(Args, Debug, Default)]
struct Names {
    /// Common name of daemons
    #[arg(long, value_name = "NAME", default_value = "simd")]
    daemon: Vec<String>,
    /// Common name of clients that may call everything; tokens limit them further
    #[arg(long, value_name = "NAME", default_value = "client")]
    client: Vec<String>,
    /// Common name of clients that may only read: no targets, and no call that requires more than the role of
    /// a viewer
    #[arg(long, value_name = "NAME")]
    viewer: Vec<String>,
}

/// Runs the arguments if they begin with `zenoh-acl`; returns the text to print.
///
/// # Errors
/// Returns clap's text about wrong usage.
pub fn run(arguments: &[OsString]) -> Option<Result<String, String>> {
    let Command::ZenohAcl(names) = match subcommand::read::<Arguments>("zenoh-acl", arguments)? {
        Ok(arguments) => arguments.command,
        Err(said) => return Some(said),
    };
    Some(Ok(format!("{:#}\n", access_control(&names))))
}

/// Returns a rule: its id, directions, messages and keys.
fn rule(id: &str, flows: &[&str], messages: &[&str], keys: &[&str]) -> Value {
    json!({ "id": id, "permission": "allow", "flows": flows, "messages": messages, "key_exprs": keys })
}

/// Returns the access control part of a router's configuration.
fn access_control(names: &Names) -> Value {
    let says = ["declare_subscriber", "liveliness_query", "declare_liveliness_subscriber"];
    let hears = ["put", "reply", "declare_subscriber", "declare_queryable", "liveliness_token"];
    let calls = "simd/*/rpc/*/*";
    let targets = "simd/*/joint_targets";
    let reads = viewers_calls();
    let reads: Vec<&str> = reads.iter().map(String::as_str).collect();
    let watched: Vec<&str> = PUBLISHED.into_iter().chain([DAEMONS]).collect();
    let mut rules = vec![
        rule(
            "daemons say",
            &["ingress"],
            &["put", "reply", "declare_queryable", "liveliness_token"],
            &["simd/*/**", DAEMONS],
        ),
        rule("daemons hear", &["egress"], &["put", "query"], &[calls, targets]),
        rule(
            "daemons ask",
            &["ingress", "egress"],
            &["declare_subscriber", "liveliness_token", "liveliness_query", "declare_liveliness_subscriber"],
            &["simd/*/**", DAEMONS, CLIENTS],
        ),
        rule("clients are there", &["ingress"], &["liveliness_token"], &[CLIENTS]),
        rule("clients say", &["ingress"], &["put", "query"], &[calls, targets]),
        rule("clients ask", &["ingress"], &says, &watched),
        rule("clients hear", &["egress"], &hears, &["simd/*/**", DAEMONS]),
    ];
    let mut subjects = vec![
        json!({ "id": "daemons", "cert_common_names": names.daemon }),
        json!({ "id": "clients", "cert_common_names": names.client }),
    ];
    let mut policies = vec![
        json!({ "subjects": ["daemons"], "rules": ["daemons say", "daemons hear", "daemons ask"] }),
        json!({ "subjects": ["clients"], "rules": ["clients are there", "clients say", "clients ask", "clients hear"] }),
    ];
    if !names.viewer.is_empty() {
        rules.push(rule("viewers say", &["ingress"], &["query"], &reads));
        subjects.push(json!({ "id": "viewers", "cert_common_names": names.viewer }));
        policies.push(
            json!({ "subjects": ["viewers"], "rules": ["viewers say", "clients ask", "clients hear"] }),
        );
    }
    let control = json!({
        "enabled": true, "default_permission": "deny", "subjects": subjects, "rules": rules, "policies": policies,
    });
    json!({ "access_control": control })
}

/// Returns the keys of the calls that a viewer may make.
fn viewers_calls() -> Vec<String> {
    let calls = methods::all().filter(|(service, name, _)| role_of(service, name) == Role::Viewer);
    calls.map(|(service, name, _)| format!("simd/*/rpc/{service}/{name}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viewers_may_make_the_calls_of_viewers_and_no_other() {
        let calls = viewers_calls();
        assert!(calls.contains(&"simd/*/rpc/JointService/GetJointStates".to_owned()));
        assert!(!calls.iter().any(|key| key.ends_with("/SetJointTargets") || key.ends_with("/DeleteEntity")));
    }

    #[cfg(feature = "zenoh")]
    #[test]
    fn zenoh_reads_the_printed_access_control() {
        let said = run(&["simd", "zenoh-acl", "--viewer", "a", "--viewer", "b"].map(OsString::from))
            .unwrap()
            .unwrap();
        let read = zenoh::Config::from_json5(&said).unwrap();
        assert!(read.get_json("access_control").unwrap().contains("viewers say"));
        assert!(run(&["simd".into()]).is_none());
        assert!(run(&["simd", "zenoh-acl", "--unknown"].map(OsString::from)).unwrap().is_err());
    }
}

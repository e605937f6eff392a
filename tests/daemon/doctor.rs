//! Findings of `simctl doctor`.

use serde_json::Value;
use simd_tests::network::Router;
use simd_tests::process::{Home, Process, said};
use tokio::process::Command;

use crate::operator::{guarded, json};

/// Returns the doctor's result for each check, with the worst of several lines.
async fn doctor(mut command: Command, arguments: &[&str]) -> (i32, Vec<(String, String, String)>) {
    command.args(["doctor", "--json"]).args(arguments);
    let said = said("simctl", command).await;
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let document = json(&said);
    let found = document.as_array().unwrap().iter().map(|of| {
        // Every problem comes with advice.
        assert_eq!(of["level"] == "ok", of["advice"].is_null(), "{of}");
        (text(&of["check"]), text(&of["level"]), text(&of["found"]))
    });
    (said.code, found.collect())
}

fn problems(found: &[(String, String, String)]) -> Vec<(&str, &str)> {
    found.iter().filter(|(_, level, _)| level == "problem").map(|(of, _, text)| (&**of, &**text)).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_doctor_finds_a_healthy_daemon_an_empty_port_and_tokens_that_are_wrong() {
    let home = Home::new();
    let (daemon, [admin, _]) = guarded(&home).await;
    let look = async |token: Option<&str>, place: &str, arguments: &[&str]| {
        let mut command = home.command("simctl");
        command.env("SIMD_ENDPOINT", place).envs(token.map(|token| ("SIMD_TOKEN", token)));
        doctor(command, arguments).await
    };
    let tokens = home.path().join("tokens").display().to_string();
    let (code, found) = look(Some(&admin), daemon.address(), &["--tokens", &tokens]).await;
    assert!(code == 0 && problems(&found).is_empty(), "{found:?}");
    let has =
        |check: &str, text: &str| found.iter().any(|(of, _, found)| of == check && found.contains(text));
    assert!(
        has("daemon", "called guarded") && has("token", "the token of admin, from SIMD_TOKEN: admin"),
        "{found:?}"
    );
    assert!(
        has("file of tokens", "2 tokens") && has("clock", "within") && has("world", "0 overruns"),
        "{found:?}"
    );

    let (code, found) = look(None, daemon.address(), &[]).await;
    assert!(code == 1 && matches!(problems(&found)[..], [("token", _)]), "{found:?}");
    let (code, found) = look(Some("simd_no"), daemon.address(), &[]).await;
    assert!(code == 1 && problems(&found)[0].1.contains("is refused"), "{found:?}");
    let (code, found) = look(None, "127.0.0.1:1", &[]).await;
    assert!(code == 1 && problems(&found)[0].1.contains("nothing listens at 127.0.0.1:1"), "{found:?}");
    let (code, found) = look(None, &format!("https://{}", daemon.address()), &[]).await;
    assert!(code == 1 && problems(&found)[0].0 == "TLS", "{found:?}");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        std::fs::set_permissions(&tokens, std::fs::Permissions::from_mode(0o644)).unwrap();
        let (code, found) = look(Some(&admin), daemon.address(), &["--tokens", &tokens]).await;
        assert!(code == 1 && problems(&found)[0].1.contains("0644"), "{found:?}");
    }
    // For people: the advice follows the table.
    let mut table = home.command("simctl");
    table.args(["doctor", "-e", "127.0.0.1:1"]);
    let table = said("simctl", table).await;
    assert!(
        table.out.contains("port: start a daemon there") && table.err == "simctl: 1 problem\n",
        "{table:?}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_doctor_looks_at_certificates_as_they_are_served() {
    let home = Home::new();
    let tls = home.path().join("tls");
    let file = |name: &str| tls.join(name).display().to_string();
    assert_eq!(home.run("simd", ["tls", "init", &tls.display().to_string()]).await.code, 0);
    let flags = ["--tls-certificate", &file("server.pem"), "--tls-key", &file("server.key")];
    let daemon = Process::start(flags).await;
    let plain = daemon.endpoint.replace("https://", "http://");
    let look = async |place: &str, authority: &str| {
        let mut command = home.command("simctl");
        command.env("SIMD_ENDPOINT", place).env("SIMD_TLS_CA", authority);
        doctor(command, &flags).await
    };
    let (code, found) = look(&daemon.endpoint, &file("ca.pem")).await;
    assert_eq!(problems(&found), [], "{found:?}");
    assert_eq!(code, 0);
    let served: Vec<&str> =
        found.iter().filter(|(of, ..)| of == "certificate").map(|(.., text)| &**text).collect();
    assert!(served[0].contains("expires in") && served[1].contains("127.0.0.1"), "{served:?}");
    let (code, found) = look(&plain, &file("ca.pem")).await;
    assert!(code == 1 && problems(&found)[0].1.contains("the endpoint does not"), "{found:?}");
    let other = home.path().join("other");
    assert_eq!(home.run("simd", ["tls", "init", &other.display().to_string()]).await.code, 0);
    let (code, found) = look(&daemon.endpoint, &other.join("ca.pem").display().to_string()).await;
    assert!(code == 1 && problems(&found)[0].1.contains("not trusted"), "{found:?}");
    let (code, found) = look(&daemon.endpoint, &file("none.pem")).await;
    assert!(code == 1 && problems(&found)[0].0 == "authorities", "{found:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_doctor_joins_a_router_and_counts_names() {
    let router = Router::start().await;
    let zenoh = ["--zenoh-connect", router.locator.as_str()];
    let _lab = Process::start_with(zenoh, ["--name", "lab", "--paused"]).await;
    let look = async |place: &str| {
        let mut command = Home::new().command("simctl");
        command.env("SIMD_ENDPOINT", place);
        doctor(command, &[]).await
    };
    let (code, found) = look(&router.locator).await;
    assert_eq!((code, problems(&found)), (0, Vec::new()), "{found:?}");
    assert!(found.iter().any(|(of, _, text)| of == "Zenoh" && text.contains("1 daemon")), "{found:?}");
    let (code, found) = look(&format!("{}#sea", router.locator)).await;
    assert!(code == 1 && problems(&found)[0].1.contains("no daemon is called sea"), "{found:?}");
}

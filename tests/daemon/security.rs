//! The lines of `docs/security.md`, as an operator and a client run them.

use simd_tests::process::{Home, Process, Said, said, soon};

/// Returns the result of a shell command in this folder.
async fn shell(home: &Home, command: &str) -> Said {
    let mut shell = home.command("sh");
    shell.args(["-c", command]).current_dir(home.path());
    said(command, shell).await
}

#[tokio::test]
async fn the_documented_lines_make_a_daemon_that_only_those_with_a_token_reach() {
    let document =
        std::fs::read_to_string(simd_tests::process::repository().join("docs/security.md")).unwrap();
    let home = Home::new();
    let folder = home.path().display().to_string();
    let fences: Vec<String> =
        document.split("```sh\n").skip(1).map(|rest| rest.split("```").next().unwrap().to_owned()).collect();
    let [operator, client, ..] = fences.as_slice() else { panic!("{fences:?}") };
    let operator = operator.replace("/etc/simd", &folder).replace("\\\n", "");
    let (made, start) = operator.split_once("simd --listen").unwrap();
    let made = shell(&home, made).await;
    assert_eq!(made.code, 0, "{}", made.err);
    let token = made.out.lines().last().unwrap().to_owned();
    assert!(token.starts_with("simd_"), "{}", made.out);
    let flags = start.split_whitespace().skip(1).filter(|word| !["--zenoh", "off"].contains(word));
    let daemon = Process::start(flags).await;
    assert!(daemon.endpoint.starts_with("https://127.0.0.1:"), "{}", daemon.endpoint);
    let client = client
        .replace("SIMD_TLS_CA=ca.pem", &format!("SIMD_TLS_CA={folder}/tls/ca.pem"))
        .replace("simd_...", &token)
        .replace("https://lab.example:7400", &daemon.endpoint);
    let listed = shell(&home, &client).await;
    assert_eq!((listed.code, listed.err.as_str()), (0, ""), "{client}");
    assert!(listed.out.contains("ROBOT") || listed.out.contains("no robots"), "{}", listed.out);
    let environment = client.lines().find(|line| line.starts_with("export")).unwrap();
    let paused = shell(&home, &format!("{environment}; simctl sim pause")).await;
    assert!(paused.code == 71 && paused.err.contains("needs the role admin"), "{paused:?}");
    let unknown = shell(&home, &format!("{environment}; SIMD_TOKEN= simctl robot list")).await;
    assert!(unknown.code == 80 && unknown.err.contains("asks for a token"), "{unknown:?}");
    let plain = daemon.endpoint.replace("https", "http");
    let plain = shell(&home, &format!("{environment}; simctl -e {plain} robot list")).await;
    assert!(plain.code == 78 && plain.out.is_empty(), "{plain:?}");
    let listed = shell(&home, &format!("simctl token list --file {folder}/tokens")).await;
    assert!(listed.out.contains("alice") && !listed.out.contains(&token), "{}", listed.out);
    let again = shell(&home, &format!("simctl token add alice --role admin --file {folder}/tokens")).await;
    assert!(again.code == 1 && again.err.contains("already"), "{again:?}");
    let revoked = shell(&home, &format!("simctl token revoke alice --file {folder}/tokens")).await;
    assert_eq!((revoked.code, revoked.out.as_str()), (0, "revoked the token of alice\n"), "{}", revoked.err);
    let listed = shell(&home, &format!("simctl token list --file {folder}/tokens")).await;
    assert!(listed.code == 0 && !listed.out.contains("alice"), "{listed:?}");
    // The daemon looks at the file each second.
    let refused = soon("the end of the token", async {
        loop {
            let said = shell(&home, &client).await;
            if said.code != 0 {
                return said;
            }
        }
    })
    .await;
    let is_said = refused.err.contains("the token is unknown, or was revoked");
    assert!(refused.code == 80 && is_said && refused.out.is_empty(), "{refused:?}");
}

#[cfg(unix)]
#[tokio::test]
async fn a_file_of_tokens_is_its_owners_alone_and_a_context_has_a_token() {
    use std::os::unix::fs::PermissionsExt as _;
    let home = Home::new();
    let token = shell(&home, "umask 000; simctl token add bob --role viewer --expires 1h").await.out;
    let tokens = home.path().join("simd/tokens");
    assert_eq!(std::fs::metadata(&tokens).unwrap().permissions().mode() & 0o777, 0o600);
    let daemon = Process::start(["--tokens".as_ref(), tokens.as_os_str()]).await;
    let context = format!(
        "context = \"lab\"\n[contexts.lab]\nendpoint = \"{}\"\ntoken = \"{}\"\n",
        daemon.endpoint,
        token.trim()
    );
    let file = home.path().join("simd/config.toml");
    std::fs::write(&file, context).unwrap();
    for (mode, is_warned) in [(0o644, true), (0o600, false)] {
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(mode)).unwrap();
        let info = shell(&home, "simctl server info -o json").await;
        assert_eq!(info.code, 0, "{}", info.err);
        let warning = "has a token, and others can read or change it (its mode is 0644): chmod 600 ";
        assert_eq!(info.err.contains(warning), is_warned, "{}", info.err);
    }
    let revoked = shell(&home, "simctl token revoke bob; simctl token revoke bob").await;
    assert!(revoked.out.contains("revoked the token of bob") && revoked.err.contains("no token called bob"));
}

//! Files that are damaged, missing, or readable for others.

use std::os::unix::fs::PermissionsExt as _;

use super::super::Level;
use super::*;

fn write(folder: &tempfile::TempDir, name: &str, text: &str, mode: u32) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, text).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
    path
}

fn worst(findings: &[Finding]) -> &Finding {
    findings.iter().max_by_key(|finding| finding.level).unwrap()
}

const HASH: &str = "2bb80d537b1da3e38bd30361aa855686bde0eacd7162fef6a25fe97bf527a25b";

#[test]
fn a_file_of_tokens_that_others_read_is_a_problem() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("alice admin {HASH} never\n");
    let now = SystemTime::now();
    let path = write(&folder, "tokens", &text, 0o600);
    assert_eq!(worst(&tokens(&path, now)).level, Level::Ok);
    for mode in [0o644, 0o640, 0o606, 0o620] {
        let path = write(&folder, "tokens", &text, mode);
        let found = tokens(&path, now);
        let worst = worst(&found);
        assert_eq!(worst.level, Level::Problem, "{worst:?}");
        assert_eq!(worst.advice, Some(format!("chmod 600 {}", path.display())));
    }
}

#[test]
fn damaged_empty_expired_and_missing_tokens_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let now = SystemTime::now();
    for (text, level, phrase) in [
        ("alice admin nonsense never\n".to_owned(), Level::Problem, "is not a SHA-256"),
        (String::new(), Level::Warning, "has no token"),
        (format!("bob viewer {HASH} 2020-01-01T00:00:00Z\n"), Level::Warning, "bob have expired"),
    ] {
        let path = write(&folder, "tokens", &text, 0o600);
        let found = tokens(&path, now);
        let worst = worst(&found);
        assert!(worst.level == level && worst.found.contains(phrase), "{found:?}");
    }
    assert_eq!(worst(&tokens(&folder.path().join("none"), now)).level, Level::Problem);
    assert_eq!(worst(&tokens(folder.path(), now)).level, Level::Problem);
}

#[test]
fn a_configuration_with_a_token_is_its_owners_alone() {
    let folder = tempfile::tempdir().unwrap();
    let text = "context = \"lab\"\n[contexts.lab]\nendpoint = \"lab\"\n";
    let path = write(&folder, "config.toml", text, 0o644);
    assert_eq!(worst(&configuration(Some(&path))).level, Level::Ok, "there is no secret in it");
    let secret = format!("{text}token = \"simd_1\"\n");
    let path = write(&folder, "config.toml", &secret, 0o644);
    assert_eq!(worst(&configuration(Some(&path))).level, Level::Problem);
    let path = write(&folder, "config.toml", &secret, 0o600);
    assert_eq!(worst(&configuration(Some(&path))).level, Level::Ok);
    for text in ["context = \"moon\"\n", "contxt = 1\n"] {
        let path = write(&folder, "config.toml", text, 0o600);
        assert_eq!(worst(&configuration(Some(&path))).level, Level::Problem, "{text}");
    }
    assert_eq!(worst(&configuration(Some(&folder.path().join("none")))).level, Level::Ok);
}

#[test]
fn a_daemons_file_says_where_its_own_are() {
    let folder = tempfile::tempdir().unwrap();
    let text = "tokens = \"tokens\"\n[tls]\ncertificate = \"/etc/c.pem\"\nkey = \"k.pem\"\n[zenoh]\nenabled = false\n";
    let (found, files) = daemon(&write(&folder, "simd.toml", text, 0o644));
    assert_eq!(worst(&found).level, Level::Ok);
    let expected = DaemonFiles {
        tokens: Some(folder.path().join("tokens")),
        certificate: Some("/etc/c.pem".into()),
        key: Some(folder.path().join("k.pem")),
    };
    assert_eq!(files, expected);
    let (found, files) = daemon(&write(&folder, "simd.toml", "tokens = [", 0o644));
    assert_eq!((worst(&found).level, files), (Level::Problem, DaemonFiles::default()));
}

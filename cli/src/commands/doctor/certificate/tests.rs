//! Certificates with the wrong time, name or key.

use rcgen::{CertificateParams, KeyPair};

use super::super::Level;
use super::*;

/// Returns a certificate that is valid for a range of days relative to now, and its key.
fn certificate(from: i64, to: i64) -> (String, String) {
    let names = ["lab.example", "*.sea.example", "127.0.0.1"].map(str::to_owned);
    let mut params = CertificateParams::new(names).unwrap();
    let now = time::OffsetDateTime::now_utc();
    (params.not_before, params.not_after) =
        (now + time::Duration::days(from), now + time::Duration::days(to));
    let key = KeyPair::generate().unwrap();
    (params.self_signed(&key).unwrap().pem(), key.serialize_pem())
}

fn levels(found: &[Finding]) -> Vec<Level> {
    found.iter().map(|finding| finding.level).collect()
}

#[test]
fn expired_early_and_soon_expiring_certificates_are_found() {
    let now = SystemTime::now();
    for (from, to, level, phrase) in [
        (-1, 365, Level::Ok, "it expires in 36"),
        (-9, 10, Level::Warning, "it expires in"),
        (-9, -3, Level::Problem, "it expired 3 days ago"),
        (3, 9, Level::Problem, "valid only in"),
    ] {
        let (pem, _) = certificate(from, to);
        let chain = certificates(&pem).unwrap();
        let found = served("lab.example", &chain, now);
        assert_eq!(levels(&found), [level, Level::Ok], "{found:?}");
        assert!(found[0].found.contains(phrase), "{found:?}");
    }
    assert_eq!(levels(&served("lab.example", &[], now)), [Level::Problem]);
    let nonsense = CertificateDer::from(vec![1, 2, 3]);
    assert_eq!(levels(&served("lab.example", &[nonsense], now)), [Level::Problem]);
}

#[test]
fn a_certificate_is_for_its_names_alone() {
    let (pem, _) = certificate(-1, 365);
    let chain = certificates(&pem).unwrap();
    for (host, level) in [
        ("lab.example", Level::Ok),
        ("LAB.example", Level::Ok),
        ("deep.sea.example", Level::Ok),
        ("127.0.0.1", Level::Ok),
        ("sea.example", Level::Problem),
        ("a.deep.sea.example", Level::Problem),
        ("127.0.0.2", Level::Problem),
        ("lab", Level::Problem),
    ] {
        let found = served(host, &chain, SystemTime::now());
        assert_eq!(found[1].level, level, "{host}: {found:?}");
    }
}

#[cfg(unix)]
#[test]
fn a_key_must_be_the_certificates_and_its_owners_alone() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = tempfile::tempdir().unwrap();
    let (cert, key) = (folder.path().join("server.pem"), folder.path().join("server.key"));
    let (pem, own) = certificate(-1, 365);
    let (_, other) = certificate(-1, 365);
    let look = |text: &str, mode: u32| {
        fs::write(&cert, &pem).unwrap();
        fs::write(&key, text).unwrap();
        fs::set_permissions(&key, fs::Permissions::from_mode(mode)).unwrap();
        levels(&files(&cert, &key, SystemTime::now()))
    };
    assert_eq!(look(&own, 0o600), [Level::Ok; 3]);
    assert_eq!(look(&own, 0o644), [Level::Ok, Level::Problem, Level::Ok]);
    assert_eq!(look(&other, 0o600), [Level::Ok, Level::Ok, Level::Problem]);
    assert_eq!(look("nothing", 0o600), [Level::Ok, Level::Ok, Level::Problem]);
    // The two files swapped.
    assert!(files(&key, &cert, SystemTime::now()).iter().any(|of| of.level == Level::Problem));
    assert!(files(&folder.path().join("none"), &key, SystemTime::now())[0].level == Level::Problem);
}

#[test]
fn authorities_are_certificates_in_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ca.pem");
    let (pem, key) = certificate(-1, 365);
    for (text, level) in [(&*pem, Level::Ok), (&*key, Level::Problem), ("", Level::Problem)] {
        fs::write(&path, text).unwrap();
        assert_eq!(levels(&authorities(&path, SystemTime::now())), [level]);
    }
    assert_eq!(levels(&authorities(&folder.path().join("none"), SystemTime::now())), [Level::Problem]);
}

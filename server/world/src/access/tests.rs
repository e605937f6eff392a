//! Tokens in a file that changes.

use std::fs;
use std::path::Path;

use simd_proto::access::{TokenEntry, token, write_tokens};
use tempfile::TempDir;

use super::*;

fn write(path: &Path, entries: &[TokenEntry]) {
    // Each version has another length: a file system may have coarse times.
    let length = fs::metadata(path).map_or(0, |metadata| metadata.len());
    let padding = "#".repeat(usize::try_from(length).unwrap() + 1);
    fs::write(path, format!("{padding}\n{}", write_tokens(entries))).unwrap();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        fs::set_permissions(path, fs::Permissions::from_mode(0o600)).unwrap();
    }
}

fn entry(name: &str, role: Role) -> (String, TokenEntry) {
    let text = token(&[name.as_bytes()[0]; 32]);
    let hash = token_hash(&text).unwrap();
    (text, TokenEntry { name: name.into(), role, hash, expires: None, robots: Vec::new() })
}

#[test]
fn without_tokens_every_client_may_do_all() {
    let access = Access::open();
    assert!(!access.is_required());
    assert!(access.check(None, Role::Admin, "DeleteEntity").unwrap().is_none());
}

#[test]
fn a_token_allows_its_role_and_those_below() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("tokens");
    let (text, alice) = entry("alice", Role::Operator);
    write(&path, &[alice]);
    let access = Access::from_file(path).unwrap();
    for (needed, allowed) in [(Role::Viewer, true), (Role::Operator, true), (Role::Admin, false)] {
        assert_eq!(access.check(Some(&text), needed, "Method").is_ok(), allowed, "{needed}");
    }
    let refused = access.check(Some(&text), Role::Admin, "DeleteEntity").unwrap_err();
    assert_eq!(
        refused.to_string(),
        "the token of alice has the role operator, and DeleteEntity needs the role admin"
    );
    assert_eq!(access.check(None, Role::Viewer, "Method").unwrap_err(), Denied::Missing);
    assert_eq!(access.check(Some(""), Role::Viewer, "Method").unwrap_err(), Denied::Missing);
    assert_eq!(access.check(Some(&text[1..]), Role::Viewer, "Method").unwrap_err(), Denied::Unknown);
}

#[test]
fn a_folder_in_place_of_the_file_is_refused_without_waiting() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("tokens");
    let (text, alice) = entry("alice", Role::Viewer);
    write(&path, &[alice]);
    let access = Access::from_file(path.clone()).unwrap();
    fs::remove_file(&path).unwrap();
    fs::create_dir(&path).unwrap();
    access.look();
    access.check(Some(&text), Role::Viewer, "Method").unwrap();
    assert!(Access::from_file(path).unwrap_err().contains("it is not a file"));
}

#[test]
fn a_changed_file_changes_the_rights() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("tokens");
    let ((a, alice), (b, bob)) = (entry("alice", Role::Admin), entry("bob", Role::Viewer));
    write(&path, &[alice.clone(), bob.clone()]);
    let access = Access::from_file(path.clone()).unwrap();
    let granted = |text: &str| access.check(Some(text), Role::Viewer, "Method");
    let (first, second) = (granted(&a).unwrap().unwrap(), granted(&b).unwrap().unwrap());
    write(&path, std::slice::from_ref(&alice));
    access.look();
    assert!(second.revoked.is_cancelled() && !first.revoked.is_cancelled(), "alice's streams go on");
    assert_eq!(granted(&b).unwrap_err(), Denied::Unknown);
    // An entry with another role gets a new grant.
    write(&path, &[TokenEntry { role: Role::Viewer, ..alice.clone() }]);
    access.look();
    assert!(first.revoked.is_cancelled());
    assert_eq!(granted(&a).unwrap().unwrap().role, Role::Viewer);
    // A missing or damaged file changes nothing.
    fs::write(&path, "nonsense").unwrap();
    access.look();
    granted(&a).unwrap();
    fs::remove_file(&path).unwrap();
    access.look();
    granted(&a).unwrap();
    // An expired token ends its streams.
    let past = Some("2020-01-01T00:00:00Z".parse().unwrap());
    let before = granted(&a).unwrap().unwrap();
    write(&path, &[TokenEntry { expires: past, ..alice }]);
    access.look();
    assert!(before.revoked.is_cancelled());
    assert_eq!(granted(&a).unwrap_err(), Denied::Expired { name: "alice".into() });
}

#[test]
fn a_flood_of_refusals_has_few_lines_and_is_counted() {
    let mut refusals = Refusals::default();
    let lines: Vec<_> = (0..1_000).filter_map(|_| refusals.may_log(7)).collect();
    assert_eq!(lines, [0; REFUSALS as usize]);
    assert_eq!(refusals.may_log(8), Some(1_000 - u64::from(REFUSALS)));
    assert_eq!(refusals.may_log(8), Some(0));
}

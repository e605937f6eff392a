//! Selection of the daemon, and changes of the file by `context use`.

use clap::Parser as _;

use super::*;
use crate::commands::Arguments;

const FILE: &str =
    "context = \"lab\"\n[contexts.lab]\nendpoint = \"lab:1\"\n[contexts.sea]\nendpoint = \"sea:2\"\n";

fn choice(flags: &str, environment: Option<&str>, file: &str) -> anyhow::Result<(String, String)> {
    let line = format!("simctl robot list {flags}");
    let arguments = Arguments::try_parse_from(line.split_whitespace()).unwrap();
    let choice =
        choose_from(&arguments.options, environment.map(str::to_owned), || Ok(toml::from_str(file)?))?;
    Ok((choice.endpoint, choice.source))
}

#[test]
fn the_flag_beats_the_environment_which_beats_the_file() {
    for (flags, environment, file, endpoint, source) in [
        ("-e here:9", Some("env:3"), FILE, "here:9", "--endpoint"),
        ("--context sea", Some("env:3"), FILE, "sea:2", "context sea"),
        ("", Some("env:3"), FILE, "env:3", "SIMD_ENDPOINT"),
        ("", None, FILE, "lab:1", "context lab"),
        ("", None, "", "127.0.0.1:7400", "default"),
    ] {
        let expected = (endpoint.to_owned(), source.to_owned());
        assert_eq!(choice(flags, environment, file).unwrap(), expected);
    }
}

#[test]
fn an_unknown_context_lists_those_there_are() {
    let error = choice("--context moon", None, FILE).unwrap_err().to_string();
    assert_eq!(error, "there is no context `moon`; there is lab, sea");
    assert!(choice("--context moon", None, "").is_err());
}

#[test]
fn another_context_leaves_the_rest_of_the_file_as_it_was_written() {
    let folder = tempfile::TempDir::new().unwrap();
    let path = folder.path().join("config.toml");
    for (before, after) in [
        (format!("# mine\n{FILE}"), format!("# mine\n{}", FILE.replace("\"lab\"\n[", "\"sea\"\n["))),
        (
            "[contexts.sea]\nendpoint = \"a\"".to_owned(),
            "context = \"sea\"\n[contexts.sea]\nendpoint = \"a\"".to_owned(),
        ),
        (
            "context=\"x\" # why\n\n[contexts.sea] # \"context = 1\"\nendpoint = \"a\"\n".to_owned(),
            "context = \"sea\"\n\n[contexts.sea] # \"context = 1\"\nendpoint = \"a\"\n".to_owned(),
        ),
    ] {
        fs::write(&path, before).unwrap();
        use_context(&path, "sea").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), after);
    }
    let strange = "\"context\" = \"x\"\n[contexts.sea]\nendpoint = \"a\"\n";
    fs::write(&path, strange).unwrap();
    assert!(use_context(&path, "sea").unwrap_err().to_string().contains("cannot be edited"));
    assert_eq!(fs::read_to_string(&path).unwrap(), strange, "it is left alone");
    assert!(use_context(&path, "moon").unwrap_err().to_string().contains("there is sea"));
    assert!(use_context(&folder.path().join("none"), "sea").is_err());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left beside it");
}

#[cfg(unix)]
#[test]
fn the_file_keeps_its_mode_and_stays_behind_its_link() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = tempfile::TempDir::new().unwrap();
    let (real, link) = (folder.path().join("real"), folder.path().join("config.toml"));
    fs::write(&real, FILE).unwrap();
    fs::set_permissions(&real, fs::Permissions::from_mode(0o640)).unwrap();
    std::os::unix::fs::symlink(&real, &link).unwrap();
    use_context(&link, "sea").unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(fs::metadata(&real).unwrap().permissions().mode() & 0o777, 0o640);
    assert_eq!(read(Some(&link)).unwrap().context.as_deref(), Some("sea"));
}

#[test]
fn a_slip_in_the_file_is_an_error_that_names_the_file() {
    let dir = tempfile::TempDir::new().unwrap();
    let path = dir.path().join("config.toml");
    fs::write(&path, "contxt = \"lab\"\n").unwrap();
    let error = format!("{:#}", read(Some(&path)).unwrap_err());
    assert!(error.contains("config.toml is not a configuration") && error.contains("contxt"), "{error}");
    assert!(read(Some(&dir.path().join("none.toml"))).unwrap().contexts.is_empty());
}

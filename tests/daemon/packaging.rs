//! The programs understand the files of packages.

use std::ffi::OsString;
use std::path::PathBuf;

use simd_server::config::{self, Asked, Config};
use simd_tests::process::{Home, repository, said};

const UNITS: [&str; 2] = ["simd.service", "simd@.service"];

fn packaging() -> PathBuf {
    repository().join("server/packaging")
}

fn read(file: &str) -> String {
    std::fs::read_to_string(packaging().join(file)).unwrap()
}

fn config(arguments: &[OsString]) -> Config {
    let line = std::iter::once("simd".into()).chain(arguments.iter().cloned());
    Config::from_args(line).unwrap_or_else(|error| panic!("{arguments:?}: {error}"))
}

/// Returns the configuration that is installed.
fn default_file() -> String {
    let asked = config::run(&["simd", "config", "default"].map(OsString::from), []);
    let Some(Ok(Asked::Text(text))) = asked else { panic!("{asked:?}") };
    text
}

/// Returns the configuration of a text, as text.
fn read_as_file(text: &str) -> String {
    let home = Home::new();
    let path = home.path().join("simd.toml");
    std::fs::write(&path, text).unwrap();
    // An example names it.
    std::fs::write(home.path().join("zenoh.json5"), "{}").unwrap();
    format!("{:#?}", config(&["--config".into(), path.into()]))
}

/// Returns the text without these marks at the beginning of lines, where something follows at once.
fn without(marks: &str, text: &str) -> String {
    let line = |line: &str| match line.strip_prefix(marks) {
        Some(rest) if !rest.starts_with([' ', '#']) && !rest.is_empty() => rest.to_owned() + "\n",
        _ => line.to_owned() + "\n",
    };
    text.lines().map(line).collect()
}

#[test]
fn the_configuration_that_is_installed_is_the_default_also_where_its_comments_are_taken_off() {
    let text = default_file();
    let default = format!("{:#?}", config(&[]));
    assert_eq!(read_as_file(&text), default);
    let keys = without("#", &text);
    assert!(keys.contains("\nidle_seconds = 300\n"), "{keys}");
    assert_eq!(read_as_file(&keys), default);
}

#[test]
fn the_examples_of_the_configuration_that_is_installed_are_understood() {
    let text = without("#", &without("##", &default_file()));
    for key in ["tokens", "certificate", "config", "file", "[[robots]]", "positions"] {
        assert!(text.lines().any(|line| line.starts_with(key)), "{key}");
    }
    let understood = read_as_file(&text);
    assert!(understood.contains("/srv/robots/arm"), "{understood}");
}

/// Returns the command of a unit, with the values that systemd puts in place of specifiers.
fn command(unit: &str) -> Vec<String> {
    let text = read(&format!("systemd/{unit}"));
    let line = text.lines().find_map(|line| line.strip_prefix("ExecStart=")).unwrap();
    line.split(' ').map(|word| word.replace("%i", "lab")).collect()
}

#[test]
fn units_start_the_daemon_with_flags_that_it_has_and_a_file_that_is_installed() {
    let home = Home::new();
    for unit in UNITS {
        let command = command(unit);
        assert_eq!(command[0], "/usr/bin/simd");
        let mut arguments: Vec<OsString> = command[1..].iter().map(OsString::from).collect();
        let at = arguments.iter().position(|argument| argument == "--config").unwrap() + 1;
        let installed = PathBuf::from(&arguments[at]);
        assert_eq!(installed.parent().unwrap(), "/etc/simd");
        let path = home.path().join(installed.file_name().unwrap());
        std::fs::write(&path, default_file()).unwrap();
        arguments[at] = path.into();
        let name = if unit.contains('@') { "lab" } else { "simd" };
        assert_eq!(config(&arguments).name, name);
    }
    assert_eq!(read("debian/conffiles"), "/etc/simd/simd.toml\n");
}

#[test]
fn the_two_units_are_alike_but_for_whose_they_are() {
    let settings = |unit: &str| {
        let text = read(&format!("systemd/{unit}")).replace("/%i", "").replace("simd-%i", "simd");
        let own = ["Description=", "ExecStart=", "#"];
        text.lines()
            .filter(|line| !own.iter().any(|own| line.starts_with(own)))
            .collect::<Vec<_>>()
            .join("\n")
    };
    assert_eq!(settings(UNITS[0]), settings(UNITS[1]));
}

/// Returns the values that a unit or a drop-in has for a setting, in their order.
fn values<'t>(text: &'t str, setting: &str) -> Vec<&'t str> {
    text.lines().filter_map(|line| line.strip_prefix(setting)?.strip_prefix('=')).collect()
}

/// The units without drop-ins refuse these: they allow only what most worlds need.
#[test]
fn the_drop_in_allows_all_that_realtime_asks_for() {
    let drop_in = read("systemd/realtime.conf");
    assert_eq!(values(&drop_in, "RestrictRealtime"), ["no"]);
    assert_eq!(values(&drop_in, "LimitMEMLOCK"), ["infinity"]);
    let (priority, processors) = (values(&drop_in, "LimitRTPRIO")[0], values(&drop_in, "CPUAffinity")[0]);
    let asked = read_as_file(&format!("[realtime]\npriority = {priority}\nlock_memory = true\n"));
    for part in [format!("priority: {priority},"), "lock_memory: true,".into()] {
        assert!(asked.contains(&part), "{part}: {asked}");
    }
    let one = processors.split(' ').next_back().unwrap();
    assert!(drop_in.contains(&format!("`[realtime] processors = [{one}]`")), "{drop_in}");
    let filters = values(&drop_in, "SystemCallFilter");
    let calls: Vec<&str> = filters.iter().flat_map(|filter| filter.split(' ')).collect();
    for call in ["sched_setscheduler", "sched_setaffinity", "mlockall"] {
        assert!(calls.contains(&call), "{call}: {calls:?}");
    }
    for unit in UNITS {
        let unit = read(&format!("systemd/{unit}"));
        assert_eq!(values(&unit, "RestrictRealtime"), ["yes"]);
        assert!(values(&unit, "LimitRTPRIO").is_empty());
    }
}

/// Needs systemd, which calls a service below 2.0 well confined.
#[tokio::test]
async fn units_are_confined() {
    let home = Home::new();
    for unit in UNITS {
        let mut command = home.command("systemd-analyze");
        let path = packaging().join("systemd").join(unit);
        command.args(["security", "--offline=yes", "--threshold=20", "--no-pager"]).arg(path);
        if std::process::Command::new("systemd-analyze").arg("--version").output().is_err() {
            return;
        }
        let said = said("systemd-analyze", command).await;
        assert_eq!(said.code, 0, "{unit}: {}{}", said.out, said.err);
    }
}

/// Without a container: copied files exist, the toolchain is the tree's, and no image runs as root.
#[test]
fn the_containerfile_names_what_there_is() {
    let text = read("Containerfile");
    let toolchain = std::fs::read_to_string(repository().join("rust-toolchain.toml")).unwrap();
    let toolchain: toml::Table = toml::from_str(&toolchain).unwrap();
    let channel = toolchain["toolchain"]["channel"].as_str().unwrap();
    assert!(text.contains(&format!("ARG RUST=docker.io/library/rust:{channel}-slim-bookworm\n")), "{text}");
    assert!(text.contains(&format!("ENV RUSTUP_TOOLCHAIN={channel}\n")), "{text}");
    for line in text.lines().filter_map(|line| line.strip_prefix("COPY ")) {
        let words: Vec<&str> = line.split(' ').collect();
        let (_, sources) = words.split_last().unwrap();
        if !sources[0].starts_with("--from=") {
            assert!(sources.iter().all(|source| repository().join(source).exists()), "{line}");
        }
    }
    let images: Vec<&str> = text.split("FROM ${BASE}").skip(1).collect();
    assert_eq!(images.len(), 2);
    for image in images {
        let lines: Vec<&str> = image.lines().collect();
        assert!(lines.contains(&"USER 65532:65532"), "{image}");
        assert!(lines.contains(&"COPY LICENSE /usr/share/doc/simd/LICENSE"), "{image}");
        assert!(image.contains("THIRD-PARTY-LICENSES.txt /usr/share/doc/simd/"), "{image}");
    }
}

/// The tool writes into a copy of the files that have the version.
#[tokio::test]
async fn a_release_sets_the_version_everywhere_and_dates_the_changelog() {
    let home = Home::new();
    let schema = "proto/src/generated/simd.v1.bin";
    let client = "client/python/src/simd_client/version.py";
    for file in ["Cargo.toml", "CHANGELOG.md", client, schema] {
        let copy = home.path().join(file);
        std::fs::create_dir_all(copy.parent().unwrap()).unwrap();
        std::fs::copy(repository().join(file), copy).unwrap();
    }
    let release = async || {
        let mut command = home.command("python3");
        let line = "import make_release, pathlib, sys; \
                    make_release.set_version(pathlib.Path(sys.argv[1]), '99.0.1', '2026-01-02')";
        command.current_dir(packaging()).arg("-B").args(["-c", line]).arg(home.path());
        said("make_release.py", command).await
    };
    let done = release().await;
    assert_eq!(done.code, 0, "{}", done.err);
    let text = |file: &str| std::fs::read_to_string(home.path().join(file)).unwrap();
    assert!(text("Cargo.toml").contains("\nversion = \"99.0.1\"\n"));
    assert!(text(client).contains("\n__version__ = \"99.0.1\"\n"));
    assert!(text("CHANGELOG.md").contains("\n## Unreleased\n\n## 99.0.1 (2026-01-02)\n"));
    let bytes = |file: &str| std::fs::read(home.path().join(file)).unwrap();
    assert_eq!(bytes("proto/released.binpb"), bytes(schema));
    // Without a change there is nothing to release.
    let again = release().await;
    assert_eq!(again.code, 1);
    assert!(again.err.contains("nothing has changed since the last release"), "{}", again.err);
}

/// Without a container: the daemon has the flags, and the mounted files exist.
#[test]
fn the_compose_file_starts_the_daemon_with_flags_that_it_has() {
    let text = read("compose.yaml");
    let commands: Vec<Vec<String>> = text
        .lines()
        .filter_map(|line| line.trim().strip_prefix("command: "))
        .map(|list| serde_json::from_str(list).unwrap())
        .collect();
    let [daemon, ..] = commands.as_slice() else { panic!("{text}") };
    let (file, flags) = daemon.split_at(2);
    assert_eq!(file, ["--config", "/etc/simd/simd.toml"]);
    let state = OsString::from("/var/lib/simd");
    let line = std::iter::once("simd").chain(flags.iter().map(String::as_str)).map(OsString::from);
    let config = Config::read(line, [(OsString::from("STATE_DIRECTORY"), state)]).unwrap();
    assert_eq!(config.autosave.unwrap().file, PathBuf::from("/var/lib/simd/simd.simdstate"));
    assert!(read("Containerfile").contains("ENV STATE_DIRECTORY=/var/lib/simd\n"));
    for mounted in text.lines().filter_map(|line| line.trim().strip_prefix("- ./")) {
        let (file, _) = mounted.split_once(':').unwrap();
        assert!(packaging().join(file).is_file(), "{mounted}");
    }
}

#[tokio::test]
async fn scripts_of_the_package_are_shell_and_name_the_units() {
    let home = Home::new();
    for script in ["postinst", "prerm", "postrm"] {
        let mut command = home.command("sh");
        command.arg("-n").arg(packaging().join("debian").join(script));
        let said = said(script, command).await;
        assert_eq!(said.code, 0, "{}", said.err);
        assert!(read(&format!("debian/{script}")).contains("simd.service"), "{script}");
    }
}

#[tokio::test]
async fn each_program_writes_its_manual() {
    let home = Home::new();
    let daemon = home.run("simd", ["--man"]).await;
    assert_eq!(daemon.code, 0, "{}", daemon.err);
    for text in [".TH simd 1", "\\-\\-until\\-stdin\\-closes", "\\-\\-time\\-step"] {
        assert!(daemon.out.contains(text), "{text}: {}", daemon.out);
    }
    let folder = home.path().join("man1");
    let to = ["man", folder.to_str().unwrap()];
    let refused = home.run("simctl", to).await;
    assert_eq!((refused.code, refused.out.as_str()), (1, ""), "the folder is not there");
    assert!(refused.err.contains("man1"), "{}", refused.err);
    std::fs::create_dir(&folder).unwrap();
    assert_eq!(home.run("simctl", to).await.code, 0);
    let page = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    assert!(page("simctl.1").contains("simctl\\-joint(1)"), "{}", page("simctl.1"));
    assert!(page("simctl-joint-set.1").contains(".TH simctl-joint-set 1"), "{}", page("simctl-joint-set.1"));
    assert!(!folder.join("simctl-man.1").exists(), "it is only for packages");
}

/// systemd makes the folder of `StateDirectory` and names it in the environment.
#[test]
fn recordings_and_autosaves_of_units_are_in_their_state_directory() {
    for (unit, folder) in UNITS.into_iter().zip(["/var/lib/simd", "/var/lib/simd/%i"]) {
        let text = read(&format!("systemd/{unit}"));
        let value = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)).unwrap();
        assert_eq!(format!("/var/lib/{}", value("StateDirectory=")), folder);
        assert_eq!(value("WorkingDirectory="), folder);
        let variables = [(OsString::from("STATE_DIRECTORY"), OsString::from(folder))];
        let config = Config::read(["simd", "--autosave"].map(OsString::from), variables).unwrap();
        assert_eq!(config.recording.directory, Some(PathBuf::from(folder).join("recordings")));
        assert_eq!(config.autosave.unwrap().file, PathBuf::from(folder).join("simd.simdstate"));
    }
}

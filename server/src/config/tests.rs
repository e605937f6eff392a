//! Each mistake of an operator gives one sentence that names it.

mod parts;

use std::fs;

use simd_core::simulation::SetpointProfiles;
use simd_core::{Integrator, SurfaceCombination};

use super::*;
use simd_world::handle::RunState;

fn args(flags: &str) -> Result<Config, ConfigError> {
    Config::from_args(std::iter::once("simd").chain(flags.split_whitespace()).map(OsString::from))
}

fn usage(flags: &str) -> String {
    match args(flags) {
        Err(ConfigError::Usage(sentence)) => sentence,
        other => panic!("{flags:?} gives {other:?}"),
    }
}

/// Reads a configuration from a file with this text, and flags over it.
fn file(text: &str, flags: &str) -> Result<Config, ConfigError> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("simd.toml");
    fs::write(&path, text).unwrap();
    args(&format!("--config {} {flags}", path.display()))
}

fn file_mistake(text: &str) -> String {
    match file(text, "") {
        Err(ConfigError::File(sentence)) => sentence,
        other => panic!("{text:?} gives {other:?}"),
    }
}

#[test]
fn hosts_of_flags_and_file_are_names_without_a_port() {
    let config = file("allow_hosts = [\"lab.example\"]", "--allow-host bench --allow-host a.b").unwrap();
    assert_eq!(config.allow_hosts, ["lab.example", "bench", "a.b"]);
    for name in ["lab.example:7400", "http://lab", "*", "lab/x", "ä"] {
        assert!(usage(&format!("--allow-host {name}")).contains(name), "{name}");
    }
    assert!(file_mistake("allow_hosts = [\"\"]").contains("allowed host"));
}

#[test]
fn sites_that_frame_the_page_are_origins() {
    let config = file("frame_ancestors = [\"https://lab.example\", \"http://localhost:8888\"]", "").unwrap();
    assert_eq!(config.frame_ancestors, ["https://lab.example", "http://localhost:8888"]);
    for origin in
        ["lab.example", "https://", "https://lab.example/page", "*", "https://a b", "https://a;b", "data:"]
    {
        assert!(file_mistake(&format!("frame_ancestors = [{origin:?}]")).contains(origin), "{origin}");
    }
}

#[test]
fn nothing_said_is_loopback_real_time_and_playing() {
    let config = args("").unwrap();
    assert_eq!(config.listen.to_string(), "127.0.0.1:7400");
    assert_eq!(config.driver.state, RunState::Playing);
    assert_eq!(config.driver.pace, Pace::RealTime { factor: 1.0 });
    assert_eq!(config.physics, PhysicsSettings::default());
    assert!(config.robots.is_empty() && config.asset_roots.is_empty());
}

#[test]
fn flags_beat_the_file_and_the_file_beats_the_defaults() {
    let text = r#"
        name = "from_file"
        listen = "127.0.0.1:1"
        paused = true
        [physics]
        gravity = [0, 0, -1]
        time_step = 0.002
        substeps = 4
        integrator = "euler"
        real_time_factor = 2
        [[robots]]
        path = "arm"
        xyz = [1, 2, 3]
        rpy = [0, 0, 1.5707963267948966]
        fixed = true
        positions = { shoulder = 0.5 }
        [[robots]]
        path = "/other.urdf"
    "#;
    let config = file(
        text,
        "--listen 127.0.0.1:2 --gravity -1,0,0 --load third.urdf --rtf 0.5 --surface-combination multiply",
    )
    .unwrap();
    assert_eq!((config.name.as_str(), config.listen.port()), ("from_file", 2));
    assert_eq!(config.driver.state, RunState::Paused);
    assert_eq!(config.driver.pace, Pace::RealTime { factor: 0.5 });
    let expected = PhysicsSettings {
        gravity: glamx::DVec3::new(-1.0, 0.0, 0.0),
        time_step: 0.002,
        substeps: 4,
        integrator: Integrator::Euler,
        surface_combination: SurfaceCombination::Multiply,
        sleeping: true,
        setpoint_profiles: SetpointProfiles::Undescribed,
    };
    assert_eq!(config.physics, expected);
    let paths: Vec<_> = config.robots.iter().map(|robot| robot.path.to_str().unwrap()).collect();
    assert!(paths[0].ends_with("/arm") && paths[0].starts_with('/'), "from the file's folder: {paths:?}");
    assert_eq!(paths[1..], ["/other.urdf", "third.urdf"]);
    let turned = config.robots[0].pose * glamx::DVec3::X;
    assert!((turned - glamx::DVec3::new(1.0, 3.0, 3.0)).length() < 1e-12, "{turned}");
}

#[test]
fn an_unknown_key_is_named_with_its_line() {
    let sentence = file_mistake("paused = true\n[physics]\ntimestep = 0.001\n");
    assert!(
        sentence.contains(
            "simd.toml: line 3: there is no key physics.timestep; the table has gravity, time_step"
        ),
        "{sentence}"
    );
    let sentence = file_mistake("[[robots]]\npath = \"a\"\npose = 1\n");
    assert!(sentence.contains("line 3: there is no key `pose`"), "{sentence}");
}

#[test]
fn a_value_of_the_wrong_kind_is_named_with_its_line() {
    let sentence = file_mistake("[physics]\nreal_time_factor = \"fast\"\n");
    assert!(
        sentence.contains("line 2: physics.real_time_factor is \"fast\"; it must be a number"),
        "{sentence}"
    );
    assert!(file_mistake("listen = \"here\"").contains("line 1: listen is \"here\""));
    assert!(
        file_mistake("[[robots]]\nname = \"arm\"\n")
            .contains("line 1: the table [[robots]] lacks the key `path`")
    );
    assert!(file_mistake("paused = tru").contains("line 1"));
    assert!(file_mistake("[physics]\ntime_step = \"x\"").ends_with("it must be a number"));
    assert!(
        file_mistake("[physics]\nsubsteps = -1")
            .contains("physics.substeps is -1; it must be between 1 and 1000")
    );
    let mistake = file_mistake("[physics]\nintegrator = \"rk4\"");
    assert!(mistake.contains("line 2") && mistake.contains("leapfrog"), "{mistake}");
    assert!(file_mistake("[[robots]]\npath = \"a\"\nxyz = [\"x\", 0, 0]").ends_with("expected a number"));
    assert!(file_mistake("[physics]\ngravity = [0, 0]").contains("line 2"));
}

#[test]
fn values_out_of_range_are_refused_with_the_range() {
    assert!(usage("--rtf 0").contains("between 0.001 and 1000"));
    assert!(usage("--rtf nan").contains("between 0.001 and 1000"));
    assert!(
        file_mistake("[physics]\nreal_time_factor = 2000")
            .contains("real_time_factor is 2000; it must be between 0.001 and 1000")
    );
    assert!(usage("--time-step -1").contains("--time-step is -1"));
    assert!(usage("--asset-root /nowhere").contains("asset root /nowhere: "));
    assert!(file_mistake("asset_roots = [\"nowhere\"]").contains("/nowhere: "));
    assert!(usage("--name a/b").contains("name is \"a/b\""));
    assert!(file_mistake("log = \"a=b=c\"").contains("log is"));
    assert!(usage("--log loud").contains("--log is \"loud\""), "it would be a silent part of the program");
    args("--log warn,simd_server=debug,simd::audit=info").unwrap();
    assert!(file_mistake("[[robots]]\npath = \"a\"\nxyz = [nan, 0, 0]").contains("must be finite"));
}

#[test]
fn a_mistake_in_the_flags_is_one_sentence() {
    for (flags, word) in [
        ("--bogus", "--bogus"),
        ("--listen here", "--listen"),
        ("--gravity 1,2", "three numbers"),
        ("--time-step", "--time-step"),
        ("extra", "extra"),
        ("robot.urdf", "--load PATH loads a robot"),
        ("--substeps 2", "a key has the name: --set physics.substeps=VALUE"),
        ("--lisen 127.0.0.1:0", "perhaps --listen"),
        ("--time-step 0", "--time-step is 0; it must be between"),
        ("--set physics.time_step=0", "--set: physics.time_step is 0; it must be between"),
    ] {
        let sentence = usage(flags);
        assert!(sentence.contains(word) && !sentence.contains('\n'), "{flags}: {sentence}");
        assert!(sentence.ends_with("; see simd --help"), "{sentence}");
    }
}

#[test]
fn a_flag_is_not_a_value_of_the_flag_before_it() {
    let said = usage("--name --help");
    assert!(said.contains("--help") && said.contains("the value is missing"), "{said}");
    assert!(args("--gravity -1,0,-2").is_ok());
}

#[test]
fn an_address_that_others_can_reach_must_be_asked_for() {
    assert!(usage("--listen 0.0.0.0:7400").contains("--insecure"));
    assert!(file_mistake("listen = \"192.168.0.1:7400\"").contains("without TLS and tokens"));
    let tls = "--tls-certificate a.pem --tls-key a.key";
    assert!(usage(&format!("--listen 0.0.0.0:7400 {tls}")).contains("without tokens, anyone"));
    assert!(usage("--listen 0.0.0.0:7400 --tokens t").contains("without TLS, anyone who sees"));
    assert!(args(&format!("--listen 0.0.0.0:7400 --zenoh off --tokens t {tls}")).is_ok());
    assert!(usage("--tls-certificate a.pem").contains("--tls-key"));
    assert!(args("--listen 0.0.0.0:7400 --insecure").is_ok());
    assert!(args("--listen [::1]:0").is_ok());
}

#[test]
fn a_file_that_is_not_there_is_a_mistake_of_the_file() {
    let Err(ConfigError::File(sentence)) = args("--config /nowhere/simd.toml") else { panic!() };
    assert!(sentence.starts_with("/nowhere/simd.toml: cannot be read: "), "{sentence}");
}

#[test]
fn the_help_shows_the_flags_with_their_defaults_and_the_exit_codes() {
    let Err(ConfigError::HelpOrVersion(help)) = args("--help") else { panic!() };
    assert!(help.contains("Exit codes:") && help.contains("--time-step <NUMBER>"), "{help}");
    let words = help.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("Simulated time of a step, seconds [default: 0.001]"), "{help}");
}

fn with_variables(variables: &[(&str, &str)], flags: &str) -> Result<Config, ConfigError> {
    let args = std::iter::once("simd").chain(flags.split_whitespace()).map(OsString::from);
    Config::read(args, variables.iter().map(|(name, value)| ((*name).into(), (*value).into())))
}

#[test]
fn variables_beat_the_file_and_flags_beat_variables() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("simd.toml");
    fs::write(&path, "name = \"from_file\"\n[physics]\ntime_step = 0.002\nsubsteps = 2\n").unwrap();
    let variables = [
        ("SIMD_NAME", "from_environment"),
        ("SIMD_PHYSICS_TIME_STEP", "0.004"),
        ("SIMD_ZENOH_CONNECT", "tcp/127.0.0.1:1, tcp/127.0.0.1:2"),
        ("SIMD_PAUSED", "1"),
        // Variables of clients and of no program.
        ("SIMD_TOKEN", "secret"),
        ("SIMD_TLS_CA", "ca.pem"),
        ("SIMD_TLS_CLIENT_CERT", "me.pem"),
        ("SIMD_TLS_CLIENT_KEY", "me.key"),
        ("SIMDX", ""),
    ];
    let flags = format!("--config {} --time-step 0.008 --set service.robots=3", path.display());
    let config = with_variables(&variables, &flags).unwrap();
    assert_eq!(config.name, "from_environment");
    assert_eq!((config.physics.time_step, config.physics.substeps), (0.008, 2));
    assert_eq!(config.zenoh.connect, ["tcp/127.0.0.1:1", "tcp/127.0.0.1:2"]);
    assert_eq!((config.driver.state, config.limits.robots), (RunState::Paused, 3));
}

#[test]
fn a_mistake_in_a_variable_names_it() {
    for (name, value, mistake) in [
        ("SIMD_PHYSICS_TIME_STEP", "fast", "SIMD_PHYSICS_TIME_STEP: it must be a number, and not \"fast\""),
        ("SIMD_PHYSICS_TIME_STEP", "5", "SIMD_PHYSICS_TIME_STEP is 5; it must be between"),
        (
            "SIMD_PHYSICS_TIMESTEP",
            "1",
            "SIMD_PHYSICS_TIMESTEP: it is not a key of the configuration; the keys of physics",
        ),
        ("SIMD_INSECURE", "maybe", "SIMD_INSECURE: it must be true or false"),
        ("SIMD_LISTEN", "0.0.0.0:1", "SIMD_LISTEN: 0.0.0.0:1 can be reached from other machines"),
        ("SIMD_PHYSICS_GRAVITY", "1,2", "SIMD_PHYSICS_GRAVITY is [1, 2]; it must be three numbers"),
        ("SIMD_SERVICE_ROBOTS", "-1", "SIMD_SERVICE_ROBOTS is -1; it must be between 1 and 100000"),
    ] {
        let Err(ConfigError::Usage(sentence)) = with_variables(&[(name, value)], "") else {
            panic!("{name}")
        };
        assert!(sentence.contains(mistake), "{sentence}");
    }
}

#[test]
fn each_key_can_be_said_in_each_way_and_takes_its_own_default() {
    let mut draft = draft::Draft::default();
    let paths: std::collections::BTreeSet<&str> = keys::KEYS.iter().map(|key| key.path).collect();
    assert_eq!(paths.len(), keys::KEYS.len(), "each has a path of its own");
    for key in keys::KEYS.iter() {
        let value = key.value(&mut draft);
        assert_eq!(value.is_none(), !key.example.is_empty(), "{} has a default or an example", key.path);
        let Some(value) = value else { continue };
        let (table, name) = key.table_and_name();
        let text = if table.is_empty() {
            format!("{name} = {value}")
        } else {
            format!("[{table}]\n{name} = {value}")
        };
        file(&text, "").unwrap_or_else(|error| panic!("{text}: {error}"));
        let said = value.trim_matches(['"', '[', ']']).replace(' ', "");
        with_variables(&[(&key.variable(), &said)], "")
            .unwrap_or_else(|error| panic!("{}: {error}", key.path));
        args(&format!("--set {}={said}", key.path)).unwrap();
    }
}

#[test]
fn each_value_is_shown_with_its_source() {
    let words = ["simd", "config", "show", "--time-step", "0.002"].map(OsString::from);
    let variables = [("SIMD_ZENOH_STATE_RATE".into(), "7".into())];
    let Some(Ok(Asked::Text(text))) = run(&words, variables) else { panic!() };
    assert!(text.contains("time_step = 0.002  # --time-step\n"), "{text}");
    assert!(text.contains("state_rate = 7  # SIMD_ZENOH_STATE_RATE\n"), "{text}");
    assert!(text.contains("substeps = 1  # default\n"), "{text}");
}

//! `simctl` as programs use it: names with spaces, JSON, exit codes, pipes, completions.

use serde_json::Value;
use simd_tests::process::{Home, Process};

use crate::paused;
use crate::transcript::{Transcript, assert_snapshot};

async fn json(daemon: &Process, arguments: &[&str]) -> Value {
    let said = daemon.simctl(["-o", "json"].iter().chain(arguments)).await;
    assert_eq!(said.code, 0, "{arguments:?}: {}", said.err);
    serde_json::from_str(&said.out).unwrap_or_else(|error| panic!("{arguments:?}: {error}\n{}", said.out))
}

#[tokio::test]
async fn a_package_and_joints_whose_names_hold_spaces_are_used_as_they_are() {
    let daemon = paused().await;
    let lines = [
        "simctl robot load 'tests/assets/Two Link.v2' --fixed",
        "simctl joint list two_link",
        "simctl joint set two_link 'shoulder joint=30deg' 'elbow joint=vel:9'",
        "simctl sim step 2000",
        "simctl joint get two_link 'elbow joint' 'shoulder joint'",
        "simctl joint watch two_link 'elbow joint' --count 1",
        "simctl joint reset two_link 'elbow joint=0'",
        "simctl robot reload two_link 'tests/assets/Two Link.v2'",
        "simctl robot load 'tests/assets/Two Link.v2' --rename",
    ];
    let transcript = Transcript::of(&daemon, &lines).await;
    assert!(!transcript.text().contains("exit code"), "{}", transcript.text());
    assert_snapshot("names_with_spaces", transcript.text(), &[]);
}

#[tokio::test]
async fn json_says_where_the_joints_are_with_all_digits() {
    let daemon = paused().await;
    json(&daemon, &["joint", "set", "bench_arm", "shoulder=0.5"]).await;
    let stepped = json(&daemon, &["sim", "step", "1000"]).await;
    assert_eq!(stepped["stamp"]["step"], 1000);
    let reading = json(&daemon, &["joint", "get", "bench_arm"]).await;
    let shoulder = &reading["joints"][0];
    assert_eq!((&shoulder["name"], &shoulder["mode"]), (&Value::from("shoulder"), &Value::from("position")));
    assert!((shoulder["position"].as_f64().unwrap() - 0.5).abs() < 1e-3, "{shoulder}");

    let lines = daemon.simctl(["-o", "jsonl", "joint", "watch", "bench_arm", "--count", "1"]).await;
    assert_eq!(lines.out.lines().count(), 1);
    let line: Value = serde_json::from_str(&lines.out).unwrap();
    assert_eq!(line["joints"], reading["joints"], "a watch shows what get shows");
    let lines = daemon.simctl(["-o", "jsonl", "robot", "list"]).await;
    assert_eq!(lines.out.lines().count(), 1, "an item a line");
    assert_eq!(serde_json::from_str::<Value>(&lines.out).unwrap()["name"], "bench_arm");
}

#[tokio::test]
async fn a_watch_of_a_playing_world_writes_a_json_document_a_line() {
    let daemon = crate::demo().await;
    let arguments = ["-o", "jsonl", "joint", "watch", "bench_arm", "--rate", "200", "--count", "5"];
    let said = daemon.simctl(arguments).await;
    assert_eq!(said.code, 0, "{}", said.err);
    let sequences: Vec<u64> = said
        .out
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap()["stamp"]["sequence"].as_u64().unwrap())
        .collect();
    assert_eq!(sequences.len(), 5);
    assert!(sequences.is_sorted_by(|before, after| before < after), "{sequences:?}");
    let said = daemon.shell("simctl joint watch bench_arm | head -n 2", Home::new().path()).await;
    assert_eq!((said.code, said.err.as_str()), (0, ""), "a closed pipe is not a failure");
    assert_eq!(said.out.lines().count(), 2);
}

#[tokio::test]
async fn each_refusal_is_a_sentence_and_its_documented_exit_code() {
    let daemon = paused().await;
    let folder = Home::new();
    std::fs::write(folder.path().join("broken.urdf"), "<robot name=\"arm\">\n</arm>\n").unwrap();
    let broken = format!("simctl robot load {}/broken.urdf", folder.path().display());
    let lines = [
        "simctl joint get missing",
        "simctl joint set bench_arm elbow=1",
        "simctl joint set bench_arm shoulder=nan",
        "simctl robot load 'tests/assets/Bench_Arm-1.2 rev B'",
        "simctl robot load 'tests/assets/Bench_Arm-1.2 rev B' --on-daemon",
        "simctl robot load 'tests/assets/Two Link.v2' --strict",
        &broken,
        "simctl robot load README.md",
        "simctl robot load nowhere.urdf",
        "simctl state restore never",
        "simctl sim play",
        "simctl sim step",
        "simctl sim step 0",
        "simctl joint set bench_arm",
        "simctl joint set bench_arm shoulder=torque:1",
        "simctl joint set bench_arm shoulder=12mm",
        "simctl robot load 'tests/assets/Two Link.v2' --fixed --name arm",
        "simctl joint set arm 'elbow joint=9' --refuse-beyond-limits",
        "simctl -e 127.0.0.1:1 robot list",
        "simctl -e '127.0.0.1:seven' robot list",
        "simctl --context lab robot list",
        "simctl dance",
    ];
    let transcript = Transcript::of(&daemon, &lines).await;
    let codes: Vec<&str> =
        transcript.text().lines().filter_map(|line| line.strip_prefix("(exit code ")).collect();
    let expected = [69, 69, 67, 70, 71, 67, 67, 67, 1, 69, 73, 2, 2, 2, 1, 75, 78, 2, 1, 2];
    assert_eq!(codes, expected.map(|code| format!("{code})")), "{}", transcript.text());
    assert_snapshot("refusals", transcript.text(), &[(r"from step \d+ \(\d+\.\d+ s\)", "from step # (# s)")]);
}

/// The daemon that wrote the file is gone when another process reads it. Both then export the same file,
/// which shows that their worlds continued equally.
#[tokio::test]
async fn a_world_outlives_its_daemon_in_a_file() {
    let folder = Home::new();
    let file = |name: &str| folder.path().join(name).display().to_string();
    let lines = |from: &str| {
        [
            format!("simctl state restore {from}"),
            "simctl sim step 700".to_owned(),
            "simctl joint set two_link 'elbow joint=-0.4'".to_owned(),
            "simctl sim step 150".to_owned(),
            "simctl state save later".to_owned(),
        ]
    };
    let mut first = paused().await;
    let begin = [
        "simctl robot shape plane --name ground",
        "simctl robot shape box:0.1,0.2,0.1 --name crate --pose 0.6,0,0.2",
        "simctl robot load 'tests/assets/Two Link.v2' --fixed",
        "simctl joint set two_link 'shoulder joint=1.2' 'elbow joint=0.7'",
        "simctl sim step 250",
        "simctl state save mark",
    ];
    let mut all = Transcript::of(&first, &begin).await.text().to_owned();
    let exported = json(&first, &["state", "export", "mark", &file("mark")]).await;
    assert_eq!(exported["bytes"], std::fs::metadata(file("mark")).unwrap().len());
    for line in lines("mark") {
        all += Transcript::of(&first, &[line.as_str()]).await.text();
    }
    json(&first, &["state", "export", "later", &file("one")]).await;
    first.kill().await;

    let second = Process::start(["--name", "empty", "--paused"]).await;
    let imported = json(&second, &["state", "import", &file("mark"), "--name", "mine"]).await;
    assert_eq!((&imported["name"], &imported["stamp"]["step"]), (&Value::from("mine"), &Value::from(250)));
    for line in lines("mine") {
        all += Transcript::of(&second, &[line.as_str()]).await.text();
    }
    assert!(!all.contains("exit code"), "{all}");
    json(&second, &["state", "export", "later", &file("other")]).await;
    let [one, other] = ["one", "other"].map(|name| std::fs::read(file(name)).unwrap());
    assert!(one == other, "both worlds are equal to the bit");

    std::fs::write(file("mark"), &one[..one.len() / 2]).unwrap();
    let refused = second.simctl(["state", "import", &file("mark")]).await;
    assert_eq!(refused.code, 67);
    assert!(refused.err.contains("the saved state's file is damaged"), "{}", refused.err);
}

#[tokio::test]
async fn a_configuration_file_names_the_daemon() {
    let daemon = paused().await;
    let home = Home::new();
    std::fs::create_dir(home.path().join("simd")).unwrap();
    let file = format!("context = \"lab\"\n[contexts.lab]\nendpoint = \"{}\"\n", daemon.address());
    std::fs::write(home.path().join("simd/config.toml"), file).unwrap();
    let said = home.run("simctl", ["server", "info"]).await;
    assert_eq!(said.code, 0, "{}", said.err);
    let listed = home.run("simctl", ["context", "list"]).await;
    assert!(listed.out.contains("context lab") || listed.out.contains("lab"), "{}", listed.out);
    let other = home.run("simctl", ["--context", "moon", "server", "info"]).await;
    assert_eq!((other.code, other.err.as_str()), (1, "simctl: there is no context `moon`; there is lab\n"));
}

#[tokio::test]
async fn each_shell_gets_its_completions_without_a_daemon() {
    let home = Home::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let said = home.run("simctl", ["completions", shell]).await;
        assert_eq!(said.code, 0, "{}", said.err);
        assert!(said.out.contains("SIMCTL_COMPLETE") && said.out.contains("simctl"), "{shell}");
    }
    let bash = home.run("simctl", ["completions", "bash"]).await.out;
    assert!(bash.contains("SIMCTL_COMPLETE_WORD="), "bash says what was typed: {bash}");
    let script = "simctl completions bash > c && bash -c '. ./c && complete -p simctl'";
    let mut command = home.command("sh");
    command.current_dir(home.path()).args(["-c", script]);
    let said = simd_tests::process::said("bash", command).await;
    assert_eq!(said.code, 0, "bash reads it: {}", said.err);
}

#[tokio::test]
async fn no_color_and_a_pipe_have_no_escape_codes() {
    let daemon = paused().await;
    let plain = daemon.simctl(["joint", "list", "bench_arm"]).await;
    let mut command = daemon.simctl_command(["joint", "list", "bench_arm"]);
    command.env("NO_COLOR", "1");
    let asked = simd_tests::process::said("simctl", command).await;
    assert_eq!(plain, asked);
    assert!(!plain.out.contains('\x1b'));
}

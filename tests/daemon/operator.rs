//! An operator's use of `simctl`: views of worlds, the choice of a daemon, completion of names.

use std::process::Stdio;

use serde_json::Value;
use simd_tests::network::Router;
use simd_tests::process::{Home, Process, Said, said, soon};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::process::{Child, ChildStdin, ChildStdout, Command};

use crate::{demo, paused};

pub(crate) fn json(said: &Said) -> Value {
    serde_json::from_str(&said.out).unwrap_or_else(|error| panic!("{error}: {said:?}"))
}

/// A program in a pseudo terminal, by util-linux' `script`.
struct Terminal {
    child: Child,
    keys: ChildStdin,
    screen: ChildStdout,
    shown: String,
}

impl Terminal {
    fn start(mut script: Command, line: &str) -> Self {
        let of_terminal = ["--quiet", "--return", "--command", line, "/dev/null"];
        script.args(of_terminal).stdin(Stdio::piped()).env("TERM", "xterm").env("SHELL", "/bin/sh");
        let mut child = script.spawn().unwrap();
        let (keys, screen) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        Self { child, keys, screen, shown: String::new() }
    }

    async fn shows(&mut self, text: &str) {
        let mut bytes = [0; 4096];
        while !self.shown.contains(text) {
            let read = soon(&format!("{text:?} on the screen"), self.screen.read(&mut bytes)).await.unwrap();
            assert!(read > 0, "the terminal ends without {text:?}: {:?}", self.shown);
            self.shown += &String::from_utf8_lossy(&bytes[..read]);
        }
    }

    async fn type_in(&mut self, keys: &str) {
        self.shown.clear();
        self.keys.write_all(keys.as_bytes()).await.unwrap();
        self.keys.flush().await.unwrap();
    }

    /// Returns its exit code and its last screen.
    async fn end(mut self) -> (Option<i32>, String) {
        let mut bytes = Vec::new();
        soon("the end of the terminal", self.screen.read_to_end(&mut bytes)).await.unwrap();
        let status = soon("the end of script", self.child.wait()).await.unwrap();
        (status.code(), self.shown + &String::from_utf8_lossy(&bytes))
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn top_shows_several_worlds_and_a_lost_one_as_tables_and_as_json() {
    let (playing, paused) = tokio::join!(demo(), paused());
    let places = [playing.address(), paused.address(), "127.0.0.1:1"];
    let shown = playing.simctl(["top", "--json", "--interval", "0.2"].iter().chain(&places)).await;
    assert_eq!(shown.code, 0, "{}", shown.err);
    let worlds = json(&shown);
    let of = |key: &str| worlds.as_array().unwrap().iter().map(|of| of[key].clone()).collect::<Vec<_>>();
    assert_eq!(of("link"), ["here", "here", "lost"]);
    assert_eq!(of("state"), [Value::from("playing"), "paused".into(), Value::Null]);
    assert!(worlds[0]["steps_per_second"].as_f64().unwrap() > 0.0, "{worlds}");
    assert_eq!(worlds[1]["steps_per_second"], 0.0, "{worlds}");
    assert_eq!(worlds[0]["robots"][0]["name"], "bench_arm");
    assert_eq!(worlds[0]["clients"][0]["name"], "simctl");
    assert!(worlds[2]["error"].as_str().unwrap().contains("no daemon answers at 127.0.0.1:1"), "{worlds}");
    // A pipe is not a terminal.
    let table = playing.simctl(["top", "-i", "0.1"]).await;
    assert_eq!(table.code, 0, "{}", table.err);
    for word in ["RTF", "demo", "playing", "bench_arm", "CLIENT", playing.address()] {
        assert!(table.out.contains(word), "{word}: {}", table.out);
    }
    assert!(!table.out.contains('\x1b'));
    let no_daemon = Home::new().run("simctl", ["top", "-i", "0.1", "127.0.0.1:1"]).await;
    assert!(no_daemon.code == 1 && no_daemon.out.contains("lost"), "{no_daemon:?}");
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn top_pauses_a_world_after_a_question_and_leaves_the_terminal_as_it_was() {
    let daemon = demo().await;
    let client = daemon.client().await;
    let line = format!(
        "stty rows 24 cols 120; simctl top --interval 0.2 {}; stty -a | grep -o ' icanon'",
        daemon.address()
    );
    let mut terminal = Terminal::start(Home::new().command("script"), &line);
    terminal.shows("bench_arm").await;
    terminal.type_in("p").await;
    terminal.shows("pause? y/n: demo").await;
    terminal.type_in("y").await;
    terminal.shows("is paused").await;
    let state = client.world_statistics().await.unwrap().state();
    assert_eq!(state, simd_client::proto::SimulationState::Paused);
    terminal.type_in("q").await;
    let (code, last) = terminal.end().await;
    assert_eq!(code, Some(0), "{last:?}");
    assert!(last.contains("\x1b[?1049l") && last.contains(" icanon"), "{last:?}");
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_lost_daemon_comes_back_on_a_screen_of_20_by_5() {
    let router = Router::start().await;
    let start = |name| {
        let zenoh = ["--zenoh-connect", router.locator.as_str()];
        Process::start_with(zenoh, ["--name", name, "--paused"])
    };
    let mut lab = start("lab").await;
    let line = format!("stty rows 5 cols 20; exec simctl top --interval 0.2 {}", router.locator);
    let mut terminal = Terminal::start(Home::new().command("script"), &line);
    // Columns without room are left out first.
    terminal.shows("lab").await;
    lab.kill().await;
    // A screen of this width shows this much of the sentence.
    terminal.shows("no daemon answers at").await;
    terminal.shown.clear();
    let _lab = start("lab").await;
    terminal.shows("q end  up/down choos").await;
    terminal.type_in("\x03").await;
    assert_eq!(terminal.end().await.0, Some(0));
}

async fn hz(daemon: &Process, arguments: &[&str]) -> Said {
    daemon.simctl(["joint", "hz", "bench_arm"].iter().chain(arguments)).await
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn hz_measures_the_stream_over_each_transport() {
    let flags = ["--name", "demo", "--config", "tests/assets/demo.toml"];
    let daemon = Process::start_with(["--zenoh", "tcp/127.0.0.1:0"], flags).await;
    for place in [&daemon.endpoint, daemon.locator.as_ref().unwrap()] {
        let said = hz(&daemon, &["--count", "20", "-o", "jsonl", "-e", place]).await;
        assert_eq!(said.code, 0, "{}", said.err);
        let last: Value = serde_json::from_str(said.out.lines().last().unwrap()).unwrap();
        assert_eq!((&last["states"], &last["window"]), (&20.into(), &20.into()), "{place}");
        let of = |key: &str| last[key].as_f64().unwrap();
        // These hold for any duration.
        assert!(of("min") <= of("mean") && of("mean") <= of("max"), "{last}");
        assert!((of("rate") * of("mean") - 1.0).abs() < 1e-9, "{last}");
        assert!(of("standard_deviation") <= of("max") - of("min") && of("steps_between") > 0.0, "{last}");
    }
    let table = hz(&daemon, &["--seconds", "0.3"]).await;
    assert!(table.code == 0 && table.out.contains(" Hz; between states: min "), "{table:?}");
    assert_eq!(hz(&daemon, &["--count", "1"]).await.code, 2);
    let gone = daemon.simctl(["joint", "hz", "missing", "--count", "2"]).await;
    assert_eq!(gone.code, 69, "{gone:?}");
}

#[tokio::test]
async fn hz_of_a_paused_world_says_that_nothing_comes() {
    let daemon = paused().await;
    let said = hz(&daemon, &["--seconds", "0.2"]).await;
    assert_eq!(said.code, 1, "{said:?}");
    assert!(said.err.contains("a paused world has none"), "{said:?}");
}

/// Returns the completions of the last of these words for a shell.
async fn completed(daemon: &Process, place: Option<&str>, words: &[&str]) -> Vec<String> {
    let mut command = daemon.simctl_command(["--", "simctl"].iter().chain(words));
    command.env("SIMCTL_COMPLETE", "bash").env("_CLAP_COMPLETE_INDEX", words.len().to_string());
    if let Some(place) = place {
        command.env("SIMD_ENDPOINT", place);
    }
    let said = said("simctl", command).await;
    assert_eq!((said.code, said.err.as_str()), (0, ""), "{words:?}");
    // If nothing was typed yet, options follow.
    said.out.lines().filter(|word| !word.starts_with('-')).map(str::to_owned).collect()
}

#[tokio::test]
async fn shells_complete_names_of_robots_and_joints_from_the_daemon() {
    let daemon = paused().await;
    daemon.simctl(["robot", "load", "tests/assets/Two Link.v2", "--fixed", "--name", "two_link"]).await;
    let expect = async |words: &[&str], expected: &[&str]| {
        assert_eq!(completed(&daemon, None, words).await, expected, "{words:?}");
    };
    expect(&["robot", "info", ""], &["bench_arm", "two_link"]).await;
    expect(&["robot", "delete", "b"], &["bench_arm"]).await;
    expect(&["joint", "get", "two_link", ""], &["shoulder joint", "elbow joint"]).await;
    expect(&["joint", "set", "two_link", "elb"], &["elbow joint="]).await;
    expect(&["joint", "watch", "missing", ""], &[]).await;
    expect(&["claim", "take", "bench_arm/"], &["bench_arm/shoulder"]).await;
    let verbs = completed(&daemon, None, &["joint", "h"]).await;
    assert_eq!(verbs, ["hz", "help"]);
    // The line's own endpoint counts, and an endpoint without an answer is not waited for.
    let address = daemon.address();
    assert_eq!(
        completed(&daemon, Some("127.0.0.1:1"), &["-e", address, "robot", "info", "b"]).await,
        ["bench_arm"]
    );
    assert_eq!(completed(&daemon, Some("127.0.0.1:1"), &["robot", "info", ""]).await, [""; 0]);
    assert_eq!(completed(&daemon, Some("a b"), &["robot", "info", ""]).await, [""; 0]);
}

#[tokio::test]
async fn completion_does_not_wait_for_a_daemon_that_hangs() {
    let daemon = paused().await;
    // The system answers for a program that accepts no connection, and the program never does.
    let hung = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let place = hung.local_addr().unwrap().to_string();
    // Without a separate timeout it would wait for this long.
    let words = ["--timeout", "3600", "robot", "info", ""];
    assert_eq!(completed(&daemon, Some(&place), &words).await, [""; 0]);
}

fn configured(home: &Home, file: &str) {
    std::fs::create_dir_all(home.path().join("simd")).unwrap();
    std::fs::write(home.path().join("simd/config.toml"), file).unwrap();
}

#[tokio::test]
async fn a_context_is_chosen_and_shown() {
    let home = Home::new();
    configured(
        &home,
        "# ours\n[contexts.lab]\nendpoint = \"lab:1\"\ntoken = \"simd_1\"\n[contexts.sea]\nendpoint = \"sea:2\"\n",
    );
    let used = home.run("simctl", ["context", "use", "lab"]).await;
    assert_eq!((used.code, used.out.as_str()), (0, "simctl uses lab, at lab:1\n"), "{used:?}");
    let shown = home.run("simctl", ["context", "show", "--json"]).await;
    let shown_json = json(&shown);
    assert_eq!((&shown_json["endpoint"], &shown_json["source"]), (&"lab:1".into(), &"context lab".into()));
    assert_eq!(shown_json["token"], "the context");
    assert!(!shown.out.contains("simd_1"), "a token is not shown");
    let unknown = home.run("simctl", ["context", "use", "moon"]).await;
    assert_eq!(
        (unknown.code, unknown.err.as_str()),
        (1, "simctl: there is no context `moon`; there is lab, sea\n")
    );
    let mut beaten = home.command("simctl");
    beaten.env("SIMD_ENDPOINT", "here:3").args(["context", "use", "sea"]);
    let beaten = said("simctl", beaten).await;
    assert!(beaten.code == 0 && beaten.err.contains("SIMD_ENDPOINT overrides it"), "{beaten:?}");
    let text = std::fs::read_to_string(home.path().join("simd/config.toml")).unwrap();
    assert!(text.starts_with("context = \"sea\"\n# ours\n[contexts.lab]\n"), "{text}");
    let nothing = Home::new().run("simctl", ["context", "use", "lab"]).await;
    assert!(nothing.code == 1 && nothing.err.contains("names none"), "{nothing:?}");
}

/// Returns a daemon that requires tokens, and those of an admin and a viewer.
pub(crate) async fn guarded(home: &Home) -> (Process, [String; 2]) {
    let file = home.path().join("tokens").display().to_string();
    let mut tokens = Vec::new();
    for role in ["admin", "viewer"] {
        let made = home.run("simctl", ["token", "add", role, "--role", role, "--file", &file]).await;
        assert_eq!(made.code, 0, "{}", made.err);
        tokens.push(made.out.trim().to_owned());
    }
    let [admin, viewer] = <[String; 2]>::try_from(tokens).unwrap();
    (Process::start(["--name", "guarded", "--tokens", &file]).await, [admin, viewer])
}

#[tokio::test]
async fn top_sends_the_token_of_a_context_to_no_other_daemon() {
    let home = Home::new();
    let (daemon, [_, viewer]) = guarded(&home).await;
    // The endpoints are of the same daemon: an answer shows which token was sent.
    let own = format!("[contexts.own]\nendpoint = \"{}\"\ntoken = \"{viewer}\"\n", daemon.address());
    let other = format!(
        "[contexts.other]\nendpoint = \"localhost:{}\"\n",
        daemon.address().split(':').next_back().unwrap()
    );
    configured(&home, &format!("context = \"own\"\n{own}{other}"));
    let found = json(&home.run("simctl", ["top", "--json", "-i", "0.1"]).await);
    let links: Vec<_> = found.as_array().unwrap().iter().map(|of| (&of["endpoint"], &of["link"])).collect();
    assert_eq!(links[0], (&daemon.address().into(), &"here".into()), "{found}");
    assert!(
        links[1].1 == "lost" && found[1]["error"].as_str().unwrap().contains("asks for a token"),
        "{found}"
    );
    let said = home.run("simctl", ["top", "--json", "-i", "0.1", &daemon.endpoint]).await;
    assert!(said.code == 1 && said.out.contains("asks for a token"), "{said:?}");
}

#[cfg(target_os = "linux")]
#[tokio::test]
async fn a_person_is_asked_for_a_token_and_a_pipe_is_not() {
    let home = Home::new();
    let (daemon, [_, viewer]) = guarded(&home).await;
    // Input typed before the terminal stops its echo is shown.
    let hidden = "while stty -a < /dev/tty | grep -q ' echo '; do :; done; echo hidden";
    let line = format!("({hidden}) & simctl -e {} server info; code=$?; wait; exit $code", daemon.address());
    let mut terminal = Terminal::start(home.command("script"), &line);
    terminal.shows(&format!("token for {}: ", daemon.address())).await;
    terminal.shows("hidden").await;
    terminal.type_in(&format!("{viewer}\n")).await;
    let (code, shown) = terminal.end().await;
    assert!(code == Some(0) && shown.contains("guarded") && !shown.contains(&viewer), "{shown:?}");
    let mut piped = home.command("simctl");
    piped.stdin(Stdio::piped()).args(["-e", daemon.address(), "server", "info"]);
    let piped = said("simctl", piped).await;
    assert!(piped.code == 80 && !piped.err.contains("token for"), "{piped:?}");
    // A file, and the environment, which the file beats.
    std::fs::write(home.path().join("mine"), format!("{viewer}\n")).unwrap();
    let mut flagged = home.command("simctl");
    flagged.env("SIMD_TOKEN", "simd_none").current_dir(home.path());
    flagged.args(["-e", daemon.address(), "--token-file", "mine", "robot", "list"]);
    assert_eq!(said("simctl", flagged).await.code, 0);
}

/// A name with a space becomes one word of the line, whether a quote was begun or not.
#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn bash_completes_names_with_spaces_as_it_quotes_them() {
    let daemon = paused().await;
    daemon.simctl(["robot", "load", "tests/assets/Two Link.v2", "--fixed"]).await;
    let home = Home::new();
    let rc =
        format!("PS1='ready '; export SIMD_ENDPOINT={}\n. <(simctl completions bash)\n", daemon.endpoint);
    std::fs::write(home.path().join("rc"), rc).unwrap();
    let line = format!("bash --rcfile {}/rc -i", home.path().display());
    let mut terminal = Terminal::start(home.command("script"), &line);
    terminal.shows("ready ").await;
    for (typed, completed) in [
        ("joint get two_link elb", r"elbow\ joint "),
        ("joint get two_link 'elb", "'elbow joint' "),
        (r"joint get two_link elbow\ j", r"elbow\ joint "),
        ("joint set two_link elb", r"elbow\ joint="),
    ] {
        // Ctrl-U takes the line away again.
        terminal.type_in(&format!("simctl {typed}\t")).await;
        terminal.shows(completed).await;
        terminal.type_in("\x15").await;
    }
    terminal.type_in("exit\r").await;
    assert_eq!(terminal.end().await.0, Some(0));
}

/// Pairs are set before groups. If a pair is refused, neither is set; if a link of the groups is refused, the
/// error says what was done.
#[tokio::test]
async fn a_filter_of_which_a_part_is_refused_says_what_is_set() {
    let daemon = paused().await;
    let filter = async |arguments: &[&str]| {
        daemon.simctl(["robot", "filter", "bench_arm"].iter().chain(arguments)).await
    };
    let refused = filter(&["--group", "5", "--disable", "hook,lid"]).await;
    assert!(refused.code != 0 && refused.err.contains("hook"), "{refused:?}");
    let shown = json(&filter(&["-o", "json"]).await);
    assert!(shown["groups"].as_array().unwrap().is_empty(), "{shown}");
    let refused = filter(&["--group", "5", "--link", "hook", "--self-collision", "true"]).await;
    let expected = "pairs and self-collision are set, groups and masks are not: ";
    assert!(refused.code != 0 && refused.err.contains(expected), "{refused:?}");
    let shown = json(&filter(&["-o", "json"]).await);
    assert!(shown["self_collision"] == true && shown["groups"].as_array().unwrap().is_empty(), "{shown}");
}

//! The shell commands of the pages in `docs/` run as written, page by page and in order, in the world of
//! `make demo`.

use std::path::Path;

use simd_tests::process::{Home, Process, Said, repository, said};
use tokio::task::JoinSet;

/// Pages whose commands another test runs, or that need something that a test lacks, with the reason.
const ELSEWHERE: &[(&str, &str)] = &[
    ("configuration.md", "has no commands but examples of mistakes"),
    ("daemon.md", "has what a daemon prints"),
    ("embedded.md", "cargo builds an example"),
    ("grpc.md", "examples in other languages"),
    ("lab-server.md", "a test of its own, with tokens and certificates"),
    ("operations.md", "packages and systemd: make dist-check"),
    ("python.md", "client/python/tests/test_docs.py"),
    ("rollouts.md", "daemon::rollouts"),
    ("ros2.md", "needs ROS 2"),
    ("scale-out.md", "routers of Zenoh"),
    ("security.md", "daemon::security"),
    ("zenoh.md", "routers of Zenoh"),
];

/// First words of lines that belong to another terminal, another machine or a person, and the reason to leave
/// them out.
const LEFT_OUT: &[(&str, &str)] = &[
    ("make demo", "the test has started it"),
    ("export PATH=", "the test's own programs are found first"),
    ("pip install", "the tests of the Python client have it"),
    ("python ", "the tests of the Python client run scripts"),
    ("simctl camera view", "needs a renderer"),
    ("simctl doctor", "exits with 1 where it finds a problem of the machine"),
    ("simctl sensor read", "warns of what has no reading yet"),
    ("source <(simctl completions", "is bash's own"),
    ("ssh ", "needs another machine"),
];

/// Fenced blocks for a shell.
fn blocks(page: &str) -> Vec<Vec<&str>> {
    let fences = page.split("\n```").skip(1).step_by(2);
    let shells =
        fences.filter_map(|block| block.strip_prefix("sh\n").or_else(|| block.strip_prefix("bash\n")));
    shells.map(|block| block.lines().collect()).collect()
}

fn pages() -> Vec<(String, String)> {
    let entries = std::fs::read_dir(repository().join("docs")).unwrap().map(Result::unwrap);
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let mut pages: Vec<_> = names
        .filter(|name| name.ends_with(".md"))
        .map(|name| (std::fs::read_to_string(repository().join("docs").join(&name)).unwrap(), name))
        .filter(|(text, _)| !blocks(text).is_empty())
        .map(|(text, name)| (name, text))
        .collect();
    pages.sort();
    pages
}

/// Returns the demo's options for a page: those of the line that starts a daemon, without its addresses.
fn flags(blocks: &[Vec<&str>], recordings: &str) -> Vec<String> {
    let demo = "--config tests/assets/demo.toml";
    let said = blocks
        .iter()
        .flatten()
        .find(|line| line.starts_with("simd --"))
        .map_or(demo, |line| &line["simd ".len()..]);
    let mut words = said.split_whitespace().map(|word| if word == "runs" { recordings } else { word });
    let mut flags = vec!["--name".to_owned(), "demo".to_owned()];
    while let Some(word) = words.next() {
        match word {
            "--listen" | "--zenoh" => drop(words.next()),
            _ => flags.push(word.to_owned()),
        }
    }
    flags
}

/// Runs the blocks of a page; returns the failures.
async fn run(name: &str, page: &str) -> Vec<String> {
    let home = Home::new();
    let tests = repository().join("tests").canonicalize().unwrap();
    std::os::unix::fs::symlink(tests, home.path().join("tests")).unwrap();
    let blocks = blocks(page);
    let recordings = home.path().join("runs");
    std::fs::create_dir(&recordings).unwrap();
    let daemon = Process::start(flags(&blocks, &recordings.display().to_string())).await;
    let mut wrong = Vec::new();
    for block in blocks {
        let is_run = |line: &&str| {
            !line.starts_with("simd --") && !LEFT_OUT.iter().any(|(beginning, _)| line.starts_with(beginning))
        };
        let lines: Vec<&str> = block.into_iter().filter(is_run).collect();
        let script = lines.join("\n").replace("127.0.0.1:7400", daemon.address());
        write(home.path(), &format!("set -eu\n{script}\n"));
        let said = daemon.shell("HOME=$PWD bash block.sh", home.path()).await;
        let is_done = said.code == 0;
        if !is_done || said.err.contains("inside link") || said.out.contains("nothing touches") {
            wrong.push(format!("docs/{name}:\n{script}\n{}{}", said.out, said.err));
        }
    }
    wrong
}

fn write(folder: &Path, script: &str) {
    std::fs::write(folder.join("block.sh"), script).unwrap();
}

#[tokio::test]
async fn each_command_of_the_pages_runs_in_the_world_of_the_demo() {
    let is_elsewhere = |name: &str| ELSEWHERE.iter().any(|(page, _)| *page == name);
    let pages = pages().into_iter().filter(|(name, _)| !is_elsewhere(name));
    // Each in a separate world, all at once: most commands wait.
    let runs: JoinSet<_> = pages.map(|(name, text)| async move { run(&name, &text).await }).collect();
    assert!(runs.len() >= 6, "only {} pages have commands", runs.len());
    let wrong: Vec<String> = runs.join_all().await.into_iter().flatten().collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn pages_that_are_left_out_exist_and_have_commands() {
    let text = |name: &str| std::fs::read_to_string(repository().join("docs").join(name)).unwrap();
    for (name, why) in ELSEWHERE {
        assert!(text(name).contains("```"), "{name} has no commands any more: {why}");
    }
}

/// Returns the result of a script in a separate folder.
async fn shell(home: &Home, script: &str) -> Said {
    let mut shell = home.command("sh");
    shell.args(["-euc", script]).current_dir(home.path());
    let said = said(script, shell).await;
    assert_eq!(said.code, 0, "{script}: {}{}", said.out, said.err);
    said
}

#[tokio::test]
async fn the_lines_of_the_lab_server_make_one_that_a_user_reaches() {
    let page = std::fs::read_to_string(repository().join("docs/lab-server.md")).unwrap();
    let blocks: Vec<String> = blocks(&page).into_iter().map(|lines| lines.join("\n")).collect();
    let [server, client, browser, ..] = blocks.as_slice() else { panic!("{blocks:?}") };
    let home = Home::new();
    let folder = home.path().display().to_string();
    let (made, start) = server.split_once("simd --listen").unwrap();
    let token = shell(&home, made).await.out.lines().last().unwrap().to_owned();
    // The addresses are those of the network; the test uses loopback.
    let start = start.replace("\\\n", "");
    let flags =
        start.split_whitespace().skip(1).filter(|word| !["--zenoh", "tls/0.0.0.0:7447"].contains(word));
    let flags: Vec<String> = flags
        .map(|word| if word.starts_with("--") { word.to_owned() } else { format!("{folder}/{word}") })
        .collect();
    let daemon = Process::start_with(["--zenoh", "tls/127.0.0.1:0"], &flags).await;

    let (environment, _) = client.split_once("simctl doctor").unwrap();
    let environment = environment
        .replace("https://lab.example:7400", &daemon.endpoint)
        .replace("simd_...", &token)
        .replace("=ca.pem", "=tls/ca.pem")
        .replace("=alice.", "=tls/alice.");
    let robot = repository().join("tests/assets/Two Link.v2").canonicalize().unwrap();
    let load = format!("simctl robot load '{}' --fixed", robot.display());
    assert!(client.contains("simctl robot load path/to/your_package --fixed"), "{client}");
    let loaded = shell(&home, &format!("{environment}\n{load}\nsimctl robot list")).await;
    assert!(loaded.out.contains("two_link"), "{}", loaded.out);
    shell(&home, &format!("cd tls\n{browser}\ntest -s alice.p12")).await;
}

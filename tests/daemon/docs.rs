//! The documents in `docs/` agree with the programs.

use serde_json::Value;
use simd_tests::process::{Process, repository};

use crate::paused;

fn read(document: &str) -> String {
    std::fs::read_to_string(repository().join("docs").join(document)).unwrap()
}

/// Documented and actual output have the same field names, and the same kinds of values if neither is null.
/// The first item of a documented array represents all items.
fn assert_alike(place: &str, documented: &Value, actual: &Value) {
    match (documented, actual) {
        (Value::Object(documented), Value::Object(actual)) => {
            let names = |object: &serde_json::Map<String, Value>| object.keys().cloned().collect::<Vec<_>>();
            assert_eq!(names(documented), names(actual), "{place}");
            for (name, value) in documented {
                assert_alike(&format!("{place}.{name}"), value, &actual[name]);
            }
        }
        (Value::Array(documented), Value::Array(actual)) => {
            let Some(first) = documented.first() else { return };
            assert!(!actual.is_empty(), "{place} is empty");
            actual.iter().for_each(|item| assert_alike(&format!("{place}[]"), first, item));
        }
        (Value::Null, _) | (_, Value::Null) => {}
        (documented, actual) => {
            let kind = std::mem::discriminant::<Value>;
            assert_eq!(kind(documented), kind(actual), "{place}: {documented} and {actual}");
        }
    }
}

/// Returns each JSON block, with the command in backticks that the paragraph before it begins with.
fn documented(document: &str) -> Vec<(String, Value)> {
    let mut documents = Vec::new();
    let mut paragraph = "";
    for block in document.split("\n\n") {
        if let Some(json) = block.strip_prefix("```json\n") {
            let command = paragraph.split('`').nth(1).unwrap_or_default();
            let value = serde_json::from_str(json.trim_end_matches('`'));
            documents.push((command.to_owned(), value.unwrap_or_else(|error| panic!("{command}: {error}"))));
        }
        paragraph = block;
    }
    documents
}

#[tokio::test]
async fn each_json_document_of_the_document_has_the_fields_that_simctl_writes() {
    let document = read("simctl.md");
    let documents = documented(&document);
    assert!(documents.len() > 15, "only {} documents were found", documents.len());
    let flags = ["--name", "demo", "--config", "tests/assets/demo.toml", "--paused"];
    let daemon = Process::start_with(["--zenoh", "tcp/127.0.0.1:0"], flags).await;
    let folder = simd_tests::process::Home::new();
    let points = folder.path().join("reach.csv").display().to_string();
    std::fs::write(&points, "time,shoulder\n1,0.1\n").unwrap();
    let tried = folder.path().join("tried.csv").display().to_string();
    std::fs::write(&tried, "copy,shoulder\n0,0.1\n1,0.2\n").unwrap();
    for (command, documented) in documents {
        assert!(command.starts_with("simctl "), "{command:?} is not a command");
        // Nothing is written into the repository.
        let file = folder.path().join("here.simdstate").display().to_string();
        let command = command
            .replace("here.simdstate", &file)
            .replace("reach.csv", &points)
            .replace("tried.csv", &tried);
        // The documents show gRPC's endpoint, except for the one that only Zenoh can answer.
        let place = match command.starts_with("simctl daemon") {
            true => format!(" -e {}", daemon.locator.as_deref().unwrap()),
            false => String::new(),
        };
        let said = daemon.shell(&format!("{command} -o json{place}"), &repository()).await;
        assert_eq!(said.code, 0, "{command}: {}", said.err);
        let actual = serde_json::from_str(&said.out).unwrap();
        assert_alike(&command, &documented, &actual);
    }
}

#[tokio::test]
async fn the_keys_of_the_document_are_those_of_the_table() {
    let said = simd_tests::process::Home::new().run("simd", ["config", "document"]).await;
    let document = read("configuration.md");
    let (_, keys) = document.split_once("## Keys\n\n").unwrap();
    assert_eq!(
        keys, said.out,
        "docs/configuration.md has what `simd config document` prints after its heading"
    );
}

#[tokio::test]
async fn each_flag_and_exit_code_of_the_help_is_in_the_document() {
    let help = simd_tests::process::Home::new().run("simd", ["--help"]).await.out;
    let document = read("daemon.md") + &read("configuration.md");
    let flags: Vec<&str> = help
        .lines()
        .map(str::trim_start)
        .filter(|line| line.starts_with("--"))
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    assert!(flags.len() > 10, "{flags:?}");
    for flag in flags {
        assert!(document.contains(&format!("`{flag}")), "the documents lack {flag}");
    }
    let (_, codes) = help.split_once("Exit codes:\n").unwrap();
    for line in codes.lines() {
        let (code, meaning) = line.trim().split_once(' ').unwrap();
        let row = format!("| {code} | {} |", meaning.trim());
        assert!(document.contains(&row), "docs/daemon.md lacks {row:?}");
    }
}

#[tokio::test]
async fn the_limits_of_the_document_are_those_that_the_daemon_reports() {
    let document = read("daemon.md");
    let info = paused().await.client().await.simulator_info().await.unwrap();
    let limits = info.limits.unwrap();
    for (name, value) in [
        ("max_robots", limits.max_robots.into()),
        ("max_links", limits.max_links.into()),
        ("max_description_bytes", limits.max_description_bytes),
        ("max_asset_bytes", limits.max_asset_bytes),
        ("max_upload_store_bytes", limits.max_upload_store_bytes),
        ("max_message_bytes", limits.max_message_bytes),
        ("max_steps", limits.max_steps),
        ("max_saved_states", limits.max_saved_states.into()),
        ("max_parameters", limits.max_parameters.into()),
    ] {
        let row = format!("| `{name}` | {value} |");
        assert!(document.contains(&row), "docs/daemon.md lacks {row:?}");
    }
}

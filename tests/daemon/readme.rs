//! The README's commands run, line by line and in order.

use std::path::Path;

use simd_tests::process::repository;

use crate::transcript::{Transcript, assert_snapshot};
use crate::{demo, paused};

/// Returns the text without the numbers of a playing world, and without the widths of columns.
fn without_numbers(transcript: &str) -> String {
    let is_number = |word: &str| word.trim_matches(['(', ')', ',']).parse::<f64>().is_ok();
    let line = |line: &str| {
        if line.starts_with('$') {
            return format!("{line}\n");
        }
        let words = line.split_whitespace().map(|word| if is_number(word) { "#" } else { word });
        format!("{}\n", words.collect::<Vec<_>>().join(" "))
    };
    transcript.lines().map(line).collect()
}

fn read(page: &str) -> String {
    std::fs::read_to_string(repository().join(page)).unwrap()
}

/// Returns the lines that begin with `simctl`, of each fenced block that has some.
fn blocks(text: &str) -> Vec<Vec<&str>> {
    let inside = text.split("```").skip(1).step_by(2);
    let lines = inside.map(|block| block.lines().filter(|line| line.starts_with("simctl ")).collect());
    lines.filter(|lines: &Vec<_>| !lines.is_empty()).collect()
}

#[tokio::test]
async fn each_line_of_the_readme_works_on_the_demo() {
    let readme = read("README.md");
    let blocks = blocks(&readme);
    let [of_the_demo, of_ones_own] = blocks.as_slice() else { panic!("{blocks:?}") };
    let daemon = demo().await;
    let transcript = Transcript::of(&daemon, of_the_demo).await;
    assert!(!transcript.text().contains("exit code"), "{}", transcript.text());
    assert_snapshot("readme", &without_numbers(transcript.text()), &[]);

    // The robots that the README calls one's own.
    let folder = tempfile::tempdir().unwrap();
    let to = folder.path().join("path/to");
    std::fs::create_dir_all(&to).unwrap();
    let asset = |path: &str| repository().join("tests/assets").join(path).canonicalize().unwrap();
    copy(&asset("Two Link.v2"), &to.join("your_package"));
    std::fs::copy(asset("branching/urdf/branching.urdf"), to.join("robot.urdf")).unwrap();
    for line in of_ones_own {
        let said = daemon.shell(line, folder.path()).await;
        assert_eq!(said.code, 0, "{line}: {}", said.err);
        assert!(said.out.contains("fixed base"), "{line}: {}", said.out);
        assert!(!said.err.contains("inside link"), "{line}: {}", said.err);
    }
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().map(Result::unwrap) {
        let to = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &to);
        } else {
            std::fs::copy(entry.path(), to).unwrap();
        }
    }
}

#[test]
fn make_demo_prints_lines_of_the_readme() {
    let (readme, makefile) = (read("README.md"), read("Makefile"));
    let of_the_demo = blocks(&readme).swap_remove(0);
    let printed: Vec<&str> =
        makefile.split('\'').map(str::trim).filter(|line| line.starts_with("simctl ")).collect();
    assert!(printed.len() > 3, "{printed:?}");
    let mut lines = of_the_demo.iter();
    for line in printed {
        assert!(lines.any(|shown| *shown == line), "{line:?} is not in the README, or in another order");
    }
}

#[tokio::test]
async fn a_paused_demo_shows_the_same_numbers_each_time() {
    let daemon = paused().await;
    let lines = [
        "simctl robot list",
        "simctl robot info bench_arm",
        "simctl joint list bench_arm --wide",
        "simctl sim physics",
        "simctl joint set bench_arm shoulder=0.5",
        "simctl sim step 1000",
        "simctl joint get bench_arm",
        "simctl joint set bench_arm shoulder=vel:1",
        "simctl sim step 500",
        "simctl joint get bench_arm shoulder",
        "simctl joint watch bench_arm --count 1",
        "simctl joint set bench_arm shoulder=passive",
        "simctl joint reset bench_arm shoulder=90deg,0.5",
        "simctl joint get bench_arm",
        "simctl state save upright",
        "simctl sim step 10",
        "simctl state restore upright",
        "simctl state list",
        "simctl sim status",
        "simctl sim reset",
        "simctl server info",
        "simctl robot delete bench_arm",
        "simctl robot list",
    ];
    let transcript = Transcript::of(&daemon, &lines).await;
    let filters = &[(r"step duration     \d+\.\d us", "step duration     [MEASURED] us")];
    assert_snapshot("paused", transcript.text(), filters);
}

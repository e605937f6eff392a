//! Documents name things that exist and are plain English, modules import downwards, files are opened in one
//! place, and words are those of the glossary.
#![cfg(test)]

mod files;
mod layers;
mod prose;
mod words;

use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(document: &str) -> String {
    std::fs::read_to_string(root().join(document)).unwrap_or_else(|error| panic!("{document}: {error}"))
}

/// Returns the texts between backticks that look like a path of this repository: with a slash or a known
/// ending, and without characters of code.
fn paths(text: &str) -> Vec<&str> {
    let inside = text.split('`').skip(1).step_by(2);
    let pathlike = |s: &&str| {
        let known = [".rs", ".md", ".toml", ".proto", ".py", ".json"];
        (s.contains('/') || known.iter().any(|ending| s.ends_with(ending)))
            && !s.contains(|c: char| c.is_whitespace() || "<>{}*()=:,$|".contains(c))
            && !s.starts_with('/')
    };
    inside.filter(pathlike).collect()
}

#[test]
fn each_path_that_the_architecture_names_exists() {
    let text = read("ARCHITECTURE.md");
    let paths = paths(&text);
    assert!(paths.len() > 20, "only {} paths were found", paths.len());
    let missing: Vec<_> = paths.iter().filter(|path| !root().join(path).exists()).collect();
    assert!(missing.is_empty(), "ARCHITECTURE.md names {missing:?}");
}

#[test]
fn each_path_that_a_page_of_the_design_names_exists() {
    let pages: Vec<_> = documents().into_iter().filter(|page| page.starts_with("docs/design/")).collect();
    assert!(pages.len() > 8, "only {pages:?}");
    let index = read("ARCHITECTURE.md");
    for page in pages {
        assert!(index.contains(&format!("]({page})")), "the index in ARCHITECTURE.md lacks {page}");
        let text = read(&page);
        let missing: Vec<_> = paths(&text).into_iter().filter(|path| !root().join(path).exists()).collect();
        assert!(missing.is_empty(), "{page} names {missing:?}");
    }
}

/// `FILE::TEST` names a function of that file.
#[test]
fn each_test_that_the_architecture_names_exists() {
    let text = read("ARCHITECTURE.md");
    let named = text.split('`').skip(1).step_by(2).filter_map(|code| code.split_once(".rs::"));
    let named: Vec<_> = named.collect();
    assert!(named.len() > 20, "only {} tests were found", named.len());
    for (file, test) in named {
        let file = format!("{file}.rs");
        assert!(read(&file).contains(&format!("fn {test}(")), "{file} has no test {test}");
    }
}

/// Folders whose subfolders the architecture names, each with a line.
const MAPPED: [&str; 20] = [
    "cli/src",
    "client",
    "client/camera/src",
    "client/python",
    "client/python/src/simd_client",
    "client/rust/src",
    "client/web",
    "client/web/src",
    "proto",
    "server",
    "server/api/src",
    "server/core/src",
    "server/core/src/dynamics",
    "server/core/src/simulation",
    "server/mcap/src",
    "server/model/src",
    "server/ros2/src",
    "server/src",
    "server/world/src",
    "tests",
];

/// Built, generated, or plain by its name.
const NOT_MAPPED: [&str; 10] =
    ["src", "tests", "target", "node_modules", "dist", "gen", "generated", "proto", "out", "__pycache__"];

#[test]
fn the_architecture_names_each_folder() {
    let text = read("ARCHITECTURE.md");
    let mut lacking = Vec::new();
    for folder in MAPPED {
        for entry in std::fs::read_dir(root().join(folder)).unwrap().map(Result::unwrap) {
            let name = entry.file_name().to_string_lossy().into_owned();
            // The file of a module describes its parts.
            let is_of_a_file = entry.path().with_extension("rs").exists();
            let is_left_out = name.starts_with('.') || NOT_MAPPED.contains(&name.as_str());
            let path = format!("{folder}/{name}");
            if entry.path().is_dir() && !is_of_a_file && !is_left_out && !text.contains(&format!("`{path}`"))
            {
                lacking.push(path);
            }
        }
    }
    assert!(lacking.is_empty(), "ARCHITECTURE.md does not name {lacking:?}");
}

#[test]
fn the_architecture_is_read_in_one_sitting() {
    let lines = read("ARCHITECTURE.md").lines().count();
    assert!(lines <= 250, "ARCHITECTURE.md has {lines} lines; the most is 250. Decisions go to docs/design");
}

#[test]
fn the_readme_is_short() {
    let lines = read("README.md").lines().count();
    assert!(lines <= 130, "README.md has {lines} lines; the most is 130. Details go to docs/");
}

/// Returns all pages below docs/, and the documents of the root and of the clients.
fn documents() -> Vec<String> {
    let elsewhere = [
        "ARCHITECTURE.md",
        "CHANGELOG.md",
        "CONTRIBUTING.md",
        "README.md",
        "SECURITY.md",
        "cli/README.md",
        "client/python/README.md",
        "client/python/examples/README.md",
        "client/web/README.md",
    ];
    let mut documents: Vec<String> = elsewhere.map(String::from).into();
    let mut folders = vec!["docs".to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(root().join(&folder)).unwrap().map(Result::unwrap) {
            let path = format!("{folder}/{}", entry.file_name().to_string_lossy());
            if entry.path().is_dir() {
                folders.push(path);
            } else if path.ends_with(".md") {
                documents.push(path);
            }
        }
    }
    documents.sort();
    documents
}

/// Returns the anchors of a document's headings, as GitHub and mkdocs make them.
fn anchors(text: &str) -> Vec<String> {
    let anchor = |heading: &str| {
        let kept = |c: &char| c.is_alphanumeric() || "-_ ".contains(*c);
        heading.trim().to_lowercase().chars().filter(kept).collect::<String>().replace(' ', "-")
    };
    let outside_of_code = text.split("\n```").step_by(2);
    let lines = outside_of_code.flat_map(str::lines).filter(|line| line.starts_with('#'));
    lines.map(|line| anchor(line.trim_start_matches('#'))).collect()
}

#[test]
fn each_link_of_a_document_leads_to_a_file_and_a_heading() {
    let mut lost = Vec::new();
    for document in documents() {
        let text = read(&document);
        let folder = root().join(Path::new(&document).parent().unwrap());
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            if link.starts_with("http") {
                continue;
            }
            let target = if file.is_empty() { root().join(&document) } else { folder.join(file) };
            let is_found = match std::fs::read_to_string(&target) {
                Ok(text) => anchor.is_empty() || anchors(&text).iter().any(|it| it == anchor),
                // A folder or a picture.
                Err(_) => target.exists(),
            };
            if !is_found {
                lost.push(format!("{document} links to {link}"));
            }
        }
    }
    assert!(lost.is_empty(), "{lost:#?}");
}

#[test]
fn a_search_finds_what_people_look_for() {
    for (words, page) in [
        ("1 khz", "fast-loop"),
        ("docker", "operations"),
        ("gravity", "physics"),
        ("headless", "ci"),
        ("record", "recording"),
        ("ros 2", "ros2"),
        ("systemd", "operations"),
        ("torque control", "tutorial"),
        ("torque control", "physics"),
    ] {
        let page = format!("docs/{page}.md");
        assert!(read(&page).to_lowercase().contains(words), "{page} does not have {words:?}");
    }
}

#[test]
fn every_source_file_opens_with_what_it_is_for() {
    let mut folders = vec![root()];
    let mut seen = 0;
    let made = ["target", "node_modules", "gen", "generated", "dist"];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap().map(Result::unwrap) {
            let path = entry.path();
            let name = entry.file_name().to_string_lossy().into_owned();
            if path.is_dir() && !name.starts_with('.') && !made.contains(&name.as_str()) {
                folders.push(path);
            } else if name.ends_with(".rs") {
                let text = std::fs::read_to_string(&path).unwrap();
                assert!(text.starts_with("//!"), "{} does not say what it is for", path.display());
                seen += 1;
            } else if name.ends_with(".ts") || name.ends_with(".tsx") {
                let text = std::fs::read_to_string(&path).unwrap();
                assert!(text.starts_with("// "), "{} does not say what it is for", path.display());
                seen += 1;
            }
        }
    }
    assert!(seen > 50, "only {seen} files were found");
}

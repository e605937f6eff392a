//! What the documents name must exist, modules import downwards, and words are those of the glossary.
#![cfg(test)]

mod layers;
mod words;

use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(document: &str) -> String {
    std::fs::read_to_string(root().join(document)).unwrap_or_else(|error| panic!("{document}: {error}"))
}

/// What stands between backticks and looks like a path of this repository: it has
/// a slash or a known ending, and nothing that only code has.
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
fn each_link_of_a_document_leads_to_a_file() {
    let docs = std::fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let docs = docs.filter(|path| path.extension().is_some_and(|ending| ending == "md"));
    let docs = docs.map(|path| format!("docs/{}", path.file_name().unwrap().to_string_lossy()));
    let documents = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"];
    for document in documents.into_iter().map(String::from).chain(docs) {
        let text = read(&document);
        let folder = root().join(Path::new(&document).parent().unwrap());
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let file = link.split('#').next().unwrap();
            let outside = link.starts_with("http") || file.is_empty();
            assert!(outside || folder.join(file).exists(), "{document} links to {link}");
        }
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

//! SDF and MJCF: the result for each element, as `docs/descriptions.md` documents it, on small files.
//!
//! `descriptions/*.toml`: each case with lines of the resulting URDF, and the whole report of the reader of
//! its format.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::Deserialize;
use simd_model::robot::Sha256;
use simd_model::{Asset, Assets, Finding, LoadLimits, LoadReport, ReadOptions};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    case: Vec<Case>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    /// The row of the table: its format and its element.
    row: String,
    name: String,
    text: String,
    /// Texts of other files, by URI.
    #[serde(default)]
    files: BTreeMap<String, String>,
    /// Robots: name, and whether its root link is fixed.
    robots: Vec<String>,
    /// Lines that one of the URDFs has.
    #[serde(default)]
    lines: Vec<String>,
    /// Severity, disposition, line, element, message; only the error if it is refused.
    #[serde(default)]
    report: Vec<String>,
}

struct Files<'c>(&'c BTreeMap<String, String>);

impl Assets for Files<'_> {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        let text = self.0.get(uri).ok_or_else(Vec::new)?;
        Ok(Asset { sha256: Sha256::of(text.as_bytes()), bytes: text.as_bytes().into() })
    }
}

fn cases() -> Vec<Case> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus/descriptions");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let read = |path: std::path::PathBuf| {
        let text = std::fs::read_to_string(&path).unwrap();
        toml::from_str::<File>(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display())).case
    };
    files.into_iter().flat_map(read).collect()
}

fn line(finding: &Finding) -> String {
    let Finding { severity, disposition, element, file, line, message } = finding;
    let line = line.map_or("-".to_owned(), |line| line.to_string());
    let file = file.as_ref().map(|file| format!(" [{file}]")).unwrap_or_default();
    format!("{} {} {line} {element}{file}: {message}", severity.word(), disposition.word())
}

fn lines(report: &LoadReport) -> Vec<String> {
    report.findings.iter().map(line).collect()
}

/// Returns the lines to write into the case, if its present ones differ.
fn difference(case: &Case) -> Option<String> {
    let files = Files(&case.files);
    let limits = LoadLimits::default();
    let (robots, urdfs, report) = match simd_model::translate(case.text.as_bytes(), &files, &limits) {
        Ok(Some(translation)) => {
            let robot = |model: &simd_model::TranslatedModel| {
                format!("{} {}", model.name, if model.fixed { "fixed" } else { "free" })
            };
            let mut report = lines(&translation.report);
            let mut urdfs = Vec::new();
            let files = translation.files(&files);
            for model in &translation.models {
                // Warnings of the URDF reader are a part of it too.
                let read = simd_model::read(model.urdf.as_bytes(), &files, &ReadOptions::default());
                let own = match read {
                    Ok((_, own)) => own,
                    Err(refused) => refused.report,
                };
                let own = model.report(own);
                report.extend(own.at_least(simd_model::Severity::Warning).map(line));
                urdfs.push(model.urdf.clone());
            }
            (translation.models.iter().map(robot).collect(), urdfs, report)
        }
        Ok(None) => panic!("{}: it is neither SDF nor MJCF", case.name),
        Err(refused) => (Vec::new(), Vec::new(), lines(&refused.report)),
    };
    let has =
        |wanted: &&String| urdfs.iter().any(|urdf| urdf.lines().any(|line| line.trim() == wanted.trim()));
    let lacking: Vec<&String> = case.lines.iter().filter(|line| !has(line)).collect();
    if robots == case.robots && report == case.report && lacking.is_empty() {
        return None;
    }
    let listed = |list: &[String]| list.iter().map(|line| format!("  '''{line}''',\n")).collect::<String>();
    Some(format!(
        "{} / {}\nrobots = {robots:?}\nreport = [\n{}]\nlacking: {lacking:#?}\n{}",
        case.row,
        case.name,
        listed(&report),
        if lacking.is_empty() { String::new() } else { urdfs.concat() }
    ))
}

#[test]
fn every_element_becomes_what_its_case_says() {
    let wrong: Vec<String> = cases().iter().filter_map(difference).collect();
    assert!(wrong.is_empty(), "{} cases:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn the_table_of_formats_and_the_cases_name_the_same_elements() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/descriptions.md");
    let text = std::fs::read_to_string(page).unwrap();
    let rows = text.lines().filter(|line| line.starts_with("| SDF |") || line.starts_with("| MJCF |"));
    let of_table: Vec<String> = rows
        .map(|row| {
            let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
            format!("{} {}", cells[0], cells[1])
        })
        .collect();
    let unique: BTreeSet<&String> = of_table.iter().collect();
    assert_eq!(unique.len(), of_table.len(), "an element has two rows");
    let cases = cases();
    let of_cases: BTreeSet<&String> = cases.iter().map(|case| &case.row).collect();
    let difference: Vec<_> = unique.symmetric_difference(&of_cases).collect();
    assert!(difference.is_empty(), "only in one of them: {difference:?}");
}

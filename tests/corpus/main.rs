//! Files as people send them: simd's result for each, and that none of them harms it.
//!
//! * `cases/*.toml`: small broken files, each with the whole expected report.
//! * `case`: the format of such a file; `meshes`: the mesh files in them.
//! * `table`: `docs/urdf.md` and the cases name the same things.
//! * `descriptions`: the same of SDF and MJCF.
//! * `frames`: sites and frames, as links.
//! * `limits`: each limit at its value and one past it; `hostile`: files made to harm.
//! * `mutations`: nothing that is done to a good file makes the reader panic.
//! * `schemas`: each word of the schemas of SDF and MJCF is read, or named in the report.
//! * `pybullet`: robots that others made, beside PyBullet and an independent reader.
#![cfg(test)]

mod case;
mod descriptions;
mod frames;
mod hostile;
mod limits;
mod meshes;
mod mutations;
mod pybullet;
mod schemas;
mod table;

use simd_model::{Disposition, Severity};

use case::{Case, Outcome};

#[test]
fn every_case_gets_its_report() {
    let cases = Case::all();
    assert!(cases.len() >= 250, "only {} cases were found", cases.len());
    let wrong: Vec<String> = cases.iter().filter_map(difference).collect();
    assert!(wrong.is_empty(), "{} of {} cases:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

/// Returns the text to write into the case, if its report differs and is right.
fn difference(case: &Case) -> Option<String> {
    let found = case.read().lines();
    if found == case.report {
        return None;
    }
    let lines: Vec<String> = found.iter().map(|line| format!("  '''{line}''',\n")).collect();
    Some(format!("{} / {}\nreport = [\n{}]", case.row, case.name, lines.concat()))
}

#[test]
fn no_two_cases_of_a_row_have_one_name() {
    let mut names: Vec<_> = Case::all().into_iter().map(|case| (case.row, case.name)).collect();
    let count = names.len();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), count);
}

#[test]
fn a_repair_is_a_warning_and_strict_loading_refuses_it() {
    let mut repaired = 0;
    for case in Case::all() {
        let Outcome { report, model, .. } = case.read();
        let repairs: Vec<_> =
            report.findings.iter().filter(|finding| finding.disposition == Disposition::Repaired).collect();
        let what = format!("{} / {}", case.row, case.name);
        assert!(repairs.iter().all(|repair| repair.severity == Severity::Warning), "{what}");
        if model.is_none() || repairs.is_empty() {
            continue;
        }
        repaired += 1;
        let strict = case.read_strictly();
        assert!(strict.model.is_none(), "{what}");
        for finding in strict.report.findings.iter().filter(|it| it.disposition == Disposition::Repaired) {
            assert_eq!(finding.severity, Severity::Error, "{what}: {}", finding.message);
        }
        assert!(strict.lines().last().unwrap().contains("strict loading refuses this"), "{what}");
    }
    assert!(repaired > 50, "only {repaired} cases are repaired");
}

#[test]
fn every_refusal_is_a_sentence_with_a_line_or_is_about_the_file_as_a_whole() {
    for case in Case::all() {
        let Outcome { report, model, .. } = case.read();
        let Some(refused) = report.findings.iter().find(|it| it.disposition == Disposition::Refused) else {
            assert!(model.is_some());
            continue;
        };
        assert!(refused.line.is_some() || refused.element == "file", "{}: {refused:?}", case.name);
        assert!(refused.message.split_whitespace().count() >= 3, "{}: {}", case.name, refused.message);
        assert!(!refused.message.contains("urdf-rs"), "{}: {}", case.name, refused.message);
    }
}

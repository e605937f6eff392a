//! Compares `docs/urdf.md` with the cases and the code.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use simd_model::LoadLimits;

use crate::case::Case;

/// Returns the cells of each row of a table whose head begins with this word.
fn rows(head: &str) -> Vec<Vec<String>> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/urdf.md");
    let text = std::fs::read_to_string(page).unwrap();
    let mut rows = Vec::new();
    let mut inside = false;
    for line in text.lines() {
        let cells: Vec<String> =
            line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect();
        if !line.starts_with('|') {
            inside = false;
        } else if cells[0] == head {
            inside = true;
        } else if inside && !cells[0].starts_with("--") {
            rows.push(cells);
        }
    }
    rows
}

fn name(cell: &str) -> String {
    cell.trim_matches('`').to_owned()
}

#[test]
fn the_table_and_the_cases_name_the_same_things() {
    let of_table: Vec<String> = rows("case").iter().map(|row| name(&row[0])).collect();
    let of_cases: BTreeSet<String> = Case::all().into_iter().map(|case| case.row).collect();
    let unique: BTreeSet<String> = of_table.iter().cloned().collect();
    assert_eq!(of_table.len(), unique.len(), "a case has two rows");
    let difference: Vec<_> = unique.symmetric_difference(&of_cases).collect();
    assert!(difference.is_empty(), "only in one of them: {difference:?}");
}

#[test]
fn each_case_is_reported_as_its_row_says() {
    let mut cases: BTreeMap<String, Vec<Case>> = BTreeMap::new();
    for case in Case::all() {
        cases.entry(case.row.clone()).or_default().push(case);
    }
    for row in rows("case") {
        let promised: Vec<(&str, &str)> =
            row[3].split(" or ").map(|it| it.split_once(", ").unwrap()).collect();
        let mut kept: BTreeSet<&(&str, &str)> = BTreeSet::new();
        for case in &cases[&name(&row[0])] {
            let keeps = |(disposition, severity): &&(&str, &str)| {
                let begin = format!("{severity} {disposition} ");
                case.report.iter().any(|line| line.starts_with(&begin))
            };
            let found: Vec<_> = promised.iter().filter(keeps).collect();
            assert!(
                !found.is_empty(),
                "{} / {} is not {:?}: {:?}",
                case.row,
                case.name,
                promised,
                case.report
            );
            kept.extend(found);
            // A finding that needs attention is promised in the table.
            for (severity, word) in [("warning", "repaired"), ("error", "refused")] {
                let is_there =
                    case.report.iter().any(|line| line.starts_with(&format!("{severity} {word} ")));
                let is_aside = ["text-inside", "xacro-file"].contains(&case.row.as_str());
                assert!(
                    !is_there || is_aside || promised.contains(&(word, severity)),
                    "{} / {}",
                    case.row,
                    case.name
                );
            }
        }
        assert_eq!(kept.len(), promised.len(), "{}: not all of {promised:?} has a case", row[0]);
    }
}

#[test]
fn the_table_of_limits_gives_the_defaults() {
    let of_table: Vec<(String, u64)> =
        rows("limit").iter().map(|row| (name(&row[0]), row[1].parse().unwrap())).collect();
    let LoadLimits {
        urdf_bytes,
        xml_nodes,
        xml_depth,
        xml_attributes,
        xml_namespaces,
        name_bytes,
        links,
        shapes,
        mesh_bytes,
        mesh_triangles,
        robot_triangles,
        findings,
        time,
    } = LoadLimits::default();
    let of_code = [
        ("urdf_bytes", urdf_bytes as u64),
        ("xml_nodes", u64::from(xml_nodes)),
        ("xml_depth", xml_depth as u64),
        ("xml_attributes", xml_attributes as u64),
        ("xml_namespaces", xml_namespaces as u64),
        ("name_bytes", name_bytes as u64),
        ("links", links as u64),
        ("shapes", shapes as u64),
        ("mesh_bytes", mesh_bytes as u64),
        ("mesh_triangles", mesh_triangles as u64),
        ("robot_triangles", robot_triangles as u64),
        ("findings", findings as u64),
        ("seconds", time.as_secs()),
    ];
    assert_eq!(of_table, of_code.map(|(name, value)| (name.to_owned(), value)));
}

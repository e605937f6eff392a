//! Targets of joints for each copy, from a table with commas or from a JSON document.

use std::path::Path;

use anyhow::{anyhow, bail, ensure};
use serde::Deserialize;

use crate::{
    output::number::count,
    text_file::{self, Object, from_json},
};

/// Error with the expected form of a document.
const DOCUMENT: &str = "must be a JSON object, as {\"joints\": [\"shoulder\", \"elbow\"], \
                        \"targets\": [[[0.1, 0.2], [0.3, 0.4]]]}, with lists of copies, knots and joints";

/// Contents of a file.
#[derive(Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub(super) struct Tried {
    pub(super) joints: Vec<String>,
    /// By copy, knot and joint.
    pub(super) targets: Vec<Vec<Vec<f64>>>,
}

impl Tried {
    fn check(self) -> anyhow::Result<Self> {
        let knots = self.targets.first().map_or(0, Vec::len);
        ensure!(knots > 0 && !self.joints.is_empty(), "it has no targets");
        for (copy, of_copy) in self.targets.iter().enumerate() {
            if of_copy.len() != knots {
                let knots = count(knots, "knot");
                bail!("copy {copy} has {}, and copy 0 has {knots}", count(of_copy.len(), "knot"));
            }
            if let Some(row) = of_copy.iter().find(|row| row.len() != self.joints.len()) {
                bail!(
                    "copy {copy} has a knot of {} for {}",
                    count(row.len(), "number"),
                    count(self.joints.len(), "joint")
                );
            }
        }
        Ok(self)
    }

    /// Returns all numbers in this order in one list.
    pub(super) fn numbers(&self) -> Vec<f64> {
        self.targets.iter().flatten().flatten().copied().collect()
    }
}

/// Reads a file. It is JSON if its name ends so or its text begins as JSON; otherwise it is a table.
pub(super) fn read(file: &Path, text: &str) -> anyhow::Result<Tried> {
    let is_named_json = file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
    match text.trim_start().chars().next() {
        Some('{') => {
            let Object(tried) = from_json::<Object<Tried>>(text)?;
            tried.check()
        }
        Some('[') => bail!("it is a list; it {DOCUMENT}"),
        None if is_named_json => bail!("it is empty; it {DOCUMENT}"),
        Some(_) if is_named_json => {
            bail!("its name ends in .json, and it has no object; it {DOCUMENT}; give a table another name")
        }
        _ => table(text)?.check(),
    }
}

/// Parses a table with commas.
fn table(text: &str) -> anyhow::Result<Tried> {
    let lines = text.lines().enumerate();
    let mut lines = lines.filter(|(_, line)| !line.trim().is_empty());
    let Some((_, head)) = lines.next() else { bail!("it is empty; its first line names joints") };
    let names: Vec<String> = head.split(',').map(|name| name.trim().to_owned()).collect();
    let has_copies = names.first().is_some_and(|name| name == "copy");
    let joints = names.get(usize::from(has_copies)..).unwrap_or_default().to_vec();
    let mut targets: Vec<Vec<Vec<f64>>> = Vec::new();
    for (number, line) in lines {
        let number = number + 1;
        let mut row = line
            .split(',')
            .map(|value| {
                let value = value.trim();
                value
                    .parse()
                    .map_err(|_| anyhow!("line {number}: {:?} is not a number", text_file::shown(value)))
            })
            .collect::<anyhow::Result<Vec<f64>>>()?;
        if row.len() != names.len() {
            bail!("line {number} has {} for {}", count(row.len(), "value"), count(names.len(), "column"));
        }
        let copy = if has_copies { row.remove(0) } else { 0.0 };
        let next = targets.len() as f64;
        if copy == next {
            targets.push(Vec::new());
        } else if targets.is_empty() || copy != next - 1.0 {
            bail!(
                "line {number} is of copy {copy}: copies are 0, 1, ... in order, with their lines together"
            );
        }
        if let Some(of_copy) = targets.last_mut() {
            of_copy.push(row);
        }
    }
    Ok(Tried { joints, targets })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_and_a_document_say_the_same() {
        let from_table = table("copy, shoulder,elbow\n0,0.1,0.2\n0,0.3,0.4\n\n1,-1,-2e0\n1,0,0\n").unwrap();
        let text =
            r#"{"joints": ["shoulder", "elbow"], "targets": [[[0.1, 0.2], [0.3, 0.4]], [[-1, -2], [0, 0]]]}"#;
        let from_json = read(Path::new("-"), text).unwrap();
        assert_eq!(from_table, from_json);
        assert_eq!(from_json.numbers(), [0.1, 0.2, 0.3, 0.4, -1.0, -2.0, 0.0, 0.0]);
        let one = table("shoulder\n0.5\n0.6\n").unwrap();
        assert_eq!(one.targets, [[[0.5], [0.6]]]);
    }

    #[test]
    fn a_mistake_names_its_line_or_copy() {
        let said = |text: &str| table(text).and_then(Tried::check).unwrap_err().to_string();
        for (text, part) in [
            ("", "empty"),
            ("shoulder\n", "no targets"),
            ("shoulder\nx", "line 2: \"x\" is not a number"),
            ("copy,shoulder\n0,1\n2,1", "line 3 is of copy 2"),
            ("copy,shoulder\n1,1", "line 2 is of copy 1"),
            ("shoulder,elbow\n1", "line 2 has 1 value for 2 columns"),
            ("shoulder\n1,2", "line 2 has 2 values for 1 column"),
            ("copy,shoulder\n0,1\n0,2\n1,1", "copy 1 has 1 knot, and copy 0 has 2 knots"),
        ] {
            assert!(said(text).contains(part), "{text:?}: {}", said(text));
        }
    }

    #[test]
    fn lists_objects_and_files_named_json_are_not_tables() {
        let said = |name: &str, text: &str| match read(Path::new(name), text) {
            Ok(found) => panic!("{name}, {text:?}: {found:?}"),
            Err(error) => error.to_string(),
        };
        let object = "must be a JSON object, as {\"joints\": [\"shoulder\", \"elbow\"], \"targets\": ";
        for (name, text, what) in [
            ("tried.json", "[[0.1, 0.2], [0.3, 0.4]]", "it is a list; it "),
            ("-", "\n [[0.1, 0.2]]", "it is a list; it "),
            ("tried.csv", "[[\"shoulder\"], [[[0.1]]]]", "it is a list; it "),
            ("tried.JSON", " \n", "it is empty; it "),
            ("tried.json", "shoulder\n0.5\n", "its name ends in .json, and it has no object; it "),
        ] {
            let said = said(name, text);
            assert!(said.starts_with(&format!("{what}{object}")), "{name}, {text:?}: {said}");
        }
        let broken = said("tried.csv", "{\"joints\": [\"shoulder\"]}");
        assert!(broken.contains("missing field `targets`"), "{broken}");
        let wide = said("-", "{\"joints\": [\"shoulder\"], \"targets\": [[[1, 2]]]}");
        assert_eq!(wide, "copy 0 has a knot of 2 numbers for 1 joint");
        for name in ["tried.csv", "tried", "-"] {
            assert_eq!(read(Path::new(name), "shoulder\n0.5\n").unwrap().targets, [[[0.5]]]);
        }
    }
}

//! Differences between copies: as arguments, and from a JSON document.

use anyhow::{Context as _, bail, ensure};
use serde::Deserialize;
use simd_client::{
    packed,
    proto::{RolloutNormal, RolloutUniform, RolloutVariation, RolloutVaried, rollout_variation::Values},
};

use crate::text_file::{Object, from_json};

const FORM: &str = "must be OF[:NAME,...]=LOW..HIGH or OF[:NAME,...]=MEAN+-DEVIATION";

/// Numbers that differ from copy to copy.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Variation {
    of: Option<String>,
    /// The command's robot if left out.
    robot: Option<String>,
    names: Vec<String>,
    /// By copy, then by joint or link.
    given: Option<Vec<Vec<f64>>>,
    uniform: Option<Object<Uniform>>,
    normal: Option<Object<Normal>>,
    wrench_step: u32,
    /// For a wrench: one if left out.
    wrench_steps: Option<u32>,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
struct Uniform {
    low: f64,
    high: f64,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
struct Normal {
    mean: f64,
    deviation: f64,
}

/// Parses `OF[:NAME,...]=LOW..HIGH` or `OF[:NAME,...]=MEAN+-DEVIATION`.
pub(super) fn parse(text: &str) -> Result<Variation, String> {
    let form = || FORM.to_owned();
    let (what, numbers) = text.rsplit_once('=').ok_or_else(form)?;
    let (of, names): (&str, Vec<String>) = match what.split_once(':') {
        Some((of, names)) => (of, names.split(',').map(|name| name.trim().to_owned()).collect()),
        None => (what, Vec::new()),
    };
    if varied(of)? == RolloutVaried::Wrench {
        return Err("a wrench has steps too: it stands in a file that --variations names".to_owned());
    }
    if names.iter().any(String::is_empty) {
        return Err(form());
    }
    let pair = |between: &str| {
        let (first, second) = numbers.split_once(between)?;
        Some((first.trim().parse::<f64>().ok()?, second.trim().parse::<f64>().ok()?))
    };
    let uniform = pair("..").map(|(low, high)| Object(Uniform { low, high }));
    let normal = pair("+-").map(|(mean, deviation)| Object(Normal { mean, deviation }));
    if uniform.is_none() && normal.is_none() {
        return Err(form());
    }
    Ok(Variation { of: Some(of.to_owned()), names, uniform, normal, ..Variation::default() })
}

/// Reads a list of variations.
pub(super) fn read(text: &str) -> anyhow::Result<Vec<Variation>> {
    ensure!(!text.trim().is_empty(), "it is empty; it must be a list of variations");
    let all: Vec<Object<Variation>> = from_json(text)?;
    Ok(all.into_iter().map(|Object(of)| of).collect())
}

/// Makes the requests, for this robot if variations name none.
pub(super) fn requests(all: Vec<Variation>, robot: &str) -> anyhow::Result<Vec<RolloutVariation>> {
    let request = |(index, of): (usize, Variation)| of.request(robot).with_context(|| place(index));
    all.into_iter().enumerate().map(request).collect()
}

fn place(index: usize) -> String {
    format!("variation {index}")
}

impl Variation {
    fn request(self, robot: &str) -> anyhow::Result<RolloutVariation> {
        let Some(of) = &self.of else { bail!("it has no `of`, the quantity that varies: {}", words()) };
        let of = varied(of).map_err(anyhow::Error::msg)?;
        let values = match (self.given, self.uniform, self.normal) {
            (Some(rows), None, None) => Values::Given(packed(&flat(&rows)?)),
            (None, Some(Object(Uniform { low, high })), None) => {
                Values::Uniform(RolloutUniform { low, high })
            }
            (None, None, Some(Object(Normal { mean, deviation }))) => {
                Values::Normal(RolloutNormal { mean, deviation })
            }
            (None, None, None) => bail!("it must have one of `given`, `uniform` and `normal`"),
            _ => bail!("it has more than one of `given`, `uniform` and `normal`"),
        };
        let is_wrench = of == RolloutVaried::Wrench;
        Ok(RolloutVariation {
            of: of.into(),
            robot: self.robot.unwrap_or_else(|| robot.to_owned()),
            names: self.names,
            wrench_step: self.wrench_step,
            wrench_steps: self.wrench_steps.unwrap_or(u32::from(is_wrench)),
            values: Some(values),
        })
    }
}

/// Returns all rows, which must have the same length.
fn flat(rows: &[Vec<f64>]) -> anyhow::Result<Vec<f64>> {
    let width = rows.first().map_or(0, Vec::len);
    if let Some(copy) = rows.iter().position(|row| row.len() != width) {
        bail!("copy {copy} has not as many numbers as copy 0");
    }
    ensure!(width > 0, "`given` has no numbers");
    Ok(rows.concat())
}

/// Parses a varied quantity: `link-masses`, or `link_masses` as in the schema.
fn varied(word: &str) -> Result<RolloutVaried, String> {
    let on_wire = format!("ROLLOUT_VARIED_{}", word.replace('-', "_").to_ascii_uppercase());
    let known = RolloutVaried::from_str_name(&on_wire).filter(|of| *of != RolloutVaried::Unspecified);
    known.ok_or_else(|| format!("`{word}` is nothing that can vary: {}", words()))
}

/// Returns all words for arguments.
fn words() -> String {
    let known = (1..).map_while(|number| RolloutVaried::try_from(number).ok());
    known.map(word).collect::<Vec<_>>().join(", ")
}

/// Returns its word for arguments.
pub(super) fn word(of: RolloutVaried) -> String {
    of.as_str_name().trim_start_matches("ROLLOUT_VARIED_").replace('_', "-").to_ascii_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typed_variations_equal_those_of_a_document() {
        for (typed, document) in [
            (
                "link-masses=0.8..1.2",
                r#"{"of": "link_masses", "robot": "arm", "uniform": {"low": 0.8, "high": 1.2}}"#,
            ),
            (
                "joint-positions:elbow, left wrist=-0.1+-2e-2",
                r#"{"of": "joint_positions", "names": ["elbow", "left wrist"], "normal": {"mean": -0.1, "deviation": 0.02}}"#,
            ),
        ] {
            let [typed, read] = [vec![parse(typed).unwrap()], read(&format!("[{document}]")).unwrap()];
            assert_eq!(requests(typed, "arm").unwrap(), requests(read, "arm").unwrap());
        }
        let given = read(r#"[{"of": "gains", "given": [[1, 2], [3, 4]]}]"#).unwrap();
        let request = requests(given, "arm").unwrap().remove(0);
        assert_eq!(request.values, Some(Values::Given(packed(&[1.0, 2.0, 3.0, 4.0]))));
        let wrench = read(r#"[{"of": "wrench", "names": ["hand"], "uniform": {"low": -1, "high": 1}}]"#);
        assert_eq!(requests(wrench.unwrap(), "arm").unwrap()[0].wrench_steps, 1);
    }

    #[test]
    fn faults_are_named() {
        for (text, part) in [
            ("mass=0..1", "`mass` is nothing that can vary: joint-positions, "),
            ("unspecified=0..1", "is nothing that can vary"),
            ("wrench:hand=0..1", "--variations"),
            ("gains", "LOW..HIGH"),
            ("gains=1", "LOW..HIGH"),
            ("gains=low..high", "LOW..HIGH"),
            ("gains:=0..1", "LOW..HIGH"),
        ] {
            let said = parse(text).unwrap_err();
            assert!(said.contains(part), "{text}: {said}");
        }
        let said = |text: &str| match read(text).and_then(|all| requests(all, "arm")) {
            Ok(found) => panic!("{text}: {found:?}"),
            Err(error) => format!("{error:#}"),
        };
        for (text, part) in [
            (r#"[{"of": "gains"}]"#, "variation 0: it must have one of"),
            (r#"[{"uniform": {"low": 1, "high": 2}}]"#, "variation 0: it has no `of`"),
            (r#"[{"of": "gains", "given": [[1]], "uniform": {"low": 1, "high": 2}}]"#, "more than one of"),
            (r#"[{"of": "gains", "given": [[1, 2], [3]]}]"#, "copy 1"),
            (r#"[{"of": "gains", "given": []}]"#, "no numbers"),
            (r#"[{"of": "gains", "seed": 1}]"#, "unknown field `seed`"),
            (r#"{"of": "gains"}"#, "expected a sequence"),
            (r#"[{"of": "gains", "uniform": [1]}]"#, "sequence, expected an object at line 1"),
            (r#"[{"of": "gains", "uniform": [1, 2]}]"#, "sequence, expected an object at line 1"),
            (r#"[{"of": "gains", "normal": [1, 0.1]}]"#, "sequence, expected an object at line 1"),
            ("[\n[\"gains\"]]", "sequence, expected an object at line 2"),
            (r#"[{"of": "wrench", "wrench_steps": -1}]"#, "expected a whole number from 0"),
        ] {
            assert!(said(text).contains(part), "{text}: {}", said(text));
        }
    }
}

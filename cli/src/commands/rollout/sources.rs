//! Maps fields of a request to their sources. The daemon names fields by the schema and by their place in the
//! request. Users look for them in a document, or on the command line.

use std::path::Path;

use simd_client::{
    Error, Refusal,
    proto::{RolloutCost, RolloutRequest, RolloutVariation, rollout_cost::Term, rollout_variation::Values},
};

use super::{Rollout, variations};

/// Names of fields by list or term: the daemon's name, and the name in the source. Other fields have the same
/// name.
const NAMES: [(&str, &str, &str); 9] = [
    ("controls", "values", "targets"),
    ("quantities", "names", "joints"),
    ("variations", "values", "given"),
    ("variations", "uniform[0]", "low"),
    ("variations", "uniform[1]", "high"),
    ("variations", "normal[0]", "mean"),
    ("variations", "normal[1]", "deviation"),
    ("link_position", "target", "position"),
    ("link_orientation", "target", "orientation"),
];

/// Lists of a request, with the source of each entry.
#[derive(Debug)]
pub(super) struct Sources([(&'static str, Vec<Source>); 4]);

#[derive(Debug)]
struct Source {
    /// A file with the place in it, or an option.
    name: String,
    /// Key of its names in the table.
    of: &'static str,
    /// Numbers or lists in each inner list; the daemon counts their numbers consecutively.
    inner: Vec<usize>,
    /// Meaning of the lists' indices.
    indices: &'static str,
}

impl Sources {
    pub(super) fn of(arguments: &Rollout, request: &RolloutRequest) -> Self {
        let Rollout { file, goal, effort_weight, costs, vary, variations, .. } = arguments;
        let targets = |of, inner, indices| Source { name: file.display().to_string(), of, inner, indices };
        let controls = request.controls.iter().map(|control| {
            let inner = vec![control.knots as usize, control.joints.len()];
            targets("controls", inner, "copy, knot, joint")
        });
        let quantities = request.quantities.iter().map(|_| targets("quantities", Vec::new(), ""));
        // In the order of the request.
        let options = [("--goal", !goal.is_empty()), ("--effort-weight", *effort_weight != 0.0)];
        let options: Vec<&str> =
            options.into_iter().filter(|(_, is_given)| *is_given).map(|(option, _)| option).collect();
        let cost = |(index, cost): (usize, &RolloutCost)| Source {
            name: match options.get(index) {
                Some(option) => (*option).to_owned(),
                None => entry(costs.as_deref(), "term", index - options.len()),
            },
            of: term(cost),
            inner: Vec::new(),
            indices: "",
        };
        let variation = |(index, variation): (usize, &RolloutVariation)| Source {
            name: match index.checked_sub(vary.len()) {
                Some(index) => entry(variations.as_deref(), "variation", index),
                None => format!("--vary {}", variations::word(variation.of())),
            },
            of: "variations",
            inner: match &variation.values {
                Some(Values::Given(bytes)) => {
                    vec![bytes.len() / size_of::<f64>() / (request.copies as usize).max(1)]
                }
                _ => Vec::new(),
            },
            indices: "copy, number",
        };
        Self([
            ("controls", controls.collect()),
            ("quantities", quantities.collect()),
            ("costs", request.costs.iter().enumerate().map(cost).collect()),
            ("variations", request.variations.iter().enumerate().map(variation).collect()),
        ])
    }

    /// Renames the field of an error to its source.
    pub(super) fn explain(&self, error: Error) -> Error {
        match error {
            Error::Refused(refusal) => Error::Refused(self.reworded(refusal)),
            error => error,
        }
    }

    fn reworded(&self, mut refusal: Refusal) -> Refusal {
        let said = refusal.fields.first().and_then(|(field, _)| {
            let rest = refusal.message.strip_prefix(field.as_str())?;
            Some(format!("{}{rest}", self.written(field)?))
        });
        if let Some(said) = said {
            refusal.message = said;
        }
        refusal
    }

    /// Returns the source of a field; `None` if it is in no list.
    fn written(&self, field: &str) -> Option<String> {
        let (list, rest) = field.split_once('[')?;
        let (index, path) = rest.split_once("].")?;
        // The robot of the targets is an argument, and not in their file: the usage has its name.
        if matches!((list, path), ("controls" | "quantities", "robot")) {
            return Some("ROBOT".to_owned());
        }
        let (_, sources) = self.0.iter().find(|(known, _)| *known == list)?;
        let source = sources.get(index.parse::<usize>().ok()?)?;
        Some(format!("{}: {}", source.name, source.field(path)))
    }
}

impl Source {
    fn field(&self, path: &str) -> String {
        // A term has one kind, and numbers are drawn in one way: the last name suffices.
        let name = path.rsplit('.').next().unwrap_or(path);
        let renamed = NAMES.iter().find_map(|(of, theirs, own)| {
            let rest = name.strip_prefix(*theirs).filter(|_| *of == self.of)?;
            Some(format!("{own}{}", self.nested(rest)))
        });
        renamed.unwrap_or_else(|| name.to_owned())
    }

    /// Converts a consecutive index to indices of nested lists.
    fn nested(&self, index: &str) -> String {
        let number = index.strip_prefix('[').and_then(|index| index.strip_suffix(']')?.parse::<usize>().ok());
        let Some(mut left) = number.filter(|_| !self.inner.is_empty() && !self.inner.contains(&0)) else {
            return index.to_owned();
        };
        let mut written = String::new();
        for length in self.inner.iter().rev() {
            written.insert_str(0, &format!("[{}]", left % length));
            left /= length;
        }
        format!("[{left}]{written} ({})", self.indices)
    }
}

/// Returns the place of an entry in a document.
fn entry(file: Option<&Path>, what: &str, index: usize) -> String {
    format!("{}: {what} {index}", file.unwrap_or(Path::new("")).display())
}

/// Returns the key of a term's names.
fn term(cost: &RolloutCost) -> &'static str {
    match &cost.term {
        Some(Term::LinkPosition(_)) => "link_position",
        Some(Term::LinkOrientation(_)) => "link_orientation",
        _ => "costs",
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;
    use simd_client::{
        Code, packed,
        proto::{
            ErrorReason, RolloutContactTerm, RolloutControl, RolloutJointTerm, RolloutLinkTerm,
            RolloutQuantity, RolloutVaried,
        },
    };

    use super::*;
    use crate::commands::{Arguments, Command};

    /// Returns the sources of a rollout with two options of each kind, and documents in addition.
    fn sources() -> Sources {
        let line = "simctl rollout arm tried.csv --goal elbow=1 --effort-weight 1 --costs costs.json \
                    --vary gains=0..1 --variations varied.json --copies 2";
        let parsed = Arguments::try_parse_from(line.split_whitespace()).unwrap();
        let Command::Rollout(arguments) = parsed.command else { unreachable!() };
        let term = |term| RolloutCost { weight: 1.0, term: Some(term), ..RolloutCost::default() };
        let control = RolloutControl {
            joints: vec!["shoulder".to_owned(), "elbow".to_owned()],
            knots: 3,
            ..RolloutControl::default()
        };
        let quantity = RolloutQuantity::default();
        let varied = |of: RolloutVaried, values| RolloutVariation {
            of: of.into(),
            values,
            ..RolloutVariation::default()
        };
        let request = RolloutRequest {
            copies: 2,
            controls: vec![control],
            quantities: vec![quantity],
            costs: vec![
                term(Term::JointPositions(RolloutJointTerm::default())),
                term(Term::JointEfforts(RolloutJointTerm::default())),
                term(Term::ContactForce(RolloutContactTerm::default())),
                term(Term::LinkPosition(RolloutLinkTerm::default())),
            ],
            variations: vec![
                varied(RolloutVaried::Gains, None),
                varied(RolloutVaried::LinkMasses, Some(Values::Given(packed(&[1.0; 6])))),
            ],
            ..RolloutRequest::default()
        };
        Sources::of(&arguments, &request)
    }

    #[test]
    fn a_field_is_named_as_it_was_written() {
        let sources = sources();
        for (field, written) in [
            ("controls[0].values", "tried.csv: targets"),
            ("controls[0].values[9]", "tried.csv: targets[1][1][1] (copy, knot, joint)"),
            ("controls[0].joints[1]", "tried.csv: joints[1]"),
            ("controls[0].robot", "ROBOT"),
            ("quantities[0].robot", "ROBOT"),
            ("quantities[0].names[1]", "tried.csv: joints[1]"),
            ("costs[0].targets[0]", "--goal: targets[0]"),
            ("costs[1].weight", "--effort-weight: weight"),
            ("costs[0].joints[0]", "--goal: joints[0]"),
            ("costs[2].contact_force.links[0]", "costs.json: term 0: links[0]"),
            ("costs[2].links[0]", "costs.json: term 0: links[0]"),
            ("costs[2].robot", "costs.json: term 0: robot"),
            ("costs[3].link", "costs.json: term 1: link"),
            ("costs[3].final_weight", "costs.json: term 1: final_weight"),
            ("costs[3].target[2]", "costs.json: term 1: position[2]"),
            ("variations[0].names[0]", "--vary gains: names[0]"),
            ("variations[0].uniform.low", "--vary gains: low"),
            ("variations[0].uniform[1]", "--vary gains: high"),
            ("variations[1].values", "varied.json: variation 0: given"),
            ("variations[1].values[4]", "varied.json: variation 0: given[1][1] (copy, number)"),
        ] {
            assert_eq!(sources.written(field).as_deref(), Some(written), "{field}");
        }
        for field in ["steps", "costs[9].weight", "starts[0].roots", "costs[]"] {
            assert_eq!(sources.written(field), None, "{field}");
        }
    }

    #[test]
    fn a_refusal_keeps_its_code_and_what_it_says_beside_the_field() {
        let refused = |field: &str, message: &str| {
            let refusal = Refusal {
                code: Code::InvalidArgument,
                reason: ErrorReason::InvalidValue,
                message: message.to_owned(),
                metadata: std::collections::BTreeMap::default(),
                fields: vec![(field.to_owned(), String::new())],
            };
            let error = sources().explain(Error::Refused(refusal));
            assert_eq!(error.code(), Some(Code::InvalidArgument));
            error.to_string()
        };
        assert_eq!(
            refused("costs[3].target[2]", "costs[3].target[2] is 1e300; it must be less"),
            "costs.json: term 1: position[2] is 1e300; it must be less"
        );
        assert_eq!(
            refused("costs[2].links[0]", "costs[2].links[0]: robot \"arm\" has no link \"hook\""),
            "costs.json: term 0: links[0]: robot \"arm\" has no link \"hook\""
        );
        assert_eq!(
            refused("quantities[0].robot", "quantities[0].robot: there is no robot \"leg\" in this world"),
            "ROBOT: there is no robot \"leg\" in this world"
        );
        // Fields outside of the request's lists, and sentences that do not begin with their field.
        for said in ["steps is 0; it must be at least 1", "a target is NaN"] {
            assert_eq!(refused("steps", said), said);
        }
    }
}

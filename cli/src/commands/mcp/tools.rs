//! The table of tools. Each tool is a command of simctl, and its parameters are the words after it.

use std::sync::Arc;

use anyhow::{Context as _, bail};
use rmcp::model::{JsonObject, ToolAnnotations};
use serde_json::{Value, json};

/// A tool of an agent.
pub(super) struct Tool {
    pub(super) name: &'static str,
    says: &'static str,
    pub(super) command: &'static [&'static str],
    parameters: &'static [Parameter],
    /// Whether it changes nothing.
    pub(super) reads: bool,
    /// Whether its answer is a picture.
    pub(super) draws: bool,
}

/// A parameter: an option of the command if it has one, else words after it.
struct Parameter {
    name: &'static str,
    says: &'static str,
    kind: Kind,
    option: Option<&'static str>,
    is_required: bool,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Text,
    Number,
    Count,
    Switch,
    Texts,
    /// Numbers or texts by name: words `NAME=VALUE`.
    Values,
}

const fn needed(name: &'static str, kind: Kind, says: &'static str) -> Parameter {
    Parameter { name, says, kind, option: None, is_required: true }
}

const fn possible(name: &'static str, kind: Kind, says: &'static str) -> Parameter {
    Parameter { name, says, kind, option: None, is_required: false }
}

const fn option(name: &'static str, option: &'static str, kind: Kind, says: &'static str) -> Parameter {
    Parameter { name, says, kind, option: Some(option), is_required: false }
}

const ROBOT: Parameter = needed("robot", Kind::Text, "name of the robot");
const ONE_ROBOT: Parameter = possible("robot", Kind::Text, "only this robot");
const JOINTS: Parameter = possible("joints", Kind::Texts, "names of joints; all that can move if left out");
const NAME: Parameter = option("name", "--name", Kind::Text, "name in the world");
const POSE: Parameter =
    option("pose", "--pose", Kind::Text, "`x,y,z` or `x,y,z,roll,pitch,yaw`; metres, radians");
const FIXED: Parameter = option("fixed", "--fixed", Kind::Switch, "fix the root link to the world");
const BESIDE: Parameter =
    option("beside", "--beside", Kind::Switch, "stand beside all others, and on the ground");

const fn reads(
    name: &'static str,
    command: &'static [&'static str],
    parameters: &'static [Parameter],
    says: &'static str,
) -> Tool {
    Tool { name, says, command, parameters, reads: true, draws: false }
}

const fn changes(
    name: &'static str,
    command: &'static [&'static str],
    parameters: &'static [Parameter],
    says: &'static str,
) -> Tool {
    Tool { name, says, command, parameters, reads: false, draws: false }
}

pub(super) const TOOLS: &[Tool] = &[
    reads(
        "world_status",
        &["sim", "status"],
        &[],
        "State of the world: playing or paused, simulated time, speed",
    ),
    reads("list_robots", &["robot", "list"], &[], "Robots in the world, with their poses"),
    reads("describe_robot", &["robot", "info"], &[ROBOT], "One robot: base, mass, pose, links"),
    reads("list_joints", &["joint", "list"], &[ROBOT], "Joints of a robot: type, axis, limits, mode"),
    reads(
        "joint_states",
        &["joint", "get"],
        &[ROBOT, JOINTS],
        "Positions, velocities, efforts and targets of joints",
    ),
    reads(
        "link_poses",
        &["robot", "links"],
        &[ROBOT],
        "Poses and velocities of a robot's links in the world",
    ),
    reads("contacts", &["contact", "list"], &[ONE_ROBOT], "Contacts of links: point, depth, force"),
    reads("list_sensors", &["sensor", "list"], &[ONE_ROBOT], "Sensors, their places, and samples a second"),
    reads(
        "read_sensors",
        &["sensor", "read"],
        &[ROBOT, possible("sensors", Kind::Texts, "names of its sensors; all if left out")],
        "Newest readings of sensors",
    ),
    Tool {
        draws: true,
        ..reads(
            "camera_picture",
            &["camera", "view"],
            &[ROBOT, possible("camera", Kind::Text, "name of the camera, if the robot has several")],
            "Picture of a robot's camera. Needs a running `simd-camera`",
        )
    },
    reads(
        "inverse_kinematics",
        &["robot", "ik"],
        &[
            ROBOT,
            needed("link", Kind::Text, "name of the link"),
            needed(
                "pose",
                Kind::Text,
                "pose that the link's frame is to reach, `x,y,z` or `x,y,z,roll,pitch,yaw`",
            ),
        ],
        "Joint positions at which a link reaches a pose. Nothing moves",
    ),
    reads(
        "check_description",
        &["robot", "validate"],
        &[PATH],
        "Report about a robot's file, without loading it",
    ),
    changes(
        "load_robot",
        &["robot", "load"],
        &[PATH, NAME, POSE, FIXED, BESIDE],
        "Load a robot from this disk into the world: a URDF, xacro, SDF or MJCF file, or a package folder",
    ),
    changes(
        "add_shape",
        &["robot", "shape"],
        &[
            needed(
                "shape",
                Kind::Text,
                "plane, box:X,Y,Z, sphere:RADIUS, cylinder:RADIUS,LENGTH or capsule:RADIUS,LENGTH; metres",
            ),
            NAME,
            option("mass", "--mass", Kind::Number, "kilograms"),
            POSE,
            FIXED,
            BESIDE,
        ],
        "Add a single shape: ground, a box to push",
    ),
    changes("delete_robot", &["robot", "delete"], &[ROBOT], "Delete a robot"),
    changes(
        "set_joint_targets",
        &["joint", "set"],
        &[
            ROBOT,
            needed(
                "targets",
                Kind::Values,
                "target by joint: a position in rad or m, or a text such as `90deg`, `vel:0.5`, `eff:2`, `hold`, `passive`",
            ),
            option(
                "wait",
                "--wait",
                Kind::Number,
                "wait until positions are reached, at most this many simulated seconds",
            ),
        ],
        "Set targets of joints, all at one step. With `wait` the answer has the reached positions",
    ),
    changes("play", &["sim", "play"], &[], "Let time run"),
    changes("pause", &["sim", "pause"], &[], "Stop time"),
    changes(
        "step",
        &["sim", "step"],
        &[possible("steps", Kind::Count, "number of steps; 1 if left out")],
        "Do steps of a paused world",
    ),
    changes("reset", &["sim", "reset"], &[], "Set time to zero and robots to their states at loading"),
    changes(
        "start_recording",
        &["record", "start"],
        &[possible("name", Kind::Text, "name of the recording")],
        "Record commands and states into a file of the daemon",
    ),
    changes("stop_recording", &["record", "stop"], &[], "End the recording"),
];

const PATH: Parameter = needed("path", Kind::Text, "path of the file or the package folder on this machine");

impl Tool {
    /// Returns the tool as agents see it.
    pub(super) fn described(&self) -> rmcp::model::Tool {
        let properties: JsonObject =
            self.parameters.iter().map(|parameter| (parameter.name.to_owned(), parameter.schema())).collect();
        let required: Vec<&str> = self
            .parameters
            .iter()
            .filter(|parameter| parameter.is_required)
            .map(|parameter| parameter.name)
            .collect();
        let mut schema = JsonObject::new();
        schema.insert("type".to_owned(), json!("object"));
        schema.insert("properties".to_owned(), Value::Object(properties));
        schema.insert("required".to_owned(), json!(required));
        schema.insert("additionalProperties".to_owned(), json!(false));
        let mut annotations = ToolAnnotations::new();
        annotations.read_only_hint = Some(self.reads);
        annotations.destructive_hint = Some(matches!(self.name, "delete_robot" | "reset"));
        annotations.open_world_hint = Some(false);
        rmcp::model::Tool::new(self.name, self.says, Arc::new(schema)).with_annotations(annotations)
    }

    /// Returns the command of a call. A value is never read as an option.
    ///
    /// # Errors
    /// Returns a sentence about the first wrong argument.
    pub(super) fn words(&self, given: &JsonObject) -> anyhow::Result<Vec<String>> {
        let known = |name: &String| self.parameters.iter().any(|parameter| parameter.name == name);
        if let Some(unknown) = given.keys().find(|name| !known(name)) {
            let names: Vec<&str> = self.parameters.iter().map(|parameter| parameter.name).collect();
            bail!("{} has no parameter {unknown:?}; it has {}", self.name, names.join(", "));
        }
        let mut words: Vec<String> = self.command.iter().map(|word| (*word).to_owned()).collect();
        let mut values = vec!["--".to_owned()];
        for parameter in self.parameters {
            let value = given.get(parameter.name).filter(|value| !value.is_null());
            let Some(value) = value else {
                if parameter.is_required {
                    bail!("{} needs the parameter {}: {}", self.name, parameter.name, parameter.says);
                }
                continue;
            };
            let read = parameter.words(value).with_context(|| format!("the parameter {}", parameter.name))?;
            match parameter.option {
                None => values.extend(read),
                Some(option) if parameter.kind == Kind::Switch => {
                    words.extend(read.iter().map(|_| option.to_owned()))
                }
                Some(option) => words.extend(read.iter().map(|word| format!("{option}={word}"))),
            }
        }
        words.extend(values);
        Ok(words)
    }
}

impl Parameter {
    fn schema(&self) -> Value {
        let mut schema = match self.kind {
            Kind::Text => json!({ "type": "string" }),
            Kind::Number => json!({ "type": "number" }),
            Kind::Count => json!({ "type": "integer", "minimum": 1 }),
            Kind::Switch => json!({ "type": "boolean" }),
            Kind::Texts => json!({ "type": "array", "items": { "type": "string" } }),
            Kind::Values => {
                json!({ "type": "object", "additionalProperties": { "type": ["number", "string"] } })
            }
        };
        schema["description"] = json!(self.says);
        schema
    }

    /// Returns a value as words. A switch that is on is one empty word.
    fn words(&self, value: &Value) -> anyhow::Result<Vec<String>> {
        Ok(match (self.kind, value) {
            (Kind::Text, Value::String(text)) => vec![text.clone()],
            (Kind::Number, Value::Number(number)) => vec![number.to_string()],
            (Kind::Count, Value::Number(number)) if number.is_u64() => vec![number.to_string()],
            (Kind::Switch, Value::Bool(is_on)) => vec![String::new(); usize::from(*is_on)],
            (Kind::Texts, Value::Array(items)) => {
                let texts = items.iter().map(|item| item.as_str().map(str::to_owned));
                texts.collect::<Option<_>>().context("must be an array of strings")?
            }
            (Kind::Values, Value::Object(values)) => {
                let word = |(name, value): (&String, &Value)| match value {
                    Value::Number(number) => Ok(format!("{name}={number}")),
                    Value::String(text) => Ok(format!("{name}={text}")),
                    _ => bail!("the value of {name} must be a number or a string"),
                };
                values.iter().map(word).collect::<anyhow::Result<_>>()?
            }
            _ => bail!("must be {}", self.kind.noun()),
        })
    }
}

impl Kind {
    fn noun(self) -> &'static str {
        match self {
            Self::Text => "a string",
            Self::Number => "a number",
            Self::Count => "a whole number above 0",
            Self::Switch => "true or false",
            Self::Texts => "an array of strings",
            Self::Values => "an object of numbers or strings",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{commands::Arguments, typed};

    fn words(tool: &str, given: Value) -> anyhow::Result<Vec<String>> {
        let tool = TOOLS.iter().find(|known| known.name == tool).unwrap();
        tool.words(given.as_object().unwrap())
    }

    /// Returns a value that a parameter takes.
    fn sample(parameter: &Parameter) -> Value {
        match (parameter.name, parameter.kind) {
            ("pose", _) => json!("-1,0,0.5"),
            ("shape", _) => json!("box:1,1,1"),
            (_, Kind::Text) => json!("--robot"),
            (_, Kind::Number) => json!(2.5),
            (_, Kind::Count) => json!(3),
            (_, Kind::Switch) => json!(true),
            (_, Kind::Texts) => json!(["--a", "b"]),
            (_, Kind::Values) => json!({ "elbow": -0.5, "wrist": "90deg" }),
        }
    }

    #[test]
    fn each_tool_with_all_of_its_parameters_is_a_command_of_simctl() {
        for tool in TOOLS {
            let given = tool
                .parameters
                .iter()
                .map(|parameter| (parameter.name.to_owned(), sample(parameter)))
                .collect();
            let typed = std::iter::once("simctl".to_owned()).chain(tool.words(&given).unwrap());
            typed::command::<Arguments>(typed.map(Into::into).collect()).unwrap();
            let tool = tool.described();
            assert_eq!(tool.input_schema["properties"].as_object().unwrap().len(), given.len());
        }
    }

    #[test]
    fn the_page_about_agents_has_each_tool_with_its_parameters() {
        let page =
            std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/agents.md")).unwrap();
        let rows: Vec<&str> = page.lines().filter(|line| line.starts_with("| `")).collect();
        let row = |tool: &Tool| {
            let names: Vec<String> =
                tool.parameters.iter().map(|parameter| format!("`{}` ", parameter.name)).collect();
            let names = names.join(", ").replace(" ,", ",");
            format!("| `{}` | {names}| {}|", tool.name, if tool.reads { "" } else { "yes " })
        };
        assert_eq!(rows, TOOLS.iter().map(row).collect::<Vec<_>>());
    }

    #[test]
    fn wrong_arguments_are_named() {
        for (tool, given, part) in [
            ("joint_states", json!({}), "needs the parameter robot"),
            ("joint_states", json!({ "robot": 1 }), "robot: must be a string"),
            (
                "joint_states",
                json!({ "robot": "arm", "token-file": "a" }),
                "no parameter \"token-file\"; it has robot, joints",
            ),
            ("step", json!({ "steps": -1 }), "must be a whole number above 0"),
            (
                "set_joint_targets",
                json!({ "robot": "arm", "targets": { "elbow": [1] } }),
                "the value of elbow must be",
            ),
        ] {
            let said = format!("{:#}", words(tool, given).unwrap_err());
            assert!(said.contains(part), "{said}");
        }
    }

    #[test]
    fn a_value_that_looks_like_an_option_is_a_value() {
        let given = json!({ "path": "--token-file=secret", "name": "--claim", "beside": false });
        let words = words("load_robot", given).unwrap();
        assert_eq!(words, ["robot", "load", "--name=--claim", "--", "--token-file=secret"]);
    }
}

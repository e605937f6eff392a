//! Output of sliders and buttons.

use serde::Serialize;
use simd_client::proto::{JointMode, Parameter, ParameterList, parameter::Kind};

use crate::{
    commands::present,
    output::{
        View,
        json::Stamp,
        number::{ABSENT, count, exact, fixed},
        table::{Column, Page, Table},
    },
};

/// `parameter add`, and an item of `parameter list`.
#[derive(Serialize)]
pub(super) struct ParameterView {
    name: String,
    /// `slider` or `button`.
    kind: &'static str,
    /// Present for a slider.
    minimum: Option<f64>,
    maximum: Option<f64>,
    value: Option<f64>,
    /// Present for a bound slider: `ROBOT/JOINT`, and the meaning of the value.
    joint: Option<String>,
    mode: Option<&'static str>,
    /// Present for a button.
    presses: Option<u64>,
    version: u64,
    /// Owner of the parameter.
    owner: String,
}

impl From<Parameter> for ParameterView {
    fn from(parameter: Parameter) -> Self {
        let Parameter { name, kind, version, owner, joint } = parameter;
        let mode = joint.as_ref().map(|joint| match joint.mode() {
            JointMode::Velocity => "velocity",
            JointMode::Effort => "effort",
            _ => "position",
        });
        let joint = joint.map(|joint| format!("{}/{}", joint.robot, joint.joint));
        let empty = Self {
            name,
            kind: "unknown",
            minimum: None,
            maximum: None,
            value: None,
            joint,
            mode,
            presses: None,
            version,
            owner,
        };
        match kind {
            Some(Kind::Slider(slider)) => Self {
                kind: "slider",
                minimum: Some(slider.minimum),
                maximum: Some(slider.maximum),
                value: Some(slider.value),
                ..empty
            },
            Some(Kind::Button(button)) => Self { kind: "button", presses: Some(button.presses), ..empty },
            // A newer daemon may have kinds that this client does not know.
            None => empty,
        }
    }
}

impl ParameterView {
    /// Returns its value for people.
    fn state(&self) -> String {
        match (self.value, self.presses) {
            (Some(value), _) => exact(value),
            (None, Some(presses)) => format!("pressed {}", count_of(presses, "time")),
            (None, None) => ABSENT.to_owned(),
        }
    }
}

impl View for ParameterView {
    fn page(&self) -> Page {
        let bound = match (&self.joint, self.mode) {
            (Some(joint), Some(mode)) => format!(", the {mode} of {joint}"),
            _ => String::new(),
        };
        let range = match (self.minimum, self.maximum) {
            (Some(minimum), Some(maximum)) => {
                format!(" from {} to {}, at {}", exact(minimum), exact(maximum), self.state())
            }
            _ => String::new(),
        };
        Page::of_line(format!("added {} {}{range}{bound}", self.kind, self.name))
    }
}

/// Returns the table of `parameter list`, `get`, `set` and `press`.
pub(super) fn list(parameters: &[ParameterView]) -> Page {
    let columns = vec![
        Column::left("PARAMETER"),
        Column::left("KIND"),
        Column::right("VALUE"),
        Column::right("MINIMUM"),
        Column::right("MAXIMUM"),
        Column::right("PRESSES"),
        Column::left("JOINT"),
        Column::left("OWNER"),
    ];
    let number = |value: Option<f64>| value.map_or_else(|| ABSENT.to_owned(), exact);
    let row = |parameter: &ParameterView| {
        vec![
            parameter.name.clone(),
            parameter.kind.to_owned(),
            number(parameter.value),
            number(parameter.minimum),
            number(parameter.maximum),
            parameter.presses.map_or_else(|| ABSENT.to_owned(), |presses| presses.to_string()),
            parameter.joint.clone().unwrap_or_else(|| ABSENT.to_owned()),
            parameter.owner.clone(),
        ]
    };
    Page::new().table(Table::new(columns, parameters.iter().map(row).collect()))
}

/// A line of `parameter watch` in JSON; for people, a line for each change.
#[derive(Serialize)]
pub(super) struct ListView {
    version: u64,
    stamp: Stamp,
    parameters: Vec<ParameterView>,
    /// Parameters that were removed since the last list.
    removed: Vec<String>,
    /// Version of the last shown list.
    #[serde(skip)]
    seen: u64,
}

impl ListView {
    pub(super) fn new(list: ParameterList, seen: u64, removed: Vec<String>) -> anyhow::Result<Self> {
        Ok(Self {
            version: list.version,
            stamp: present(list.stamp, "stamp")?.into(),
            parameters: list.parameters.into_iter().map(ParameterView::from).collect(),
            removed,
            seen,
        })
    }
}

impl View for ListView {
    fn page(&self) -> Page {
        let time = fixed(self.stamp.sim_time, 3);
        let changed = self.parameters.iter().filter(|parameter| parameter.version > self.seen);
        let changed = changed.map(|parameter| format!("{}  {}", parameter.name, parameter.state()));
        let removed = self.removed.iter().map(|name| format!("{name}  removed"));
        let mut lines: Vec<String> = changed.chain(removed).collect();
        if lines.is_empty() {
            lines.push("there are no parameters".to_owned());
        }
        lines.iter().fold(Page::new(), |page, line| page.line(format!("{time:>10} s  {line}")))
    }
}

/// `parameter remove`.
#[derive(Serialize)]
pub(super) struct Removed {
    pub(super) removed: Vec<String>,
}

impl View for Removed {
    fn page(&self) -> Page {
        match self.removed.as_slice() {
            [] => Page::of_line("there were no parameters"),
            names => Page::of_line(format!("removed {}", names.join(", "))),
        }
    }
}

fn count_of(number: u64, noun: &str) -> String {
    count(usize::try_from(number).unwrap_or(usize::MAX), noun)
}

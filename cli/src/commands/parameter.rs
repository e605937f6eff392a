//! `simctl parameter`: sliders and buttons that programs add and people move.

mod view;

use std::collections::BTreeSet;

use clap::{Args, Subcommand, ValueEnum};
use simd_client::{
    Client, press,
    proto::{JointBinding, JointMode, NameTakenPolicy, ParameterChange},
    slide,
};

use super::{ended, taking_over};
use crate::{complete, output::Output};
use view::{ListView, ParameterView, Removed};

#[derive(Debug, Subcommand)]
pub(crate) enum Parameter {
    /// Shows the sliders and buttons, in the order in which they were added
    List,
    /// Shows some sliders and buttons
    Get {
        /// Names of the sliders and buttons
        #[arg(required = true, value_name = "NAME", add = complete::parameters())]
        names: Vec<String>,
    },
    /// Adds a slider or a button
    Add(Add),
    /// Moves sliders, all of them or none
    Set {
        /// New value of each slider
        #[arg(required = true, value_name = "NAME=VALUE", value_parser = assignment)]
        changes: Vec<ParameterChange>,
    },
    /// Presses a button
    Press {
        /// Name of the button
        #[arg(add = complete::parameters())]
        name: String,
        /// Number of presses
        #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..), value_name = "N")]
        times: u64,
    },
    /// Shows the sliders and buttons, and their changes, until Ctrl-C
    Watch {
        /// End after this number of outputs
        #[arg(short, long, value_name = "N")]
        count: Option<u64>,
    },
    /// Removes sliders and buttons
    Remove {
        /// Names of the sliders and buttons
        #[arg(required_unless_present = "all", conflicts_with = "all", value_name = "NAME", add = complete::parameters())]
        names: Vec<String>,
        /// Remove all parameters except those of other owners
        #[arg(long)]
        all: bool,
        /// Also remove parameters of other owners: for admins
        #[arg(long)]
        take_over: bool,
    },
}

#[derive(Args, Debug)]
pub(crate) struct Add {
    /// Name for people, 1 to 256 bytes
    name: String,
    /// Minimum of a slider
    #[arg(default_value_t = 0.0, allow_hyphen_values = true)]
    minimum: f64,
    /// Maximum of a slider
    #[arg(default_value_t = 1.0, allow_hyphen_values = true)]
    maximum: f64,
    /// Initial value of a slider; 0 or the nearest value if left out
    #[arg(default_value_t = 0.0, hide_default_value = true, allow_hyphen_values = true)]
    value: f64,
    /// Joint whose target the slider sets at each move
    #[arg(long, value_name = "ROBOT/JOINT", value_parser = joint, conflicts_with = "button")]
    joint: Option<JointBinding>,
    /// Meaning of the slider's value for that joint
    #[arg(long, value_enum, default_value_t = Mode::Position, requires = "joint")]
    mode: Mode,
    /// Add a button instead of a slider
    #[arg(long, conflicts_with_all = ["minimum", "maximum", "value"])]
    button: bool,
    /// Replace a parameter of that name
    #[arg(long)]
    replace: bool,
    /// Add _1, _2, ... to a name that is taken
    #[arg(long, conflicts_with = "replace")]
    rename: bool,
    /// Also replace a parameter of another owner: for admins
    #[arg(long, requires = "replace")]
    take_over: bool,
}

/// Meaning of a slider's value for a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Mode {
    /// rad or m
    Position,
    /// rad/s or m/s
    Velocity,
    /// N m or N
    Effort,
}

pub(crate) async fn run(command: Parameter, client: &Client, output: Output) -> anyhow::Result<()> {
    match command {
        Parameter::List => show(client, output, Vec::new()).await,
        Parameter::Get { names } => show(client, output, names).await,
        Parameter::Add(arguments) => add(arguments, client, output).await,
        Parameter::Set { changes } => set(client, output, changes).await,
        Parameter::Press { name, times } => set(client, output, vec![press(name, times)]).await,
        Parameter::Watch { count } => {
            tokio::select! {
                done = watch(client, output, count) => done,
                _ = tokio::signal::ctrl_c() => Ok(()),
            }
        }
        // No names means all of them: clap requires one of the two.
        Parameter::Remove { names, all: _, take_over } => {
            let removed = taking_over(client, take_over).remove_parameters(names).await?;
            output.one(&Removed { removed })
        }
    }
}

async fn show(client: &Client, output: Output, names: Vec<String>) -> anyhow::Result<()> {
    let list = client.parameters(names).await?;
    write(output, list.parameters)
}

async fn add(arguments: Add, client: &Client, output: Output) -> anyhow::Result<()> {
    let Add { name, minimum, maximum, value, joint, mode, button, replace, rename, take_over } = arguments;
    let client = &taking_over(client, take_over);
    let name_taken = match (replace, rename) {
        (true, _) => NameTakenPolicy::Replace,
        (_, true) => NameTakenPolicy::Rename,
        _ => NameTakenPolicy::Refuse,
    };
    let added = if button {
        client.add_button(&name, name_taken).await?
    } else if let Some(joint) = joint {
        let mode = match mode {
            Mode::Position => JointMode::Position,
            Mode::Velocity => JointMode::Velocity,
            Mode::Effort => JointMode::Effort,
        };
        let joint = JointBinding { mode: mode.into(), ..joint };
        client.add_bound_slider(&name, (minimum, maximum), value, joint, name_taken).await?
    } else {
        client.add_slider(&name, (minimum, maximum), value, name_taken).await?
    };
    output.one(&ParameterView::from(added))
}

async fn set(client: &Client, output: Output, changes: Vec<ParameterChange>) -> anyhow::Result<()> {
    write(output, client.set_parameters(changes).await?)
}

fn write(output: Output, parameters: Vec<simd_client::proto::Parameter>) -> anyhow::Result<()> {
    let parameters: Vec<ParameterView> = parameters.into_iter().map(ParameterView::from).collect();
    output.list(&parameters, view::list)
}

async fn watch(client: &Client, output: Output, limit: Option<u64>) -> anyhow::Result<()> {
    let mut lists = client.watch_parameters().await?;
    let (mut seen, mut known) = (0, BTreeSet::new());
    let mut shown = 0;
    while limit.is_none_or(|limit| shown < limit) {
        let list = lists.next().await?.ok_or_else(|| ended(client))?;
        let names = list.parameters.iter().map(|it| it.name.clone()).collect();
        let gone = known.difference(&names).cloned().collect();
        let version = list.version;
        output.item(&ListView::new(list, seen, gone)?)?;
        (seen, known) = (version, names);
        shown += 1;
    }
    Ok(())
}

/// Parses `ROBOT/JOINT`; names of robots have no slash.
fn joint(text: &str) -> Result<JointBinding, String> {
    let (robot, joint) = text.split_once('/').ok_or("must be ROBOT/JOINT")?;
    if robot.is_empty() || joint.is_empty() {
        return Err("must be ROBOT/JOINT".to_owned());
    }
    Ok(JointBinding { robot: robot.to_owned(), joint: joint.to_owned(), ..JointBinding::default() })
}

/// Parses `NAME=VALUE`. The last `=` counts: a name may contain one, a number cannot.
fn assignment(text: &str) -> Result<ParameterChange, String> {
    let (name, value) = text.rsplit_once('=').ok_or("must be NAME=VALUE")?;
    let value = value.trim().parse().map_err(|_| format!("`{value}` is not a number"))?;
    if name.is_empty() {
        return Err("must be NAME=VALUE".to_owned());
    }
    Ok(slide(name, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_may_hold_an_equals_sign_and_spaces() {
        assert_eq!(assignment("a=b c=-0.5"), Ok(slide("a=b c", -0.5)));
        assert_eq!(assignment("speed=1e-3"), Ok(slide("speed", 1e-3)));
    }

    #[test]
    fn texts_that_are_not_assignments_are_refused() {
        for text in ["speed", "=1", "speed=", "speed=fast", ""] {
            assert!(assignment(text).is_err(), "{text:?}");
        }
    }
}

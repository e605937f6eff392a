//! `simctl robot sleep`: whether a robot stays awake.

use clap::Args;
use serde::Serialize;
use simd_client::Client;

use crate::{
    complete,
    output::{Output, View, table::Page},
};

#[derive(Args, Debug)]
pub(crate) struct Sleep {
    /// The robot's name
    #[arg(add = complete::robots())]
    robot: String,
    /// Whether it stays awake, even if the world lets bodies sleep; left out: shows it
    #[arg(long, value_name = "BOOL", action = clap::ArgAction::Set)]
    stays_awake: Option<bool>,
}

pub(super) async fn run(arguments: Sleep, client: &Client, output: Output) -> anyhow::Result<()> {
    let Sleep { robot, stays_awake } = arguments;
    if let Some(stays_awake) = stays_awake {
        client.set_stays_awake(&robot, stays_awake).await?;
    }
    let stays_awake = client.stays_awake(&robot).await?;
    output.one(&SleepView { robot, stays_awake })
}

#[derive(Serialize)]
struct SleepView {
    robot: String,
    stays_awake: bool,
}

impl View for SleepView {
    fn page(&self) -> Page {
        let awake = if self.stays_awake { "always awake" } else { "sleeps at rest" };
        Page::new().pairs([("robot", self.robot.clone()), ("sleep", awake.to_owned())])
    }
}

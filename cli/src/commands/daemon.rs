//! `simctl daemon`: daemons of a Zenoh network.

use anyhow::bail;
use clap::Subcommand;
use serde::Serialize;
use simd_client::{Client, Error, Network, Presence, proto::SimulationState};

use crate::{
    context::choose,
    credentials::connect_options,
    options::Options,
    output::{
        Output, json,
        number::ABSENT,
        table::{Column, Page, Table},
    },
};

#[derive(Debug, Subcommand)]
pub(crate) enum Daemon {
    /// Shows the daemons behind a Zenoh locator, which belongs to a daemon or a router
    List,
}

pub(crate) async fn run(command: Daemon, options: &Options, output: Output) -> anyhow::Result<()> {
    let Daemon::List = command;
    let choice = choose(options)?;
    let is_zenoh = simd_client::is_zenoh(&choice.endpoint);
    let locator = match choice.source.as_str() {
        // Without an address, the default of Zenoh is used.
        "default" => simd_client::DEFAULT_LOCATOR,
        _ if is_zenoh => choice.endpoint.as_str(),
        source => bail!(
            "daemons are found over Zenoh, and {source} names the gRPC endpoint {}; use for instance \
             --endpoint {}",
            choice.endpoint,
            simd_client::DEFAULT_LOCATOR
        ),
    };
    let network = Network::join(locator, connect_options(options, &choice)?).await?;
    let mut daemons = Vec::new();
    for presence in network.daemons().await? {
        let client = network.client(&presence.name);
        daemons.push(DaemonView::of(presence, &client).await?);
    }
    output.list(&daemons, page)
}

/// A line of `daemon list`.
#[derive(Serialize)]
struct DaemonView {
    name: String,
    /// Value for `--endpoint` to reach it from here.
    endpoint: String,
    /// Id of its Zenoh session, which changes with each start.
    zid: String,
    /// Null if it exists but does not answer, like the following fields.
    version: Option<String>,
    robots: Option<usize>,
    state: Option<String>,
}

impl DaemonView {
    async fn of(presence: Presence, client: &Client) -> Result<Self, Error> {
        let seen = Self::ask(client).await;
        let (version, robots, state) = match seen {
            Ok((version, robots, state)) => (Some(version), Some(robots), Some(state)),
            // It left in the meantime, or hangs: the others are shown nevertheless.
            Err(Error::Unreachable { .. } | Error::TimedOut { .. }) => (None, None, None),
            Err(error) => return Err(error),
        };
        let endpoint = client.endpoint().to_owned();
        Ok(Self { name: presence.name, endpoint, zid: presence.zid, version, robots, state })
    }

    async fn ask(client: &Client) -> Result<(String, usize, String), Error> {
        let version = client.simulator_info().await?.version;
        let robots = client.robots().await?.len();
        let state: SimulationState = client.world_statistics().await?.state();
        Ok((version, robots, json::name("SIMULATION_STATE_", state.as_str_name())))
    }
}

fn page(daemons: &[DaemonView]) -> Page {
    if daemons.is_empty() {
        return Page::of_line("no daemon was found");
    }
    let columns = vec![
        Column::left("NAME"),
        Column::left("ENDPOINT"),
        Column::left("VERSION"),
        Column::right("ROBOTS"),
        Column::left("STATE"),
        Column::left("ZID"),
    ];
    let absent = || ABSENT.to_owned();
    let row = |daemon: &DaemonView| {
        vec![
            daemon.name.clone(),
            daemon.endpoint.clone(),
            daemon.version.clone().unwrap_or_else(absent),
            daemon.robots.map_or_else(absent, |robots| robots.to_string()),
            daemon.state.clone().unwrap_or_else(absent),
            daemon.zid.clone(),
        ]
    };
    Page::new().table(Table::new(columns, daemons.iter().map(row).collect()))
}

//! `simctl top`: worlds, robots and clients, live.
//!
//! * This file: arguments, and the tables of `--once`.
//! * `find`: finds the daemons. `watch`: polls one of them.
//! * `world`: state of one world, and the rates between two answers.
//! * With the feature `top`, `screen`: the terminal and its keys. `app`: actions of keys. `draw`: the
//!   picture.

#[cfg(feature = "top")]
mod app;
#[cfg(feature = "top")]
mod draw;
mod find;
#[cfg(feature = "top")]
mod screen;
mod watch;
mod world;

use std::{
    env,
    io::{self, IsTerminal as _},
    time::Duration,
};

use clap::Args;

use crate::{
    options::Options,
    output::{
        Format, Output, has_colour,
        table::{Column, Page, Table},
    },
};
use watch::Board;
use world::{COLUMNS, ClientRow, Link, RobotRow, World};

const KEYS: &str = "\
Keys: up and down choose a world, or a robot after Tab; s sorts; p pauses a world, or lets it play,
after a question; q ends.

Without an ENDPOINT, --endpoint, --context or $SIMD_ENDPOINT it shows what simctl finds: each context of the
configuration file, 127.0.0.1:7400, and the daemons on the Zenoh network at tcp/127.0.0.1:7447.";

#[derive(Args, Debug)]
#[command(after_help = KEYS)]
pub(crate) struct Top {
    /// Daemons, as for --endpoint; a Zenoh locator without #NAME means all of its daemons
    endpoints: Vec<String>,
    /// Seconds between two polls: 0.1 to 60
    #[arg(short, long, default_value = "1", value_name = "SECONDS", value_parser = interval)]
    interval: Duration,
    /// Show tables once, and exit; this is also done if stdout is not a terminal, and for JSON
    #[arg(long)]
    once: bool,
}

fn interval(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| "must be a number of seconds".to_owned())?;
    match seconds {
        0.1..=60.0 => Ok(Duration::from_secs_f64(seconds)),
        _ => Err("must be 0.1 to 60".to_owned()),
    }
}

pub(crate) async fn run(arguments: Top, options: &Options, output: Output) -> anyhow::Result<()> {
    let Top { endpoints, interval, once } = arguments;
    let is_screen = io::stdout().is_terminal() && env::var_os("TERM").is_none_or(|term| term != "dumb");
    let once = once || options.format() != Format::Table || !is_screen || cfg!(not(feature = "top"));
    let board = Board::new(interval, options.timeout.min(Duration::from_secs(2)), once);
    let found = find::find(&endpoints, options, &board)?;
    if once {
        tokio::select! {
            () = board.looked_twice(found) => {}
            _ = tokio::signal::ctrl_c() => return Ok(()),
        }
        let worlds = board.worlds();
        output.list(&worlds, tables)?;
        anyhow::ensure!(worlds.iter().any(|world| world.link == Link::Here), "none of them answers");
        return Ok(());
    }
    #[cfg(feature = "top")]
    screen::run(
        &board,
        &options.claim.clone().or_else(|| env::var("SIMD_CLAIM").ok()).unwrap_or_default(),
        has_colour(true),
    )
    .await?;
    Ok(())
}

fn tables(worlds: &[World]) -> Page {
    let column = |(heading, is_right): (&str, bool)| match is_right {
        true => Column::right(heading),
        false => Column::left(heading),
    };
    let columns = COLUMNS.iter().map(|of| column((of.heading, of.is_right))).collect();
    let rows = worlds.iter().map(|world| COLUMNS.iter().map(|of| (of.cell)(world)).collect()).collect();
    let mut page = Page::new().table(Table::new(columns, rows));
    for world in worlds {
        if let Some(error) = &world.error {
            page = page.line(format!("{}: {error}", world.endpoint));
        }
    }
    let several = worlds.len() > 1;
    let of_world = |world: &World, mut row: Vec<String>| {
        if several {
            row.insert(0, world.label().to_owned());
        }
        row
    };
    let headed = |headings: &[(&str, bool)]| {
        let world = several.then(|| Column::left("WORLD"));
        world.into_iter().chain(headings.iter().copied().map(column)).collect()
    };
    let robots: Vec<_> = worlds
        .iter()
        .flat_map(|world| world.robots.iter().map(move |robot| of_world(world, robot.cells())))
        .collect();
    if !robots.is_empty() {
        page = page.line("").table(Table::new(headed(&RobotRow::HEADINGS), robots));
    }
    let clients: Vec<_> = worlds
        .iter()
        .flat_map(|world| world.clients.iter().map(move |client| of_world(world, client.cells())))
        .collect();
    if !clients.is_empty() {
        page = page.line("").table(Table::new(headed(&ClientRow::HEADINGS), clients));
    }
    page
}

//! `simctl state`: saved states of the world.

use std::path::PathBuf;

use anyhow::Context as _;
use clap::Subcommand;
use serde::Serialize;
use simd_client::{Client, proto::SavedStateInfo};

use super::{present, taking_over};
use crate::output::{
    Output, View,
    json::Stamp,
    number::{count, fixed},
    table::{Column, Page, Table},
};

#[derive(Debug, Subcommand)]
pub(crate) enum State {
    /// Keeps the state of the world in the daemon's memory
    Save {
        /// Name of the state, which is replaced if it exists; chosen by the daemon if left out
        #[arg(default_value = "", hide_default_value = true)]
        name: String,
        /// Also replace another owner's state: for admins
        #[arg(long)]
        take_over: bool,
    },
    /// Restores a saved state
    Restore {
        /// Name of the state
        name: String,
    },
    /// Shows the saved states, oldest first
    List,
    /// Deletes a saved state
    Delete {
        /// Name of the state
        name: String,
        /// Also delete another owner's state: for admins
        #[arg(long)]
        take_over: bool,
    },
    /// Writes a saved state and its robots' files into a file
    Export {
        /// Name of the state
        name: String,
        /// File to write; an existing one is replaced
        file: PathBuf,
    },
    /// Keeps the saved state of a file in the daemon's memory; the world does not change
    Import {
        /// File to read
        file: PathBuf,
        /// Name of the state; its name at the export if left out
        #[arg(long, default_value = "", hide_default_value = true)]
        name: String,
        /// Also replace another owner's state: for admins
        #[arg(long)]
        take_over: bool,
    },
}

pub(crate) async fn run(command: State, client: &Client, output: Output) -> anyhow::Result<()> {
    match command {
        State::Save { name, take_over } => {
            let saved = SavedStateView::new(taking_over(client, take_over).save_state(&name).await?)?;
            output.one(&Saved(saved))
        }
        State::Restore { name } => {
            let stamp = client.restore_state(&name).await?.into();
            output.one(&Restored { restored: name, stamp })
        }
        State::List => {
            let saved_states: Vec<SavedStateView> = client
                .saved_states()
                .await?
                .into_iter()
                .map(SavedStateView::new)
                .collect::<Result<_, _>>()?;
            output.list(&saved_states, list)
        }
        State::Delete { name, take_over } => {
            taking_over(client, take_over).delete_saved_state(&name).await?;
            output.one(&Deleted { deleted: name })
        }
        State::Export { name, file } => {
            let bytes = client.export_saved_state(&name, &file).await?;
            output.one(&Exported { exported: name, file: file.display().to_string(), bytes })
        }
        State::Import { file, name, take_over } => {
            let client = taking_over(client, take_over);
            let imported = client.import_saved_state(&file, &name).await;
            let imported = imported.with_context(|| file.display().to_string())?;
            let imported = SavedStateView::new(imported)?;
            output.one(&Imported(imported))
        }
    }
}

#[derive(Serialize)]
struct SavedStateView {
    name: String,
    stamp: Stamp,
    robots: u32,
    /// Owner of the state.
    owner: String,
}

impl SavedStateView {
    fn new(saved_state: SavedStateInfo) -> anyhow::Result<Self> {
        let stamp = present(saved_state.stamp, "stamp")?.into();
        let SavedStateInfo { name, robots, owner, .. } = saved_state;
        Ok(Self { name, stamp, robots, owner })
    }
}

fn list(saved_states: &[SavedStateView]) -> Page {
    let columns = vec![
        Column::left("STATE"),
        Column::right("EPOCH"),
        Column::right("STEP"),
        Column::right("SIM TIME [s]"),
        Column::right("ROBOTS"),
        Column::left("OWNER"),
    ];
    let row = |saved_state: &SavedStateView| {
        vec![
            saved_state.name.clone(),
            saved_state.stamp.epoch.to_string(),
            saved_state.stamp.step.to_string(),
            fixed(saved_state.stamp.sim_time, 3),
            saved_state.robots.to_string(),
            saved_state.owner.clone(),
        ]
    };
    Page::new().table(Table::new(columns, saved_states.iter().map(row).collect()))
}

/// `state save`.
#[derive(Serialize)]
#[serde(transparent)]
struct Saved(SavedStateView);

impl View for Saved {
    fn page(&self) -> Page {
        let robots = count(self.0.robots as usize, "robot");
        Page::of_line(format!("saved {}: {robots} at {}", self.0.name, self.0.stamp))
    }
}

/// `state restore`.
#[derive(Serialize)]
struct Restored {
    restored: String,
    stamp: Stamp,
}

impl View for Restored {
    fn page(&self) -> Page {
        let (name, stamp) = (&self.restored, &self.stamp);
        Page::of_line(format!("restored {name}; now at {stamp} of epoch {}", stamp.epoch))
    }
}

/// `state delete`.
#[derive(Serialize)]
struct Deleted {
    deleted: String,
}

impl View for Deleted {
    fn page(&self) -> Page {
        Page::of_line(format!("deleted {}", self.deleted))
    }
}

/// `state export`.
#[derive(Serialize)]
struct Exported {
    exported: String,
    file: String,
    bytes: u64,
}

impl View for Exported {
    fn page(&self) -> Page {
        Page::of_line(format!("exported {} to {}: {} bytes", self.exported, self.file, self.bytes))
    }
}

/// `state import`.
#[derive(Serialize)]
#[serde(transparent)]
struct Imported(SavedStateView);

impl View for Imported {
    fn page(&self) -> Page {
        let Self(SavedStateView { name, stamp, robots, .. }) = self;
        let robots = count(*robots as usize, "robot");
        Page::of_line(format!("imported {name}: {robots} at {stamp}; `simctl state restore` restores it"))
    }
}

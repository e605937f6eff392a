//! `simctl snapshot`: states of the world to go back to.

use std::path::PathBuf;

use clap::Subcommand;
use serde::Serialize;
use simd_client::{Client, proto::SnapshotInfo};

use super::present;
use crate::output::{
    Output, View,
    json::Stamp,
    number::{count, fixed},
    table::{Column, Page, Table},
};

#[derive(Debug, Subcommand)]
pub(crate) enum Snapshot {
    /// Keeps the state of the world in the daemon's memory
    Save {
        /// Replaces one of that name; made up where it is left out
        #[arg(default_value = "", hide_default_value = true)]
        name: String,
    },
    /// Puts the world back to a snapshot
    Restore {
        /// Which one
        name: String,
    },
    /// Shows the snapshots, oldest first
    List,
    /// Forgets a snapshot
    Delete {
        /// Which one
        name: String,
    },
    /// Writes a snapshot and what its robots are made of into a file
    Export {
        /// Which one
        name: String,
        /// Where to; a file that is there is replaced
        file: PathBuf,
    },
    /// Keeps the snapshot of a file in the daemon's memory; the world stays as it is
    Import {
        /// Where from
        file: PathBuf,
        /// What it is called here; as where it was exported if left out
        #[arg(long, default_value = "", hide_default_value = true)]
        name: String,
    },
}

pub(crate) async fn run(command: Snapshot, client: &Client, output: Output) -> anyhow::Result<()> {
    match command {
        Snapshot::Save { name } => {
            let saved = SnapshotView::new(client.save_snapshot(&name).await?)?;
            output.one(&Saved(saved))
        }
        Snapshot::Restore { name } => {
            let stamp = client.restore_snapshot(&name).await?.into();
            output.one(&Restored { restored: name, stamp })
        }
        Snapshot::List => {
            let snapshots: Vec<SnapshotView> =
                client.snapshots().await?.into_iter().map(SnapshotView::new).collect::<Result<_, _>>()?;
            output.list(&snapshots, list)
        }
        Snapshot::Delete { name } => {
            client.delete_snapshot(&name).await?;
            output.one(&Deleted { deleted: name })
        }
        Snapshot::Export { name, file } => {
            let bytes = client.export_snapshot(&name, &file).await?;
            output.one(&Exported { exported: name, file: file.display().to_string(), bytes })
        }
        Snapshot::Import { file, name } => {
            let imported = SnapshotView::new(client.import_snapshot(&file, &name).await?)?;
            output.one(&Imported(imported))
        }
    }
}

#[derive(Serialize)]
struct SnapshotView {
    name: String,
    stamp: Stamp,
    robots: u32,
}

impl SnapshotView {
    fn new(snapshot: SnapshotInfo) -> anyhow::Result<Self> {
        let stamp = present(snapshot.stamp, "stamp")?.into();
        Ok(Self { name: snapshot.name, stamp, robots: snapshot.robots })
    }
}

fn list(snapshots: &[SnapshotView]) -> Page {
    let columns = vec![
        Column::left("SNAPSHOT"),
        Column::right("EPOCH"),
        Column::right("STEP"),
        Column::right("SIM TIME [s]"),
        Column::right("ROBOTS"),
    ];
    let row = |snapshot: &SnapshotView| {
        vec![
            snapshot.name.clone(),
            snapshot.stamp.epoch.to_string(),
            snapshot.stamp.step.to_string(),
            fixed(snapshot.stamp.sim_time, 3),
            snapshot.robots.to_string(),
        ]
    };
    Page::new().table(Table::new(columns, snapshots.iter().map(row).collect()))
}

/// `snapshot save`.
#[derive(Serialize)]
#[serde(transparent)]
struct Saved(SnapshotView);

impl View for Saved {
    fn page(&self) -> Page {
        let robots = count(self.0.robots as usize, "robot");
        Page::of_line(format!("saved {}: {robots} at {}", self.0.name, self.0.stamp))
    }
}

/// `snapshot restore`.
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

/// `snapshot delete`.
#[derive(Serialize)]
struct Deleted {
    deleted: String,
}

impl View for Deleted {
    fn page(&self) -> Page {
        Page::of_line(format!("deleted {}", self.deleted))
    }
}

/// `snapshot export`.
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

/// `snapshot import`.
#[derive(Serialize)]
#[serde(transparent)]
struct Imported(SnapshotView);

impl View for Imported {
    fn page(&self) -> Page {
        let Self(SnapshotView { name, stamp, robots }) = self;
        let robots = count(*robots as usize, "robot");
        Page::of_line(format!("imported {name}: {robots} at {stamp}; `simctl snapshot restore` goes there"))
    }
}

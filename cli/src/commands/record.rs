//! `simctl record`: recordings of the world, which the daemon makes on its own disk.

mod export;

use std::path::PathBuf;

use anyhow::bail;
use clap::{Args, Subcommand};
use serde::Serialize;
use simd_client::{
    Client,
    proto::{Recording, RecordingTopic, StartRecordingRequest},
};

use super::present;
use crate::failure::warn;
use crate::output::{
    Output, View, json,
    number::{count, fixed},
    table::{Column, Page, Table},
};

#[derive(Debug, Subcommand)]
pub(crate) enum Record {
    /// Starts a recording of every command, with states of the world
    Start {
        /// Name of the recording and its file: letters and digits of any script, `_` and `-`; the time in UTC if left out
        #[arg(default_value = "", hide_default_value = true)]
        name: String,
        /// Rate of joint states and link poses, per simulated second; 0 records none
        #[arg(long, value_name = "HZ", default_value_t = 100.0)]
        rate: f64,
        /// Keep only the last seconds, in several files whose oldest are deleted
        #[arg(long, value_name = "SECONDS", default_value_t = 0.0, hide_default_value = true)]
        keep_last: f64,
        /// Size at which the recording ends; with --keep-last, the oldest files are deleted instead
        #[arg(long, value_name = "BYTES", default_value_t = 0, hide_default_value = true)]
        max_bytes: u64,
        /// Duration after which the recording ends
        #[arg(long, value_name = "SECONDS", default_value_t = 0.0, hide_default_value = true)]
        max_duration: f64,
    },
    /// Stops the running recording
    Stop {
        /// Stop the recording only if it has this name
        #[arg(default_value = "", hide_default_value = true)]
        name: String,
    },
    /// Shows the recordings
    List,
    /// Shows the contents of a recording
    Info {
        /// Name of the recording
        name: String,
    },
    /// Copies the files of a recording from the daemon's disk to this one
    Download {
        /// Name of the recording
        name: String,
        /// Folder to write to
        #[arg(default_value = ".")]
        folder: PathBuf,
    },
    /// Writes the joint states of a file as a table, or its ROS 2 messages as a bag; needs no daemon
    Export(Export),
    /// Deletes the files of a recording
    Delete {
        /// Name of the recording
        name: String,
    },
}

#[derive(Args, Debug)]
pub(crate) struct Export {
    /// File of a recording (.mcap), on this disk
    file: PathBuf,
    /// Table to write, a row for each joint of each state: time, robot, joint, position, velocity, effort
    #[arg(long, value_name = "FILE", required_unless_present = "ros2")]
    csv: Option<PathBuf>,
    /// New folder to write, for `ros2 bag` and `rosbags`
    #[arg(long, value_name = "FOLDER")]
    ros2: Option<PathBuf>,
}

/// `record export`, which needs no daemon.
pub(crate) fn export(arguments: &Export, output: Output) -> anyhow::Result<()> {
    let Export { file, csv, ros2 } = arguments;
    let mut messages = 0;
    let csv = csv.iter().map(|to| export::csv(file, to).map(|written| (to, written)));
    let ros2 = ros2.iter().map(|to| export::ros2(file, to).map(|written| (to, written)));
    for written in csv.chain(ros2) {
        let (to, written) = written?;
        messages += written.messages;
        if let Some(early) = written.early {
            warn(&format!("{}: {early}; {} has what is before that", file.display(), to.display()));
        }
    }
    output.one(&Exported { exported: file.display().to_string(), messages })
}

pub(crate) async fn run(command: Record, client: &Client, output: Output) -> anyhow::Result<()> {
    match command {
        Record::Start { name, rate, keep_last, max_bytes, max_duration } => {
            let request = StartRecordingRequest {
                name,
                state_rate: Some(rate),
                keep_last,
                max_bytes,
                max_duration,
                ..StartRecordingRequest::default()
            };
            output.one(&Said("recording", client.start_recording(request).await?.into()))
        }
        Record::Stop { name } => output.one(&Said("recorded", client.stop_recording(&name).await?.into())),
        Record::List => {
            let recordings: Vec<RecordingView> =
                client.recordings().await?.into_iter().map(RecordingView::from).collect();
            output.list(&recordings, list)
        }
        Record::Info { name } => {
            let info = client.recording(&name).await?;
            let recording = present(info.recording, "recording")?.into();
            let topics = info.topics.into_iter().map(TopicView::from).collect();
            output.one(&Info { recording, duration: info.duration, topics })
        }
        Record::Download { name, folder } => {
            let (files, bytes) = tokio::select! {
                downloaded = client.download_recording(&name, &folder) => downloaded?,
                // The received part of a file is deleted.
                _ = tokio::signal::ctrl_c() => bail!("interrupted"),
            };
            output.one(&Downloaded { downloaded: name, files, bytes })
        }
        Record::Export(arguments) => export(&arguments, output),
        Record::Delete { name } => {
            client.delete_recording(&name).await?;
            output.one(&Deleted { deleted: name })
        }
    }
}

#[derive(Serialize)]
struct RecordingView {
    name: String,
    /// `recording`, `complete` or `unfinished`.
    state: String,
    bytes: u64,
    files: Vec<String>,
}

impl From<Recording> for RecordingView {
    fn from(recording: Recording) -> Self {
        let state = json::name("RECORDING_STATE_", recording.state().as_str_name());
        let files = recording.files.into_iter().map(|file| file.name).collect();
        Self { name: recording.name, state, bytes: recording.bytes, files }
    }
}

fn list(recordings: &[RecordingView]) -> Page {
    let columns = vec![
        Column::left("RECORDING"),
        Column::left("STATE"),
        Column::right("FILES"),
        Column::right("BYTES"),
    ];
    let row = |recording: &RecordingView| {
        let files = recording.files.len().to_string();
        vec![recording.name.clone(), recording.state.clone(), files, recording.bytes.to_string()]
    };
    Page::new().table(Table::new(columns, recordings.iter().map(row).collect()))
}

/// `record start` and `record stop`.
struct Said(&'static str, RecordingView);

impl Serialize for Said {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.1.serialize(serializer)
    }
}

impl View for Said {
    fn page(&self) -> Page {
        let Self(what, RecordingView { name, files, bytes, .. }) = self;
        Page::of_line(match *what {
            "recorded" => format!("recorded {name}: {} in {}", bytes_of(*bytes), files.join(", ")),
            _ => format!("{what} {name} into {}", files.join(", ")),
        })
    }
}

fn bytes_of(bytes: u64) -> String {
    count(usize::try_from(bytes).unwrap_or(usize::MAX), "byte")
}

#[derive(Serialize)]
struct TopicView {
    topic: String,
    schema: String,
    messages: u64,
}

impl From<RecordingTopic> for TopicView {
    fn from(topic: RecordingTopic) -> Self {
        let RecordingTopic { topic, schema, messages } = topic;
        Self { topic, schema, messages }
    }
}

/// `record info`.
#[derive(Serialize)]
struct Info {
    #[serde(flatten)]
    recording: RecordingView,
    /// Wall seconds.
    duration: f64,
    topics: Vec<TopicView>,
}

impl View for Info {
    fn page(&self) -> Page {
        let RecordingView { name, state, bytes, files } = &self.recording;
        let columns = vec![Column::left("TOPIC"), Column::left("SCHEMA"), Column::right("MESSAGES")];
        let row =
            |topic: &TopicView| vec![topic.topic.clone(), topic.schema.clone(), topic.messages.to_string()];
        let size = bytes_of(*bytes);
        Page::of_line(format!(
            "{name} ({state}): {size} in {}, {} s",
            files.join(", "),
            fixed(self.duration, 1)
        ))
        .table(Table::new(columns, self.topics.iter().map(row).collect()))
    }
}

/// `record download`.
#[derive(Serialize)]
struct Downloaded {
    downloaded: String,
    files: Vec<String>,
    bytes: u64,
}

impl View for Downloaded {
    fn page(&self) -> Page {
        Page::of_line(format!(
            "downloaded {}: {} in {}",
            self.downloaded,
            bytes_of(self.bytes),
            self.files.join(", ")
        ))
    }
}

/// `record export`.
#[derive(Serialize)]
struct Exported {
    exported: String,
    messages: u64,
}

impl View for Exported {
    fn page(&self) -> Page {
        let messages = usize::try_from(self.messages).unwrap_or(usize::MAX);
        Page::of_line(format!("exported {}: {}", self.exported, count(messages, "message")))
    }
}

/// `record delete`.
#[derive(Serialize)]
struct Deleted {
    deleted: String,
}

impl View for Deleted {
    fn page(&self) -> Page {
        Page::of_line(format!("deleted {}", self.deleted))
    }
}

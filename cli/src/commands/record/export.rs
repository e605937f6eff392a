//! `simctl record export`: writes the joint states of a recording on this disk as a table, or its ROS 2
//! messages as a bag.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufReader, BufWriter, IntoInnerError, Write as _};
use std::path::Path;

use anyhow::{Context as _, bail};
use simd_client::Replacement;
use simd_mcap::{Item, ReadLimits, Reader, Writer};
use simd_ros2::Message as _;
use simd_ros2::messages::sensor_msgs::JointState;

/// Type of joint states.
const JOINT_STATE: &str = JointState::NAME;
/// Encoding of ROS 2 messages.
const CDR: &str = "cdr";

/// Result of an export.
#[derive(Debug, Default)]
pub(super) struct Written {
    pub(super) messages: u64,
    /// Reason why the recording ends early.
    pub(super) early: Option<String>,
}

fn open(recording: &Path) -> anyhow::Result<Reader<BufReader<File>>> {
    let named = || recording.display().to_string();
    let file = File::open(recording).with_context(named)?;
    Reader::new(BufReader::new(file), ReadLimits::default()).with_context(named)
}

/// Writes a row for each joint of each state: simulated time in seconds, robot, joint, position, velocity and
/// effort.
pub(super) fn csv(recording: &Path, to: &Path) -> anyhow::Result<Written> {
    let mut reader = open(recording)?;
    let named = || to.display().to_string();
    if to.exists() && to.canonicalize().ok() == recording.canonicalize().ok() {
        bail!("{}: --csv would overwrite the recording", to.display());
    }
    let mut out = BufWriter::new(Replacement::begin(to).with_context(named)?);
    writeln!(out, "time,robot,joint,position,velocity,effort").with_context(named)?;
    let mut written = Written::default();
    loop {
        let (topic, state) = match reader.next() {
            Ok(Some(Item::Message { channel, data, .. })) => match &channel.schema {
                // Topics of encoders are below `sensors`.
                Some(schema) if schema.name == JOINT_STATE && channel.topic.ends_with("/joint_states") => {
                    (channel.topic.clone(), JointState::from_cdr(data)?)
                }
                _ => continue,
            },
            Ok(Some(Item::Metadata { .. })) => continue,
            Ok(None) => break,
            Err(error) => {
                written.early = Some(error.to_string());
                break;
            }
        };
        let robot = field(topic.trim_start_matches('/').trim_end_matches("/joint_states"));
        let time = f64::from(state.header.stamp.sec) + f64::from(state.header.stamp.nanosec) * 1e-9;
        let numbers = state.position.iter().zip(&state.velocity).zip(&state.effort);
        for (joint, ((position, velocity), effort)) in state.name.iter().zip(numbers) {
            // Enough digits to read the same number again.
            writeln!(out, "{time},{robot},{},{position:?},{velocity:?},{effort:?}", field(joint))
                .with_context(named)?;
        }
        written.messages += 1;
    }
    let out = out.into_inner().map_err(IntoInnerError::into_error).with_context(named)?;
    out.finish().with_context(named)?;
    Ok(written)
}

/// Returns a field of a table, quoted if needed.
fn field(text: &str) -> String {
    if text.contains(['"', ',', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// Writes a folder that `ros2 bag` and `rosbags` read: a file with only the ROS 2 messages, and
/// `metadata.yaml`.
pub(super) fn ros2(recording: &Path, to: &Path) -> anyhow::Result<Written> {
    let mut reader = open(recording)?;
    std::fs::create_dir(to).with_context(|| to.display().to_string())?;
    let written = bag(&mut reader, recording, to);
    if written.is_err() {
        // The folder is new, and a part of a bag is useless.
        let _ = std::fs::remove_dir_all(to);
    }
    written
}

fn bag(reader: &mut Reader<BufReader<File>>, recording: &Path, to: &Path) -> anyhow::Result<Written> {
    let stem = to.file_name().and_then(|name| name.to_str()).unwrap_or("bag");
    let file = format!("{stem}_0.mcap");
    let path = to.join(&file);
    let created = File::create(&path).with_context(|| path.display().to_string())?;
    let out = BufWriter::new(created);
    let mut writer = Writer::new(out, "ros2", concat!("simctl ", env!("CARGO_PKG_VERSION")))?;
    let (mut channels, mut schemas, mut topics) = (BTreeMap::new(), BTreeMap::new(), Vec::new());
    let mut span: Option<(u64, u64)> = None;
    let mut written = Written::default();
    loop {
        let (channel, time, data) = match reader.next() {
            Ok(Some(Item::Message { channel, time, data })) => (channel, time, data),
            Ok(Some(Item::Metadata { .. })) => continue,
            Ok(None) => break,
            Err(error) => {
                written.early = Some(error.to_string());
                break;
            }
        };
        let Some(schema) = channel.schema.as_ref().filter(|_| channel.encoding == CDR) else { continue };
        let id = match channels.get(&channel.id) {
            Some(known) => *known,
            None => {
                let of = match schemas.get(&schema.name) {
                    Some(of) => *of,
                    None => {
                        let of = writer.add_schema(&schema.name, &schema.encoding, &schema.data)?;
                        schemas.insert(schema.name.clone(), of);
                        of
                    }
                };
                let id = writer.add_channel(of, &channel.topic, &channel.encoding, &channel.metadata)?;
                channels.insert(channel.id, id);
                topics.push((channel.topic.clone(), schema.name.clone()));
                id
            }
        };
        writer.write(id, time, data)?;
        let (start, end) = span.get_or_insert((time, time));
        (*start, *end) = ((*start).min(time), (*end).max(time));
        written.messages += 1;
    }
    if written.messages == 0 {
        bail!("{} has no messages of ROS 2: it was recorded with a rate of 0", recording.display());
    }
    let counts = writer.messages().to_vec();
    writer.finish()?;
    let metadata = metadata(&file, span.unwrap_or_default(), &topics, &counts);
    let path = to.join("metadata.yaml");
    std::fs::write(&path, metadata).with_context(|| path.display().to_string())?;
    Ok(written)
}

/// Returns the metadata as rosbag2 writes it, in version 5.
fn metadata(file: &str, (start, end): (u64, u64), topics: &[(String, String)], counts: &[u64]) -> String {
    // A JSON string is also a YAML string, except for control characters above the first ones of ASCII.
    let quoted = |text: &str| {
        let escaped =
            |c: char| if c.is_control() { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
        serde_json::Value::from(text).to_string().chars().map(escaped).collect::<String>()
    };
    let file = quoted(file);
    let total: u64 = counts.iter().sum();
    let mut text = format!(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  duration:\n    nanoseconds: {}\n  \
         starting_time:\n    nanoseconds_since_epoch: {start}\n  message_count: {total}\n  \
         topics_with_message_count:\n",
        end - start
    );
    for ((topic, schema), count) in topics.iter().zip(counts) {
        let (topic, schema) = (quoted(topic), quoted(schema));
        let _ = write!(
            text,
            "    - topic_metadata:\n        name: {topic}\n        type: {schema}\n        serialization_format: cdr\n        \
             offered_qos_profiles: \"\"\n      message_count: {count}\n",
        );
    }
    let _ = write!(
        text,
        "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - {file}\n  files:\n    - path: \
         {file}\n      starting_time:\n        nanoseconds_since_epoch: {start}\n      duration:\n        nanoseconds: \
         {}\n      message_count: {total}\n",
        end - start
    );
    text
}

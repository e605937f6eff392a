//! Answers of the recording service.

use simd_proto::v1;

use super::stamp;
use simd_world::handle::{RecordingContents, RecordingInfo, RecordingState};

/// Converts a recording on the disk.
pub fn recording(info: RecordingInfo) -> v1::Recording {
    let RecordingInfo { name, state, files, modified } = info;
    let state = match state {
        RecordingState::Recording => v1::RecordingState::Recording,
        RecordingState::Complete => v1::RecordingState::Complete,
        RecordingState::Unfinished => v1::RecordingState::Unfinished,
    };
    v1::Recording {
        name,
        state: state.into(),
        bytes: files.iter().map(|(_, bytes)| bytes).sum(),
        files: files.into_iter().map(|(name, bytes)| v1::RecordingFile { name, bytes }).collect(),
        modified: modified.map(stamp::timestamp),
    }
}

/// Converts a recording and its contents.
pub fn contents(info: RecordingInfo, contents: RecordingContents) -> v1::GetRecordingResponse {
    let RecordingContents { topics, duration } = contents;
    let topic = |(topic, schema, messages)| v1::RecordingTopic { topic, schema, messages };
    v1::GetRecordingResponse {
        recording: Some(recording(info)),
        topics: topics.into_iter().map(topic).collect(),
        duration,
    }
}

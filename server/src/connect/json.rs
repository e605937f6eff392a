//! Messages of the schema as JSON and back, as protobuf defines it: names in lowerCamelCase, zeros left out,
//! integers of 64 bits as text.

use std::sync::LazyLock;

use axum::body::Bytes;
use prost::Message as _;
use prost_reflect::{
    DescriptorPool, DeserializeOptions, DynamicMessage, MessageDescriptor, SerializeOptions,
};
use simd_proto::v1::FILE_DESCRIPTOR_SET;
use tonic::Status;

use super::MAX_VALUES;

/// The compiled schema; empty if it is broken, which a test would show.
static SCHEMA: LazyLock<DescriptorPool> =
    LazyLock::new(|| DescriptorPool::decode(FILE_DESCRIPTOR_SET).unwrap_or_default());

/// Returns the schema.
pub(super) fn schema() -> &'static DescriptorPool {
    &SCHEMA
}

fn message(name: &str) -> Result<MessageDescriptor, Status> {
    let found = SCHEMA.get_message_by_name(&format!("simd.v1.{name}"));
    found.ok_or_else(|| Status::internal(format!("the schema has no message {name}")))
}

/// Encodes a message given as JSON. Nothing at all is an empty message. Commas separate values, also within texts.
///
/// # Errors
///
/// Returns an error that names the unknown or wrong field with its line.
pub(super) fn read(name: &str, text: &[u8]) -> Result<Bytes, Status> {
    let text = if text.trim_ascii().is_empty() { b"{}" } else { text };
    if text.iter().filter(|byte| **byte == b',').count() > MAX_VALUES {
        return Err(Status::resource_exhausted(format!(
            "{name} has more than {MAX_VALUES} values: use gRPC"
        )));
    }
    let mut reader = serde_json::Deserializer::from_slice(text);
    let options = DeserializeOptions::new().deny_unknown_fields(true);
    let wrong = |error: serde_json::Error| Status::invalid_argument(format!("{name} as JSON: {error}"));
    let read =
        DynamicMessage::deserialize_with_options(message(name)?, &mut reader, &options).map_err(wrong)?;
    reader.end().map_err(wrong)?;
    Ok(read.encode_to_vec().into())
}

/// Writes an encoded message as JSON.
///
/// # Errors
///
/// Returns an error if the message is not one of the schema.
pub(super) fn write(name: &str, bytes: &Bytes) -> Result<Vec<u8>, Status> {
    let internal = |error: &dyn std::fmt::Display| Status::internal(format!("{name} as JSON: {error}"));
    let read = DynamicMessage::decode(message(name)?, bytes.clone()).map_err(|error| internal(&error))?;
    let mut text = Vec::new();
    let mut writer = serde_json::Serializer::new(&mut text);
    read.serialize_with_options(&mut writer, &SerializeOptions::new()).map_err(|error| internal(&error))?;
    Ok(text)
}

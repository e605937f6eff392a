//! Shapes of all messages for `src/checked.rs`, generated from the compiled schema. The compiler provides the
//! sizes of the generated types.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorSet};

/// The package, as descriptors write it before a name.
const PACKAGE: &str = ".simd.v1.";
/// The only message of another package.
const TIMESTAMP: &str = ".google.protobuf.Timestamp";
/// Field by which a repeated request is recognised.
const REQUEST_ID: &str = "request_id";
/// Field with the claim that a request acts for.
const CLAIM: &str = "claim";

/// Returns Rust text: a `Shape` for each message, and implementations of `Known` and `Identified`.
pub(crate) fn generate(schema: &FileDescriptorSet) -> String {
    let files = || schema.file.iter().filter(|file| file.package() == PACKAGE.trim_matches('.'));
    let requests = requests(schema);
    let mut text = String::new();
    for message in files().flat_map(|file| &file.message_type) {
        write_message(&mut text, message, requests.contains(message.name()));
    }
    let rows = requests
        .iter()
        .map(|name| format!("(\"{name}\", |bytes| decode::<crate::v1::{name}>(bytes).map(drop)), "));
    let _ = writeln!(text, "static REQUESTS: &[Request] = &[{}];", rows.collect::<String>());
    text
}

/// Returns Rust text: implementations of `Claiming`, and the table of their requests.
pub(crate) fn generate_claiming(schema: &FileDescriptorSet) -> String {
    let files = || schema.file.iter().filter(|file| file.package() == PACKAGE.trim_matches('.'));
    let is_request = |message: &DescriptorProto| requests(schema).contains(message.name());
    let claims = |message: &DescriptorProto| message.field.iter().any(|field| field.name() == CLAIM);
    let claiming = files().flat_map(|file| &file.message_type).filter(|&of| is_request(of) && claims(of));
    let (mut text, mut rows) = (String::new(), String::new());
    for message in claiming {
        let name = message.name();
        let _ = writeln!(
            text,
            "impl Claiming for crate::v1::{name} {{ fn claim_mut(&mut self) -> &mut String {{ &mut self.{CLAIM} }} }}"
        );
        let _ = write!(rows, "(\"{name}\", seal_in::<crate::v1::{name}>), ");
    }
    let _ = writeln!(text, "static CLAIMING: &[(&str, Seal)] = &[{rows}];");
    text
}

/// Returns the names of the messages that methods take.
fn requests(schema: &FileDescriptorSet) -> BTreeSet<&str> {
    let files = schema.file.iter().filter(|file| file.package() == PACKAGE.trim_matches('.'));
    let services = files.flat_map(|file| &file.service);
    services.flat_map(|service| &service.method).map(|method| bare(method.input_type())).collect()
}

fn write_message(text: &mut String, message: &DescriptorProto, is_request: bool) {
    let name = message.name();
    let entries: BTreeMap<&str, &DescriptorProto> =
        message.nested_type.iter().map(|nested| (nested.name(), nested)).collect();
    let is_map = |entry: &DescriptorProto| entry.options.as_ref().is_some_and(|options| options.map_entry());
    assert!(entries.values().all(|entry| is_map(entry)), "{name}: a message within a message has no shape");
    let fields = sorted(message).into_iter().map(|field| match entries.get(last(field.type_name())) {
        Some(entry) => map(field, entry),
        None => plain(field),
    });
    let fields: String = fields.collect();
    let _ = writeln!(text, "static {}: Shape = Shape {{ fields: &[{fields}] }};", shape(name));
    let _ = writeln!(
        text,
        "impl Known for crate::v1::{name} {{ const NAME: &'static str = \"{name}\"; const SHAPE: &'static \
         Shape = &{}; const IS_REQUEST: bool = {is_request}; }}",
        shape(name)
    );
    let has = |name: &str| message.field.iter().any(|field| field.name() == name);
    if is_request && has(REQUEST_ID) {
        let claim =
            if has(CLAIM) { format!("fn claim(&self) -> &str {{ &self.{CLAIM} }}") } else { String::new() };
        let _ = writeln!(
            text,
            "impl Identified for crate::v1::{name} {{ fn request_id(&self) -> &str {{ &self.{REQUEST_ID} }} {claim} }}"
        );
    }
}

fn sorted(message: &DescriptorProto) -> Vec<&FieldDescriptorProto> {
    let mut fields: Vec<_> = message.field.iter().collect();
    fields.sort_by_key(|field| field.number());
    fields
}

fn plain(field: &FieldDescriptorProto) -> String {
    let kind = if field.label() == Label::Repeated { "List" } else { "One" };
    entry(field.number(), kind, &size(field), &inside(field))
}

/// Returns the field of a map. A map's entry is a message of a key and a value.
fn map(field: &FieldDescriptorProto, of: &DescriptorProto) -> String {
    let fields = sorted(of);
    let sizes: Vec<String> = fields.iter().map(|field| size(field)).collect();
    let fields: String = fields.iter().map(|field| plain(field)).collect();
    let inside = format!("Inside::Message(&Shape {{ fields: &[{fields}] }})");
    entry(field.number(), "Map", &sizes.join(" + "), &inside)
}

fn entry(number: i32, kind: &str, size: &str, inside: &str) -> String {
    format!("Field {{ number: {number}, kind: Kind::{kind}, size: {size}, inside: {inside} }}, ")
}

/// Returns the size of a value within its message, list or map.
fn size(field: &FieldDescriptorProto) -> String {
    match field.r#type() {
        Type::Message | Type::Group => match field.type_name() {
            TIMESTAMP => "size_of::<prost_types::Timestamp>()".to_owned(),
            name => format!("size_of::<crate::v1::{}>()", bare(name)),
        },
        Type::String | Type::Bytes => "size_of::<String>()".to_owned(),
        Type::Double | Type::Fixed64 | Type::Sfixed64 | Type::Int64 | Type::Uint64 | Type::Sint64 => {
            "8".into()
        }
        Type::Float
        | Type::Fixed32
        | Type::Sfixed32
        | Type::Int32
        | Type::Uint32
        | Type::Sint32
        | Type::Enum => "4".into(),
        Type::Bool => "1".into(),
    }
}

fn inside(field: &FieldDescriptorProto) -> String {
    match field.r#type() {
        Type::Message | Type::Group => match field.type_name() {
            // A timestamp has two numbers.
            TIMESTAMP => "Inside::Message(&Shape { fields: &[] })".to_owned(),
            name => format!("Inside::Message(&{})", shape(bare(name))),
        },
        Type::String | Type::Bytes => "Inside::Bytes".to_owned(),
        Type::Double | Type::Fixed64 | Type::Sfixed64 => "Inside::Numbers(Some(8))".to_owned(),
        Type::Float | Type::Fixed32 | Type::Sfixed32 => "Inside::Numbers(Some(4))".to_owned(),
        Type::Int64
        | Type::Uint64
        | Type::Sint64
        | Type::Int32
        | Type::Uint32
        | Type::Sint32
        | Type::Enum
        | Type::Bool => "Inside::Numbers(None)".to_owned(),
    }
}

fn bare(name: &str) -> &str {
    name.strip_prefix(PACKAGE).unwrap_or(name)
}

fn last(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}

fn shape(message: &str) -> String {
    message.to_uppercase()
}

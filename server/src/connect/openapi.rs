//! The methods as OpenAPI 3.1, made of the compiled schema: `/openapi.json`.

use std::sync::LazyLock;

use axum::body::Bytes;
use prost_reflect::{Cardinality, EnumDescriptor, FieldDescriptor, Kind, MessageDescriptor};
use serde_json::{Map, Value, json};
use simd_proto::methods;

use super::{STREAM, UNARY, json};

static DOCUMENT: LazyLock<Bytes> = LazyLock::new(|| made().to_string().into());

/// Returns the document.
pub(crate) fn document() -> Bytes {
    DOCUMENT.clone()
}

fn made() -> Value {
    let mut paths = Map::new();
    for (service, name, method) in methods::all().filter(|(_, _, method)| !method.takes_many) {
        let media = if method.gives_many { STREAM } else { UNARY };
        let error = json!({ "$ref": "#/components/responses/Error" });
        let operation = json!({
            "operationId": format!("{service}_{name}"),
            "tags": [service],
            "requestBody": { "content": content(media, &method.request) },
            "responses": {
                "200": { "description": method.answer, "content": content(media, &method.answer) },
                "default": error,
            },
        });
        paths.insert(method.path.clone(), json!({ "post": operation }));
    }
    let messages = json::schema().all_messages().filter(|message| !message.is_map_entry());
    let mut schemas: Map<String, Value> =
        messages.map(|message| (name(message.full_name()), of_message(&message))).collect();
    schemas.extend(json::schema().all_enums().map(|of| (name(of.full_name()), of_enum(&of))));
    schemas.insert(
        "Error".to_owned(),
        json!({
            "type": "object",
            "properties": {
                "code": { "type": "string" },
                "message": { "type": "string" },
                "details": { "type": "array", "items": { "type": "object" } },
            },
        }),
    );
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "simd",
            "version": env!("CARGO_PKG_VERSION"),
            "description": "Each method of the schema by the Connect protocol. Lengths are metres, angles radians, times seconds.",
        },
        "paths": paths,
        "components": {
            "schemas": schemas,
            "responses": { "Error": { "description": "a refused call", "content": content(UNARY, "Error") } },
            "securitySchemes": { "token": { "type": "http", "scheme": "bearer" } },
        },
        "security": [{}, { "token": [] }],
    })
}

fn content(media: &str, message: &str) -> Value {
    json!({ media: { "schema": reference(message) } })
}

fn reference(name: &str) -> Value {
    json!({ "$ref": format!("#/components/schemas/{name}") })
}

/// Returns the name of a schema: without this project's package.
fn name(full: &str) -> String {
    full.strip_prefix("simd.v1.").unwrap_or(full).to_owned()
}

fn of_enum(of: &EnumDescriptor) -> Value {
    let names: Vec<_> = of.values().map(|value| value.name().to_owned()).collect();
    json!({ "type": "string", "enum": names })
}

fn of_message(message: &MessageDescriptor) -> Value {
    if message.full_name() == "google.protobuf.Timestamp" {
        return json!({ "type": "string", "format": "date-time" });
    }
    let fields: Map<String, Value> =
        message.fields().map(|field| (field.json_name().to_owned(), of_field(&field))).collect();
    json!({ "type": "object", "properties": fields, "additionalProperties": false })
}

fn of_field(field: &FieldDescriptor) -> Value {
    if let Kind::Message(entry) = field.kind()
        && field.is_map()
    {
        return json!({ "type": "object", "additionalProperties": of_kind(&entry.map_entry_value_field().kind()) });
    }
    match field.cardinality() {
        Cardinality::Repeated => json!({ "type": "array", "items": of_kind(&field.kind()) }),
        Cardinality::Optional | Cardinality::Required => of_kind(&field.kind()),
    }
}

/// Returns the type of a value as protobuf's JSON has it.
fn of_kind(kind: &Kind) -> Value {
    match kind {
        // NaN and infinity are text.
        Kind::Double | Kind::Float => json!({ "type": ["number", "string"] }),
        Kind::Int32 | Kind::Sint32 | Kind::Sfixed32 => json!({ "type": "integer", "format": "int32" }),
        Kind::Uint32 | Kind::Fixed32 => json!({ "type": "integer", "minimum": 0 }),
        Kind::Int64 | Kind::Sint64 | Kind::Sfixed64 => {
            json!({ "type": ["string", "integer"], "format": "int64" })
        }
        Kind::Uint64 | Kind::Fixed64 => json!({ "type": ["string", "integer"], "format": "uint64" }),
        Kind::Bool => json!({ "type": "boolean" }),
        Kind::String => json!({ "type": "string" }),
        Kind::Bytes => json!({ "type": "string", "contentEncoding": "base64" }),
        Kind::Message(message) => reference(&name(message.full_name())),
        Kind::Enum(of) => reference(&name(of.full_name())),
    }
}

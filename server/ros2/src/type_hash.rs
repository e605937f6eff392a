//! RIHS01, the hash of a type in ROS 2 (REP-2016). It is the SHA-256 of a JSON text with all fields of the
//! type and of the types in it.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use sha2::{Digest as _, Sha256};

use crate::message::{Base, Count, Description, FieldType};

/// Number of a message type in type_description_interfaces/msg/FieldType.
const NESTED: u8 = 1;
/// Offsets on the number of an element's type for arrays, bounded sequences and sequences.
const ARRAY: u8 = 48;
const BOUNDED_SEQUENCE: u8 = 96;
const SEQUENCE: u8 = 144;

/// Returns `RIHS01_` and 64 hexadecimal digits.
pub fn rihs01(description: &Description) -> String {
    let mut inner = BTreeMap::new();
    collect(description, &mut inner);
    let referenced: Vec<String> = inner.values().map(|inner| json(inner)).collect();
    // Format of Python's `json.dumps`. No name needs escapes.
    let text = format!(
        "{{\"type_description\": {}, \"referenced_type_descriptions\": [{}]}}",
        json(description),
        referenced.join(", ")
    );
    let mut hash = String::from("RIHS01_");
    for byte in Sha256::digest(text.as_bytes()) {
        let _ = write!(hash, "{byte:02x}");
    }
    hash
}

fn collect<'a>(description: &'a Description, met: &mut BTreeMap<&'a str, &'a Description>) {
    for (_, field) in &description.fields {
        if let Base::Message(inner) = &field.base
            && met.insert(&inner.name, inner).is_none()
        {
            collect(inner, met);
        }
    }
}

fn json(description: &Description) -> String {
    let fields: Vec<String> =
        description.wire_fields().iter().map(|(name, field)| field_json(name, field)).collect();
    format!("{{\"type_name\": \"{}\", \"fields\": [{}]}}", description.name, fields.join(", "))
}

fn field_json(name: &str, field: &FieldType) -> String {
    let (id, nested) = match &field.base {
        Base::Primitive(_, id) => (*id, ""),
        Base::Message(inner) => (NESTED, inner.name.as_str()),
    };
    let (added, capacity) = match field.count {
        Count::One => (0, 0),
        Count::Array(count) => (ARRAY, count),
        Count::Sequence => (SEQUENCE, 0),
        Count::UpTo(count) => (BOUNDED_SEQUENCE, count),
    };
    format!(
        "{{\"name\": \"{name}\", \"type\": {{\"type_id\": {}, \"capacity\": {capacity}, \"string_capacity\": 0, \
         \"nested_type_name\": \"{nested}\"}}}}",
        id + added
    )
}

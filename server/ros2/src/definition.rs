//! The text definition of a type: its own fields, then the fields of each type in it, as `rosbag2` writes
//! them beside messages.

use std::fmt::Write as _;

use crate::message::{Base, Count, Description, FieldType};

/// Separator between two types, as MCAP's registry of encodings specifies for `ros2msg`.
const SEPARATOR: &str = "================================================================================";

/// Returns the definition of a type and of all types in it, each once, in order of their first use.
pub fn text(description: &Description) -> String {
    let mut met = Vec::new();
    collect(description, &mut met);
    let mut text = own(description);
    for other in met {
        // Writing to a string cannot fail.
        let _ = write!(text, "{SEPARATOR}\nMSG: {}\n{}", short(&other.name), own(other));
    }
    text
}

/// Collects the types in a type, without itself.
fn collect<'a>(description: &'a Description, met: &mut Vec<&'a Description>) {
    for (_, field) in &description.fields {
        if let Base::Message(inner) = &field.base
            && !met.iter().any(|other| other.name == inner.name)
        {
            met.push(inner);
            collect(inner, met);
        }
    }
}

fn own(description: &Description) -> String {
    let mut text = String::new();
    for (kind, name, value) in &description.constants {
        let _ = writeln!(text, "{kind} {name}={value}");
    }
    for (name, field) in &description.fields {
        let _ = writeln!(text, "{} {name}", spelled(field));
    }
    text
}

fn spelled(field: &FieldType) -> String {
    let base = match &field.base {
        Base::Primitive(name, _) => (*name).to_owned(),
        Base::Message(inner) => short(&inner.name),
    };
    match field.count {
        Count::One => base,
        Count::Array(count) => format!("{base}[{count}]"),
        Count::Sequence => format!("{base}[]"),
        Count::UpTo(count) => format!("{base}[<={count}]"),
    }
}

/// Shortens `geometry_msgs/msg/Vector3` to `geometry_msgs/Vector3`.
fn short(name: &str) -> String {
    name.replacen("/msg/", "/", 1)
}

//! Converts wire types to the daemon's own types and back, by named functions, for every front-end.
//!
//! * [`field`]: the path of a field, and the refusal of its value.
//! * [`from_proto`]: requests. Converted values are finite, named, known and in range.
//! * [`to_proto`]: messages of answers.
//! * [`selection`]: the joints that a client wants to see, resolved once per layout.

pub mod field;
pub mod from_proto;
pub mod selection;
pub mod to_proto;

pub use field::BadField;
pub use selection::Selection;

#[cfg(any(test, feature = "testing"))]
pub mod test_world;

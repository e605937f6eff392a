//! Reads the parts of glTF 2.0 files, as text and binary: the document, and the numbers in its buffers.
//!
//! * [`Document`]: the JSON, as far as it is read, and the binary part.
//! * [`Buffers`]: numbers in buffers.
//!
//! No library is used: the existing ones decode pictures, or compute with counts of a file before they check
//! its length. Nothing here recurses, and memory is bounded by the file's own bytes. Each error is a fragment
//! of a sentence.

mod accessor;
mod document;

pub use accessor::Buffers;
pub use document::{
    Accessor, Asset, Attributes, Buffer, BufferView, Document, Image, Material, Mesh, Node, Pbr, Primitive,
    Scene, Sparse, Texture, TextureInfo, data, read,
};

/// Mode of a primitive of triangles.
pub const TRIANGLES: u32 = 4;
/// Maximum number of vertices of a mesh.
pub const MAX_VERTICES: usize = 6_000_000;
/// Maximum number of bytes of a file's JSON.
pub const MAX_JSON_BYTES: usize = 32 << 20;
/// Maximum number of objects in a file's JSON.
pub const MAX_OBJECTS: usize = 250_000;
/// Maximum number of elements of buffers that are read for a file: repeated references count each time.
pub const MAX_ELEMENTS: usize = 50_000_000;

/// Converts a linear colour component, as in glTF, to sRGB (IEC 61966-2-1).
pub fn srgb(part: f64) -> f64 {
    let part = part.clamp(0.0, 1.0);
    if part <= 0.003_130_8 { 12.92 * part } else { 1.055 * part.powf(1.0 / 2.4) - 0.055 }
}

/// Quotes a word of the file for an error, and shortens it.
fn shown(word: &str) -> String {
    const MAX: usize = 40;
    match word.char_indices().nth(MAX) {
        Some((end, _)) => format!("{:?}...", word.get(..end).unwrap_or_default()),
        None => format!("{word:?}"),
    }
}

//! Bytes to text: the size cap, the byte order mark, the encoding.

use super::findings::Refusal;
use crate::limits;

/// The text without its byte order mark.
pub(super) fn decode(urdf: &[u8]) -> Result<&str, Refusal> {
    if urdf.len() > limits::URDF_BYTES {
        let (size, cap) = (urdf.len(), limits::URDF_BYTES);
        return Err(Refusal::of_file(format!("the URDF has {size} bytes; the most is {cap}")));
    }
    let bytes = urdf.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(urdf);
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
        return Err(Refusal::of_file("the URDF is UTF-16; save it as UTF-8".to_owned()));
    }
    std::str::from_utf8(bytes).map_err(|error| {
        let line = bytes.iter().take(error.valid_up_to()).filter(|byte| **byte == b'\n').count() + 1;
        Refusal::of_file(format!(
            "the URDF is not UTF-8: line {line} has a byte that is none; save it as UTF-8"
        ))
    })
}

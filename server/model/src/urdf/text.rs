//! Decodes bytes to text: size limit, byte order marks, encodings.

use std::borrow::Cow;

use super::findings::{Findings, Refusal};
use crate::limits::LoadLimits;
use crate::report::{Disposition, Severity};

/// Returns the text without its byte order mark. Text that is not UTF-8 is decoded by its declaration or its
/// appearance, and reported.
pub(crate) fn decode<'a>(
    urdf: &'a [u8],
    limits: &LoadLimits,
    findings: &mut Findings,
) -> Result<Cow<'a, str>, Refusal> {
    if urdf.len() > limits.urdf_bytes {
        let (size, cap) = (urdf.len(), limits.urdf_bytes);
        return Err(Refusal::of_file(format!("the URDF has {size} bytes; the limit is {cap}")));
    }
    if let Some(wide) = wide(urdf)? {
        let message = "the file is UTF-16, and is read as such".to_owned();
        findings.of_text(Severity::Info, Disposition::Used, None, message);
        return Ok(Cow::Owned(wide));
    }
    let bytes = urdf.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(urdf);
    let error = match std::str::from_utf8(bytes) {
        Ok(text) => return Ok(Cow::Borrowed(text)),
        Err(error) => error,
    };
    if !bytes.contains(&b'<') || bytes.iter().take(64).any(|byte| *byte == 0) {
        return Err(Refusal::of_file("this is not a URDF: it is not text".to_owned()));
    }
    let line = bytes.iter().take(error.valid_up_to()).filter(|byte| **byte == b'\n').count() + 1;
    let line = u32::try_from(line).unwrap_or(u32::MAX);
    if says_latin(bytes) {
        let message = "the file is read as ISO-8859-1, as it declares".to_owned();
        findings.of_text(Severity::Info, Disposition::Used, None, message);
    } else {
        let message = "a byte here is not UTF-8; the file is read as ISO-8859-1: save it as UTF-8".to_owned();
        findings.of_text(Severity::Warning, Disposition::Repaired, Some(line), message);
    }
    Ok(Cow::Owned(bytes.iter().map(|byte| char::from(*byte)).collect()))
}

/// Decodes UTF-16, which is recognised by its mark or by a zero next to the first `<`.
fn wide(urdf: &[u8]) -> Result<Option<String>, Refusal> {
    let read: fn([u8; 2]) -> u16 = match urdf {
        [0xFF, 0xFE, 0, 0, ..] | [0, 0, 0xFE, 0xFF, ..] => {
            return Err(Refusal::of_file("the URDF is UTF-32; save it as UTF-8".to_owned()));
        }
        [0xFF, 0xFE, ..] | [b'<', 0, _, 0, ..] => u16::from_le_bytes,
        [0xFE, 0xFF, ..] | [0, b'<', 0, _, ..] => u16::from_be_bytes,
        _ => return Ok(None),
    };
    let (pairs, rest) = urdf.as_chunks::<2>();
    let mut text = String::with_capacity(pairs.len());
    let mut line = 1;
    for character in char::decode_utf16(pairs.iter().map(|pair| read(*pair))) {
        let Ok(character) = character else {
            let message = "the URDF is broken UTF-16 here; save it as UTF-8".to_owned();
            return Err(Refusal::at(line, message));
        };
        line += u32::from(character == '\n');
        if character != '\u{feff}' || !text.is_empty() {
            text.push(character);
        }
    }
    if !rest.is_empty() {
        return Err(Refusal::of_file("the URDF is UTF-16 and ends within a character".to_owned()));
    }
    Ok(Some(text))
}

/// Returns whether the declaration names a single-byte encoding of Latin script.
fn says_latin(bytes: &[u8]) -> bool {
    let head: String = bytes.iter().take(200).map(|byte| char::from(*byte).to_ascii_lowercase()).collect();
    let Some((_, after)) = head.split_once("encoding") else { return false };
    let name = after.trim_start_matches([' ', '=', '"', '\'']);
    ["iso-8859-1", "iso8859-1", "latin1", "latin-1", "windows-1252", "cp1252", "us-ascii", "ascii"]
        .iter()
        .any(|known| name.starts_with(known))
}

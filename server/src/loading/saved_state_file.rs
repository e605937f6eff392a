//! A saved state's file as bytes: its header, its hash, and what bounds the memory that reading it takes.
//! `saved_state_file.proto` says how it is laid out.

use prost::Message as _;
use prost::encoding::{WireType, decode_key, decode_varint};
use simd_model::robot::Sha256;
use simd_proto::v1;

use crate::handle::CallError;

/// What a file begins with.
const MAGIC: &[u8; 8] = b"simdsave";

/// The newest format that is read, and the one that is written. It grows where a daemon that does not
/// know what is new would go on otherwise than the one that wrote it.
pub const FORMAT: u32 = 1;

/// Entries of lists of strings and messages, of all robots together: what is in memory takes some
/// fifty bytes for each, and in a file two. Far above a thousand robots with a hundred meshes each.
const MOST_ENTRIES: usize = 1_000_000;

/// A file that was opened.
#[derive(Debug)]
pub struct Opened {
    /// The release of the daemon that wrote it.
    pub written_by: String,
    /// What is in it.
    pub content: v1::SavedStateFile,
}

/// A file of this content.
pub fn seal(content: &v1::SavedStateFile) -> Vec<u8> {
    seal_encoded(&content.encode_to_vec())
}

/// A file of this content, encoded.
pub fn seal_encoded(content: &[u8]) -> Vec<u8> {
    let release = env!("CARGO_PKG_VERSION").as_bytes();
    // A release of more than 65,535 letters there is not.
    let length = u16::try_from(release.len()).unwrap_or(0).to_le_bytes();
    let rest = [&length, release, content].concat();
    let Sha256(hash) = Sha256::of(&rest);
    [&MAGIC[..], &FORMAT.to_le_bytes(), &hash, &rest].concat()
}

/// Opens a file for a daemon that takes so many robots.
///
/// # Errors
/// Where it is no saved state, is of a newer format, is damaged, or has more entries than it may.
pub fn open(file: &[u8], robots: usize) -> Result<Opened, CallError> {
    let Some((magic, rest)) = file.split_first_chunk::<8>() else { return Err(no_saved_state()) };
    let (Some((format, rest)), true) = (rest.split_first_chunk::<4>(), magic == MAGIC) else {
        return Err(no_saved_state());
    };
    match u32::from_le_bytes(*format) {
        FORMAT => {}
        0 => return Err(damaged("its format is 0, which there is not")),
        newer => {
            return Err(invalid(format!(
                "the saved state's file is of format {newer}, and this daemon reads up to {FORMAT}; the daemon is \
                 older: update the daemon, or export the state with this one"
            )));
        }
    }
    let Some((hash, rest)) = rest.split_first_chunk::<32>() else { return Err(damaged("it ends early")) };
    if Sha256::of(rest) != Sha256(*hash) {
        return Err(damaged("what is in it does not have the hash that its header says"));
    }
    let split = rest.split_first_chunk::<2>();
    let release = split.and_then(|(len, rest)| rest.split_at_checked(u16::from_le_bytes(*len).into()));
    let Some((release, content)) = release else { return Err(damaged("it ends early")) };
    let written_by = String::from_utf8_lossy(release).into_owned();
    bound(content, robots)?;
    let content = v1::SavedStateFile::decode(content).map_err(|error| damaged(&error.to_string()))?;
    Ok(Opened { written_by, content })
}

/// Counts what takes more memory than it has bytes, before it is decoded: a message of two bytes
/// becomes hundreds.
fn bound(content: &[u8], robots: usize) -> Result<(), CallError> {
    /// Of `SavedStateFile`.
    const ROBOTS: u32 = 9;
    let (mut found, mut entries) = (0, 0);
    let mut fields = Fields { rest: content };
    while let Some(field) = fields.next() {
        let (number, inside) = field.ok_or_else(|| damaged("it is no message"))?;
        entries += 1;
        if number == ROBOTS {
            found += 1;
            let mut of_robot = Fields { rest: inside };
            while let Some(field) = of_robot.next() {
                field.ok_or_else(|| damaged("one of its robots is no message"))?;
                entries += 1;
                if entries > MOST_ENTRIES {
                    break;
                }
            }
        }
        if found > robots {
            let what = "the number of robots in the saved state".into();
            return Err(CallError::LimitExceeded { what, value: found as u64, limit: robots as u64 });
        }
        if entries > MOST_ENTRIES {
            let what = "the number of entries in the saved state's file".into();
            return Err(CallError::LimitExceeded { what, value: entries as u64, limit: MOST_ENTRIES as u64 });
        }
    }
    Ok(())
}

/// The fields of an encoded message, one level deep: number, and the bytes of what has a length.
struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    /// The next; inside, `None` where the bytes are no message.
    fn next(&mut self) -> Option<Option<(u32, &'a [u8])>> {
        (!self.rest.is_empty()).then(|| self.field())
    }

    fn field(&mut self) -> Option<(u32, &'a [u8])> {
        let (number, wire) = decode_key(&mut self.rest).ok()?;
        let length = match wire {
            WireType::Varint => {
                decode_varint(&mut self.rest).ok()?;
                0
            }
            WireType::SixtyFourBit => 8,
            WireType::ThirtyTwoBit => 4,
            WireType::LengthDelimited => usize::try_from(decode_varint(&mut self.rest).ok()?).ok()?,
            WireType::StartGroup | WireType::EndGroup => return None,
        };
        let (inside, rest) = self.rest.split_at_checked(length)?;
        self.rest = rest;
        Some((number, inside))
    }
}

/// A refusal of a file.
pub fn invalid(message: impl Into<String>) -> CallError {
    CallError::InvalidSavedState { message: message.into() }
}

fn no_saved_state() -> CallError {
    invalid("the file is no saved state of simd: it does not begin as one")
}

fn damaged(why: &str) -> CallError {
    invalid(format!("the saved state's file is damaged: {why}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn content() -> v1::SavedStateFile {
        let robots = vec![v1::SavedStateRobot { name: "arm".into(), ..Default::default() }];
        v1::SavedStateFile { name: "a".into(), robots, files: vec![vec![7; 100]], ..Default::default() }
    }

    fn refusal(file: &[u8]) -> String {
        open(file, 10).unwrap_err().to_string()
    }

    #[test]
    fn a_file_that_was_sealed_is_opened() {
        let opened = open(&seal(&content()), 10).unwrap();
        assert_eq!((opened.content, &*opened.written_by), (content(), env!("CARGO_PKG_VERSION")));
    }

    #[test]
    fn a_newer_format_is_refused_and_says_who_is_older() {
        let mut file = seal(&content());
        file[8] = 2;
        let refusal = refusal(&file);
        assert!(refusal.contains("format 2") && refusal.contains("the daemon is older"), "{refusal}");
    }

    #[test]
    fn every_flipped_bit_and_every_cut_is_noticed() {
        let file = seal(&content());
        for bit in 0..8 * file.len() {
            let mut file = file.clone();
            file[bit / 8] ^= 1 << (bit % 8);
            assert!(matches!(open(&file, 10), Err(CallError::InvalidSavedState { .. })), "bit {bit}");
        }
        for end in 0..file.len() {
            assert!(
                matches!(open(&file[..end], 10), Err(CallError::InvalidSavedState { .. })),
                "cut at {end}"
            );
        }
        assert!(refusal(&[&file[..], b"x"].concat()).contains("damaged"));
        assert!(refusal(b"solid ascii\n").contains("no saved state of simd"));
    }

    #[test]
    fn entries_are_counted_before_they_take_memory() {
        let wrapped = seal_encoded;
        // Field 9, of no bytes: a robot.
        let robots = refusal(&wrapped(&[9 << 3 | 2, 0].repeat(11)));
        assert_eq!(robots, "the number of robots in the saved state would be 11, and the limit is 10");
        // Field 12: a file.
        let files = refusal(&wrapped(&[12 << 3 | 2, 0].repeat(MOST_ENTRIES + 1)));
        assert!(files.contains("entries"), "{files}");
        // Link properties, within a robot.
        let inside = [9 << 3 | 2, 0].repeat(MOST_ENTRIES);
        let mut robot = vec![9 << 3 | 2];
        prost::encoding::encode_varint(inside.len() as u64, &mut robot);
        robot.extend(inside);
        assert!(refusal(&wrapped(&robot)).contains("entries"));
        // A length of billions.
        assert!(refusal(&wrapped(&[9 << 3 | 2, 0xff, 0xff, 0xff, 0xff, 0x0f])).contains("damaged"));
    }
}

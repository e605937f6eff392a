//! Names of recordings and of their files: `NAME.mcap`, or `NAME.000001.mcap` and following if only the last
//! minutes are kept. A name has no dot, so that no file belongs to two recordings.

use std::path::Path;
use std::time::SystemTime;
use std::{fs, io};

use time::OffsetDateTime;

/// Maximum length of a name, characters.
const MAX_NAME: usize = 64;
/// Maximum length of a name, bytes: names of files have at most 255.
const MAX_NAME_BYTES: usize = 200;
/// Maximum number of files in the folder that are examined.
const MAX_FILES: usize = 100_000;

/// Returns whether a recording may have this name.
pub fn is_name(name: &str) -> bool {
    name.len() <= MAX_NAME_BYTES && name.chars().count() <= MAX_NAME && simd_model::is_wire_name(name)
}

/// Returns the name of its only file.
pub(super) fn single(name: &str) -> String {
    format!("{name}.mcap")
}

/// Returns the name of one of its files, from 1.
pub(super) fn numbered(name: &str, number: u64) -> String {
    format!("{name}.{number:06}.mcap")
}

/// Returns the recording of a file, and the file's number; 0 for the only file.
fn parse(file: &str) -> Option<(&str, u64)> {
    let stem = file.strip_suffix(".mcap")?;
    let (name, number) = match stem.split_once('.') {
        None => (stem, 0),
        Some((name, digits)) => {
            let number = digits.parse().ok().filter(|number| numbered(name, *number) == file)?;
            (name, number)
        }
    };
    is_name(name).then_some((name, number))
}

/// Returns all files of recordings in a folder, each with its recording's name: ordered by name, then by
/// number.
pub(super) fn files(directory: &Path) -> io::Result<Vec<(String, String)>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(directory)?.take(MAX_FILES) {
        let Ok(file) = entry?.file_name().into_string() else { continue };
        if let Some((name, number)) = parse(&file) {
            found.push((name.to_owned(), number, file));
        }
    }
    found.sort();
    Ok(found.into_iter().map(|(name, _, file)| (name, file)).collect())
}

/// Returns a name like `2026-03-01T12-00-00`, in UTC.
pub(super) fn of_time(time: SystemTime) -> String {
    let time = OffsetDateTime::from(time);
    let (hour, minute, second) = time.to_hms();
    format!(
        "{:04}-{:02}-{:02}T{hour:02}-{minute:02}-{second:02}",
        time.year(),
        u8::from(time.month()),
        time.day()
    )
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, UNIX_EPOCH};

    use super::*;

    #[test]
    fn names_are_plain() {
        for name in ["a", "Run_1", "2026-03-01T12-00-00", "Опыт-1", &"a".repeat(64), &"机".repeat(64)] {
            assert!(is_name(name), "{name}");
        }
        for name in [
            "",
            "a.b",
            "..",
            "a/b",
            "/etc/passwd",
            "ä b",
            "a b",
            "a\0",
            &"a".repeat(65),
            &"\u{1f916}".repeat(64),
        ] {
            assert!(!is_name(name), "{name:?}");
        }
    }

    #[test]
    fn files_are_those_of_names_and_no_others() {
        assert_eq!(parse("run.mcap"), Some(("run", 0)));
        assert_eq!(parse("run.000012.mcap"), Some(("run", 12)));
        assert_eq!(parse(&numbered("run", 12_345_678)), Some(("run", 12_345_678)));
        for other in ["run.mcap.part", ".mcap", "run.12.mcap", "run.x.mcap", "a.000001.000002.mcap", "run"] {
            assert_eq!(parse(other), None, "{other}");
        }
    }

    #[test]
    fn a_time_is_a_name_in_utc() {
        let at = |seconds| of_time(UNIX_EPOCH + Duration::from_secs(seconds));
        assert_eq!(at(0), "1970-01-01T00-00-00");
        assert_eq!(at(951_827_696), "2000-02-29T12-34-56");
        assert_eq!(at(4_107_542_399), "2100-02-28T23-59-59");
        assert!(is_name(&at(1_772_366_400)));
    }
}

//! Files that people wrote, or what comes by the standard input.

use std::{
    fs::File,
    io::{Read, stdin},
    path::Path,
};

use anyhow::{Context as _, ensure};

/// The text of a file of so many bytes at the most, also where it has no end; of `-` that of the standard input. Without the mark that
/// some editors begin a file with.
pub(crate) fn read(file: &Path, most: u64) -> anyhow::Result<String> {
    let name = || file.display().to_string();
    let mut bytes = Vec::new();
    let source: Box<dyn Read> = match file.to_str() {
        Some("-") => Box::new(stdin()),
        _ => Box::new(File::open(file).with_context(name)?),
    };
    // One more, so that what is too long shows.
    source.take(most + 1).read_to_end(&mut bytes).with_context(name)?;
    ensure!(
        bytes.len() as u64 <= most,
        "{} has more than {most} bytes, which are the most that can be read",
        name()
    );
    let text = String::from_utf8(bytes).with_context(name)?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_too_long_is_not_read_to_its_end() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("rays.txt");
        std::fs::write(&file, "\u{feff}0 0 2 0 0 -1\n").unwrap();
        assert_eq!(read(&file, 16).unwrap(), "0 0 2 0 0 -1\n");
        let refused = read(&file, 15).unwrap_err().to_string();
        assert!(refused.contains("more than 15 bytes") && refused.contains("rays.txt"), "{refused}");
        for (path, part) in
            [(folder.path().join("none.txt"), "none.txt"), (folder.path().into(), "directory")]
        {
            let refused = format!("{:#}", read(&path, 16).unwrap_err());
            assert!(refused.contains(part), "{refused}");
        }
        std::fs::write(&file, [0x30, 0xff]).unwrap();
        let refused = format!("{:#}", read(&file, 16).unwrap_err());
        assert!(refused.contains("rays.txt: invalid utf-8"), "{refused}");
    }

    /// Its size is 0, and it has no end.
    #[cfg(unix)]
    #[test]
    fn a_device_without_an_end_is_refused() {
        assert!(
            read(Path::new("/dev/zero"), 1_024).unwrap_err().to_string().contains("more than 1024 bytes")
        );
    }
}

//! Files that people write, or the standard input; and JSON in them.

use std::{
    fmt,
    fs::{self, File},
    io::{self, Read, stdin},
    marker::PhantomData,
    path::Path,
};

use anyhow::{Context as _, anyhow, ensure};
use serde::{
    Deserialize, Deserializer,
    de::{DeserializeOwned, MapAccess, Visitor, value::MapAccessDeserializer},
};

/// Reads a file of at most `most` bytes, even if it has no end; `-` is the standard input. Removes the byte
/// order mark of some editors.
pub(crate) fn read(file: &Path, most: u64) -> anyhow::Result<String> {
    let name = || file.display().to_string();
    let mut bytes = Vec::new();
    let source: Box<dyn Read> = match file.to_str() {
        Some("-") => Box::new(stdin()),
        _ => Box::new(File::open(file).with_context(name)?),
    };
    // One byte more, to detect a file that is too long.
    source.take(most + 1).read_to_end(&mut bytes).with_context(name)?;
    ensure!(
        bytes.len() as u64 <= most,
        "{} has more than {most} bytes, which are the most that can be read",
        name()
    );
    let text = String::from_utf8(bytes).map_err(|error| {
        let before = error.as_bytes().iter().take(error.utf8_error().valid_up_to());
        let line = before.filter(|byte| **byte == b'\n').count() + 1;
        anyhow!("{} is not text in UTF-8: see line {line}, and save it as UTF-8", name())
    })?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

/// Reads a file of any length.
pub(crate) fn read_whole(file: &Path) -> io::Result<String> {
    let no_text = |_| io::Error::new(io::ErrorKind::InvalidData, "it is not text in UTF-8");
    String::from_utf8(fs::read(file)?).map_err(no_text)
}

/// Returns a part of a file for an error: a file of another kind may have one endless line.
pub(crate) fn shown(part: &str) -> String {
    const MAX: usize = 40;
    let part = part.trim();
    match part.char_indices().nth(MAX) {
        Some((end, _)) => format!("{}…", &part[..end]),
        None => part.to_owned(),
    }
}

/// Parses a JSON document.
pub(crate) fn from_json<T: DeserializeOwned>(text: &str) -> anyhow::Result<T> {
    serde_json::from_str(text).map_err(|error| anyhow::Error::msg(in_words(&error)))
}

/// Requires an object in a document. Serde alone would also accept a list of its values in the order of
/// Rust's fields, which the author of a document cannot know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Object<T>(pub(crate) T);

struct ObjectVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for ObjectVisitor<T> {
    type Value = Object<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        T::deserialize(MapAccessDeserializer::new(map)).map(Object)
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Object<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(ObjectVisitor(PhantomData::<T>))
    }
}

/// Expected types, by serde's Rust names, and in words of JSON.
const EXPECTED: [(&str, &str); 2] = [("f64", "a number"), ("u32", "a whole number from 0 to 4294967295")];

/// Describes a fault of a document without Rust's names, which its author need not know.
fn in_words(error: &serde_json::Error) -> String {
    let whole = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    // An error without a place is not about the text.
    let Some(said) = whole.strip_suffix(&place) else { return whole };
    if let Some(what) = said.strip_prefix("EOF while parsing ") {
        return format!("it ends within {what}{place}");
    }
    // The value in the document comes before that.
    let Some((before, expected)) = said.rsplit_once("expected ") else { return whole };
    let known = EXPECTED.iter().find(|(in_rust, _)| *in_rust == expected).map(|(_, in_json)| *in_json);
    let expected = known.or_else(|| expected.starts_with("struct ").then_some("an object"));
    expected.map_or_else(|| whole.clone(), |expected| format!("{before}expected {expected}{place}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_too_long_is_not_read_to_its_end() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("rays.txt");
        fs::write(&file, "\u{feff}0 0 2 0 0 -1\n").unwrap();
        assert_eq!(read(&file, 16).unwrap(), "0 0 2 0 0 -1\n");
        let refused = read(&file, 15).unwrap_err().to_string();
        assert!(refused.contains("more than 15 bytes") && refused.contains("rays.txt"), "{refused}");
        for (path, part) in
            [(folder.path().join("none.txt"), "none.txt"), (folder.path().into(), "directory")]
        {
            let refused = format!("{:#}", read(&path, 16).unwrap_err());
            assert!(refused.contains(part), "{refused}");
        }
    }

    #[test]
    fn files_that_are_not_text_are_refused_with_their_line() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("rays.txt");
        fs::write(&file, b"0 0 2\n\n# 90\xb0\n").unwrap();
        let refused = format!("{:#}", read(&file, 16).unwrap_err());
        assert!(refused.contains("rays.txt is not text in UTF-8: see line 3, and save it"), "{refused}");
        assert_eq!(read_whole(&file).unwrap_err().to_string(), "it is not text in UTF-8");
        assert_eq!(read_whole(&folder.path().join("none")).unwrap_err().kind(), io::ErrorKind::NotFound);
    }

    #[test]
    fn faults_of_a_document_are_reported_without_names_of_rust() {
        #[derive(Debug, serde::Deserialize)]
        struct Document {
            value: f64,
            steps: Option<u32>,
        }
        let read: Document = from_json(r#"{"value": 0.5, "steps": 3}"#).unwrap();
        assert_eq!((read.value, read.steps), (0.5, Some(3)));
        for (text, sentence) in [
            ("1", "invalid type: integer `1`, expected an object at line 1"),
            ("[0.5]", "expected an object at line 1"),
            (r#"{"value": "expected f64"}"#, "string \"expected f64\", expected a number at line 1"),
            (r#"{"value": 1, "steps": -1}"#, "integer `-1`, expected a whole number from 0 to"),
            ("{\"value\": 1,\n\"steps\": 0.5}", "expected a whole number from 0 to 4294967295 at line 2"),
            (r#"{"value": 1"#, "it ends within an object at line 1"),
            (r#"{"steps": 1}"#, "missing field `value`"),
            ("{]", "at line 1"),
        ] {
            let said = from_json::<Document>(text).unwrap_err().to_string();
            assert!(said.contains(sentence), "{text}: {said}");
        }
    }

    #[test]
    fn a_list_is_not_an_object_however_many_values_it_has() {
        #[derive(Debug, Default, PartialEq, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        struct Range {
            low: f64,
            high: f64,
        }
        let read: Vec<Object<Range>> = from_json(r#"[{"low": 1, "high": 2}, {}]"#).unwrap();
        assert_eq!(read, [Object(Range { low: 1.0, high: 2.0 }), Object(Range::default())]);
        for list in ["[]", "[1]", "[1, 2]", "[1, 2, 3]"] {
            let said = from_json::<Vec<Object<Range>>>(&format!("[{{}},\n{list}]")).unwrap_err().to_string();
            assert!(said.contains("sequence, expected an object at line 2"), "{list}: {said}");
        }
        // Faults inside of an object are reported as without the requirement.
        for (text, sentence) in [
            ("{\"low\": 1,\n\"least\": 0}", "unknown field `least`, expected `low` or `high` at line 2"),
            ("{\"low\": 1,\n\"high\": \"2\"}", "string \"2\", expected a number at line 2"),
            ("{\"low\": 1", "it ends within an object at line 1"),
        ] {
            let said = from_json::<Object<Range>>(text).unwrap_err().to_string();
            assert!(said.contains(sentence), "{text}: {said}");
        }
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

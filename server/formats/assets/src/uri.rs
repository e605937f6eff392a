//! Parses the `filename` attributes of a URDF.

use crate::Why;

/// A URI, by its kind of lookup.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Uri {
    /// `package://NAME/rest` and `model://NAME/rest`.
    Package { name: String, rest: String },
    /// `file:///path` and `/path`.
    Absolute(String),
    /// A path from the URDF's folder.
    Relative(String),
}

/// Returns the readings of a URI, the literal one first: a `%20` is sometimes part of a file's real name. The
/// error is a phrase about the URI.
pub(crate) fn readings(uri: &str) -> Result<Vec<Uri>, Why> {
    let text = uri.trim().replace('\\', "/");
    if text.is_empty() {
        return Err(Why::Empty);
    }
    if text.contains("$(") || text.contains("${") {
        return Err(Why::Xacro);
    }
    let mut readings = vec![parse(&text)?];
    if let Some(decoded) = percent_decoded(&text) {
        // Decoding may have added characters with a meaning.
        let decoded = parse(&decoded.replace('\\', "/"))?;
        if !readings.contains(&decoded) {
            readings.push(decoded);
        }
    }
    Ok(readings)
}

fn parse(text: &str) -> Result<Uri, Why> {
    if text.contains('\0') {
        return Err(Why::Null);
    }
    let Some((scheme, path)) = text.split_once("://") else {
        // `file:/a` is short for `file:///a`.
        return path_of(text.strip_prefix("file:").filter(|path| path.starts_with('/')).unwrap_or(text));
    };
    match scheme.to_ascii_lowercase().as_str() {
        "package" | "model" => {
            let (name, rest) = path.split_once('/').ok_or(Why::NoFile)?;
            if name == "." || name == ".." {
                return Err(Why::NoPackage);
            }
            if rest.is_empty() {
                return Err(Why::NoFile);
            }
            Ok(Uri::Package { name: name.to_owned(), rest: rest.trim_start_matches('/').to_owned() })
        }
        "file" => {
            let path = path.strip_prefix("localhost").filter(|p| p.starts_with('/')).unwrap_or(path);
            // Two slashes instead of three are a common mistake for a relative path.
            if path.is_empty() { Err(Why::NoFile) } else { path_of(path) }
        }
        "http" | "https" | "ftp" => Err(Why::Network),
        _ => Err(Why::Scheme),
    }
}

/// Parses the part after a scheme, or a path without one.
fn path_of(path: &str) -> Result<Uri, Why> {
    let bytes = path.trim_start_matches('/').as_bytes();
    if matches!(bytes, [drive, b':', b'/', ..] if drive.is_ascii_alphabetic()) {
        return Err(Why::Windows);
    }
    let path = path.to_owned();
    Ok(if path.starts_with('/') { Uri::Absolute(path) } else { Uri::Relative(path) })
}

/// Returns the decoded text. `None` if there is nothing to decode or the result is not text.
fn percent_decoded(text: &str) -> Option<String> {
    if !text.contains('%') {
        return None;
    }
    let mut decoded = Vec::with_capacity(text.len());
    let mut bytes = text.bytes();
    while let Some(byte) = bytes.next() {
        let mut ahead = bytes.clone();
        let code = match (byte, ahead.next().and_then(hex), ahead.next().and_then(hex)) {
            (b'%', Some(high), Some(low)) => high * 16 + low,
            _ => {
                decoded.push(byte);
                continue;
            }
        };
        decoded.push(code);
        bytes = ahead;
    }
    String::from_utf8(decoded).ok()
}

fn hex(digit: u8) -> Option<u8> {
    char::from(digit).to_digit(16).and_then(|d| u8::try_from(d).ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn package(name: &str, rest: &str) -> Uri {
        Uri::Package { name: name.into(), rest: rest.into() }
    }

    #[test]
    fn a_package_name_may_hold_spaces_dots_and_dashes() {
        let read = readings("package://Robot arm-v1.2/meshes/base link.STL").unwrap();
        assert_eq!(read, [package("Robot arm-v1.2", "meshes/base link.STL")]);
    }

    #[test]
    fn percent_codes_are_read_literally_first_and_then_decoded() {
        let read = readings("package://my%20arm/a%2g.stl").unwrap();
        assert_eq!(read, [package("my%20arm", "a%2g.stl"), package("my arm", "a%2g.stl")]);
    }

    #[test]
    fn model_uris_backslashes_and_capital_schemes_are_read_alike() {
        assert_eq!(readings("model://arm/meshes/a.stl").unwrap(), [package("arm", "meshes/a.stl")]);
        assert_eq!(readings("Package:\\\\arm\\meshes\\a.stl").unwrap(), [package("arm", "meshes/a.stl")]);
    }

    #[test]
    fn file_uris_are_absolute_with_three_slashes_and_relative_with_two() {
        assert_eq!(readings("file:///a/b.stl").unwrap(), [Uri::Absolute("/a/b.stl".into())]);
        assert_eq!(readings("file://localhost/b.stl").unwrap(), [Uri::Absolute("/b.stl".into())]);
        assert_eq!(readings("file://meshes/b.stl").unwrap(), [Uri::Relative("meshes/b.stl".into())]);
        assert_eq!(readings("file:/a/b.stl").unwrap(), [Uri::Absolute("/a/b.stl".into())]);
    }

    #[test]
    fn unusable_uris_are_refused_with_a_phrase() {
        for (uri, why) in [
            ("", Why::Empty),
            ("https://a/b.stl", Why::Network),
            ("package://arm", Why::NoFile),
            ("package://../b.stl", Why::NoPackage),
            ("gopher://a/b.stl", Why::Scheme),
            ("$(find arm)/b.stl", Why::Xacro),
            ("a%00.stl", Why::Null),
            ("C:\\cad\\b.stl", Why::Windows),
            ("file:///C:/cad/b.stl", Why::Windows),
        ] {
            assert_eq!(readings(uri).unwrap_err(), why, "{uri}");
        }
    }
}

//! Takes apart what a URDF writes in `filename`.

/// A URI, by the way it is looked up.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Uri {
    /// `package://NAME/rest` and `model://NAME/rest`.
    Package { name: String, rest: String },
    /// `file:///path` and `/path`.
    Absolute(String),
    /// A path from the URDF's folder.
    Relative(String),
}

/// The readings of a URI, the literal one first: a `%20` is rarely, but
/// sometimes, part of a file's real name. The error is a phrase about the URI.
pub(crate) fn readings(uri: &str) -> Result<Vec<Uri>, &'static str> {
    let text = uri.trim().replace('\\', "/");
    if text.is_empty() {
        return Err("is empty");
    }
    if text.contains("$(") || text.contains("${") {
        return Err("is an unexpanded xacro expression: run xacro on the file first");
    }
    let mut readings = vec![parse(&text)?];
    if let Some(decoded) = percent_decoded(&text) {
        // Decoding may have brought in characters with a meaning.
        let decoded = parse(&decoded.replace('\\', "/"))?;
        if !readings.contains(&decoded) {
            readings.push(decoded);
        }
    }
    Ok(readings)
}

fn parse(text: &str) -> Result<Uri, &'static str> {
    if text.contains('\0') {
        return Err("holds a null character");
    }
    let Some((scheme, path)) = text.split_once("://") else {
        return Ok(if is_absolute(text) {
            Uri::Absolute(text.to_owned())
        } else {
            Uri::Relative(text.to_owned())
        });
    };
    match scheme.to_ascii_lowercase().as_str() {
        "package" | "model" => {
            let (name, rest) = path.split_once('/').ok_or("names a package and no file in it")?;
            if name == "." || name == ".." {
                return Err("names no package");
            }
            if rest.is_empty() {
                return Err("names a package and no file in it");
            }
            Ok(Uri::Package { name: name.to_owned(), rest: rest.trim_start_matches('/').to_owned() })
        }
        "file" => {
            let path = path.strip_prefix("localhost").filter(|p| p.starts_with('/')).unwrap_or(path);
            if path.is_empty() {
                Err("names no file")
            } else if is_absolute(path) {
                Ok(Uri::Absolute(path.to_owned()))
            } else {
                // Two slashes instead of three: a common slip, meant as a relative path.
                Ok(Uri::Relative(path.to_owned()))
            }
        }
        "http" | "https" | "ftp" => Err("is a network address, and nothing is fetched from the network"),
        _ => Err("has a scheme other than package, model and file"),
    }
}

/// Also of a Windows path, which no other system would take for absolute.
fn is_absolute(path: &str) -> bool {
    let bytes = path.trim_start_matches('/').as_bytes();
    path.starts_with('/') || matches!(bytes, [drive, b':', b'/', ..] if drive.is_ascii_alphabetic())
}

/// `None` where there is nothing to decode or the result is not text.
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
        assert_eq!(readings("C:\\cad\\b.stl").unwrap(), [Uri::Absolute("C:/cad/b.stl".into())]);
    }

    #[test]
    fn what_cannot_be_looked_up_is_refused_with_a_phrase() {
        for (uri, phrase) in [
            ("", "is empty"),
            ("https://a/b.stl", "network"),
            ("package://arm", "no file in it"),
            ("package://../b.stl", "names no package"),
            ("gopher://a/b.stl", "scheme"),
            ("$(find arm)/b.stl", "xacro"),
            ("a%00.stl", "null"),
        ] {
            let refused = readings(uri).unwrap_err();
            assert!(refused.contains(phrase), "{uri}: {refused}");
        }
    }
}

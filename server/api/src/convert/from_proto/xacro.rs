//! Requests to expand xacro.

use std::collections::BTreeMap;

use bytes::Bytes;
use simd_proto::v1;

use crate::convert::field::{BadField, Path};
use simd_world::handle::XacroFiles;

/// Maximum number of files in a request, and of bytes and steps in the path of one.
const FILES: usize = 2_000;
const PATH_BYTES: usize = 512;
const STEPS: usize = 32;

/// Parses a xacro file and the files that it may include.
pub fn files(request: v1::ExpandXacroRequest) -> Result<XacroFiles, BadField> {
    let v1::ExpandXacroRequest { files, path, arguments } = request;
    let root = Path::ROOT;
    if files.len() > FILES {
        return Err(root.field("files").refuse(files.len(), format!("it must be at most {FILES} files")));
    }
    for name in files.keys() {
        let refuse = |expected| root.entry("files", name).refuse(format_args!("{name:?}"), expected);
        let is_step = |step: &str| !step.is_empty() && step != "." && step != "..";
        if name.len() > PATH_BYTES || name.split('/').count() > STEPS {
            let expected = format!("it must be a path of at most {PATH_BYTES} bytes and {STEPS} steps");
            return Err(refuse(expected));
        }
        if !name.split('/').all(is_step) || name.contains(['\0', '\\']) {
            let expected = "it must be a path without a `/` at its ends, `\\`, and the steps `.` and `..`";
            return Err(refuse(expected.into()));
        }
        let mut above = name.as_str();
        while let Some((folder, _)) = above.rsplit_once('/') {
            if files.contains_key(folder) {
                return Err(refuse(format!("it must not be in {folder:?}, which is a file")));
            }
            above = folder;
        }
    }
    if !files.contains_key(&path) {
        return Err(root.field("path").refuse(format_args!("{path:?}"), "it must be one of the files"));
    }
    let files: BTreeMap<String, Bytes> =
        files.into_iter().map(|(name, bytes)| (name, bytes.into())).collect();
    Ok(XacroFiles { files, path, arguments })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(names: &[&str], path: &str) -> v1::ExpandXacroRequest {
        let files = names.iter().map(|name| ((*name).to_owned(), b"<robot/>".to_vec())).collect();
        v1::ExpandXacroRequest { files, path: path.to_owned(), arguments: BTreeMap::new() }
    }

    #[test]
    fn paths_that_could_leave_the_folder_or_cannot_be_written_are_refused() {
        let names = ["", "/a", "a/", "a//b", "./a", "a/./b", "../a", "a/../../b", "a\\b", "a\0b"];
        for name in names {
            let refused = files(request(&[name], name)).unwrap_err();
            assert!(refused.expected.contains("a path without"), "{name:?}: {refused}");
        }
        let long = format!("{}/a", "b".repeat(PATH_BYTES));
        let deep = "a/".repeat(STEPS) + "b";
        for name in [long, deep] {
            assert!(files(request(&[&name], &name)).unwrap_err().expected.contains("at most"));
        }
        let within = files(request(&["a/b/c", "a/b"], "a/b")).unwrap_err();
        assert!(within.expected.contains("\"a/b\", which is a file"), "{within}");
    }

    #[test]
    fn the_expanded_path_must_be_one_of_the_files() {
        assert_eq!(files(request(&["arm/a.xacro"], "arm/a.xacro")).unwrap().files.len(), 1);
        let refused = files(request(&["arm/a.xacro"], "a.xacro")).unwrap_err();
        assert_eq!(refused.field, "path");
    }
}

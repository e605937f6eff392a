//! Finds the description file of a robot's path.

use std::path::{Path, PathBuf};

/// Reason why a path has no URDF, as a sentence that names it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoUrdf {
    /// Nothing exists there, or it is not readable.
    #[error("cannot read {path}: {reason}", path = path.display())]
    Unreadable {
        /// Requested path.
        path: PathBuf,
        /// Message of the system.
        reason: String,
    },
    /// Something else exists there.
    #[error("{path} {reason}", path = path.display())]
    Unfit {
        /// Requested path.
        path: PathBuf,
        /// Description of what exists there, as the rest of the sentence.
        reason: String,
    },
}

/// Returns the URDF file of a path: the file itself, or the only `.urdf` in a folder. If the folder has none,
/// its folder `urdf` is searched.
///
/// # Errors
/// [`NoUrdf`] if there is none, if there are several, or if the file needs xacro first.
pub fn find_urdf(path: &Path) -> Result<PathBuf, NoUrdf> {
    find(path, None).and_then(no_xacro)
}

/// Like [`find_urdf`], below a folder: a folder `urdf` that is a link out of it is ignored.
///
/// # Errors
/// As [`find_urdf`].
pub fn find_urdf_within(root: &Path, path: &Path) -> Result<PathBuf, NoUrdf> {
    find(path, Some(root)).and_then(no_xacro)
}

/// Returns the description file of a path: as [`find_urdf`], or a `.xacro` file, or the only `.urdf.xacro` if
/// there is no `.urdf`.
///
/// # Errors
/// [`NoUrdf`] if there is none, or if there are several.
pub fn find_description(path: &Path) -> Result<PathBuf, NoUrdf> {
    find(path, None)
}

/// Returns whether a file must be expanded to a URDF, by its name.
pub fn is_xacro(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("xacro"))
}

/// Returns whether a text must be expanded, whatever the file's extension: it has xacro's own elements
/// outside of comments. Calls of macros do not count: xacro leaves an unknown macro unchanged.
pub fn has_xacro(text: &[u8]) -> bool {
    const DIRECTIVES: [&str; 10] = [
        "arg",
        "attribute",
        "call",
        "element",
        "if",
        "include",
        "insert_block",
        "macro",
        "property",
        "unless",
    ];
    let text = String::from_utf8_lossy(text);
    let mut rest: &str = &text;
    while let Some(open) = rest.find('<') {
        let tag = rest.get(open..).unwrap_or_default();
        if tag.starts_with("<!--") {
            let Some(end) = tag.find("-->") else { return false };
            rest = tag.get(end + 3..).unwrap_or_default();
            continue;
        }
        let name = tag.strip_prefix("<xacro:").unwrap_or_default();
        let end = name.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(name.len());
        if DIRECTIVES.contains(&name.get(..end).unwrap_or_default()) {
            return true;
        }
        rest = tag.get(1..).unwrap_or_default();
    }
    false
}

fn no_xacro(path: PathBuf) -> Result<PathBuf, NoUrdf> {
    if is_xacro(&path) {
        let reason = "is a xacro file, which clients expand; send it from there, or run `xacro` on it";
        return Err(unfit(&path, reason));
    }
    Ok(path)
}

fn find(path: &Path, root: Option<&Path>) -> Result<PathBuf, NoUrdf> {
    let metadata = std::fs::metadata(path).map_err(|error| unreadable(path, &error))?;
    if metadata.is_dir() {
        return only_urdf(path, root);
    }
    if metadata.is_file() {
        Ok(path.to_path_buf())
    } else {
        Err(unfit(path, "is neither a file nor a folder"))
    }
}

fn only_urdf(folder: &Path, root: Option<&Path>) -> Result<PathBuf, NoUrdf> {
    let inner = folder.join("urdf");
    let is_inside = root.is_none_or(|root| crate::below(root, &inner).is_some());
    for ending in [".urdf", ".urdf.xacro", "model.sdf"] {
        let mut found = files_in(folder, ending)?;
        if found.is_empty() && is_inside && inner.is_dir() {
            found = files_in(&inner, ending)?;
        }
        match found.as_slice() {
            [only] => return Ok(only.clone()),
            [] => {}
            several => {
                let names: Vec<String> = several.iter().map(|path| path.display().to_string()).collect();
                let reason = format!("holds several {ending} files; name one of {}", names.join(", "));
                return Err(unfit(folder, &reason));
            }
        }
    }
    Err(unfit(folder, "holds no .urdf file, and neither does a folder `urdf` in it"))
}

/// Lists the files in a folder with an ending, sorted, so that error messages are the same each time. A link
/// counts, whether or not its target exists.
fn files_in(folder: &Path, ending: &str) -> Result<Vec<PathBuf>, NoUrdf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|error| unreadable(folder, &error))? {
        let entry = entry.map_err(|error| unreadable(folder, &error))?;
        let ends = entry.file_name().to_string_lossy().to_ascii_lowercase().ends_with(ending);
        if ends && entry.file_type().is_ok_and(|kind| !kind.is_dir()) {
            found.push(entry.path());
        }
    }
    found.sort();
    Ok(found)
}

fn unreadable(path: &Path, error: &std::io::Error) -> NoUrdf {
    NoUrdf::Unreadable { path: path.to_path_buf(), reason: error.to_string() }
}

fn unfit(path: &Path, reason: &str) -> NoUrdf {
    NoUrdf::Unfit { path: path.to_path_buf(), reason: reason.to_owned() }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use tempfile::TempDir;

    use super::*;

    fn folder(files: &[&str]) -> TempDir {
        let dir = TempDir::new().unwrap();
        for file in files {
            let path = dir.path().join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, file).unwrap();
        }
        dir
    }

    #[test]
    fn a_package_folder_stands_for_its_only_urdf() {
        let dir = folder(&["urdf/arm.URDF", "urdf/arm.csv", "meshes/a.stl", "package.xml"]);
        assert_eq!(find_urdf(dir.path()).unwrap(), dir.path().join("urdf/arm.URDF"));
        assert_eq!(find_urdf(&dir.path().join("urdf")).unwrap(), dir.path().join("urdf/arm.URDF"));
    }

    #[test]
    fn several_urdfs_are_listed_for_one_to_be_chosen() {
        let dir = folder(&["b.urdf", "a.urdf"]);
        let sentence = find_urdf(dir.path()).unwrap_err().to_string();
        let (a, b) = (dir.path().join("a.urdf"), dir.path().join("b.urdf"));
        let end = format!("several .urdf files; name one of {}, {}", a.display(), b.display());
        assert!(sentence.ends_with(&end), "{sentence}");
    }

    #[test]
    fn a_folder_without_a_robot_a_missing_file_and_a_xacro_are_refused() {
        let dir = folder(&["macros.xacro", "README"]);
        let of = |path: &Path| find_urdf(path).unwrap_err().to_string();
        assert!(of(dir.path()).contains("holds no .urdf file"));
        assert!(of(&dir.path().join("none.urdf")).starts_with("cannot read /"));
        assert!(of(&dir.path().join("macros.xacro")).contains("is a xacro file"));
    }

    #[test]
    fn a_description_may_be_a_xacro_where_there_is_no_urdf() {
        let dir = folder(&["urdf/arm.urdf.xacro", "urdf/macros.xacro"]);
        let xacro = dir.path().join("urdf/arm.urdf.xacro");
        assert_eq!(find_description(dir.path()).unwrap(), xacro);
        assert!(find_urdf(dir.path()).unwrap_err().to_string().contains("is a xacro file"));
        fs::write(dir.path().join("urdf/arm.urdf"), "").unwrap();
        assert_eq!(find_description(dir.path()).unwrap(), dir.path().join("urdf/arm.urdf"));
        assert!(is_xacro(&xacro) && !is_xacro(&dir.path().join("urdf/arm.urdf")));
    }

    #[cfg(unix)]
    #[test]
    fn below_a_root_a_folder_that_leads_out_is_not_looked_into() {
        let dir = folder(&["root/arm/README", "secret/hidden.urdf"]);
        std::os::unix::fs::symlink(dir.path().join("secret"), dir.path().join("root/arm/urdf")).unwrap();
        let refused = find_urdf_within(&dir.path().join("root"), &dir.path().join("root/arm")).unwrap_err();
        assert!(refused.to_string().contains("holds no .urdf file"), "{refused}");
    }
}

//! Which file is meant by the path of a robot.

use std::path::{Path, PathBuf};

/// Why a path stands for no URDF, as a sentence that names it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoUrdf {
    /// There is nothing there, or nothing that can be read.
    #[error("cannot read {path}: {reason}", path = path.display())]
    Unreadable {
        /// What was asked for.
        path: PathBuf,
        /// The system's words.
        reason: String,
    },
    /// There is something else.
    #[error("{path} {reason}", path = path.display())]
    Unfit {
        /// What was asked for.
        path: PathBuf,
        /// What it is instead, as the rest of the sentence.
        reason: String,
    },
}

/// The URDF file that a path stands for: the file itself, or the only `.urdf` of
/// a folder or, where the folder has none, of its folder `urdf`.
///
/// # Errors
/// [`NoUrdf`] where there is none, or several to choose from, or where the file
/// needs xacro first.
pub fn find_urdf(path: &Path) -> Result<PathBuf, NoUrdf> {
    let metadata = std::fs::metadata(path).map_err(|error| unreadable(path, &error))?;
    let file = if metadata.is_dir() { only_urdf(path)? } else { path.to_path_buf() };
    if file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("xacro")) {
        return Err(unfit(path, "is a xacro file; run `xacro` on it and load what comes out"));
    }
    if !file.is_file() {
        return Err(unfit(path, "is neither a file nor a folder"));
    }
    Ok(file)
}

fn only_urdf(folder: &Path) -> Result<PathBuf, NoUrdf> {
    let mut found = urdfs_in(folder)?;
    let inner = folder.join("urdf");
    if found.is_empty() && inner.is_dir() {
        found = urdfs_in(&inner)?;
    }
    match found.as_slice() {
        [only] => Ok(only.clone()),
        [] => Err(unfit(folder, "holds no .urdf file, and neither does a folder `urdf` in it")),
        several => {
            let names: Vec<String> = several.iter().map(|path| path.display().to_string()).collect();
            Err(unfit(folder, &format!("holds several .urdf files; name one of {}", names.join(", "))))
        }
    }
}

/// Sorted, so that the sentence that lists them is the same each time.
fn urdfs_in(folder: &Path) -> Result<Vec<PathBuf>, NoUrdf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|error| unreadable(folder, &error))? {
        let path = entry.map_err(|error| unreadable(folder, &error))?.path();
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("urdf")) && path.is_file()
        {
            found.push(path);
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
        let dir = folder(&["arm.urdf.xacro"]);
        let of = |path: &Path| find_urdf(path).unwrap_err().to_string();
        assert!(of(dir.path()).contains("holds no .urdf file"));
        assert!(of(&dir.path().join("none.urdf")).starts_with("cannot read /"));
        assert!(of(&dir.path().join("arm.urdf.xacro")).contains("run `xacro`"));
    }
}

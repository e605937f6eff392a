//! Permitted and refused paths on the disk.

use std::fs;

use super::*;

/// Returns a root with a robot in `arm/urdf`, and a secret robot outside of it.
fn disk() -> (tempfile::TempDir, Roots) {
    let dir = tempfile::tempdir().unwrap();
    for file in ["root/arm/urdf/arm.urdf", "root/arm/meshes/a.stl", "secret/secret.urdf"] {
        let file = dir.path().join(file);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(&file, file.to_str().unwrap()).unwrap();
    }
    let roots = Roots::new(&[dir.path().join("root")]).unwrap();
    (dir, roots)
}

fn refusal(roots: &Roots, path: impl AsRef<Path>) -> CallError {
    roots.find(path.as_ref().to_str().unwrap()).unwrap_err()
}

#[test]
fn a_robot_below_a_root_is_found_by_file_by_folder_and_by_relative_path() {
    let (dir, roots) = disk();
    let root = dir.path().join("root").canonicalize().unwrap();
    let urdf = root.join("arm/urdf/arm.urdf");
    for path in [root.join("arm"), urdf.clone(), "arm".into(), "./arm/urdf/../urdf".into()] {
        let found = roots.find(path.to_str().unwrap()).unwrap();
        assert_eq!(found, OnDisk { urdf: urdf.clone(), root: Some(root.clone()) });
    }
}

#[test]
fn without_a_root_the_refusal_says_how_to_have_one() {
    let refused = refusal(&Roots::default(), "arm");
    assert!(matches!(&refused, CallError::PathNotAllowed { message } if message.contains("--asset-root")));
}

#[test]
fn outside_of_the_roots_a_client_does_not_learn_what_exists() {
    let (dir, roots) = disk();
    let there = dir.path().join("secret/secret.urdf");
    let not_there = dir.path().join("secret/other.urdf");
    for path in [there, not_there, "../secret/secret.urdf".into(), "/etc/passwd".into()] {
        let refused = refusal(&roots, &path);
        assert!(matches!(refused, CallError::PathNotAllowed { .. }), "{}: {refused}", path.display());
        assert!(refused.to_string().ends_with("is not below one of the daemon's asset roots"), "{refused}");
    }
    assert!(matches!(refusal(&roots, "arm/none.urdf"), CallError::FileNotFound { .. }));
}

#[cfg(unix)]
#[test]
fn a_symbolic_link_out_of_a_root_is_refused() {
    let (dir, roots) = disk();
    let secret = dir.path().join("secret");
    std::os::unix::fs::symlink(&secret, dir.path().join("root/folder")).unwrap();
    fs::create_dir(dir.path().join("root/linked")).unwrap();
    std::os::unix::fs::symlink(secret.join("secret.urdf"), dir.path().join("root/linked/a.urdf")).unwrap();
    for path in ["folder", "folder/secret.urdf", "linked", "linked/a.urdf"] {
        let refused = refusal(&roots, path);
        assert!(matches!(refused, CallError::PathNotAllowed { .. }), "{path}: {refused}");
    }
}

#[cfg(unix)]
#[test]
fn through_a_link_out_of_a_root_a_client_does_not_learn_what_exists() {
    let (dir, roots) = disk();
    std::os::unix::fs::symlink(dir.path().join("secret"), dir.path().join("root/folder")).unwrap();
    let [there, not_there] =
        ["folder/secret.urdf", "folder/other.urdf"].map(|path| refusal(&roots, path).to_string());
    assert_eq!(there.replace("secret.urdf", "other.urdf"), not_there);
    assert!(there.contains("leads out of the asset roots"), "{there}");
}

#[test]
fn meshes_are_found_below_the_root_and_missing_ones_name_the_places() {
    let (_dir, roots) = disk();
    let assets = DiskAssets::new(&roots.find("arm").unwrap(), 1 << 20);
    let found = assets.find("package://arm/meshes/a.stl").unwrap();
    assert!(found.bytes.ends_with(b"a.stl"));
    let places = assets.find("package://arm/meshes/b.stl").unwrap_err();
    assert!(places.iter().any(|place| place.ends_with("arm/meshes/b.stl")), "{places:?}");
    assert_eq!(assets.into_files().len(), 1);
}

#[test]
fn a_file_beyond_the_limit_is_not_read() {
    let (dir, _roots) = disk();
    let path = dir.path().join("secret/secret.urdf");
    assert!(matches!(read_file(&path, 3), Err(CallError::LimitExceeded { limit: 3, .. })));
}

#[test]
fn a_root_that_is_not_a_folder_is_named() {
    let (dir, _roots) = disk();
    let missing = dir.path().join("none");
    assert_eq!(Roots::new(std::slice::from_ref(&missing)).unwrap_err().0, missing);
}

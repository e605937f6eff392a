//! Tests of the search, on packages in temporary folders.

use std::fs;

use tempfile::TempDir;

use super::*;

/// Returns a folder with files in it, by their paths.
fn tree(files: &[&str]) -> TempDir {
    let dir = TempDir::new().unwrap();
    for file in files {
        let path = dir.path().join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, format!("<package><name>{}</name></package>", "from_manifest")).unwrap();
    }
    dir
}

fn real(dir: &TempDir, path: &str) -> PathBuf {
    dir.path().join(path).canonicalize().unwrap()
}

#[test]
fn a_package_is_found_by_the_name_of_a_folder_above_the_urdf() {
    let dir = tree(&["Robot arm-v1.2/urdf/arm.urdf", "Robot arm-v1.2/meshes/base link.STL"]);
    let locator = Locator::new(&dir.path().join("Robot arm-v1.2/urdf/arm.urdf"));
    let expected = real(&dir, "Robot arm-v1.2/meshes/base link.STL");
    for uri in [
        "package://Robot arm-v1.2/meshes/base link.STL",
        "package://Robot%20arm-v1.2/meshes/base%20link.STL",
        "model://Robot arm-v1.2/meshes/base link.STL",
        "package://Robot arm-v1.2\\meshes\\base link.STL",
        "../meshes/base link.STL",
    ] {
        assert_eq!(locator.find(uri).as_ref(), Ok(&expected), "{uri}");
    }
}

#[test]
fn a_package_is_found_by_its_manifest_beside_the_urdf_and_after_renaming() {
    let dir = tree(&[
        "copy of arm/package.xml",
        "copy of arm/urdf/arm.urdf",
        "copy of arm/meshes/a.stl",
        "sensors/meshes/camera.dae",
    ]);
    let locator = Locator::new(&dir.path().join("copy of arm/urdf/arm.urdf"));
    let mesh = real(&dir, "copy of arm/meshes/a.stl");
    assert_eq!(locator.find("package://from_manifest/meshes/a.stl"), Ok(mesh.clone()));
    assert_eq!(locator.find("package://arm/meshes/a.stl"), Ok(mesh));
    assert_eq!(
        locator.find("package://sensors/meshes/camera.dae"),
        Ok(real(&dir, "sensors/meshes/camera.dae"))
    );
}

#[test]
fn the_package_map_comes_first() {
    let dir = tree(&["arm/urdf/arm.urdf", "arm/meshes/a.stl", "elsewhere/meshes/a.stl"]);
    let locator = Locator::new(&dir.path().join("arm/urdf/arm.urdf"))
        .with_package("arm", &dir.path().join("elsewhere"));
    assert_eq!(locator.find("package://arm/meshes/a.stl"), Ok(real(&dir, "elsewhere/meshes/a.stl")));
}

#[test]
fn a_missing_file_names_the_places_searched() {
    let dir = tree(&["arm/package.xml", "arm/urdf/arm.urdf"]);
    let missing =
        Locator::new(&dir.path().join("arm/urdf/arm.urdf")).find("package://arm/meshes/a.stl").unwrap_err();
    assert!(missing.places.contains(&dir.path().join("arm/meshes/a.stl")), "{missing:?}");
    let sentence = missing.to_string();
    assert!(sentence.starts_with("no file for `package://arm/meshes/a.stl`; searched /"), "{sentence}");
}

#[test]
fn relative_paths_may_leave_the_package_and_others_may_not() {
    let dir = tree(&["arm/package.xml", "arm/urdf/arm.urdf", "secret/a.stl"]);
    let secret = dir.path().join("secret/a.stl");
    let locator = Locator::new(&dir.path().join("arm/urdf/arm.urdf"));
    for (uri, phrase) in [
        ("package://arm/../secret/a.stl".to_owned(), "climbs out"),
        ("package://arm/%2e%2e/secret/a.stl".to_owned(), "climbs out"),
        (format!("file://{}", secret.display()), "absolute path outside"),
        (secret.display().to_string(), "absolute path outside"),
    ] {
        let refused = locator.find(&uri).unwrap_err();
        assert!(refused.reason().contains(phrase), "{uri}: {refused}");
    }
    assert_eq!(locator.find("../../secret/a.stl"), Ok(real(&dir, "secret/a.stl")));
    let missing = locator.find("../../secret/none.stl").unwrap_err();
    assert!(missing.reason().contains("no file for"), "{missing}");
    let within = locator.within(&dir.path().join("arm"));
    assert!(within.find("../../secret/a.stl").unwrap_err().reason().contains("climbs out"));
}

#[cfg(unix)]
#[test]
fn a_symbolic_link_of_a_package_uri_leads_nowhere_outside_of_the_package() {
    let dir = tree(&["arm/package.xml", "arm/urdf/arm.urdf", "arm/real/a.stl", "secret/a.stl"]);
    std::os::unix::fs::symlink(dir.path().join("secret"), dir.path().join("arm/meshes")).unwrap();
    std::os::unix::fs::symlink(dir.path().join("arm/real"), dir.path().join("arm/linked")).unwrap();
    let locator = Locator::new(&dir.path().join("arm/urdf/arm.urdf"));
    let refused = locator.find("package://arm/meshes/a.stl").unwrap_err();
    assert!(refused.reason().contains("symbolic link"), "{refused}");
    assert_eq!(locator.find("../meshes/a.stl"), Ok(real(&dir, "secret/a.stl")));
    assert_eq!(locator.find("package://arm/linked/a.stl"), Ok(real(&dir, "arm/real/a.stl")));
}

#[cfg(unix)]
#[test]
fn a_urdf_reached_through_a_link_finds_the_package_of_either_path() {
    let dir = tree(&["v17/urdf/arm.urdf", "v17/meshes/a.stl"]);
    std::os::unix::fs::symlink(dir.path().join("v17"), dir.path().join("arm")).unwrap();
    let locator = Locator::new(&dir.path().join("arm/urdf/arm.urdf"));
    for uri in ["package://arm/meshes/a.stl", "package://v17/meshes/a.stl", "../meshes/a.stl"] {
        assert_eq!(locator.find(uri), Ok(real(&dir, "v17/meshes/a.stl")), "{uri}");
    }
}

#[test]
fn only_meshes_and_images_are_given_away() {
    let dir = tree(&["arm/urdf/arm.urdf", ".ssh/id_rsa", "arm/meshes/a.stl"]);
    let locator = Locator::new(&dir.path().join("arm/urdf/arm.urdf"));
    let refused = locator.find("package://.ssh/id_rsa").unwrap_err();
    assert!(refused.reason().contains("not a mesh"), "{refused}");
}

#[test]
fn absolute_paths_are_found_inside_the_package_and_inside_the_root() {
    let dir = tree(&["arm/package.xml", "arm/urdf/arm.urdf", "arm/meshes/a.stl", "other/b.stl"]);
    let urdf = dir.path().join("arm/urdf/arm.urdf");
    let mesh = real(&dir, "arm/meshes/a.stl");
    let other = real(&dir, "other/b.stl");
    assert_eq!(Locator::new(&urdf).find(&format!("file://{}", mesh.display())), Ok(mesh.clone()));
    let rooted = Locator::new(&urdf).within(dir.path());
    assert_eq!(rooted.find(other.to_str().unwrap()), Ok(other.clone()));
    assert_eq!(rooted.find("../../other/b.stl"), Ok(other));
}

#[test]
fn the_root_bounds_the_search_and_the_package_map() {
    let dir = tree(&["root/arm/urdf/arm.urdf", "outside/meshes/a.stl"]);
    let outside = dir.path().join("outside");
    let locator = Locator::new(&dir.path().join("root/arm/urdf/arm.urdf"))
        .with_package("mapped", &outside)
        .within(&dir.path().join("root"));
    assert!(locator.find("package://outside/meshes/a.stl").is_err());
    assert!(locator.find("package://mapped/meshes/a.stl").is_err());
    assert!(locator.find("../../../outside/meshes/a.stl").is_err());
}

#[test]
fn a_folder_or_an_empty_name_is_not_a_file() {
    let dir = tree(&["arm/urdf/arm.urdf", "arm/meshes.stl/a.stl"]);
    let locator = Locator::new(&dir.path().join("arm/urdf/arm.urdf"));
    assert!(locator.find("package://arm/meshes.stl").is_err());
    assert_eq!(locator.find("package:///meshes.stl/a.stl"), Ok(real(&dir, "arm/meshes.stl/a.stl")));
}

#[test]
fn a_file_is_found_from_the_packages_folder_too_and_reported() {
    let dir =
        tree(&["arm/urdf/robots/arm.urdf", "arm/package.xml", "arm/meshes/a.stl", "arm/urdf/robots/b.stl"]);
    let locator = Locator::new(&dir.path().join("arm/urdf/robots/arm.urdf"));
    for uri in ["meshes/a.stl", "package:///meshes/a.stl"] {
        assert_eq!(locator.find(uri), Ok(real(&dir, "arm/meshes/a.stl")), "{uri}");
        let note = locator.note(uri).unwrap();
        assert!(
            note.starts_with("it is found from the package's folder ") && note.ends_with("arm"),
            "{note}"
        );
    }
    assert_eq!(locator.note("b.stl"), None);
    assert_eq!(locator.note("nothing.stl"), None);
}

#[test]
fn only_an_sdf_or_mjcf_names_other_descriptions() {
    let dir = tree(&["arm/arm.urdf", "arm/arm.sdf", "arm/arm.xml", "arm/part.xml", "arm/grip.urdf"]);
    let of = |name: &str| Locator::new(&dir.path().join("arm").join(name)).find("part.xml");
    assert_eq!(of("arm.urdf").unwrap_err().why, Why::NotAMesh);
    assert_eq!(of("arm.sdf"), Ok(real(&dir, "arm/part.xml")));
    assert_eq!(of("arm.xml"), Ok(real(&dir, "arm/part.xml")));
    let gripper = |name: &str| Locator::new(&dir.path().join("arm").join(name)).find("grip.urdf");
    assert_eq!(gripper("arm.sdf"), Ok(real(&dir, "arm/grip.urdf")));
    assert_eq!(gripper("arm.urdf").unwrap_err().why, Why::NotAMesh);
}

#[test]
fn models_of_gazebo_are_found_by_its_variables_and_beside_worlds() {
    let dir = tree(&["ws/worlds/w.sdf", "ws/models/near/model.sdf", "far/models/away/model.sdf"]);
    let locator = Locator::new(&dir.path().join("ws/worlds/w.sdf"));
    assert_eq!(locator.find("model://near/model.sdf"), Ok(real(&dir, "ws/models/near/model.sdf")));
    assert!(locator.find("model://away/model.sdf").is_err());
    let locator = locator.with_model_paths(vec![dir.path().join("far/models")]);
    assert_eq!(locator.find("model://away/model.sdf"), Ok(real(&dir, "far/models/away/model.sdf")));
}

//! Test vectors that all clients share: `server/formats/assets/vectors`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use tempfile::TempDir;

use super::*;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    name: String,
    files: BTreeMap<String, String>,
    #[serde(default)]
    links: BTreeMap<String, String>,
    urdf: String,
    #[serde(default)]
    packages: BTreeMap<String, String>,
    #[serde(default)]
    ros_package_path: Vec<String>,
    #[serde(default)]
    ament_prefix_path: Vec<String>,
    root: Option<String>,
    find: Vec<Question>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Question {
    uri: String,
    path: Option<String>,
    why: Option<String>,
}

impl Case {
    fn make(&self, tree: &Path) {
        let file = |path: &str| {
            let path = tree.join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            path
        };
        for (path, content) in &self.files {
            fs::write(file(path), content).unwrap();
        }
        for (path, target) in &self.links {
            let target = target.replace("{tree}", tree.to_str().unwrap());
            std::os::unix::fs::symlink(target, file(path)).unwrap();
        }
    }

    fn locator(&self, tree: &Path) -> Locator {
        let folders = |list: &[String]| list.iter().map(|folder| tree.join(folder)).collect();
        let locator = Locator::new(&tree.join(&self.urdf))
            .with_ros_paths(folders(&self.ros_package_path), folders(&self.ament_prefix_path));
        let locator = self
            .packages
            .iter()
            .fold(locator, |locator, (name, folder)| locator.with_package(name, &tree.join(folder)));
        match &self.root {
            Some(root) => locator.within(&tree.join(root)),
            None => locator,
        }
    }
}

#[test]
fn each_vector_is_answered_as_it_says() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("vectors/paths.json");
    let cases: Vec<Case> = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    let mut asked = 0;
    let mut wrong = Vec::new();
    for case in &cases {
        let dir = TempDir::new().unwrap();
        let tree = dir.path().canonicalize().unwrap();
        case.make(&tree);
        let locator = case.locator(&tree);
        for question in &case.find {
            let uri = question.uri.replace("{tree}", tree.to_str().unwrap());
            let expected = match (&question.path, &question.why) {
                (Some(path), None) => Ok(tree.join(path)),
                (None, Some(why)) => Err(why.as_str()),
                _ => panic!("{}: {uri} has both or neither", case.name),
            };
            let found = locator.find(&uri);
            if found.as_ref().map_err(|not_found| not_found.why.word())
                != expected.as_ref().map_err(|why| *why)
            {
                wrong.push(format!("{}: {uri}: {found:?} instead of {expected:?}", case.name));
            }
            asked += 1;
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(asked > 80, "only {asked} questions");
}

//! Fuzz targets: plain functions from bytes. A fuzzer calls them with its own bytes, the tests with those of
//! `tests/fuzz/corpus`. Each panics if a promise is broken, and only then.

#[cfg(feature = "commands")]
mod commands;
#[cfg(feature = "commands")]
mod queries;
#[cfg(feature = "commands")]
mod recordings;
#[cfg(feature = "commands")]
mod requests;
#[cfg(feature = "commands")]
mod saved_states;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

#[cfg(feature = "commands")]
pub use commands::commands;
#[cfg(feature = "commands")]
pub use queries::queries;
#[cfg(feature = "commands")]
pub use recordings::recordings;
#[cfg(feature = "commands")]
pub use requests::untrusted_requests;
#[cfg(feature = "commands")]
pub use saved_states::saved_states;
use simd_assets::Locator;
use simd_model::robot::{Geometry, Grid, Inertial, MeshAsset, RobotModel, Sha256};
use simd_model::{Asset, Assets, LoadLimits, LoadReport, ReadOptions, Refused};

/// A target: the function, and its name, which its corpus and its fuzzer share.
pub type Target = (&'static str, fn(&[u8]));

/// All of them.
pub const TARGETS: &[Target] = &[
    ("urdf", urdf),
    ("sdf", sdf),
    ("mjcf", mjcf),
    ("stl", stl),
    ("obj", obj),
    ("collada", collada),
    ("gltf", gltf),
    ("looks", looks),
    ("msh", msh),
    ("heights_png", heights_png),
    ("heights_csv", heights_csv),
    ("paths", paths),
    ("xacro", xacro),
    #[cfg(feature = "commands")]
    ("commands", commands::commands),
    #[cfg(feature = "commands")]
    ("queries", |bytes| {
        queries::queries(bytes);
    }),
    #[cfg(feature = "commands")]
    ("recordings", |bytes| {
        recordings::recordings(bytes);
    }),
    #[cfg(feature = "commands")]
    ("requests", requests::untrusted_requests),
    #[cfg(feature = "commands")]
    ("saved_states", |bytes| {
        saved_states::saved_states(bytes);
    }),
];

/// Any URI leads to the same file.
struct Only(Option<Asset>);

impl Assets for Only {
    fn find(&self, _uri: &str) -> Result<Asset, Vec<String>> {
        self.0.clone().ok_or_else(Vec::new)
    }
}

fn only(bytes: &[u8]) -> Only {
    Only(Some(Asset { sha256: Sha256::of(bytes), bytes: Arc::from(bytes) }))
}

/// Takes the next message off a sequence: a byte for the kind, two for the length, and the message.
#[cfg(feature = "commands")]
fn message<'a>(sequence: &mut &'a [u8]) -> Option<(u8, &'a [u8])> {
    let [kind, low, high, left @ ..] = *sequence else { return None };
    let (message, left) = left.split_at(left.len().min(usize::from(u16::from_le_bytes([*low, *high]))));
    *sequence = left;
    Some((*kind, message))
}

/// A URDF is refused with a sentence, or gives a robot of finite numbers.
pub fn urdf(bytes: &[u8]) {
    // The robot, if it has meshes, has this one.
    let triangle = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let described = simd_model::describe(bytes, &LoadLimits::default());
    let read = simd_model::read(bytes, &only(triangle), &ReadOptions::default());
    if let Ok((model, _)) = &read {
        assert!(described.is_ok(), "a robot that is read is described");
        assert!(simd_model::read(bytes, &Only(None), &ReadOptions::default()).is_ok(), "no mesh is a must");
        let again = simd_model::read(bytes, &only(triangle), &ReadOptions::default());
        assert!(again.is_ok_and(|(again, _)| again == *model), "the same bytes are the same robot");
    }
    check(read);
}

/// An SDF is refused in a sentence, or is URDF that is read or refused as any other.
pub fn sdf(bytes: &[u8]) {
    translated(bytes, b"<sdf", b"<sdf version='1.9'>");
}

/// An MJCF is refused in a sentence, or is URDF that is read or refused as any other.
pub fn mjcf(bytes: &[u8]) {
    translated(bytes, b"<mujoco", b"<mujoco>");
}

fn translated(bytes: &[u8], begin: &[u8], root: &[u8]) {
    // Bytes of another format would not reach the reader.
    let bytes =
        if bytes.trim_ascii_start().starts_with(begin) { bytes.to_vec() } else { [root, bytes].concat() };
    let limits = LoadLimits::default();
    // This is the content of any included file and of each mesh.
    let included = b"<sdf version='1.9'><model name='i'><link name='l'/></model></sdf>";
    for files in [only(included), only(b"<mujoco/>"), Only(None)] {
        // Whatever is missing can be described, or is refused.
        let described = simd_model::describe_with(&bytes, &files, &limits);
        let translation = match simd_model::translate(&bytes, &files, &limits) {
            Ok(Some(translation)) => translation,
            Ok(None) => return,
            Err(refused) => {
                assert!(!refused.message.is_empty(), "a refusal says why");
                assert!(!refused.report.findings.is_empty(), "and its report does");
                continue;
            }
        };
        assert!(described.is_ok(), "what is translated is described");
        assert!(!translation.models.is_empty(), "what is translated has a robot");
        for model in &translation.models {
            assert!(model.pose.translation.is_finite() && model.pose.rotation.is_finite(), "it is somewhere");
            assert!(translation.model(&model.name).is_ok(), "a robot is found by its name");
            check(simd_model::read(model.urdf.as_bytes(), &files, &ReadOptions::default()));
        }
        let again = simd_model::translate(&bytes, &files, &limits);
        assert!(again.is_ok_and(|again| again == Some(translation)), "the same bytes are the same robots");
    }
}

fn check(read: Result<(RobotModel, LoadReport), Refused>) {
    let model = match read {
        Ok((model, _)) => model,
        Err(refused) => {
            assert!(!refused.message.is_empty(), "a refusal says why");
            assert!(!refused.report.findings.is_empty(), "and its report does");
            return;
        }
    };
    assert_eq!(model.joints.len() + 1, model.links.len(), "a robot is a tree");
    for (index, joint) in model.joints.iter().enumerate() {
        assert_eq!(joint.child, index + 1);
        assert!(joint.parent < joint.child, "a parent comes first");
        assert!(joint.axis.is_finite() && joint.parent_from_joint.translation.is_finite());
        let (lower, upper) = joint.limits.range();
        assert!(lower <= upper, "limits are in order");
    }
    for link in &model.links {
        let Inertial { mass, center_of_mass, inertia } = link.inertial;
        assert!(mass.is_finite() && mass >= 0.0 && center_of_mass.is_finite() && inertia.is_finite());
        let shapes = link.visuals.iter().map(|visual| &visual.geometry);
        for geometry in shapes.chain(link.collisions.iter().map(|collision| &collision.geometry)) {
            if let Geometry::Mesh { asset: Some(mesh), .. } = geometry {
                check_mesh(mesh);
            }
        }
    }
}

fn check_mesh(mesh: &MeshAsset) {
    assert!(!mesh.triangles.is_empty(), "a mesh has triangles");
    assert!(mesh.vertices.iter().all(|vertex| vertex.is_finite()), "a corner is somewhere");
    let in_range = |corner: &u32| (*corner as usize) < mesh.vertices.len();
    assert!(mesh.triangles.iter().flatten().all(in_range), "a triangle's corners are there");
    for paint in &mesh.paints {
        assert!(
            paint.first <= mesh.triangles.len() && (0.0..=1.0).contains(&paint.alpha),
            "a paint is on triangles"
        );
        if let Some(texture) = &paint.texture {
            assert!(paint.first + texture.uvs.len() <= mesh.triangles.len(), "and so is a picture");
            let mut uvs = texture.uvs.iter().flatten().flatten();
            assert!(uvs.all(|uv| uv.is_finite()), "of which each corner has finite coordinates");
        }
    }
    if let Some(Grid { rows, columns }) = mesh.grid {
        assert!(rows > 1 && columns > 1 && rows * columns == mesh.vertices.len(), "a grid has its corners");
        assert_eq!(mesh.triangles.len(), 2 * (rows - 1) * (columns - 1), "and two triangles a cell");
    }
}

/// A mesh is refused with a warning, or its triangles have existing vertices.
fn mesh(extension: &str, bytes: &[u8]) {
    let urdf = format!(
        "<robot name='r'><link name='a'><visual><geometry><mesh filename='a.{extension}'/></geometry></visual>\
         </link></robot>"
    );
    let read = simd_model::read(urdf.as_bytes(), &only(bytes), &ReadOptions::default());
    assert!(read.is_ok(), "a mesh to draw never fails a load");
    check(read);
}

/// STL.
pub fn stl(bytes: &[u8]) {
    mesh("stl", bytes);
}

/// Wavefront OBJ.
pub fn obj(bytes: &[u8]) {
    mesh("obj", bytes);
}

/// COLLADA.
pub fn collada(bytes: &[u8]) {
    mesh("dae", bytes);
}

/// glTF, as text and binary.
pub fn gltf(bytes: &[u8]) {
    mesh("gltf", bytes);
}

/// Materials of an OBJ, or a picture on a box, by the first bytes. In every case the mesh is read.
pub fn looks(bytes: &[u8]) {
    let obj: &[u8] = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n";
    let urdf = b"<robot name='r'><link name='a'><visual><geometry><mesh filename='a.obj'/></geometry>\
        <material name='m'><texture filename='a.png'/></material></visual></link></robot>";
    let named = Beside { mesh: only(obj), other: only(bytes) };
    let described = simd_model::describe_with(urdf, &named, &LoadLimits::default());
    assert!(described.is_ok_and(|described| described.asset_uris.len() < 1000), "what it names is bounded");
    let read = simd_model::read(urdf, &named, &ReadOptions::default());
    let drawn = read.as_ref().is_ok_and(|(model, _)| {
        model
            .links
            .iter()
            .flat_map(|link| &link.visuals)
            .all(|visual| matches!(&visual.geometry, Geometry::Mesh { asset: Some(_), .. }))
    });
    assert!(drawn, "a mesh is read, whatever its materials are");
    check(read);
}

/// A mesh, and any other file.
struct Beside {
    mesh: Only,
    other: Only,
}

impl Assets for Beside {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        if uri.ends_with(".obj") { self.mesh.find(uri) } else { self.other.find(uri) }
    }
}

/// MuJoCo's meshes.
pub fn msh(bytes: &[u8]) {
    mesh("msh", bytes);
}

/// The picture of a height field.
pub fn heights_png(bytes: &[u8]) {
    mesh("png", bytes);
}

/// A height field as rows of numbers.
pub fn heights_csv(bytes: &[u8]) {
    mesh("csv", bytes);
}

/// For any URI, the resulting file lies in the root, or there is none.
pub fn paths(bytes: &[u8]) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let Ok(real) = root.canonicalize() else { return };
    let uri = String::from_utf8_lossy(bytes);
    let locator = Locator::new(&root.join("src/robot.urdf"));
    for locator in [locator.clone(), locator.with_package("arm", root).within(root)] {
        for found in [locator.find(&uri), locator.find_source(&uri)] {
            match found {
                Ok(found) => assert!(found.starts_with(&real), "{} is outside", found.display()),
                Err(not_found) => assert!(!not_found.to_string().is_empty()),
            }
        }
    }
}

/// A xacro is refused with a sentence, or expands to text whose every line has an origin.
pub fn xacro(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    match simd_xacro::expand_text(&text, &BTreeMap::from([("a".to_owned(), "1".to_owned())])) {
        Ok(expanded) => {
            let lines = u32::try_from(expanded.urdf.lines().count()).unwrap_or(u32::MAX);
            assert!((1..=lines).all(|line| expanded.source(line).is_some()), "each line has an origin");
            assert!(expanded.source(lines.saturating_add(1)).is_none());
        }
        Err(error) => assert!(!error.message.is_empty()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_of_the_corpus_keeps_the_promises() {
        for (name, target) in TARGETS {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(name);
            let mut replayed = 0;
            for entry in std::fs::read_dir(&folder).unwrap() {
                let path = entry.unwrap().path();
                println!("{}", path.display());
                target(&std::fs::read(&path).unwrap());
                replayed += 1;
            }
            assert!(replayed >= 5, "only {replayed} files for {name}");
        }
    }
}

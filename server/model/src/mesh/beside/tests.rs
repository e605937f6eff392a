//! Files beside meshes: found, missing, hostile.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use super::*;
use crate::mesh::{Content, read};

/// Files by URI.
#[derive(Default)]
struct Files(BTreeMap<String, Vec<u8>>);

impl Files {
    fn with(mut self, uri: &str, bytes: &[u8]) -> Self {
        self.0.insert(uri.to_owned(), bytes.to_vec());
        self
    }
}

impl Assets for Files {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        let bytes = self.0.get(uri).ok_or_else(|| vec!["/here".to_owned()])?;
        Ok(Asset { sha256: Sha256::of(bytes), bytes: Arc::from(bytes.as_slice()) })
    }
}

/// Returns a box that `tests/assets/make_textured.py` writes.
fn asset(name: &str) -> Vec<u8> {
    fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/assets/textured").join(name)).unwrap()
}

fn boxes() -> Files {
    ["box.mtl", "box.bin"].into_iter().fold(
        Files::default().with("package://b/meshes/../pictures/squares.png", &asset("pictures/squares.png")),
        |files, name| files.with(&format!("package://b/meshes/{name}"), &asset(&format!("meshes/{name}"))),
    )
}

fn read_box(format: &str, files: &Files) -> (Content, Beside) {
    let (uri, bytes) = (format!("package://b/meshes/box.{format}"), asset(&format!("meshes/box.{format}")));
    let beside = Beside::gather(&uri, &bytes, files);
    (read(&uri, &bytes, &beside).unwrap(), beside)
}

/// Returns the texture coordinates of each corner by its position, as a viewer would see them.
fn uvs(content: &Content) -> Vec<([i64; 3], [f32; 2])> {
    let (vertices, triangles) = &content.triangles;
    let [paint] = &content.paints[..] else { panic!("{:?}", content.paints) };
    let texture = paint.texture.as_ref().unwrap();
    assert_eq!((paint.first, texture.uvs.len()), (0, triangles.len()));
    let corners = triangles.iter().flatten().zip(texture.uvs.iter().flatten());
    let mut all: Vec<_> = corners
        .map(|(corner, uv)| (vertices[*corner as usize].to_array().map(|x| (x * 10.0).round() as i64), *uv))
        .collect();
    all.sort_by(|a, b| a.partial_cmp(b).unwrap());
    all.dedup();
    all
}

#[test]
fn each_format_has_the_picture_at_the_same_corners() {
    let (glb, beside) = read_box("glb", &Files::default());
    assert_eq!((beside.files.len(), beside.notes.len()), (0, 0), "it is within the file");
    let expected = uvs(&glb);
    // The upper left of the side towards x is the picture's upper left.
    assert!(expected.contains(&([1, -1, 1], [0.0, 0.0])) && expected.contains(&([1, 1, -1], [1.0, 1.0])));
    for format in ["obj", "dae", "gltf"] {
        let (content, beside) = read_box(format, &boxes());
        assert_eq!(beside.notes, [""; 0]);
        assert_eq!(uvs(&content), expected, "{format}");
        let texture = content.paints[0].texture.as_ref().unwrap();
        assert_eq!(
            (texture.image.size, &*texture.image.bytes),
            ([32, 32], &asset("pictures/squares.png")[..])
        );
        assert!(beside.files.iter().any(|file| file.name == "../pictures/squares.png"), "{:?}", beside.files);
    }
}

#[test]
fn a_picture_that_is_missing_or_too_large_is_noted_and_the_colour_is_left() {
    let files = Files::default().with("package://b/meshes/box.mtl", &asset("meshes/box.mtl"));
    let (content, beside) = read_box("obj", &files);
    let expected = "the texture \"../pictures/squares.png\" is not found; looked in: /here; the colour of its material is shown";
    assert_eq!(beside.notes, [expected]);
    assert_eq!(content.paints[0].color, Some([1.0; 3]));
    assert!(content.paints[0].texture.is_none());
    let mut bomb = asset("pictures/squares.png");
    bomb[16..20].copy_from_slice(&60_000_u32.to_be_bytes());
    let files = files.with("package://b/meshes/../pictures/squares.png", &bomb);
    let (_, beside) = read_box("obj", &files);
    assert!(beside.notes[0].contains("is not read: it has 60000 by 32 pixels"), "{:?}", beside.notes);
    assert_eq!(beside.files.len(), 1, "what is not used is not part of the look");
    let (_, beside) = read_box("dae", &Files::default());
    assert!(
        beside.notes[0].starts_with("the texture \"../pictures/squares.png\" is not found"),
        "{:?}",
        beside.notes
    );
}

#[test]
fn files_that_a_mesh_names_are_known_as_far_as_they_were_sent() {
    let obj = "package://b/meshes/box.obj";
    let files = Files::default();
    assert_eq!(uris(obj, &files), [""; 0]);
    let files = files.with(obj, &asset("meshes/box.obj"));
    assert_eq!(uris(obj, &files), ["package://b/meshes/box.mtl"]);
    let files = files.with("package://b/meshes/box.mtl", &asset("meshes/box.mtl"));
    let picture = "package://b/meshes/../pictures/squares.png";
    assert_eq!(uris(obj, &files), ["package://b/meshes/box.mtl", picture]);
    let dae = "package://b/meshes/box.dae";
    assert_eq!(uris(dae, &files.with(dae, &asset("meshes/box.dae"))), [picture]);
    let stl = "package://b/meshes/box.stl";
    assert_eq!(uris(stl, &Files::default().with(stl, b"mtllib a.mtl")), [""; 0]);
}

#[test]
fn files_that_name_each_other_or_thousands_of_others_come_to_an_end() {
    // Each file is the other's material.
    let text =
        b"mtllib a.mtl\nmtllib b.mtl\nmap_Kd a.mtl\nmap_Kd b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let files = Files::default().with("a.mtl", text).with("b.mtl", text);
    let beside = Beside::gather("a.obj", text, &files);
    assert_eq!(beside.files.len(), 2, "as materials, and none as a picture");
    let many: String = (0..5000).map(|n| format!("map_Kd {n}.png\n")).collect();
    let files = Files::default().with("m.mtl", many.as_bytes());
    let beside = Beside::gather("a.obj", b"mtllib m.mtl", &files);
    assert!(beside.notes.len() <= 16);
    assert!(uris("a.obj", &files.with("a.obj", b"mtllib m.mtl")).len() <= limits::FILES_BESIDE);
}

#[test]
fn a_document_of_nothing_but_beginnings_of_pictures_is_looked_through_once() {
    // A search of the whole rest for each of them would take hours.
    for (part, end) in [("<image>", ""), ("<image>", "</image>"), ("<image><init_from", "")] {
        let text = part.repeat(4 << 20) + end;
        assert!(collada(text.as_bytes()).is_empty(), "{part}");
    }
    let broken = "<image><image></image><image><init_from>a.png</init_from></image>";
    assert_eq!(collada(broken.as_bytes()), [Named { name: "a.png".into(), role: Role::Image }]);
}

#[test]
fn names_lead_to_files_beside_the_mesh_and_nowhere_else() {
    for (name, expected) in [
        ("a.png", Some("a.png")),
        (" ./sub/a b.png ", Some("sub/a b.png")),
        ("..\\up\\a.png", Some("../up/a.png")),
        ("/home/me/a.png", Some("a.png")),
        ("file:///home/me/a.png", Some("a.png")),
        ("file://a.png", Some("a.png")),
        ("C:\\me\\a.png", Some("a.png")),
        ("file:///C:/me/a.png", Some("a.png")),
        ("http://example.com/a.png", None),
        ("data:image/png;base64,AA==", None),
        ("", None),
        ("folder/", None),
        ("a\0b", None),
    ] {
        assert_eq!(relative(name).as_deref(), expected, "{name}");
    }
    assert_eq!(address("package://b/m/a.dae", "../t/a.png"), "package://b/m/../t/a.png");
    assert_eq!(address("a.dae", "t.png"), "t.png");
    assert_eq!(joined("sub/a.mtl", "t.png").as_deref(), Some("sub/t.png"));
}

#[test]
fn materials_of_an_obj_have_colours_and_what_shines_through() {
    let obj = b"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\nusemtl glass\nf 1 2 3\nusemtl lost\nf 1 2 3\n\
        usemtl red\nf 1 3 2\n";
    let mtl = b"newmtl red\nKd 1 0 0\n# newmtl no\nnewmtl glass\nKd 0.5\nTr 0.75\nnewmtl hidden\nd 0\n";
    let files = Files::default().with("m.mtl", mtl);
    let beside = Beside::gather("a.obj", obj, &files);
    let content = read("a.obj", obj, &beside).unwrap();
    let paints: Vec<_> = content.paints.iter().map(|paint| (paint.first, paint.color, paint.alpha)).collect();
    let red = Some([1.0, 0.0, 0.0]);
    assert_eq!(paints, [(0, red, 1.0), (1, Some([0.5; 3]), 0.25), (2, None, 1.0), (3, red, 1.0)]);
    // Without its materials the mesh stays as before.
    let bare = read("a.obj", obj, &Beside::default()).unwrap();
    assert_eq!((bare.triangles, bare.paints.len()), (content.triangles, 0));
}

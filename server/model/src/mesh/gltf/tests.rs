//! glTF files, valid and broken.

use glamx::DVec3;

use crate::mesh::{Beside, Content, read};

/// A triangle in a buffer within the JSON. The vertices are (0, 0, 0), (1, 0, 0), (0, 1, 0), then come the
/// indices 0 1 2 as bytes.
const DATA: &str = "data:application/octet-stream;base64,\
    AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAEC";

fn document(more: &str) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}},
        "buffers": [{{"uri": "{DATA}", "byteLength": 39}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}, {{"buffer": 0, "byteOffset": 36, "byteLength": 3}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}},
            {{"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1, "material": 0}}]}}], {more}}}"#
    )
}

const PLAIN: &str = r#""scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}]"#;

fn parse(text: &str) -> Result<Content, String> {
    read("a.gltf", text.as_bytes(), &Beside::default())
}

fn why(text: &str) -> String {
    parse(text).err().unwrap_or_else(|| panic!("{text} is read"))
}

#[test]
fn nodes_place_meshes_and_the_axes_are_those_of_the_file() {
    let read = parse(&document(PLAIN)).unwrap();
    assert_eq!(read.triangles.0, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(DVec3::from_array));
    assert_eq!(read.triangles.1, [[0, 1, 2]]);
    // Half a turn about z, twice as large, moved; its parent is moved too.
    let nodes = r#""nodes": [{"children": [1], "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,5,1]},
        {"mesh": 0, "translation": [1, 0, 0], "rotation": [0, 0, 1, 0], "scale": [2, 2, 2]}], "scenes": [{"nodes": [0]}]"#;
    let read = parse(&document(nodes)).unwrap();
    assert!((read.triangles.0[1] - DVec3::new(-1.0, 0.0, 5.0)).length() < 1e-12, "{:?}", read.triangles.0);
    // Without a scene, all meshes are read.
    assert_eq!(parse(&document(r#""nodes": []"#)).unwrap().triangles.1.len(), 1);
}

#[test]
fn the_base_colour_is_as_screens_have_it_and_shines_through_where_it_blends() {
    let material = |more: &str| {
        let materials = format!(
            r#""materials": [{{"pbrMetallicRoughness": {{"baseColorFactor": [1, 0.21404114048223255, 0, 0.5]}}{more}}}], {PLAIN}"#
        );
        let paints = parse(&document(&materials)).unwrap().paints;
        (paints[0].color.unwrap(), paints[0].alpha)
    };
    let ([red, green, blue], alpha) = material("");
    assert_eq!((blue, alpha), (0.0, 1.0));
    // As exact as the power of 1 / 2.4.
    assert!((red - 1.0).abs() < 1e-12 && (green - 0.5).abs() < 1e-6, "{red} {green}");
    assert_eq!(material(r#", "alphaMode": "BLEND""#).1, 0.5);
    assert_eq!(parse(&document(PLAIN)).unwrap().paints, [], "a material that does not exist is none");
}

#[test]
fn broken_and_unknown_parts_are_refused_with_a_sentence() {
    let fine = document(PLAIN);
    for (from, to, expected) in [
        ("\"2.0\"", "\"1.0\"", "it is glTF \"1.0\"; only 2.0 is supported"),
        (
            "\"count\": 3, \"type\": \"VEC3\"",
            "\"count\": 4, \"type\": \"VEC3\"",
            "accessor 0 declares 4 elements",
        ),
        ("\"count\": 3", "\"count\": 18446744073709551615", "accessor 0 declares"),
        ("\"VEC3\"", "\"VEC2\"", "accessor 0 is of \"VEC2\" instead of VEC3"),
        ("\"POSITION\": 0", "\"POSITION\": 7", "it names accessor 7"),
        ("\"mesh\": 0", "\"mesh\": 3", "it names mesh 3"),
        ("\"nodes\": [0]", "\"nodes\": [4]", "it names node 4"),
        ("\"mesh\": 0", "\"mesh\": 0, \"children\": [0]", "node 0 is in two places, or contains itself"),
        ("\"byteLength\": 36", "\"byteLength\": 99", "buffer view 0 ends behind its buffer"),
        ("AAEC", "AAEJ", "a triangle names a corner that does not exist; the mesh has 3"),
        ("base64,", "base64,*", "buffer 0 is not in base 64"),
        (DATA, "lost.bin", "its buffer \"lost.bin\" does not exist"),
        (
            "\"meshes\"",
            "\"extensionsRequired\": [\"KHR_draco_mesh_compression\"], \"meshes\"",
            "it requires the extension",
        ),
        ("\"componentType\": 5126", "\"componentType\": 1", "accessor 0 is of the unknown type 1"),
        ("\"asset\"", "asset", "its JSON is not valid"),
    ] {
        let broken = fine.replacen(from, to, 1);
        assert_ne!(broken, fine, "{from}");
        let why = why(&broken);
        assert!(why.contains(expected), "{why:?} instead of {expected:?}");
    }
    let empty = fine.replace("\"indices\": 1", "\"mode\": 1");
    assert_eq!(why(&empty), "it has no triangles", "lines have no area");
}

#[test]
fn a_short_file_does_not_become_long_work() {
    let many = "{},".repeat(simd_gltf::MAX_OBJECTS);
    assert!(why(&document(&format!(r#""images": [{many}{{}}], {PLAIN}"#))).contains("objects; the limit is"));
    // A mesh of ten thousand parts, used ten thousand times.
    let part = r#"{"attributes": {"POSITION": 0}, "mode": 0},"#.repeat(10_000);
    let nodes = r#"{"mesh": 1},"#.repeat(10_000);
    let indices: Vec<String> = (0..10_000).map(|n| n.to_string()).collect();
    let text =
        document(&format!(r#""scenes": [{{"nodes": [{}]}}], "nodes": [{nodes}{{}}]"#, indices.join(",")));
    let text =
        text.replace("\"meshes\": [", &format!("\"meshes\": [{{}}, {{\"primitives\": [{part}{{}}]}}, "));
    assert!(why(&text).contains("its meshes are used more than"));
    assert!(why(&"[".repeat(100_000)).contains("its JSON is not valid"), "nothing recurses without end");
}

#[test]
fn no_cut_glb_is_read_in_part() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/assets/textured/meshes/box.glb");
    let whole = std::fs::read(path).unwrap();
    let parse = |bytes: &[u8]| read("a.glb", bytes, &Beside::default());
    assert_eq!(parse(&whole).unwrap().triangles.1.len(), 12);
    for end in 0..whole.len() {
        assert!(parse(&whole[..end]).is_err(), "{end}");
    }
}

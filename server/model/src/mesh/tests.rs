//! Valid and broken STL and OBJ files.

use glamx::DVec3;

use super::parse;
use crate::limits;

type Corner = [f32; 3];

/// Returns four triangles with four vertices.
pub(crate) fn tetrahedron() -> Vec<[Corner; 3]> {
    let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    vec![[o, y, x], [o, x, z], [o, z, y], [x, y, z]]
}

pub(crate) fn binary(triangles: &[[Corner; 3]], header: &str) -> Vec<u8> {
    let mut bytes = header.as_bytes().to_vec();
    bytes.resize(80, 0);
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        bytes.extend(triangle.iter().flatten().flat_map(|number| number.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn ascii(name: &str) -> String {
    let triangle = |corners: &[Corner; 3]| {
        let corner = |[x, y, z]: &Corner| format!("      vertex {x} {y} {z}\n");
        let corners: String = corners.iter().map(corner).collect();
        format!("  facet normal 0 0 0\n    outer loop\n{corners}    endloop\n  endfacet\n")
    };
    let triangles: String = tetrahedron().iter().map(triangle).collect();
    format!("solid{name}\n{triangles}endsolid{name}\n")
}

#[test]
fn a_binary_stl_is_read_with_shared_corners() {
    let (vertices, triangles) = parse("a/b.stl", &binary(&tetrahedron(), "x")).unwrap();
    assert_eq!((vertices.len(), triangles.len()), (4, 4));
}

#[test]
fn a_binary_stl_whose_header_begins_with_solid_is_binary() {
    for header in ["solid", "solid part one", "solid\nfacet normal"] {
        assert_eq!(parse("A.STL", &binary(&tetrahedron(), header)).unwrap().1.len(), 4);
    }
}

#[test]
fn a_binary_stl_with_bytes_behind_its_end_is_read() {
    let mut bytes = binary(&tetrahedron(), "x");
    bytes.extend(b"trailer");
    assert_eq!(parse("a.stl", &bytes).unwrap().1.len(), 4);
}

#[test]
fn an_ascii_stl_is_read_with_and_without_a_name_and_with_crlf() {
    for text in
        [ascii(" part"), ascii(""), ascii(" part").replace('\n', "\r\n"), ascii("").replace('\n', "\r\n")]
    {
        assert_eq!(parse("a.stl", text.as_bytes()).unwrap().1.len(), 4, "{text}");
    }
}

#[test]
fn a_count_that_the_file_does_not_hold_is_refused_at_once() {
    let mut bytes = binary(&tetrahedron(), "x");
    bytes[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    let why = parse("a.stl", &bytes).unwrap_err();
    assert_eq!(why, "its header declares 4294967295 triangles, but it has 4");
}

#[test]
fn a_corner_that_is_not_finite_is_refused() {
    let mut triangles = tetrahedron();
    triangles[2][1][0] = f32::NAN;
    assert_eq!(parse("a.stl", &binary(&triangles, "x")).unwrap_err(), "a corner is not finite");
    triangles[2][1][0] = 1e30;
    assert!(parse("a.stl", &binary(&triangles, "x")).unwrap_err().contains("further than"));
}

#[test]
fn no_triangles_cut_files_and_rubbish_are_refused() {
    assert_eq!(parse("a.stl", &binary(&[], "x")).unwrap_err(), "it has no triangles");
    assert_eq!(parse("a.stl", b"solid a\nendsolid a\n").unwrap_err(), "it has no triangles");
    let whole = binary(&tetrahedron(), "x");
    let text = ascii(" part");
    for cut in 0..whole.len() {
        parse("a.stl", &whole[..cut]).unwrap_err();
    }
    for cut in 0..text.len() - "endsolid part\n".len() {
        parse("a.stl", &text.as_bytes()[..cut]).unwrap_err();
    }
    parse("a.stl", b"").unwrap_err();
    parse("a.stl", b"solid").unwrap_err();
}

#[test]
fn other_formats_are_named_in_the_refusal() {
    assert_eq!(
        parse("x/a.ply", b"").unwrap_err(),
        ".ply files are not read; convert it to STL, OBJ, COLLADA or glTF"
    );
    assert_eq!(
        parse("x.y/a", b"").unwrap_err(),
        "only .stl, .obj, .dae, .gltf, .glb and .msh files are read, and height fields in .png and .csv"
    );
}

const SQUARE: &str =
    "mtllib ../../../etc/passwd\no one\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl x\nf 1 2 3 4\n";

#[test]
fn an_obj_is_read_as_triangles_and_its_material_file_is_not_opened() {
    let (vertices, triangles) = parse("a.OBJ", SQUARE.as_bytes()).unwrap();
    assert_eq!((vertices.len(), triangles), (4, vec![[0, 1, 2], [0, 2, 3]]));
    let two = format!("{SQUARE}o two\nv 0 0 1\nf 1 2 5\n");
    let (vertices, triangles) = parse("a.obj", two.as_bytes()).unwrap();
    assert!(triangles.iter().flatten().all(|&corner| (corner as usize) < vertices.len()));
    assert_eq!(triangles.len(), 3);
}

#[test]
fn an_obj_counts_from_either_end_and_may_name_corners_before_they_come() {
    for faces in ["f -4 -3 -2\nf 1/9/9 3//9 4/9", "f 1 2 \\\n 3 # first\nf\t-4 -2 -1", "f 1 2 3\nf 1 3 4"] {
        let text = format!("v 0 0 0\nv 1 0 0 1\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0\n{faces}\n");
        assert_eq!(parse("a.obj", text.as_bytes()).unwrap().1, [[0, 1, 2], [0, 2, 3]], "{faces}");
    }
    let text = "f 1 2 3\r\nv 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\n";
    assert_eq!(parse("a.obj", text.as_bytes()).unwrap().1, [[0, 1, 2]]);
}

#[test]
fn corners_of_an_obj_that_no_face_uses_are_left_out() {
    let text = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 9 9\nf 2 3 4\nl 1 5\n";
    assert_eq!(parse("a.obj", text.as_bytes()).unwrap().0.len(), 3);
}

#[test]
fn corners_of_an_obj_without_any_face_are_their_convex_hull() {
    let (corners, triangles) =
        parse("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0.1 0.1 0.1\n").unwrap();
    assert_eq!((corners.len(), triangles.len()), (4, 4));
    let flat = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
    assert_eq!(parse("a.obj", flat.as_bytes()).unwrap_err(), "it has no triangles");
    let far = "v 0 0 0\nv 1e300 0 0\nv 0 1e300 0\nv 0 0 1e300\n";
    assert_eq!(parse("a.obj", far.as_bytes()).unwrap_err(), "it has no triangles");
    let many = "v 0 0 0\n".repeat(3_001);
    assert!(
        parse("a.obj", many.as_bytes()).unwrap_err().contains("3001 corners and no face; the limit is 3000")
    );
}

#[test]
fn an_obj_that_is_wrong_is_refused_with_its_line() {
    for (text, reason) in [
        ("", "it has no triangles"),
        ("v 0 0 0\n", "it has no triangles"),
        ("v 0 0 0\nf 1 1\n", "it has no triangles"),
        ("v 0 0 0\nf 1 1 9\n", "line 2: a face names the corner \"9\", which does not exist"),
        ("v 0 0 0\nf 0 1 1\n", "line 2: a face names the corner \"0\", which does not exist"),
        ("v 0 0 0\nf -2 1 1\n", "line 2: a face names the corner \"-2\", which does not exist"),
        ("f -1 1 1\nv 0 0 0\n", "line 1: a face names the corner \"-1\", which does not exist"),
        ("f 1 1 -9223372036854775808\n", "line 1: a face names the corner"),
        ("f 1 1 9223372036854775807\n", "line 1: a face names the corner"),
        ("f 1 1 99999999999999999999\n", "line 1: a face names the corner"),
        ("v 0 0\n", "line 1: a corner has 2 coordinates instead of three"),
        ("v 0 zero 0\n", "line 1: \"zero\" is not a number"),
        ("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a corner is not finite"),
        ("v 1e19 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a corner is further than"),
    ] {
        let why = parse("a.obj", text.as_bytes()).unwrap_err();
        assert!(why.starts_with(reason), "{text:?} {why}");
    }
}

#[test]
fn polygons_of_many_corners_end_at_the_limit_of_triangles() {
    let polygon = |corners: usize| format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf{}\n", " 1".repeat(corners));
    let at = parse("a.obj", polygon(limits::MESH_TRIANGLES + 2).as_bytes()).unwrap();
    assert_eq!(at.1.len(), limits::MESH_TRIANGLES);
    let beyond = parse("a.obj", polygon(limits::MESH_TRIANGLES + 3).as_bytes()).unwrap_err();
    assert_eq!(beyond, "line 4: it has more than 2000000 triangles");
}

#[test]
fn a_binary_stl_ends_at_the_limit_of_triangles() {
    let file = |triangles: usize| {
        let mut bytes = vec![0; 84 + 50 * triangles];
        bytes[80..84].copy_from_slice(&u32::try_from(triangles).unwrap().to_le_bytes());
        bytes
    };
    assert_eq!(parse("a.stl", &file(limits::MESH_TRIANGLES)).unwrap().1.len(), limits::MESH_TRIANGLES);
    let beyond = parse("a.stl", &file(limits::MESH_TRIANGLES + 1)).unwrap_err();
    assert_eq!(beyond, "it has 2000001 triangles; the limit is 2000000");
}

#[test]
fn a_file_beyond_the_limit_of_bytes_is_not_read() {
    for name in ["a.stl", "a.obj", "a.dae"] {
        let beyond = parse(name, &vec![b'\n'; limits::MESH_BYTES + 1]).unwrap_err();
        assert_eq!(beyond, "it has 134217729 bytes; the limit is 134217728");
    }
    assert_eq!(parse("a.obj", &vec![b'\n'; limits::MESH_BYTES]).unwrap_err(), "it has no triangles");
}

#[test]
fn corners_of_an_stl_at_one_place_are_one_corner_in_the_order_of_the_file() {
    let mut triangles = tetrahedron();
    triangles[3][0] = [1.0, -0.0, 0.0];
    let (vertices, faces) = parse("a.stl", &binary(&triangles, "x")).unwrap();
    let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(DVec3::from_array);
    assert_eq!(vertices, [o, y, x, z]);
    assert_eq!(faces, [[0, 1, 2], [0, 2, 3], [0, 3, 1], [2, 1, 3]]);
}

//! Pictures that materials of SDF and MJCF name: from the file to the visual.

use super::*;
use crate::robot::{Geometry, MeshAsset, TextureRepeat, Visual};

const BOX: &str = "<body name='b'><freejoint/><geom type='box' size='1 1 1' material='squares'/></body>";
const MESH: &str = "<body name='b'><freejoint/><geom type='mesh' mesh='box' material='squares'/></body>";

/// Returns a box that `tests/assets/make_textured.py` writes.
fn asset(name: &str) -> Vec<u8> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/assets/textured");
    std::fs::read(folder.join(name)).unwrap()
}

fn files() -> Files {
    Files::default()
        .with("pictures/squares.png", asset("pictures/squares.png"))
        .with("meshes/box.obj", asset("meshes/box.obj"))
        .with("meshes/box.mtl", asset("meshes/box.mtl"))
        .with("meshes/box.dae", asset("meshes/box.dae"))
}

fn mjcf(assets: &str, body: &str) -> String {
    format!(
        "<mujoco model='m'><compiler meshdir='meshes' texturedir='pictures'/>\n<asset>{assets}</asset>\n\
         <worldbody>{body}</worldbody></mujoco>"
    )
}

fn sdf(shape: &str, material: &str) -> String {
    format!(
        "<sdf version='1.9'><model name='m'><link name='b'><inertial auto='true'/>\
         <collision name='c'><geometry><box><size>1 1 1</size></box></geometry></collision>\
         <visual name='v'><geometry>{shape}</geometry><material>{material}</material></visual></link></model></sdf>"
    )
}

fn visual(text: &str, files: &Files) -> (Visual, LoadReport) {
    let (model, report) = robot_with(text, files);
    let visual = model.links.iter().find_map(|link| link.visuals.first());
    (visual.unwrap_or_else(|| panic!("nothing is drawn: {report:?}")).clone(), report)
}

fn mesh(visual: &Visual) -> &MeshAsset {
    match &visual.geometry {
        Geometry::Mesh { asset: Some(asset), .. } => asset,
        other => panic!("{other:?}"),
    }
}

fn picture_of(visual: &Visual) -> Option<&str> {
    visual.texture.as_ref().map(|picture| picture.uri.as_str())
}

#[test]
fn a_material_of_mjcf_puts_its_picture_on_shapes() {
    let squares = "<texture name='t' type='2d' file='squares.png'/><material name='squares' texture='t'/>";
    let (shown, report) = visual(&mjcf(squares, BOX), &files());
    assert_eq!((picture_of(&shown), shown.color), (Some("pictures/squares.png"), None));
    assert_eq!(warnings(&report), []);
    // Without a name it has its file's, and the material uses a layer.
    let layered = "<material name='squares' rgba='1 0.5 0 1'><layer texture='squares' role='rgb'/></material>\
                   <texture type='cube' file='squares.png'/>";
    let (shown, _) = visual(&mjcf(layered, BOX), &files());
    assert_eq!((picture_of(&shown), shown.color), (Some("pictures/squares.png"), Some([1.0, 0.5, 0.0, 1.0])));
    let (shown, _) = visual(&mjcf(layered, &BOX.replace("'box'", "'sphere'")), &files());
    assert_eq!(picture_of(&shown), None, "what is wrapped around lies nowhere on a ball");
}

#[test]
fn an_unusable_picture_leaves_the_colour_and_a_finding() {
    let built_in = "<texture name='t' type='cube' builtin='gradient' width='8' height='8'/>\
                    <material name='squares' texture='t' rgba='1 0 0 1'/>";
    let (shown, report) = visual(&mjcf(built_in, BOX), &files());
    assert_eq!((picture_of(&shown), shown.color), (None, Some([1.0, 0.0, 0.0, 1.0])));
    assert!(report.findings.iter().any(|finding| finding.message.contains("whole pictures")), "{report:?}");
    let lost =
        "<texture name='t' type='2d' file='lost.png'/><material name='squares' texture='t' rgba='1 0 0 1'/>";
    let (shown, report) = visual(&mjcf(lost, BOX), &files());
    assert_eq!(picture_of(&shown), None);
    assert!(
        report.findings.iter().any(|finding| finding.message.contains("pictures/lost.png")),
        "{report:?}"
    );
}

/// Returns the rows of a PNG.
fn pixels(bytes: &[u8]) -> Vec<Vec<[u8; 3]>> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let width = reader.next_frame(&mut pixels).unwrap().width as usize;
    let row = |row: &[u8]| row.chunks_exact(3).map(|pixel| pixel.try_into().unwrap()).collect();
    pixels.chunks_exact(3 * width).map(row).collect()
}

#[test]
fn textures_that_mujoco_makes_are_pictures() {
    let ground = |texture: &str| {
        let text = mjcf(
            &format!("<texture name='t' type='2d' {texture}/><material name='squares' texture='t'/>"),
            "<geom type='plane' size='0 0 1' material='squares'/>",
        );
        let (shown, report) = visual(&text, &files());
        assert_eq!(warnings(&report), []);
        let picture = shown.texture.unwrap();
        assert!(picture.uri.starts_with("mjcf_inline/t"), "{}", picture.uri);
        pixels(&picture.image.bytes)
    };
    let [red, blue, white] = [[255, 0, 0], [0, 0, 255], [255; 3]];
    let checker = ground("builtin='checker' rgb1='1 0 0' rgb2='0 0 1' width='4' height='2'");
    assert_eq!(checker, [[red, red, blue, blue], [blue, blue, red, red]]);
    let edge = ground("builtin='flat' rgb1='1 0 0' mark='edge' markrgb='1 1 1' width='3' height='3'");
    assert_eq!(edge, [[white; 3], [white, red, white], [white; 3]]);
    let cross = ground("builtin='flat' rgb1='1 0 0' mark='cross' markrgb='1 1 1' width='3' height='3'");
    assert_eq!(cross, [[red, white, red], [white; 3], [red, white, red]]);
    let gradient = ground("builtin='gradient' rgb1='1 0 0' rgb2='0 0 1' width='65' height='65'");
    assert_eq!((gradient[32][32], gradient[0][0]), (red, blue));
    // Half of the way out, both colours are equal.
    assert_eq!(gradient[32][48], [127, 0, 127]);
    let random = ground(
        "builtin='flat' rgb1='1 0 0' mark='random' random='0.25' markrgb='1 1 1' width='100' height='100'",
    );
    let marked = random.iter().flatten().filter(|pixel| **pixel == white).count();
    assert!((2300..2700).contains(&marked), "{marked} of 10000 pixels");
    // Regardless of the requested size.
    let large = ground("builtin='checker' rgb1='1 0 0' rgb2='0 0 1' width='1e9' height='100'");
    assert_eq!((large.len(), large[0].len(), large[0][0], large[0][1023]), (100, 1024, red, blue));
}

/// Repetitions as in MuJoCo's renderer: over the size of a plane, or over two metres if uniform.
#[test]
fn a_picture_is_repeated_as_its_material_says() {
    let repeat = |material: &str, geom: &str| {
        let text = mjcf(
            &format!(
                "<texture name='t' type='2d' file='squares.png'/><material name='squares' texture='t' {material}/>"
            ),
            &format!("<geom {geom} material='squares'/>"),
        );
        let (shown, report) = visual(&text, &files());
        assert_eq!(warnings(&report), []);
        shown.texture.unwrap().repeat
    };
    let (plane, endless) = ("type='plane' size='5 2 1'", "type='plane' size='0 0 1'");
    assert_eq!(repeat("", plane), TextureRepeat::PerMetre([0.1, 0.25]));
    assert_eq!(repeat("texrepeat='10 4'", plane), TextureRepeat::PerMetre([1.0, 1.0]));
    assert_eq!(repeat("texrepeat='10 4' texuniform='true'", plane), TextureRepeat::PerMetre([5.0, 2.0]));
    assert_eq!(repeat("texrepeat='10 4'", endless), TextureRepeat::PerMetre([5.0, 2.0]));
    let (cuboid, ball) = ("type='box' size='1 1 1'", "type='sphere' size='1'");
    assert_eq!(repeat("texrepeat='3 2'", cuboid), TextureRepeat::Times([3.0, 2.0]));
    assert_eq!(repeat("texrepeat='3 2' texuniform='true'", cuboid), TextureRepeat::PerMetre([1.5, 1.0]));
    assert_eq!(repeat("texrepeat='3 2'", ball), TextureRepeat::Times([3.0, 2.0]));
    // One repetition is the default, and invalid ones are ignored.
    assert_eq!(repeat("", cuboid), TextureRepeat::default());
    assert_eq!(repeat("texrepeat='0 1'", cuboid), TextureRepeat::default());
}

/// The attributes that translations write, in a URDF; a robot twice as large has half the repetitions per
/// metre.
#[test]
fn a_urdf_says_how_often_a_picture_is_there() {
    let visual =
        |material: &str| format!("<visual><geometry><box size='1 1 1'/></geometry>{material}</visual>");
    let named =
        "<material name='tiles'><texture filename='pictures/squares.png' per_metre='4 2'/></material>";
    let own = |often: &str| {
        format!("<material name=''><texture filename='pictures/squares.png' {often}/></material>")
    };
    let shapes = [
        "<material name='tiles'/>",
        &own("repeat='3 -1'"),
        &own(""),
        &own("repeat='0 1'"),
        &own("per_metre='1e9 1'"),
    ];
    let text =
        format!("<robot name='r'>{named}<link name='a'>{}</link></robot>", shapes.map(visual).concat());
    let repeats = |scale: f64| -> Vec<TextureRepeat> {
        let options = ReadOptions { scale, ..ReadOptions::default() };
        let (model, report) = read(text.as_bytes(), &files(), &options).unwrap();
        assert_eq!(warnings(&report), []);
        model.links[0].visuals.iter().map(|visual| visual.texture.as_ref().unwrap().repeat).collect()
    };
    let (whole, often) = (TextureRepeat::default(), TextureRepeat::Times([3.0, -1.0]));
    assert_eq!(repeats(1.0), [TextureRepeat::PerMetre([4.0, 2.0]), often, whole, whole, whole]);
    assert_eq!(repeats(2.0), [TextureRepeat::PerMetre([2.0, 1.0]), often, whole, whole, whole]);
}

/// Only the file of the box's OBJ exists, without its materials, as with most models of MuJoCo.
#[test]
fn a_mesh_has_the_picture_where_its_corners_say_and_another_look_for_it() {
    let assets = "<texture name='t' type='2d' file='squares.png'/><material name='squares' texture='t'/>\
                  <mesh name='box' file='box.obj'/>";
    let bare = Files::default()
        .with("pictures/squares.png", asset("pictures/squares.png"))
        .with("meshes/box.obj", asset("meshes/box.obj"));
    let (shown, _) = visual(&mjcf(assets, MESH), &bare);
    let covered = mesh(&shown);
    let [paint] = &covered.paints[..] else { panic!("{:?}", covered.paints) };
    let texture = paint.texture.as_ref().unwrap();
    assert_eq!((paint.first, texture.uvs.len()), (0, covered.triangles.len()));
    assert_eq!(texture.image.sha256, Sha256::of(&asset("pictures/squares.png")));
    let mut corners: Vec<[f32; 2]> = texture.uvs.iter().flatten().copied().collect();
    corners.sort_by(|a, b| a.partial_cmp(b).unwrap());
    corners.dedup();
    assert_eq!(corners, [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]);
    let (plain, _) = visual(&mjcf("<mesh name='box' file='box.obj'/>", MESH), &bare);
    assert_eq!(mesh(&plain).sha256, covered.sha256);
    assert_ne!(mesh(&plain).look(), covered.look());
    assert_eq!(mesh(&plain).paints.len(), 0);
}

#[test]
fn a_mesh_without_places_in_pictures_says_that_the_picture_is_not_drawn() {
    let stl = "solid a\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1 0\n  endloop\n endfacet\nendsolid a\n";
    let assets = "<texture name='t' type='2d' file='squares.png'/><material name='squares' texture='t'/>\
                  <mesh name='box' file='a.stl'/>";
    // A triangle has no volume, and moving bodies need a mass.
    let still = MESH.replace("<freejoint/>", "");
    let (shown, report) = visual(&mjcf(assets, &still), &files().with("meshes/a.stl", stl));
    assert_eq!(mesh(&shown).paints.len(), 0);
    let said = report.findings.iter().filter(|finding| finding.message.contains("no texture coordinates"));
    assert_eq!(said.count(), 1, "{report:?}");
}

#[test]
fn an_albedo_map_of_sdf_is_drawn_on_shapes_and_meshes() {
    let pbr = |workflow: &str| {
        format!(
            "<ambient>0.3 0.3 0.3</ambient>\
             <pbr><{workflow}><albedo_map>pictures/squares.png</albedo_map></{workflow}></pbr>"
        )
    };
    let cube = "<box><size>1 1 1</size></box>";
    for workflow in ["metal", "specular"] {
        let (shown, report) = visual(&sdf(cube, &pbr(workflow)), &files());
        assert_eq!(
            (picture_of(&shown), shown.color),
            (Some("pictures/squares.png"), None),
            "ambient light is not a colour"
        );
        assert_eq!(warnings(&report), []);
    }
    let (shown, _) = visual(&sdf("<mesh><uri>meshes/box.obj</uri></mesh>", &pbr("metal")), &files());
    assert!(mesh(&shown).paints.iter().all(|paint| paint.texture.is_some()), "{shown:?}");
    let diffuse = format!("<diffuse>1 0 0 1</diffuse>{}", pbr("metal"));
    let (shown, _) = visual(&sdf(cube, &diffuse), &files());
    assert_eq!(shown.color, Some([1.0, 0.0, 0.0, 1.0]));
}

/// A client that sends a description learns its pictures like its meshes.
#[test]
fn pictures_are_among_the_files_that_a_description_asks_for() {
    let text = sdf(
        "<box><size>1 1 1</size></box>",
        "<pbr><metal><albedo_map>model://a/squares.png</albedo_map></metal></pbr>",
    );
    let described = describe_with(text.as_bytes(), &Files::default(), &LoadLimits::default()).unwrap();
    assert_eq!(described.asset_uris, ["model://a/squares.png"]);
}

//! Shapes, meshes and colours.

use std::sync::Arc;

use glamx::DVec3;

use super::*;
use crate::mesh::tests::{binary, tetrahedron};
use crate::robot::{Geometry, Link};

fn link(content: &str, files: &Files) -> (Link, LoadReport) {
    let urdf = format!("<robot name='r'>\n<link name='a'>{content}</link></robot>");
    let (mut model, report) = read(urdf.as_bytes(), files, &ReadOptions::default()).unwrap();
    (model.links.remove(0), report)
}

fn collision(geometry: &str) -> String {
    format!("<collision><geometry>{geometry}</geometry></collision>")
}

fn visual(geometry: &str, material: &str) -> String {
    format!("<visual><geometry>{geometry}</geometry>{material}</visual>")
}

#[test]
fn every_primitive_is_read() {
    let shapes = "<box size='1 2 3'/>|<sphere radius='1'/>|<cylinder radius='1' length='2'/>|<capsule radius='1' length='2'/>|<cone radius='1' length='2'/>";
    let content: String = shapes.split('|').map(collision).collect();
    let (link, report) = link(&content, &Files::default());
    let shapes: Vec<_> = link.collisions.into_iter().map(|collision| collision.geometry).collect();
    let expected = [
        Geometry::Box { size: DVec3::new(1.0, 2.0, 3.0) },
        Geometry::Sphere { radius: 1.0 },
        Geometry::Cylinder { radius: 1.0, length: 2.0 },
        Geometry::Capsule { radius: 1.0, length: 2.0 },
        Geometry::Cone { radius: 1.0, length: 2.0 },
    ];
    assert_eq!(shapes, expected);
    assert_eq!(warnings(&report), [""; 0]);
}

#[test]
fn a_shape_without_extent_or_size_is_ignored_with_a_warning() {
    for geometry in [
        "<box size='1 0 3'/>",
        "<sphere radius='-1'/>",
        "<cylinder radius='1' length='0'/>",
        "<box/>",
        "<sphere/>",
        "<mesh/>",
        "<mesh filename=''/>",
        "<mesh filename='a.stl' scale='1 0 1'/>",
        "<cone radius='1'/>",
        "<cone radius='1' length='0'/>",
        "<pyramid height='1'/>",
        "",
    ] {
        let (link, report) = link(&collision(geometry), &Files::default());
        assert_eq!(link.collisions.len(), 0, "{geometry}");
        assert_ne!(warnings(&report).len(), 0, "{geometry}");
    }
}

#[test]
fn the_shapes_after_an_ignored_one_keep_their_places() {
    let content = ["<box/>", "<sphere radius='-1'/>", "<sphere radius='2'/>"].map(collision).concat();
    let (link, _) = link(&(content + &visual("<sphere radius='3'/>", "")), &Files::default());
    assert_eq!(link.collisions.len(), 1);
    assert_eq!(link.collisions[0].geometry, Geometry::Sphere { radius: 2.0 });
    assert_eq!(link.visuals[0].geometry, Geometry::Sphere { radius: 3.0 });
}

#[test]
fn links_whose_parts_are_mixed_are_read_as_if_they_were_sorted() {
    let sphere = "<sphere radius='1'/>";
    let parts = [visual(sphere, ""), BODY.to_owned(), collision(sphere), visual(sphere, "")].concat();
    let (link, _) = link(&parts, &Files::default());
    assert_eq!((link.visuals.len(), link.collisions.len(), link.inertial.mass), (2, 1, 1.0));
}

#[test]
fn a_missing_mesh_is_reported_with_every_place_searched_and_loads_all_the_same() {
    let (link, report) = link(&collision("<mesh filename='package://x y/m.STL'/>"), &Files::default());
    assert!(matches!(&link.collisions[0].geometry, Geometry::Mesh { asset: None, .. }));
    let finding = find(&report, "mesh \"package://x y/m.STL\" is not found; looked in: here, there");
    assert_eq!((finding.severity, finding.line), (Severity::Warning, Some(2)));
}

#[test]
fn strict_refuses_a_missing_collision_mesh_but_never_a_missing_visual_one() {
    let strict = ReadOptions { strict: true, ..ReadOptions::default() };
    let read = |shape: &str| {
        let urdf = format!(
            "<robot name='r'><link name='a'>{BODY}<{shape}><geometry><mesh filename='m.stl'/></geometry></{shape}>\
             </link></robot>"
        );
        read(urdf.as_bytes(), &Files::default(), &strict)
    };
    assert!(read("collision").unwrap_err().message.contains("is not found"));
    assert_eq!(warnings(&read("visual").unwrap().1).len(), 1);
}

#[test]
fn a_mesh_is_read_with_its_scale_and_equal_files_are_one_asset() {
    let stl = binary(&tetrahedron(), "made here");
    let files = Files::default().with("a.STL", stl.clone()).with("b.stl", stl);
    let shapes =
        ["<mesh filename='a.STL' scale='-1 1 1'/>", "<mesh filename='b.stl'/>"].map(collision).concat();
    let (link, report) = link(&shapes, &files);
    let [first, second] = &link.collisions[..] else { panic!("two shapes") };
    let (Geometry::Mesh { scale, asset: Some(a), .. }, Geometry::Mesh { asset: Some(b), .. }) =
        (&first.geometry, &second.geometry)
    else {
        panic!("two meshes: {report:?}")
    };
    assert!(Arc::ptr_eq(a, b));
    assert_eq!(*scale, DVec3::new(-1.0, 1.0, 1.0));
    assert_eq!((a.vertices.len(), a.triangles.len()), (4, 4));
}

#[test]
fn a_mesh_that_cannot_be_read_is_reported_once_for_each_use() {
    let files = Files::default().with("a.ply", "ply").with("b.stl", "rubbish");
    let shapes = ["<mesh filename='a.ply'/>", "<mesh filename='b.stl'/>", "<mesh filename='b.stl'/>"];
    let (_, report) = link(&shapes.map(collision).concat(), &files);
    let expected = [
        "mesh \"a.ply\" is not read: .ply files are not read; convert it to STL, OBJ, COLLADA or glTF; it touches nothing",
        "mesh \"b.stl\" is not read: not an STL: it has only 7 bytes; it touches nothing",
    ];
    assert_eq!(warnings(&report), expected);
}

#[test]
fn a_colour_is_the_visuals_own_or_that_of_the_material_it_names() {
    let urdf = "<robot name='r'><material name='blue'><color rgba='0 0 1 0.5'/></material><link name='a'>\
        <visual><geometry><sphere radius='1'/></geometry><material name=''><color rgba='1 0 0 1'/></material></visual>\
        <visual><geometry><sphere radius='1'/></geometry><material name='blue'/></visual>\
        <visual><geometry><sphere radius='1'/></geometry><material name='blue'><color rgba='0 1 0 1'/></material></visual>\
        <visual><geometry><sphere radius='1'/></geometry></visual>\
        <visual><geometry><sphere radius='1'/></geometry><material><texture/></material></visual>\
        </link></robot>";
    let (model, report) = robot(urdf);
    let colors: Vec<_> = model.links[0].visuals.iter().map(|visual| visual.color).collect();
    let expected =
        [Some([1.0, 0.0, 0.0, 1.0]), Some([0.0, 0.0, 1.0, 0.5]), Some([0.0, 1.0, 0.0, 1.0]), None, None];
    assert_eq!(colors, expected);
    assert_eq!(warnings(&report), [""; 0]);
}

#[test]
fn a_material_that_is_nowhere_defined_leaves_the_default_colour() {
    let (link, report) = link(&visual("<sphere radius='1'/>", "<material name='mauve'/>"), &Files::default());
    assert_eq!(link.visuals[0].color, None);
    assert_eq!(find(&report, "no colour is defined for \"mauve\"").severity, Severity::Info);
}

#[test]
fn a_colour_out_of_range_is_cut() {
    let material = "<material name='m'><color rgba='255 -1 0.5 1'/></material>";
    let (link, report) = link(&visual("<sphere radius='1'/>", material), &Files::default());
    assert_eq!(link.visuals[0].color, Some([1.0, 0.0, 0.5, 1.0]));
    find(&report, "is cut to 0 to 1");
}

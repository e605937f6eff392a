//! COLLADA files, valid and broken.

use glamx::DVec3;

use crate::limits;
use crate::mesh::Beside;
use crate::mesh::parse as parse_by_name;

type Read = Result<(Vec<DVec3>, Vec<[u32; 3]>), String>;

fn parse(text: &str) -> Read {
    parse_by_name("a.DAE", text.as_bytes())
}

/// Returns a file with an asset, libraries and a scene.
fn file(asset: &str, libraries: &str, nodes: &str) -> String {
    format!(
        r##"<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset>{asset}</asset>
<library_geometries>{libraries}</library_geometries>
<library_visual_scenes><visual_scene id="scene">{nodes}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>"##
    )
}

/// Returns a square in the plane z = 0 from 0 to 1, with faces as given.
fn square(faces: &str) -> String {
    geometry("0 0 0 1 0 0 1 1 0 0 1 0", r#"count="4" stride="3""#, faces)
}

fn geometry(array: &str, accessor: &str, faces: &str) -> String {
    format!(
        r##"<geometry id="g"><mesh>
<source id="p"><float_array id="a" count="12">{array}</float_array><technique_common>
<accessor source="#a" {accessor}><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>{faces}</mesh></geometry>"##
    )
}

const TRIANGLES: &str = r##"<triangles count="2"><input semantic="VERTEX" source="#v" offset="0"/>
<p>0 1 2 0 2 3</p></triangles>"##;
const INSTANCE: &str = r##"<node><instance_geometry url="#g"/></node>"##;

/// Returns the corners of all triangles, one after another.
fn corners(read: &(Vec<DVec3>, Vec<[u32; 3]>)) -> Vec<DVec3> {
    read.1.iter().flatten().map(|&corner| read.0[corner as usize]).collect()
}

fn why(text: &str) -> String {
    parse(text).unwrap_err()
}

#[test]
fn triangles_are_read_in_the_files_own_axes() {
    for asset in ["", "<up_axis>Y_UP</up_axis>", "<up_axis>Z_UP</up_axis>"] {
        let read = parse(&file(asset, &square(TRIANGLES), INSTANCE)).unwrap();
        assert_eq!(read.0, [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]].map(DVec3::from_array));
        assert_eq!(read.1, [[0, 1, 2], [0, 2, 3]]);
    }
}

#[test]
fn the_unit_makes_metres() {
    let read = parse(&file(r#"<unit name="inch" meter="0.0254"/>"#, &square(TRIANGLES), INSTANCE)).unwrap();
    assert_eq!(read.0[2], DVec3::new(0.0254, 0.0254, 0.0));
    for meter in ["0", "-1", "nan", "x"] {
        let asset = format!(r#"<unit meter="{meter}"/>"#);
        assert!(why(&file(&asset, &square(TRIANGLES), INSTANCE)).starts_with("line 3: "), "{meter}");
    }
}

#[test]
fn polylists_polygons_fans_and_strips_become_triangles() {
    let input = r##"<input semantic="VERTEX" source="#v" offset="0"/>"##;
    for (faces, expected) in [
        ("<polylist>INPUT<vcount>4</vcount><p>0 1 2 3</p></polylist>", vec![[0, 1, 2], [0, 2, 3]]),
        (
            "<polylist>INPUT<vcount>3 2 1 0 3</vcount><p>0 1 2 0 1 0 0 2 3</p></polylist>",
            vec![[0, 1, 2], [0, 2, 3]],
        ),
        (
            "<polygons>INPUT<p>0 1 2</p><ph><p>0 2 3</p><h>1 2 3</h></ph></polygons>",
            vec![[0, 1, 2], [0, 2, 3]],
        ),
        ("<trifans>INPUT<p>0 1 2 3</p></trifans>", vec![[0, 1, 2], [0, 2, 3]]),
        ("<tristrips>INPUT<p>0 1 3 2</p></tristrips>", vec![[0, 1, 3], [3, 1, 2]]),
        ("<lines>INPUT<p>0 1</p></lines><triangles>INPUT<p>1 2 3</p></triangles>", vec![[0, 1, 2]]),
    ] {
        let read = parse(&file("", &square(&faces.replace("INPUT", input)), INSTANCE)).unwrap();
        assert_eq!(read.1, expected, "{faces}");
    }
}

#[test]
fn the_corners_index_is_taken_from_among_the_inputs() {
    let faces = r##"<triangles count="1"><input semantic="NORMAL" source="#n" offset="0"/>
<input semantic="VERTEX" source="#v" offset="1"/><input semantic="TEXCOORD" source="#t" offset="2"/>
<p>9 1 9 9 2 9 9 3 9</p></triangles>"##;
    let read = parse(&file("", &square(faces), INSTANCE)).unwrap();
    assert_eq!(read.0, [[1., 0., 0.], [1., 1., 0.], [0., 1., 0.]].map(DVec3::from_array), "and no others");
}

#[test]
fn an_accessor_has_an_offset_a_stride_and_names() {
    let array = "7 1 2 3 8 4 5 6 8 7 8 9";
    let faces = TRIANGLES.replace("0 1 2 0 2 3", "0 1 2");
    let of = |accessor: &str| parse(&file("", &geometry(array, accessor, &faces), INSTANCE));
    // The last stride may end with the array.
    let read = of(r#"count="3" offset="1" stride="4""#).unwrap();
    assert_eq!(read.0, [[1., 2., 3.], [4., 5., 6.], [7., 8., 9.]].map(DVec3::from_array));
    let turned = geometry(array, r#"count="3" offset="1" stride="4""#, &faces)
        .replace("\"X\"", "\"Q\"")
        .replace("\"Z\"", "\"X\"")
        .replace("\"Q\"", "\"Z\"");
    let read = parse(&file("", &turned, INSTANCE)).unwrap();
    assert_eq!(read.0[0], DVec3::new(3.0, 2.0, 1.0));
    assert!(of(r#"count="3" stride="5""#).unwrap_err().contains("3 corners; its array has fewer"));
    assert!(of(r#"count="4294967295" stride="3""#).unwrap_err().contains("its array has fewer"));
    assert!(of(r#"count="1" offset="18446744073709551615""#).unwrap_err().contains("fewer"));
    assert!(of(r#"count="3" stride="2""#).unwrap_err().contains("stride of 2"));
    assert!(of(r#"count="1" stride="18446744073709551615""#).unwrap_err().contains("corner 1 of 1"));
}

#[test]
fn transforms_of_nodes_are_multiplied_in_their_order() {
    let nodes = r##"<node><translate>10 0 0</translate><rotate>0 0 1 90</rotate><scale>2 2 2</scale>
<node><matrix>1 0 0 1  0 1 0 0  0 0 1 5  0 0 0 1</matrix><instance_geometry url="#g"/></node></node>"##;
    let read = parse(&file(r#"<unit meter="0.5"/>"#, &square(TRIANGLES), nodes)).unwrap();
    // (0, 0, 0) -> matrix (1, 0, 5) -> scale (2, 0, 10) -> rotate (0, 2, 10) -> translate (10, 2, 10).
    let off = (read.0[0] - DVec3::new(5.0, 1.0, 5.0)).length();
    assert!(off < 1e-12, "{:?}", read.0[0]);
}

#[test]
fn nodes_and_geometries_may_be_used_again() {
    let nodes = r##"<node id="part"><instance_geometry url="#g"/></node>
<node><translate>0 0 1</translate><instance_node url="#part"/><instance_geometry url="#g"/></node>"##;
    let read = parse(&file("", &square(TRIANGLES), nodes)).unwrap();
    assert_eq!((read.0.len(), read.1.len()), (12, 6));
    assert_eq!(corners(&read).iter().filter(|corner| corner.z == 1.0).count(), 12);
}

#[test]
fn a_skin_stands_where_it_was_bound() {
    let controllers = r##"<controller id="c"><skin source="#g">
<bind_shape_matrix>1 0 0 0 0 1 0 0 0 0 1 3 0 0 0 1</bind_shape_matrix></skin></controller>"##;
    let nodes = r##"<node><translate>9 9 9</translate><instance_controller url="#c"/></node>"##;
    let libraries = square(TRIANGLES) + controllers;
    let read = parse(&file("", &libraries, nodes)).unwrap();
    assert_eq!(read.0[0], DVec3::new(0.0, 0.0, 3.0));
}

#[test]
fn without_a_scene_all_geometries_are_read() {
    let text = file("", &square(TRIANGLES), "").replace("<scene>", "<other>").replace("</scene>", "</other>");
    assert_eq!(why(&text), "it has no triangles", "the first visual scene shows nothing");
    let text = text.replace("visual_scene ", "nothing ").replace("</visual_scene>", "</nothing>");
    assert_eq!(parse(&text).unwrap().1.len(), 2);
}

#[test]
fn a_mark_at_the_start_and_latin_letters_do_no_harm() {
    let text = file("<author>X</author>", &square(TRIANGLES), INSTANCE);
    let with_mark = [b"\xEF\xBB\xBF".as_slice(), text.as_bytes()].concat();
    assert!(parse_by_name("a.dae", &with_mark).is_ok());
    let mut latin = text.into_bytes();
    let letter = latin.iter().position(|byte| *byte == b'X').unwrap();
    latin[letter] = 0xFC;
    assert!(parse_by_name("a.dae", &latin).is_ok());
}

#[test]
fn faults_are_named_with_their_line() {
    let good = file("", &square(TRIANGLES), INSTANCE);
    assert!(parse(&good).is_ok());
    for (from, to, reason) in [
        ("0 2 3</p>", "0 2 4</p>", "line 9: a face names corner 4 of 4, counted from 0"),
        ("0 2 3</p>", "0 2</p>", "line 9: the last face has too few corners"),
        ("0 2 3</p>", "0 2 -1</p>", "line 9: \"-1\" is not a whole number that fits"),
        ("1 0 0 1 1 0", "1 0 nan 1 1 0", "line 5: \"nan\" is not a finite number"),
        ("1 0 0 1 1 0", "1 0 0,5 1 1 0", "line 5: \"0,5\" is not a finite number"),
        ("1 0 0 1 1 0", "1 0 0 1 1", "line 6: the accessor says 4 corners; its array has fewer"),
        ("float_array", "Name_array", "line 6: \"#a\" refers to no <float_array>"),
        ("url=\"#g\"", "url=\"#h\"", "line 10: \"#h\" refers to no <geometry>"),
        (
            "url=\"#g\"",
            "url=\"../b.dae#g\"",
            "line 10: \"../b.dae#g\" refers to another file, which simd does not open",
        ),
        ("url=\"#g\"", "", "line 10: <instance_geometry> has no url"),
        ("VERTEX", "NORMAL", "line 8: faces without an input VERTEX"),
        ("COLLADA", "robot", "line 2: it is not COLLADA: its root is \"robot\""),
        ("<asset>", "<asset", "its XML is not valid: "),
        ("<node>", "<node><matrix>1 2</matrix>", "line 10: <matrix> has 2 numbers instead of 16"),
        ("<node>", "<node><lookat>1</lookat>", "line 10: <lookat> is not supported"),
        ("<node>", "<node><scale>1e300 1 1</scale><scale>1e300 1 1</scale>", "a corner is not finite"),
        ("<node>", "<node><scale>1e19 1 1</scale>", "a corner is further than 1e18 away"),
    ] {
        let text = good.replace(from, to);
        assert_ne!(text, good, "{from}");
        let why = why(&text);
        assert!(why.starts_with(reason), "{from} {to}: {why}");
    }
}

#[test]
fn nodes_that_hold_themselves_are_refused() {
    let nodes = r##"<node id="n"><instance_node url="#n"/></node>"##;
    assert!(why(&file("", "", nodes)).contains("or contain themselves"));
    let nodes =
        r##"<node id="a"><instance_node url="#b"/></node><node id="b"><instance_node url="#a"/></node>"##;
    assert!(why(&file("", "", nodes)).contains("or contain themselves"));
}

#[test]
fn nodes_that_double_at_each_level_are_refused() {
    let mut nodes = String::new();
    for level in 0..60 {
        let next = format!("<instance_node url=\"#n{}\"/>", level + 1);
        nodes += &format!("<node id=\"n{level}\">{next}{next}</node>");
    }
    nodes += "<node id=\"n60\"><instance_geometry url=\"#g\"/></node>";
    let why = why(&file("", &square(TRIANGLES), &nodes));
    assert!(why.contains("again") || why.contains("so often"), "{why}");
}

#[test]
fn a_long_array_that_is_read_repeatedly_is_refused() {
    let array = "0 ".repeat(400_000);
    let source = format!("<source id=\"s\"><float_array id=\"a\">{array}</float_array></source>");
    let mut libraries = format!("<geometry>{source}</geometry>");
    let mut nodes = String::new();
    for n in 0..1000 {
        libraries += &format!(
            r##"<geometry id="g{n}"><mesh><source id="s{n}"><technique_common><accessor source="#a"
count="100000"/></technique_common></source><triangles><input semantic="POSITION" source="#s{n}"/>
<p>0 1 2</p></triangles></mesh></geometry>"##
        );
        nodes += &format!("<node><instance_geometry url=\"#g{n}\"/></node>");
    }
    assert!(why(&file("", &libraries, &nodes)).contains("walks over more than"));
}

#[test]
fn a_mesh_of_many_instances_ends_at_the_limit_of_triangles() {
    let faces = TRIANGLES.replace("0 1 2 0 2 3", &"0 1 2 ".repeat(20_000));
    let most = limits::MESH_TRIANGLES / 20_000;
    let at = file("", &square(&faces), &INSTANCE.repeat(most));
    assert_eq!(parse(&at).unwrap().1.len(), limits::MESH_TRIANGLES);
    let beyond = file("", &square(&faces), &INSTANCE.repeat(most + 1));
    assert_eq!(why(&beyond), "it has more than 2000000 triangles");
}

#[test]
fn deep_wide_and_long_files_are_refused() {
    let deep = |levels: usize| {
        let nodes = "<extra>".repeat(levels) + &"</extra>".repeat(levels) + INSTANCE;
        parse(&file("", &square(TRIANGLES), &nodes))
    };
    // The root, its library and the scene surround them.
    let most = limits::XML_DEPTH - 3;
    assert!(deep(most).is_ok());
    assert!(deep(most + 1).unwrap_err().contains("nested deeper than 100 levels"));
    assert!(deep(50_000).unwrap_err().contains("nested deeper"));
    let wide = |attributes: usize| {
        let all: String = (0..attributes).map(|n| format!(" a{n}=\"\"")).collect();
        parse(&file("", &square(TRIANGLES), &format!("{INSTANCE}<extra{all}/>")))
    };
    assert!(wide(limits::XML_ATTRIBUTES).is_ok());
    assert!(wide(limits::XML_ATTRIBUTES + 1).unwrap_err().contains("some 129 attributes"));
    let good = file("", &square(TRIANGLES), INSTANCE);
    let long = |bytes: usize| parse(&(good.clone() + &"\n".repeat(bytes - good.len())));
    assert!(long(limits::COLLADA_BYTES).is_ok());
    assert!(long(limits::COLLADA_BYTES + 1).unwrap_err().contains("the limit for COLLADA is 67108864"));
    let doctype = good.replace("<COLLADA", "<!DOCTYPE a [<!ENTITY b \"c\">]><COLLADA");
    assert!(why(&doctype).contains("DTD"));
    assert!(why("").contains("no root element"));
}

#[test]
fn no_cut_file_is_read_in_part() {
    let good = file("", &square(TRIANGLES), INSTANCE);
    for end in 0..good.len() {
        assert!(parse(&good[..end]).is_err(), "{end}");
    }
}

/// Two triangles with two materials: the scene binds one to red and one to a texture.
#[test]
fn triangles_have_the_colours_of_their_materials() {
    let faces = |material: &str, p: &str| {
        format!(
            r##"<triangles material="{material}" count="1"><input semantic="VERTEX" source="#v" offset="0"/>
            <p>{p}</p></triangles>"##
        )
    };
    let effect = |id: &str, diffuse: &str| {
        format!(
            r##"<effect id="{id}"><profile_COMMON><technique><lambert><diffuse>{diffuse}</diffuse></lambert>
            </technique></profile_COMMON></effect>"##
        )
    };
    let bind = |symbol: &str, target: &str| {
        format!(r##"<instance_material symbol="{symbol}" target="#{target}"/>"##)
    };
    let geometry = square(&(faces("skin", "0 1 2") + &faces("none", "0 1 3") + &faces("eye", "0 2 3")));
    let libraries = format!(
        r##"{geometry}</library_geometries><library_effects>{}{}</library_effects><library_materials>
        <material id="m1"><instance_effect url="#e1"/></material><material id="m2"><instance_effect url="#e2"/>
        </material></library_materials><library_geometries>"##,
        effect("e1", "<color>1 0.5 -3 1</color>"),
        effect("e2", "<texture/>"),
    );
    let node = |bound: String| {
        format!(
            r##"<node><instance_geometry url="#g"><bind_material><technique_common>{bound}
            </technique_common></bind_material></instance_geometry></node>"##
        )
    };
    let nodes = node(bind("skin", "m1") + &bind("eye", "m2")) + &node(bind("eye", "m1")) + INSTANCE;
    let text = file("", &libraries, &nodes);
    let read = crate::mesh::read("a.dae", text.as_bytes(), &Beside::default()).unwrap();
    let ((_, triangles), paints) = (read.triangles, read.paints);
    assert_eq!(triangles.len(), 9);
    let red = Some([1.0, 0.5, 0.0]);
    let painted: Vec<_> = paints.iter().map(|paint| (paint.first, paint.color)).collect();
    assert_eq!(painted, [(0, red), (1, None), (5, red), (6, None)]);
    // A broken reference gives no colour, and is not a reason to refuse the rest.
    for (from, to) in [("#m1", "#lost"), ("1 0.5 -3 1", "1 0.5"), ("url=\"#e1\"", ""), ("#e1", "#e2")] {
        let broken = text.replace(from, to);
        let paints = crate::mesh::read("a.dae", broken.as_bytes(), &Beside::default()).unwrap().paints;
        assert!(paints.iter().all(|paint| paint.color.is_none()), "{from}");
    }
}

/// Each of many parts has the same material with many children: visiting them for each part would take
/// minutes.
#[test]
fn a_material_of_many_parts_is_looked_through_once() {
    let faces = r##"<triangles material="s" count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>"##;
    let geometry = square(&faces.repeat(40_000));
    let filling = "<a/>".repeat(150_000);
    let libraries = format!(
        r##"{geometry}</library_geometries><library_effects><effect id="e"><profile_COMMON><technique><lambert><diffuse>
        <color>1 0 0 1</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects><library_materials>
        <material id="m">{filling}<instance_effect url="#e"/></material></library_materials><library_geometries>"##
    );
    let nodes = r##"<node><instance_geometry url="#g"><bind_material><technique_common>
        <instance_material symbol="s" target="#m"/></technique_common></bind_material></instance_geometry></node>"##;
    let text = file("", &libraries, nodes);
    let read = crate::mesh::read("a.dae", text.as_bytes(), &Beside::default()).unwrap();
    assert_eq!((read.triangles.1.len(), read.paints.len()), (40_000, 1));
    assert_eq!(read.paints[0].color, Some([1.0, 0.0, 0.0]));
}

//! Descriptions with other addresses of their meshes.

use crate::limits::LoadLimits;
use crate::setup::NamedState;
use crate::urdf::{describe, readdress, with_states};

/// Returns the text with each mesh at `/assets/` and its number.
fn rewritten(urdf: &[u8]) -> String {
    let known = describe(urdf, &LoadLimits::default()).unwrap().asset_uris;
    let address = |uri: &str| known.iter().position(|at| at == uri).map(|n| format!("/assets/{n}.stl"));
    readdress(urdf, &LoadLimits::default(), &address).unwrap()
}

#[test]
fn only_the_file_names_of_meshes_change() {
    let urdf = r#"<robot name="r"> <!-- filename="a.stl" -->
  <link name="l" filename="a.stl">
    <visual><geometry><mesh scale="1 2 3"   filename = 'a &amp; b.stl'/></geometry></visual>
    <collision><geometry><mesh filename="a.stl" scale="1 1 1"/></geometry></collision>
    <visual><geometry><mesh filename="a &amp; b.stl"/></geometry></visual>
    <sensor><mesh filename="a.stl"/></sensor>
  </link>
</robot>
"#;
    let expected = urdf
        .replace("filename = 'a &amp; b.stl'", "filename=\"/assets/0.stl\"")
        .replace("mesh filename=\"a &amp; b.stl\"", "mesh filename=\"/assets/0.stl\"")
        .replace("geometry><mesh filename=\"a.stl\"", "geometry><mesh filename=\"/assets/1.stl\"");
    assert_eq!(rewritten(urdf.as_bytes()), expected);
}

#[test]
fn the_content_of_an_address_is_escaped() {
    let urdf = r#"<robot name="r"><link name="l"><visual><geometry><mesh filename="a"/></geometry></visual></link></robot>"#;
    let hostile = "\"/><evil a='&amp;'>\n\u{e4}";
    let text = readdress(urdf.as_bytes(), &LoadLimits::default(), &|_| Some(hostile.to_owned())).unwrap();
    assert_eq!(describe(text.as_bytes(), &LoadLimits::default()).unwrap().asset_uris, [hostile]);
    let kept = readdress(urdf.as_bytes(), &LoadLimits::default(), &|_| None).unwrap();
    assert_eq!(kept, urdf);
}

#[test]
fn text_in_another_encoding_is_utf_8_afterwards() {
    let urdf = "<?xml version=\"1.0\" encoding=\"utf-16\"?>\n<robot name=\"\u{e4}\"><link name=\"l\"><visual>\
                <geometry><mesh filename=\"\u{fc}.stl\"/></geometry></visual></link></robot>";
    let wide: Vec<u8> =
        std::iter::once(0xfeff).chain(urdf.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let text = rewritten(&wide);
    assert!(text.contains("name=\"\u{e4}\"") && text.contains("filename=\"/assets/0.stl\""), "{text}");
    assert!(!text.contains("utf-16"));
    assert_eq!(describe(text.as_bytes(), &LoadLimits::default()).unwrap().asset_uris, ["/assets/0.stl"]);
}

#[test]
fn states_that_are_added_are_read_again_and_lines_stay() {
    let urdf = super::one_joint("continuous", "");
    let (model, _) = super::robot(&urdf);
    let home =
        |name: &str| NamedState { name: name.into(), group: "g \"&".into(), positions: vec![(0, -0.25)] };
    let states = [home("home"), home("<away>")];
    let text = with_states(urdf.as_bytes(), &LoadLimits::default(), &model, &states).unwrap();
    assert_eq!(text.lines().count(), urdf.lines().count());
    let (again, report) = super::robot(&text);
    assert_eq!(again.setup.states, states);
    assert_eq!(super::warnings(&report), [""; 0]);
    let none = with_states(urdf.as_bytes(), &LoadLimits::default(), &model, &[]);
    assert_eq!(none, None);
    let tight = LoadLimits { urdf_bytes: urdf.len() + 10, ..LoadLimits::default() };
    assert_eq!(with_states(urdf.as_bytes(), &tight, &model, &states), None, "too large to be read again");
}
